//! Files that VTK itself wrote (`fixtures/make.py`), in every encoding, and damaged ones.

use glam::{DVec3, Vec3};
use proptest::prelude::*;

use super::*;
use crate::volume::tests::{BUDGET, apply, assert_valid, damage, damaged_cases, indices};

macro_rules! fixtures {
    ($($name:literal),*) => { [$(($name, include_bytes!(concat!("fixtures/", $name)).as_slice())),*] };
}

const MESHES: [(&str, &[u8]); 6] =
    fixtures!("ascii.vtu", "binary.vtu", "zlib.vtu", "appended.vtu", "raw_lz4.vtu", "appended_zlib.vtu");
const IMAGES: [(&str, &[u8]); 10] = fixtures!(
    "i8.vti", "u8.vti", "i16.vti", "u16.vti", "i32.vti", "u32.vti", "i64.vti", "u64.vti", "f32.vti", "f64.vti"
);

/// A file with a part of its text exchanged.
fn edited(file: &[u8], from: &str, to: &str) -> Vec<u8> {
    let text = std::str::from_utf8(file).unwrap();
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1).into_bytes()
}

/// One hexahedron (6 tetrahedra), a wedge (3), a pyramid (2) and a tetrahedron, conforming; a triangle is passed over.
/// f = x + 2y + 4z on points is reproduced everywhere, whatever the encoding.
#[test]
fn meshes_in_every_encoding() {
    let first = read_vtu(MESHES[0].1, Some("f"), BUDGET).unwrap();
    assert_eq!(first.count(), 6 + 3 + 2 + 1);
    let neighbours = |i: usize| first.neighbours(i).into_iter().flatten().count();
    let inner = (0..first.count()).map(neighbours).sum::<usize>();
    // Within the cells 6 + 2 + 1 faces, between them 2 + 2 + 1, each counted from both sides.
    assert_eq!(inner, 2 * (9 + 5));
    let map = first.world_from_unit();
    for (name, bytes) in MESHES {
        let mesh = read_vtu(bytes, None, BUDGET).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(mesh, first, "{name}");
        for world in [Vec3::new(0.3, 0.6, 0.2), Vec3::new(1.3, 0.2, 0.6), Vec3::new(0.5, 0.5, 1.7)] {
            let value = mesh.value(map.inverse().transform_point3(world)).unwrap();
            assert!((value - (world.x + 2.0 * world.y + 4.0 * world.z)).abs() < 1e-5, "{name}: {value} at {world}");
        }
        assert_eq!(mesh.value(map.inverse().transform_point3(Vec3::new(1.9, 0.9, 0.5))), None, "{name}");

        let cells = read_vtu(bytes, Some("number"), BUDGET).unwrap();
        for (world, number) in [(Vec3::new(0.3, 0.6, 0.2), 10.0), (Vec3::new(1.5, -0.3, 0.5), 13.0)] {
            assert_eq!(cells.value(map.inverse().transform_point3(world)), Some(number), "{name}");
        }
    }
}

/// Points (i, j, k) of extent 1–3, 0–1, −1–0 lie at (1, 2, 3) + R·(i/2, j, 2k), R a quarter turn about z.
#[test]
fn images_of_every_type() {
    for (name, bytes) in IMAGES {
        let grid = read_vti(bytes, None, BUDGET).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_valid(&grid, BUDGET);
        assert_eq!(grid.dims, [3, 2, 2], "{name}");
        for (n, [i, j, k]) in indices(grid.dims).enumerate() {
            assert_eq!(grid.value(i, j, k), n as f32 + 1.0, "{name}");
        }
        let at = |i: f32, j: f32, k: f32| grid.world_from_index.transform_point3(Vec3::new(i, j, k));
        assert_eq!([at(0.0, 0.0, 0.0), at(1.0, 1.0, 1.0)], [Vec3::new(1.0, 2.5, 1.0), Vec3::new(0.0, 3.0, 3.0)]);

        let cells = read_vti(bytes, Some("c"), BUDGET).unwrap();
        assert_eq!((cells.dims, cells.value(0, 0, 0), cells.value(1, 0, 0)), ([2, 1, 1], 7.0, 9.0), "{name}");
        let middle = cells.world_from_index.transform_point3(Vec3::ZERO);
        assert_eq!(middle, at(0.5, 0.5, 0.5), "{name}");
    }
}

#[test]
fn messages() {
    let mesh = |from: &str, to: &str| read_vtu(&edited(MESHES[0].1, from, to), None, BUDGET).unwrap_err().to_string();
    let image = |from: &str, to: &str| read_vti(&edited(IMAGES[3].1, from, to), None, BUDGET).unwrap_err().to_string();
    let cases = [
        (
            read_vtu(MESHES[0].1, Some("g"), BUDGET).unwrap_err().to_string(),
            "found no array named \"g\" on points or cells; accepted: the arrays \"f\", \"number\"",
        ),
        (
            mesh("<PointData Scalars=\"f\">", "<PointData>"),
            "found the arrays \"f\", \"number\"; accepted: the name of one array",
        ),
        (
            mesh("12 13 14 10 5", "12 13 14 24 5"),
            "unsupported: cell 3 of type 24 with 4 vertices; accepted: tetrahedra (10), voxels (11), hexahedra (12), \
             wedges (13) and pyramids (14) of 4, 8, 8, 6 and 5 vertices, and cells without volume (1 to 9)",
        ),
        (mesh("9 6 4 5 6 7", "9 6 4 5 6 77"), "the mesh is malformed: cell 2 names vertex 77; there are 12 vertices"),
        (
            mesh("8 14 19 23 26", "8 4 19 23 26"),
            "the file is corrupt: the offset of cell 1 is 4, after 8; offsets must ascend",
        ),
        (
            mesh("1 2\n        </DataArray>", "1\n        </DataArray>"),
            "the file is corrupt: the array \"connectivity\" ends at number 26; it must have more",
        ),
        (mesh("0 1 3 2 4 5", "0 1 x 2 4 5"), "the file is corrupt: the array \"f\", at number 3: \"x\" is no number"),
        (
            mesh("0 1 3 2 4 5", "0 1 nan 2 4 5"),
            "the mesh is malformed: value 2 of its vertices is NaN; it must be finite",
        ),
        (
            mesh("NumberOfPoints=\"12\"", "NumberOfPoints=\"a dozen\""),
            "the file is corrupt: NumberOfPoints of <Piece> is \"a dozen\"; it must be 1 numbers",
        ),
        (
            mesh("NumberOfPoints=\"12\"", "NumberOfPoints=\"1000000000000\""),
            "a mesh of 1000000000000 vertices and 0 tetrahedra needs 40000000000180 bytes while it is made; the budget \
             is 33554432",
        ),
        (
            mesh("<VTKFile", "<VTKFile compressor=\"vtkLZMADataCompressor\""),
            "unsupported: compressor \"vtkLZMADataCompressor\"; accepted: vtkZLibDataCompressor, vtkLZ4DataCompressor or \
             none",
        ),
        (
            read_vtu(IMAGES[3].1, None, BUDGET).unwrap_err().to_string(),
            "unsupported: a VTK file of \"ImageData\"; accepted: UnstructuredGrid in a .vtu",
        ),
        (
            image("<Piece Extent=\"1 3", "<Piece Extent=\"1 2"),
            "unsupported: a piece of extent [1, 2, 0, 1, -1, 0] of [1, 3, 0, 1, -1, 0]; accepted: one piece that is the \
             whole",
        ),
        (
            image("Direction=\"0 -1 0 1", "Direction=\"0 0 0 1"),
            "the file is corrupt: the matrix of its Origin, Spacing and Direction is [[0.0, 0.0, 0.0, 1.0], [0.5, 0.0, \
             0.0, 2.5], [0.0, 0.0, 2.0, 1.0], [0.0, 0.0, 0.0, 1.0]]; it must be finite and invertible",
        ),
    ];
    for (found, expected) in cases {
        assert_eq!(found, expected);
    }
    let error = read_vtu(b"<html></html>", None, BUDGET).unwrap_err().to_string();
    assert!(error.starts_with("not a VTK XML file: its root is <html>"), "{error}");
    let error = read_vtu(b"\x89PNG", None, BUDGET).unwrap_err().to_string();
    assert!(error.starts_with("not a VTK XML file: it is not UTF-8"), "{error}");
}

/// What a file claims is not believed: neither counts, nor blocks, nor depth.
#[test]
fn claims() {
    let huge = edited(IMAGES[3].1, "WholeExtent=\"1 3", "WholeExtent=\"1 2000000000");
    let huge = edited(&huge, "<Piece Extent=\"1 3", "<Piece Extent=\"1 2000000000");
    assert!(matches!(read_vti(&huge, None, Budget(u64::MAX)), Err(VolumeError::Truncated { .. })));
    assert!(matches!(read_vti(IMAGES[3].1, None, Budget(23)), Err(VolumeError::TooLarge { bytes: 24, .. })));
    assert!(matches!(read_vtu(MESHES[0].1, None, Budget(1871)), Err(VolumeError::MeshTooLarge { .. })));
    assert!(read_vtu(MESHES[0].1, None, Budget(1872)).is_ok());
    let deep = "<VTKFile>".repeat(100_000).into_bytes();
    assert!(read_vtu(&deep, None, BUDGET).is_err());
    // One block that is to be of 4 GiB, and one that LZ4 could not make.
    for (size, compressed) in [(u32::MAX, 8u32), (1 << 20, 8)] {
        let header: Vec<_> = [1, size, 0, compressed, 0, 0].into_iter().flat_map(u32::to_le_bytes).collect();
        let layout = blocks::Layout { big_endian: false, wide: false, codec: Some(blocks::Codec::Lz4) };
        let read = layout.open(&header[..]).and_then(|mut bytes| std::io::Read::read(&mut bytes, &mut [0; 8]));
        assert!(read.is_err(), "{size}");
    }
}

/// Whatever a damaged file is read as, or not: no panic.
fn read(bytes: &[u8]) {
    for name in [None, Some("number"), Some("c")] {
        if let Ok(mesh) = read_vtu(bytes, name, BUDGET) {
            assert!(mesh.count() > 0 && mesh.value(Vec3::splat(0.5)).is_none_or(f32::is_finite));
        }
        if let Ok(grid) = read_vti(bytes, name, BUDGET) {
            assert_valid(&grid, BUDGET);
        }
    }
}

#[test]
fn every_truncation() {
    for (_, bytes) in MESHES.into_iter().chain(IMAGES) {
        for end in 0..bytes.len() {
            read(&bytes[..end]);
        }
    }
}

proptest! {
    #![proptest_config(damaged_cases())]
    #[test]
    fn damaged(which in 0..MESHES.len() + IMAGES.len(), damage in damage()) {
        let (_, bytes) = MESHES.into_iter().chain(IMAGES).nth(which).unwrap();
        let mut bytes = bytes.to_vec();
        apply(&mut bytes, &damage);
        read(&bytes);
    }
}

#[test]
fn units_are_metres() {
    let mesh = read_vtu(MESHES[0].1, None, BUDGET).unwrap();
    let corner = mesh.world_from_unit().transform_point3(Vec3::ONE);
    assert_eq!(corner, DVec3::new(2.0, 1.0, 2.0).as_vec3());
}
