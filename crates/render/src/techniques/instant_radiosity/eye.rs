//! What virtual lights count for a picture: what a few points that the eye sees receive of each.

use glam::{DVec3, Vec3};
use tyndall_scene::World;
use tyndall_scene::surface::Bsdf;

use super::Walk;
use super::geometry::{Geometry, Mirror, Point};
use super::sequence::radical_inverse;
use super::sources::towards;
use super::vpl::{LOBE, PARALLEL, Vpl};
use super::walk::{reflect, through};
use crate::math::brdf::Brdf;
use crate::resident::View;

/// Rays to lights that are traced at most, and the most and the fewest points that the eye sees.
const RAYS: usize = 1 << 19;
const POINTS: [usize; 2] = [32, 64];

/// The share of its weight that a light has for its power alone: what no point sees still counts, as others may.
const FLOOR: f64 = 0.3;

/// Mirrors and glass between the eye and a point, at most.
const TURNS: usize = 8;

/// A point that the eye sees.
struct Seen {
    position: DVec3,
    normal: DVec3,
    shading: DVec3,
    viewer: DVec3,
    brdf: Brdf,
    throughput: DVec3,
}

/// A weight for each of these lights, none of them lamps, whose sum is 1: what it and its images in mirrors add to the picture, over what is
/// there; 1/r² is bounded by `bounds` [m⁻²], of reflected and of emitted light.
pub fn contributions(world: &World, walk: &Walk, lights: &[Vpl], bounds: [f64; 2]) -> Vec<f64> {
    let Walk { geometry, mirrors, .. } = walk;
    let power = |vpl: &Vpl| f64::from(vpl.power.element_sum());
    let powers: f64 = lights.iter().map(power).sum();
    let count = (RAYS / lights.len().max(1)).clamp(POINTS[0], POINTS[1]);
    let rows: Vec<Vec<f64>> = seen(world, geometry, count as u32)
        .iter()
        .map(|seen| {
            let images: Vec<_> = mirrors.iter().filter_map(|mirror| seen.before(mirror)).collect();
            let all = |vpl: &Vpl| {
                let bound = bounds[usize::from(vpl.bounce == 0)];
                let image = |(image, mirror): &(Seen, &Mirror)| received(geometry, image, vpl, bound, Some(mirror));
                received(geometry, seen, vpl, bound, None) + images.iter().map(image).sum::<f64>()
            };
            lights.iter().map(all).collect()
        })
        .collect();
    let sums: Vec<f64> = rows.iter().map(|row| row.iter().sum()).collect();
    let mean = sums.iter().sum::<f64>() / sums.len().max(1) as f64;
    let mut weights = vec![0.0; lights.len()];
    for (row, sum) in rows.iter().zip(&sums).filter(|(_, sum)| **sum > 0.0) {
        weights.iter_mut().zip(row).for_each(|(weight, value)| *weight += value / (sum + mean));
    }
    let total: f64 = weights.iter().sum();
    let floor = if total > 0.0 { FLOOR } else { 1.0 };
    let weight = |(weight, vpl): (&f64, &Vpl)| (1.0 - floor) * weight / total.max(1e-300) + floor * power(vpl) / powers;
    weights.iter().zip(lights).map(weight).collect()
}

/// Points that the eye sees all over the film, also by way of mirrors and glass.
fn seen(world: &World, geometry: &Geometry, count: u32) -> Vec<Seen> {
    let view = View::new(&world.scene.camera, world.scene.film.size, Vec3::ZERO, 0.0);
    let [forward, right, up] = [view.forward, view.right, view.up].map(Vec3::as_dvec3);
    let middle = 0.5 / f64::from(count);
    let place =
        |i: u32| [f64::from(i) / f64::from(count) + middle, radical_inverse(2, i) + middle].map(|x| 2.0 * x - 1.0);
    let ray = |[x, y]: [f64; 2]| (forward + x * right + y * up).normalize();
    (0..count).filter_map(|i| look(geometry, view.position.as_dvec3(), ray(place(i)))).collect()
}

fn look(geometry: &Geometry, eye: DVec3, ray: DVec3) -> Option<Seen> {
    let (mut origin, mut direction, mut throughput) = (eye, ray, DVec3::ONE);
    for _ in 0..TURNS {
        let point: Point = geometry.trace(origin, direction)?;
        let [normal, shading] = towards(&point, -direction);
        let brdf = geometry.brdf(&point);
        origin = point.position;
        match geometry.bsdf(point.surface) {
            Bsdf::Mirror { .. } => {
                throughput *= brdf.base;
                direction = reflect(direction, normal);
            }
            // Refracted wherever it can be.
            bsdf @ Bsdf::Dielectric { .. } => direction = through(bsdf, &point, direction, 1.0),
            _ => return Some(Seen { position: origin, normal, shading, viewer: -direction, brdf, throughput }),
        }
    }
    None
}

impl Seen {
    /// The point as a mirror shows it, to what is on the same side of the mirror as itself: what lights the image through the mirror lights
    /// the point by way of it.
    fn before<'a>(&self, mirror: &'a Mirror) -> Option<(Self, &'a Mirror)> {
        let height = self.position.dot(mirror.normal) - mirror.distance;
        let turned = |direction| reflect(direction, mirror.normal);
        (height.abs() > 1e-9).then(|| {
            let image = Self {
                position: self.position - 2.0 * height * mirror.normal,
                normal: turned(self.normal),
                shading: turned(self.shading),
                viewer: turned(self.viewer),
                throughput: self.throughput * mirror.reflectance,
                brdf: self.brdf,
            };
            (image, mirror)
        })
    }
}

/// The radiance that the eye sees of a light at a point, all channels together; where the point is one that a mirror shows, by way of that.
fn received(geometry: &Geometry, seen: &Seen, vpl: &Vpl, bound: f64, mirror: Option<&Mirror>) -> f64 {
    let least = 2e-5 * geometry.sphere().1;
    let start = seen.position + least * seen.normal;
    let normal = vpl.normal.as_dvec3();
    let way = if vpl.kind == PARALLEL {
        2.0 * geometry.sphere().1 * normal
    } else {
        vpl.position.as_dvec3() + least * normal - start
    };
    let direction = way.normalize_or_zero();
    let cosine = direction.dot(seen.shading);
    if cosine <= 0.0 || direction.dot(seen.normal) <= 0.0 {
        return 0.0;
    }
    let mut light = vpl.power.as_dvec3();
    if vpl.kind == LOBE {
        let [metallic, alpha] = [vpl.metallic, vpl.alpha].map(f64::from);
        let brdf = Brdf { kind: 1, base: vpl.base.as_dvec3(), metallic, alpha };
        light *= brdf.value(vpl.shading.as_dvec3(), vpl.incoming.as_dvec3(), -direction);
    }
    light *= match vpl.kind {
        PARALLEL => cosine,
        _ => (cosine * (-direction.dot(normal)).max(0.0) / way.length_squared()).min(bound),
    };
    let value = (seen.throughput * seen.brdf.value(seen.shading, direction, seen.viewer) * light).element_sum();
    let open = |from: DVec3, way: DVec3| !geometry.bvh.occluded(from.as_vec3(), way.as_vec3(), 1.0);
    let visible = || match mirror {
        None => open(start, way),
        Some(mirror) => {
            // From the image to the mirror's plane nothing is in the way; before it stands the point itself.
            let [height, rise] = [start, way].map(|v| v.dot(mirror.normal));
            let share = (mirror.distance - height) / rise;
            let place = start + share * way;
            let side = mirror.normal * rise.signum();
            let own = place + reflect(start - place, mirror.normal);
            let there = || geometry.bvh.closest(own.as_vec3(), (place - own).as_vec3(), 1.01);
            let shown =
                || there().and_then(|hit| geometry.at(hit)).is_some_and(|point| point.surface == mirror.surface);
            (0.0..1.0).contains(&share) && shown() && open(place + least * side, (1.0 - share) * way)
        }
    };
    if value > 0.0 && visible() { value } else { 0.0 }
}
