//! Accessors: typed columns of a buffer.

use gltf::Accessor;
use gltf::accessor::{DataType, Dimensions, sparse};

use super::super::SurfaceError;
use super::super::error::check_budget;
use super::container::Buffers;
use crate::volume::Budget;

/// The entries of an accessor, `N` numbers each: floats as they are, whole numbers divided by their largest where the accessor
/// is normalised.
pub(super) fn read<const N: usize>(
    accessor: &Accessor,
    buffers: &Buffers,
    budget: Budget,
) -> Result<Vec<[f32; N]>, SurfaceError> {
    let wrong = |what: String| SurfaceError::corrupt(format!("accessor {}: {what}", accessor.index()));
    let components = accessor.dimensions().multiplicity();
    let matrix = matches!(accessor.dimensions(), Dimensions::Mat2 | Dimensions::Mat3 | Dimensions::Mat4);
    if components != N || matrix {
        return Err(wrong(format!("entries of {components} numbers; accepted: {N}")));
    }
    check_budget("its vertices", accessor.count() as u64, size_of::<[f32; N]>(), budget)?;
    let kind = accessor.data_type();
    let normalized = accessor.normalized();
    let entry = |bytes: &[u8]| {
        let size = kind.size();
        std::array::from_fn(|i| number(&bytes[i * size..][..size], kind, normalized))
    };
    let size = N * kind.size();
    let mut entries: Vec<[f32; N]> = match accessor.view() {
        Some(view) => {
            let bytes = buffers.view(&view)?;
            let column = Column::of(bytes, accessor.offset(), view.stride(), size, accessor.count()).map_err(wrong)?;
            column.map(entry).collect()
        }
        // Only a sparse accessor replaces zeros; others without a view are all zeros, and so count for nothing.
        None if accessor.sparse().is_some() => vec![[0.0; N]; accessor.count()],
        None => return Err(wrong("no view".into())),
    };
    if let Some(sparse) = accessor.sparse() {
        let index_size = sparse.indices().index_type().size();
        let (indices, values) = (sparse.indices(), sparse.values());
        let (index_view, value_view) = (indices.view(), values.view());
        let index_bytes = buffers.view(&index_view)?;
        let index = Column::of(index_bytes, indices.offset(), index_view.stride(), index_size, sparse.count())
            .map_err(wrong)?;
        let value_bytes = buffers.view(&value_view)?;
        let value =
            Column::of(value_bytes, values.offset(), value_view.stride(), size, sparse.count()).map_err(wrong)?;
        let kind = match indices.index_type() {
            sparse::IndexType::U8 => DataType::U8,
            sparse::IndexType::U16 => DataType::U16,
            sparse::IndexType::U32 => DataType::U32,
        };
        for (index, value) in index.zip(value) {
            let index = whole(index, kind);
            let place = entries.get_mut(index as usize).ok_or_else(|| wrong(format!("replaces its entry {index}")))?;
            *place = entry(value);
        }
    }
    Ok(entries)
}

/// The entries of an accessor of indices.
pub(super) fn read_indices(accessor: &Accessor, buffers: &Buffers, budget: Budget) -> Result<Vec<u32>, SurfaceError> {
    let wrong = |what: String| SurfaceError::corrupt(format!("accessor {}: {what}", accessor.index()));
    let kind = accessor.data_type();
    if accessor.dimensions() != Dimensions::Scalar || !matches!(kind, DataType::U8 | DataType::U16 | DataType::U32) {
        return Err(wrong(format!("indices are {kind:?}; accepted: U8, U16 or U32")));
    }
    let (Some(view), None) = (accessor.view(), accessor.sparse()) else {
        return Err(wrong("indices that are sparse or have no view".into()));
    };
    check_budget("its indices", accessor.count() as u64, size_of::<u32>(), budget)?;
    let bytes = buffers.view(&view)?;
    let column = Column::of(bytes, accessor.offset(), view.stride(), kind.size(), accessor.count()).map_err(wrong)?;
    Ok(column.map(|bytes| whole(bytes, kind)).collect())
}

/// Entries of `size` bytes every `stride` bytes.
struct Column<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    left: usize,
}

impl<'a> Column<'a> {
    fn of(bytes: &'a [u8], offset: usize, stride: Option<usize>, size: usize, count: usize) -> Result<Self, String> {
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(format!("entries of {size} bytes every {stride}"));
        }
        let needed = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
        let rest = bytes.get(offset..).filter(|rest| needed.is_some_and(|needed| needed <= rest.len()));
        let rest = rest.ok_or_else(|| {
            format!("{count} entries every {stride} bytes, from byte {offset} on of a view of {}", bytes.len())
        })?;
        Ok(Self { bytes: rest, stride, size, left: count })
    }
}

impl<'a> Iterator for Column<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        self.left = self.left.checked_sub(1)?;
        let entry = &self.bytes[..self.size];
        // After the last entry there need be no whole stride.
        self.bytes = self.bytes.get(self.stride..).unwrap_or_default();
        Some(entry)
    }
}

fn whole(bytes: &[u8], kind: DataType) -> u32 {
    match (kind, bytes) {
        (DataType::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
        (DataType::U16, &[a, b]) => u16::from_le_bytes([a, b]).into(),
        (_, bytes) => bytes[0].into(),
    }
}

/// A number of an accessor. [glTF2, 3.11]
fn number(bytes: &[u8], kind: DataType, normalized: bool) -> f32 {
    let (value, largest) = match (kind, bytes) {
        (DataType::I8, &[a]) => (f32::from(a as i8), 127.0),
        (DataType::I16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32767.0),
        (DataType::F32, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
        (DataType::U8, bytes) => (whole(bytes, kind) as f32, 255.0),
        (_, bytes) => (whole(bytes, kind) as f32, if kind == DataType::U16 { 65535.0 } else { u32::MAX as f32 }),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}
