use super::*;
use crate::assets::Embedded;
use crate::volume::tests::BUDGET;

/// Reads two voxels along x after a header of these lines and what must be there.
fn read(lines: &str, data: &[u8]) -> Result<Grid, VolumeError> {
    let header = format!("ObjectType = Image\nNDims = 3\nDimSize = 2 1 1\n{lines}ElementDataFile = LOCAL\n");
    read_meta_image("a.mha", &[header.as_bytes(), data].concat(), &Embedded::default(), BUDGET)
}

fn values(lines: &str, data: &[u8]) -> [f32; 2] {
    let grid = read(lines, data).unwrap();
    [grid.value(0, 0, 0), grid.value(1, 0, 0)]
}

fn message(lines: &str) -> String {
    read(lines, &[1, 2]).unwrap_err().to_string()
}

#[test]
fn every_type_in_both_byte_orders() {
    macro_rules! check {
        ($($type:ty: $names:expr),*) => {$(
            for name in $names {
                let [a, b] = [77 as $type, 78 as $type];
                let lines = format!("ElementType = {name}\n");
                assert_eq!(values(&lines, &[a.to_le_bytes(), b.to_le_bytes()].concat()), [77.0, 78.0]);
                for key in ["BinaryDataByteOrderMSB", "ElementByteOrderMSB"] {
                    let lines = format!("{lines}{key} = True\r\n");
                    assert_eq!(values(&lines, &[a.to_be_bytes(), b.to_be_bytes()].concat()), [77.0, 78.0]);
                }
            }
        )*};
    }
    check!(
        i8: ["MET_CHAR"], u8: ["MET_UCHAR"], i16: ["MET_SHORT"], u16: ["MET_USHORT"], i32: ["MET_INT", "MET_LONG"],
        u32: ["MET_UINT", "MET_ULONG"], i64: ["MET_LONG_LONG"], u64: ["MET_ULONG_LONG"], f32: ["MET_FLOAT"],
        f64: ["MET_DOUBLE"]
    );
}

#[test]
fn text_and_other_headers() {
    assert_eq!(values("ElementType = MET_UCHAR\nBinaryData = False\n", b"3 4\n"), [3.0, 4.0]);
    assert_eq!(values("ElementType = MET_UCHAR\nHeaderSize = 3\n", &[9, 9, 9, 1, 2]), [1.0, 2.0]);
    assert_eq!(values("ElementType = MET_UCHAR\nHeaderSize = -1\n", &[9, 9, 1, 2]), [1.0, 2.0]);
}

#[test]
fn refusals_say_what_is_accepted() {
    let byte = "ElementType = MET_UCHAR\n";
    assert_eq!(message(""), "the file is corrupt: its header has no ElementType");
    assert!(
        message("ElementType = MET_STRING\n").starts_with("unsupported: ElementType = MET_STRING; accepted: MET_CHAR")
    );
    assert_eq!(
        message(&format!("{byte}ElementNumberOfChannels = 3\n")),
        "unsupported: ElementNumberOfChannels = 3; accepted: one scalar volume: NDims = 3, ElementNumberOfChannels = 1"
    );
    assert!(message(&format!("{byte}NDims = 2\n")).starts_with("unsupported: NDims = 2; "));
    assert_eq!(
        message(&format!("{byte}DimSize = 2 0 1\n")),
        "the file is corrupt: its DimSize is \"2 0 1\"; it must be three sizes of at least 1"
    );
    assert_eq!(
        message(&format!("{byte}ElementSpacing = 1 1\n")),
        "the file is corrupt: its ElementSpacing is \"1 1\"; it must be 3 numbers"
    );
    assert_eq!(
        message(&format!("{byte}CompressedData = maybe\n")),
        "the file is corrupt: its CompressedData is \"maybe\"; it must be True or False"
    );
    assert!(message(&format!("{byte}ElementSpacing = 1 0 1\n")).contains("TransformMatrix and ElementSpacing"));
    assert!(message(&format!("{byte}CompressedData = True\n")).starts_with("the file is corrupt: Zlib, 0 bytes into"));
    let huge = format!("{byte}DimSize = 4294967295 4294967295 4294967295\n");
    assert!(message(&huge).starts_with("the file ends at byte 2, within the voxels"));
    let read = |bytes: &[u8]| read_meta_image("a.mha", bytes, &Embedded::default(), BUDGET).unwrap_err().to_string();
    assert_eq!(
        read(b"no volume"),
        "not a MetaImage file: it begins with \"no volum\"; accepted: lines `Name = value`, ElementDataFile last"
    );
    assert!(read(b"ElementDataFile = LIST\n").starts_with("the file is corrupt: its header has no DimSize"));
}
