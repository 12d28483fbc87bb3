//! The mesh's boundary as a hierarchy of boxes, for rays to find where they enter.

use glam::Vec3;
use tyndall_scene::volume::Mesh;

/// A node as the shader sees it; nodes stand in the order of their traversal.
#[derive(Clone, Copy, Debug, PartialEq, encase::ShaderType)]
pub(crate) struct Node {
    /// The lowest corner of its box, in the unit cube.
    low: Vec3,
    /// The node after this one and all below it.
    skip: u32,
    /// The highest corner.
    high: Vec3,
    /// A leaf's face, numbered four to each tetrahedron; [`NOWHERE`] in other nodes.
    face: u32,
}

/// No face, and no tetrahedron.
pub(super) const NOWHERE: u32 = u32::MAX;

/// A face with its box.
struct Face {
    low: Vec3,
    high: Vec3,
    face: u32,
}

/// The hierarchy: halved at the median along the longest axis, down to single faces.
pub(super) fn hierarchy(mesh: &Mesh) -> Vec<Node> {
    // Boxes are wider than their faces by more than rounding along a ray.
    const MARGIN: f32 = 2e-6;
    let mut faces = Vec::new();
    for tetrahedron in 0..mesh.count() {
        let corners = mesh.corners(tetrahedron);
        for (opposite, neighbour) in mesh.neighbours(tetrahedron).into_iter().enumerate() {
            if neighbour.is_none() {
                let own = (0..4).filter(|&i| i != opposite).map(|i| corners[i]);
                let low = own.clone().fold(Vec3::INFINITY, Vec3::min) - MARGIN;
                let high = own.fold(Vec3::NEG_INFINITY, Vec3::max) + MARGIN;
                faces.push(Face { low, high, face: (4 * tetrahedron + opposite) as u32 });
            }
        }
    }
    let mut nodes = Vec::with_capacity(2 * faces.len());
    build(&mut faces, &mut nodes);
    nodes
}

fn build(faces: &mut [Face], nodes: &mut Vec<Node>) {
    let low = faces.iter().fold(Vec3::INFINITY, |low, face| low.min(face.low));
    let high = faces.iter().fold(Vec3::NEG_INFINITY, |high, face| high.max(face.high));
    let at = nodes.len();
    let face = if let [only] = faces { only.face } else { NOWHERE };
    nodes.push(Node { low, skip: 0, high, face });
    if faces.len() > 1 {
        let axis = (high - low).max_position();
        let middle = faces.len() / 2;
        faces.select_nth_unstable_by(middle, |a, b| (a.low + a.high)[axis].total_cmp(&(b.low + b.high)[axis]));
        let (left, right) = faces.split_at_mut(middle);
        build(left, nodes);
        build(right, nodes);
    }
    nodes[at].skip = nodes.len() as u32;
}
