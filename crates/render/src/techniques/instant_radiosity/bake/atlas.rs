//! Where in a light map each side of each surface is.

use std::ops::ControlFlow;
use std::sync::Mutex;

use glam::{UVec4, Vec2};
use uvunwrap::{Density, MeshInput, Options, OutputMesh};

use super::Progress;
use crate::RenderError;
use crate::resident::surfaces::Vertex;

/// One side of a surface.
#[derive(Clone, Debug)]
pub(super) struct Side {
    /// The surface.
    pub surface: usize,
    /// Whether it is the back.
    pub back: bool,
    /// The number of the surface's first triangle among those of all surfaces.
    pub first: u32,
    /// In the world.
    pub vertices: Vec<Vertex>,
    /// Corners among `vertices`, counter-clockwise as seen from the front of the surface.
    pub triangles: Vec<UVec4>,
}

/// Sides laid out on one page.
#[derive(Debug)]
pub(super) struct Atlas {
    /// Columns and rows.
    pub size: [u32; 2],
    /// For each side its vertices, which are more where a seam runs, with their place in the page.
    pub meshes: Vec<OutputMesh>,
    /// For each texel what the shader reads: the triangle, from 1, or 0; 1 for a back; weights of the second and third corner.
    pub places: Vec<[u32; 4]>,
    /// For each texel the side, from 1, or 0.
    pub sides: Vec<u32>,
}

/// How far from a triangle a texel's middle may be for the texel to be seen there, where neighbours are interpolated.
const REACH: f32 = std::f32::consts::SQRT_2;

/// By so much places are drawn to the middle of their triangle, so that none is on another surface that meets it in an edge.
const INWARDS: f32 = 1e-3;

impl Side {
    /// The corners of a triangle as its side is seen, counter-clockwise.
    fn corners(&self, triangle: &UVec4) -> [u32; 3] {
        if self.back { [triangle.x, triangle.z, triangle.y] } else { [triangle.x, triangle.y, triangle.z] }
    }
}

impl Atlas {
    /// Lays sides out on a page of at most `side` × `side` texels, with four texels between charts.
    ///
    /// # Errors
    /// What does not fit, and [`RenderError::Interrupted`].
    pub fn new(sides: &[Side], side: u32, progress: &mut Progress<'_>) -> Result<Self, RenderError> {
        let too_small = |found: String| RenderError::Limit {
            what: "the light map".into(),
            found,
            limit: format!("what fits {side} x {side} texels"),
            advice: "Use more texels, or simpler meshes.".into(),
        };
        let positions: Vec<Vec<[f32; 3]>> =
            sides.iter().map(|side| side.vertices.iter().map(|vertex| vertex.position.into()).collect()).collect();
        let indices: Vec<Vec<u32>> =
            sides.iter().map(|side| side.triangles.iter().flat_map(|t| side.corners(t)).collect()).collect();
        let meshes: Vec<_> = positions.iter().zip(&indices).map(|(p, i)| MeshInput::new(p, i)).collect();
        let options = Options { density: Density::Auto { page_size: side }, ..Options::default() };
        let progress = Mutex::new(progress);
        let go_on = |_| progress.lock().is_ok_and(|mut progress| progress(0.0).is_continue());
        let atlas = uvunwrap::generate_with_progress(&meshes, &options, go_on).map_err(|error| match error {
            uvunwrap::Error::Cancelled => RenderError::Interrupted,
            other => too_small(other.to_string()),
        })?;
        if atlas.page_count > 1 {
            return Err(too_small(format!("{} charts, for {} pages", atlas.chart_count, atlas.page_count)));
        }
        let count = atlas.width as usize * atlas.height as usize;
        let mut made = Self {
            size: [atlas.width, atlas.height],
            meshes: atlas.meshes,
            places: vec![[0; 4]; count],
            sides: vec![0; count],
        };
        made.find_places(sides);
        Ok(made)
    }

    /// Finds for each texel the nearest point of the charts, no farther away than interpolation reaches.
    fn find_places(&mut self, sides: &[Side]) {
        let [width, height] = self.size;
        let size = Vec2::new(width as f32, height as f32);
        let mut distances = vec![f32::MAX; self.places.len()];
        for (number, (side, mesh)) in (1..).zip(sides.iter().zip(&self.meshes)) {
            for (i, corners) in mesh.indices.chunks_exact(3).enumerate() {
                let corners = [0, 1, 2].map(|k| Vec2::from(mesh.vertices[corners[k] as usize].uv) * size);
                let low = corners.iter().copied().reduce(Vec2::min).unwrap_or_default() - REACH;
                let high = corners.iter().copied().reduce(Vec2::max).unwrap_or_default() + REACH;
                let span = |low: f32, high: f32, end: u32| low.floor().max(0.0) as u32..(high.ceil() as u32).min(end);
                for y in span(low.y, high.y, height) {
                    for x in span(low.x, high.x, width) {
                        let Some((weights, distance)) = nearest(&corners, Vec2::new(x as f32, y as f32) + 0.5) else {
                            continue;
                        };
                        let texel = (y * width + x) as usize;
                        if distance > REACH || distance >= distances[texel] {
                            continue;
                        }
                        distances[texel] = distance;
                        let [b, c] = if side.back { [weights[2], weights[1]] } else { [weights[1], weights[2]] };
                        let inwards = |weight: f32| (weight + INWARDS * (1.0 / 3.0 - weight)).to_bits();
                        self.places[texel] = [side.first + i as u32 + 1, u32::from(side.back), inwards(b), inwards(c)];
                        self.sides[texel] = number;
                    }
                }
            }
        }
    }
}

/// The point of a triangle that is nearest to another, by its weights, and how far away it is; `None` where there is no triangle.
fn nearest(corners: &[Vec2; 3], point: Vec2) -> Option<([f32; 3], f32)> {
    let [a, b, c] = *corners;
    let area = (b - a).perp_dot(c - a);
    if area.abs() < 1e-9 {
        return None;
    }
    let weights =
        [(c - b).perp_dot(point - b) / area, (a - c).perp_dot(point - c) / area, (b - a).perp_dot(point - a) / area];
    if weights.iter().all(|&weight| weight >= 0.0) {
        return Some((weights, 0.0));
    }
    let along = |i: usize| {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        let t = ((point - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
        let mut weights = [0.0; 3];
        (weights[i], weights[(i + 1) % 3]) = (1.0 - t, t);
        (weights, from.lerp(to, t).distance(point))
    };
    [0, 1, 2].map(along).into_iter().min_by(|a, b| a.1.total_cmp(&b.1))
}

/// What lets work be broken off: it is told the finished share.
pub(super) fn broken(progress: &mut Progress<'_>, done: f64) -> Result<(), RenderError> {
    match progress(done) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(RenderError::Interrupted),
    }
}
