//! Surfaces as renderers read them: triangles with a material.

mod material;
mod shapes;
#[cfg(test)]
mod tests;
mod texture;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};

pub use material::{Bsdf, Material, Transmission};
pub use texture::{Map, NormalMap, Texture, TextureError};

use crate::LoadError;
use crate::assets::Assets;
use crate::description::{self, Scene};
use crate::volume::Budget;

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

/// Triangles; every list has an entry a vertex, but `triangles`, and `tangents` and `colors` where they are empty.
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
    /// Linear red, green, blue and alpha, which multiply the reflectance (base colour); empty where there are none.
    pub colors: Vec<Vec4>,
    /// Indices of vertices, counter-clockwise as seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

/// The surfaces of a scene, in the order of their names; their textures are taken off what is `left` of the budget.
pub(crate) fn load(scene: &Scene, assets: &dyn Assets, left: &mut Budget) -> Result<Vec<Surface>, LoadError> {
    let mut reader = Reader { assets, left, textures: Vec::new() };
    let mut materials = BTreeMap::new();
    for (name, material) in &scene.materials {
        materials.insert(name.as_str(), reader.material(name, material)?);
    }
    let mut surfaces = Vec::new();
    for (name, surface) in &scene.surfaces {
        let mut material = surface.material.as_ref().map(|of| materials[of.as_str()].clone()).unwrap_or_default();
        material.emission += surface.radiance;
        material.double_sided = surface.double_sided;
        if let Some(file) = &surface.radiance_map {
            material.emission_map = Some(reader.map(&format!("surfaces.{name}.radiance_map"), file, true)?);
        }
        let world_from_object = surface.transform.matrix();
        let finite = world_from_object.is_finite() && world_from_object.as_dmat4().inverse().as_mat4().is_finite();
        if !finite {
            return Err(LoadError::Singular { path: format!("surfaces.{name}.transform") });
        }
        surfaces.push(Surface {
            name: name.clone(),
            mesh: Arc::new(TriangleMesh::of(&surface.shape)),
            world_from_object,
            material: Arc::new(material),
        });
    }
    Ok(surfaces)
}

/// Reads what surfaces consist of, each file once.
struct Reader<'a> {
    assets: &'a dyn Assets,
    left: &'a mut Budget,
    /// By file and whether it is sRGB.
    textures: Vec<(String, bool, Map)>,
}

impl Reader<'_> {
    fn material(&mut self, name: &str, material: &description::Material) -> Result<Material, LoadError> {
        use description::Material as Described;
        let mut of = |variant: &str, field: &str, file: &Option<String>, srgb| {
            let path = format!("materials.{name}.{variant}.{field}");
            file.as_ref().map(|file| self.map(&path, file, srgb)).transpose()
        };
        let (bsdf, normals) = match material {
            Described::Lambert { reflectance, reflectance_map, normal_map } => {
                let map = of("lambert", "reflectance_map", reflectance_map, true)?;
                (Bsdf::Lambert { reflectance: *reflectance, map }, of("lambert", "normal_map", normal_map, false)?)
            }
            Described::MetallicRoughness {
                base_color,
                base_color_map,
                metallic,
                roughness,
                metallic_roughness_map,
                normal_map,
            } => {
                let variant = "metallic_roughness";
                let bsdf = Bsdf::MetallicRoughness {
                    base_color: *base_color,
                    base_color_map: of(variant, "base_color_map", base_color_map, true)?,
                    metallic: *metallic,
                    roughness: *roughness,
                    metallic_roughness_map: of(variant, "metallic_roughness_map", metallic_roughness_map, false)?,
                };
                (bsdf, of(variant, "normal_map", normal_map, false)?)
            }
            Described::Mirror { reflectance } => (Bsdf::Mirror { reflectance: *reflectance }, None),
            Described::Dielectric { ior } => (Bsdf::Dielectric { ior: *ior }, None),
        };
        let normal_map = normals.map(|map| NormalMap { map, scale: 1.0 });
        Ok(Material { name: name.into(), bsdf, normal_map, ..Material::default() })
    }

    /// The picture of a file that the field at `path` names.
    fn map(&mut self, path: &str, file: &str, srgb: bool) -> Result<Map, LoadError> {
        if let Some((.., map)) = self.textures.iter().find(|(name, of, _)| name == file && *of == srgb) {
            return Ok(map.clone());
        }
        let bytes = self.assets.read(file, self.left.0).map_err(|source| LoadError::Asset {
            path: path.into(),
            file: file.into(),
            source,
        })?;
        let texture = Texture::decode(&bytes, srgb, *self.left).map_err(|source| LoadError::Texture {
            path: path.into(),
            file: file.into(),
            source,
        })?;
        self.left.0 = self.left.0.saturating_sub(texture.bytes());
        let map = Map(Arc::new(texture));
        self.textures.push((file.into(), srgb, map.clone()));
        Ok(map)
    }
}
