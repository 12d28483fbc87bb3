//! A hierarchy of boxes over the triangles of all surfaces, and the walk of a ray through it: the twin of `bvh.wesl`.
//!
//! Nodes lie depth first, each with the number of the node that comes next where its box is missed. A walk needs no stack, and
//! no tree is too deep for it.

#[cfg(test)]
mod test;

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use tyndall_scene::surface::Surface;

use crate::{Gpu, RenderError};

/// Texels in a row of `nodes` and `corners`: `BVH_ROW` in `bvh.wesl`.
const ROW: u32 = 2048;

/// Triangles of a leaf, at most: four bits in the shader.
const LEAF: u32 = 4;

/// A hierarchy over triangles in the world.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// In the order of the leaves.
    corners: Vec<Corners>,
    bounds: [Vec3; 2],
}

/// A box of the hierarchy.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// The node that comes next where the box is missed.
    skip: u32,
    first: u32,
    /// 0 for an inner node.
    count: u32,
}

/// A triangle: a corner and the edges to the two others [m].
#[derive(Clone, Copy, Debug)]
struct Corners {
    a: Vec3,
    ab: Vec3,
    ac: Vec3,
    /// Its number among all triangles of all surfaces.
    triangle: u32,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Along the ray, in lengths of its direction.
    pub distance: f32,
    /// Among all triangles of all surfaces, in their order.
    pub triangle: u32,
    /// Weights of its second and third corner.
    pub weights: [f32; 2],
}

/// The corners of all triangles of surfaces in the world [m], counter-clockwise as seen from the front.
pub fn triangles(surfaces: &[Surface]) -> Vec<[Vec3; 3]> {
    let (vertices, triangles) = super::surfaces::triangles(surfaces);
    triangles.iter().map(|t| [t.x, t.y, t.z].map(|i| vertices[i as usize].position)).collect()
}

impl Bvh {
    /// A hierarchy over triangles; those with a corner that is not finite are left out.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let finite = |i: &u32| triangles[*i as usize].iter().all(|corner| corner.is_finite());
        let indices: Vec<u32> = (0..triangles.len() as u32).filter(finite).collect();
        let boxes: Vec<Aabb> =
            indices.iter().map(|&i| Aabb::from_points(&triangles[i as usize].map(Vec3A::from))).collect();
        let order: Vec<u32> = (0..boxes.len() as u32).collect();
        // The builder that takes triangles reads a clock, which browsers do not have.
        let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &boxes,
            order,
            SortPrecision::U64,
            3,
        );
        let mut optimizer = ReinsertionOptimizer::default();
        optimizer.run(&mut tree, 0.05, None);
        collapse(&mut tree, LEAF, 1.0);
        let mut bvh = Self { nodes: Vec::new(), corners: Vec::new(), bounds: [Vec3::ZERO; 2] };
        bvh.flatten(&tree, &indices, triangles);
        if let Some(root) = bvh.nodes.first() {
            bvh.bounds = [root.low, root.high];
        }
        bvh
    }

    /// Lays the nodes out depth first; a stack of its own, as trees may be deep.
    fn flatten(&mut self, tree: &Bvh2, indices: &[u32], triangles: &[[Vec3; 3]]) {
        enum Visit {
            Node(u32),
            Close(usize),
        }
        let mut stack = if tree.nodes.is_empty() { Vec::new() } else { vec![Visit::Node(0)] };
        while let Some(visit) = stack.pop() {
            let number = match visit {
                Visit::Close(node) => {
                    self.nodes[node].skip = self.nodes.len() as u32;
                    continue;
                }
                Visit::Node(number) => number,
            };
            let node = &tree.nodes[number as usize];
            let here = self.nodes.len();
            let (low, high) = (node.aabb().min.into(), node.aabb().max.into());
            self.nodes.push(Node { low, high, skip: 0, first: self.corners.len() as u32, count: node.prim_count });
            stack.push(Visit::Close(here));
            if node.prim_count == 0 {
                stack.push(Visit::Node(node.first_index + 1));
                stack.push(Visit::Node(node.first_index));
                continue;
            }
            let leaf = node.first_index..node.first_index + node.prim_count;
            self.corners.extend(leaf.map(|i| {
                let triangle = indices[tree.primitive_indices[i as usize] as usize];
                Corners::new(triangles[triangle as usize], triangle)
            }));
        }
    }

    /// Takes triangles that have moved, of the same number and order: boxes change, the tree does not.
    pub fn refit(&mut self, triangles: &[[Vec3; 3]]) {
        for corners in &mut self.corners {
            *corners = Corners::new(triangles[corners.triangle as usize], corners.triangle);
        }
        for i in (0..self.nodes.len()).rev() {
            let node = self.nodes[i];
            let (low, high) = if node.count > 0 {
                let leaf = &self.corners[node.first as usize..(node.first + node.count) as usize];
                let points = leaf.iter().flat_map(|c| [c.a, c.a + c.ab, c.a + c.ac]);
                points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
            } else {
                let [left, right] = [self.nodes[i + 1], self.nodes[self.nodes[i + 1].skip as usize]];
                (left.low.min(right.low), left.high.max(right.high))
            };
            (self.nodes[i].low, self.nodes[i].high) = (low, high);
        }
        if let Some(root) = self.nodes.first() {
            self.bounds = [root.low, root.high];
        }
    }

    /// The lowest and the highest corner of a box around everything [m].
    pub fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    /// How many nodes there are: no walk visits more.
    pub fn nodes(&self) -> u32 {
        self.nodes.len() as u32
    }

    /// The nearest triangle that a ray meets before `limit` [lengths of the direction].
    pub fn closest(&self, origin: Vec3, direction: Vec3, limit: f32) -> Option<Hit> {
        self.walk(origin, direction, limit, |_| true)
    }

    /// Whether a ray meets anything before `limit` [lengths of the direction].
    pub fn occluded(&self, origin: Vec3, direction: Vec3, limit: f32) -> bool {
        self.walk(origin, direction, limit, |_| false).is_some()
    }

    /// How many nodes and triangles a ray meets on its way to the nearest triangle.
    pub(crate) fn effort(&self, origin: Vec3, direction: Vec3, limit: f32) -> u32 {
        let mut effort = 0;
        self.walk_counted(origin, direction, limit, |_| true, &mut effort);
        effort
    }

    fn walk(&self, origin: Vec3, direction: Vec3, limit: f32, go_on: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        self.walk_counted(origin, direction, limit, go_on, &mut 0)
    }

    fn walk_counted(
        &self,
        origin: Vec3,
        direction: Vec3,
        limit: f32,
        mut go_on: impl FnMut(&Hit) -> bool,
        effort: &mut u32,
    ) -> Option<Hit> {
        let inverse = 1.0 / away_from_zero(direction);
        let (mut nearest, mut found) = (limit, None);
        let mut number = 0;
        while let Some(node) = self.nodes.get(number as usize) {
            *effort += 1;
            let (a, b) = ((node.low - origin) * inverse, (node.high - origin) * inverse);
            let enter = a.min(b).max_element().max(0.0);
            let leave = a.max(b).min_element() * LENIENT;
            if enter > leave.min(nearest) {
                number = node.skip;
                continue;
            }
            *effort += node.count;
            for corners in &self.corners[node.first as usize..(node.first + node.count) as usize] {
                let Some(hit) = corners.meet(origin, direction).filter(|hit| hit.distance < nearest) else { continue };
                (nearest, found) = (hit.distance, Some(hit));
                if !go_on(&hit) {
                    return found;
                }
            }
            number += 1;
        }
        found
    }

    /// The hierarchy as the textures `nodes` and `corners`.
    ///
    /// # Errors
    /// More triangles than the device's textures hold, and a lack of memory.
    pub(crate) async fn textures(&self, gpu: &Gpu) -> Result<[wgpu::Texture; 2], RenderError> {
        let [nodes, corners] = self.texels();
        Ok([table(gpu, "nodes", nodes).await?, table(gpu, "corners", corners).await?])
    }

    /// The texels of both textures.
    fn texels(&self) -> [Vec<[u32; 4]>; 2] {
        let texel = |v: Vec3, w: u32| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), w];
        let nodes = self.nodes.iter().flat_map(|n| [texel(n.low, n.skip), texel(n.high, n.first << 4 | n.count)]);
        let corners = self.corners.iter().flat_map(|c| [texel(c.a, c.triangle), texel(c.ab, 0), texel(c.ac, 0)]);
        [nodes.collect(), corners.collect()]
    }

    /// Writes what [`refit`](Self::refit) changed into textures made of this hierarchy.
    pub(crate) fn update(&self, gpu: &Gpu, textures: &[wgpu::Texture; 2]) {
        for (texture, texels) in textures.iter().zip(self.texels()) {
            write(gpu, texture, texels);
        }
    }
}

/// Makes up for the roundings of the distances to a box [Ize13].
const LENIENT: f32 = 1.000_000_4;

/// A direction without components so small that their inverse overflows.
fn away_from_zero(direction: Vec3) -> Vec3 {
    let least = |x: f32| if x.abs() < 1e-20 { 1e-20f32.copysign(x) } else { x };
    Vec3::new(least(direction.x), least(direction.y), least(direction.z))
}

impl Corners {
    fn new([a, b, c]: [Vec3; 3], triangle: u32) -> Self {
        Self { a, ab: b - a, ac: c - a, triangle }
    }

    /// Where a ray meets the triangle, from either side. [MoellerTrumbore97]
    fn meet(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let p = direction.cross(self.ac);
        let determinant = self.ab.dot(p);
        let s = origin - self.a;
        let q = s.cross(self.ab);
        let [u, v, t] = [s.dot(p), direction.dot(q), self.ac.dot(q)].map(|x| x / determinant);
        // A triangle without area, or on edge, has determinant 0, and nothing below holds of what is not a number.
        let inside = determinant != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0;
        inside.then_some(Hit { distance: t, triangle: self.triangle, weights: [u, v] })
    }
}

/// Texels as a texture of rows of [`ROW`].
pub(crate) async fn table(gpu: &Gpu, label: &str, mut texels: Vec<[u32; 4]>) -> Result<wgpu::Texture, RenderError> {
    let height = (texels.len() as u32).div_ceil(ROW).max(1);
    let limit = gpu.device.limits().max_texture_dimension_2d;
    if height > limit {
        return Err(RenderError::Limit {
            what: label.into(),
            found: format!("{} texels", texels.len()),
            limit: format!("{} texels", u64::from(ROW) * u64::from(limit)),
            advice: "Use simpler meshes.".into(),
        });
    }
    texels.resize((ROW * height) as usize, [0; 4]);
    gpu.table(label, [ROW, height], wgpu::TextureFormat::Rgba32Uint, bytemuck::cast_slice(&texels)).await
}

/// Overwrites a texture that [`table`] made.
pub(crate) fn write(gpu: &Gpu, texture: &wgpu::Texture, mut texels: Vec<[u32; 4]>) {
    texels.resize((ROW * texture.height()) as usize, [0; 4]);
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(ROW * 16), rows_per_image: None };
    gpu.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&texels), layout, texture.size());
}
