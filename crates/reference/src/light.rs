//! Lamps and the environment: what arrives at a point, before what is on the way takes its share.

use glam::DVec3;
use tyndall_scene::World;
use tyndall_scene::description::Light;

use crate::sky::Sky;

/// The lights of a scene, in the form paths ask for.
pub(crate) struct Lights {
    /// Those that no path finds by chance.
    pub lamps: Vec<Lamp>,
    /// The radiance from every direction in which a path escapes [W·sr⁻¹·m⁻²].
    pub environment: DVec3,
    /// What comes on top, by direction.
    pub sky: Option<Sky>,
}

/// A directional light, or one from a point.
pub(crate) enum Lamp {
    Sun { travel: DVec3, irradiance: DVec3 },
    Bulb { position: DVec3, intensity: DVec3, cone: Option<Cone> },
}

/// A spot light's cone.
pub(crate) struct Cone {
    axis: DVec3,
    cos_inner: f64,
    cos_outer: f64,
}

/// Light on its way to a point.
pub(crate) struct Arrival {
    /// The direction it travels in; a unit vector.
    pub travel: DVec3,
    /// How far away the light is [m]; infinite for a directional one.
    pub distance: f64,
    /// Irradiance on a plane perpendicular to `travel`, in vacuum [W·m⁻²].
    pub irradiance: DVec3,
}

impl Lights {
    pub fn new(world: &World) -> Self {
        let sky = world.environment.clone().map(Sky::new);
        let mut lights = Self { lamps: Vec::new(), environment: DVec3::ZERO, sky };
        for light in world.lights.values() {
            match light {
                Light::Directional { direction, irradiance } => lights
                    .lamps
                    .push(Lamp::Sun { travel: direction.as_dvec3().normalize(), irradiance: irradiance.as_dvec3() }),
                Light::Point { position, intensity } => lights.lamps.push(Lamp::Bulb {
                    position: position.as_dvec3(),
                    intensity: intensity.as_dvec3(),
                    cone: None,
                }),
                Light::Spot { position, direction, intensity, inner_angle, outer_angle } => {
                    let cone = Cone {
                        axis: direction.as_dvec3().normalize(),
                        cos_inner: f64::from(*inner_angle).to_radians().cos(),
                        cos_outer: f64::from(*outer_angle).to_radians().cos(),
                    };
                    lights.lamps.push(Lamp::Bulb {
                        position: position.as_dvec3(),
                        intensity: intensity.as_dvec3(),
                        cone: Some(cone),
                    });
                }
                Light::Constant { radiance } => lights.environment += radiance.as_dvec3(),
                // The world has it, loaded.
                Light::Environment { .. } => {}
            }
        }
        lights
    }

    /// The radiance from a direction in which a path escapes [W·sr⁻¹·m⁻²].
    pub fn behind(&self, direction: DVec3) -> DVec3 {
        self.environment + self.sky.as_ref().map_or(DVec3::ZERO, |sky| sky.radiance(direction))
    }
}

impl Lamp {
    /// Nearer than this a point light's inverse square is left out [m]: no float of a scene in metres resolves it, and
    /// a path gets there with probability 0.
    pub const NEAREST: f64 = 1e-12;

    /// The light that would arrive at `point` through vacuum, or `None` where there is none.
    pub fn arrival(&self, point: DVec3) -> Option<Arrival> {
        match self {
            Lamp::Sun { travel, irradiance } => {
                Some(Arrival { travel: *travel, distance: f64::INFINITY, irradiance: *irradiance })
            }
            Lamp::Bulb { position, intensity, cone } => {
                let offset = point - position;
                let distance = offset.length();
                if distance.is_nan() || distance < Self::NEAREST {
                    return None;
                }
                let travel = offset / distance;
                let share = cone.as_ref().map_or(1.0, |cone| cone.share(travel));
                let irradiance = *intensity * (share / (distance * distance));
                (share > 0.0).then_some(Arrival { travel, distance, irradiance })
            }
        }
    }
}

impl Cone {
    /// The share of the intensity on the axis that goes this way: the linear ramp of the cosine between the two
    /// angles, squared [KHR_lights_punctual].
    fn share(&self, travel: DVec3) -> f64 {
        let ramp = (self.axis.dot(travel) - self.cos_outer) / (self.cos_inner - self.cos_outer).max(f64::MIN_POSITIVE);
        let ramp = ramp.clamp(0.0, 1.0);
        ramp * ramp
    }
}
