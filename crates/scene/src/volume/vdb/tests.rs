//! The fixtures' formulas stand in fixtures/make.py too.

use std::time::Instant;

use glam::{Mat4, Vec3};
use proptest::prelude::*;

use super::*;
use crate::volume::Voxels;
use crate::volume::tests::{BUDGET, apply, assert_valid, damage, damaged_cases, data, indices};

const CODES: &[u8] = include_bytes!("../fixtures/codes.vdb");
const TILES: &[u8] = include_bytes!("../fixtures/tiles.vdb");
const VECTORS: &[u8] = include_bytes!("../fixtures/vectors.vdb");
const PLAIN: &[u8] = include_bytes!("../fixtures/plain.vdb");
const PLAIN_HALF: &[u8] = include_bytes!("../fixtures/plain_half.vdb");
const ZIP: &[u8] = include_bytes!("../fixtures/zip.vdb");
const ZIP_HALF: &[u8] = include_bytes!("../fixtures/zip_half.vdb");
const OLD: &[u8] = include_bytes!("../fixtures/old.vdb");

fn field([x, y, z]: [i64; 3]) -> f32 {
    (7 * x + 3 * y + 5 * z).rem_euclid(64) as f32 / 4.0 + 0.25
}

/// Holds a grid against its box of active voxels, the voxels, and the world's place of three file indices.
fn check(grid: &Grid, low: [i64; 3], high: [i64; 3], background: f32, value: impl Fn([i64; 3]) -> f32) {
    assert_eq!(grid.dims, [0, 1, 2].map(|axis| (high[axis] - low[axis] + 3) as u32));
    for [i, j, k] in indices(grid.dims) {
        let voxel = [low[0] - 1 + i64::from(i), low[1] - 1 + i64::from(j), low[2] - 1 + i64::from(k)];
        let inside = (0..3).all(|axis| (low[axis]..=high[axis]).contains(&voxel[axis]));
        let expected = if inside { value(voxel) } else { background };
        assert_eq!(grid.value(i, j, k), expected, "voxel {voxel:?}");
    }
}

/// Where the file's index (x, y, z) lies in the world.
fn world(grid: &Grid, low: [i64; 3], index: [i64; 3]) -> Vec3 {
    grid.world_from_index.transform_point3(Vec3::from_array([0, 1, 2].map(|axis| (index[axis] - low[axis] + 1) as f32)))
}

#[test]
fn every_code_of_inactive_values() {
    let grid = read_vdb(CODES, "codes", BUDGET).unwrap();
    let inactive = [[2, 2], [-2, -2], [5, 5], [-2, 2], [5, 2], [5, 7]];
    assert!(matches!(grid.voxels(), Voxels::F32(_)), "thirds are not exact in 16 bits");
    check(&grid, [0; 3], [55, 7, 7], 2.0, |[x, y, z]| {
        let sum = x + y + z;
        match (sum % 3, inactive.get(x as usize / 8)) {
            (0, _) => (f64::from(field([x, y, z])) + 1.0 / 3.0) as f32,
            (_, Some(pair)) => pair[(x + y) as usize % 2] as f32,
            (_, None) => {
                if (x + y) % 2 == 0 {
                    5.0
                } else {
                    sum as f32
                }
            }
        }
    });
    assert_eq!(world(&grid, [0; 3], [2, 4, 6]), Vec3::new(1.0, 2.0, 3.0));
}

#[test]
fn tiles_and_two_root_children() {
    let grid = read_vdb(TILES, "tiles", BUDGET).unwrap();
    assert!(matches!(grid.voxels(), Voxels::F16(_)));
    let low = [-5, -8, -8];
    check(&grid, low, [135, 127, 127], 0.0, |[x, y, z]| {
        if [x, y, z].iter().all(|n| (0..128).contains(n)) {
            1.5
        } else if [x, y, z].iter().all(|&n| n < 0) {
            field([x, y, z])
        } else if x >= 128 && (16..24).contains(&z) {
            match y {
                8..16 => 2.5,
                16..24 => 3.5,
                _ => 0.0,
            }
        } else {
            0.0
        }
    });
    assert_eq!(world(&grid, low, [1, 2, 3]), Vec3::new(0.0, 2.25, 6.0));
}

#[test]
fn vectors_by_component() {
    let names = ["Cd.x", "Cd.y", "Cd.z", "v.x", "v.y", "v.z"];
    assert_eq!(vdb_grid_names(VECTORS).unwrap(), names);
    let inactive = [[2, 2], [-2, -2], [5, 5], [-2, 2], [5, 2], [5, 7]];
    for (i, name) in names.into_iter().enumerate() {
        let pick = |vector: [f32; 3]| vector[i % 3];
        let grid = read_vdb(VECTORS, name, BUDGET).unwrap();
        check(&grid, [0; 3], [55, 15, 7], pick([2.0, -2.0, 1.0]), |[x, y, z]| {
            if y >= 8 {
                return pick(if x < 8 { [3.0, 4.0, 5.0] } else { [2.0, -2.0, 1.0] });
            }
            if (x + y + z) % 3 == 0 {
                return pick([field([x, y, z]), -field([y, z, x]), 2.0 * field([z, x, y])]);
            }
            let off = match inactive.get(x as usize / 8) {
                Some(pair) => pair[(x + y) as usize % 2] as f32,
                None if (x + y) % 2 == 0 => 5.0,
                None => (x + y + z) as f32,
            };
            pick([off, -off, off / 2.0])
        });
    }
    let error = read_vdb(VECTORS, "v", BUDGET).unwrap_err();
    assert!(
        error.to_string().ends_with("accepted: the grids \"Cd.x\", \"Cd.y\", \"Cd.z\", \"v.x\", \"v.y\", \"v.z\""),
        "{error}"
    );
}

#[test]
fn compressions_versions_and_transforms() {
    let scale_translate = Vec3::new(1.5, 4.5, -197.0);
    for (bytes, background, at) in [
        (ZIP, 0.75, scale_translate),
        (ZIP_HALF, 0.0, Vec3::new(0.5, 2.5, -200.0)),
        (PLAIN, -1.0, Vec3::new(2.0, 12.0, 103.0)),
        (PLAIN_HALF, 0.0, Vec3::new(-10.0, 1.0, 100.0)),
        (OLD, 0.75, Vec3::new(1.5, 7.0, 53.0)),
    ] {
        let grid = read_vdb(bytes, "hand", BUDGET).unwrap();
        assert!(matches!(grid.voxels(), Voxels::F16(_)), "every value is exact in 16 bits");
        let (low, high) = ([242, 240, -16], [255, 255, -1]);
        check(&grid, low, high, background, |voxel| {
            let [x, y, z] = voxel.map(|n| n.div_euclid(8) * 8);
            let leaf = matches!([x, y, z], [248, 240, -8] | [240, 240, -8] | [240, 248, -16]);
            let active = voxel[0] % 8 >= 2 && voxel.iter().sum::<i64>().rem_euclid(5) < 3;
            if leaf && active { field(voxel) } else { background }
        });
        assert!(world(&grid, low, [1, 10, 100]).abs_diff_eq(at, 1e-3));
    }
}

#[test]
fn grids_by_name() {
    assert_eq!(vdb_grid_names(CODES).unwrap().len(), 3);
    assert_eq!(vdb_grid_names(TILES).unwrap(), ["tiles"]);
    let empty = read_vdb(CODES, "codes[1]", BUDGET).unwrap();
    assert_eq!((empty.dims, empty.value(0, 0, 0)), ([1; 3], 7.0));
    let error = read_vdb(CODES, "density", BUDGET).unwrap_err();
    assert!(error.to_string().ends_with("accepted: the grids \"codes[0]\", \"codes[1]\", \"mask\""), "{error}");
    let error = read_vdb(CODES, "mask", BUDGET).unwrap_err();
    assert_eq!(
        error.to_string(),
        "unsupported: the grid type Tree_bool_5_4_3; accepted: Tree_float_5_4_3, Tree_vec3s_5_4_3"
    );
}

#[test]
fn refused_before_anything_is_read_or_allocated() {
    assert!(matches!(read_vdb(b"solid", "a", BUDGET), Err(VolumeError::NotVdb { found }) if found == "73 6f 6c 69 64"));
    assert!(matches!(read_vdb(b"", "a", BUDGET), Err(VolumeError::NotVdb { .. })));
    for version in [219u32, 226] {
        let mut bytes = TILES.to_vec();
        bytes[8..12].copy_from_slice(&version.to_le_bytes());
        assert!(matches!(read_vdb(&bytes, "tiles", BUDGET), Err(VolumeError::Unsupported { .. })));
    }
    // Of 143 x 138 x 138 voxels only some bricks are kept: half of what a dense grid would need.
    let bytes = read_vdb(TILES, "tiles", BUDGET).unwrap().bytes();
    assert!(bytes * 2 < 143 * 138 * 138 * 2, "{bytes}");
    let error = read_vdb(TILES, "tiles", Budget(bytes / 2)).unwrap_err();
    assert!(matches!(error, VolumeError::TooLarge { dims: [143, 138, 138], .. }), "{error}");
}

#[test]
fn values_that_are_not_finite_are_named() {
    let mut bytes = PLAIN.to_vec();
    let end = bytes.len();
    bytes[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
    let error = read_vdb(&bytes, "hand", BUDGET).unwrap_err();
    assert!(matches!(error, VolumeError::NotFinite { index: [255, 247, -1], value } if value.is_nan()), "{error}");
}

#[test]
fn blosc_chunks_of_all_codecs() {
    let ramps: Vec<u8> = (0..303u32).flat_map(|i| (i * i).to_le_bytes()).chain(*b"end").collect();
    let noise = || (0..200usize).map(|i| (i * i * 37 / 8 % 251) as u8);
    let runs: Vec<u8> = noise().chain([0; 9000]).chain(noise()).collect();
    let mut cursor = Cursor::new(include_bytes!("../fixtures/chunks.blosc"));
    for content in [&ramps, &ramps, &ramps, &runs, &runs, &runs] {
        let size = cursor.u32("a length").unwrap();
        let chunk = cursor.take(size.into(), "a chunk").unwrap();
        let mut out = vec![0; content.len()];
        blosc::decompress(chunk, &mut out).unwrap();
        assert_eq!(&out, content);
        assert!(blosc::decompress(chunk, &mut out[1..]).is_err(), "a chunk fills its target exactly");

        let mut zstd = chunk.to_vec();
        zstd[2] = zstd[2] & 0x1f | 4 << 5;
        let error = blosc::decompress(&zstd, &mut out).unwrap_err();
        assert_eq!(error.to_string(), "unsupported: Blosc with zstd (code 4); accepted: blosclz, lz4, zlib");
    }
}

/// The numbers are those that OpenVDB 10.0 gives.
#[test]
fn smoke_with_half_floats() {
    let Some(bytes) = data("smoke.vdb") else { return };
    assert_eq!(vdb_grid_names(&bytes).unwrap(), ["density", "temperature"]);
    let grid = read_vdb(&bytes, "density", BUDGET).unwrap();
    assert_eq!(grid.dims, [62, 154, 62]);
    assert!(matches!(grid.voxels(), Voxels::F16(_)), "the file has half floats");
    assert_eq!(indices(grid.dims).filter(|&[i, j, k]| grid.value(i, j, k) > 0.0).count(), 134_590);
    let origin = Mat4::from_scale(Vec3::splat(0.0125)) * Mat4::from_translation(Vec3::new(8.0, -1.0, 6.0));
    assert!(grid.world_from_index.abs_diff_eq(origin, 1e-7));
    assert_valid(&grid, BUDGET);
}

/// Reads every grid of a damaged file: each must come out valid, or as an error, and soon.
fn survive(bytes: &[u8]) {
    let start = Instant::now();
    for name in vdb_grid_names(bytes).unwrap_or_default() {
        if let Ok(grid) = read_vdb(bytes, &name, BUDGET) {
            assert_valid(&grid, BUDGET);
        }
    }
    assert!(start.elapsed().as_secs_f32() < 1.0, "took {:?}", start.elapsed());
}

const FIXTURES: [&[u8]; 8] = [CODES, TILES, VECTORS, PLAIN, PLAIN_HALF, ZIP, ZIP_HALF, OLD];

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged_files_give_errors_or_grids(file in 0..FIXTURES.len(), damage in damage()) {
        let mut bytes = FIXTURES[file].to_vec();
        apply(&mut bytes, &damage);
        survive(&bytes);
    }

    #[test]
    fn a_file_that_ends_early_is_an_error(file in 0..FIXTURES.len(), cut in 0.0..1.0) {
        let bytes = FIXTURES[file];
        let bytes = &bytes[..(cut * bytes.len() as f64) as usize];
        survive(bytes);
        let grid = ["codes", "tiles", "v.z", "hand"][file.min(3)];
        prop_assert!(read_vdb(bytes, grid, BUDGET).is_err());
    }

    #[test]
    fn damaged_chunks_give_errors_or_bytes(at in 0usize..6, damage in damage(), length in 0usize..10_000) {
        let mut cursor = Cursor::new(include_bytes!("../fixtures/chunks.blosc"));
        let mut chunk = &[][..];
        for _ in 0..=at {
            let size = cursor.u32("a length").unwrap();
            chunk = cursor.take(size.into(), "a chunk").unwrap();
        }
        let mut chunk = chunk.to_vec();
        apply(&mut chunk, &damage);
        let content = if at < 3 { 1215 } else { 9400 };
        let _ = blosc::decompress(&chunk, &mut vec![0; content]);
        let _ = blosc::decompress(&chunk, &mut vec![0; length]);
    }
}
