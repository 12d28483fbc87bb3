//! Phase functions as tables.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// A phase function by its values at nodes, linear between them in the coordinate
///
/// z = √(√2 sin(θ/4)), from 0 at θ = 0 to 1 at θ = π.
///
/// This is its definition, not an approximation: its integral over the sphere, 1 in each channel, is one of polynomials,
/// as sin²(θ/2) = 2z⁴ − z⁸. At the front θ ≈ 2√2 z², which crowds nodes into the narrow peak of large particles, while at
/// the back, where they have another peak, θ is linear in z. `docs/phase.md` has the errors of this and other choices.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseTable {
    values: Vec<Vec3>,
}

impl PhaseTable {
    /// How many nodes there are: at z = i/(NODES − 1).
    pub const NODES: usize = 4096;

    /// The table of a function of θ [radians], which need not be normalised. `None` where its integral is not positive.
    pub(super) fn new(function: impl Fn(f64) -> DVec3 + Sync) -> Option<Self> {
        let values: Vec<DVec3> = (0..Self::NODES).into_par_iter().map(|i| function(Self::angle(i))).collect();
        let total: DVec3 = values.iter().zip(Self::weights()).map(|(value, weight)| *value * weight).sum();
        let values: Vec<_> = values.into_iter().map(|value| (value / total).as_vec3()).collect();
        values.iter().all(|value| value.is_finite()).then_some(Self { values })
    }

    /// The coordinate z of an angle.
    pub fn coordinate(cos_theta: f64) -> f64 {
        // √2 sin(θ/4) = √(1 − cos(θ/2)), which is sin²(θ/2)/(1 + cos(θ/2)) without cancellation.
        let half = (0.5 * (1.0 + cos_theta)).max(0.0).sqrt();
        (0.5 * (1.0 - cos_theta).max(0.0) / (1.0 + half)).sqrt().sqrt()
    }

    /// sin²(θ/2) at a coordinate: the share of the sphere within θ.
    pub fn share(z: f64) -> f64 {
        let y = z * z;
        y * y * (2.0 - y * y)
    }

    /// The values [sr⁻¹] at the nodes.
    pub fn values(&self) -> &[Vec3] {
        &self.values
    }

    /// The value [sr⁻¹] at an angle.
    pub fn value(&self, cos_theta: f64) -> DVec3 {
        let place = Self::coordinate(cos_theta) * (Self::NODES - 1) as f64;
        let node = (place as usize).min(Self::NODES - 2);
        let [a, b] = [node, node + 1].map(|i| self.values[i].as_dvec3());
        a.lerp(b, place - node as f64)
    }

    /// The angle θ of a node [radians].
    fn angle(node: usize) -> f64 {
        let z = node as f64 / (Self::NODES - 1) as f64;
        4.0 * (z * z * std::f64::consts::FRAC_1_SQRT_2).asin()
    }

    /// What each node's value counts in the integral over the sphere [sr]: exact for what is linear between nodes.
    fn weights() -> impl Iterator<Item = f64> {
        (0..Self::NODES).map(|node| {
            let before = node.checked_sub(1).map_or(0.0, |cell| Self::parts(cell)[1]);
            let after = if node + 1 < Self::NODES { Self::parts(node)[0] } else { 0.0 };
            before + after
        })
    }

    /// The integral over a cell between two nodes is the sum of their values times these [sr].
    pub fn parts(cell: usize) -> [f64; 2] {
        let step = 1.0 / (Self::NODES - 1) as f64;
        let [a, b] = [cell, cell + 1].map(|i| i as f64 * step);
        // ∫ share dz
        let integral = |z: f64| z.powi(5) * (2.0 / 5.0 - z.powi(4) / 9.0);
        // By parts, ∫ (z − a)/(b − a) dshare = share(b) − ∫ share dz/(b − a).
        let mean = (integral(b) - integral(a)) / step;
        let sphere = 4.0 * std::f64::consts::PI;
        [sphere * (mean - Self::share(a)), sphere * (Self::share(b) - mean)]
    }
}
