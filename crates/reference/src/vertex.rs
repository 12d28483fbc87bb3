//! Where a path scatters: in the media or at a surface, which light does not tell apart.

use glam::DVec3;

use crate::bsdf::Sample;
use crate::phase::Phase;
use crate::surface::Spot;
use crate::tracking::Scatterer;
use crate::{Random, Tracer};

/// A point at which a path scatters, and what there does so.
pub(crate) enum Vertex<'a> {
    /// Media.
    Media {
        /// [m]
        point: DVec3,
        /// That of the path before; a unit vector.
        direction: DVec3,
        scatterers: &'a [Scatterer],
        /// The path's, which decides among media and channels.
        weight: DVec3,
    },
    /// A surface.
    Surface(&'a Spot),
}

impl Vertex<'_> {
    /// Where a ray in a direction starts.
    pub fn start(&self, towards: DVec3) -> DVec3 {
        match self {
            Vertex::Media { point, .. } => *point,
            Vertex::Surface(spot) => spot.start(towards),
        }
    }

    /// Whether no light that is sought is scattered.
    pub fn is_specular(&self) -> bool {
        matches!(self, Vertex::Surface(spot) if spot.bsdf.is_specular())
    }
}

impl Tracer {
    /// The share of light from the unit direction `towards` that is scattered to the path, on a unit of irradiance across it
    /// [sr⁻¹, in media sr⁻¹·m⁻¹].
    pub(crate) fn scattering(&self, vertex: &Vertex, towards: DVec3) -> DVec3 {
        match vertex {
            Vertex::Media { direction, scatterers, .. } => {
                let cos_theta = direction.dot(towards);
                scatterers.iter().map(|part| part.sigma_s * self.phase(part).pdf(cos_theta)).sum()
            }
            Vertex::Surface(spot) => spot.scattering(towards),
        }
    }

    /// The density with which [`Tracer::sample`] chooses a direction [sr⁻¹].
    pub(crate) fn chance(&self, vertex: &Vertex, towards: DVec3) -> f64 {
        let (direction, scatterers, weight) = match vertex {
            Vertex::Surface(spot) => return spot.chance(towards),
            Vertex::Media { direction, scatterers, weight, .. } => (direction, scatterers, weight),
        };
        let cos_theta = direction.dot(towards);
        if let Some(only) = self.alone(scatterers) {
            return self.phase(only).pdf(cos_theta).x;
        }
        let (mut density, mut total) = (0.0, 0.0);
        for part in *scatterers {
            density += weight.dot(part.sigma_s * self.phase(part).pdf(cos_theta));
            total += weight.dot(part.sigma_s);
        }
        density / total
    }

    /// A direction for the path to go on in, with [`Tracer::scattering`] over [`Tracer::chance`]; `None` where it ends.
    pub(crate) fn sample(&self, vertex: &Vertex, rng: &mut Random) -> Option<Sample> {
        let (direction, scatterers, weight) = match vertex {
            Vertex::Surface(spot) => return spot.sample(rng),
            Vertex::Media { direction, scatterers, weight, .. } => (*direction, *scatterers, *weight),
        };
        let (medium, channel) = self.choose(scatterers, weight, rng);
        let towards = self.media.media[medium].phase.sample(channel, direction, rng);
        let chance = self.chance(vertex, towards);
        let weight = match self.alone(scatterers) {
            Some(only) => only.sigma_s,
            None => self.scattering(vertex, towards) / chance,
        };
        Some(Sample { towards, weight, density: Some(chance) })
    }

    pub(crate) fn phase(&self, scatterer: &Scatterer) -> &Phase {
        &self.media.media[scatterer.medium].phase
    }

    /// The medium that scatters, where it is the only one and scatters all channels alike: the usual case.
    fn alone<'s>(&self, scatterers: &'s [Scatterer]) -> Option<&'s Scatterer> {
        match scatterers {
            [only] if self.phase(only).is_grey() => Some(only),
            _ => None,
        }
    }

    /// The medium and the channel that scatter, chosen with a probability in proportion to their part in the weight: what
    /// a path then weighs, summed over channels, does not depend on the angle.
    fn choose(&self, scatterers: &[Scatterer], weight: DVec3, rng: &mut Random) -> (usize, usize) {
        if let Some(only) = self.alone(scatterers) {
            return (only.medium, 0);
        }
        let mut chosen = (0, 0);
        let parts = scatterers.iter().map(|part| (part.medium, weight * part.sigma_s));
        let mut rest = rng.uniform() * parts.clone().map(|(_, part)| part.element_sum()).sum::<f64>();
        for (medium, part) in parts {
            for channel in (0..3).filter(|&channel| part[channel] > 0.0) {
                chosen = (medium, channel);
                rest -= part[channel];
                if rest < 0.0 {
                    return chosen;
                }
            }
        }
        chosen
    }
}
