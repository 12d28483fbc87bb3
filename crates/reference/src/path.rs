//! The estimator of one path from the eye: emission, single and multiple scattering, all without bias.

use glam::DVec3;
use tyndall_scene::World;

use crate::light::{Arrival, Lamp, Lights};
use crate::march::March;
use crate::medium::Medium;
use crate::near::Ball;
use crate::phase::Phase;
use crate::tracking::{End, Flight, Media, Scatterer};
use crate::{Random, ReferenceError};

/// A world made ready for tracing.
pub struct Tracer {
    pub(crate) media: Media,
    pub(crate) lights: Lights,
    /// One for each lamp.
    balls: Vec<Ball>,
}

impl Tracer {
    /// Prepares a world: bounds its densities, cell by cell.
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
        Ok(Self { media: Media { media, bodies, scatters, glows }, lights, balls })
    }

    /// An estimate of the radiance that arrives at `origin` (metres) from the unit `direction` [W·sr⁻¹·m⁻²]; its mean is the
    /// radiance of light scattered at most `depth` times (`None`: any number of times).
    ///
    /// Depth 0 is emission, absorption and what is behind; 1 is single scattering. Light of lamps is sought at every
    /// scattering, that of the constant environment is found where a path escapes, and that of the environment map both ways,
    /// weighted by the balance heuristic [Veach95].
    pub fn radiance(&self, origin: DVec3, direction: DVec3, depth: Option<u32>, rng: &mut Random) -> DVec3 {
        let (mut origin, mut direction) = (origin, direction);
        let mut flight = Flight::new();
        let mut shadow = March::default();
        // The density with which the last scattering chose the direction [sr⁻¹]; the camera has no choice.
        let mut density = None;
        for scatterings in 0u32.. {
            if !self.media.scatters || depth.is_some_and(|depth| scatterings >= depth) {
                self.last(origin, direction, density, &mut flight, &mut shadow, rng);
                break;
            }
            for (lamp, &ball) in self.lights.lamps.iter().zip(&self.balls) {
                let light = self.near(lamp, ball, origin, direction, &mut shadow, rng);
                flight.radiance += flight.weight * light;
            }
            let distance = match self.media.fly(origin, direction, true, &mut flight, rng) {
                End::Scattered(distance) => distance,
                End::Escaped => {
                    flight.radiance += flight.weight * self.behind(direction, density);
                    break;
                }
                End::Lost => break,
            };
            origin += direction * distance;
            for (lamp, ball) in self.lights.lamps.iter().zip(&self.balls) {
                let Some(arrival) = lamp.arrival(origin) else { continue };
                let light = self.scattered(&arrival, origin, direction, &flight.scatterers, &mut shadow, rng);
                flight.radiance += flight.weight * light * (1.0 - ball.share(arrival.distance));
            }
            flight.radiance += flight.weight * self.sky(origin, direction, &flight, &mut shadow, rng);
            let (next, channel) = self.choose(&flight, rng);
            let sampled = self.media.media[next].phase.sample(channel, direction, rng);
            let cos_theta = direction.dot(sampled);
            let chance = self.chance(&flight, cos_theta);
            flight.weight *= self.mixture(&flight, cos_theta, chance);
            (direction, density) = (sampled, Some(chance));
            if !flight.survives(rng) {
                break;
            }
        }
        flight.radiance
    }

    /// An estimate of the share of light that passes from `origin` over `distance` (metres) in the unit `direction`.
    pub fn transmittance(&self, origin: DVec3, direction: DVec3, distance: f64, rng: &mut Random) -> DVec3 {
        self.media.transmittance(origin, direction, distance, &mut March::default(), rng)
    }

    /// The last flight of a path, which scatters no more: what glows on the way, and the environment behind it all.
    fn last(
        &self,
        origin: DVec3,
        direction: DVec3,
        density: Option<f64>,
        flight: &mut Flight,
        march: &mut March,
        rng: &mut Random,
    ) {
        let behind = self.behind(direction, density);
        if behind != DVec3::ZERO {
            let share = self.media.transmittance(origin, direction, f64::INFINITY, march, rng);
            flight.radiance += flight.weight * share * behind;
        }
        if self.media.glows {
            self.media.fly(origin, direction, false, flight, rng);
        }
    }

    /// What a path finds where it escapes, having chosen its direction with this density [sr⁻¹]: the share of the map that
    /// the search for it leaves to paths, and the constant environment [W·sr⁻¹·m⁻²].
    fn behind(&self, direction: DVec3, density: Option<f64>) -> DVec3 {
        let Some(sky) = &self.lights.sky else { return self.lights.environment };
        let share = density.map_or(1.0, |density| density / (density + sky.pdf(direction)));
        self.lights.environment + sky.radiance(direction) * share
    }

    /// The environment map's light that is scattered at `point` against `direction`: of one direction sought in the map, the
    /// share that escaping paths leave to it, per unit of weight [W·sr⁻¹·m⁻³].
    fn sky(&self, point: DVec3, direction: DVec3, flight: &Flight, march: &mut March, rng: &mut Random) -> DVec3 {
        let Some(sky) = &self.lights.sky else { return DVec3::ZERO };
        let Some((towards, density)) = sky.sample(rng) else { return DVec3::ZERO };
        // [Veach95]: p/(p + q) of the estimate, which is divided by p.
        let share = 1.0 / (density + self.chance(flight, direction.dot(towards)));
        let arrival = Arrival { travel: -towards, distance: f64::INFINITY, irradiance: sky.radiance(towards) * share };
        self.scattered(&arrival, point, direction, &flight.scatterers, march, rng)
    }

    /// Light that arrives at `point` and is scattered against `direction` (that of the path), per unit of weight
    /// [W·sr⁻¹·m⁻³].
    pub(crate) fn scattered(
        &self,
        arrival: &Arrival,
        point: DVec3,
        direction: DVec3,
        scatterers: &[Scatterer],
        march: &mut March,
        rng: &mut Random,
    ) -> DVec3 {
        let cos_theta = -direction.dot(arrival.travel);
        let scattering: DVec3 = scatterers.iter().map(|s| s.sigma_s * self.phase(s).pdf(cos_theta)).sum();
        let share = self.media.transmittance(point, -arrival.travel, arrival.distance, march, rng);
        scattering * share * arrival.irradiance
    }

    /// What a flight from `origin` scatters of a lamp's light while near it: the share that collisions leave to flights
    /// [W·sr⁻¹·m⁻²].
    fn near(
        &self,
        lamp: &Lamp,
        ball: Ball,
        origin: DVec3,
        direction: DVec3,
        march: &mut March,
        rng: &mut Random,
    ) -> DVec3 {
        let Lamp::Bulb { position, .. } = lamp else { return DVec3::ZERO };
        let Some((distance, density)) = ball.sample(*position, origin, direction, rng) else { return DVec3::ZERO };
        let point = origin + direction * distance;
        let scatterers = self.media.scatterers(point);
        let Some(arrival) = lamp.arrival(point).filter(|_| !scatterers.is_empty()) else { return DVec3::ZERO };
        let way = self.media.transmittance(origin, direction, distance, march, rng);
        let light = self.scattered(&arrival, point, direction, &scatterers, march, rng);
        way * light * (ball.share(arrival.distance) / density)
    }

    pub(crate) fn phase(&self, scatterer: &Scatterer) -> &Phase {
        &self.media.media[scatterer.medium].phase
    }

    /// Σ σ_s·p over the media, divided by the density with which [`Tracer::choose`] and sampling give that angle, its
    /// [`chance`](Tracer::chance) [m⁻¹].
    fn mixture(&self, flight: &Flight, cos_theta: f64, chance: f64) -> DVec3 {
        if let Some(only) = self.alone(flight) {
            return only.sigma_s;
        }
        let scattered = |part: &Scatterer| part.sigma_s * self.phase(part).pdf(cos_theta);
        flight.scatterers.iter().map(scattered).sum::<DVec3>() / chance
    }

    /// The density with which [`Tracer::choose`] and sampling give a direction at that angle [sr⁻¹].
    fn chance(&self, flight: &Flight, cos_theta: f64) -> f64 {
        if let Some(only) = self.alone(flight) {
            return self.phase(only).pdf(cos_theta).x;
        }
        let (mut density, mut total) = (0.0, 0.0);
        for part in &flight.scatterers {
            density += flight.weight.dot(part.sigma_s * self.phase(part).pdf(cos_theta));
            total += flight.weight.dot(part.sigma_s);
        }
        density / total
    }

    /// The medium that scatters, where it is the only one and scatters all channels alike: the usual case.
    fn alone<'f>(&self, flight: &'f Flight) -> Option<&'f Scatterer> {
        match &flight.scatterers[..] {
            [only] if self.phase(only).is_grey() => Some(only),
            _ => None,
        }
    }

    /// The medium and the channel that scatter, chosen with a probability in proportion to their part in the weight: what
    /// a path then weighs, summed over channels, does not depend on the angle.
    fn choose(&self, flight: &Flight, rng: &mut Random) -> (usize, usize) {
        if let Some(only) = self.alone(flight) {
            return (only.medium, 0);
        }
        let mut chosen = (0, 0);
        let parts = flight.scatterers.iter().map(|part| (part.medium, flight.weight * part.sigma_s));
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
