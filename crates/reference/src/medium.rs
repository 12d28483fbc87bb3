//! A participating medium in the form tracking asks for.

use glam::{DAffine3, DMat4, DVec3};
use tyndall_scene::description::Optics;
use tyndall_scene::{Field, Volume};

use crate::ReferenceError;
use crate::majorant::Bounds;
use crate::phase::Phase;

/// A medium: [`Volume`] with what a ray needs precomputed.
pub(crate) struct Medium {
    pub unit_from_world: DAffine3,
    pub phase: Phase,
    pub bounds: Bounds,
    /// Extinction where the strength is 1 [m⁻¹].
    pub extinction: DVec3,
    /// The largest component of `extinction`.
    pub steepest: f64,
    /// The least majorant where the medium is not empty [m⁻¹]: a thin medium that glows must collide now and then for
    /// its light to be seen.
    pub least: f64,
    /// Of its box [m].
    pub diagonal: f64,
    field: Field,
    response: Response,
}

/// What a medium does to light at a point.
#[derive(Clone, Copy)]
pub(crate) struct Local {
    pub sigma_s: DVec3,
    pub sigma_a: DVec3,
    pub emission: DVec3,
}

impl Local {
    const NOTHING: Self = Self { sigma_s: DVec3::ZERO, sigma_a: DVec3::ZERO, emission: DVec3::ZERO };
}

enum Response {
    /// Everything is in proportion to the strength.
    Linear(Local),
    /// A transfer function.
    Transfer(Optics),
}

impl Medium {
    /// Collisions expected along the diagonal of a medium that glows but hardly absorbs.
    const GLOW_COLLISIONS: f64 = 4.0;

    pub fn new(volume: &Volume) -> Result<Self, ReferenceError> {
        let world_from_unit: DMat4 = volume.world_from_unit.as_dmat4();
        let bounds = Bounds::new(&volume.field, &volume.optics);
        let (extinction, glows, response) = match &volume.optics {
            Optics::Coefficients { sigma_s, sigma_a, emission, .. } => {
                let local =
                    Local { sigma_s: sigma_s.as_dvec3(), sigma_a: sigma_a.as_dvec3(), emission: emission.as_dvec3() };
                (local.sigma_s + local.sigma_a, local.emission != DVec3::ZERO, Response::Linear(local))
            }
            Optics::Transfer(_) => (DVec3::ONE, true, Response::Transfer(volume.optics.clone())),
        };
        let steepest = extinction.max_element();
        if !(steepest * f64::from(bounds.highest())).is_finite() {
            return Err(ReferenceError::Unbounded { medium: volume.name.clone() });
        }
        let diagonal = world_from_unit.transform_vector3(DVec3::ONE).length();
        Ok(Self {
            unit_from_world: DAffine3::from_mat4(world_from_unit.inverse()),
            phase: Phase::new(&volume.phase),
            bounds,
            extinction,
            steepest,
            least: if glows { Self::GLOW_COLLISIONS / diagonal } else { 0.0 },
            diagonal,
            field: volume.field.clone(),
            response,
        })
    }

    /// Whether light can change its direction in it.
    pub fn scatters(&self) -> bool {
        matches!(&self.response, Response::Linear(local) if local.sigma_s != DVec3::ZERO)
    }

    /// Whether it gives light of its own.
    pub fn glows(&self) -> bool {
        self.least > 0.0
    }

    /// The coefficients at a position in the unit cube; rounding beyond its faces does not matter.
    #[inline]
    pub fn at(&self, unit: DVec3) -> Local {
        let Some(value) = self.value(unit) else { return Local::NOTHING };
        match &self.response {
            Response::Linear(one) => {
                let density = f64::from(value.max(0.0));
                Local {
                    sigma_s: one.sigma_s * density,
                    sigma_a: one.sigma_a * density,
                    emission: one.emission * density,
                }
            }
            Response::Transfer(optics) => {
                let c = optics.at(value);
                Local { sigma_s: c.sigma_s.as_dvec3(), sigma_a: c.sigma_a.as_dvec3(), emission: c.emission.as_dvec3() }
            }
        }
    }

    /// The strength at a position in the unit cube: what `extinction` is per.
    #[inline]
    pub fn strength(&self, unit: DVec3) -> f64 {
        let Some(value) = self.value(unit) else { return 0.0 };
        match &self.response {
            Response::Linear(_) => f64::from(value.max(0.0)),
            Response::Transfer(optics) => f64::from(strength(optics, value)),
        }
    }

    #[inline]
    fn value(&self, unit: DVec3) -> Option<f32> {
        self.field.within(unit.clamp(DVec3::ZERO, DVec3::ONE).as_vec3())
    }
}

/// The scalar that a medium's extinction is in proportion to: the density, or a transfer function's absorption [m⁻¹].
pub(crate) fn strength(optics: &Optics, value: f32) -> f32 {
    match optics {
        Optics::Coefficients { .. } => value.max(0.0),
        Optics::Transfer(_) => optics.at(value).sigma_a.x,
    }
}
