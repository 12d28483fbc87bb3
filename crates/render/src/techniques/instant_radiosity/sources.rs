//! Where particles start: every light in proportion to its power.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use tyndall_scene::description::Light;
use tyndall_scene::{EnvironmentMap, World};

use super::geometry::{Emitter, Geometry, Point};
use super::vpl::Vpl;

/// The lights of a world, as particles leave them.
#[derive(Debug)]
pub struct Sources {
    list: Vec<Source>,
    /// Running sum of the shares of the whole power, without the leading 0.
    sums: Vec<f64>,
    center: DVec3,
    radius: f64,
}

#[derive(Debug)]
enum Source {
    Triangle(Emitter),
    /// A light at a point or from one direction, as its number among [`Sources::lamps`].
    Lamp(Light),
    Constant(DVec3),
    Sky(Sky),
}

/// A particle that has left a light.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// The light itself as a virtual light, where particles choose its place; `None` for lamps, which are one as they are.
    pub vpl: Option<Vpl>,
    /// Where the particle sets out [m].
    pub origin: DVec3,
    /// The unit vector along which it travels.
    pub direction: DVec3,
    /// What the particle carries, over the probability of having chosen it: the mean over particles is the power of all lights
    /// [W].
    pub flux: DVec3,
}

/// An environment map, by its texels.
#[derive(Debug)]
struct Sky {
    map: Arc<EnvironmentMap>,
    /// Running sum of the shares of texels, without the leading 0.
    sums: Vec<f64>,
}

impl Sources {
    /// The lights of a world whose surfaces are `geometry`.
    pub fn new(world: &World, geometry: &Geometry) -> Self {
        let (center, radius) = geometry.sphere();
        let disc = PI * radius * radius;
        let mean = |v: DVec3| v.element_sum() / 3.0;
        let mut list = Vec::new();
        let mut powers = Vec::new();
        for emitter in geometry.emitters() {
            let sides = if emitter.double_sided { 2.0 } else { 1.0 };
            powers.push(PI * emitter.area * sides * mean(emitter.radiance));
            list.push(Source::Triangle(emitter));
        }
        for light in world.lights.values() {
            let power = match light {
                Light::Directional { irradiance, .. } => disc * mean(irradiance.as_dvec3()),
                Light::Point { intensity, .. } => 4.0 * PI * mean(intensity.as_dvec3()),
                Light::Spot { intensity, inner_angle, outer_angle, .. } => {
                    let [inner, outer] = [inner_angle, outer_angle].map(|a| f64::from(*a).to_radians().cos());
                    // ∫ of the ramp's square is a third of its width.
                    TAU * (1.0 - inner + (inner - outer) / 3.0) * mean(intensity.as_dvec3())
                }
                Light::Constant { radiance } => {
                    powers.push(4.0 * PI * disc * mean(radiance.as_dvec3()));
                    list.push(Source::Constant(radiance.as_dvec3()));
                    continue;
                }
                // The world holds the map.
                Light::Environment { .. } => continue,
            };
            powers.push(power);
            list.push(Source::Lamp(light.clone()));
        }
        if let Some(map) = &world.environment {
            let (sky, radiance) = Sky::new(map.clone());
            powers.push(disc * radiance);
            list.push(Source::Sky(sky));
        }
        Self { list, sums: shares(&powers), center, radius }
    }

    /// The area of all surfaces that emit, of each side that does [m²].
    pub fn emitting_area(&self) -> f64 {
        let area = |source: &Source| match source {
            Source::Triangle(emitter) => emitter.area * if emitter.double_sided { 2.0 } else { 1.0 },
            _ => 0.0,
        };
        self.list.iter().map(area).sum()
    }

    /// The lamps as virtual lights: with no place to choose, they are one each, in full.
    pub fn lamps(&self) -> Vec<Vpl> {
        let lamp = |source: &Source| match source {
            Source::Lamp(light) => Some(Vpl::lamp(light)),
            _ => None,
        };
        self.list.iter().filter_map(lamp).collect()
    }

    /// A particle. `u` chooses the light and the place on it (or the direction of an environment), `v` the direction (or the
    /// place in the disc of the scene).
    pub fn start(&self, u: [f64; 2], v: [f64; 2], geometry: &Geometry) -> Option<Start> {
        let (k, x) = choose(&self.sums, u[0])?;
        let probability = self.sums[k] - if k == 0 { 0.0 } else { self.sums[k - 1] };
        let place = [x, u[1]];
        let start = match &self.list[k] {
            Source::Triangle(emitter) => emitted(emitter, place, v, probability, geometry)?,
            Source::Lamp(light) => self.shone(light, v, probability, geometry),
            Source::Constant(radiance) => {
                let z = 1.0 - 2.0 * x;
                let (sin, cos) = (TAU * u[1]).sin_cos();
                let ring = (1.0 - z * z).max(0.0).sqrt();
                let towards = DVec3::new(ring * cos, z, ring * sin);
                self.parallel(towards, *radiance * (4.0 * PI / probability), v, geometry)
            }
            Source::Sky(sky) => {
                let (towards, irradiance) = sky.sample(place)?;
                self.parallel(towards, irradiance / probability, v, geometry)
            }
        };
        Some(start)
    }

    /// Parallel light of an irradiance from a direction, through the disc across it around the scene.
    fn parallel(&self, towards: DVec3, irradiance: DVec3, v: [f64; 2], geometry: &Geometry) -> Start {
        let vpl = Vpl::directional(towards, irradiance);
        let (x, y) = towards.any_orthonormal_pair();
        let disc = disc(v) * self.radius;
        let origin = self.center + disc.x * x + disc.y * y + self.radius * towards;
        let arrived = irradiance * geometry.media.transmittance(origin, towards, f64::INFINITY);
        let flux = arrived * (PI * self.radius * self.radius);
        Start { vpl: Some(vpl), origin, direction: -towards, flux }
    }

    fn shone(&self, light: &Light, v: [f64; 2], probability: f64, geometry: &Geometry) -> Start {
        match *light {
            Light::Spot { position, direction, intensity, inner_angle, outer_angle } => {
                let [inner, outer] = [inner_angle, outer_angle].map(|a| f64::from(a).to_radians().cos());
                let cos = 1.0 - v[0] * (1.0 - outer);
                let ramp = ((cos - outer) / (inner - outer).max(1e-4)).clamp(0.0, 1.0);
                let direction = around(direction.as_dvec3().normalize(), cos, v[1]);
                let flux = intensity.as_dvec3() * (ramp * ramp * TAU * (1.0 - outer) / probability);
                Start { vpl: None, origin: position.as_dvec3(), direction, flux }
            }
            Light::Directional { direction, irradiance } => {
                let towards = -direction.as_dvec3().normalize();
                Start { vpl: None, ..self.parallel(towards, irradiance.as_dvec3() / probability, v, geometry) }
            }
            Light::Point { position, intensity } => {
                let direction = around(DVec3::Y, 1.0 - 2.0 * v[0], v[1]);
                let flux = intensity.as_dvec3() * (4.0 * PI / probability);
                Start { vpl: None, origin: position.as_dvec3(), direction, flux }
            }
            Light::Constant { .. } | Light::Environment { .. } => unreachable!("no lamps"),
        }
    }
}

/// A particle from a triangle that emits; of two sides that shine each has half of them.
fn emitted(emitter: &Emitter, place: [f64; 2], v: [f64; 2], probability: f64, geometry: &Geometry) -> Option<Start> {
    let (side, first, sides) = match (emitter.double_sided, place[0] < 0.5) {
        (false, _) => (1.0, place[0], 1.0),
        (true, true) => (1.0, 2.0 * place[0], 2.0),
        (true, false) => (-1.0, 2.0 * place[0] - 1.0, 2.0),
    };
    // [Turk90]
    let root = first.sqrt();
    let point = geometry.point(emitter.triangle, [root * (1.0 - place[1]), root * place[1]])?;
    let normal = side * point.normal;
    let intensity = geometry.emission(&point) * (emitter.area * sides / probability);
    let direction = around(normal, (1.0 - v[0]).sqrt(), v[1]);
    let position = point.position;
    Some(Start {
        vpl: Some(Vpl::cosine(position, normal, intensity)),
        origin: position,
        direction,
        flux: intensity * PI,
    })
}

impl Sky {
    /// A map, and the integral of its radiance over the sphere, the mean of the channels [W·m⁻²].
    fn new(map: Arc<EnvironmentMap>) -> (Self, f64) {
        let texel = |i: usize| {
            let weight = solid_angle(&map, i as u32 / map.width);
            // Bilinear interpolation brings some light from the neighbours into texels that are black.
            let at = [i as u32 % map.width, i as u32 / map.width];
            let around = [(0, 0), (1, 0), (map.width - 1, 0), (0, 1), (0, u32::MAX)].map(|(dx, dy): (u32, u32)| {
                let row = at[1].saturating_add_signed(dy as i32).min(map.height - 1);
                let pixel = map.pixels[(row * map.width + (at[0] + dx) % map.width) as usize];
                f64::from(pixel.iter().sum::<f32>()) / 3.0
            });
            weight * (0.5 * around[0] + 0.125 * around[1..].iter().sum::<f64>())
        };
        let powers: Vec<_> = (0..map.pixels.len()).map(texel).collect();
        let total = powers.iter().sum();
        (Self { sums: shares(&powers), map }, total)
    }

    /// A direction towards the sky, and the radiance from there over its density.
    fn sample(&self, u: [f64; 2]) -> Option<(DVec3, DVec3)> {
        let (texel, x) = choose(&self.sums, u[0])?;
        let share = self.sums[texel] - if texel == 0 { 0.0 } else { self.sums[texel - 1] };
        let (width, height) = (self.map.width, self.map.height);
        let (column, row) = (texel as u32 % width, texel as u32 / width);
        let cos = |row: u32| (PI * f64::from(row) / f64::from(height)).cos();
        let v = (cos(row) + u[1] * (cos(row + 1) - cos(row))).acos() / PI;
        let direction = self.map.direction(DVec2::new((f64::from(column) + x) / f64::from(width), v));
        let radiance = self.map.radiance(direction.as_vec3()).as_dvec3();
        Some((direction, radiance * (solid_angle(&self.map, row) / share)))
    }
}

/// The solid angle of a texel [sr].
fn solid_angle(map: &EnvironmentMap, row: u32) -> f64 {
    let cos = |row: u32| (PI * f64::from(row) / f64::from(map.height)).cos();
    TAU / f64::from(map.width) * (cos(row) - cos(row + 1))
}

/// Running sums of powers as shares of their total; none where the total is 0.
fn shares(powers: &[f64]) -> Vec<f64> {
    let total: f64 = powers.iter().sum();
    if !(total > 0.0 && total.is_finite()) {
        return Vec::new();
    }
    let mut sum = 0.0;
    powers
        .iter()
        .map(|power| {
            sum += power / total;
            sum
        })
        .collect()
}

/// Which share a number in [0, 1) falls into, and where in it, from 0 to 1: composition.
fn choose(sums: &[f64], u: f64) -> Option<(usize, f64)> {
    let last = sums.len().checked_sub(1)?;
    // Rounding may leave the last sum short of 1; a share of nothing is never chosen.
    let k = sums.partition_point(|&sum| sum <= u).min(last);
    let k = if k > 0 && sums[k] == sums[k - 1] { sums.partition_point(|&sum| sum < sums[k]) } else { k };
    let low = if k == 0 { 0.0 } else { sums[k - 1] };
    Some((k, ((u - low) / (sums[k] - low)).clamp(0.0, 1.0 - f64::EPSILON)))
}

/// The unit vector at an angle to an axis, turned about it by a share of a whole turn.
pub fn around(axis: DVec3, cos: f64, turn: f64) -> DVec3 {
    let (x, y) = axis.any_orthonormal_pair();
    let (s, c) = (TAU * turn).sin_cos();
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    sin * (c * x + s * y) + cos * axis
}

/// A point of the unit disc, evenly spread.
fn disc(u: [f64; 2]) -> DVec2 {
    let (s, c) = (TAU * u[1]).sin_cos();
    u[0].sqrt() * DVec2::new(c, s)
}

/// The normals of a point, turned to the side of the triangle that a direction points to.
pub fn towards(point: &Point, direction: DVec3) -> [DVec3; 2] {
    let side = if point.normal.dot(direction) < 0.0 { -1.0 } else { 1.0 };
    [side * point.normal, side * point.shading]
}
