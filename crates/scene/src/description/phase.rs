use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::invalid;
use super::quantity::{
    Diameter, DraineAlpha, GeometricDeviation, MeanCosine, PolarAngle, Radius, RefractiveIndex, Rgb, Wavelengths,
};
use crate::FieldError;

/// A phase function, normalised over the sphere [sr⁻¹]; θ is the angle between the directions of travel before and
/// after scattering, so that 0 is straight on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Phase {
    /// 1/(4π).
    #[default]
    Isotropic,
    /// 3/(16π)·(1 + cos²θ): particles much smaller than the wavelength.
    Rayleigh,
    /// Henyey–Greenstein, (1 − g²)/(4π(1 + g² − 2g cosθ)^{3/2}): forward for g > 0.
    Hg {
        /// Mean cosine of θ.
        #[serde(with = "MeanCosine")]
        g: f32,
    },
    /// Cornette–Shanks, 3(1 − g²)(1 + cos²θ)/(8π(2 + g²)(1 + g² − 2g cosθ)^{3/2}): Rayleigh's for g = 0.
    CornetteShanks {
        /// Forward for g > 0; the mean cosine is 3g(4 + g²)/(5(2 + g²)).
        #[serde(with = "MeanCosine")]
        g: f32,
    },
    /// Draine, (1 − g²)(1 + α cos²θ)/(4π(1 + α(1 + 2g²)/3)(1 + g² − 2g cosθ)^{3/2}): Henyey–Greenstein's for α = 0,
    /// Cornette–Shanks' for α = 1.
    Draine {
        /// Forward for g > 0; the mean cosine is g(1 + α(3 + 2g²)/5)/(1 + α(1 + 2g²)/3).
        #[serde(with = "MeanCosine")]
        g: f32,
        /// The weight of cos²θ, α.
        #[serde(with = "DraineAlpha")]
        alpha: f32,
    },
    /// Water droplets in air: a mixture of Henyey–Greenstein's and Draine's function fitted to Mie's, for visible light.
    Droplets {
        /// The droplets' diameter [µm].
        #[serde(with = "Diameter")]
        diameter: f32,
    },
    /// Measured or computed elsewhere: values over the angle, linear between the given angles, constant before the
    /// first and after the last, and scaled so that each channel's integral over the sphere is 1.
    Tabulated {
        /// Angles θ in ascending order [degrees], at least two.
        #[schemars(length(min = 2))]
        angles: Vec<Angle>,
        /// A value for each angle, or three of them [r, g, b]; in any unit, as only their ratios count.
        #[schemars(length(min = 2))]
        values: Vec<Relative>,
    },
    /// Spheres, computed exactly from Maxwell's equations.
    Mie(Mie),
}

/// An angle θ of a table [degrees].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Angle(#[serde(with = "PolarAngle")] pub f32);

/// A phase function's value at an angle, linear Rec. 709, but for a common factor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Relative(#[serde(with = "Rgb")] pub Vec3);

/// Homogeneous spheres in a medium that does not absorb, their radii log-normally distributed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mie {
    /// Refractive index n + ik of the spheres, relative to the medium around them, as [n, k]; absorbing for k > 0.
    #[serde(with = "RefractiveIndex")]
    pub refractive_index: [f32; 2],
    /// Median radius [µm].
    #[serde(with = "Radius")]
    pub radius: f32,
    /// Geometric standard deviation of the radii: ln r is normally distributed with standard deviation ln(spread);
    /// 1 is one size.
    #[serde(with = "GeometricDeviation", default = "one")]
    pub spread: f32,
    /// Wavelengths that stand for red, green and blue, in the medium around the spheres [nm].
    #[serde(with = "Wavelengths", default = "wavelengths")]
    pub wavelengths: Vec3,
}

fn one() -> f32 {
    1.0
}

fn wavelengths() -> Vec3 {
    Vec3::new(680.0, 550.0, 440.0)
}

impl Mie {
    /// The largest size parameter 2πr/λ that is computed: beyond it, a table's nodes do not resolve the rings.
    pub const MAX_SIZE_PARAMETER: f64 = 1000.0;

    /// Standard deviation of ln r.
    pub fn deviation(&self) -> f64 {
        f64::from(self.spread).ln()
    }

    /// The least and largest radius [µm] that are taken into account: 3.5 standard deviations of ln r about its mean
    /// weighted by cross-section, 2σ² above the median. A twentieth of a percent of the area is beyond.
    pub fn radii(&self) -> [f64; 2] {
        let sigma = self.deviation();
        [-3.5, 3.5].map(|deviations| f64::from(self.radius) * (sigma * (2.0 * sigma + deviations)).exp())
    }

    /// Checks what no field can check alone.
    fn check(&self, path: &str) -> Result<(), FieldError> {
        if self.refractive_index == [1.0, 0.0] {
            let accepted = "an index other than that of the medium around, which does not scatter";
            return invalid(&format!("{path}.refractive_index"), "[1, 0]".into(), accepted);
        }
        let (largest, shortest) = (self.radii()[1], f64::from(self.wavelengths.min_element()));
        let size = std::f64::consts::TAU * largest * 1e3 / shortest;
        if size > Self::MAX_SIZE_PARAMETER {
            let found = format!(
                "{} µm with spread = {}: spheres up to {largest:.4} µm, whose size parameter 2πr/λ is {size:.0} at \
                 {shortest} nm",
                self.radius, self.spread
            );
            return invalid(&format!("{path}.radius"), found, "size parameters up to 1000; for larger ones `droplets`");
        }
        Ok(())
    }
}

impl Phase {
    /// Checks the relations between fields.
    pub(crate) fn check(&self, path: &str) -> Result<(), FieldError> {
        match self {
            Phase::Tabulated { angles, values } => {
                let path = format!("{path}.tabulated");
                if angles.len() < 2 {
                    let found = format!("{} of them", angles.len());
                    return invalid(&format!("{path}.angles"), found, "at least two angles");
                }
                if values.len() != angles.len() {
                    let found = format!("{} of them for {} angles", values.len(), angles.len());
                    return invalid(&format!("{path}.values"), found, "a value for each angle");
                }
                for (i, pair) in angles.windows(2).enumerate() {
                    if pair[0].0 >= pair[1].0 {
                        let found = format!("{} after {}", pair[1].0, pair[0].0);
                        return invalid(&format!("{path}.angles.{}", i + 1), found, "angles in ascending order");
                    }
                }
                Ok(())
            }
            Phase::Mie(mie) => mie.check(&format!("{path}.mie")),
            _ => Ok(()),
        }
    }
}
