//! Reads VTK XML files: `.vtu` into a [`Mesh`], `.vti` into a [`Grid`].
//!
//! Source of the format: "VTK XML Formats", <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.
//! The crate `roxmltree` reads the XML; arrays are decoded value by value, so that nothing is kept that a file merely
//! claims to have. VTK knows no unit of length; it is taken as the metre.

mod array;
mod blocks;
mod document;
#[cfg(test)]
mod tests;

use glam::{DMat3, DMat4, DVec3, Mat4};

use super::bricks::Slices;
use super::grid::{Filled, Sample, invertible, smallest};
use super::mesh::{Cell, Mesh, Values};
use super::{Budget, Grid, VolumeError};
use array::Array;
use document::{Document, Element};

/// DEFLATE makes no more bytes than this of one, LZ4 fewer.
const MAX_RATIO: u64 = 1032;

/// Reads an `UnstructuredGrid` of one piece (`.vtu`) and the scalars on its points or cells: those of that `name` (of
/// points before cells), or without one the only ones, or the active ones.
///
/// Accepted cells are tetrahedra, hexahedra, voxels, wedges and pyramids; those of fewer dimensions are passed over.
///
/// # Errors
/// Any [`VolumeError`] but those of VDB and NIfTI, for other cells and whatever [`Mesh::new`] refuses among them.
pub fn read_vtu(bytes: &[u8], name: Option<&str>, budget: Budget) -> Result<Mesh, VolumeError> {
    let text = document::text(bytes)?;
    let xml = document::parse(&text)?;
    let document = Document::new(bytes, &xml, "UnstructuredGrid")?;
    let piece = document.piece()?;
    let [vertex_count, cell_count] = [piece.number("NumberOfPoints")?, piece.number("NumberOfCells")?];
    Mesh::check_size(vertex_count, cell_count, 0, budget)?;
    let (array, association) = scalars(&document, piece, name)?;

    let points = array_named(&document, piece.child("Points")?, None)?;
    points.check_components(3)?;
    let mut numbers = points.values()?;
    let mut vertices = Vec::new();
    for _ in 0..vertex_count {
        vertices.push(DVec3::new(numbers.next()?, numbers.next()?, numbers.next()?));
    }
    let (cells, kept) = cells(&document, piece.child("Cells")?, cell_count)?;
    let mut numbers = array.values()?;
    let mut read = |count| (0..count).map(|_| numbers.next().map(|value| value as f32)).collect::<Result<Vec<_>, _>>();
    let values = match association {
        Association::Point => Values::Vertices(read(vertex_count)?),
        Association::Cell => {
            let all = read(cell_count)?;
            Values::Cells(kept.into_iter().map(|cell| all[cell as usize]).collect())
        }
    };
    Mesh::new(&vertices, &cells, values, budget)
}

/// The cells that have a volume, and their numbers among all.
fn cells(document: &Document, element: Element, count: usize) -> Result<(Vec<Cell>, Vec<u32>), VolumeError> {
    let array = |name| array_named(document, element, Some(name));
    let (types, offsets, connectivity) = (array("types")?, array("offsets")?, array("connectivity")?);
    let (mut types, mut offsets, mut connectivity) = (types.values()?, offsets.values()?, connectivity.values()?);
    let (mut cells, mut kept) = (Vec::new(), Vec::new());
    let mut start = 0;
    for number in 0..count {
        let (kind, end) = (types.next_index()?, offsets.next_index()?);
        let vertices = end.checked_sub(start).filter(|_| end <= u64::from(u32::MAX)).ok_or_else(|| {
            VolumeError::corrupt(format!("the offset of cell {number} is {end}, after {start}; offsets must ascend"))
        })?;
        start = end;
        let mut indices = [0; 8];
        for place in 0..vertices {
            let index = connectivity.next_index()?;
            if let Some(slot) = indices.get_mut(place as usize) {
                *slot = u32::try_from(index).unwrap_or(u32::MAX);
            }
        }
        let [a, b, c, d, e, f, g, h] = indices;
        let cell = match (kind, vertices) {
            (1..=9, _) => continue,
            (10, 4) => Cell::Tetrahedron([a, b, c, d]),
            // A voxel is a box whose vertices are in the order of their coordinates.
            (11, 8) => Cell::Hexahedron([a, b, d, c, e, f, h, g]),
            (12, 8) => Cell::Hexahedron(indices),
            (13, 6) => Cell::Wedge([a, b, c, d, e, f]),
            (14, 5) => Cell::Pyramid([a, b, c, d, e]),
            _ => {
                return Err(VolumeError::Unsupported {
                    found: format!("cell {number} of type {kind} with {vertices} vertices"),
                    accepted: "tetrahedra (10), voxels (11), hexahedra (12), wedges (13) and pyramids (14) of 4, 8, 8, \
                               6 and 5 vertices, and cells without volume (1 to 9)",
                });
            }
        };
        cells.push(cell);
        kept.push(number as u32);
    }
    Ok((cells, kept))
}

/// Reads an `ImageData` of one piece (`.vti`) and the scalars on its points or cells, chosen as by [`read_vtu`].
///
/// Voxels have their centres at the points, or in the middle of the cells.
///
/// # Errors
/// Any [`VolumeError`] but those of VDB, NIfTI and meshes.
pub fn read_vti(bytes: &[u8], name: Option<&str>, budget: Budget) -> Result<Grid, VolumeError> {
    let text = document::text(bytes)?;
    let xml = document::parse(&text)?;
    let document = Document::new(bytes, &xml, "ImageData")?;
    let piece = document.piece()?;
    let whole: [i64; 6] = document.content.numbers("WholeExtent")?;
    let extent: [i64; 6] = piece.numbers("Extent")?;
    if extent != whole {
        return Err(VolumeError::Unsupported {
            found: format!("a piece of extent {extent:?} of {whole:?}"),
            accepted: "one piece that is the whole",
        });
    }
    let (array, association) = scalars(&document, piece, name)?;
    let first = [extent[0], extent[2], extent[4]];
    let points = u64::from(association == Association::Point);
    let dims = [0, 1, 2].map(|axis| u64::try_from(extent[2 * axis + 1].saturating_sub(first[axis])).ok());
    let dims = dims.map(|n| n.map_or(0, |n| n.saturating_add(points)));
    if dims.contains(&0) {
        return Err(VolumeError::corrupt(format!("its extent, {extent:?}, holds nothing")));
    }
    let count = dims.iter().fold(1u64, |count, &n| count.saturating_mul(n));
    if count > (bytes.len() as u64).saturating_mul(MAX_RATIO) {
        return Err(VolumeError::Truncated { what: "the voxels", at: bytes.len() as u64 });
    }
    let middle = 0.5 * (1 - points) as f64;
    let world_from_index = world_from_index(document.content, DVec3::from(first.map(|n| n as f64)) + middle)?;
    let voxels = smallest(|| fill(&array, dims, budget), || fill(&array, dims, budget))?;
    Ok(Grid::bricked(dims.map(|n| n as u32), voxels, world_from_index))
}

fn fill<T: Sample>(array: &Array, dims: [u64; 3], budget: Budget) -> Result<Filled<T>, VolumeError> {
    let mut slices = Slices::new(dims, budget)?;
    let mut numbers = array.values()?;
    for _ in 0..dims.iter().product::<u64>() {
        slices.push_value(numbers.next()?)?;
        if !slices.exact() {
            break;
        }
    }
    Ok(slices.finish())
}

/// x = Origin + Direction · (Spacing ∘ (index + first)), Direction a matrix by rows.
fn world_from_index(image: Element, first: DVec3) -> Result<Mat4, VolumeError> {
    let origin = DVec3::from(image.numbers_or("Origin", [0.0; 3])?);
    let spacing = DVec3::from(image.numbers_or("Spacing", [1.0; 3])?);
    let direction = image.numbers_or("Direction", [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])?;
    let axes = DMat3::from_cols_array(&direction).transpose();
    let matrix = DMat4::from_translation(origin)
        * DMat4::from_mat3(axes)
        * DMat4::from_scale(spacing)
        * DMat4::from_translation(first);
    invertible(matrix, "Origin, Spacing and Direction")
}

/// What values belong to.
#[derive(Clone, Copy, PartialEq)]
enum Association {
    Point,
    Cell,
}

/// The scalars that were asked for.
fn scalars<'f>(
    document: &Document<'f>,
    piece: Element<'f>,
    name: Option<&str>,
) -> Result<(Array<'f>, Association), VolumeError> {
    let mut arrays = Vec::new();
    let mut active = Vec::new();
    for (element, association) in [("PointData", Association::Point), ("CellData", Association::Cell)] {
        let Ok(data) = piece.child(element) else { continue };
        active.extend(data.attribute("Scalars").map(str::to_owned));
        for array in data.children("DataArray") {
            arrays.push((array.attribute("Name").unwrap_or_default().to_owned(), array, association));
        }
    }
    let available = || arrays.iter().map(|(name, ..)| name.clone()).collect::<Vec<_>>();
    let found = match (name, &arrays[..], &active[..]) {
        (Some(name), ..) => arrays
            .iter()
            .find(|array| array.0 == name)
            .ok_or_else(|| VolumeError::NoSuchArray { name: name.to_owned(), available: available() })?,
        (None, [only], _) => only,
        (None, _, [active]) => {
            let found = arrays.iter().find(|array| array.0 == *active);
            found.ok_or_else(|| VolumeError::NoArrayNamed { available: available() })?
        }
        _ => return Err(VolumeError::NoArrayNamed { available: available() }),
    };
    let array = Array::new(document, found.1)?;
    array.check_components(1)?;
    Ok((array, found.2))
}

/// An element's only array, or that of a name.
fn array_named<'f>(
    document: &Document<'f>,
    element: Element<'f>,
    name: Option<&str>,
) -> Result<Array<'f>, VolumeError> {
    let mut arrays = element.children("DataArray");
    let found = arrays.find(|array| name.is_none() || array.attribute("Name") == name);
    let found = found.ok_or_else(|| {
        VolumeError::corrupt(format!("<{}> has no array {}", element.name(), name.unwrap_or("of points")))
    })?;
    Array::new(document, found)
}
