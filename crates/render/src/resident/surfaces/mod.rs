//! Surfaces on the device (`resident/surface.wesl`): all triangles in the world, their materials and maps.

pub(crate) mod emitters;
mod maps;
#[cfg(test)]
mod test;

use glam::{Mat3, Mat4, UVec4, Vec2, Vec3, Vec4};
use tyndall_scene::FieldError;
use tyndall_scene::surface::{Bsdf, Map, Surface, Texcoords};

use crate::{Gpu, RenderError};
use maps::Maps;
#[cfg(test)]
pub(crate) use maps::Picture;
pub use maps::Placed;

/// A vertex as shaders see it.
#[derive(Clone, Copy, Debug, Default, PartialEq, encase::ShaderType)]
pub struct Vertex {
    /// In the world [m].
    pub position: Vec3,
    /// The first texture coordinate.
    pub u: f32,
    /// On the front side, a unit vector but where a transform stretches: interpolated, and then made one.
    pub normal: Vec3,
    /// The second texture coordinate.
    pub v: f32,
    /// Along u, and the sign of the bitangent w·(normal × tangent); 0 where there is none.
    pub tangent: Vec4,
    /// Linear red, green, blue and alpha, which multiply the material's.
    pub color: Vec4,
    /// The second set of texture coordinates.
    pub second: Vec2,
}

impl Vertex {
    /// Both sets of texture coordinates.
    pub fn texcoords(&self) -> Texcoords {
        [Vec2::new(self.u, self.v), self.second]
    }
}

/// What a surface does to light as shaders see it.
#[derive(Clone, Copy, Debug, Default, PartialEq, encase::ShaderType)]
pub struct Material {
    /// The reflectance of a diffuse base or a mirror; of a metal at normal incidence.
    pub base: Vec3,
    /// As `math/brdf.wesl` numbers them: Lambert, metallic-roughness, mirror, dielectric.
    pub kind: u32,
    /// Radiance [W·sr⁻¹·m⁻²].
    pub emission: Vec3,
    /// Whether the back emits, too.
    pub double_sided: u32,
    /// From dielectric, 0, to metal, 1.
    pub metallic: f32,
    /// The square root of the width of the facets' distribution.
    pub roughness: f32,
    /// The refractive index behind the front side over that before it.
    pub ior: f32,
    /// There is no surface where the alpha of `base_map` is less.
    pub cutoff: f32,
    /// Multiplies `base`.
    pub base_map: Placed,
    /// Multiplies `emission`.
    pub emission_map: Placed,
    /// Its green multiplies `roughness`, its blue `metallic`.
    pub metallic_roughness_map: Placed,
    /// Bends the normals.
    pub normal_map: Placed,
    /// How strongly.
    pub normal_scale: f32,
}

impl Material {
    /// The maps that it has.
    fn maps(&mut self) -> impl Iterator<Item = &mut Placed> {
        let maps = [&mut self.base_map, &mut self.emission_map, &mut self.metallic_roughness_map, &mut self.normal_map];
        maps.into_iter().filter(|map| map.size != 0)
    }
}

/// The surfaces of a world on the device. No buffer is empty: where there are no surfaces, each holds one entry of zeros.
#[derive(Clone, Debug)]
pub struct Surfaces {
    /// [`Vertex`]es.
    pub vertices: wgpu::Buffer,
    /// Three vertices, counter-clockwise from the front, and the surface: four `u32` a triangle.
    pub triangles: wgpu::Buffer,
    /// A [`Material`] a surface.
    pub materials: wgpu::Buffer,
    /// A matrix a surface, from where it is to where it was in the frame before.
    pub motions: wgpu::Buffer,
    /// All maps, one after the other, row by row; then their mip levels from the second on.
    pub texels: wgpu::Texture,
    /// How many triangles there are.
    pub count: u32,
    /// The lowest and the highest corner of a box around them [m].
    pub bounds: Option<[Vec3; 2]>,
    /// Whether alpha cuts any of them.
    pub cutouts: bool,
    /// Whether there are pictures on any of them.
    pub pictures: bool,
}

/// The buffer `vertices`.
#[derive(encase::ShaderType)]
struct Vertices {
    #[shader(size(runtime))]
    list: Vec<Vertex>,
}

/// The buffer `triangles`.
#[derive(encase::ShaderType)]
struct Triangles {
    #[shader(size(runtime))]
    list: Vec<UVec4>,
}

/// The buffer `motions`.
#[derive(encase::ShaderType)]
struct Motions {
    #[shader(size(runtime))]
    list: Vec<Mat4>,
}

/// The buffer `materials`.
#[derive(encase::ShaderType)]
struct Materials {
    #[shader(size(runtime))]
    list: Vec<Material>,
}

impl Surfaces {
    /// Uploads surfaces.
    ///
    /// # Errors
    /// More of them, or of their pictures, than the device can hold, and memory that runs out.
    pub async fn new(gpu: &Gpu, surfaces: &[Surface]) -> Result<Self, RenderError> {
        let (vertices, triangles) = triangles(surfaces);
        let mut maps = Maps::default();
        let mut materials: Vec<_> = surfaces.iter().map(|surface| material(surface, &mut maps)).collect();
        let limits = gpu.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let sizes = [("vertices", vertices.len(), 80), ("triangles", triangles.len(), 16)];
        for (what, count, size) in sizes {
            if count as u64 * size > most {
                return Err(RenderError::Limit {
                    what: "surfaces".into(),
                    found: format!("{count} {what}"),
                    limit: format!("{} {what}", most / size),
                    advice: "Use simpler meshes.".into(),
                });
            }
        }
        let count = triangles.len() as u32;
        let bounds = vertices.iter().map(|v| [v.position; 2]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let cutouts = materials.iter().any(|material| material.cutoff > 0.0);
        materials.iter_mut().flat_map(Material::maps).for_each(|map| map.coarser += maps.coarser());
        let pictures = materials.iter_mut().any(|material| material.maps().next().is_some());
        let texels = maps.texture(gpu).await?;
        let (mut vertices, mut triangles) = (vertices, triangles);
        vertices.resize(vertices.len().max(1), Vertex::default());
        triangles.resize(triangles.len().max(1), UVec4::ZERO);
        materials.resize(materials.len().max(1), Material::default());
        Ok(Self {
            vertices: gpu.buffer("vertices", &Vertices { list: vertices }),
            triangles: gpu.buffer("triangles", &Triangles { list: triangles }),
            motions: gpu.buffer("motions", &Motions { list: vec![Mat4::IDENTITY; materials.len()] }),
            materials: gpu.buffer("materials", &Materials { list: materials }),
            texels,
            count,
            bounds,
            cutouts,
            pictures,
        })
    }
}

impl Surfaces {
    /// Takes the same surfaces with other transforms.
    pub(crate) fn moved(&mut self, gpu: &Gpu, surfaces: &[Surface]) {
        let (list, _) = triangles(surfaces);
        self.bounds = list.iter().map(|v| [v.position; 2]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        gpu.write(&self.vertices, &Vertices { list });
    }

    /// Says how surfaces have moved since the frame before, in which they had these transforms.
    pub(crate) fn moved_from(&self, gpu: &Gpu, surfaces: &[Surface], before: &[Mat4]) {
        let motion = |(surface, before): (&Surface, &Mat4)| match surface.world_from_object {
            same if same == *before => Mat4::IDENTITY,
            now => (before.as_dmat4() * now.as_dmat4().inverse()).as_mat4(),
        };
        gpu.write(&self.motions, &Motions { list: surfaces.iter().zip(before).map(motion).collect() });
    }
}

/// Moves the surface of a name.
///
/// # Errors
/// A name that there is not, and a transform that has no inverse; nothing is moved then.
pub(crate) fn set_transform(surfaces: &mut [Surface], name: &str, world_from_object: Mat4) -> Result<(), FieldError> {
    if !world_from_object.is_finite() || !world_from_object.as_dmat4().inverse().as_mat4().is_finite() {
        return Err(FieldError {
            path: format!("surfaces.{name}"),
            found: format!("the transform {world_from_object}"),
            accepted: "one that has an inverse".into(),
        });
    }
    let names = surfaces.iter().map(|surface| surface.name.as_str()).collect::<Vec<_>>().join(", ");
    let named = surfaces.iter_mut().filter(|surface| surface.name == name);
    if named.map(|surface| surface.world_from_object = world_from_object).count() == 0 {
        return Err(FieldError {
            path: "surfaces".into(),
            found: format!("{name:?}"),
            accepted: format!("one of {names}"),
        });
    }
    Ok(())
}

/// Every surface's vertices and triangles in the world.
pub(crate) fn triangles(surfaces: &[Surface]) -> (Vec<Vertex>, Vec<UVec4>) {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (number, surface) in surfaces.iter().enumerate() {
        let (first, mesh) = (vertices.len() as u32, &surface.mesh);
        let linear = Mat3::from_mat4(surface.world_from_object);
        let mirrored = linear.determinant() < 0.0;
        // Lengths are those of a transform that keeps volumes.
        let scale = linear.determinant().abs().cbrt();
        let normals = linear.as_dmat3().inverse().transpose().as_mat3() * scale;
        for (i, position) in mesh.positions.iter().enumerate() {
            let normal = normals * mesh.normals[i];
            let tangent = mesh.tangents.get(i).map_or(Vec4::ZERO, |tangent| {
                let turned = if mirrored { -tangent.w } else { tangent.w };
                (linear * tangent.truncate() / scale).extend(turned)
            });
            let [uv, second] = mesh.texcoords_of(i as u32);
            let position = surface.world_from_object.transform_point3(*position);
            let color = mesh.colors.get(i).copied().unwrap_or(Vec4::ONE);
            vertices.push(Vertex { position, u: uv.x, normal, v: uv.y, tangent, color, second });
        }
        triangles.extend(mesh.triangles.iter().map(|&[a, b, c]| {
            // What mirrors turns triangles over, but not what is front.
            let [b, c] = if mirrored { [c, b] } else { [b, c] };
            UVec4::new(first + a, first + b, first + c, number as u32)
        }));
    }
    (vertices, triangles)
}

/// A surface's material, its maps among `maps`.
fn material(surface: &Surface, maps: &mut Maps) -> Material {
    let material = &surface.material;
    let cut = material.alpha_cutoff.is_some_and(|cutoff| cutoff > 0.0);
    let mut place = |map: &Option<Map>, cut: bool| map.as_ref().map_or(Placed::default(), |map| maps.place(map, cut));
    let mut encoded = Material {
        emission: material.emission,
        double_sided: u32::from(material.double_sided),
        cutoff: material.alpha_cutoff.unwrap_or(0.0),
        emission_map: place(&material.emission_map, false),
        normal_map: place(&material.normal_map.as_ref().map(|normal| normal.map.clone()), false),
        normal_scale: material.normal_map.as_ref().map_or(1.0, |normal| normal.scale),
        ..Material::default()
    };
    match &material.bsdf {
        Bsdf::Lambert { reflectance, map } => {
            (encoded.base, encoded.base_map) = (*reflectance, place(map, cut));
        }
        Bsdf::MetallicRoughness { base_color, base_color_map, metallic, roughness, metallic_roughness_map } => {
            (encoded.kind, encoded.base, encoded.base_map) = (1, *base_color, place(base_color_map, cut));
            (encoded.metallic, encoded.roughness) = (*metallic, *roughness);
            encoded.metallic_roughness_map = place(metallic_roughness_map, false);
        }
        Bsdf::Mirror { reflectance } => (encoded.kind, encoded.base) = (2, *reflectance),
        Bsdf::Dielectric { ior } => (encoded.kind, encoded.ior) = (3, *ior),
    }
    encoded
}
