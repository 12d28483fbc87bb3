//! Light that comes straight from where it is made to where a path scatters.

use glam::DVec3;

use crate::light::{Arrival, Lamp};
use crate::march::March;
use crate::vertex::Vertex;
use crate::{Random, Tracer};

impl Tracer {
    /// What is scattered to the path of the light of all lamps, but for what [`Tracer::near`] finds, and of one direction
    /// sought in the environment map and one point sought on surfaces that shine, of these the share that paths leave to the search
    /// [W·sr⁻¹·m⁻², in media W·sr⁻¹·m⁻³].
    pub(crate) fn direct(&self, vertex: &Vertex, march: &mut March, rng: &mut Random) -> DVec3 {
        if vertex.is_specular() {
            return DVec3::ZERO;
        }
        let point = match vertex {
            Vertex::Media { point, .. } => *point,
            Vertex::Surface(spot) => spot.point,
        };
        let mut light = DVec3::ZERO;
        for (lamp, ball) in self.lights.lamps.iter().zip(&self.balls) {
            let Some(mut arrival) = lamp.arrival(point) else { continue };
            if let Vertex::Media { .. } = vertex {
                arrival.irradiance *= 1.0 - ball.share(arrival.distance);
            }
            light += self.scattered(&arrival, vertex, march, rng);
        }
        let sought = [self.from_sky(vertex, rng), self.from_surfaces(vertex, point, rng)];
        for arrival in sought.into_iter().flatten() {
            light += self.scattered(&arrival, vertex, march, rng);
        }
        light
    }

    /// The environment map's light from a direction sought in it, over the sum of both densities [Veach95].
    fn from_sky(&self, vertex: &Vertex, rng: &mut Random) -> Option<Arrival> {
        let sky = self.lights.sky.as_ref()?;
        let (towards, density) = sky.sample(rng)?;
        let irradiance = sky.radiance(towards) / (density + self.chance(vertex, towards));
        Some(Arrival { travel: -towards, distance: f64::INFINITY, irradiance })
    }

    /// The light of a point sought on surfaces that shine, over the sum of both densities [Veach95].
    fn from_surfaces(&self, vertex: &Vertex, point: DVec3, rng: &mut Random) -> Option<Arrival> {
        let lights = &self.surfaces.lights;
        let light = lights.sample(|face| *self.surfaces.face(face), rng)?;
        let offset = light.point - point;
        let distance = offset.length();
        let towards = offset.try_normalize()?;
        let cosine = -light.normal.dot(towards);
        let emission = self.surfaces.emission(light.face, light.weights, cosine > 0.0);
        if emission == DVec3::ZERO || cosine == 0.0 {
            return None;
        }
        let density = lights.chance(light.face, distance, cosine.abs());
        let irradiance = emission / (density + self.chance(vertex, towards));
        Some(Arrival { travel: -towards, distance, irradiance })
    }

    /// Light on its way to a vertex that is scattered to the path, as far as it arrives.
    pub(crate) fn scattered(&self, arrival: &Arrival, vertex: &Vertex, march: &mut March, rng: &mut Random) -> DVec3 {
        let towards = -arrival.travel;
        let light = self.scattering(vertex, towards) * arrival.irradiance;
        if light == DVec3::ZERO {
            return DVec3::ZERO;
        }
        light * self.share(vertex.start(towards), towards, arrival.distance, march, rng)
    }

    /// What a flight from `origin` scatters of lamps' light while near them and within `limit` [m]: the share that collisions
    /// leave to flights [W·sr⁻¹·m⁻²].
    pub(crate) fn near(
        &self,
        origin: DVec3,
        direction: DVec3,
        limit: f64,
        march: &mut March,
        rng: &mut Random,
    ) -> DVec3 {
        let mut light = DVec3::ZERO;
        for (lamp, ball) in self.lights.lamps.iter().zip(&self.balls) {
            let Lamp::Bulb { position, .. } = lamp else { continue };
            let Some((distance, density)) = ball.sample(*position, origin, direction, rng) else { continue };
            if distance >= limit {
                continue;
            }
            let point = origin + direction * distance;
            let scatterers = self.media.scatterers(point);
            let Some(arrival) = lamp.arrival(point).filter(|_| !scatterers.is_empty()) else { continue };
            let way = self.media.transmittance(origin, direction, distance, march, rng);
            let vertex = Vertex::Media { point, direction, scatterers: &scatterers, weight: DVec3::ONE };
            let scattered = self.scattered(&arrival, &vertex, march, rng);
            light += way * scattered * (ball.share(arrival.distance) / density);
        }
        light
    }
}
