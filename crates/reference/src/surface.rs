//! Surfaces as paths meet them.

use std::sync::Arc;

use glam::{DMat3, DMat4, DVec3, Vec3, Vec4};
use tyndall_scene::World;
use tyndall_scene::surface::{self, Material, Surface, Texcoords, TriangleMesh};

use crate::Random;
use crate::area::AreaLights;
use crate::bsdf::{Bsdf, Rough, Sample};
use crate::bvh::{Bvh, Meeting, Triangle};

/// All surfaces of a world.
#[derive(Default)]
pub(crate) struct Surfaces {
    bvh: Bvh,
    parts: Vec<Part>,
    faces: Vec<Face>,
    /// Those that shine.
    pub lights: AreaLights,
    /// How far rays start beside a surface, so that they do not meet it again [m].
    offset: f64,
}

/// A surface of one material.
struct Part {
    mesh: Arc<TriangleMesh>,
    material: Arc<Material>,
    /// Of vectors along the surface, and of normals; both mirrored if the transform mirrors.
    linear: DMat3,
    normals: DMat3,
}

/// A triangle that is there.
#[derive(Clone, Copy)]
pub(crate) struct Face {
    part: u32,
    /// Vertices of its mesh, counter-clockwise in the world.
    corners: [u32; 3],
    pub triangle: Triangle,
}

/// A point of a surface that a path meets.
pub(crate) struct Spot {
    /// From the path's origin [m].
    pub distance: f64,
    /// [m]
    pub point: DVec3,
    /// The unit vector back along the path.
    pub view: DVec3,
    /// The triangle's unit normal, and the one for shading; both turned to the path if it meets the back.
    pub geometric: DVec3,
    shading: DVec3,
    pub bsdf: Bsdf,
    /// What is emitted to the path [W·sr⁻¹·m⁻²].
    pub emission: DVec3,
    /// Which of the faces it is on.
    pub face: usize,
    /// How far beside the surface rays start [m].
    offset: f64,
}

/// A point of a surface that shines, as it is seen from another.
pub(crate) struct LightPoint {
    /// The unit vector to it.
    pub towards: DVec3,
    /// [m]
    pub distance: f64,
    /// What it emits to there [W·sr⁻¹·m⁻²].
    pub emission: DVec3,
    /// With which the direction to it was chosen [sr⁻¹].
    pub density: f64,
}

impl Surfaces {
    /// [`Surfaces::offset`] in largest coordinates M of all surfaces.
    ///
    /// With u = 2⁻⁵³, a point that is weighted from three corners is off by 7uM along each axis, by 7√3·uM in all. When a
    /// ray meets the plane again, the corners' distances from its origin, of at most 2√3·M, carry 3u each, and so does their
    /// mean: 12√3·uM. All together are less than 33uM.
    const OFFSET: f64 = 32.0 * f64::EPSILON;

    /// Takes the triangles into the world. Those without an area, and those that are not finite, are left out.
    pub fn new(world: &World) -> Self {
        let (mut parts, mut faces) = (Vec::new(), Vec::new());
        for surface in &world.surfaces {
            let part = Part::new(surface);
            faces.extend(part.faces(surface, parts.len() as u32));
            parts.push(part);
        }
        let triangles: Vec<_> = faces.iter().map(|face| face.triangle).collect();
        let bvh = Bvh::new(&triangles);
        let offset = Self::OFFSET * bvh.reach();
        let lights = AreaLights::new(&faces, |face| parts[face.part as usize].power());
        Self { bvh, parts, faces, lights, offset }
    }

    /// Where a ray in the unit `direction` first meets a surface.
    pub fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<Spot> {
        let meeting = self.bvh.nearest(origin, direction, f64::INFINITY, |meeting| self.exists(meeting))?;
        Some(self.spot(&meeting, direction))
    }

    /// Whether a ray in the unit `direction` meets a surface before a distance [m]; what is at that distance, as a light may be,
    /// is no obstacle.
    pub fn block(&self, origin: DVec3, direction: DVec3, distance: f64) -> bool {
        self.bvh.blocked(origin, direction, distance - self.offset, |meeting| self.exists(meeting))
    }

    /// A random point of the surfaces that shine, beside the side that is seen from `eye`, and what it emits there; `None` where
    /// there is none, or the point is dark from there.
    pub fn sample_light(&self, eye: DVec3, rng: &mut Random) -> Option<LightPoint> {
        let (index, weights) = self.lights.sample(rng)?;
        let face = &self.faces[index];
        let normal = face.triangle.area_vector().normalize();
        let corners = face.triangle.0;
        let mut point = blend(weights, |i| corners[i]);
        let height = normal.dot(eye - point);
        let part = &self.parts[face.part as usize];
        let emission = part.emission(part.texcoord(face, weights), height > 0.0);
        point += normal * self.offset.copysign(height);
        let (towards, distance) = (point - eye).normalize_and_length();
        let cosine = normal.dot(towards).abs();
        let density = self.lights.chance(index, distance, cosine);
        let seen = emission != DVec3::ZERO && distance > 0.0 && cosine > 0.0;
        seen.then_some(LightPoint { towards, distance, emission, density })
    }

    /// All faces.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// Not where its material is transparent.
    #[inline]
    pub fn exists(&self, meeting: &Meeting) -> bool {
        let face = &self.faces[meeting.triangle];
        let part = &self.parts[face.part as usize];
        let Some(cutoff) = part.material.alpha_cutoff else { return true };
        let uv = part.texcoord(face, meeting.weights);
        part.color(face, meeting.weights, uv).w >= cutoff
    }

    /// The point where a ray in the unit `direction` meets a face.
    pub fn spot(&self, meeting: &Meeting, direction: DVec3) -> Spot {
        let face = &self.faces[meeting.triangle];
        let part = &self.parts[face.part as usize];
        let uv = part.texcoord(face, meeting.weights);
        let normal = face.triangle.area_vector().normalize();
        let turn = if meeting.front { 1.0 } else { -1.0 };
        let corners = face.triangle.0;
        Spot {
            distance: meeting.distance,
            point: blend(meeting.weights, |i| corners[i]),
            view: -direction,
            geometric: normal * turn,
            shading: part.normal(face, meeting.weights, uv).unwrap_or(normal) * turn,
            bsdf: part.bsdf(face, meeting.weights, uv, meeting.front),
            emission: part.emission(uv, meeting.front),
            face: meeting.triangle,
            offset: self.offset,
        }
    }
}

/// Σ wᵢ·xᵢ.
fn blend(weights: [f64; 3], of: impl Fn(usize) -> DVec3) -> DVec3 {
    of(0) * weights[0] + of(1) * weights[1] + of(2) * weights[2]
}

impl Part {
    fn new(surface: &Surface) -> Self {
        let linear = DMat3::from_mat4(surface.world_from_object.as_dmat4());
        // The cofactors are the inverse's transpose times the determinant, whose sign turns normals of a mirroring
        // transform over: it is taken off again.
        let sign = linear.determinant().signum();
        let cofactors = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        );
        Self { mesh: surface.mesh.clone(), material: surface.material.clone(), linear, normals: cofactors * sign }
    }

    /// Its triangles in the world.
    fn faces(&self, surface: &Surface, part: u32) -> impl Iterator<Item = Face> {
        let world_from_object: DMat4 = surface.world_from_object.as_dmat4();
        let mirrors = self.linear.determinant() < 0.0;
        self.mesh.triangles.iter().filter_map(move |&[a, b, c]| {
            let corners = if mirrors { [a, c, b] } else { [a, b, c] };
            let [a, b, c] = corners.map(|corner| self.mesh.positions.get(corner as usize));
            let points = [*a?, *b?, *c?].map(|point| world_from_object.transform_point3(point.as_dvec3()));
            let triangle = Triangle(points);
            let area = triangle.area_vector().length();
            (area > 0.0 && area.is_finite()).then_some(Face { part, corners, triangle })
        })
    }

    /// Texture coordinates; 0 where there are none.
    fn texcoord(&self, face: &Face, weights: [f64; 3]) -> Texcoords {
        let corners = face.corners.map(|corner| self.mesh.texcoords_of(corner));
        [0, 1].map(|set| (0..3).map(|i| corners[i][set] * weights[i] as f32).sum())
    }

    /// The unit normal for shading on the front; `None` where there is none.
    fn normal(&self, face: &Face, weights: [f64; 3], uv: Texcoords) -> Option<DVec3> {
        let at =
            |i: usize| self.mesh.normals.get(face.corners[i] as usize).map_or(DVec3::ZERO, |normal| normal.as_dvec3());
        let normal = (self.normals * blend(weights, at)).try_normalize()?;
        let Some(map) = self.material.normal_map.as_ref().filter(|_| !self.mesh.tangents.is_empty()) else {
            return Some(normal);
        };
        let of = |i: usize| self.mesh.tangents.get(face.corners[i] as usize).copied().unwrap_or_default();
        let tangent = (self.linear * blend(weights, |i| of(i).truncate().as_dvec3())).try_normalize()?;
        let hand = f64::from(of(0).w) * self.linear.determinant().signum();
        let bitangent = normal.cross(tangent) * hand;
        let scale = f64::from(map.scale);
        let bent = (map.map.at(uv).truncate().as_dvec3() * 2.0 - 1.0) * DVec3::new(scale, scale, 1.0);
        (tangent * bent.x + bitangent * bent.y + normal * bent.z).try_normalize()
    }

    /// What multiplies the reflectance, and how opaque it is: the vertices' colours times the material's picture.
    fn color(&self, face: &Face, weights: [f64; 3], uv: Texcoords) -> Vec4 {
        let of = |i: usize| self.mesh.colors.get(face.corners[i] as usize).copied().unwrap_or(Vec4::ONE);
        let color: Vec4 = (0..3).map(|i| of(i) * weights[i] as f32).sum();
        let map = match &self.material.bsdf {
            surface::Bsdf::Lambert { map, .. } => map.as_ref(),
            surface::Bsdf::MetallicRoughness { base_color_map, .. } => base_color_map.as_ref(),
            surface::Bsdf::Mirror { .. } | surface::Bsdf::Dielectric { .. } => None,
        };
        color * map.map_or(Vec4::ONE, |map| map.at(uv))
    }

    fn bsdf(&self, face: &Face, weights: [f64; 3], uv: Texcoords, front: bool) -> Bsdf {
        let color = || self.color(face, weights, uv).truncate();
        match &self.material.bsdf {
            surface::Bsdf::Lambert { reflectance, .. } => {
                Bsdf::Lambert { reflectance: (reflectance * color()).as_dvec3() }
            }
            surface::Bsdf::MetallicRoughness { base_color, metallic, roughness, metallic_roughness_map, .. } => {
                let texel = metallic_roughness_map.as_ref().map_or(Vec3::ONE, |map| map.at(uv).truncate());
                let [metallic, roughness] = [metallic * texel.z, roughness * texel.y].map(f64::from);
                Bsdf::Rough(Rough::new((base_color * color()).as_dvec3(), metallic, roughness))
            }
            surface::Bsdf::Mirror { reflectance } => Bsdf::Mirror { reflectance: reflectance.as_dvec3() },
            surface::Bsdf::Dielectric { ior } => {
                let ior = f64::from(*ior);
                Bsdf::Dielectric { eta: if front { ior } else { 1.0 / ior } }
            }
        }
    }

    /// What a side emits [W·sr⁻¹·m⁻²].
    fn emission(&self, uv: Texcoords, front: bool) -> DVec3 {
        let material = &self.material;
        if material.emission == Vec3::ZERO || !(front || material.double_sided) {
            return DVec3::ZERO;
        }
        let map = material.emission_map.as_ref().map_or(Vec3::ONE, |map| map.at(uv).truncate());
        (material.emission * map).as_dvec3()
    }

    /// How bright an area is for the choice of lights: the emission's sum over channels and sides, a picture taken as white.
    fn power(&self) -> f64 {
        let sides = if self.material.double_sided { 2.0 } else { 1.0 };
        f64::from(self.material.emission.element_sum()) * sides
    }
}

impl Spot {
    /// The share of light from the unit direction `towards` that is scattered to the path, on a unit of irradiance across it:
    /// the value times the cosine to the normal for shading [sr⁻¹]. Nothing is reflected through the surface.
    pub fn scattering(&self, towards: DVec3) -> DVec3 {
        if self.geometric.dot(towards) <= 0.0 {
            return DVec3::ZERO;
        }
        self.bsdf.value(self.view, towards, self.shading) * self.shading.dot(towards).max(0.0)
    }

    /// The density with which [`Spot::sample`] chooses a direction [sr⁻¹].
    pub fn chance(&self, towards: DVec3) -> f64 {
        self.bsdf.pdf(self.view, towards, self.shading)
    }

    /// A direction for the path to go on in; `None` where it ends.
    pub fn sample(&self, rng: &mut Random) -> Option<Sample> {
        let sample = self.bsdf.sample(self.view, self.shading, rng)?;
        // Reflected light stays on the side of both normals, refracted light on the other of both.
        let [shape, shade] = [self.geometric, self.shading].map(|normal| normal.dot(sample.towards));
        (shape * shade > 0.0).then_some(sample)
    }

    /// Where a ray in a direction starts: beside the surface, on the side it goes to.
    pub fn start(&self, towards: DVec3) -> DVec3 {
        self.point + self.geometric * self.offset.copysign(self.geometric.dot(towards))
    }
}
