use std::collections::BTreeMap;

use glam::{UVec2, Vec3};
use tyndall_scene::description;

/// A light as shaders see it (`light.wesl`).
#[derive(Clone, Copy, Debug, PartialEq, encase::ShaderType)]
pub struct Light {
    /// Irradiance on a perpendicular plane [W·m⁻²], or radiant intensity on the axis [W·sr⁻¹].
    pub power: Vec3,
    /// [`Light::DIRECTIONAL`], [`Light::LOCAL`] or [`Light::AREA`].
    pub local: u32,
    /// Position [m]; for a directional light the unit vector towards it.
    pub place: Vec3,
    /// With `offset`: attenuation is saturate(cosine·scale + offset)², the cosine of the angle to the axis.
    pub scale: f32,
    /// Unit vector along which a spot shines; an area light's normal.
    pub axis: Vec3,
    /// See `scale`. Of an area light the square of the radius of its part [m²].
    pub offset: f32,
    /// Its shadow maps: the first and how many.
    pub maps: UVec2,
    /// Whether it stands for a part of the environment.
    pub sky: u32,
}

/// The buffer `lights`.
#[derive(Debug, encase::ShaderType)]
pub struct Lights {
    /// As many as there are.
    #[shader(size(runtime))]
    pub lights: Vec<Light>,
}

impl Light {
    /// `local` of parallel light.
    pub const DIRECTIONAL: u32 = 0;
    /// `local` of a light at a position.
    pub const LOCAL: u32 = 1;
    /// `local` of a part of a surface that emits.
    pub const AREA: u32 = 2;

    /// Parallel light that travels along `direction`.
    pub fn directional(direction: Vec3, irradiance: Vec3) -> Self {
        let towards = -direction.normalize();
        Self { power: irradiance, place: towards, offset: 1.0, ..Self::dark() }
    }

    /// Light of a part of a surface, of an area [m²] around a position: of one side, with this unit normal.
    pub fn area(position: Vec3, normal: Vec3, area: f32, radiance: Vec3) -> Self {
        let squared_radius = area / std::f32::consts::PI;
        let (power, local) = (radiance * area, Self::AREA);
        Self { power, local, place: position, axis: normal, offset: squared_radius, ..Self::dark() }
    }

    fn dark() -> Self {
        Self {
            power: Vec3::ZERO,
            local: Self::DIRECTIONAL,
            place: Vec3::ZERO,
            scale: 0.0,
            axis: Vec3::ZERO,
            offset: 0.0,
            maps: UVec2::ZERO,
            sky: 0,
        }
    }
}

/// The lights that stand somewhere or come from one direction, and the sum of the constant environments.
pub(super) fn encode(lights: &BTreeMap<String, description::Light>) -> (Vec<Light>, Vec3) {
    let mut encoded = Vec::new();
    let mut environment = Vec3::ZERO;
    for light in lights.values() {
        match *light {
            description::Light::Directional { direction, irradiance } => {
                encoded.push(Light::directional(direction, irradiance));
            }
            description::Light::Point { position, intensity } => encoded.push(Light {
                power: intensity,
                local: Light::LOCAL,
                place: position,
                offset: 1.0,
                ..Light::dark()
            }),
            description::Light::Spot { position, direction, intensity, inner_angle, outer_angle } => {
                let (inner, outer) = (inner_angle.to_radians().cos(), outer_angle.to_radians().cos());
                let scale = 1.0 / (inner - outer).max(1e-4);
                encoded.push(Light {
                    power: intensity,
                    local: Light::LOCAL,
                    place: position,
                    scale,
                    axis: direction.normalize(),
                    offset: -outer * scale,
                    ..Light::dark()
                });
            }
            description::Light::Constant { radiance } => environment += radiance,
            // The world holds the map.
            description::Light::Environment { .. } => {}
        }
    }
    (encoded, environment)
}
