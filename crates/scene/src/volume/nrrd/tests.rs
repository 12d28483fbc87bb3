use flate2::{Compression, write::GzEncoder};
use glam::Vec3;
use std::io::Write;

use super::*;
use crate::assets::Embedded;
use crate::volume::tests::BUDGET;

/// Reads two voxels of 1 byte along x; `more` are further fields, `data` follows the header.
fn read(more: &str, data: &[u8]) -> Result<Grid, VolumeError> {
    read_fields(&format!("type: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: raw\n{more}"), data)
}

fn read_fields(fields: &str, data: &[u8]) -> Result<Grid, VolumeError> {
    let bytes = [b"NRRD0004\n# made here\nkey:=value\n", fields.as_bytes(), b"\n", data].concat();
    read_nrrd("a.nrrd", &bytes, &Embedded::default(), BUDGET)
}

fn message(fields: &str) -> String {
    read(fields, &[1, 2]).unwrap_err().to_string()
}

#[test]
fn the_world_is_right_anterior_superior_in_metres() {
    let place = |more: &str| {
        let grid = read(more, &[1, 2]).unwrap();
        assert_eq!([grid.value(0, 0, 0), grid.value(1, 0, 0)], [1.0, 2.0]);
        grid.world_from_index.transform_point3(Vec3::ONE)
    };
    let close = |a: Vec3, b: [f32; 3]| assert!(a.abs_diff_eq(b.into(), 1e-6 * a.length()), "{a} is not {b:?}");
    close(place(""), [1e-3, 1e-3, 1e-3]);
    close(place("spacings: 1 2 nan\n"), [1e-3, 2e-3, 1e-3]);
    close(place("spacings: 1 2 3\nunits: \"m\" \"cm\" \"um\"\n"), [1.0, 2e-2, 3e-6]);
    let directions = "space directions: (0,2,0) (3, 0, 0) (0,0,4)\nspace origin: (10,20,30)\n";
    for (space, [x, y, z]) in [
        ("space: RAS\n", [1.0, 1.0, 1.0]),
        ("space: right-anterior-superior\r\n", [1.0, 1.0, 1.0]),
        ("space dimension: 3\n", [1.0, 1.0, 1.0]),
        ("space: LPS\n", [-1.0, -1.0, 1.0]),
        ("space: Left-Posterior-Superior\n", [-1.0, -1.0, 1.0]),
        ("space: left-anterior-superior\n", [-1.0, 1.0, 1.0]),
    ] {
        close(place(&format!("{space}{directions}")), [x * 13e-3, y * 22e-3, z * 34e-3]);
    }
    close(place(&format!("space: RAS\nspace units: \"m\" \"m\" \"mm\"\n{directions}")), [13.0, 22.0, 34e-3]);
}

#[test]
fn lines_and_bytes_are_skipped() {
    let values = |more: &str, data: &[u8]| {
        let grid = read(more, data).unwrap();
        [grid.value(0, 0, 0), grid.value(1, 0, 0)]
    };
    assert_eq!(values("byte skip: 3\n", &[9, 9, 9, 1, 2]), [1.0, 2.0]);
    assert_eq!(values("line skip: 2\n", b"one\r\ntwo\n\x01\x02"), [1.0, 2.0]);
    assert_eq!(values("lineskip: 1\nbyteskip: 1\n", b"one\n\x09\x01\x02"), [1.0, 2.0]);
    assert_eq!(values("byte skip: -1\n", &[9, 9, 1, 2]), [1.0, 2.0]);
    // Of a compressed file the lines are skipped as they stand, the bytes once they are decompressed.
    let mut encoder = GzEncoder::new(b"one\n".to_vec(), Compression::default());
    encoder.write_all(&[9, 9, 1, 2]).unwrap();
    let fields = "type: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: gz\nline skip: 1\nbyte skip: 2\n";
    assert_eq!(read_fields(fields, &encoder.finish().unwrap()).unwrap().value(1, 0, 0), 2.0);
    assert_eq!(message("byte skip: -2\n"), "the file is corrupt: its `byte skip` is \"-2\"; it must be a whole number");
    assert!(matches!(read("line skip: 99999999999\n", &[1, 2]), Err(VolumeError::Truncated { .. })));
    assert!(matches!(read("byte skip: 18446744073709551615\n", &[1, 2]), Err(VolumeError::Truncated { .. })));
    assert!(matches!(read("byte skip: -1\n", &[1]), Err(VolumeError::Truncated { .. })));
}

#[test]
fn every_type_in_both_byte_orders() {
    macro_rules! check {
        ($($type:ty: $names:expr),*) => {$(
            for name in $names {
                for (endian, bytes) in [("little", (77 as $type).to_le_bytes()), ("big", (77 as $type).to_be_bytes())] {
                    let fields = format!("type: {name}\ndimension: 3\nsizes: 1 1 1\nencoding: raw\nendian: {endian}\n");
                    assert_eq!(read_fields(&fields, &bytes).unwrap().value(0, 0, 0), 77.0, "{name}");
                }
            }
        )*};
    }
    check!(
        i8: ["signed char", "int8"], u8: ["uchar", "unsigned char", "uint8_t"], i16: ["short", "signed short int"],
        u16: ["ushort", "uint16"], i32: ["int", "int32_t"], u32: ["unsigned int", "uint"], i64: ["long long", "int64"],
        u64: ["unsigned long long int", "uint64"], f32: ["float"], f64: ["double"]
    );
}

#[test]
fn refusals_say_what_is_accepted() {
    let with = |field: &str, value: &str| {
        let fields: String = ["type: uchar", "dimension: 3", "sizes: 2 1 1", "encoding: raw"]
            .iter()
            .filter(|line| !line.starts_with(&format!("{field}:")))
            .map(|line| format!("{line}\n"))
            .collect();
        let line = if value.is_empty() { String::new() } else { format!("{field}: {value}\n") };
        read_fields(&(fields + &line), &[1, 2]).unwrap_err().to_string()
    };
    assert_eq!(with("encoding", "bzip2"), "unsupported: the encoding bzip2; accepted: raw, gzip, ascii");
    assert_eq!(with("encoding", ""), "the file is corrupt: its header has no `encoding`");
    assert_eq!(with("dimension", "4"), "unsupported: 4 axes; accepted: one scalar volume: 3 axes, all in space");
    assert_eq!(
        with("kinds", "vector domain domain"),
        "unsupported: an axis of kind vector; accepted: one scalar volume: 3 axes, all in space"
    );
    assert_eq!(
        with("space directions", "none (1,0,0) (0,1,0)"),
        "unsupported: an axis without direction (space directions: none (1,0,0) (0,1,0)); accepted: one scalar volume: \
         3 axes, all in space"
    );
    assert_eq!(with("sizes", "2 0 1"), "the file is corrupt: its `sizes` are 2 0 1; they must be three, of at least 1");
    assert_eq!(with("sizes", "2 1"), "the file is corrupt: its `sizes` are 2 1; they must be three, of at least 1");
    assert_eq!(
        with("type", "block"),
        "unsupported: voxels of type block; accepted: int8, uint8, int16, uint16, int32, uint32, int64, uint64, float, \
         double"
    );
    assert_eq!(with("type", "short"), "the file is corrupt: its header has no `endian`");
    assert_eq!(
        with("type", "short\nendian: middle"),
        "the file is corrupt: its `endian` is middle; it must be little or big"
    );
    assert_eq!(with("units", "\"ft\" \"mm\" \"mm\""), "unsupported: the unit \"ft\"; accepted: m, cm, mm, um, nm");
    assert!(with("space", "3D-left-handed").starts_with("unsupported: the space 3d-left-handed; accepted: "));
    assert!(with("data file", "LIST").starts_with("unsupported: voxels in several files (LIST)"));
    assert!(with("data file", "slice%03d.raw 1 20 1").starts_with("unsupported: voxels in several files"));
    assert!(with("spacings", "1 0 1").contains("the matrix of its spacings"));
    assert_eq!(message("type: uchar\n"), "the file is corrupt: its header has `type` twice");
    assert_eq!(
        message("nonsense\n"),
        "the file is corrupt: its header has the line \"nonsense\"; it must be `field: value`"
    );
    let error = read_nrrd("a.nrrd", b"NRRD0009\n", &Embedded::default(), BUDGET).unwrap_err();
    assert_eq!(error.to_string(), "not an NRRD file: it begins with \"NRRD0009\"; accepted: NRRD0001 to NRRD0005");
    let ascii = "type: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: ascii\n";
    assert_eq!(read_fields(ascii, b"1, 2.5").unwrap().value(1, 0, 0), 2.5);
    assert_eq!(
        read_fields(ascii, b"1 two").unwrap_err().to_string(),
        "the file is corrupt: a voxel is \"two\"; it must be a number"
    );
    assert!(matches!(read_fields(ascii, b"1   "), Err(VolumeError::Truncated { .. })));
    assert!(matches!(read_fields(ascii, b"1 nan"), Err(VolumeError::NotFinite { index: [1, 0, 0], .. })));
}

#[test]
fn nothing_is_allocated_that_a_file_merely_claims() {
    let fields = "type: double\nendian: big\ndimension: 3\nsizes: 4294967295 4294967295 4294967295\nencoding: ";
    for encoding in ["raw", "gzip", "ascii"] {
        let error = read_fields(&format!("{fields}{encoding}\n"), &[b'1'; 100]).unwrap_err();
        assert!(matches!(error, VolumeError::Truncated { .. }), "{error}");
    }
}
