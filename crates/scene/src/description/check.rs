//! What holds between a scene's fields, which no field can check alone.

use super::{Density, Emitter, Light, Medium, Optics, Raw, Scene, Shape};
use crate::FieldError;
use crate::field::{Formula, MAX_COORDINATE};
use crate::volume::Format;

impl Scene {
    /// Checks every field and the relations between them. Parsing a [`crate::Document`] does this; a scene built in
    /// code is checked when it is loaded.
    ///
    /// # Errors
    /// The first field that is out of range or contradicts another, with its path.
    pub fn check(&self) -> Result<(), FieldError> {
        self.check_values()?;
        self.check_relations()
    }

    /// Checks what reading a file does not: the relations between fields.
    pub(crate) fn check_relations(&self) -> Result<(), FieldError> {
        if self.camera.is_none() {
            if self.media.is_empty() && self.surfaces.is_empty() {
                return invalid(
                    "",
                    "no `camera`".into(),
                    "a table with `camera`, or something that one can be put before",
                );
            }
        } else if self.camera.frame().is_none() {
            let [target, position] = [self.camera.target, self.camera.position].map(|v| v.to_array());
            let found = format!("{target:?}, seen from {position:?}");
            return invalid("camera.target", found, "a point apart from `position`, not straight along `up`");
        }
        for (name, light) in &self.lights {
            if let Light::Spot { inner_angle, outer_angle, .. } = light
                && inner_angle >= outer_angle
            {
                let found = format!("{inner_angle} with outer_angle = {outer_angle}");
                return invalid(&format!("lights.{name}.spot.inner_angle"), found, "an angle less than outer_angle");
            }
        }
        let mut maps = self.lights.iter().filter(|(_, light)| matches!(light, Light::Environment { .. }));
        if let (Some((first, _)), Some((second, _))) = (maps.next(), maps.next()) {
            let found = format!("a second environment map, beside lights.{first}");
            return invalid(&format!("lights.{second}.environment"), found, "one in a scene");
        }
        let mut cameras = self.surfaces.iter().filter_map(|(name, surface)| match &surface.shape {
            Shape::Mesh { camera, .. } => camera.as_ref().map(|camera| (name, camera)),
            _ => None,
        });
        if let Some((name, camera)) = cameras.next() {
            let other = cameras.next().map(|(other, _)| format!("surfaces.{other}"));
            if let Some(other) = other.or((!self.camera.is_none()).then(|| "the scene's `camera`".into())) {
                let found = format!("{camera:?} beside that of {other}");
                return invalid(&format!("surfaces.{name}.shape.mesh.camera"), found, "one camera");
            }
        }
        for (name, surface) in &self.surfaces {
            surface.check(&format!("surfaces.{name}"))?;
            if let Some(material) = &surface.material
                && !self.materials.contains_key(material)
            {
                let known = self.materials.keys().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
                let accepted =
                    format!("one of the scene's materials: {}", if known.is_empty() { "none" } else { &known });
                return invalid(&format!("surfaces.{name}.material"), format!("{material:?}"), &accepted);
            }
        }
        for (name, medium) in &self.media {
            match &medium.density {
                Density::Homogeneous { min, max } if min.cmpge(*max).any() => {
                    return empty_box(&format!("media.{name}.density.homogeneous.max"), *min, *max);
                }
                Density::Exponential { min, max, .. } if min.cmpge(*max).any() => {
                    return empty_box(&format!("media.{name}.density.exponential.max"), *min, *max);
                }
                Density::Exponential { min, max, base, scale_height } => {
                    let path = format!("media.{name}.density.exponential");
                    if !(scale_height / (max.y - min.y)).is_normal() {
                        let found = format!("{scale_height:?} for a box from y = {:?} to {:?}", min.y, max.y);
                        let accepted = "a height comparable to the box's";
                        return invalid(&format!("{path}.scale_height"), found, accepted);
                    }
                    let bottom = ((base - min.y) / scale_height).exp();
                    if !bottom.is_finite() {
                        let found =
                            format!("{base:?}, so that the density overflows at the box's bottom, y = {:?}", min.y);
                        return invalid(&format!("{path}.base"), found, "a base at most 88 scale heights above it");
                    }
                }
                Density::Sphere { radius, falloff, .. } if falloff > radius => {
                    let found = format!("{falloff:?} with radius = {radius:?}");
                    let accepted = "a length of at most the radius";
                    return invalid(&format!("media.{name}.density.sphere.falloff"), found, accepted);
                }
                Density::Noise { min, max, .. } if min.cmpge(*max).any() => {
                    return empty_box(&format!("media.{name}.density.noise.max"), *min, *max);
                }
                Density::Noise { min, max, scale, octaves, lacunarity, .. } => {
                    let finest = scale / lacunarity.powf(*octaves as f32 - 1.0);
                    let farthest = min.abs().max(max.abs()).max_element();
                    if farthest / finest > MAX_COORDINATE {
                        let found =
                            format!("{scale:?}, whose finest octave is {finest:e} m, in a box up to {farthest:?} m");
                        let accepted = "a scale whose finest octave is at least a 2^20th of that";
                        return invalid(&format!("media.{name}.density.noise.scale"), found, accepted);
                    }
                }
                Density::Expression { min, max, .. } if min.cmpge(*max).any() => {
                    return empty_box(&format!("media.{name}.density.expression.max"), *min, *max);
                }
                Density::Expression { wgsl, .. } => {
                    Formula::parse(wgsl).map_err(|error| error.of(name))?;
                }
                Density::Grid { file, name: grid, raw } => check_grid(name, file, grid.as_deref(), raw.as_ref())?,
                Density::Emitter(Emitter { lifetime, frame_rate, .. }) if lifetime * frame_rate > MOST_STEPS => {
                    let found = format!("{frame_rate:?} with lifetime = {lifetime:?}");
                    return invalid(&format!("media.{name}.density.emitter.frame_rate"), found, ACCEPTED_STEPS);
                }
                Density::Emitter(Emitter { time, lifetime, .. }) if time / lifetime > MOST_LIVES => {
                    let found = format!("{time:?} with lifetime = {lifetime:?}");
                    let accepted = "a time of at most 10000 lifetimes";
                    return invalid(&format!("media.{name}.density.emitter.time"), found, accepted);
                }
                Density::Homogeneous { .. }
                | Density::Sphere { .. }
                | Density::Mesh { .. }
                | Density::Particles(_)
                | Density::Emitter(_)
                | Density::Strands(_)
                | Density::Head(_) => {}
            }
            if let Some(bodies) = medium.density.bodies() {
                check_bodies(name, bodies, medium)?;
            }
            if let Optics::Coefficients { phase, .. } = &medium.optics {
                phase.check(&format!("media.{name}.optics.coefficients.phase"))?;
            }
            if let Optics::Transfer(transfer) = &medium.optics {
                transfer.check(&format!("media.{name}.optics.transfer"))?;
                for (field, set) in [("temperature", medium.temperature.is_some()), ("color", medium.color.is_some())] {
                    if set {
                        let found = format!("`{field}` with `optics.transfer`");
                        return invalid(&format!("media.{name}.{field}"), found, "it with `optics.coefficients`");
                    }
                }
            }
            if let Some(clip) = &medium.clip {
                clip.check(&format!("media.{name}.clip"))?;
            }
        }
        Ok(())
    }
}

/// The most steps of a particle's life, and the most lives that are emitted before a picture is taken.
const MOST_STEPS: f32 = 10_000.0;
const ACCEPTED_STEPS: &str = "at most 10000 steps in a lifetime";
const MOST_LIVES: f32 = 10_000.0;

/// Bodies stay round, and what they do to light is in proportion to how many overlap.
fn check_bodies(name: &str, bodies: &str, medium: &Medium) -> Result<(), FieldError> {
    let scale = medium.transform.scale;
    if scale != glam::Vec3::splat(scale.x) {
        let found = format!("{:?} with density.{bodies}", scale.to_array());
        return invalid(&format!("media.{name}.transform.scale"), found, "the same factor on every axis");
    }
    if matches!(medium.optics, Optics::Transfer(_)) {
        let found = format!("it with density.{bodies}");
        return invalid(&format!("media.{name}.optics.transfer"), found, "optics.coefficients");
    }
    if medium.color.is_some() {
        let found = format!("it with density.{bodies}, which has colours of its own");
        return invalid(&format!("media.{name}.color"), found, "it with other densities");
    }
    Ok(())
}

/// What a file is asked for is what its format has.
fn check_grid(medium: &str, file: &str, name: Option<&str>, raw: Option<&Raw>) -> Result<(), FieldError> {
    let path = format!("media.{medium}.density.grid");
    let format = Format::of(file);
    if format == Some(Format::Raw) && raw.is_none() {
        let accepted = "`raw` with a file that has no header: its dims, type and spacing";
        return invalid(&path, format!("no `raw` with file = {file:?}"), accepted);
    }
    if format != Some(Format::Raw) && raw.is_some() {
        let accepted = "`raw` only with a file that has no header: .raw, .bin or .dat";
        return invalid(&format!("{path}.raw"), format!("`raw` with file = {file:?}"), accepted);
    }
    if let (Some(name), Some(format)) = (name, format)
        && !matches!(format, Format::Vdb | Format::NanoVdb | Format::Vti)
    {
        let accepted = format!("no name with {} file, which holds one volume", format.name());
        return invalid(&format!("{path}.name"), format!("{name:?}"), &accepted);
    }
    Ok(())
}

pub(super) fn empty_box(path: &str, min: glam::Vec3, max: glam::Vec3) -> Result<(), FieldError> {
    let found = format!("{:?} with min = {:?}", max.to_array(), min.to_array());
    invalid(path, found, "a corner above `min` on every axis")
}

pub(super) fn invalid(path: &str, found: String, accepted: &str) -> Result<(), FieldError> {
    Err(FieldError { path: path.into(), found, accepted: accepted.into() })
}
