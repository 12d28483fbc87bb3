//! Particles as a participating medium: soft balls. `docs/particles.md` derives their profile.
//!
//! A particle is a ball of radius r. Through its centre its optical depth is τ₀ = −ln(1 − α), where α is its opacity; along a
//! ray that passes the centre at a distance b it is τ₀·(1 − b²/r²)^(5/2), which is what a billboard that faces the ray shows,
//! and in space its extinction is the one field that has these line integrals, 15/(16r)·τ₀·(1 − ρ²/r²)² at a distance ρ. Where
//! balls overlap, extinctions add.

mod columns;
mod csv;
mod emission;
mod file;
mod hierarchy;
mod npz;
mod ply;
#[cfg(test)]
mod tests;

use std::sync::OnceLock;

use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

pub use emission::Emission;
pub(crate) use file::read_particles;
pub use hierarchy::Hierarchy;

use crate::description::Transform;
use crate::volume::{Budget, VolumeError};

/// The largest optical depth of a body through its middle: an opacity of 1 would be infinite. e⁻¹⁰ = 0.005 % passes.
pub const MAX_DEPTH: f32 = 10.0;

/// The optical depth of an opacity from 0 to 1, at most [`MAX_DEPTH`].
pub fn optical_depth(opacity: f32) -> f32 {
    (-(-opacity).ln_1p()).clamp(0.0, MAX_DEPTH)
}

/// The smallest and the largest radius of a body [m], and the farthest it may be from the origin on an axis [m]: numbers
/// whose products single precision holds.
pub const RADII: [f32; 2] = [1e-7, 1e6];
/// See [`RADII`].
pub const FARTHEST: f32 = 1e9;

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// The centre [m].
    pub position: Vec3,
    /// The radius [m].
    pub radius: f32,
    /// The share of σ_s that is scattered, 0 to 1, linear Rec. 709; the rest is absorbed.
    pub color: Vec3,
    /// The optical depth through the centre τ₀ per unit of the medium's σ_t; at most [`MAX_DEPTH`].
    pub depth: f32,
}

impl Particle {
    /// (1 − b²/r²)^(5/2), the share of `depth` along a ray that passes the centre at a distance of `impact` radii.
    pub fn profile(impact: f32) -> f32 {
        let q = (1.0 - impact * impact).max(0.0);
        q * q * q.sqrt()
    }

    /// The extinction at a point [m⁻¹ per unit of the medium's σ_t].
    pub fn density(&self, point: DVec3) -> f64 {
        let radius = f64::from(self.radius);
        let q = 1.0 - point.distance_squared(self.position.as_dvec3()) / (radius * radius);
        15.0 / 16.0 * f64::from(self.depth) / radius * q.max(0.0) * q.max(0.0)
    }

    /// Whether numbers are in their ranges.
    fn check(&self, index: usize) -> Result<(), VolumeError> {
        let wrong = |what: &str, value: String, accepted: &str| {
            Err(VolumeError::corrupt(format!("{what} of particle {index} is {value}; accepted: {accepted}")))
        };
        let Self { position, radius, color, depth } = *self;
        // No comparison holds of what is no number.
        if !(position.abs().max_element() <= FARTHEST && position.is_finite()) {
            return wrong("the position", format!("{:?}", position.to_array()), "at most 1e9 m from the origin");
        }
        if !(RADII[0]..=RADII[1]).contains(&radius) {
            return wrong("the radius", format!("{radius:?}"), "1e-7 to 1e6 m");
        }
        if !(color.is_finite() && color.min_element() >= 0.0 && color.max_element() <= 1.0) {
            return wrong("the colour", format!("{:?}", color.to_array()), "0 to 1, or whole numbers of 8 or 16 bits");
        }
        if !(0.0..=MAX_DEPTH).contains(&depth) {
            return wrong("the optical depth", format!("{depth:?}"), "0 to 10");
        }
        Ok(())
    }
}

/// What bodies are at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Here {
    /// The sum of their extinctions [m⁻¹ per unit of the medium's σ_t].
    pub density: f64,
    /// The mean of their colours, weighted by extinction; 1 where there are none.
    pub color: DVec3,
}

impl Here {
    /// The sum over the bodies that are there, each told by its density and colour.
    pub(crate) fn sum(bodies: impl FnOnce(&mut dyn FnMut(f64, Vec3))) -> Self {
        let mut here = Self::default();
        bodies(&mut |density, color| {
            here.density += density;
            here.color += density * color.as_dvec3();
        });
        here.color = if here.density > 0.0 { here.color / here.density } else { DVec3::ONE };
        here
    }
}

/// Particles in the world.
#[derive(Clone, Debug, Default)]
pub struct Particles {
    list: Vec<Particle>,
    bounds: Option<[Vec3; 2]>,
    hierarchy: OnceLock<Hierarchy>,
}

impl Particles {
    /// Bytes that a particle takes, with its part of the hierarchy.
    pub const BYTES: u64 = size_of::<Particle>() as u64 + Hierarchy::BYTES;

    /// Particles in the world [m].
    ///
    /// # Errors
    /// [`VolumeError::Corrupt`] for a particle that is not finite, has no radius, or a colour or depth out of range.
    pub fn new(list: Vec<Particle>) -> Result<Self, VolumeError> {
        list.iter().enumerate().try_for_each(|(index, particle)| particle.check(index))?;
        Ok(Self::of(list))
    }

    /// Particles that are in their ranges.
    fn of(list: Vec<Particle>) -> Self {
        let corners = list.par_iter().map(|p| [p.position - p.radius, p.position + p.radius]);
        let bounds = corners.reduce_with(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        Self { list, bounds, hierarchy: OnceLock::new() }
    }

    /// Moved into the world: positions by the transform, radii by its scale, opacities as they are.
    ///
    /// # Errors
    /// As for [`new`](Self::new), where that leaves the range of numbers.
    pub fn moved(mut self, transform: &Transform) -> Result<Self, VolumeError> {
        let matrix = transform.matrix();
        self.list.par_iter_mut().for_each(|particle| {
            particle.position = matrix.transform_point3(particle.position);
            particle.radius *= transform.scale.x;
        });
        Self::new(self.list)
    }

    /// Every particle.
    pub fn list(&self) -> &[Particle] {
        &self.list
    }

    /// The particles as shaders read them, two vectors each: (position [m], radius [m]), (colour, optical depth).
    pub fn packed(&self) -> Vec<[Vec4; 2]> {
        self.list.par_iter().map(|p| [p.position.extend(p.radius), p.color.extend(p.depth)]).collect()
    }

    /// The lowest and highest corner of the box around all particles [m]; `None` where there are none.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        self.bounds
    }

    /// The hierarchy over the particles, made when it is first asked for.
    pub fn hierarchy(&self) -> &Hierarchy {
        self.hierarchy.get_or_init(|| {
            let corners = |p: &Particle| outward(p.position - p.radius, p.position + p.radius);
            Hierarchy::new(&self.list.par_iter().map(corners).collect::<Vec<_>>())
        })
    }

    /// What the particles are at a point [m].
    pub fn at(&self, point: DVec3) -> Here {
        Here::sum(|add| {
            self.hierarchy().at(point, |body| {
                let particle = &self.list[body];
                add(particle.density(point), particle.color);
            });
        })
    }
}

/// A box that contains what its corners were rounded from.
pub(crate) fn outward(low: Vec3, high: Vec3) -> [Vec3; 2] {
    [low.map(f32::next_down), high.map(f32::next_up)]
}

/// Room for bodies within a budget.
pub(crate) fn reserve<T>(what: &'static str, count: u64, bytes: u64, budget: Budget) -> Result<Vec<T>, VolumeError> {
    let needed = count.saturating_mul(bytes);
    if needed > budget.0 || count > u64::from(u32::MAX / 2) {
        return Err(VolumeError::TooMany { what, count, bytes: needed, budget: budget.0 });
    }
    let mut list = Vec::new();
    list.try_reserve_exact(count as usize).map_err(|_| VolumeError::OutOfMemory { bytes: needed })?;
    Ok(list)
}
