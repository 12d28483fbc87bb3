//! Phase functions in the form that renderers evaluate: what a scene states, resolved once when it is loaded.

mod droplets;
mod mie;
mod table;
#[cfg(test)]
mod test;

use std::sync::Arc;

use glam::DVec3;

pub use table::PhaseTable;

use crate::FieldError;
use crate::description::{Angle, Phase, Relative};

/// A phase function [sr⁻¹], normalised over the sphere; the formulas stand at [`Phase`].
#[derive(Clone, Debug, PartialEq)]
pub enum PhaseFunction {
    /// The same in all directions.
    Isotropic,
    /// Rayleigh's.
    Rayleigh,
    /// Henyey–Greenstein's.
    HenyeyGreenstein {
        /// Mean cosine.
        g: f64,
    },
    /// Draine's; with α = 1 Cornette–Shanks'.
    Draine {
        /// Forward for g > 0.
        g: f64,
        /// The weight of cos²θ.
        alpha: f64,
    },
    /// (1 − w_d)·Henyey–Greenstein(g_hg) + w_d·Draine(g_d, α).
    Blend(Blend),
    /// Values at nodes, by channel.
    Table(Arc<PhaseTable>),
}

/// A mixture of Henyey–Greenstein's and Draine's phase functions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// Mean cosine of the Henyey–Greenstein part.
    pub g_hg: f64,
    /// The g of Draine's part.
    pub g_d: f64,
    /// The α of Draine's part.
    pub alpha: f64,
    /// The share of Draine's part.
    pub w_d: f64,
}

impl PhaseFunction {
    /// Resolves what a scene states, `path` being where; a Mie phase function takes up to some seconds.
    ///
    /// # Errors
    /// Fields that contradict each other, and a table of which nothing is left at the nodes.
    pub fn new(phase: &Phase, path: &str) -> Result<Self, FieldError> {
        phase.check(path)?;
        Ok(match phase {
            Phase::Isotropic => Self::Isotropic,
            Phase::Rayleigh => Self::Rayleigh,
            &Phase::Hg { g } => Self::HenyeyGreenstein { g: g.into() },
            &Phase::CornetteShanks { g } => Self::Draine { g: g.into(), alpha: 1.0 },
            &Phase::Draine { g, alpha } => Self::Draine { g: g.into(), alpha: alpha.into() },
            &Phase::Droplets { diameter } => Self::Blend(droplets::fit(diameter.into())),
            Phase::Tabulated { angles, values } => {
                let table = PhaseTable::new(|theta| interpolated(angles, values, theta.to_degrees()));
                let table = table.ok_or_else(|| FieldError {
                    path: format!("{path}.tabulated.values"),
                    found: "a channel that is 0 wherever light goes".into(),
                    accepted: "in each channel values > 0 over more than a tenth of a degree".into(),
                })?;
                Self::Table(Arc::new(table))
            }
            Phase::Mie(mie) => {
                let table = PhaseTable::new(mie::intensity(mie)).ok_or_else(|| FieldError {
                    path: format!("{path}.mie"),
                    found: "spheres that scatter too little to be computed".into(),
                    accepted: "a larger radius, or an index further from 1".into(),
                })?;
                Self::Table(Arc::new(table))
            }
        })
    }
}

/// Linear between angles [degrees] in ascending order, constant beyond them.
fn interpolated(angles: &[Angle], values: &[Relative], theta: f64) -> DVec3 {
    let after = angles.partition_point(|angle| f64::from(angle.0) <= theta);
    let (before, after) = (after.saturating_sub(1), after.min(angles.len() - 1));
    let [a, b] = [before, after].map(|i| values[i].0.as_dvec3());
    let [low, high] = [before, after].map(|i| f64::from(angles[i].0));
    if low < high { a.lerp(b, ((theta - low) / (high - low)).clamp(0.0, 1.0)) } else { a }
}
