//! A NanoVDB grid as it is in memory: a root, nodes of 32³ nodes of 16³ leaves of 8³ voxels.

use std::collections::BTreeSet;

use super::values::Layout;
use crate::volume::VolumeError;

/// Bytes a grid's own data takes; the tree follows.
const GRID: usize = 672;
/// Where the grid's data has its type.
const GRID_TYPE: usize = 636;
/// Voxels along an edge of a leaf, of a node of leaves, and of a child of the root.
const LEAF: i64 = 8;
const LOWER: i64 = 16 * LEAF;
const UPPER: i64 = 32 * LOWER;

/// Bytes that may be fewer than expected.
#[derive(Clone, Copy)]
pub struct Bytes<'a>(pub &'a [u8]);

impl<'a> Bytes<'a> {
    pub fn slice(self, at: usize, count: usize) -> Result<&'a [u8], VolumeError> {
        let slice = self.0.get(at..).and_then(|rest| rest.get(..count));
        slice.ok_or(VolumeError::Truncated { what: "a NanoVDB grid", at: self.0.len() as u64 })
    }

    pub fn array<const N: usize>(self, at: usize) -> Result<[u8; N], VolumeError> {
        let mut array = [0; N];
        array.copy_from_slice(self.slice(at, N)?);
        Ok(array)
    }

    pub fn u32(self, at: usize) -> Result<u32, VolumeError> {
        Ok(u32::from_le_bytes(self.array(at)?))
    }

    pub fn f32(self, at: usize) -> Result<f32, VolumeError> {
        Ok(f32::from_le_bytes(self.array(at)?))
    }

    /// What lies at the signed 64-bit offset at `at`, counted from `base`.
    fn offset(self, base: usize, at: usize) -> Result<usize, VolumeError> {
        let offset = i64::from_le_bytes(self.array(at)?);
        let place = i64::try_from(base).ok().and_then(|base| base.checked_add(offset));
        let place = place.and_then(|place| usize::try_from(place).ok()).filter(|&place| place < self.0.len());
        place.ok_or_else(|| VolumeError::corrupt(format!("a node lies {offset} bytes after byte {base} of its grid")))
    }

    fn bit(self, at: usize, bit: usize) -> Result<bool, VolumeError> {
        Ok(self.array::<1>(at + bit / 8)?[0] >> (bit % 8) & 1 != 0)
    }
}

/// The layout of the nodes of one level.
struct Level {
    /// Entries along an edge.
    edge: usize,
    /// Voxels along an edge of an entry.
    voxels: i64,
    /// Where the table of values and children begins.
    table: usize,
    /// The level of the children; that of leaves has none.
    below: Option<&'static Level>,
}

static UPPER_LEVEL: Level = Level { edge: 32, voxels: LOWER, table: 8256, below: Some(&LOWER_LEVEL) };
static LOWER_LEVEL: Level = Level { edge: 16, voxels: LEAF, table: 1088, below: None };
/// Where the masks of a node begin: first of its active values, then of its children.
const MASKS: usize = 32;

/// The tree of a grid.
pub struct Tree<'a> {
    memory: Bytes<'a>,
    layout: Layout,
    root: usize,
}

/// Lowest and highest index.
type Box3 = ([i64; 3], [i64; 3]);

/// What a walk meets. Coordinates are the grid's own.
#[derive(Clone, Copy)]
pub struct Cell<'a> {
    origin: [i64; 3],
    /// Voxels along an edge.
    edge: i64,
    values: Values<'a>,
}

#[derive(Clone, Copy)]
enum Values<'a> {
    /// One value for all, and whether it is active.
    Tile(f64, bool),
    /// A leaf's own.
    Leaf(Bytes<'a>, Layout),
}

impl<'a> Tree<'a> {
    /// The tree of a grid; of vectors, that of their component.
    pub fn new(memory: Bytes<'a>, component: Option<usize>) -> Result<Self, VolumeError> {
        let layout = Layout::new(memory.u32(GRID_TYPE)?, component)?;
        let root = memory.offset(GRID, GRID + 24)?;
        Ok(Self { memory, layout, root })
    }

    pub fn background(&self) -> Result<f64, VolumeError> {
        self.layout.background(self.memory, self.root)
    }

    /// Shows every tile and leaf to `visit`; they are disjoint.
    ///
    /// Errors: those of `visit`, and [`VolumeError`]s of a malformed tree.
    pub fn walk(&self, visit: &mut dyn FnMut(&Cell) -> Result<(), VolumeError>) -> Result<(), VolumeError> {
        const ENTRY: usize = 32;
        let mut walk = Walk { memory: self.memory, layout: self.layout, seen: BTreeSet::new(), visit };
        let mut origins = BTreeSet::new();
        for i in 0..self.memory.u32(self.root + 24)? as usize {
            let at = self.root + self.layout.root + ENTRY * i;
            let key = u64::from_le_bytes(self.memory.array(at)?);
            // 21 bits a coordinate; the highest becomes its sign.
            let origin = [42, 21, 0].map(|shift| i64::from(((key >> shift) << 12) as u32 as i32));
            if !origins.insert(origin) {
                return Err(VolumeError::corrupt(format!("the root has two entries at {origin:?}")));
            }
            if i64::from_le_bytes(self.memory.array(at + 8)?) != 0 {
                walk.node(self.memory.offset(self.root, at + 8)?, origin, &UPPER_LEVEL)?;
            } else {
                let value = self.layout.value(self.memory, at + self.layout.tile)?;
                let values = Values::Tile(value, self.memory.u32(at + 16)? != 0);
                (walk.visit)(&Cell { origin, edge: UPPER, values })?;
            }
        }
        Ok(())
    }
}

struct Walk<'a, 'v> {
    memory: Bytes<'a>,
    layout: Layout,
    /// The nodes that were met: one that is met again could make a small file take long.
    seen: BTreeSet<usize>,
    visit: &'v mut dyn FnMut(&Cell) -> Result<(), VolumeError>,
}

impl Walk<'_, '_> {
    fn node(&mut self, node: usize, origin: [i64; 3], level: &Level) -> Result<(), VolumeError> {
        self.enter(node)?;
        let edge = level.edge;
        let masks = edge * edge * edge / 8;
        for entry in 0..edge * edge * edge {
            let place = [entry / (edge * edge), entry / edge % edge, entry % edge];
            let origin = [0, 1, 2].map(|axis| origin[axis] + place[axis] as i64 * level.voxels);
            let at = node + level.table + self.layout.entry * entry;
            if !self.memory.bit(node + MASKS + masks, entry)? {
                let values = Values::Tile(self.layout.value(self.memory, at)?, self.memory.bit(node + MASKS, entry)?);
                (self.visit)(&Cell { origin, edge: level.voxels, values })?;
                continue;
            }
            let child = self.memory.offset(node, at)?;
            match level.below {
                Some(below) => self.node(child, origin, below)?,
                None => {
                    self.enter(child)?;
                    let leaf = self.layout.leaf(self.memory, child)?;
                    (self.visit)(&Cell { origin, edge: LEAF, values: Values::Leaf(leaf, self.layout) })?;
                }
            }
        }
        Ok(())
    }

    fn enter(&mut self, node: usize) -> Result<(), VolumeError> {
        if self.seen.insert(node) {
            return Ok(());
        }
        Err(VolumeError::corrupt(format!("the node at byte {node} of its grid has two parents")))
    }
}

impl Cell<'_> {
    /// The value of all voxels, if they have one.
    pub fn tile(&self) -> Option<f64> {
        match self.values {
            Values::Tile(value, _) => Some(value),
            Values::Leaf(..) => None,
        }
    }

    /// The value of a voxel within the cell.
    pub fn value(&self, index: [i64; 3]) -> Result<f64, VolumeError> {
        match self.values {
            Values::Tile(value, _) => Ok(value),
            Values::Leaf(leaf, layout) => layout.voxel(leaf, self.voxel(index)),
        }
    }

    /// Place of a voxel in its leaf.
    fn voxel(&self, index: [i64; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis| (index[axis] - self.origin[axis]) as usize);
        64 * x + 8 * y + z
    }

    /// Lowest and highest index of the active voxels.
    fn active(&self) -> Result<Option<Box3>, VolumeError> {
        const MASK: usize = 16;
        let leaf = match self.values {
            Values::Tile(_, false) => return Ok(None),
            Values::Tile(_, true) => return Ok(Some((self.origin, self.origin.map(|n| n + self.edge - 1)))),
            Values::Leaf(leaf, _) => leaf,
        };
        let mut extent = None;
        for voxel in 0..512 {
            if leaf.bit(MASK, voxel)? {
                let place = [voxel / 64, voxel / 8 % 8, voxel % 8];
                let index = [0, 1, 2].map(|axis| self.origin[axis] + place[axis] as i64);
                extent = Some(union(extent, (index, index)));
            }
        }
        Ok(extent)
    }
}

fn union(a: Option<Box3>, b: Box3) -> Box3 {
    let a = a.unwrap_or(b);
    ([0, 1, 2].map(|axis| a.0[axis].min(b.0[axis])), [0, 1, 2].map(|axis| a.1[axis].max(b.1[axis])))
}

/// Lowest and highest index of all active voxels; `None` without any.
pub struct Extent(Option<Box3>);

impl Extent {
    pub fn of(tree: &Tree) -> Result<Self, VolumeError> {
        let mut extent = None;
        tree.walk(&mut |cell| {
            if let Some(active) = cell.active()? {
                extent = Some(union(extent, active));
            }
            Ok(())
        })?;
        Ok(Self(extent))
    }

    /// Index, in the file, of the first voxel of the result: there is a border of one voxel.
    pub fn origin(&self) -> [i64; 3] {
        self.0.map_or([0; 3], |(low, _)| low.map(|n| n - 1))
    }

    /// Voxels of the result.
    pub fn dims(&self) -> [u64; 3] {
        self.0.map_or([1; 3], |(low, high)| [0, 1, 2].map(|axis| (high[axis] - low[axis] + 3) as u64))
    }

    /// Lowest and highest index that the cell has within.
    pub fn within(&self, cell: &Cell) -> Option<Box3> {
        let (low, high) = self.0?;
        let low = [0, 1, 2].map(|axis| low[axis].max(cell.origin[axis]));
        let high = [0, 1, 2].map(|axis| high[axis].min(cell.origin[axis] + cell.edge - 1));
        (0..3).all(|axis| low[axis] <= high[axis]).then_some((low, high))
    }

    /// A voxel's place in the result.
    pub fn place(&self, index: [i64; 3]) -> [usize; 3] {
        let origin = self.origin();
        [0, 1, 2].map(|axis| (index[axis] - origin[axis]) as usize)
    }
}
