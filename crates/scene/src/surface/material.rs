//! What a surface does to light, with its textures in memory.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};

use crate::description;

/// A material with its textures. Reflection is the same on both sides; normals are turned to the side that is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in the scene or in the file it comes from.
    pub name: String,
    /// What it does to light.
    pub bsdf: Bsdf,
    /// Emitted radiance [W·sr⁻¹·m⁻²], the same in all directions, of the front side; of both where `double_sided`.
    pub emission: Vec3,
    /// Multiplies `emission`.
    pub emission_map: Option<Map>,
    /// Bends the normals for shading.
    pub normal_map: Option<NormalMap>,
    /// Whether the back emits, too.
    pub double_sided: bool,
    /// Where the alpha of the base colour's map is less than this there is no surface.
    pub alpha_cutoff: Option<f32>,
}

/// How light is scattered.
#[derive(Clone, Debug, PartialEq)]
pub enum Bsdf {
    /// reflectance/π.
    Lambert {
        /// The share of light that is reflected.
        reflectance: Vec3,
        /// Multiplies it.
        map: Option<Map>,
    },
    /// [glTF2, B]: with α = max(roughness², 0.001), the microfacet distribution D of Trowbridge and Reitz (GGX), Smith's
    /// height-correlated masking and shadowing, and Schlick's F = f₀ + (1 − f₀)(1 − v·h)⁵: a metal is D·G·F/(4 n·l n·v) with
    /// f₀ = base colour; a dielectric (1 − F)·base/π + D·G·F/(4 n·l n·v) with f₀ = 0.04; the two are mixed by `metallic`.
    MetallicRoughness {
        /// The reflectance of the diffuse base, or of a metal at normal incidence.
        base_color: Vec3,
        /// Multiplies it.
        base_color_map: Option<Map>,
        /// From dielectric, 0, to metal, 1.
        metallic: f32,
        /// The square root of α.
        roughness: f32,
        /// Its green multiplies `roughness`, its blue `metallic`.
        metallic_roughness_map: Option<Map>,
    },
    /// Reflects like a mirror.
    Mirror {
        /// The share of light that is reflected.
        reflectance: Vec3,
    },
    /// Reflects and refracts by Fresnel's equations.
    Dielectric {
        /// The refractive index behind the front side over that before it.
        ior: f32,
    },
}

/// A picture on a surface.
#[derive(Clone, Debug)]
pub struct Map(pub Arc<Texture>);

impl PartialEq for Map {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// A map of normals in tangent space: (2·rgb − 1)·(scale, scale, 1), then made a unit vector.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalMap {
    /// The picture.
    pub map: Map,
    /// How strong it is.
    pub scale: f32,
}

/// A picture in memory, 8 bits a channel; it repeats beyond its edges.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Texture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue, alpha; row by row from the top.
    pub texels: Vec<[u8; 4]>,
    /// Whether red, green and blue are sRGB, and not linear.
    pub srgb: bool,
}

impl Texture {
    /// Linear red, green, blue, alpha at texture coordinates: bilinear between texels' centres.
    pub fn at(&self, uv: Vec2) -> Vec4 {
        let [w, h] = [self.width, self.height];
        let (x, y) = (uv.x.rem_euclid(1.0) * w as f32 - 0.5, uv.y.rem_euclid(1.0) * h as f32 - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let texel = |dx: i64, dy: i64| {
            let column = (x.floor() as i64 + dx).rem_euclid(i64::from(w)) as usize;
            let row = (y.floor() as i64 + dy).rem_euclid(i64::from(h)) as usize;
            self.linear(self.texels[row * w as usize + column])
        };
        texel(0, 0).lerp(texel(1, 0), fx).lerp(texel(0, 1).lerp(texel(1, 1), fx), fy)
    }

    fn linear(&self, texel: [u8; 4]) -> Vec4 {
        let [r, g, b, a] = texel.map(|byte| f32::from(byte) / 255.0);
        let decode = |x: f32| if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
        if self.srgb { Vec4::new(decode(r), decode(g), decode(b), a) } else { Vec4::new(r, g, b, a) }
    }
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: "default".into(),
            bsdf: Bsdf::Lambert { reflectance: Vec3::splat(0.5), map: None },
            emission: Vec3::ZERO,
            emission_map: None,
            normal_map: None,
            double_sided: false,
            alpha_cutoff: None,
        }
    }
}

impl Material {
    pub(super) fn new(name: &str, material: &description::Material) -> Self {
        let bsdf = match *material {
            description::Material::Lambert { reflectance } => Bsdf::Lambert { reflectance, map: None },
            description::Material::MetallicRoughness { base_color, metallic, roughness } => Bsdf::MetallicRoughness {
                base_color,
                base_color_map: None,
                metallic,
                roughness,
                metallic_roughness_map: None,
            },
            description::Material::Mirror { reflectance } => Bsdf::Mirror { reflectance },
            description::Material::Dielectric { ior } => Bsdf::Dielectric { ior },
        };
        Self { name: name.into(), bsdf, ..Self::default() }
    }
}
