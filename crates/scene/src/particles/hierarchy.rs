//! A hierarchy of boxes over bodies that are far smaller than the space they fill, for queries at a point and along a ray.

use glam::{DVec3, Vec3};

/// A binary tree of boxes, split at the median of the longest axis: half of the bodies on either side, so that bodies far
/// from all others cost nothing.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    /// The root first.
    nodes: Vec<Node>,
    /// The bodies, those of a leaf side by side.
    order: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Of a leaf its first place in the order, else the first of two nodes.
    first: u32,
    /// The bodies of a leaf, or [`INNER`].
    count: u32,
}

const INNER: u32 = u32::MAX;

/// The most bodies of a leaf.
const LEAF: usize = 4;

/// Nodes that wait on the way down: one a level, and halving 2³² bodies takes 32 levels.
const DEEPEST: usize = 64;

impl Hierarchy {
    /// Bytes that it takes for each body, at most.
    pub const BYTES: u64 = 4 + size_of::<Node>() as u64;

    /// A hierarchy over the bodies' boxes: lowest and highest corners [m].
    pub fn new(boxes: &[[Vec3; 2]]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = vec![Node { low: Vec3::ZERO, high: Vec3::ZERO, first: 0, count: 0 }];
        let mut open = vec![(0, 0..boxes.len())];
        while let Some((node, range)) = open.pop() {
            let part = &mut order[range.clone()];
            let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            let (mut first, mut last) = (low, high);
            for &body in part.iter() {
                let [a, b] = boxes[body as usize];
                (low, high) = (low.min(a), high.max(b));
                (first, last) = (first.min(a + b), last.max(a + b));
            }
            if part.len() <= LEAF {
                nodes[node] = Node { low, high, first: range.start as u32, count: part.len() as u32 };
                continue;
            }
            let axis = (last - first).max_position();
            let middle = part.len() / 2;
            let place = |body: &u32| boxes[*body as usize][0][axis] + boxes[*body as usize][1][axis];
            part.select_nth_unstable_by(middle, |a, b| place(a).total_cmp(&place(b)));
            let children = nodes.len();
            nodes[node] = Node { low, high, first: children as u32, count: INNER };
            nodes.extend([nodes[node]; 2]);
            open.push((children, range.start..range.start + middle));
            open.push((children + 1, range.start + middle..range.end));
        }
        Self { nodes, order }
    }

    /// Visits the bodies whose boxes may contain a point [m].
    #[inline]
    pub fn at(&self, point: DVec3, mut visit: impl FnMut(usize)) {
        let mut waiting = [0u32; DEEPEST];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let node = &self.nodes[waiting[count] as usize];
            if point.cmplt(node.low.as_dvec3()).any() || point.cmpgt(node.high.as_dvec3()).any() {
                continue;
            }
            if node.count == INNER {
                (waiting[count], waiting[count + 1]) = (node.first, node.first + 1);
                count += 2;
            } else {
                self.leaf(node).for_each(&mut visit);
            }
        }
    }

    /// Visits the bodies whose boxes a ray may meet, about from near to far: from `origin` [m] along `direction` (of any
    /// length, in which `from` and `to` count). `visit` is told a body and the end of the ray, and gives what is to be its
    /// end from then on.
    #[inline]
    pub fn along(&self, origin: DVec3, direction: DVec3, from: f64, to: f64, mut visit: impl FnMut(usize, f64) -> f64) {
        let inverse = direction.recip();
        let mut end = to;
        let mut waiting = [(0u32, from); DEEPEST];
        let mut count = usize::from(self.nodes[0].entry(origin, inverse, from, end).is_some());
        while count > 0 {
            count -= 1;
            let (node, enter) = waiting[count];
            if enter > end {
                continue;
            }
            let node = &self.nodes[node as usize];
            if node.count != INNER {
                self.leaf(node).for_each(|body| end = visit(body, end));
                continue;
            }
            let children = [node.first, node.first + 1];
            match children.map(|child| self.nodes[child as usize].entry(origin, inverse, from, end)) {
                [Some(a), Some(b)] => {
                    let (near, far) = if a <= b { (0, 1) } else { (1, 0) };
                    let entries = [a, b];
                    waiting[count] = (children[far], entries[far]);
                    waiting[count + 1] = (children[near], entries[near]);
                    count += 2;
                }
                [Some(a), None] => {
                    waiting[count] = (children[0], a);
                    count += 1;
                }
                [None, Some(b)] => {
                    waiting[count] = (children[1], b);
                    count += 1;
                }
                [None, None] => {}
            }
        }
    }

    fn leaf(&self, node: &Node) -> impl Iterator<Item = usize> {
        let first = node.first as usize;
        self.order[first..first + node.count as usize].iter().map(|&body| body as usize)
    }
}

impl Node {
    /// Where a ray enters the box between two distances; `None` where it misses.
    #[inline]
    fn entry(&self, origin: DVec3, inverse: DVec3, from: f64, to: f64) -> Option<f64> {
        let a = (self.low.as_dvec3() - origin) * inverse;
        let b = (self.high.as_dvec3() - origin) * inverse;
        let (mut enter, mut exit) = (from, to);
        for axis in 0..3 {
            let (near, far) = if inverse[axis] > 0.0 { (a[axis], b[axis]) } else { (b[axis], a[axis]) };
            // A ray along a face gives 0·∞, which is neither more nor less: the face belongs to the box.
            if near > enter {
                enter = near;
            }
            if far < exit {
                exit = far;
            }
        }
        // The roundings of two quotients.
        const MARGIN: f64 = 1.0 + 1e-14;
        (enter <= exit * MARGIN || enter <= exit).then_some(enter)
    }
}

#[cfg(test)]
mod test {
    use super::*;
    use crate::field::pcg3d;
    use glam::UVec3;

    fn random(i: u32, k: u32) -> Vec3 {
        (pcg3d(UVec3::new(i, k, 3)) >> 8u32).as_vec3() / 16_777_216.0
    }

    /// Every body whose box a point or a ray meets is visited, once; those that were not are not met. One is far away.
    #[test]
    fn nothing_is_missed() {
        for n in [0, 1, 4, 5, 300] {
            let mut boxes: Vec<_> = (0..n)
                .map(|i| (random(i, 0), 0.1 * random(i, 1)))
                .map(|(middle, half)| [middle - half, middle + half])
                .collect();
            if let Some(last) = boxes.last_mut() {
                *last = last.map(|corner| corner + 1e6);
            }
            let hierarchy = Hierarchy::new(&boxes);
            let mut met = 0;
            for i in 0..400 {
                let origin = if i % 9 == 0 { boxes.last().map_or(Vec3::ZERO, |b| b[0]) } else { random(i, 2) };
                let along = [Vec3::X, random(i, 4) - 0.5, Vec3::NEG_Y][i as usize % 3];
                let (from, direction) = (origin.as_dvec3(), along.as_dvec3());
                let mut visited = vec![[0; 2]; n as usize];
                hierarchy.at(from, |body| visited[body][0] += 1);
                hierarchy.along(from, direction, 0.0, 0.7, |body, end| {
                    visited[body][1] += 1;
                    end
                });
                for (corners, counts) in boxes.iter().zip(&visited) {
                    let [low, high] = corners.map(|corner| corner.as_dvec3());
                    let inside = |p: DVec3| p.cmpge(low).all() && p.cmple(high).all();
                    let passes = (0..=1000).any(|k| inside(from + direction * (0.7 * f64::from(k) / 1000.0)));
                    assert!(counts.iter().all(|&count| count <= 1));
                    assert!(!inside(from) || counts[0] == 1);
                    assert!(!passes || counts[1] == 1);
                    met += u32::from(passes);
                }
            }
            assert!(n < 4 || met > 0);
        }
    }

    /// A ray that is cut short visits no more than lies before its new end.
    #[test]
    fn near_comes_before_far() {
        let boxes: Vec<_> = (0..1000).map(|i| [Vec3::X * i as f32, Vec3::X * i as f32 + 0.5]).collect();
        let mut visited = 0;
        Hierarchy::new(&boxes).along(DVec3::new(-1.0, 0.25, 0.25), DVec3::X, 0.0, f64::INFINITY, |body, end| {
            visited += 1;
            end.min(1.5 + body as f64)
        });
        assert!(visited <= LEAF, "{visited} visited");
    }
}
