use std::time::Instant;

use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::assets::Embedded;
use crate::volume::tests::{BUDGET, apply, assert_valid, damage, damaged_cases, indices};
use crate::volume::{Stored, Voxels};

/// What `fixtures/make_dense.py` made with NumPy, pynrrd and SimpleITK.
pub const FILES: [(&str, &[u8]); 12] = [
    ("c.npy", include_bytes!("../fixtures/c.npy")),
    ("fortran.npy", include_bytes!("../fixtures/fortran.npy")),
    ("half.npy", include_bytes!("../fixtures/half.npy")),
    ("version3.npy", include_bytes!("../fixtures/version3.npy")),
    ("gzip.nrrd", include_bytes!("../fixtures/gzip.nrrd")),
    ("ras.nrrd", include_bytes!("../fixtures/ras.nrrd")),
    ("ascii.nrrd", include_bytes!("../fixtures/ascii.nrrd")),
    ("detached.nhdr", include_bytes!("../fixtures/detached.nhdr")),
    ("detached.raw", include_bytes!("../fixtures/detached.raw")),
    ("meta.mhd", include_bytes!("../fixtures/meta.mhd")),
    ("meta.raw", include_bytes!("../fixtures/meta.raw")),
    ("zlib.mha", include_bytes!("../fixtures/zlib.mha")),
];

fn read(file: &str) -> Result<Grid, FileError> {
    read_grid(file, None, None, &Embedded(FILES.to_vec()), BUDGET)
}

fn place(grid: &Grid, index: [f32; 3]) -> Vec3 {
    grid.world_from_index.transform_point3(Vec3::from_array(index))
}

/// Where SimpleITK puts voxels (0, 0, 0), (3, 2, 1) and (1, 0, 1); it speaks of left-posterior-superior \[mm\].
#[test]
fn medical_files_are_where_another_reader_puts_them() {
    let nrrd = [[-12.5, 30.25, 7.0], [-11.2, 31.65, 9.4], [-12.0, 30.05, 9.0]];
    let meta = [[-12.5, 30.25, 7.0], [-11.509039, 31.118952, 9.600561], [-12.347008, 29.65368, 8.967485]];
    let files = [
        ("gzip.nrrd", nrrd, 1.0, -50.0, true),
        ("ras.nrrd", nrrd, -1.0, -50.0, true),
        ("ascii.nrrd", nrrd, 1.0, -50.0, true),
        ("detached.nhdr", nrrd, 1.0, 0.0, true),
        ("meta.mhd", meta, 1.0, -50.0, true),
        ("zlib.mha", meta, 1.0, -50.0, true),
    ];
    for (file, places, sign, first, half) in files {
        let grid = read(file).unwrap();
        assert_valid(&grid, BUDGET);
        assert_eq!(grid.dims, [4, 3, 2], "{file}");
        assert_eq!(matches!(grid.voxels(), Voxels::F16(_)), half, "{file}");
        for [i, j, k] in indices(grid.dims) {
            assert_eq!(grid.value(i, j, k), first + (100 * k + 10 * j + i) as f32, "{file}");
        }
        for (index, [l, p, s]) in [[0.0, 0.0, 0.0], [3.0, 2.0, 1.0], [1.0, 0.0, 1.0]].into_iter().zip(places) {
            let expected = Vec3::new(-l * sign, -p * sign, s) * 1e-3;
            let found = place(&grid, index);
            assert!(found.abs_diff_eq(expected, 1e-8), "{file} {index:?}: {found} is not {expected}");
        }
    }
}

#[test]
fn arrays_fill_a_metre_in_either_order() {
    for file in ["c.npy", "half.npy", "version3.npy", "fortran.npy"] {
        let grid = read(file).unwrap();
        assert_valid(&grid, BUDGET);
        let fortran = file == "fortran.npy";
        assert_eq!(grid.dims, if fortran { [2, 3, 4] } else { [4, 3, 2] });
        for [i, j, k] in indices([4, 3, 2]) {
            let index = if fortran { [k, j, i] } else { [i, j, k] };
            assert_eq!(grid.value(index[0], index[1], index[2]), (100 * k + 10 * j + i) as f32 - 50.0, "{file}");
            let expected = (Vec3::new(i as f32, j as f32, k as f32) - Vec3::new(1.5, 1.0, 0.5)) / 4.0;
            let found = place(&grid, index.map(|n| n as f32));
            assert!(found.abs_diff_eq(expected, 1e-7), "{file}: {found} is not {expected}");
        }
    }
}

#[test]
fn files_without_header() {
    let bytes: Vec<u8> = [7].into_iter().chain((0..24u16).flat_map(|n| (n * 10).to_be_bytes())).collect();
    let read =
        |raw: &Raw, budget| read_grid("a.raw", None, Some(raw), &Embedded(vec![("a.raw", &bytes)]), Budget(budget));
    let raw =
        Raw { dims: [4, 3, 2], sample: Stored::U16, spacing: Vec3::new(0.1, 0.2, 0.3), big_endian: true, offset: 1 };
    let grid = read(&raw, 2000).unwrap();
    for (n, [i, j, k]) in indices([4, 3, 2]).enumerate() {
        assert_eq!(grid.value(i, j, k), 10.0 * n as f32);
        let expected = Vec3::new(i as f32 - 1.5, j as f32 - 1.0, k as f32 - 0.5) * raw.spacing;
        assert!(place(&grid, [i, j, k].map(|n| n as f32)).abs_diff_eq(expected, 1e-7));
    }
    let message = |raw: &Raw| read(raw, 2000).unwrap_err().to_string();
    let wrong = "found 49 bytes; accepted: ";
    assert_eq!(
        message(&Raw { offset: 0, ..raw.clone() }),
        format!("{wrong}48, for 4 x 3 x 2 voxels of u16 after 0 bytes")
    );
    assert_eq!(
        message(&Raw { sample: Stored::F64, ..raw.clone() }),
        format!("{wrong}193, for 4 x 3 x 2 voxels of f64 after 1 bytes")
    );
    let huge = Raw { dims: [u32::MAX; 3], offset: u64::MAX, ..raw.clone() };
    assert!(message(&huge).starts_with(&format!("{wrong}18446744073709551615, for 4294967295 x ")));
    let message = read(&raw, 47).unwrap_err().to_string();
    assert!(message.contains("it has 49 bytes or more"), "{message}");
}

#[test]
fn the_data_file_of_a_header_is_named() {
    let header = FILES[7].1;
    let message = |data: Option<&[u8]>| {
        let mut files = vec![("scan/detached.nhdr", header)];
        files.extend(data.map(|data| ("scan/detached.raw", data)));
        match read_grid("scan/detached.nhdr", None, None, &Embedded(files), BUDGET) {
            Ok(grid) => format!("{:?}", grid.dims),
            Err(error) => error.to_string(),
        }
    };
    assert_eq!(message(Some(FILES[8].1)), "[4, 3, 2]");
    assert_eq!(message(None), "cannot read \"scan/detached.raw\": no embedded file of that name");
    assert_eq!(
        message(Some(&FILES[8].1[..100])),
        "\"scan/detached.raw\": the file ends at byte 100, within the voxels"
    );
}

/// Reads `FILES[which]`, or the header that names it, where its bytes are these.
fn read_with(which: usize, bytes: &[u8]) -> Result<Grid, FileError> {
    let mut files = FILES.to_vec();
    files[which].1 = bytes;
    let header = if files[which].0.ends_with(".raw") { which - 1 } else { which };
    read_grid(files[header].0, None, None, &Embedded(files), BUDGET)
}

#[test]
fn every_truncation_is_an_error() {
    for (which, (name, bytes)) in FILES.into_iter().enumerate() {
        for cut in 0..bytes.trim_ascii_end().len() {
            let read = read_with(which, &bytes[..cut]);
            // The last number of a text may be cut short and still be one.
            assert!(read.is_err() || name == "ascii.nrrd" && cut + 4 > bytes.len(), "{name} cut at {cut}");
        }
    }
}

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged_files_give_errors_or_grids(which in 0..FILES.len(), damage in damage()) {
        let mut bytes = FILES[which].1.to_vec();
        apply(&mut bytes, &damage);
        let start = Instant::now();
        match read_with(which, &bytes) {
            Ok(grid) => assert_valid(&grid, BUDGET),
            Err(error) => prop_assert!(error.to_string().len() < 500, "{error}"),
        }
        prop_assert!(start.elapsed().as_secs_f32() < 1.0, "took {:?}", start.elapsed());
    }
}
