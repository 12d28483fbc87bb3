//! The estimator of one path from the eye: emission, single and multiple scattering, all without bias.

use glam::DVec3;
use tyndall_scene::World;

use crate::light::Lights;
use crate::march::March;
use crate::medium::Medium;
use crate::near::Ball;
use crate::surface::{Spot, Surfaces};
use crate::tracking::{End, Flight, Media};
use crate::vertex::Vertex;
use crate::{Random, ReferenceError};

/// A world made ready for tracing.
pub struct Tracer {
    pub(crate) media: Media,
    pub(crate) surfaces: Surfaces,
    pub(crate) lights: Lights,
    /// One for each lamp.
    pub(crate) balls: Vec<Ball>,
    caustics: bool,
}

/// Where a path goes.
struct Way {
    origin: DVec3,
    direction: DVec3,
    /// The density with which the last scattering chose the direction [sr⁻¹]; camera, mirrors and glass have no choice.
    density: Option<f64>,
    /// How often it has been scattered into more than directions of their own.
    diffuse: u32,
}

impl Tracer {
    /// Prepares a world: bounds its densities, cell by cell, and its triangles, box by box.
    ///
    /// # Errors
    /// [`ReferenceError::Unbounded`] where the extinction of a medium overflows, [`ReferenceError::Unphysical`] where a
    /// transfer function has more to it than colour and opacity.
    pub fn new(world: &World) -> Result<Self, ReferenceError> {
        let media = world.volumes.iter().map(Medium::new).collect::<Result<Vec<_>, _>>()?;
        let scatters = media.iter().any(Medium::scatters);
        let glows = media.iter().any(Medium::glows);
        let lights = Lights::new(world);
        let balls = lights.lamps.iter().map(|lamp| Ball::new(lamp, &media)).collect();
        let bodies = (0..media.len()).filter(|&index| media[index].bodies.is_some()).collect();
        let surfaces = Surfaces::new(world);
        Ok(Self { media: Media { media, bodies, scatters, glows }, surfaces, lights, balls, caustics: true })
    }

    /// The same without caustics, as [`Options::caustics`](crate::Options::caustics) defines them.
    pub fn without_caustics(self) -> Self {
        Self { caustics: false, ..self }
    }

    /// An estimate of the radiance that arrives at `origin` (metres) from the unit `direction` [W·sr⁻¹·m⁻²]; its mean is the
    /// radiance of light scattered at most `depth` times (`None`: any number of times), by surfaces and media alike.
    ///
    /// Depth 0 is emission, absorption and what is behind; 1 is direct light and single scattering. Light of lamps is
    /// sought wherever a path scatters, that of the constant environment is found where it escapes, and that of the
    /// environment map and of surfaces both ways, weighted by the balance heuristic [Veach95].
    pub fn radiance(&self, origin: DVec3, direction: DVec3, depth: Option<u32>, rng: &mut Random) -> DVec3 {
        let mut way = Way { origin, direction, density: None, diffuse: 0 };
        let mut flight = Flight::new();
        let mut shadow = March::default();
        for scatterings in 0u32.. {
            let last = depth.is_some_and(|depth| scatterings >= depth);
            let spot = self.surfaces.nearest(way.origin, way.direction);
            let limit = spot.as_ref().map_or(f64::INFINITY, |spot| spot.distance);
            let end = if self.media.scatters && !last {
                let light = self.near(way.origin, way.direction, limit, &mut shadow, rng);
                flight.radiance += flight.weight * light;
                self.media.fly(way.origin, way.direction, limit, true, &mut flight, rng)
            } else {
                let goes_on = spot.is_some() && !last;
                let needed = goes_on || self.found(&way, spot.as_ref()) != DVec3::ZERO;
                self.pass(&way, limit, needed, &mut flight, rng);
                End::Passed
            };
            let vertex = match end {
                End::Lost => break,
                End::Scattered(distance) => Vertex::Media {
                    point: way.origin + way.direction * distance,
                    direction: way.direction,
                    scatterers: &flight.scatterers,
                    weight: flight.weight,
                },
                End::Passed => {
                    flight.radiance += flight.weight * self.found(&way, spot.as_ref());
                    match &spot {
                        Some(spot) if !last => Vertex::Surface(spot),
                        _ => break,
                    }
                }
            };
            let light = self.direct(&vertex, &mut shadow, rng);
            let sample = self.sample(&vertex, rng);
            let origin = sample.map(|sample| vertex.start(sample.towards));
            flight.radiance += flight.weight * light;
            let (Some(sample), Some(origin)) = (sample, origin) else { break };
            let diffuse = way.diffuse + u32::from(sample.density.is_some());
            way = Way { origin, direction: sample.towards, density: sample.density, diffuse };
            flight.weight *= sample.weight;
            if !flight.survives(rng) {
                break;
            }
        }
        flight.radiance
    }

    /// An estimate of the share of light that passes from `origin` over `distance` (metres) in the unit `direction`; 0 where
    /// there is a surface on the way.
    pub fn transmittance(&self, origin: DVec3, direction: DVec3, distance: f64, rng: &mut Random) -> DVec3 {
        self.share(origin, direction, distance, &mut March::default(), rng)
    }

    /// As [`Tracer::transmittance`].
    pub(crate) fn share(
        &self,
        origin: DVec3,
        direction: DVec3,
        distance: f64,
        march: &mut March,
        rng: &mut Random,
    ) -> DVec3 {
        if self.surfaces.block(origin, direction, distance) {
            return DVec3::ZERO;
        }
        self.media.transmittance(origin, direction, distance, march, rng)
    }

    /// A flight that does not scatter: what glows on the way, and, where it is needed, what is left at its end.
    fn pass(&self, way: &Way, limit: f64, needed: bool, flight: &mut Flight, rng: &mut Random) {
        let weight = flight.weight;
        if self.media.glows {
            self.media.fly(way.origin, way.direction, limit, false, flight, rng);
        }
        let mut march = March::default();
        flight.weight = match needed {
            true => weight * self.media.transmittance(way.origin, way.direction, limit, &mut march, rng),
            false => weight,
        };
    }

    /// What a path finds where it ends, at a surface or behind all: its light, or the share that the search for it leaves to
    /// paths that choose their direction [W·sr⁻¹·m⁻²].
    fn found(&self, way: &Way, spot: Option<&Spot>) -> DVec3 {
        if way.density.is_none() && way.diffuse == 1 && !self.caustics {
            return DVec3::ZERO;
        }
        // [Veach95]: p/(p + q) of what is found with the density p, and sought with q.
        let share = |sought: f64| way.density.map_or(1.0, |density| density / (density + sought));
        match spot {
            Some(spot) if spot.emission != DVec3::ZERO => {
                let cosine = spot.geometric.dot(spot.view);
                spot.emission * share(self.surfaces.lights.chance(spot.face, spot.distance, cosine))
            }
            Some(_) => DVec3::ZERO,
            None => {
                let sky = self.lights.sky.as_ref();
                let sky = sky.map(|sky| sky.radiance(way.direction) * share(sky.pdf(way.direction)));
                self.lights.environment + sky.unwrap_or_default()
            }
        }
    }
}
