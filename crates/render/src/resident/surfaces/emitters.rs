//! Surfaces that emit, as lights at points.

use glam::{DVec3, Mat3, UVec4, Vec3};
use tyndall_scene::surface::Surface;

use super::{Vertex, triangles};
use crate::graph::Graph;
use crate::resident::{Light, Lights};

/// The weights of channels in luminance [Rec. 709].
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Surfaces that emit as about `count` lights, at least one each, in proportion to their power: a light stands for a part of its
/// surface, of which all have the same area. Points are spread evenly [Keller97, Hammersley's].
pub(crate) fn lights(surfaces: &[Surface], count: u32) -> Vec<Light> {
    shared(surfaces, &shares(surfaces, count))
}

/// The buffer of lights, those of [`lights`] among them, which go with surfaces that move.
pub(crate) fn buffer(graph: &mut Graph<'_>, lights: Vec<Light>, surfaces: &[Surface], count: u32) -> wgpu::Buffer {
    let lights = Lights { lights };
    let buffer = graph.gpu().buffer("lights", &lights);
    if lights.lights.iter().any(|light| light.local == Light::AREA) {
        let shares = shares(surfaces, count);
        graph.follow(&buffer, move |_, surfaces| {
            let mut moved = shared(surfaces, &shares).into_iter();
            let place = |light: &Light| match light.local {
                Light::AREA => moved.next().map_or(*light, |moved| Light { maps: light.maps, ..moved }),
                _ => *light,
            };
            Lights { lights: lights.lights.iter().map(place).collect() }
        });
    }
    buffer
}

/// As how many lights each surface shines.
fn shares(surfaces: &[Surface], count: u32) -> Vec<u32> {
    let powers: Vec<_> = surfaces.iter().map(|surface| Emitter::of(surface).map_or(0.0, |e| e.power())).collect();
    let total = powers.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let share = |&power: &f64| (f64::from(count) * power / total).round().max(1.0) as u32;
    powers.iter().map(|power| if *power > 0.0 && count > 0 { share(power) } else { 0 }).collect()
}

/// Surfaces as so many lights each.
fn shared(surfaces: &[Surface], shares: &[u32]) -> Vec<Light> {
    let emitters = surfaces.iter().zip(shares).filter(|(_, share)| **share > 0);
    emitters.filter_map(|(surface, share)| Some(Emitter::of(surface)?.lights(*share))).flatten().collect()
}

struct Emitter<'s> {
    surface: &'s Surface,
    vertices: Vec<Vertex>,
    triangles: Vec<UVec4>,
    /// The area of the triangles up to each [m²].
    areas: Vec<f64>,
    area: f64,
}

impl<'s> Emitter<'s> {
    /// A surface, if it emits.
    fn of(surface: &'s Surface) -> Option<Self> {
        if surface.material.emission == Vec3::ZERO {
            return None;
        }
        let (vertices, triangles) = triangles(std::slice::from_ref(surface));
        let mut area = 0.0;
        let area_of = |t: &UVec4| {
            let [a, b, c] = corners(&vertices, t).map(|vertex| vertex.position.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        };
        let areas = triangles.iter().map(|t| {
            area += area_of(t);
            area
        });
        let areas = areas.collect();
        Some(Self { surface, vertices, triangles, areas, area })
    }

    /// Without the map of emission [W, but for constants].
    fn power(&self) -> f64 {
        let sides = if self.surface.material.double_sided { 2.0 } else { 1.0 };
        sides * self.area * f64::from(self.surface.material.emission.dot(LUMINANCE))
    }

    fn lights(&self, count: u32) -> Vec<Light> {
        let material = &self.surface.material;
        let mut lights = Vec::new();
        for i in 0..count {
            // A position along the triangles' areas says which of them it is, and what is left of it, where in it.
            let along = (f64::from(i) + 0.5) / f64::from(count) * self.area;
            let number = self.areas.partition_point(|&end| end <= along).min(self.areas.len() - 1);
            let begin = if number == 0 { 0.0 } else { self.areas[number - 1] };
            let left = ((along - begin) / (self.areas[number] - begin)).clamp(0.0, 1.0);
            let root = left.sqrt();
            let other = f64::from(i.reverse_bits()) / 2f64.powi(32) + 0.5 / f64::from(count);
            let weights = DVec3::new(1.0 - root, root * (1.0 - other), root * other).as_vec3();
            let [a, b, c] = corners(&self.vertices, &self.triangles[number]);
            let position = Mat3::from_cols(a.position, b.position, c.position) * weights;
            let normal = (b.position - a.position).cross(c.position - a.position).normalize_or_zero();
            let [ta, tb, tc] = [a, b, c].map(Vertex::texcoords);
            let uv = [0, 1].map(|set| ta[set] * weights.x + tb[set] * weights.y + tc[set] * weights.z);
            let map = material.emission_map.as_ref().map_or(Vec3::ONE, |map| map.at(uv).truncate());
            let area = (self.area / f64::from(count)) as f32;
            lights.push(Light::area(position, normal, area, material.emission * map));
            if material.double_sided {
                lights.push(Light::area(position, -normal, area, material.emission * map));
            }
        }
        lights
    }
}

fn corners<'v>(vertices: &'v [Vertex], triangle: &UVec4) -> [&'v Vertex; 3] {
    [triangle.x, triangle.y, triangle.z].map(|i| &vertices[i as usize])
}
