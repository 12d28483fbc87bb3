//! Virtual lights as the lights that other renderers know.

use std::f32::consts::PI;

use tyndall_scene::World;
use tyndall_scene::description::Light;
use tyndall_scene::parameter::Settings;

use super::vpl::{COSINE, LOBE, PARALLEL, Vpl};
use super::{TECHNIQUE, Walk};
use crate::RenderError;

/// The virtual lights of a world, by its settings of the technique, as point, spot and directional lights with names; images in
/// mirrors are left out, and shadows are for who renders them. A light with the cosine becomes a spot of 90 degrees: that falls with the
/// cosine's square [KHR_lights_punctual], and has the same flux.
///
/// # Errors
/// Settings that are not accepted.
pub fn punctual(world: &World) -> Result<Vec<(String, Light)>, RenderError> {
    let given = world.scene.techniques.get(TECHNIQUE.name);
    let settings = Settings::new(TECHNIQUE.name, TECHNIQUE.parameters, given)?;
    let vpls = Walk::new(world, &settings)?.lights();
    let lamps = world
        .lights
        .iter()
        .filter(|(_, light)| matches!(light, Light::Directional { .. } | Light::Point { .. } | Light::Spot { .. }));
    let mut lights: Vec<_> = lamps.map(|(name, light)| (name.clone(), light.clone())).collect();
    let own = vpls.iter().filter(|vpl| !vpl.is_lamp());
    lights.extend(own.filter_map(|vpl| Some((format!("vpl {}, bounce {}", vpl.path, vpl.bounce), light(vpl)?))));
    Ok(lights)
}

fn light(vpl: &Vpl) -> Option<Light> {
    let spot = |intensity| Light::Spot {
        position: vpl.position,
        direction: vpl.normal,
        // ∫cos = π over the hemisphere, ∫cos² = 2π/3.
        intensity: 1.5 * intensity,
        inner_angle: 0.0,
        outer_angle: 90.0,
    };
    match vpl.kind {
        COSINE => Some(spot(vpl.power)),
        // As if it were diffuse.
        LOBE => Some(spot(vpl.power * vpl.base / PI)),
        PARALLEL => Some(Light::Directional { direction: -vpl.normal, irradiance: vpl.power }),
        _ => None,
    }
}
