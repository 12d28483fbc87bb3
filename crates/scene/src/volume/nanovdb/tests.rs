use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::volume::tests::{BUDGET, apply, assert_valid, damage, damaged_cases, indices};

/// What `fixtures/make_nanovdb.cc` made with NanoVDB.
const ZIP: &[u8] = include_bytes!("../fixtures/zip.nvdb");
const BLOSC: &[u8] = include_bytes!("../fixtures/blosc.nvdb");
const TYPES: &[u8] = include_bytes!("../fixtures/types.nvdb");

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
    check_values(grid, shift, tolerance, value);
}

fn check_values(grid: &Grid, shift: i64, tolerance: f32, value: impl Fn([i64; 3]) -> f32) {
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
fn every_compression() {
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
fn every_type_of_value() {
    let names = ["integers", "double", "color.x", "color.y", "color.z", "fp4", "fp8", "fpn", "widths"];
    assert_eq!(nanovdb_grid_names(TYPES).unwrap(), names);
    let read = |name| read_nanovdb(TYPES, name, BUDGET).unwrap();
    check(&read("double"), 0, 0.0);
    for (name, factor) in [("color.x", 1.0), ("color.y", 0.5), ("color.z", -1.0)] {
        check_values(&read(name), 0, 0.0, |at| factor * value(at));
    }
    // No leaf has values further apart than -1 and 35; what is quantised is off by half a quantum.
    check(&read("fp4"), 0, 0.5 * 36.0 / 15.0);
    check(&read("fp8"), 0, 0.5 * 36.0 / 255.0);
    check(&read("fpn"), 0, 0.5 * 36.0 / 65535.0);
    // Values that NanoVDB itself prints, at (0, 0, 0), (4, 3, 1), (-3, -2, -3), (1, 0, 0), (9, 5, 7).
    for (name, expected) in [
        ("fp4", [-0.75, 30.7499981, -18.3999996, 1.3499999, 7.0]),
        ("fp8", [-0.00882351398, 30.0088234, -17.7647057, 0.485294104, 7.0]),
        ("fpn", [-0.000171661377, 30.0001717, -17.7498741, 0.50019455, 7.0f64]),
    ] {
        let grid = read(name);
        let found =
            [[4, 3, 5], [8, 6, 6], [1, 1, 2], [5, 3, 5], [13, 8, 12]].map(|[i, j, k]: [u32; 3]| grid.value(i, j, k));
        assert_eq!(found, expected.map(|value| value as f32), "{name}");
    }
}

/// Five leaves, of 1, 2, 4, 8 and 16 bits, as NanoVDB chose and lists them.
#[test]
fn every_width_of_codes() {
    let grid = read_nanovdb(TYPES, "widths", BUDGET).unwrap();
    assert_eq!(grid.dims, [42, 10, 10]);
    for at in indices([40, 8, 8]) {
        let [x, y, z] = at;
        let steps = [2, 4, 16, 256, 512][x as usize / 8];
        let expected = ((64 * (x % 8) + 8 * y + z) % steps) as f32;
        // Half a quantum, and the rounding of floats up to 512.
        let tolerance = if steps == 512 { 0.5 * 511.0 / 65535.0 + 6e-5 } else { 6e-5 };
        let found = grid.value(x + 1, y + 1, z + 1);
        assert!((found - expected).abs() <= tolerance, "{at:?}: {found} is not {expected}");
    }
}

/// A grid of 16-bit floats, which NanoVDB's own tools do not write: one leaf of n / 4 for voxel n, and an active tile of 5
/// above it; background 3. Laid out by hand after PNanoVDB's table of constants.
fn half_floats() -> Vec<u8> {
    const ROOT: usize = 672 + 64;
    const UPPER: usize = ROOT + 64 + 32;
    const LOWER: usize = UPPER + 270_400;
    const LEAF: usize = LOWER + 33_856;
    let mut memory = vec![0; LEAF + 1120];
    let mut put = |at: usize, bytes: &[u8]| memory[at..at + bytes.len()].copy_from_slice(bytes);
    let half = |value: f32| half::f16::from_f32(value).to_le_bytes();
    for axis in 0..3 {
        put(384 + 32 * axis, &1f64.to_le_bytes());
    }
    put(636, &9u32.to_le_bytes());
    put(672 + 24, &64u64.to_le_bytes());
    put(ROOT + 24, &1u32.to_le_bytes());
    put(ROOT + 28, &half(3.0));
    put(ROOT + 64 + 8, &((UPPER - ROOT) as u64).to_le_bytes());
    put(UPPER + 32 + 4096, &[1]);
    put(UPPER + 8256, &((LOWER - UPPER) as u64).to_le_bytes());
    put(LOWER + 32, &[2]);
    put(LOWER + 32 + 512, &[1]);
    put(LOWER + 1088, &((LEAF - LOWER) as u64).to_le_bytes());
    put(LOWER + 1088 + 8, &half(5.0));
    put(LEAF + 16, &[255; 64]);
    for voxel in 0..512 {
        put(LEAF + 96 + 2 * voxel, &half(voxel as f32 / 4.0));
    }
    memory
}

#[test]
fn half_floats_by_hand() {
    let grid = in_memory(Bytes(&half_floats()), None, BUDGET).unwrap();
    assert_eq!(grid.dims, [10, 10, 18]);
    for [x, y, z] in indices(grid.dims) {
        let inside = (1..=8).contains(&x) && (1..=8).contains(&y) && (1..=16).contains(&z);
        let expected = match z {
            _ if !inside => 3.0,
            9.. => 5.0,
            _ => (64 * (x - 1) + 8 * (y - 1) + z - 1) as f32 / 4.0,
        };
        assert_eq!(grid.value(x, y, z), expected, "{x} {y} {z}");
    }
}

#[test]
fn numbers_beyond_single_precision_are_named() {
    let descriptor = &descriptors(TYPES).unwrap()[1];
    let mut memory = descriptor.unpack(BUDGET).unwrap();
    let end = memory.len();
    memory[end - 8..].copy_from_slice(&1e300f64.to_le_bytes());
    let error = in_memory(Bytes(&memory), None, BUDGET).unwrap_err();
    assert!(matches!(error, VolumeError::NotFinite { value: 1e300, .. }), "{error}");
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
    let accepted = "accepted: Float, Double, Vec3f, Half, Fp4, Fp8, Fp16, FpN";
    assert_eq!(
        message(TYPES, "integers", BUDGET.0),
        format!("unsupported: a NanoVDB grid of type 4 (Int32); {accepted}")
    );
    for (kind, name) in [(8, "8 (Mask)"), (11, "11 (Boolean)"), (23, "23 (PointIndex)"), (99, "99")] {
        let other = patched(plain(), HEADER + DESCRIPTOR + 8 + 636, &[kind]);
        let expected = format!("unsupported: a NanoVDB grid of type {name}; {accepted}");
        assert_eq!(message(&other, "density", BUDGET.0), expected);
    }
    let names =
        "\"integers\", \"double\", \"color.x\", \"color.y\", \"color.z\", \"fp4\", \"fp8\", \"fpn\", \"widths\"";
    assert_eq!(
        message(TYPES, "color", BUDGET.0),
        format!("found no grid named \"color\"; accepted: the grids {names}")
    );
    let vectors = patched(plain(), HEADER + DESCRIPTOR + 8 + 636, &[6]);
    assert!(message(&vectors, "density", BUDGET.0).contains("a grid is of type 6, and its file says of another"));
    let numbers = patched(plain(), HEADER + 32, &[6]);
    assert!(message(&numbers, "density.y", BUDGET.0).contains("a grid is of type 1, and its file says of another"));
}

fn survive(bytes: &[u8]) {
    let start = std::time::Instant::now();
    for name in nanovdb_grid_names(bytes).unwrap_or_default() {
        if let Ok(grid) = read_nanovdb(bytes, &name, BUDGET) {
            assert_valid(&grid, BUDGET);
        }
    }
    assert!(start.elapsed().as_secs_f32() < 4.0, "took {:?}", start.elapsed());
}

#[test]
fn every_truncation_is_an_error() {
    for (bytes, name) in [(ZIP, "density"), (BLOSC, "quantised"), (TYPES, "widths")] {
        for cut in 0..bytes.len() {
            assert!(read_nanovdb(&bytes[..cut], name, BUDGET).is_err(), "cut at {cut}");
        }
    }
}

/// Grids that end before their nodes do: at every byte of their own data and of their root, and at others.
#[test]
fn every_grid_that_ends_early_is_an_error() {
    let mut grids: Vec<_> = descriptors(TYPES).unwrap()[1..]
        .iter()
        .map(|descriptor| (descriptor.unpack(BUDGET).unwrap(), descriptor.component))
        .collect();
    // NanoVDB leaves more room behind leaves of type FpN than it needs.
    for (grid, end) in [(6, 2_443_552), (7, 307_552)] {
        grids[grid].0.truncate(end);
    }
    grids.push((half_floats(), None));
    for (memory, component) in grids {
        let few = (900..memory.len()).step_by(10_007).chain(memory.len() - 20..memory.len());
        for cut in (0..900).chain(few) {
            assert!(in_memory(Bytes(&memory[..cut]), component, BUDGET).is_err(), "cut at {cut}");
        }
    }
}

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged_files_give_errors_or_grids(which in 0..4usize, damage in damage()) {
        let mut bytes = vec![ZIP.to_vec(), BLOSC.to_vec(), plain(), TYPES.to_vec()].swap_remove(which);
        apply(&mut bytes, &damage);
        survive(&bytes);
    }

    #[test]
    fn damaged_grids_give_errors_or_grids(which in 0..10usize, damage in damage()) {
        let descriptors = descriptors(TYPES).unwrap();
        let (mut memory, component) = match descriptors.get(which) {
            Some(descriptor) => (descriptor.unpack(BUDGET).unwrap(), descriptor.component),
            None => (half_floats(), None),
        };
        apply(&mut memory, &damage);
        if let Ok(grid) = in_memory(Bytes(&memory), component, BUDGET) {
            assert_valid(&grid, BUDGET);
        }
    }
}
