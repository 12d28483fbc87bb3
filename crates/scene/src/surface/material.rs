//! What a surface does to light, with its textures in memory.

use glam::Vec3;

use super::{Map, NormalMap};

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
    /// Its red is the share of environment light that reaches a point, where nothing better is known.
    pub occlusion_map: Option<Map>,
    /// What passes through it; no renderer shows it yet.
    pub transmission: Option<Transmission>,
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

/// What a material is made of inside, read from files (KHR_materials_transmission, _ior, _volume) and kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Transmission {
    /// The share of the light that enters and is not diffusely reflected, but passes through.
    pub factor: f32,
    /// Its red multiplies `factor`.
    pub map: Option<Map>,
    /// The refractive index of the inside.
    pub ior: f32,
    /// How thick it is beneath the surface [m]; 0 is a thin wall.
    pub thickness: f32,
    /// The green of the picture multiplies `thickness`.
    pub thickness_map: Option<Map>,
    /// After this length of the inside [m] white light is `attenuation_color`; infinite where nothing is absorbed.
    pub attenuation_distance: f32,
    /// See `attenuation_distance`.
    pub attenuation_color: Vec3,
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
            occlusion_map: None,
            transmission: None,
        }
    }
}
