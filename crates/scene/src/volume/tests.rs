//! What the tests of all loaders share, and tests of the grid.

use std::path::PathBuf;

use glam::Mat4;
use half::f16;
use proptest::prelude::*;

use super::bricks::Bricks;
use super::grid::{Bricked, invertible};
use super::{BRICK_VOXELS, Budget, Grid, VolumeError, Voxels};

/// Room for every fixture, and for what a damaged one may grow into.
pub const BUDGET: Budget = Budget(32 << 20);

/// A file of `$TYNDALL_DATA`, or of the folder `shared/data` beside the workspace; `None`, and a word on it, without
/// one.
pub fn data(name: &str) -> Option<Vec<u8>> {
    let folder = std::env::var_os("TYNDALL_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    let path = folder.join(name);
    let bytes = std::fs::read(&path).ok();
    if bytes.is_none() {
        println!("skipped: {} is not there", path.display());
    }
    bytes
}

/// What holds of every grid that a loader gives.
pub fn assert_valid(grid: &Grid, budget: Budget) {
    let (length, finite) = match grid.voxels() {
        Voxels::F16(v) => (v.len(), v.iter().all(|v| v.is_finite())),
        Voxels::F32(v) => (v.len(), v.iter().all(|v| v.is_finite())),
    };
    let counts = grid.brick_counts().map(|n| n as usize);
    assert_eq!(grid.bricks().len(), counts.iter().product::<usize>(), "bricks of a grid of {:?}", grid.dims);
    let slots = grid.bricks().iter().filter(|brick| !brick.is_uniform()).map(|brick| brick.slot as usize);
    assert_eq!(slots.clone().count() * BRICK_VOXELS, length, "a slot a brick");
    assert!(slots.max().is_none_or(|last| (last + 1) * BRICK_VOXELS == length), "no voxels without a brick");
    assert!(grid.bytes() <= budget.0 + budget.0 / 8, "{} bytes", grid.bytes());
    assert!(finite && grid.bricks().iter().all(|brick| brick.low.is_finite() && brick.high.is_finite()));
    assert!(grid.world_from_index.is_finite() && grid.world_from_index.inverse().is_finite());
}

/// Every voxel's index.
pub fn indices(dims: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    let [nx, ny, nz] = dims;
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}

/// How many damaged files a test tries; `TYNDALL_FUZZ` sets another number for a long run.
pub fn damaged_cases() -> ProptestConfig {
    let cases = std::env::var("TYNDALL_FUZZ").ok().and_then(|n| n.parse().ok()).unwrap_or(300);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// A damage: where, as a fraction of the bytes that are not zero (those that say something) or of all, and what.
pub fn damage() -> impl Strategy<Value = Vec<(bool, f64, Change)>> {
    let change = prop_oneof![
        6 => (0..8u8).prop_map(Change::Flip),
        1 => any::<u8>().prop_map(Change::Byte),
        1 => prop::sample::select(vec![0, 1, -1, i32::MAX, i32::MIN, 0x7fc0_0000, 0x7f80_0000, 0x7bff_7c00])
            .prop_map(Change::Word),
    ];
    prop::collection::vec((prop::bool::weighted(0.8), 0.0..1.0, change), 1..4)
}

#[derive(Debug, Clone)]
pub enum Change {
    Flip(u8),
    Byte(u8),
    Word(i32),
}

pub fn apply(bytes: &mut [u8], damage: &[(bool, f64, Change)]) {
    let telling: Vec<_> = (0..bytes.len()).filter(|&i| bytes[i] != 0).collect();
    for (tell, place, change) in damage {
        let at = match tell {
            true => telling[(place * telling.len() as f64) as usize],
            false => (place * bytes.len() as f64) as usize,
        };
        match change {
            Change::Flip(bit) => bytes[at] ^= 1 << bit,
            Change::Byte(byte) => bytes[at] = *byte,
            Change::Word(word) => {
                let end = bytes.len().min(at + 4);
                bytes[at..end].copy_from_slice(&word.to_le_bytes()[..end - at]);
            }
        }
    }
}

#[test]
fn x_is_fastest() {
    let values = (0..24u8).map(f16::from).collect();
    let grid = Grid::dense([2, 3, 4], Voxels::F16(values), Mat4::IDENTITY);
    assert_eq!(
        [grid.value(1, 0, 0), grid.value(0, 1, 0), grid.value(0, 0, 1), grid.value(1, 2, 3)],
        [1.0, 2.0, 6.0, 23.0]
    );
}

/// Filling boxes of bricks, in any order, gives the same voxels as a dense array; and bricks of one value have no voxels.
#[test]
fn bricks_hold_what_is_filled() {
    proptest!(ProptestConfig::with_cases(64), |(
        dims in [1usize..28, 1usize..28, 1usize..28],
        boxes in prop::collection::vec(([0.0..1.0, 0.0..1.0, 0.0..1.0], [0.0..1.0, 0.0..1.0, 0.0..1.0], 0u8..4), 0..8),
    )| {
        let mut dense = vec![f16::ONE; dims.iter().product()];
        let mut bricks = Bricks::uniform(dims.map(|n| n as u64), f16::ONE, BUDGET).unwrap();
        for (a, b, value) in boxes {
            let at = |t: [f64; 3]| [0, 1, 2].map(|axis| (t[axis] * dims[axis] as f64) as usize);
            let (a, b) = (at(a), at(b));
            let (low, high) = ([0, 1, 2].map(|i| a[i].min(b[i])), [0, 1, 2].map(|i| a[i].max(b[i])));
            bricks.fill(low, high, f16::from(value)).unwrap();
            for z in low[2]..=high[2] {
                for y in low[1]..=high[1] {
                    let row = (z * dims[1] + y) * dims[0];
                    dense[row + low[0]..=row + high[0]].fill(f16::from(value));
                }
            }
        }
        bricks.settle();
        let sides = dims.map(|n| n as u32);
        let filled = Grid::bricked(sides, Bricked::f16(bricks), Mat4::IDENTITY);
        assert_valid(&filled, BUDGET);
        let expected = Grid::dense(sides, Voxels::F16(dense.clone()), Mat4::IDENTITY);
        for ([i, j, k], voxel) in indices(sides).zip(dense) {
            prop_assert_eq!(filled.value(i, j, k), voxel.to_f32());
            prop_assert_eq!(expected.value(i, j, k), voxel.to_f32());
        }
        let ranges = |grid: &Grid| grid.bricks().iter().map(|b| (b.low, b.high)).collect::<Vec<_>>();
        prop_assert_eq!(ranges(&filled), ranges(&expected));
    });
}

#[test]
fn the_budget_is_exact() {
    let dims = [3, 5, 7];
    assert!(Budget(210).reserve::<f16>(dims, dims).is_ok());
    let error = Budget(209).reserve::<f16>(dims, dims).unwrap_err();
    assert_eq!(error, VolumeError::TooLarge { dims, bytes: 210, budget: 209 });
    assert_eq!(error.to_string(), "a grid of 3 x 5 x 7 voxels needs 210 bytes; the budget is 209");
    // Sizes beyond 64 bits do not wrap.
    assert!(matches!(
        Budget(u64::MAX).reserve::<f32>([1 << 33; 3], [1 << 33; 3]),
        Err(VolumeError::TooLarge { bytes: u64::MAX, .. })
    ));
    assert!(matches!(
        Budget(u64::MAX).reserve::<f32>([1 << 31, 1 << 30, 1], [1 << 31, 1 << 30, 1]),
        Err(VolumeError::OutOfMemory { .. })
    ));
}

#[test]
fn flat_matrices_are_refused_at_every_scale() {
    use glam::{DMat4, DVec3};
    for metre in [1e-9, 1.0, 1e9] {
        assert!(invertible(DMat4::from_scale(DVec3::splat(metre)), "map").is_ok());
        assert!(invertible(DMat4::from_scale(DVec3::new(metre, metre, 0.0)), "map").is_err());
    }
    assert!(invertible(DMat4::from_scale(DVec3::splat(f64::NAN)), "map").is_err());
    assert!(invertible(DMat4::from_scale(DVec3::splat(1e300)), "map").is_err());
}
