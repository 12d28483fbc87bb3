use std::io::Write;
use std::time::Instant;

use flate2::{Compression, write::GzEncoder};
use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::volume::Voxels;
use crate::volume::tests::{BUDGET, apply, assert_valid, damage, damaged_cases, data, indices};

/// A file, field by field; offsets and types are those of nifti1.h.
#[derive(Clone)]
struct File {
    bytes: Vec<u8>,
    big_endian: bool,
}

impl File {
    /// A volume of `dims` voxels of `datatype` (none of which are there yet), a millimetre apart.
    fn new(datatype: i16, dims: &[i16], big_endian: bool) -> Self {
        let mut file = Self { bytes: vec![0; 352], big_endian };
        file.set(0, 348i32).set(40, dims.len() as i16).set(70, datatype).set(108, 352f32).bytes[344..348]
            .copy_from_slice(b"n+1\0");
        for (i, &n) in dims.iter().enumerate() {
            file.set(42 + 2 * i, n).set(80 + 4 * i, 1f32);
        }
        file
    }

    fn set(&mut self, at: usize, value: impl Number) -> &mut Self {
        let bytes = value.bytes(self.big_endian);
        self.bytes[at..at + bytes.len()].copy_from_slice(&bytes);
        self
    }

    fn push(&mut self, values: impl IntoIterator<Item = impl Number>) -> &mut Self {
        for value in values {
            self.bytes.extend(value.bytes(self.big_endian));
        }
        self
    }

    fn rows(&mut self, rows: [[f32; 4]; 3]) -> &mut Self {
        self.set(254, 1i16);
        for (i, value) in rows.into_iter().flatten().enumerate() {
            self.set(280 + 4 * i, value);
        }
        self
    }

    fn read(&self) -> Result<Grid, VolumeError> {
        read_nifti(&self.bytes, BUDGET)
    }
}

trait Number {
    fn bytes(&self, big_endian: bool) -> Vec<u8>;
}

macro_rules! number {
    ($($type:ty)*) => {$(
        impl Number for $type {
            fn bytes(&self, big_endian: bool) -> Vec<u8> {
                if big_endian { self.to_be_bytes().to_vec() } else { self.to_le_bytes().to_vec() }
            }
        }
    )*};
}
number!(u8 i8 u16 i16 u32 i32 u64 i64 f32 f64);

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn every_datatype_in_both_byte_orders() {
    let dims = [3, 2, 2];
    for big_endian in [false, true] {
        // Each holds twelve numbers from `first` on, but for the steps of `step`.
        let check = |datatype, push: &dyn Fn(&mut File) -> &mut File, first: f64, step: f64, half: bool| {
            let mut file = File::new(datatype, &dims, big_endian);
            push(&mut file);
            for bytes in [file.bytes.clone(), gzip(&file.bytes)] {
                let grid = read_nifti(&bytes, BUDGET).unwrap();
                assert_eq!(matches!(grid.voxels(), Voxels::F16(_)), half, "datatype {datatype}");
                for (n, [i, j, k]) in indices(grid.dims).enumerate() {
                    assert_eq!(grid.value(i, j, k), (first + step * n as f64) as f32, "datatype {datatype}");
                }
            }
        };
        check(2, &|f| f.push((0..12).map(|n| 200 + n as u8)), 200.0, 1.0, true);
        check(256, &|f| f.push((0..12).map(|n| -100 + n as i8)), -100.0, 1.0, true);
        check(512, &|f| f.push((0..12).map(|n| 60_000 + n as u16)), 60_000.0, 1.0, false);
        check(4, &|f| f.push((0..12).map(|n| -1024 + n as i16)), -1024.0, 1.0, true);
        check(768, &|f| f.push((0..12).map(|n| 4_000_000_000 + n as u32)), 4e9, 1.0, false);
        check(8, &|f| f.push((0..12).map(|n| -70_000 + n)), -70_000.0, 1.0, false);
        check(1280, &|f| f.push((0..12).map(|n| (1u64 << 63) + (n << 40))), 2f64.powi(63), 2f64.powi(40), false);
        check(1024, &|f| f.push((0..12i64).map(|n| -5_000_000_000 + n)), -5e9, 1.0, false);
        check(16, &|f| f.push((0..12).map(|n| 0.5 + 0.25 * n as f32)), 0.5, 0.25, true);
        check(64, &|f| f.push((0..12).map(|n| 0.1 + 0.1 * n as f64)), 0.1, 0.1, false);
    }
}

#[test]
fn values_are_scaled_and_a_slope_of_zero_is_not_applied() {
    let mut file = File::new(2, &[2, 1, 1], false);
    let read = |file: &File| {
        let grid = file.read().unwrap();
        [grid.value(0, 0, 0), grid.value(1, 0, 0)]
    };
    file.push([10u8, 20]).set(112, 0.5f32).set(116, -3f32);
    assert_eq!(read(&file), [2.0, 7.0]);
    assert_eq!(read(file.set(112, 0f32)), [10.0, 20.0]);
    assert_eq!(read(file.set(112, f32::NAN)), [10.0, 20.0]);
    assert!(file.set(112, 1f32).set(116, f32::NAN).read().is_err());
}

#[test]
fn the_world_is_in_metres() {
    let mut file = File::new(2, &[1, 1, 1], true);
    let place = |file: &File| file.read().unwrap().world_from_index.transform_point3(Vec3::new(1.0, 2.0, 3.0));
    let close = |a: Vec3, b: Vec3| assert!(a.abs_diff_eq(b, 1e-6 * b.length()), "{a} is not {b}");
    file.push([0u8]).set(80, 0.5f32).set(84, 1.5f32).set(88, 2.0f32);
    for (unit, metres) in [(0u8, 1e-3), (2, 1e-3), (1, 1.0), (3, 1e-6), (2 | 8, 1e-3)] {
        close(place(file.set(123, unit)), metres * Vec3::new(0.5, 3.0, 6.0));
    }
    assert!(matches!(file.clone().set(123, 5u8).read(), Err(VolumeError::Unsupported { .. })));

    // The qform. First a turn that takes x to y to z; then by 180° about x; then what nibabel makes of it.
    file.set(252, 1i16).set(268, 10f32).set(272, -20f32).set(276, 30f32);
    let mut turn =
        |b: f32, c: f32, d: f32, mirror: f32| place(file.set(256, b).set(260, c).set(264, d).set(76, mirror));
    close(turn(0.5, 0.5, 0.5, 1.0), 1e-3 * Vec3::new(16.0, -19.5, 33.0));
    close(turn(0.5, 0.5, 0.5, -1.0), 1e-3 * Vec3::new(4.0, -19.5, 33.0));
    close(turn(1.0, 0.0, 0.0, 1.0), 1e-3 * Vec3::new(10.5, -23.0, 24.0));
    close(turn(0.1, -0.3, 0.6, -1.0), 1e-3 * Vec3::new(9.15000, -15.76728, 24.84136));

    // An sform goes before it.
    file.rows([[0.0, 2.0, 0.0, 5.0], [-1.0, 0.0, 0.0, 6.0], [0.0, 0.0, 3.0, 7.0]]);
    close(place(&file), 1e-3 * Vec3::new(9.0, 5.0, 16.0));
    file.rows([[0.0; 4]; 3]);
    assert!(file.read().unwrap_err().to_string().contains("sform"));
    file.set(254, 0i16).set(252, 0i16).set(84, -1f32);
    assert!(file.read().unwrap_err().to_string().contains("spacing"));
}

#[test]
fn refusals_say_what_is_accepted() {
    let volume = |dims: &[i16]| File::new(2, dims, false).push([0u8; 24]).clone();
    assert!(volume(&[2, 3, 4]).read().is_ok());
    assert!(volume(&[2, 3, 4, 1, 1]).read().is_ok());
    assert_eq!(volume(&[24]).read().unwrap().dims, [24, 1, 1]);
    let error = |file: &File| file.read().unwrap_err().to_string();
    assert!(error(&volume(&[2, 3, 2, 2])).contains("pick one"));
    assert!(error(&volume(&[2, 0, 2])).contains("dim[2] is 0"));
    assert!(error(&volume(&[2, -3, 2])).contains("dim[2] is -3"));
    assert!(error(volume(&[2, 3, 4]).set(40, 8i16)).contains("dim[0]"));
    assert!(error(volume(&[2, 3, 4]).set(40, 0i16)).contains("dim[0]"));
    assert!(error(volume(&[2, 3, 4]).set(70, 128i16)).contains("datatype 128"));
    assert!(error(volume(&[2, 3, 4]).set(0, 540i32)).contains("NIfTI-2"));
    assert!(error(volume(&[2, 3, 4]).set(0, 347i32)).contains("begins with"));
    assert!(error(volume(&[2, 3, 4]).set(108, 1e9f32)).contains("vox_offset"));
    assert!(error(volume(&[2, 3, 4]).set(345, b'i')).contains(".hdr and .img"));
    assert!(error(volume(&[2, 3, 4]).set(344, 0u8)).contains("magic"));
    assert!(matches!(read_nifti(b"", BUDGET), Err(VolumeError::Truncated { at: 0, .. })));
}

#[test]
fn sizes_are_checked_before_anything_is_allocated() {
    let huge = File::new(64, &[32767, 32767, 32767], false);
    for bytes in [huge.bytes.clone(), gzip(&huge.bytes)] {
        assert!(matches!(read_nifti(&bytes, Budget(u64::MAX)), Err(VolumeError::Truncated { .. })));
    }
    let file = File::new(2, &[2, 3, 4], false).push([1u8; 24]).clone();
    assert!(read_nifti(&file.bytes, Budget(48)).is_ok());
    let error = read_nifti(&file.bytes, Budget(47)).unwrap_err();
    assert_eq!(error, VolumeError::TooLarge { dims: [2, 3, 4], bytes: 48, budget: 47 });
    // Zeros compress well, but no more of them are read than the header speaks of.
    let zeros = File::new(2, &[2, 3, 4], false).push(vec![0u8; 10 << 20]).clone();
    assert_eq!(read_nifti(&gzip(&zeros.bytes), Budget(48)).unwrap().dims, [2, 3, 4]);
}

#[test]
fn extensions_are_skipped_and_checksums_checked() {
    let file = File::new(2, &[2, 1, 1], false).set(108, 368f32).push([9u8; 16]).push([1u8, 2]).clone();
    let mut bytes = gzip(&file.bytes);
    assert_eq!(read_nifti(&bytes, BUDGET).unwrap().value(1, 0, 0), 2.0);
    let end = bytes.len();
    bytes[end - 6] ^= 1;
    assert!(matches!(read_nifti(&bytes, BUDGET), Err(VolumeError::Corrupt { .. })));
}

#[test]
fn values_that_are_not_finite_are_named() {
    for value in [f64::NAN, f64::NEG_INFINITY, 1e300] {
        let mut values = [0.0; 24];
        values[2 * 3 * 2 + 2 + 1] = value;
        let error = File::new(64, &[2, 3, 4], true).push(values).read().unwrap_err();
        assert!(matches!(error, VolumeError::NotFinite { index: [1, 1, 2], .. }), "{error}");
    }
}

/// The numbers are those that nibabel gives.
#[test]
fn head_of_the_mni() {
    let Some(bytes) = data("mni152_t1_1mm.nii.gz") else { return };
    let grid = read_nifti(&bytes, BUDGET).unwrap();
    assert_eq!(grid.dims, [197, 233, 189]);
    assert!(matches!(grid.voxels(), Voxels::F16(_)), "the file has bytes");
    assert_eq!(indices(grid.dims).map(|[i, j, k]| grid.value(i, j, k) as u64).sum::<u64>(), 333_468_829);
    assert_eq!([grid.value(90, 100, 80), grid.value(100, 120, 90), grid.value(60, 140, 100)], [179.0, 217.0, 168.0]);
    let origin = grid.world_from_index.transform_point3(Vec3::ZERO);
    assert!(origin.abs_diff_eq(Vec3::new(-0.098, -0.134, -0.072), 1e-6), "{origin}");
    assert_valid(&grid, BUDGET);
}

fn survive(bytes: &[u8]) {
    let start = Instant::now();
    if let Ok(grid) = read_nifti(bytes, BUDGET) {
        assert_valid(&grid, BUDGET);
    }
    assert!(start.elapsed().as_secs_f32() < 1.0, "took {:?}", start.elapsed());
}

fn sound() -> impl Strategy<Value = Vec<u8>> {
    (prop::sample::select(vec![2i16, 256, 512, 4, 768, 8, 1280, 1024, 16, 64]), any::<(bool, bool)>()).prop_map(
        |(datatype, (big, zip))| {
            let mut file = File::new(datatype, &[5, 4, 3], big);
            file.rows([[-1.0, 0.0, 0.0, 90.0], [0.0, 1.0, 0.0, -126.0], [0.0, 0.0, 1.0, -72.0]]).set(112, 1f32);
            let size = stored(datatype).unwrap().size();
            file.push((0..60 * size).map(|n| (n * n) as u8 & 0x3f));
            if zip { gzip(&file.bytes) } else { file.bytes }
        },
    )
}

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged_files_give_errors_or_grids(mut bytes in sound(), damage in damage()) {
        prop_assert!(read_nifti(&bytes, BUDGET).is_ok());
        apply(&mut bytes, &damage);
        survive(&bytes);
    }

    #[test]
    fn a_file_that_ends_early_is_an_error(bytes in sound(), cut in 0.0..1.0) {
        let cut = (cut * bytes.len() as f64) as usize;
        prop_assert!(read_nifti(&bytes[..cut], BUDGET).is_err());
    }
}
