//! Phase functions: which way scattered light goes.
//!
//! θ is the angle between the directions of travel before and after scattering, so cosθ = 1 is straight on. All are
//! symmetric under reversal of the path, so a path may be followed from the eye.

use std::f64::consts::{FRAC_1_PI, TAU};
use std::sync::Arc;

use glam::DVec3;
use tyndall_scene::phase::{Blend, PhaseFunction, PhaseTable};

use crate::Random;

/// A phase function made ready for sampling.
#[derive(Clone, Debug)]
pub enum Phase {
    /// One that is the same in all channels.
    Grey(PhaseFunction),
    /// Values at nodes.
    Table(Table),
}

impl Phase {
    /// Prepares a phase function: sums up a table's cells.
    pub fn new(function: &PhaseFunction) -> Self {
        match function {
            PhaseFunction::Table(table) => Self::Table(Table::new(table.clone())),
            grey => Self::Grey(grey.clone()),
        }
    }

    /// Whether it is the same in all channels.
    pub fn is_grey(&self) -> bool {
        matches!(self, Self::Grey(_))
    }

    /// The density of scattering by an angle [sr⁻¹], by channel; its integral over the sphere is 1.
    #[inline]
    pub fn pdf(&self, cos_theta: f64) -> DVec3 {
        match self {
            Self::Grey(function) => DVec3::splat(grey(function, cos_theta)),
            Self::Table(table) => table.values.value(cos_theta),
        }
    }

    /// The cosine of a random scattering angle, distributed as a channel of [`Phase::pdf`].
    #[inline]
    pub fn sample_cosine(&self, channel: usize, rng: &mut Random) -> f64 {
        match self {
            Self::Grey(function) => grey_cosine(function, rng),
            Self::Table(table) => table.cosine(channel, rng),
        }
    }

    /// A random direction after scattering in a channel, for one of travel `direction` before; both unit vectors.
    #[inline]
    pub fn sample(&self, channel: usize, direction: DVec3, rng: &mut Random) -> DVec3 {
        let cos_theta = self.sample_cosine(channel, rng);
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * rng.uniform()).sin_cos();
        let (x, y) = direction.any_orthonormal_pair();
        (x * (sin_theta * cos_phi) + y * (sin_theta * sin_phi) + direction * cos_theta).normalize()
    }
}

fn grey(function: &PhaseFunction, cos_theta: f64) -> f64 {
    match function {
        PhaseFunction::Rayleigh => 3.0 / 16.0 * FRAC_1_PI * (1.0 + cos_theta * cos_theta),
        &PhaseFunction::HenyeyGreenstein { g } => henyey_greenstein(g, cos_theta),
        &PhaseFunction::Draine { g, alpha } => draine(g, alpha, cos_theta),
        &PhaseFunction::Blend(Blend { g_hg, g_d, alpha, w_d }) => {
            (1.0 - w_d) * henyey_greenstein(g_hg, cos_theta) + w_d * draine(g_d, alpha, cos_theta)
        }
        PhaseFunction::Isotropic | PhaseFunction::Table(_) => 0.25 * FRAC_1_PI,
    }
}

/// [Henyey41]; (1 − g)² + 2g(1 − cosθ) = 1 + g² − 2g cosθ, without cancellation.
fn henyey_greenstein(g: f64, cos_theta: f64) -> f64 {
    let d = (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cos_theta);
    0.25 * FRAC_1_PI * (1.0 - g * g) / (d * d.sqrt())
}

/// [Draine03]; with α = 1 [Cornette92].
fn draine(g: f64, alpha: f64, cos_theta: f64) -> f64 {
    let norm = 1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0;
    henyey_greenstein(g, cos_theta) * (1.0 + alpha * cos_theta * cos_theta) / norm
}

fn grey_cosine(function: &PhaseFunction, rng: &mut Random) -> f64 {
    match function {
        PhaseFunction::Rayleigh => {
            // The real root of μ³ + 3μ = 4s, by Cardano [Frisvad11].
            let s = 2.0 * rng.uniform() - 1.0;
            let a = (2.0 * s + (1.0 + 4.0 * s * s).sqrt()).cbrt();
            (a - 1.0 / a).clamp(-1.0, 1.0)
        }
        &PhaseFunction::HenyeyGreenstein { g } => henyey_greenstein_cosine(g, rng),
        &PhaseFunction::Draine { g, alpha } => draine_cosine(g, alpha, rng),
        &PhaseFunction::Blend(Blend { g_hg, g_d, alpha, w_d }) => {
            if rng.uniform() < w_d {
                draine_cosine(g_d, alpha, rng)
            } else {
                henyey_greenstein_cosine(g_hg, rng)
            }
        }
        PhaseFunction::Isotropic | PhaseFunction::Table(_) => 2.0 * rng.uniform() - 1.0,
    }
}

fn henyey_greenstein_cosine(g: f64, rng: &mut Random) -> f64 {
    // [Witt77], (1 + g² − ((1−g²)/(1+gs))²)/2g, multiplied out so that nothing is divided by g.
    let s = 2.0 * rng.uniform() - 1.0;
    let d = 1.0 + g * s;
    let numerator = 2.0 * s * (1.0 + g * g) + g * (3.0 - g * g + s * s * (1.0 + g * g));
    (numerator / (2.0 * d * d)).clamp(-1.0, 1.0)
}

/// By rejection from Henyey–Greenstein's, of which it is a multiple of 1 + α cos²θ: a third or more are accepted. The
/// inverse of its distribution [Jendersie23] divides by g and by α.
fn draine_cosine(g: f64, alpha: f64, rng: &mut Random) -> f64 {
    loop {
        let cos_theta = henyey_greenstein_cosine(g, rng);
        if rng.uniform() * (1.0 + alpha) < 1.0 + alpha * cos_theta * cos_theta {
            return cos_theta;
        }
    }
}

/// A [`PhaseTable`] with the probabilities of its cells.
#[derive(Clone, Debug)]
pub struct Table {
    values: Arc<PhaseTable>,
    /// The probability of each cell and all before it.
    cumulative: Vec<DVec3>,
}

impl Table {
    fn new(values: Arc<PhaseTable>) -> Self {
        let cells = values.values().windows(2).enumerate();
        let cumulative = cells.scan(DVec3::ZERO, |sum, (cell, ends)| {
            let [a, b] = PhaseTable::parts(cell);
            *sum += ends[0].as_dvec3() * a + ends[1].as_dvec3() * b;
            Some(*sum)
        });
        Self { cumulative: cumulative.collect(), values }
    }

    /// A cell by its probability; within it, a point of its ring of the sphere by rejection. At least half are accepted,
    /// but for a front cell's 1/5.
    fn cosine(&self, channel: usize, rng: &mut Random) -> f64 {
        let last = self.cumulative.len() - 1;
        let u = rng.uniform() * self.cumulative[last][channel];
        let cell = self.cumulative.partition_point(|sum| sum[channel] <= u).min(last);
        let [a, b] = [cell, cell + 1].map(|i| i as f64 / (PhaseTable::NODES - 1) as f64);
        let [share_a, share_b] = [a, b].map(PhaseTable::share);
        let [p, q] = [cell, cell + 1].map(|i| f64::from(self.values.values()[i][channel]));
        loop {
            let cos_theta = 1.0 - 2.0 * (share_a + (share_b - share_a) * rng.uniform());
            let value = p + (q - p) * (PhaseTable::coordinate(cos_theta) - a) / (b - a);
            if rng.uniform() * p.max(q) <= value {
                return cos_theta;
            }
        }
    }
}
