use super::*;
use crate::volume::tests::BUDGET;

/// A file of version 1 with this header.
fn file(header: &str, voxels: &[u8]) -> Vec<u8> {
    [MAGIC, &[1, 0], &(header.len() as u16).to_le_bytes(), header.as_bytes(), voxels].concat()
}

fn message(header: &str) -> String {
    match read_npy(&file(header, &[0; 64]), BUDGET) {
        Ok(grid) => format!("{:?}", grid.dims),
        Err(error) => error.to_string(),
    }
}

#[test]
fn every_type_in_both_byte_orders() {
    macro_rules! check {
        ($($type:ty: $descr:literal),*) => {$(
            for (order, bytes) in [("<", <$type>::to_le_bytes as fn($type) -> _), (">", <$type>::to_be_bytes)] {
                let header = format!("{{'descr': '{order}{}', 'fortran_order': False, 'shape': (1, 1, 2), }}", $descr);
                let voxels = [bytes(77u8.into()), bytes(78u8.into())].concat();
                let grid = read_npy(&file(&header, &voxels), BUDGET).unwrap();
                assert_eq!([grid.value(0, 0, 0), grid.value(1, 0, 0)], [77.0, 78.0], "{header}");
            }
        )*};
    }
    check!(u16: "u2", i16: "i2", u32: "u4", i32: "i4", u64: "u8", i64: "i8", half::f16: "f2", f32: "f4", f64: "f8");
    for (descr, value) in [("|u1", 255.0), ("|i1", -1.0)] {
        let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (1, 1, 1), }}");
        assert_eq!(read_npy(&file(&header, &[255]), BUDGET).unwrap().value(0, 0, 0), value);
    }
}

#[test]
fn refusals_say_what_is_accepted() {
    assert_eq!(message("{'shape': (4, 1, 2), \"descr\": '|b1','fortran_order': True}"), "[4, 1, 2]");
    for (shape, found) in
        [("(2, 3)", "(2, 3)"), ("(1, 2, 3, 4)", "(1, 2, 3, 4)"), ("()", "()"), ("(0, 2, 2)", "(0, 2, 2)")]
    {
        assert_eq!(
            message(&format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}")),
            format!("unsupported: an array of shape {found}; accepted: three axes [z][y][x] of at least one voxel")
        );
    }
    for descr in ["<c8", "<U4", "|O", "f4", "", "µ4"] {
        assert_eq!(
            message(&format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (1, 1, 1), }}")),
            match descr.is_ascii() {
                true => format!(
                    "unsupported: voxels of dtype {descr}; accepted: bool, int8 to int64, uint8 to uint64, float16, \
                     float32, float64"
                ),
                false => "the file is corrupt: its header is no text".into(),
            }
        );
    }
    assert!(
        message("{'descr': [('a', '<f4'), ('b', '<f4')], 'fortran_order': False, 'shape': (1, 1, 1), }")
            .starts_with("unsupported: voxels of dtype [('a', '<f4'), ('b', '<f4')]")
    );
    for header in [
        "",
        "{}",
        "{'descr': '<f4', }",
        "[",
        "{'descr': '<f4', 'fortran_order': 3, 'shape': (1, 1, 1)}",
        "{'shape': (1",
    ] {
        assert!(message(header).starts_with("the file is corrupt: its header is "), "{header}");
    }
    assert_eq!(
        read_npy(b"PK\x03\x04", BUDGET).unwrap_err().to_string(),
        "not a NumPy file: it begins with \"PK\\x03\\x04\"; accepted: \\x93NUMPY"
    );
    assert_eq!(
        read_npy(b"\x93NUMPY\x04\0........", BUDGET).unwrap_err().to_string(),
        "unsupported: a NumPy file of version 4; accepted: versions 1, 2, 3"
    );
    assert_eq!(
        read_npy(b"\x93NUMPY\x02\0\xff\xff\xff\xff", BUDGET).unwrap_err().to_string(),
        "the file is corrupt: its header has 4294967295 bytes; at most 65536 are read"
    );
    let huge = "{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296, 4294967296), }";
    assert_eq!(message(huge), "the file ends at byte 163, within the voxels");
}
