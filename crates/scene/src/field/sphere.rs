//! A ball with a soft edge.

use glam::Vec3;

/// A ball that touches the faces of the unit cube: 1 within, falling to 0 at its surface as 3t² − 2t³, where t runs from 1
/// to 0 over the last `falloff` of the radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// The share of the radius over which the density falls, 0 (a hard edge) to 1.
    pub falloff: f32,
}

impl Sphere {
    /// The density at a position in the unit cube.
    pub fn value(&self, unit: Vec3) -> f32 {
        self.at(2.0 * (unit - 0.5).length())
    }

    /// The lowest and highest density in a box.
    pub fn range(&self, low: Vec3, high: Vec3) -> [f32; 2] {
        // What the two roundings of a length may add or take.
        const MARGIN: f32 = 1e-6;
        let (low, high) = (low - 0.5, high - 0.5);
        let nearest = Vec3::ZERO.clamp(low, high).length();
        let farthest = low.abs().max(high.abs()).length();
        [self.at(2.0 * farthest + MARGIN), self.at(2.0 * nearest - MARGIN)]
    }

    /// The density at a distance from the centre, in radii.
    fn at(&self, distance: f32) -> f32 {
        let depth = 1.0 - distance;
        if depth >= self.falloff {
            return 1.0;
        }
        let t = (depth / self.falloff).max(0.0);
        if self.falloff > 0.0 { t * t * (3.0 - 2.0 * t) } else { 0.0 }
    }
}
