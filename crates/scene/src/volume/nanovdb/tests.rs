use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::volume::tests::{BUDGET, apply, assert_valid, damage, damaged_cases, indices};

/// What `fixtures/make_nanovdb.cc` made with NanoVDB.
const ZIP: &[u8] = include_bytes!("../fixtures/zip.nvdb");
const BLOSC: &[u8] = include_bytes!("../fixtures/blosc.nvdb");

/// The value of a voxel as the fixtures are made; index before the shift.
fn value([x, y, z]: [i64; 3]) -> f32 {
    let within = |n: i64, low, high| (low..=high).contains(&n);
    if within(x, 8, 15) && within(y, 0, 7) && within(z, 0, 7) {
        7.0
    } else if within(x, -3, 4) && within(y, -2, 3) && within(z, -4, 1) && (x + y + z) % 2 == 0 {
        0.25 * x as f32 + 10.0 * y as f32 - z as f32
    } else {
        0.5
    }
}

fn check(grid: &Grid, shift: i64, tolerance: f32) {
    assert_valid(grid, BUDGET);
    // NanoVDB says that voxels (-3, -2, -4) to (15, 7, 7) are active; around them is one of background.
    assert_eq!(grid.dims, [21, 12, 14]);
    let index = |[i, j, k]: [u32; 3]| [i64::from(i) - 4, i64::from(j) - 3, i64::from(k) - 5];
    for at in indices(grid.dims) {
        let (found, expected) = (grid.value(at[0], at[1], at[2]), value(index(at)));
        assert!((found - expected).abs() <= tolerance, "{:?}: {found} is not {expected}", index(at));
    }
    // As NanoVDB's indexToWorld has it: (4, 3, 1) lies at (1.43, -1.32, 3.4), but for the shift.
    let [x, y, z] = index([20, 10, 3]).map(|n| (n + shift) as f32);
    let expected = Vec3::new(0.1 * x + 0.03 * z + 1.0, 0.02 * x + 0.2 * y - 2.0, 0.4 * z + 3.0);
    let found = grid.world_from_index.transform_point3(Vec3::new(20.0, 10.0, 3.0));
    assert!(found.abs_diff_eq(expected, 1e-5), "{found} is not {expected}");
}

/// The grid of `ZIP` as `Codec::NONE` writes it.
fn plain() -> Vec<u8> {
    let descriptor = &descriptors(ZIP).unwrap()[0];
    let grid = descriptor.unpack(BUDGET).unwrap();
    let mut bytes = ZIP[..HEADER + DESCRIPTOR + "density".len() + 1].to_vec();
    bytes[HEADER + 8..HEADER + 16].copy_from_slice(&(grid.len() as u64).to_le_bytes());
    bytes[HEADER + 168..HEADER + 170].fill(0);
    [bytes, grid].concat()
}

#[test]
fn every_compression_and_type() {
    check(&read_nanovdb(ZIP, "density", BUDGET).unwrap(), 0, 0.0);
    check(&read_nanovdb(&plain(), "density", BUDGET).unwrap(), 0, 0.0);
    check(&read_nanovdb(BLOSC, "density", BUDGET).unwrap(), 16, 0.0);
    let quantised = read_nanovdb(BLOSC, "quantised", BUDGET).unwrap();
    check(&quantised, 16, 1e-3);
    // Values that NanoVDB itself prints.
    for (at, expected) in
        [([0, 0, 0], -0.000171661377), ([4, 3, 1], 30.0001717), ([-3, -2, -3], -17.7498741), ([1, 0, 0], 0.50019455)]
    {
        let [i, j, k] = at.map(i64::from);
        assert_eq!(quantised.value((i + 4) as u32, (j + 3) as u32, (k + 5) as u32), expected as f32, "{at:?}");
    }
}

#[test]
fn refusals_say_what_is_accepted() {
    let message = |bytes: &[u8], name: &str, budget| read_nanovdb(bytes, name, Budget(budget)).unwrap_err().to_string();
    assert_eq!(nanovdb_grid_names(BLOSC).unwrap(), ["density", "quantised"]);
    assert_eq!(
        message(BLOSC, "smoke", 0),
        "found no grid named \"smoke\"; accepted: the grids \"density\", \"quantised\""
    );
    assert_eq!(
        message(b" BDV\0\0\0\0", "a", 0),
        "not a NanoVDB file: it begins with \" BDV\\x00\\x00\\x00\\x00\"; accepted: NanoVDB0 or NanoVDB2, as \
         nanovdb::io::writeGrid makes it"
    );
    assert!(message(b"", "a", 0).starts_with("not a NanoVDB file"));
    let patched = |mut bytes: Vec<u8>, at: usize, value: &[u8]| {
        bytes[at..at + value.len()].copy_from_slice(value);
        bytes
    };
    assert_eq!(
        message(&patched(ZIP.to_vec(), 8, &(28u32 << 21 | 3 << 10).to_le_bytes()), "density", 0),
        "unsupported: a NanoVDB file of version 28.3; accepted: versions 32.x"
    );
    assert_eq!(
        message(&patched(ZIP.to_vec(), HEADER + 168, &[9]), "density", BUDGET.0),
        "unsupported: a grid compressed by codec 9; accepted: 0 (none), 1 (zip), 2 (Blosc)"
    );
    let grid = plain().len() - (HEADER + DESCRIPTOR + 8);
    assert_eq!(
        message(ZIP, "density", 1000),
        format!("unsupported: a grid of {grid} bytes, with a budget of 1000; accepted: one that fits")
    );
    assert!(message(ZIP, "density", grid as u64 + 143).starts_with("a grid of 21 x 12 x 14 voxels needs 144 bytes"));
    assert!(
        message(&patched(ZIP.to_vec(), HEADER, &u64::MAX.to_le_bytes()), "density", u64::MAX).contains("ends at byte")
    );
    let other = patched(plain(), HEADER + DESCRIPTOR + 8 + 636, &[2]);
    assert_eq!(
        message(&other, "density", BUDGET.0),
        "unsupported: a NanoVDB grid of type 2; accepted: 1 (Float), 15 (Fp16)"
    );
}

fn survive(bytes: &[u8]) {
    let start = std::time::Instant::now();
    for name in ["density", "quantised"] {
        if let Ok(grid) = read_nanovdb(bytes, name, BUDGET) {
            assert_valid(&grid, BUDGET);
        }
    }
    assert!(start.elapsed().as_secs_f32() < 4.0, "took {:?}", start.elapsed());
}

#[test]
fn every_truncation_is_an_error() {
    for (bytes, name) in [(ZIP, "density"), (BLOSC, "quantised")] {
        for cut in 0..bytes.len() {
            assert!(read_nanovdb(&bytes[..cut], name, BUDGET).is_err(), "cut at {cut}");
        }
    }
}

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged_files_give_errors_or_grids(which in 0..3usize, damage in damage()) {
        let mut bytes = vec![ZIP.to_vec(), BLOSC.to_vec(), plain()].swap_remove(which);
        apply(&mut bytes, &damage);
        survive(&bytes);
    }
}
