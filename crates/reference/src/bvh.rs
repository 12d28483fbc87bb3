//! Which triangle a ray meets first.
//!
//! The tree is of single precision, and finds candidates; triangles are met in double precision. No candidate is lost, as
//! every box is padded by what the tree's arithmetic may be off, [`Bvh::PADDING`].

use glam::DVec3;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::{Ray, RayHit};

/// A triangle in the world [m], counter-clockwise as seen from the front.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle(pub [DVec3; 3]);

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meeting {
    /// Which triangle it is, in the order they were given.
    pub triangle: usize,
    /// From the ray's origin [m].
    pub distance: f64,
    /// What each corner counts; their sum is 1.
    pub weights: [f64; 3],
    /// Whether it is the front that is met.
    pub front: bool,
}

/// Triangles to be met by rays.
#[derive(Default)]
pub(crate) struct Bvh {
    tree: Bvh2,
    /// In the order of the tree's leaves, each with its place in the order they were given.
    triangles: Vec<(Triangle, u32)>,
    /// The box about all, padded [m].
    bounds: [DVec3; 2],
    /// The largest coordinate [m].
    reach: f64,
}

impl Bvh {
    /// By how much a box is larger than what it holds, in largest coordinates M of all triangles.
    ///
    /// With u = 2⁻²⁴ the tree's t = (box − o)/d has relative errors of u from each of: d and its reciprocal, the
    /// difference, the product, of which |box − o| ≤ 2M; and o, which is within the bounds, is rounded by uM. As lengths along the
    /// axis these are 8uM + uM. A component of d below 2u is taken for 2u, which over the longest way of 2√3·M makes
    /// 7uM more. 32u is twice the sum.
    const PADDING: f64 = 16.0 * f32::EPSILON as f64;

    /// Builds the tree; the triangles are finite.
    pub fn new(triangles: &[Triangle]) -> Self {
        if triangles.is_empty() {
            return Self::default();
        }
        let corners = || triangles.iter().flat_map(|triangle| triangle.0);
        let reach = corners().map(|corner| corner.abs().max_element()).fold(0.0, f64::max);
        let padding = DVec3::splat(Self::PADDING * reach);
        let around = |points: &mut dyn Iterator<Item = DVec3>| {
            let start = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            let [min, max] = points.fold(start, |[min, max], point| [min.min(point), max.max(point)]);
            [min - padding, max + padding]
        };
        let boxes: Vec<_> = triangles
            .iter()
            .map(|triangle| {
                let [min, max] = around(&mut triangle.0.into_iter());
                Aabb::new(min.as_vec3a(), max.as_vec3a())
            })
            .collect();
        let parameters = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        let tree = build_bvh2(&boxes, parameters, &mut Default::default());
        let triangles = tree.primitive_indices.iter().map(|&i| (triangles[i as usize], i)).collect();
        let bounds = around(&mut corners());
        Self { tree, triangles, bounds, reach }
    }

    /// The largest coordinate of any triangle [m].
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The first triangle within `limit` [m] that a ray in the unit `direction` meets, of those that `exist` there.
    #[inline]
    pub fn nearest(
        &self,
        origin: DVec3,
        direction: DVec3,
        limit: f64,
        exist: impl Fn(&Meeting) -> bool,
    ) -> Option<Meeting> {
        let (ray, start) = self.enter(origin, direction, limit)?;
        let (mut found, mut nearest) = (None, limit);
        self.tree.ray_traverse(ray, &mut RayHit::none(), |_, leaf| {
            match self.meet(leaf, origin, direction, nearest).filter(&exist) {
                None => f32::INFINITY,
                Some(meeting) => {
                    nearest = meeting.distance;
                    found = Some(meeting);
                    above(nearest - start)
                }
            }
        });
        found
    }

    /// Whether a ray in the unit `direction` meets a triangle within `limit` [m], of those that `exist` there.
    #[inline]
    pub fn blocked(&self, origin: DVec3, direction: DVec3, limit: f64, exist: impl Fn(&Meeting) -> bool) -> bool {
        let Some((ray, _)) = self.enter(origin, direction, limit) else { return false };
        !self.tree.ray_traverse_miss(ray, |_, leaf| {
            if self.meet(leaf, origin, direction, limit).is_some_and(|meeting| exist(&meeting)) {
                f32::NEG_INFINITY
            } else {
                f32::INFINITY
            }
        })
    }

    /// The ray for the tree, which begins where the given one enters the bounds, and how far along that is [m]: its
    /// coordinates are no larger than theirs.
    fn enter(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<(Ray, f64)> {
        if self.triangles.is_empty() {
            return None;
        }
        let [min, max] = self.bounds;
        let mut start = 0.0f64;
        if origin.cmplt(min).any() || origin.cmpgt(max).any() {
            let inverse = direction.recip();
            let [a, b] = [(min - origin) * inverse, (max - origin) * inverse];
            start = a.min(b).max_element().max(0.0);
            let end = a.max(b).min_element();
            // NaN, where a ray runs in a face of the bounds, is no reason to miss.
            if start > end || start > limit {
                return None;
            }
        }
        let entry = (origin + direction * start).clamp(min, max);
        Some((Ray::new(entry.as_vec3a(), direction.as_vec3a(), 0.0, above(limit - start)), start))
    }

    #[inline]
    fn meet(&self, leaf: usize, origin: DVec3, direction: DVec3, limit: f64) -> Option<Meeting> {
        let (triangle, index) = &self.triangles[leaf];
        let (distance, weights, front) = triangle.meet(origin, direction)?;
        (distance > 0.0 && distance < limit).then_some(Meeting { triangle: *index as usize, distance, weights, front })
    }
}

/// The next single above a double; at least 0.
fn above(x: f64) -> f32 {
    (x as f32).next_up().max(0.0)
}

impl Triangle {
    /// Where a ray's line meets it: distance [m], negative behind the origin, the corners' weights, and whether from the front.
    #[inline]
    pub fn meet(&self, origin: DVec3, direction: DVec3) -> Option<(f64, [f64; 3], bool)> {
        let [a, b, c] = self.0.map(|corner| corner - origin);
        // Six times the volumes that the ray spans with the edges, whose signs say on which side it passes each. Two triangles
        // compute that of a common edge from the same numbers, to the same size and opposite sign: no ray slips
        // through between them [Woop13].
        let weights = [direction.dot(c.cross(b)), direction.dot(a.cross(c)), direction.dot(b.cross(a))];
        let [u, v, w] = weights;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        let weights = weights.map(|weight| weight / sum);
        let distance = direction.dot(a * weights[0] + b * weights[1] + c * weights[2]);
        // In the triangle's plane the sum is 0, and the distance is no number.
        distance.is_finite().then_some((distance, weights, sum > 0.0))
    }

    /// Twice its area times its unit normal [m²].
    pub fn area_vector(&self) -> DVec3 {
        let [a, b, c] = self.0;
        (b - a).cross(c - a)
    }
}

#[cfg(test)]
mod test;
