//! Surfaces as renderers read them: triangles with a material.

mod material;
mod shapes;

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};

pub use material::{Bsdf, Map, Material, NormalMap, Texture};

use crate::FieldError;
use crate::description::Scene;

/// Triangles of one material in the world.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its name in the scene, followed by its place in the file where that holds several.
    pub name: String,
    /// In its own space.
    pub mesh: Arc<TriangleMesh>,
    /// Maps the mesh's space to the world [m]; affine and invertible. It may mirror: fronts stay fronts.
    pub world_from_object: Mat4,
    /// What it does to light.
    pub material: Arc<Material>,
}

/// Triangles; every list but `tangents` and `triangles` has an entry a vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Positions of the vertices [m].
    pub positions: Vec<Vec3>,
    /// Unit normals for shading, on the front side.
    pub normals: Vec<Vec3>,
    /// Texture coordinates; (0, 0) is a picture's top left corner, (1, 1) its bottom right.
    pub texcoords: Vec<Vec2>,
    /// Unit tangents, along the first texture coordinate; w (±1) is the sign of the bitangent w·(normal × tangent). Empty
    /// where no material needs them.
    pub tangents: Vec<Vec4>,
    /// Indices of vertices, counter-clockwise as seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

/// The surfaces of a scene, in the order of their names.
pub(crate) fn load(scene: &Scene) -> Result<Vec<Surface>, FieldError> {
    let mut surfaces = Vec::new();
    for (name, surface) in &scene.surfaces {
        let mut material = match &surface.material {
            None => Material::default(),
            Some(of) => match scene.materials.get(of) {
                Some(material) => Material::new(of, material),
                None => {
                    let known: Vec<_> = scene.materials.keys().map(String::as_str).collect();
                    return Err(FieldError {
                        path: format!("surfaces.{name}.material"),
                        found: format!("{of:?}"),
                        accepted: format!("one of the scene's materials: {}", known.join(", ")),
                    });
                }
            },
        };
        material.emission += surface.radiance;
        surfaces.push(Surface {
            name: name.clone(),
            mesh: Arc::new(TriangleMesh::of(&surface.shape)),
            world_from_object: surface.transform.matrix(),
            material: Arc::new(material),
        });
    }
    Ok(surfaces)
}
