//! Surfaces as renderers read them: triangles with a material.

mod error;
mod export;
mod file;
mod gltf;
mod material;
mod mesh;
mod obj;
mod ply;
mod shapes;
mod tangents;
#[cfg(test)]
mod tests;
mod texture;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};

pub use error::SurfaceError;
pub use export::{Export, Exported};
pub(crate) use file::Format;
pub use material::{Bsdf, Material, Transmission};
pub use texture::{Map, NormalMap, Texcoords, Texture, TextureError, Wrap};

use crate::LoadError;
use crate::assets::Assets;
use crate::description::{self, Camera, Light, Scene, Shape};
use crate::volume::Budget;
use file::{Model, Part, Source};

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

/// Triangles; every list has an entry a vertex, but `triangles`, and `second_texcoords`, `tangents` and `colors` where they are
/// empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Positions of the vertices [m].
    pub positions: Vec<Vec3>,
    /// Unit normals for shading, on the front side.
    pub normals: Vec<Vec3>,
    /// Texture coordinates; (0, 0) is a picture's top left corner, (1, 1) its bottom right.
    pub texcoords: Vec<Vec2>,
    /// A second set of them, of maps that take it; empty where none does.
    pub second_texcoords: Vec<Vec2>,
    /// Unit tangents, along the first coordinate in the normal map; w (±1) is the sign of the bitangent w·(normal × tangent). Empty
    /// where no material needs them.
    pub tangents: Vec<Vec4>,
    /// Linear red, green, blue and alpha, which multiply the reflectance (base colour); empty where there are none.
    pub colors: Vec<Vec4>,
    /// Indices of vertices, counter-clockwise as seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// Bytes of memory.
    pub fn bytes(&self) -> u64 {
        let Self { positions, normals, texcoords, second_texcoords, tangents, colors, triangles } = self;
        let vectors = size_of_val(positions.as_slice()) + size_of_val(normals.as_slice());
        let wide = size_of_val(tangents.as_slice()) + size_of_val(colors.as_slice());
        let flat = size_of_val(texcoords.as_slice()) + size_of_val(second_texcoords.as_slice());
        (vectors + wide + flat + size_of_val(triangles.as_slice())) as u64
    }

    /// Both texture coordinates of a vertex; 0 where there are none.
    pub fn texcoords_of(&self, vertex: u32) -> Texcoords {
        [&self.texcoords, &self.second_texcoords].map(|set| set.get(vertex as usize).copied().unwrap_or_default())
    }
}

impl Surface {
    /// The lowest and the highest corner of its box in the world [m]; `None` without triangles.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let points = self.mesh.positions.iter().map(|&position| self.world_from_object.transform_point3(position));
        points.map(|point| [point; 2]).reduce(|[a, b], [low, high]| [a.min(low), b.max(high)])
    }
}

/// What the surfaces of a scene bring into its world.
pub(crate) struct Loaded {
    /// In the order of their names.
    pub surfaces: Vec<Surface>,
    /// The lights of files, by name.
    pub lights: BTreeMap<String, Light>,
    /// The camera of a file that was asked for, else the first that a file has.
    pub camera: Option<Camera>,
}

/// Loads the surfaces of a scene; textures and files are taken off what is `left` of the budget.
pub(crate) fn load(scene: &Scene, assets: &dyn Assets, left: &mut Budget) -> Result<Loaded, LoadError> {
    let mut reader = Reader { assets, left, textures: BTreeMap::new() };
    let mut materials = BTreeMap::new();
    for (name, material) in &scene.materials {
        materials.insert(name.as_str(), Arc::new(reader.material(name, material)?));
    }
    let mut loaded = Loaded { surfaces: Vec::new(), lights: BTreeMap::new(), camera: None };
    let mut asked = false;
    for (name, surface) in &scene.surfaces {
        let world_from_file = surface.transform.matrix();
        let finite = world_from_file.is_finite() && world_from_file.as_dmat4().inverse().as_mat4().is_finite();
        if !finite {
            return Err(LoadError::Singular { path: format!("surfaces.{name}.transform") });
        }
        let Model { parts, lights, cameras } = reader.model(name, surface)?;
        let several = parts.len() > 1;
        if parts.iter().all(|part| part.mesh.triangles.is_empty()) && lights.is_empty() && cameras.is_empty() {
            tracing::warn!("{name}: has no triangles");
        }
        for Part { name: part, mesh, file_from_object, material } in parts {
            let object = if several { format!("{name}/{part}") } else { name.clone() };
            let given = surface.material.as_ref().map(|of| materials[of.as_str()].clone());
            let material = reader.glowing(name, surface, given.unwrap_or(material))?;
            let glows = material.emission != Vec3::ZERO;
            if mesh.triangles.is_empty() {
                if glows {
                    tracing::warn!("{object}: emits light, but has no area");
                }
                continue;
            }
            let world_from_object = world_from_file * file_from_object;
            if !world_from_object.is_finite() || !world_from_object.as_dmat4().inverse().as_mat4().is_finite() {
                tracing::warn!("{object}: its transform overflows or has no inverse; it is left out");
                continue;
            }
            let mesh = match &material.normal_map {
                Some(normals) if mesh.tangents.is_empty() => {
                    let mut mesh = (*mesh).clone();
                    tangents::add_tangents(&mut mesh, &normals.map);
                    Arc::new(mesh)
                }
                _ => mesh,
            };
            loaded.surfaces.push(Surface { name: object, mesh, world_from_object, material });
        }
        for (light, description) in lights {
            loaded.lights.insert(format!("{name}/{light}"), placed(&description, &world_from_file));
        }
        if let Shape::Mesh { file, camera: Some(of) } = &surface.shape
            && !cameras.iter().any(|(camera, _)| camera == of)
        {
            let available = cameras.into_iter().map(|(name, _)| name).collect();
            let source = SurfaceError::NoSuchCamera { name: of.clone(), available };
            let path = format!("surfaces.{name}.shape.mesh.camera");
            return Err(LoadError::Surface { path, file: file.clone(), source });
        }
        let wanted = |camera: &str| matches!(&surface.shape, Shape::Mesh { camera: Some(of), .. } if of == camera);
        for (camera, description) in cameras {
            if (loaded.camera.is_none() || wanted(&camera)) && !asked {
                asked = wanted(&camera);
                loaded.camera = Some(seen(&description, &world_from_file));
            }
        }
    }
    loaded.surfaces.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(loaded)
}

/// Whether a file says that something in it gives light.
pub(crate) fn gives_light(file: &str, assets: &dyn Assets) -> bool {
    let bytes = assets.read(file, u64::MAX).ok().filter(|_| Format::of(file) == Some(Format::Gltf));
    bytes.is_some_and(|bytes| gltf::gives_light(&bytes))
}

/// A light of a file in the world.
fn placed(light: &Light, world_from_file: &Mat4) -> Light {
    let mut light = light.clone();
    match &mut light {
        Light::Directional { direction, .. } => *direction = world_from_file.transform_vector3(*direction),
        Light::Point { position, .. } => *position = world_from_file.transform_point3(*position),
        Light::Spot { position, direction, .. } => {
            *position = world_from_file.transform_point3(*position);
            *direction = world_from_file.transform_vector3(*direction);
        }
        Light::Constant { .. } | Light::Environment { .. } => {}
    }
    light
}

/// A camera of a file in the world.
fn seen(camera: &Camera, world_from_file: &Mat4) -> Camera {
    let forward = world_from_file.transform_vector3(camera.target - camera.position).normalize_or(Vec3::NEG_Z);
    let position = world_from_file.transform_point3(camera.position);
    Camera { position, target: position + forward, up: world_from_file.transform_vector3(camera.up), fov: camera.fov }
}

/// Reads what surfaces consist of, each file once.
struct Reader<'a> {
    assets: &'a dyn Assets,
    left: &'a mut Budget,
    /// By file and whether it is sRGB; `None` where one that a file names cannot be had.
    textures: BTreeMap<(String, bool), Option<Map>>,
}

impl Reader<'_> {
    /// What a surface's shape is, in its own space.
    fn model(&mut self, name: &str, surface: &description::Surface) -> Result<Model, LoadError> {
        let Shape::Mesh { file, .. } = &surface.shape else {
            let mesh = Arc::new(TriangleMesh::of(&surface.shape));
            let (file_from_object, material) = (Mat4::IDENTITY, Arc::default());
            return Ok(Model {
                parts: vec![Part { name: String::new(), mesh, file_from_object, material }],
                ..Model::default()
            });
        };
        let Self { assets, left, textures } = self;
        let read = Source { file, object: name, assets: *assets, left, textures }.read();
        read.map_err(|source| {
            let path = format!("surfaces.{name}.shape.mesh.file");
            match source {
                SurfaceError::Read(source) => LoadError::Asset { path, file: file.clone(), source },
                source => LoadError::Surface { path, file: file.clone(), source },
            }
        })
    }

    /// A material with what the surface itself says of its emission.
    fn glowing(
        &mut self,
        name: &str,
        surface: &description::Surface,
        material: Arc<Material>,
    ) -> Result<Arc<Material>, LoadError> {
        let description::Surface { radiance, radiance_map, double_sided, .. } = surface;
        if *radiance == Vec3::ZERO && radiance_map.is_none() && !double_sided {
            return Ok(material);
        }
        let mut material = (*material).clone();
        material.emission += *radiance;
        material.double_sided |= double_sided;
        if let Some(file) = radiance_map {
            material.emission_map = Some(self.map(&format!("surfaces.{name}.radiance_map"), file, true)?);
        }
        Ok(Arc::new(material))
    }

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
        let key = (file.to_owned(), srgb);
        if let Some(Some(map)) = self.textures.get(&key) {
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
        let map = Map::new(texture);
        self.textures.insert(key, Some(map.clone()));
        Ok(map)
    }
}
