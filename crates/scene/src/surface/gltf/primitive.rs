//! The triangles of a primitive.

use glam::{Vec2, Vec3, Vec4};
use gltf::mesh::Mode;
use gltf::{Primitive, Semantic};

use super::super::error::check_budget;
use super::super::mesh::{Missing, TRIANGLE_BYTES, Triangles};
use super::super::{Material, SurfaceError, TriangleMesh};
use super::accessor::{read, read_indices};
use super::{Reader, texture};

impl Reader<'_, '_> {
    /// Reads a primitive; one of points or lines has no triangles.
    pub(super) fn primitive(
        &mut self,
        object: &str,
        primitive: &Primitive,
        material: &Material,
    ) -> Result<TriangleMesh, SurfaceError> {
        let (buffers, budget) = (&self.buffers, *self.source.left);
        let Some(positions) = primitive.get(&Semantic::Positions) else {
            tracing::warn!("{object}: a primitive has no positions; it is left out");
            return Ok(TriangleMesh::default());
        };
        let positions: Vec<Vec3> = read::<3>(&positions, buffers, budget)?.into_iter().map(Vec3::from).collect();
        let count = positions.len();
        let full = |length: usize, what: &str| {
            if length == count {
                return Ok(());
            }
            Err(SurfaceError::corrupt(format!("{object}: {length} {what} for {count} positions")))
        };
        let mut triangles = Triangles { positions, ..Triangles::default() };
        if let Some(normals) = primitive.get(&Semantic::Normals) {
            triangles.normals = read::<3>(&normals, buffers, budget)?.into_iter().map(Vec3::from).collect();
            full(triangles.normals.len(), "normals")?;
        }
        if let Some(tangents) = primitive.get(&Semantic::Tangents) {
            triangles.tangents = read::<4>(&tangents, buffers, budget)?.into_iter().map(Vec4::from).collect();
            full(triangles.tangents.len(), "tangents")?;
        }
        let texcoords = |set: u32| -> Result<Vec<Vec2>, SurfaceError> {
            let Some(texcoords) = primitive.get(&Semantic::TexCoords(set)) else { return Ok(Vec::new()) };
            let list: Vec<_> = read::<2>(&texcoords, buffers, budget)?.into_iter().map(Vec2::from).collect();
            full(list.len(), "texture coordinates")?;
            Ok(list)
        };
        let sets = texture::sets(&primitive.material())?;
        triangles.texcoords = texcoords(sets.first().copied().unwrap_or(0))?;
        if let Some(&second) = sets.get(1) {
            triangles.second_texcoords = texcoords(second)?;
        }
        if let Some(colors) = primitive.get(&Semantic::Colors(0)) {
            triangles.colors = match colors.dimensions() {
                gltf::accessor::Dimensions::Vec3 => {
                    read::<3>(&colors, buffers, budget)?.into_iter().map(|rgb| Vec3::from(rgb).extend(1.0)).collect()
                }
                _ => read::<4>(&colors, buffers, budget)?.into_iter().map(Vec4::from).collect(),
            };
            full(triangles.colors.len(), "colours")?;
        }
        let corners = match primitive.indices() {
            Some(indices) => read_indices(&indices, buffers, budget)?,
            None => (0..count as u32).collect(),
        };
        if let Some(corner) = corners.iter().find(|&&corner| corner as usize >= count) {
            return Err(SurfaceError::corrupt(format!("{object}: the index {corner}, of {count} vertices")));
        }
        check_budget("its triangles", corners.len() as u64, TRIANGLE_BYTES, budget)?;
        triangles.triangles = match primitive.mode() {
            Mode::Triangles => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
            // Every second triangle of a strip turns the other way.
            Mode::TriangleStrip => {
                let turned = |(i, c): (usize, &[u32])| if i % 2 == 0 { [c[0], c[1], c[2]] } else { [c[1], c[0], c[2]] };
                corners.windows(3).enumerate().map(turned).collect()
            }
            Mode::TriangleFan => corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]).collect(),
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
                tracing::warn!("{object}: points and lines are not rendered; they are left out");
                return Ok(TriangleMesh::default());
            }
        };
        Ok(triangles.finish(object, Missing::Flat, material.normal_map.as_ref().map(|normals| &normals.map)))
    }
}
