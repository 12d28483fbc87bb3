use std::collections::BTreeMap;

use glam::Vec3;
use tyndall_scene::description;

/// A light as shaders see it (`light.wesl`).
#[derive(Clone, Copy, Debug, PartialEq, encase::ShaderType)]
pub struct Light {
    /// Irradiance on a perpendicular plane [W·m⁻²], or radiant intensity on the axis [W·sr⁻¹].
    pub power: Vec3,
    /// 1 for a light at a position, 0 for a directional one.
    pub local: u32,
    /// Position [m]; for a directional light the unit vector towards it.
    pub place: Vec3,
    /// With `offset`: attenuation is saturate(cosine·scale + offset)², the cosine of the angle to the axis.
    pub scale: f32,
    /// Unit vector along which a spot shines.
    pub axis: Vec3,
    /// See `scale`.
    pub offset: f32,
}

/// The buffer `lights`.
#[derive(Debug, encase::ShaderType)]
pub struct Lights {
    /// As many as there are.
    #[shader(size(runtime))]
    pub lights: Vec<Light>,
}

impl Light {
    /// Parallel light that travels along `direction`.
    pub fn directional(direction: Vec3, irradiance: Vec3) -> Self {
        let towards = -direction.normalize();
        Self { power: irradiance, local: 0, place: towards, scale: 0.0, axis: Vec3::ZERO, offset: 1.0 }
    }
}

/// The lights that come from one direction, then those that stand somewhere, and the sum of the constant environments.
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
                local: 1,
                place: position,
                scale: 0.0,
                axis: Vec3::ZERO,
                offset: 1.0,
            }),
            description::Light::Spot { position, direction, intensity, inner_angle, outer_angle } => {
                let (inner, outer) = (inner_angle.to_radians().cos(), outer_angle.to_radians().cos());
                let scale = 1.0 / (inner - outer).max(1e-4);
                encoded.push(Light {
                    power: intensity,
                    local: 1,
                    place: position,
                    scale,
                    axis: direction.normalize(),
                    offset: -outer * scale,
                });
            }
            description::Light::Constant { radiance } => environment += radiance,
            // The world holds the map.
            description::Light::Environment { .. } => {}
        }
    }
    encoded.sort_by_key(|light| light.local);
    (encoded, environment)
}
