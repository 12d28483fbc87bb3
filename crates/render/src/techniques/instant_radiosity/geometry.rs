//! What particles meet: surfaces and their materials on the host.

use glam::{DVec3, Vec3, Vec4};
use tyndall_scene::surface::{Bsdf, Map, Surface, Texcoords};

use super::media::Media;
use crate::math::brdf::Brdf;
use crate::resident::bvh::{Bvh, Hit};
use crate::resident::surfaces::{self, Vertex};

/// All surfaces, with the hierarchy over their triangles.
#[derive(Debug)]
pub struct Geometry {
    /// The hierarchy.
    pub bvh: Bvh,
    vertices: Vec<Vertex>,
    triangles: Vec<glam::UVec4>,
    surfaces: Vec<Surface>,
    /// What is between surfaces.
    pub media: Media,
}

/// Layers of what alpha cuts away, one behind the other, at most: as many as `resident/solid.wesl` passes.
const LAYERS: u32 = 8;

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// [m]
    pub position: DVec3,
    /// The unit normal of the triangle, on the front side.
    pub normal: DVec3,
    /// The unit normal for shading, on the same side; without normal map.
    pub shading: DVec3,
    /// Texture coordinates.
    pub uv: Texcoords,
    /// Of the vertices: multiplies the material's colour and alpha.
    pub color: Vec4,
    /// The surface's number.
    pub surface: u32,
}

/// A plane of a mirror.
#[derive(Clone, Copy, Debug)]
pub struct Mirror {
    /// Its unit normal.
    pub normal: DVec3,
    /// Its distance from the origin along the normal [m].
    pub distance: f64,
    /// The mirror's surface.
    pub surface: u32,
    /// The share of light that it reflects.
    pub reflectance: DVec3,
}

/// A triangle that emits.
#[derive(Clone, Copy, Debug)]
pub struct Emitter {
    /// Its number.
    pub triangle: u32,
    /// [m²]
    pub area: f64,
    /// Radiance [W·sr⁻¹·m⁻²] where there is no map.
    pub radiance: DVec3,
    /// Whether the back emits, too.
    pub double_sided: bool,
}

impl Geometry {
    /// The geometry of surfaces, with nothing between them.
    pub fn new(list: &[Surface]) -> Self {
        let (vertices, triangles) = surfaces::triangles(list);
        let bvh = Bvh::new(&crate::resident::bvh::triangles(list));
        Self { bvh, vertices, triangles, surfaces: list.to_vec(), media: Media::default() }
    }

    /// Takes surfaces whose transforms have changed: the hierarchy is fitted to them.
    pub fn moved(&mut self, list: &[Surface]) {
        (self.vertices, self.triangles) = surfaces::triangles(list);
        self.bvh.refit(&crate::resident::bvh::triangles(list));
        self.surfaces = list.to_vec();
    }

    /// The centre and the radius [m] of a sphere around everything.
    pub fn sphere(&self) -> (DVec3, f64) {
        let [low, high] = self.bvh.bounds().map(Vec3::as_dvec3);
        ((low + high) / 2.0, ((high - low).length() / 2.0).max(1e-6))
    }

    /// What a ray meets first, of what alpha has not cut away; its origin is a point of a surface.
    pub fn trace(&self, origin: DVec3, direction: DVec3) -> Option<Point> {
        // Off the surface that it leaves.
        let least = 1e-5 * self.sphere().1;
        let mut origin = origin;
        for _ in 0..LAYERS {
            let hit = self.bvh.closest((origin + least * direction).as_vec3(), direction.as_vec3(), f32::MAX)?;
            let point = self.at(hit)?;
            if !self.cut_out(&point) {
                return Some(point);
            }
            origin = point.position;
        }
        None
    }

    /// Whether alpha cuts a surface away at a point.
    fn cut_out(&self, point: &Point) -> bool {
        let material = &self.surfaces[point.surface as usize].material;
        let Some(cutoff) = material.alpha_cutoff else { return false };
        let map = match &material.bsdf {
            Bsdf::Lambert { map, .. } => map,
            Bsdf::MetallicRoughness { base_color_map, .. } => base_color_map,
            _ => &None,
        };
        point.color.w * map.as_ref().map_or(1.0, |map| map.at(point.uv).w) < cutoff
    }

    /// The point of a hit.
    pub fn at(&self, hit: Hit) -> Option<Point> {
        self.point(hit.triangle, hit.weights.map(f64::from))
    }

    /// The point of a triangle with these weights of its second and third corner; `None` where it has no area.
    pub fn point(&self, triangle: u32, [v, w]: [f64; 2]) -> Option<Point> {
        let corners = self.triangles[triangle as usize];
        let [a, b, c] = [corners.x, corners.y, corners.z].map(|i| self.vertices[i as usize]);
        let [pa, pb, pc] = [a, b, c].map(|vertex| vertex.position.as_dvec3());
        let normal = (pb - pa).cross(pc - pa).try_normalize()?;
        let u = 1.0 - v - w;
        let mean = u * a.normal.as_dvec3() + v * b.normal.as_dvec3() + w * c.normal.as_dvec3();
        let [ta, tb, tc] = [a, b, c].map(|vertex| vertex.texcoords());
        let uv = |i: usize| (u * ta[i].as_dvec2() + v * tb[i].as_dvec2() + w * tc[i].as_dvec2()).as_vec2();
        Some(Point {
            position: u * pa + v * pb + w * pc,
            normal,
            shading: mean.try_normalize().unwrap_or(normal),
            color: u as f32 * a.color + v as f32 * b.color + w as f32 * c.color,
            uv: [uv(0), uv(1)],
            surface: corners.w,
        })
    }

    /// Whether any surface scatters light so.
    pub fn any(&self, how: impl Fn(&Bsdf) -> bool) -> bool {
        self.surfaces.iter().any(|surface| how(&surface.material.bsdf))
    }

    /// A surface's material.
    pub fn bsdf(&self, surface: u32) -> &Bsdf {
        &self.surfaces[surface as usize].material.bsdf
    }

    /// How a point reflects; a mirror's reflectance is `base`.
    pub fn brdf(&self, point: &Point) -> Brdf {
        let map = |map: &Option<Map>| map.as_ref().map_or(Vec4::ONE, |map| map.at(point.uv));
        let color = point.color.truncate();
        match self.bsdf(point.surface) {
            Bsdf::Lambert { reflectance, map: of } => Brdf {
                kind: 0,
                base: (*reflectance * color * map(of).truncate()).as_dvec3(),
                metallic: 0.0,
                alpha: 1.0,
            },
            Bsdf::MetallicRoughness { base_color, base_color_map, metallic, roughness, metallic_roughness_map } => {
                let factors = map(metallic_roughness_map);
                Brdf {
                    kind: 1,
                    base: (*base_color * color * map(base_color_map).truncate()).as_dvec3(),
                    metallic: f64::from(metallic * factors.z),
                    alpha: f64::from(roughness * factors.y).powi(2).max(0.001),
                }
            }
            Bsdf::Mirror { reflectance } => Brdf { kind: 2, base: reflectance.as_dvec3(), metallic: 1.0, alpha: 0.0 },
            Bsdf::Dielectric { .. } => Brdf { kind: 3, base: DVec3::ONE, metallic: 0.0, alpha: 0.0 },
        }
    }

    /// The radiance that a point emits [W·sr⁻¹·m⁻²].
    pub fn emission(&self, point: &Point) -> DVec3 {
        if self.cut_out(point) {
            return DVec3::ZERO;
        }
        let material = &self.surfaces[point.surface as usize].material;
        let map = material.emission_map.as_ref().map_or(Vec3::ONE, |map| map.at(point.uv).truncate());
        (material.emission * map).as_dvec3()
    }

    /// All triangles that emit.
    pub fn emitters(&self) -> Vec<Emitter> {
        let emits = |(i, corners): (usize, &glam::UVec4)| {
            let material = &self.surfaces[corners.w as usize].material;
            let area = self.area(i as u32);
            (material.emission != Vec3::ZERO && area > 0.0).then(|| Emitter {
                triangle: i as u32,
                area,
                radiance: material.emission.as_dvec3(),
                double_sided: material.double_sided,
            })
        };
        self.triangles.iter().enumerate().filter_map(emits).collect()
    }

    /// A triangle's area [m²]; 0 where it is none.
    fn area(&self, triangle: u32) -> f64 {
        let corners = self.triangles[triangle as usize];
        let [a, b, c] = [corners.x, corners.y, corners.z].map(|i| self.vertices[i as usize].position.as_dvec3());
        let area = (b - a).cross(c - a).length() / 2.0;
        if area.is_finite() { area } else { 0.0 }
    }

    /// ρ̄: how much of the light surfaces reflect, the mean over their area and the three channels; what is between a mirror's 1
    /// and nothing. At most 0.99, so that walks end.
    pub fn mean_reflectivity(&self) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for i in 0..self.triangles.len() as u32 {
            let area = self.area(i);
            let Some(point) = self.point(i, [1.0 / 3.0; 2]) else { continue };
            let brdf = self.brdf(&point);
            let dielectric = brdf.base * 0.96 + 0.04;
            let reflected = if brdf.kind == 1 { dielectric.lerp(brdf.base, brdf.metallic) } else { brdf.base };
            sum += area * reflected.element_sum() / 3.0;
            total += area;
        }
        if total > 0.0 { (sum / total).clamp(0.0, 0.99) } else { 0.0 }
    }

    /// The planes of planar mirrors. A mirror of more than `most` planes has none.
    pub fn mirrors(&self, most: usize) -> Vec<Mirror> {
        let mut found = Vec::new();
        let tolerance = 1e-5 * self.sphere().1;
        for (number, surface) in self.surfaces.iter().enumerate() {
            let Bsdf::Mirror { reflectance } = surface.material.bsdf else { continue };
            let mut planes: Vec<(DVec3, f64)> = Vec::new();
            let own = (0..self.triangles.len() as u32).filter(|&i| self.triangles[i as usize].w == number as u32);
            for point in own.filter_map(|i| self.point(i, [1.0 / 3.0; 2])) {
                let known = |&(n, d): &(DVec3, f64)| {
                    n.dot(point.normal).abs() > 1.0 - 1e-9 && (n.dot(point.position) - d).abs() < tolerance
                };
                if !planes.iter().any(known) {
                    planes.push((point.normal, point.normal.dot(point.position)));
                }
            }
            if planes.len() > most {
                tracing::warn!(
                    "surfaces.{}: light that it reflects onto others is left out, as it is not flat",
                    surface.name
                );
                continue;
            }
            let (surface, reflectance) = (number as u32, reflectance.as_dvec3());
            found.extend(planes.into_iter().map(|(normal, distance)| Mirror {
                normal,
                distance,
                surface,
                reflectance,
            }));
        }
        found
    }
}
