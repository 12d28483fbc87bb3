//! Triangles of a file made fit for rendering: what is no triangle is dropped, what is missing is computed.

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::tangents::add_tangents;
use super::{Map, TriangleMesh};

/// Triangles as a file gives them; lists other than `positions` and `triangles` may be empty, else they have an entry a
/// vertex. Indices are within `positions`.
#[derive(Clone, Debug, Default)]
pub(super) struct Triangles {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub texcoords: Vec<Vec2>,
    pub second_texcoords: Vec<Vec2>,
    pub tangents: Vec<Vec4>,
    pub colors: Vec<Vec4>,
    pub triangles: Vec<[u32; 3]>,
}

/// Bytes that a vertex takes at most, and a triangle.
pub(super) const VERTEX_BYTES: usize = size_of::<[Vec3; 2]>() + size_of::<[Vec2; 2]>() + size_of::<[Vec4; 2]>();
pub(super) const TRIANGLE_BYTES: usize = size_of::<[u32; 3]>();

/// How normals that a file lacks are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Missing {
    /// Every triangle is flat, as glTF demands.
    Flat,
    /// Those of the triangles around a vertex are averaged, weighted by their angles there. [Thurmer98]
    Smooth,
}

impl Triangles {
    /// The mesh, with tangents where there is a normal map. What had to be dropped or replaced is warned about, by the
    /// name of the object.
    pub fn finish(mut self, object: &str, missing: Missing, normal_map: Option<&Map>) -> TriangleMesh {
        let count = self.triangles.len();
        let positions = &self.positions;
        self.triangles.retain(|triangle| twice_area(positions, triangle).is_some());
        let dropped = count - self.triangles.len();
        if dropped > 0 {
            tracing::warn!(
                "{object}: {dropped} of {count} triangles have no area or no finite corners; they are dropped"
            );
        }
        if missing == Missing::Flat && self.normals.is_empty() {
            self.split();
        }
        self.compact();
        self.mend_normals(object);
        let sets = self.texcoords.iter_mut().chain(&mut self.second_texcoords);
        let stray = sets.filter(|uv| !uv.is_finite()).map(|uv| *uv = Vec2::ZERO).count();
        let pale = self.colors.iter_mut().filter(|color| !(color.is_finite() && color.min_element() >= 0.0));
        let pale = pale.map(|color| *color = Vec4::ONE).count();
        for (count, what) in [(stray, "texture coordinates"), (pale, "colours")] {
            if count > 0 {
                tracing::warn!("{object}: the {what} of {count} vertices are no numbers; they are replaced");
            }
        }
        let second = normal_map.is_some_and(|map| map.second);
        let mapped = !if second { &self.second_texcoords } else { &self.texcoords }.is_empty();
        if self.texcoords.is_empty() {
            self.texcoords = vec![Vec2::ZERO; self.positions.len()];
        }
        let given = self.tangents.iter().all(|t| t.truncate().is_normalized() && t.w.abs() == 1.0);
        if normal_map.is_none() || !given {
            self.tangents.clear();
        }
        let Self { positions, normals, texcoords, second_texcoords, tangents, colors, triangles } = self;
        let mut mesh = TriangleMesh { positions, normals, texcoords, second_texcoords, tangents, colors, triangles };
        if let Some(map) = normal_map.filter(|_| mesh.tangents.is_empty()) {
            if !mapped {
                tracing::warn!("{object}: has a normal map, but no texture coordinates");
            }
            add_tangents(&mut mesh, map);
        }
        mesh
    }

    /// Gives every triangle vertices of its own.
    fn split(&mut self) {
        let corners: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        self.gather(&corners);
        self.triangles = (0..corners.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    }

    /// Drops vertices of no triangle.
    fn compact(&mut self) {
        let mut place = vec![u32::MAX; self.positions.len()];
        let mut kept = Vec::new();
        for corner in self.triangles.iter_mut().flatten() {
            let place = &mut place[*corner as usize];
            if *place == u32::MAX {
                *place = kept.len() as u32;
                kept.push(*corner);
            }
            *corner = *place;
        }
        self.gather(&kept);
    }

    /// Puts the vertices `from` in place of all.
    fn gather(&mut self, from: &[u32]) {
        fn pick<T: Copy>(list: &mut Vec<T>, from: &[u32]) {
            if !list.is_empty() {
                *list = from.iter().map(|&i| list[i as usize]).collect();
            }
        }
        pick(&mut self.positions, from);
        pick(&mut self.normals, from);
        pick(&mut self.texcoords, from);
        pick(&mut self.second_texcoords, from);
        pick(&mut self.tangents, from);
        pick(&mut self.colors, from);
    }

    /// Makes normals unit vectors, and replaces those that are missing or no directions.
    fn mend_normals(&mut self, object: &str) {
        let given = !self.normals.is_empty();
        self.normals.resize(self.positions.len(), Vec3::ZERO);
        let mut wrong = 0;
        for normal in &mut self.normals {
            // In double precision no length over- or underflows.
            let unit = normal.as_dvec3().normalize_or_zero().as_vec3();
            *normal = if normal.is_finite() { unit } else { Vec3::ZERO };
            wrong += usize::from(*normal == Vec3::ZERO);
        }
        if wrong == 0 {
            return;
        }
        if given {
            tracing::warn!("{object}: the normals of {wrong} vertices are no directions; they are computed");
        }
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for triangle in &self.triangles {
            let Some(normal) = twice_area(&self.positions, triangle) else { continue };
            let [a, b, c] = triangle.map(|i| self.positions[i as usize].as_dvec3());
            for (corner, [to, from]) in triangle.iter().zip([[b - a, c - a], [c - b, a - b], [a - c, b - c]]) {
                sums[*corner as usize] += normal.normalize() * to.angle_between(from);
            }
        }
        for (normal, sum) in self.normals.iter_mut().zip(&sums) {
            if *normal == Vec3::ZERO {
                // Opposite triangles may cancel.
                *normal = sum.try_normalize().unwrap_or(DVec3::Y).as_vec3();
            }
        }
    }
}

/// A triangle's normal, twice its area long; `None` where single precision holds neither.
fn twice_area(positions: &[Vec3], triangle: &[u32; 3]) -> Option<DVec3> {
    let [a, b, c] = triangle.map(|i| positions[i as usize]);
    let normal = (b.as_dvec3() - a.as_dvec3()).cross(c.as_dvec3() - a.as_dvec3());
    // What renderers compute.
    let single = (b - a).cross(c - a).length_squared();
    (single.is_normal() && normal.length_squared().is_normal()).then_some(normal)
}

#[cfg(test)]
mod test;
