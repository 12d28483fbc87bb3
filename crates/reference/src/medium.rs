//! A participating medium in the form tracking asks for.

use glam::{DAffine3, DMat4, DVec3};
use tyndall_scene::description::{Optics, Plane};
use tyndall_scene::particles::Here;
use tyndall_scene::{Color, Field, Temperature, Volume};

use crate::ReferenceError;
use crate::bodies::Bodies;
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
    /// In the world; the medium is where every one of them keeps it.
    pub clip: Vec<Plane>,
    /// What it is made of, where that is particles or strands: `bounds` are then of nothing, and collisions are found among
    /// them, at [`rate`](Self::rate).
    pub bodies: Option<Bodies>,
    world_from_unit: DAffine3,
    field: Field,
    response: Response,
    temperature: Option<Temperature>,
    color: Option<Color>,
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

    fn times(&self, density: f64) -> Self {
        Self { sigma_s: self.sigma_s * density, sigma_a: self.sigma_a * density, emission: self.emission * density }
    }
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
        if let Optics::Transfer(transfer) = &volume.optics
            && let Some(field) = transfer.unphysical()
        {
            return Err(ReferenceError::Unphysical { medium: volume.name.clone(), field });
        }
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
            least: if glows || volume.temperature.is_some() { Self::GLOW_COLLISIONS / diagonal } else { 0.0 },
            diagonal,
            clip: volume.clip.clone(),
            bodies: Bodies::new(&volume.field),
            world_from_unit: DAffine3::from_mat4(world_from_unit),
            field: volume.field.clone(),
            response,
            temperature: volume.temperature.clone(),
            color: volume.color.clone(),
        })
    }

    /// Whether a point [m] is in its box, and not cut away; and where that is in the unit cube.
    pub fn place(&self, point: DVec3) -> Option<DVec3> {
        let unit = self.unit_from_world.transform_point3(point);
        let within =
            (unit - 0.5).abs().max_element() <= 0.5 && self.clip.iter().all(|plane| height(plane, point) <= 0.0);
        within.then_some(unit)
    }

    /// Whether light can change its direction in it.
    pub fn scatters(&self) -> bool {
        matches!(&self.response, Response::Linear(local) if local.sigma_s != DVec3::ZERO)
    }

    /// Whether it gives light of its own.
    pub fn glows(&self) -> bool {
        self.least > 0.0
    }

    /// Collisions with bodies per density: as many as extinction has in its strongest channel, and for what glows as many as
    /// make its light seen.
    pub fn rate(&self) -> f64 {
        self.steepest.max(if self.glows() { 1.0 } else { 0.0 })
    }

    /// The coefficients at a position in the unit cube; rounding beyond its faces does not matter.
    #[inline]
    pub fn at(&self, unit: DVec3) -> Local {
        if let (Some(here), Response::Linear(one)) = (self.here(unit), &self.response) {
            let mut local = one.times(here.density);
            let lost = local.sigma_s * (1.0 - here.color);
            local.sigma_s -= lost;
            local.sigma_a += lost;
            return self.tinted(local, unit);
        }
        let Some(value) = self.value(unit) else { return Local::NOTHING };
        let local = match &self.response {
            Response::Linear(one) => one.times(f64::from(value.max(0.0))),
            Response::Transfer(optics) => {
                let c = optics.at(value);
                Local { sigma_s: c.sigma_s.as_dvec3(), sigma_a: c.sigma_a.as_dvec3(), emission: c.emission.as_dvec3() }
            }
        };
        self.tinted(local, unit)
    }

    /// What grids of colour and temperature make of it.
    #[inline]
    fn tinted(&self, mut local: Local, unit: DVec3) -> Local {
        if self.color.is_some() || self.temperature.is_some() {
            let point = self.world_from_unit.transform_point3(unit).as_vec3();
            if let Some(color) = &self.color {
                let lost = local.sigma_s * (1.0 - color.at(point).as_dvec3());
                local.sigma_s -= lost;
                local.sigma_a += lost;
            }
            if let Some(temperature) = &self.temperature {
                local.emission += local.sigma_a * temperature.radiance(point).as_dvec3();
            }
        }
        local
    }

    /// The strength at a position in the unit cube: what `extinction` is per.
    #[inline]
    pub fn strength(&self, unit: DVec3) -> f64 {
        if let Some(here) = self.here(unit) {
            return here.density;
        }
        let Some(value) = self.value(unit) else { return 0.0 };
        match &self.response {
            Response::Linear(_) => f64::from(value.max(0.0)),
            Response::Transfer(optics) => f64::from(strength(optics, value)),
        }
    }

    /// What bodies are at a position in the unit cube, in double precision: fibres are thinner than single resolves.
    #[inline]
    fn here(&self, unit: DVec3) -> Option<Here> {
        self.bodies.as_ref()?;
        self.field.bodies_at(self.world_from_unit.transform_point3(unit))
    }

    #[inline]
    fn value(&self, unit: DVec3) -> Option<f32> {
        self.field.within(unit.clamp(DVec3::ZERO, DVec3::ONE).as_vec3())
    }
}

/// How far a point is on the side of a plane that is cut away [m].
pub(crate) fn height(plane: &Plane, point: DVec3) -> f64 {
    plane.normal.as_dvec3().dot(point) - f64::from(plane.distance)
}

/// The scalar that a medium's extinction is in proportion to: the density, or a transfer function's absorption [m⁻¹].
pub(crate) fn strength(optics: &Optics, value: f32) -> f32 {
    match optics {
        Optics::Coefficients { .. } => value.max(0.0),
        Optics::Transfer(transfer) => transfer.sigma_a(value),
    }
}
