//! Tangents for normal maps, as the tools that bake these compute them. [Mikkelsen08]

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace};
use glam::{Vec3, Vec4};

use super::{Map, TriangleMesh};

/// Gives a mesh tangents for a map of normals. Vertices whose triangles need different ones become several.
pub(super) fn add_tangents(mesh: &mut TriangleMesh, normals: &Map) {
    let mut corners = Corners { tangents: vec![None; 3 * mesh.triangles.len()], mesh, normals };
    // It fails only for meshes without triangles, which have no vertices either.
    let _ = bevy_mikktspace::generate_tangents(&mut corners);
    let tangents = corners.tangents;
    mesh.tangents = vec![Vec4::ZERO; mesh.positions.len()];
    let mut copies = HashMap::new();
    for (i, tangent) in tangents.into_iter().enumerate() {
        let vertex = mesh.triangles[i / 3][i % 3] as usize;
        let tangent = across(tangent, mesh.normals[vertex]);
        if mesh.tangents[vertex] == Vec4::ZERO {
            mesh.tangents[vertex] = tangent;
        } else if mesh.tangents[vertex] != tangent {
            let key = (vertex, tangent.to_array().map(f32::to_bits));
            mesh.triangles[i / 3][i % 3] = *copies.entry(key).or_insert_with(|| {
                mesh.positions.push(mesh.positions[vertex]);
                mesh.normals.push(mesh.normals[vertex]);
                mesh.texcoords.push(mesh.texcoords[vertex]);
                if let Some(&second) = mesh.second_texcoords.get(vertex) {
                    mesh.second_texcoords.push(second);
                }
                mesh.tangents.push(tangent);
                if let Some(&color) = mesh.colors.get(vertex) {
                    mesh.colors.push(color);
                }
                mesh.positions.len() as u32 - 1
            });
        }
    }
}

/// A unit tangent with its sign; any across the normal where there is none.
fn across(tangent: Option<Vec4>, normal: Vec3) -> Vec4 {
    let unit = tangent.and_then(|t| Some(t.truncate().try_normalize()?.extend(t.w)));
    unit.unwrap_or_else(|| normal.any_orthonormal_vector().extend(1.0))
}

/// The mesh as the algorithm reads it, and what it says of the triangles' corners.
struct Corners<'a> {
    mesh: &'a TriangleMesh,
    normals: &'a Map,
    tangents: Vec<Option<Vec4>>,
}

impl Corners<'_> {
    fn of<T: Copy>(&self, list: &[T], face: usize, corner: usize) -> T {
        list[self.mesh.triangles[face][corner] as usize]
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }
    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }
    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.of(&self.mesh.positions, face, corner).to_array()
    }
    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.of(&self.mesh.normals, face, corner).to_array()
    }
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.normals.place(self.mesh.texcoords_of(self.mesh.triangles[face][corner])).to_array()
    }
    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        // The algorithm's bitangent is along the second texture coordinate, which goes down in a picture; that of a
        // normal map goes up.
        let tangent = space.map(|space| Vec4::from_array(space.tangent_encoded()) * Vec4::new(1.0, 1.0, 1.0, -1.0));
        self.tangents[3 * face + corner] = tangent.filter(|tangent| tangent.is_finite());
    }
}
