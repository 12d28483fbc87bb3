//! Virtual point lights as shaders see them (`vpl.wesl`).

use glam::{DVec3, Vec3, Vec4};
use tyndall_scene::description::Light;

use crate::math::brdf::Brdf;
use crate::resident;

/// How a virtual light shines.
pub const COSINE: u32 = 0;
/// By the BRDF of what reflects there.
pub const LOBE: u32 = 1;
/// As a point or spot light.
pub const LAMP: u32 = 2;
/// From one direction.
pub const PARALLEL: u32 = 3;

/// No mirror.
pub const NO_MIRROR: u32 = u32::MAX;

/// The path of what belongs to none.
const LAMPS: u32 = u32::MAX;

/// A virtual point light.
#[derive(Clone, Copy, Debug, PartialEq, encase::ShaderType)]
pub struct Vpl {
    /// Where it is [m]; not of use where it is parallel light.
    pub position: Vec3,
    /// How it shines.
    pub kind: u32,
    /// The unit normal on the side that shines; of a lamp its axis; of parallel light the unit vector towards it.
    pub normal: Vec3,
    /// Of a lobe the width of the facets' distribution; of a lamp its cone's `offset` (`resident/light.wesl`).
    pub alpha: f32,
    /// Intensity along the normal, which falls with the cosine [W·sr⁻¹]; of a lobe the flux that arrives [W]; of a lamp its
    /// intensity [W·sr⁻¹]; of parallel light its irradiance [W·m⁻²].
    pub power: Vec3,
    /// Of a lobe how metallic it is; of a lamp its cone's `scale`.
    pub metallic: f32,
    /// Of a lobe the unit vector to where the light comes from.
    pub incoming: Vec3,
    /// The surface through which it is seen, mirrored; or [`NO_MIRROR`].
    pub mirror: u32,
    /// Of a lobe its reflectance.
    pub base: Vec3,
    /// How often the light has been reflected.
    pub bounce: u32,
    /// Of a lobe the unit normal for shading.
    pub shading: Vec3,
    /// The path that it belongs to.
    pub path: u32,
    /// The mirror's unit normal, and its distance from the origin [m].
    pub plane: Vec4,
}

impl Vpl {
    /// Light that leaves a point with the cosine.
    pub fn cosine(position: DVec3, normal: DVec3, intensity: DVec3) -> Self {
        Self {
            position: position.as_vec3(),
            normal: normal.as_vec3(),
            power: intensity.as_vec3(),
            ..Self::none(COSINE)
        }
    }

    /// Parallel light from a direction.
    pub fn directional(towards: DVec3, irradiance: DVec3) -> Self {
        Self { normal: towards.as_vec3(), power: irradiance.as_vec3(), ..Self::none(PARALLEL) }
    }

    /// Light that arrives from `incoming` with a flux and is reflected by a BRDF.
    pub fn lobe(position: DVec3, [normal, shading]: [DVec3; 2], incoming: DVec3, flux: DVec3, brdf: &Brdf) -> Self {
        Self {
            position: position.as_vec3(),
            normal: normal.as_vec3(),
            shading: shading.as_vec3(),
            incoming: incoming.as_vec3(),
            power: flux.as_vec3(),
            base: brdf.base.as_vec3(),
            alpha: brdf.alpha as f32,
            metallic: brdf.metallic as f32,
            ..Self::none(LOBE)
        }
    }

    /// A lamp of the scene; black where it is none.
    pub fn lamp(light: &Light) -> Self {
        match *light {
            Light::Directional { direction, irradiance } => {
                Self { normal: -direction.normalize(), power: irradiance, ..Self::none(PARALLEL) }
            }
            Light::Point { position, intensity } => {
                Self { position, power: intensity, metallic: 0.0, alpha: 1.0, ..Self::none(LAMP) }
            }
            Light::Spot { position, direction, intensity, inner_angle, outer_angle } => {
                let (inner, outer) = (inner_angle.to_radians().cos(), outer_angle.to_radians().cos());
                let (scale, normal) = (1.0 / (inner - outer).max(1e-4), direction.normalize());
                Self { position, normal, power: intensity, metallic: scale, alpha: -outer * scale, ..Self::none(LAMP) }
            }
            Light::Constant { .. } | Light::Environment { .. } => Self::none(PARALLEL),
        }
    }

    /// A light that is none.
    pub const BLACK: Self = Self::none(PARALLEL);

    /// Whether it is a light of the scene that has one place or direction.
    pub fn is_lamp(&self) -> bool {
        self.kind == LAMP || (self.kind == PARALLEL && self.path == LAMPS)
    }

    /// Whether it can have a shadow map: lamps and images in mirrors have none.
    pub fn has_map(&self) -> bool {
        !self.is_lamp() && self.mirror == NO_MIRROR
    }

    /// As a light of the scene, with 1/(r² + this square of a radius [m²]) in place of 1/r²; a lobe as if it were diffuse.
    pub fn softened(&self, squared_radius: f32) -> resident::Light {
        if self.kind == PARALLEL {
            return resident::Light::directional(-self.normal, self.power);
        }
        let area = std::f32::consts::PI * squared_radius.max(1e-12);
        let intensity = if self.kind == LOBE { self.power * self.base / std::f32::consts::PI } else { self.power };
        resident::Light::area(self.position, self.normal, area, intensity / area)
    }

    const fn none(kind: u32) -> Self {
        Self {
            position: Vec3::ZERO,
            kind,
            normal: Vec3::ZERO,
            alpha: 1.0,
            power: Vec3::ZERO,
            metallic: 0.0,
            incoming: Vec3::ZERO,
            mirror: NO_MIRROR,
            base: Vec3::ZERO,
            bounce: 0,
            shading: Vec3::ZERO,
            path: LAMPS,
            plane: Vec4::ZERO,
        }
    }
}
