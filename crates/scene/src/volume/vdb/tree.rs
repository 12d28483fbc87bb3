//! Walks the tree of a VDB grid: a root, nodes of 32³ nodes of 16³ leaves of 8³ voxels.
//!
//! Source of the format: OpenVDB, tree/RootNode.h, tree/InternalNode.h, tree/LeafNode.h. A file has the shape of the
//! tree first, with the values of tiles (cubes of one value, in place of a child), and then the values of all leaves.

use super::cursor::Cursor;
use super::values::{Encoding, Mask, ValueReader, count_on, is_on, read_mask};
use crate::volume::VolumeError;

/// Voxels along an edge of a leaf, of a node of leaves, and of a child of the root.
const LEAF: i64 = 8;
const LOWER: i64 = 16 * LEAF;
const UPPER: i64 = 32 * LOWER;

/// The active voxels of a leaf, voxel (x, y, z) at bit `64 * x + 8 * y + z`.
pub(super) type LeafMask = [u64; 8];

/// What a walk meets. Coordinates are the grid's own.
pub(super) trait Visit {
    /// A cube of `edge`³ voxels of one value.
    fn tile(&mut self, origin: [i64; 3], edge: i64, value: f32, active: bool) -> Result<(), VolumeError>;
    /// A leaf of 8³ voxels.
    fn leaf(&mut self, origin: [i64; 3], active: &LeafMask) -> Result<(), VolumeError>;
}

/// A tree whose shape begins at a cursor.
pub(super) struct Tree<'a> {
    start: Cursor<'a>,
    encoding: Encoding,
    pub background: f32,
}

impl<'a> Tree<'a> {
    pub fn new(mut cursor: Cursor<'a>, encoding: Encoding) -> Result<Self, VolumeError> {
        let buffers = cursor.u32("a tree")?;
        if buffers != 1 {
            return Err(VolumeError::Unsupported {
                found: format!("a tree of {buffers} buffers"),
                accepted: "one buffer",
            });
        }
        let background = encoding.value(&mut cursor, "a tree's background")?;
        Ok(Self { start: cursor, encoding, background })
    }

    /// Reads its values.
    pub fn values(&self) -> ValueReader {
        ValueReader::new(self.encoding, self.background)
    }

    /// Shows every tile and leaf to `visit`, leaves in the order of their values; gives the position of those values.
    ///
    /// Errors: those of `visit`, and [`VolumeError`]s of a malformed tree. Tiles of the root come first; all others,
    /// and all leaves, are disjoint.
    pub fn walk(&self, visit: &mut impl Visit) -> Result<Cursor<'a>, VolumeError> {
        let mut walk = Walk {
            cursor: self.start.clone(),
            encoding: self.encoding,
            reader: self.values(),
            upper: Node::new(32),
            lower: Node::new(16),
            visit,
        };
        let tiles = walk.cursor.u32("the root")?;
        let children = walk.cursor.u32("the root")?;
        let mut last = None;
        for _ in 0..tiles {
            let origin = walk.origin(&mut last)?;
            let value = self.encoding.value(&mut walk.cursor, "a tile of the root")?;
            let active = walk.cursor.u8("a tile of the root")? != 0;
            walk.visit.tile(origin, UPPER, value, active)?;
        }
        last = None;
        for _ in 0..children {
            let origin = walk.origin(&mut last)?;
            walk.upper(origin)?;
        }
        Ok(walk.cursor)
    }

    /// Moves `cursor` from the beginning of a leaf's values to the values proper.
    pub fn enter_leaf(&self, cursor: &mut Cursor, active: &LeafMask) -> Result<(), VolumeError> {
        let mut again = [0; 8];
        read_mask(cursor, &mut again, "a leaf's mask")?;
        if again != *active {
            return Err(VolumeError::corrupt("a leaf has other active voxels beside its values than in its tree"));
        }
        if !self.encoding.node_codes {
            cursor.take(12, "a leaf's origin")?;
            let buffers = cursor.u8("a leaf's buffers")?;
            if buffers != 1 {
                return Err(VolumeError::Unsupported {
                    found: format!("a leaf of {buffers} buffers"),
                    accepted: "one buffer",
                });
            }
        }
        Ok(())
    }
}

/// The table of an internal node.
struct Node {
    /// Entries along an edge.
    edge: i64,
    children: Vec<u64>,
    active: Vec<u64>,
    values: Vec<f32>,
}

impl Node {
    fn new(edge: i64) -> Self {
        let count = (edge * edge * edge) as usize;
        Self { edge, children: vec![0; count / 64], active: vec![0; count / 64], values: vec![0.0; count] }
    }

    fn read(&mut self, cursor: &mut Cursor, encoding: Encoding, reader: &mut ValueReader) -> Result<(), VolumeError> {
        read_mask(cursor, &mut self.children, "a node's children")?;
        read_mask(cursor, &mut self.active, "a node's active values")?;
        if encoding.node_codes {
            return reader.read(cursor, &self.active, &mut self.values);
        }
        // Older files have no value for a child: read the others, then move each to its place, the last one first.
        let mut count = self.values.len() - count_on(&self.children);
        reader.read(cursor, &self.active, &mut self.values[..count])?;
        for i in (0..self.values.len()).rev().filter(|&i| !is_on(&self.children, i)) {
            count -= 1;
            self.values[i] = self.values[count];
        }
        Ok(())
    }

    /// Origin of an entry's voxels, in a node at `origin` whose entries have `voxels` along an edge.
    fn child_origin(&self, origin: [i64; 3], entry: usize, voxels: i64) -> [i64; 3] {
        let entry = entry as i64;
        let place = [entry / (self.edge * self.edge), entry / self.edge % self.edge, entry % self.edge];
        [0, 1, 2].map(|axis| origin[axis] + place[axis] * voxels)
    }
}

struct Walk<'a, 'v, V> {
    cursor: Cursor<'a>,
    encoding: Encoding,
    reader: ValueReader,
    /// One table a level: a node is done with its tiles before its first child is read.
    upper: Node,
    lower: Node,
    visit: &'v mut V,
}

impl<V: Visit> Walk<'_, '_, V> {
    /// Origin of the next entry of the root. As OpenVDB sorts them, entries that do not ascend would be read in another
    /// order than they were written; and entries at one place could make a small file take long.
    fn origin(&mut self, last: &mut Option<[i64; 3]>) -> Result<[i64; 3], VolumeError> {
        let mut origin = [0; 3];
        for coordinate in &mut origin {
            *coordinate = i64::from(self.cursor.i32("an entry of the root")?);
        }
        if origin.iter().any(|coordinate| coordinate % UPPER != 0) || last.is_some_and(|last| last >= origin) {
            return Err(VolumeError::corrupt(format!(
                "the root has an entry at {origin:?}; entries lie at multiples of {UPPER}, in ascending order"
            )));
        }
        *last = Some(origin);
        Ok(origin)
    }

    fn upper(&mut self, origin: [i64; 3]) -> Result<(), VolumeError> {
        self.upper.read(&mut self.cursor, self.encoding, &mut self.reader)?;
        tiles(&self.upper, origin, LOWER, self.visit)?;
        for entry in entries_on(&self.upper.children, self.upper.values.len()) {
            let origin = self.upper.child_origin(origin, entry, LOWER);
            self.lower.read(&mut self.cursor, self.encoding, &mut self.reader)?;
            tiles(&self.lower, origin, LEAF, self.visit)?;
            for entry in entries_on(&self.lower.children, self.lower.values.len()) {
                let mut active = [0; 8];
                read_mask(&mut self.cursor, &mut active, "a leaf's mask")?;
                self.visit.leaf(self.lower.child_origin(origin, entry, LEAF), &active)?;
            }
        }
        Ok(())
    }
}

fn tiles(node: &Node, origin: [i64; 3], voxels: i64, visit: &mut impl Visit) -> Result<(), VolumeError> {
    for entry in (0..node.values.len()).filter(|&entry| !is_on(&node.children, entry)) {
        let active = is_on(&node.active, entry);
        visit.tile(node.child_origin(origin, entry, voxels), voxels, node.values[entry], active)?;
    }
    Ok(())
}

fn entries_on(mask: &Mask, count: usize) -> impl Iterator<Item = usize> {
    (0..count).filter(|&entry| is_on(mask, entry))
}
