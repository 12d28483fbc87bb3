//! What a point of the media emits, and scatters of light that comes straight from where it is made.

use glam::DVec3;

use crate::march::March;
use crate::medium::Local;
use crate::vertex::Vertex;
use crate::{Random, Tracer};

impl Tracer {
    /// The extinction at a point (metres), by channel [m⁻¹].
    pub fn extinction(&self, point: DVec3) -> DVec3 {
        self.local(point).map(|local| local.sigma_s + local.sigma_a).sum()
    }

    /// An estimate of what a point (metres) emits, and of what it scatters once, towards an eye that looks along the unit
    /// `direction` [W·sr⁻¹·m⁻³]; the integral of its mean times the transmittance to the eye is the radiance of depth 1,
    /// without what is behind and what is emitted and then scattered.
    ///
    /// The way to a lamp, and one to the environment or to a surface that shines, by each
    /// phase function, is ratio-tracked.
    pub fn source(&self, point: DVec3, direction: DVec3, rng: &mut Random) -> DVec3 {
        let mut march = March::default();
        let mut source: DVec3 = self.local(point).map(|local| local.emission).sum();
        let scatterers = self.media.scatterers(point);
        if scatterers.is_empty() {
            return source;
        }
        let vertex = Vertex::Media { point, direction, scatterers: &scatterers, weight: DVec3::ONE };
        for arrival in self.lights.lamps.iter().filter_map(|lamp| lamp.arrival(point)) {
            source += self.scattered(&arrival, &vertex, &mut march, rng);
        }
        if self.lights.environment == DVec3::ZERO && self.surfaces.lights.is_empty() {
            return source;
        }
        for scatterer in &scatterers {
            let phase = self.phase(scatterer);
            let mut light = |channel| {
                let sampled = phase.sample(channel, direction, rng);
                let spot = self.surfaces.nearest(point, sampled);
                let (light, distance) = match &spot {
                    None => (self.lights.environment, f64::INFINITY),
                    Some(spot) => (spot.emission, spot.distance),
                };
                light * self.media.transmittance(point, sampled, distance, &mut march, rng)
            };
            let arriving = if phase.is_grey() { light(0) } else { DVec3::new(light(0).x, light(1).y, light(2).z) };
            source += scatterer.sigma_s * arriving;
        }
        source
    }

    fn local(&self, point: DVec3) -> impl Iterator<Item = Local> {
        self.media.media.iter().filter_map(move |medium| Some(medium.at(medium.place(point)?)))
    }
}
