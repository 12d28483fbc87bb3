//! The simplest path tracer for media and surfaces that is right, on a page. [`crate::Tracer`] must agree with it.
//!
//! One majorant for all the world \[Woodcock65\], one colour channel a path, absorption by chance, no cells, no tree of
//! triangles, no search for lights that a path can find: slow, noisy, and easy to check by reading. It shares with the tracer the
//! lamps, the phase functions, the values of surfaces and the random numbers, each of which has tests of its own.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use tyndall_scene::description::{Coefficients, Optics};
use tyndall_scene::particles::Particle;
use tyndall_scene::{Field, Volume, World};

use crate::Random;
use crate::bsdf::cosine_direction;
use crate::bvh::Meeting;
use crate::light::Lights;
use crate::phase::Phase;
use crate::surface::{Spot, Surfaces};

/// A world, a majorant of its extinction, and a ball around its media.
pub struct Simple<'a> {
    world: &'a World,
    /// One for each volume.
    phases: Vec<Phase>,
    surfaces: Surfaces,
    lights: Lights,
    majorant: f64,
    center: DVec3,
    radius: f64,
}

impl<'a> Simple<'a> {
    /// Finds majorant and ball.
    pub fn new(world: &'a World) -> Self {
        let corners = world.volumes.iter().flat_map(|volume| {
            let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
            (0..8).map(move |i| volume.world_from_unit.transform_point3(corner(i)).as_dvec3())
        });
        let center = corners.clone().sum::<DVec3>() / corners.clone().count().max(1) as f64;
        let radius = corners.map(|corner| corner.distance(center)).fold(0.0, f64::max) * 1.001;
        // The second term is for media that glow but do not absorb: they too must collide.
        let majorant = world.volumes.iter().map(highest).sum::<f64>() + 1.0 / radius;
        let phases = world.volumes.iter().map(|volume| Phase::new(&volume.phase)).collect();
        let (surfaces, lights) = (Surfaces::new(world), Lights::new(world));
        Self { world, phases, surfaces, lights, majorant, center, radius }
    }

    /// An estimate of the radiance [W·sr⁻¹·m⁻²] that arrives at `origin` (metres) from the unit `direction`, of light scattered
    /// at most `depth` times.
    pub fn radiance(&self, origin: DVec3, direction: DVec3, depth: Option<u32>, rng: &mut Random) -> DVec3 {
        let channel = (3.0 * rng.uniform()) as usize;
        let (mut origin, mut direction, mut scatterings) = (origin, direction, 0);
        let (mut radiance, mut weight) = (0.0, 1.0);
        loop {
            let spot = self.nearest(origin, direction);
            let limit = spot.as_ref().map_or(f64::INFINITY, |spot| spot.distance);
            let Some(point) = self.collision(origin, direction, limit, rng) else {
                let Some(spot) = spot else {
                    radiance += weight * self.lights.behind(direction)[channel];
                    break;
                };
                radiance += weight * spot.emission[channel];
                scatterings += 1;
                if depth.is_some_and(|depth| scatterings > depth) {
                    break;
                }
                radiance += weight * self.reflected(&spot, channel, rng);
                let Some((towards, factor)) = scattered(&spot, channel, rng) else { break };
                // Absorption; mirrors and refraction may also make radiance larger.
                let survival = factor.min(1.0);
                if rng.uniform() >= survival {
                    break;
                }
                weight *= factor / survival;
                (origin, direction) = (spot.start(towards), towards);
                continue;
            };
            let here = self.coefficients(point);
            let sum =
                |of: fn(&Coefficients) -> Vec3| -> f64 { here.iter().map(|(c, _)| f64::from(of(c)[channel])).sum() };
            let (sigma_s, sigma_a, emission) = (sum(|c| c.sigma_s), sum(|c| c.sigma_a), sum(|c| c.emission));
            radiance += weight * emission / self.majorant;
            let event = rng.uniform() * self.majorant;
            origin = point;
            if event < sigma_a {
                break;
            } else if event < sigma_a + sigma_s {
                scatterings += 1;
                if depth.is_some_and(|depth| scatterings > depth) {
                    break;
                }
                for arrival in self.lights.lamps.iter().filter_map(|lamp| lamp.arrival(point)) {
                    let cos_theta = -direction.dot(arrival.travel);
                    let pdf =
                        |(c, p): &(Coefficients, &Phase)| f64::from(c.sigma_s[channel]) * p.pdf(cos_theta)[channel];
                    let scattered = here.iter().map(pdf).sum::<f64>() / sigma_s;
                    let share = self.transmittance(point, -arrival.travel, arrival.distance, channel, rng);
                    radiance += weight * scattered * share * arrival.irradiance[channel];
                }
                let mut choice = rng.uniform() * sigma_s;
                let chosen = here.iter().find(|(c, _)| {
                    choice -= f64::from(c.sigma_s[channel]);
                    choice < 0.0
                });
                // Rounding may leave none; then the last one scatters, if there is any.
                let Some((_, phase)) = chosen.or(here.last()) else { break };
                direction = phase.sample(channel, direction, rng);
            }
        }
        // One channel of three was followed.
        DVec3::AXES[channel] * (3.0 * radiance)
    }

    /// The light of lamps that a surface reflects.
    fn reflected(&self, spot: &Spot, channel: usize, rng: &mut Random) -> f64 {
        let arrivals = self.lights.lamps.iter().filter_map(|lamp| lamp.arrival(spot.point));
        let light = arrivals.map(|arrival| {
            let towards = -arrival.travel;
            let share = self.transmittance(spot.start(towards), towards, arrival.distance, channel, rng);
            spot.scattering(towards)[channel] * share * arrival.irradiance[channel]
        });
        light.sum()
    }

    /// The first surface on a ray, of all triangles [Moeller97].
    fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<Spot> {
        let mut first: Option<Meeting> = None;
        for (triangle, face) in self.surfaces.faces().iter().enumerate() {
            let [a, b, c] = face.triangle.0;
            let (u, v, from) = (b - a, c - a, origin - a);
            let (p, q) = (direction.cross(v), from.cross(u));
            let volume = u.dot(p);
            let [y, z] = [from.dot(p), direction.dot(q)].map(|part| part / volume);
            let (weights, distance) = ([1.0 - y - z, y, z], v.dot(q) / volume);
            let meeting = Meeting { triangle, distance, weights, front: volume > 0.0 };
            let nearer = distance > 0.0 && first.is_none_or(|first| distance < first.distance);
            if nearer && weights.iter().all(|&weight| weight >= 0.0) && self.surfaces.exists(&meeting) {
                first = Some(meeting);
            }
        }
        first.map(|meeting| self.surfaces.spot(&meeting, direction))
    }

    /// The share of light of a channel that passes over a distance: ratio tracking [Novak14], if there is no surface.
    fn transmittance(&self, from: DVec3, direction: DVec3, distance: f64, channel: usize, rng: &mut Random) -> f64 {
        if self.nearest(from, direction).is_some_and(|spot| spot.distance < distance) {
            return 0.0;
        }
        let (mut share, mut point, mut left) = (1.0, from, distance);
        while let Some(next) = self.collision(point, direction, left, rng) {
            let sigma_t: f64 = self.coefficients(next).iter().map(|(c, _)| f64::from(c.sigma_t()[channel])).sum();
            share *= 1.0 - sigma_t / self.majorant;
            left -= next.distance(point);
            point = next;
        }
        share
    }

    /// The next tentative collision within a distance, or `None` beyond all media.
    fn collision(&self, origin: DVec3, direction: DVec3, distance: f64, rng: &mut Random) -> Option<DVec3> {
        let middle = (self.center - origin).dot(direction);
        let miss = (origin + direction * middle).distance(self.center);
        let half = (self.radius * self.radius - miss * miss).max(0.0).sqrt();
        let t = (middle - half).max(0.0) + rng.exponential() / self.majorant;
        (t < distance.min(middle + half)).then(|| origin + direction * t)
    }

    /// What each medium does at a point.
    fn coefficients(&self, point: DVec3) -> Vec<(Coefficients, &Phase)> {
        let at = |(volume, phase): (&Volume, _)| {
            volume.coefficients(point.as_vec3()).map(|coefficients| (coefficients, phase))
        };
        self.world.volumes.iter().zip(&self.phases).filter_map(at).collect()
    }
}

/// A direction in which a path goes on from a surface, and what light from there counts: of mirrors and glass their own, else any
/// above the triangle, with the density cosθ/π.
fn scattered(spot: &Spot, channel: usize, rng: &mut Random) -> Option<(DVec3, f64)> {
    if spot.bsdf.is_specular() {
        return spot.sample(rng).map(|sample| (sample.towards, sample.weight[channel]));
    }
    let towards = cosine_direction(spot.geometric, rng);
    Some((towards, spot.scattering(towards)[channel] * PI / spot.geometric.dot(towards)))
}

/// The highest extinction of a medium in any channel [m⁻¹].
fn highest(volume: &Volume) -> f64 {
    let sigma_t = |value: f32| f64::from(volume.optics.at(value).sigma_t().max_element());
    match (&volume.optics, &volume.field) {
        (Optics::Transfer(transfer), _) => transfer.knots().into_iter().map(sigma_t).fold(0.0, f64::max),
        (_, Field::Homogeneous) => sigma_t(1.0),
        (_, Field::Exponential { .. }) => sigma_t(volume.field.value(Vec3::ZERO)),
        (_, Field::Grid(grid)) => {
            let [x, y, z] = grid.dims;
            let voxels = (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| grid.value(i, j, k))));
            sigma_t(voxels.fold(0.0, f32::max))
        }
        (_, Field::Mesh(mesh)) => {
            sigma_t((0..mesh.count()).flat_map(|cell| mesh.corner_values(cell)).fold(0.0, f32::max))
        }
        (_, Field::Sphere(_)) => sigma_t(1.0),
        (_, Field::Noise(noise)) => sigma_t(noise.range(Vec3::ZERO, Vec3::ONE)[1]),
        // As if all overlapped: enough for the few that a page of code can trace.
        (_, Field::Particles(particles)) => {
            let middle = |particle: &Particle| particle.density(particle.position.as_dvec3());
            sigma_t(1.0) * particles.list().iter().map(middle).sum::<f64>()
        }
        (_, Field::Strands(strands)) => {
            sigma_t(1.0) * (0..strands.count()).map(|index| strands.segment(index).density()).sum::<f64>()
        }
        (_, Field::Expression(expression)) => sigma_t(expression.highest),
    }
}
