//! `KHR_lights_punctual`.

use glam::{Mat4, Vec3};
use gltf::khr_lights_punctual::{Kind, Light as Punctual};

use crate::description::Light;

/// Luminous efficacy by which photometric units become radiometric ones [lm·W⁻¹]: of white, (1, 1, 1), the luminance is 683
/// times the radiance, as Y of the CIE counts [W] times 683 lm/W.
pub const LUMENS_PER_WATT: f32 = 683.0;

/// Half-angles of a cone are this much apart and from 0 at least [degrees], as the description wants them.
pub const LEAST_ANGLE: f32 = 1e-3;

/// A light at a node, shining along its −z; `None` where its intensity is no number or negative.
pub(super) fn read(light: &Punctual, file_from_node: &Mat4) -> Option<Light> {
    let strength = Vec3::from(light.color()) * (light.intensity() / LUMENS_PER_WATT);
    if !strength.is_finite() || strength.min_element() < 0.0 {
        return None;
    }
    let position = file_from_node.transform_point3(Vec3::ZERO);
    let direction = file_from_node.transform_vector3(Vec3::NEG_Z).normalize_or(Vec3::NEG_Z);
    Some(match light.kind() {
        Kind::Directional => Light::Directional { direction, irradiance: strength },
        Kind::Point => Light::Point { position, intensity: strength },
        Kind::Spot { inner_cone_angle, outer_cone_angle } => {
            let outer_angle = outer_cone_angle.to_degrees().clamp(2.0 * LEAST_ANGLE, 90.0);
            let inner_angle = inner_cone_angle.to_degrees().clamp(LEAST_ANGLE, outer_angle - LEAST_ANGLE);
            Light::Spot { position, direction, intensity: strength, inner_angle, outer_angle }
        }
    })
}
