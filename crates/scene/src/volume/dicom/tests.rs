use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::assets::Embedded;
use crate::volume::tests::{BUDGET, apply, assert_valid, damage, damaged_cases, indices};

/// What `fixtures/make_dicom.py` made with pydicom: the second is implicit, each has a rescale of its own, and the
/// order of names is not that of the slices.
const FILES: [(&str, &[u8]); 4] = [
    ("ct/a.dcm", include_bytes!("../fixtures/ct/a.dcm")),
    ("ct/b.dcm", include_bytes!("../fixtures/ct/b.dcm")),
    ("ct/c.dcm", include_bytes!("../fixtures/ct/c.dcm")),
    ("ct/notes.txt", b"no DICOM"),
];

fn read(files: &[(&str, &[u8])], series: Option<&str>) -> Result<Grid, VolumeError> {
    let names: Vec<_> = files.iter().map(|(name, _)| name.to_string()).collect();
    read_dicom(&names, series, &Embedded(files.to_vec()), BUDGET)
}

fn message(files: &[(&str, &[u8])], series: Option<&str>) -> String {
    match read(files, series) {
        Ok(grid) => format!("{:?}", grid.dims),
        Err(error) => error.to_string(),
    }
}

/// `file` with the value of every element `tag` (group, element) set; it must be as long as the old one.
fn with(file: &[u8], tag: [u16; 2], value: &[u8]) -> Vec<u8> {
    let tag = [tag[0].to_le_bytes(), tag[1].to_le_bytes()].concat();
    let mut file = file.to_vec();
    let places: Vec<_> = (0..file.len()).filter(|&at| file[at..].starts_with(&tag)).collect();
    assert!(!places.is_empty());
    for at in places {
        file[at + 8..at + 8 + value.len()].copy_from_slice(value);
    }
    file
}

/// Values and places are those that SimpleITK (GDCM) gives.
#[test]
fn a_series_is_sorted_rescaled_and_placed() {
    let grid = read(&FILES, None).unwrap();
    assert_valid(&grid, BUDGET);
    assert_eq!(grid.dims, [4, 3, 3]);
    for [i, j, k] in indices(grid.dims) {
        let value = (100 * k + 10 * j + i) as f32;
        assert_eq!(grid.value(i, j, k), if k < 2 { value - 1024.0 } else { value });
    }
    for (index, [l, p, s]) in [
        ([0.0, 0.0, 0.0], [-10.0, 20.0, 30.0]),
        ([3.0, 2.0, 2.0], [-10.044596, 25.219962, 28.5]),
        ([1.0, 0.0, 1.0], [-10.261132, 22.5361, 30.0]),
    ] {
        let expected = Vec3::new(-l, -p, s) * 1e-3;
        let found = grid.world_from_index.transform_point3(index.into());
        // The positions in the files have six decimals [mm].
        assert!(found.abs_diff_eq(expected, 1e-8), "{index:?}: {found} is not {expected}");
    }
    assert_eq!(read(&FILES, Some("1.2.840.7")).unwrap(), grid);
}

#[test]
fn one_slice_is_as_thick_as_it_says() {
    let grid = read(&FILES[..1], None).unwrap();
    assert_eq!(grid.dims, [4, 3, 1]);
    assert!((grid.world_from_index.z_axis.truncate().length() - 9e-3).abs() < 1e-8);
}

#[test]
fn slices_that_are_no_series_are_refused() {
    let [a, b, c, notes] = FILES;
    assert_eq!(
        message(&[notes], None),
        "unsupported: a folder of 1 files, none of which is a DICOM image; accepted: the slices of a series"
    );
    let other = with(b.1, [0x0020, 0x000e], b"1.2.840.8");
    let both = [a, ("ct/b.dcm", other.as_slice()), c];
    let expected = "found the series \"1.2.840.7\", \"1.2.840.8\"; accepted: `name`, the SeriesInstanceUID of one";
    assert_eq!(message(&both, None), expected);
    assert_eq!(message(&both, Some("1.2")), expected);
    assert_eq!(message(&both, Some("1.2.840.8")), "[4, 3, 1]");
    // Five in a row, the fourth of which is missing; the others are copies further along the normal.
    let step = [-0.738801 / 2.5 * 2.5, 2.388341, 0.0];
    let at = |n: f64| {
        let [x, y, z] = [-10.0 + n * step[0], 20.0 + n * step[1], 30.0];
        let text = format!("{x:.6}\\{y:.6}\\{z:.6}");
        move_to(c.1, &text)
    };
    let slices = [at(0.0), at(1.0), at(2.0), at(4.0)];
    let names = ["0.dcm", "1.dcm", "2.dcm", "4.dcm"];
    let files: Vec<_> = names.iter().zip(&slices).map(|(name, bytes)| (*name, bytes.as_slice())).collect();
    assert_eq!(message(&files[..3], None), "[4, 3, 3]");
    assert_eq!(
        message(&files, None),
        "the slices \"2.dcm\" and \"4.dcm\" are 5.000 mm apart along their normal, others 2.500 mm; accepted: slices in a \
         row, evenly spaced within 1 %"
    );
    let twice = [files[0], files[1], ("again.dcm", files[1].1)];
    assert!(message(&twice, None).starts_with("the slices "));
    let larger = with(a.1, [0x0028, 0x0011], &[2, 0]);
    assert_eq!(
        message(&[c, ("ct/a.dcm", &larger)], None),
        "unsupported: slices of different size, spacing or orientation (\"ct/c.dcm\" and \"ct/a.dcm\"); accepted: a series \
         of parallel slices of one size"
    );
}

/// `file`, explicit, with another ImagePositionPatient.
fn move_to(file: &[u8], position: &str) -> Vec<u8> {
    let tag = [0x20, 0, 0x32, 0, b'D', b'S'];
    let at = (0..file.len()).find(|&at| file[at..].starts_with(&tag)).unwrap();
    let old = usize::from(file[at + 6]);
    let position = if position.len().is_multiple_of(2) { position.to_owned() } else { format!("{position} ") };
    [&file[..at + 6], &(position.len() as u16).to_le_bytes(), position.as_bytes(), &file[at + 8 + old..]].concat()
}

#[test]
fn what_a_slice_may_not_have_is_named() {
    let (name, file) = FILES[2];
    let refusal = |file: Vec<u8>| message(&[(name, &file)], None);
    let jpeg = with(file, [0x0002, 0x0010], b"1.2.840.10008.1.2.5\0");
    assert_eq!(
        refusal(jpeg),
        "\"ct/c.dcm\": unsupported: the transfer syntax 1.2.840.10008.1.2.5; accepted: 1.2.840.10008.1.2 and \
         1.2.840.10008.1.2.1: not compressed, little-endian"
    );
    assert_eq!(
        refusal(with(file, [0x0028, 0x0002], &[3, 0])),
        "\"ct/c.dcm\": unsupported: more than one value a voxel (SamplesPerPixel); accepted: slices of one value a voxel, \
         each in a file of its own"
    );
    assert_eq!(
        refusal(with(file, [0x0028, 0x0010], &[9, 0])),
        "\"ct/c.dcm\": the file is corrupt: its PixelData has 24 bytes; 9 rows of 4 voxels need 72, and at least 1"
    );
    assert!(refusal(with(file, [0x0028, 0x0101], &[17, 0])).contains("voxels of 16 bits, 17 stored up to bit 11"));
    assert!(refusal(with(file, [0x0028, 0x1053], b"x")).contains("its RescaleSlope is \"x"));
    // Bits above those that are stored do not count, and the sign is the highest of these.
    let pixels = file.len() - 24;
    let mut bits = file.to_vec();
    bits[pixels..pixels + 4].copy_from_slice(&[0x05, 0xf0, 0xff, 0x0f]);
    let grid = read(&[(name, &bits)], None).unwrap();
    assert_eq!([grid.value(0, 0, 0), grid.value(1, 0, 0)], [5.0 - 1024.0, -1.0 - 1024.0]);
}

#[test]
fn the_budget_holds() {
    let names: Vec<_> = FILES.iter().map(|(name, _)| name.to_string()).collect();
    let read = |budget| read_dicom(&names, None, &Embedded(FILES.to_vec()), Budget(budget));
    assert!(matches!(read(600), Err(VolumeError::Unreadable { .. })));
    // The voxels of a brick.
    assert!(read(1457).unwrap_err().to_string().ends_with("needs 1458 bytes; the budget is 1457"));
    assert!(read(1458).is_ok());
    let huge = with(&with(FILES[2].1, [0x0028, 0x0010], &[255, 255]), [0x0028, 0x0011], &[255, 255]);
    assert!(message(&[("huge", &huge)], None).contains("need 8589672450"));
}

#[test]
fn a_slice_that_ends_early_is_an_error_or_none() {
    for (which, (name, bytes)) in FILES[..3].iter().enumerate() {
        for cut in 0..bytes.len() {
            let mut files = FILES.to_vec();
            files[which] = (name, &bytes[..cut]);
            // Where the file is none any more, one is missing, or the two that are left stand alone.
            if let Ok(grid) = read(&files, None) {
                assert_eq!(grid.dims, [4, 3, 2]);
            }
        }
    }
}

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged_files_give_errors_or_grids(which in 0..3usize, damage in damage()) {
        let mut bytes = FILES[which].1.to_vec();
        apply(&mut bytes, &damage);
        let mut files = FILES.to_vec();
        files[which].1 = &bytes;
        if let Ok(grid) = read(&files, None) {
            assert_valid(&grid, BUDGET);
        }
    }
}
