//! How surfaces scatter light: value, sampler, and the sampler's density.
//!
//! `view` and `towards` are unit vectors away from the surface, to the eye and to where light comes from; `normal` is the unit
//! normal for shading, on the eye's side. What the shape itself says, that nothing is reflected through it, stands with
//! the spots where paths meet it.

mod rough;
mod specular;

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;
pub use rough::Rough;

use crate::Random;

/// A surface's scattering at a point, all textures looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// reflectance/π.
    Lambert {
        /// The share of light that is reflected.
        reflectance: DVec3,
    },
    /// The metallic-roughness model of glTF 2.0.
    Rough(Rough),
    /// A mirror.
    Mirror {
        /// The share of light that is reflected.
        reflectance: DVec3,
    },
    /// A smooth dielectric.
    Dielectric {
        /// The refractive index beyond the surface over that on the eye's side.
        eta: f64,
    },
}

/// A direction that a path goes on in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Where light comes from; a unit vector.
    pub towards: DVec3,
    /// Value times cosine over density; of a specular direction, what the light from there counts.
    pub weight: DVec3,
    /// With which the direction was chosen [sr⁻¹]; `None` of a specular one.
    pub density: Option<f64>,
}

impl Bsdf {
    /// Whether light goes only in directions of its own, so that no lamp can be sought.
    pub fn is_specular(&self) -> bool {
        matches!(self, Self::Mirror { .. } | Self::Dielectric { .. })
    }

    /// The bidirectional scattering distribution [sr⁻¹], without specular directions.
    #[inline]
    pub fn value(&self, view: DVec3, towards: DVec3, normal: DVec3) -> DVec3 {
        match self {
            _ if normal.dot(towards) <= 0.0 => DVec3::ZERO,
            Self::Lambert { reflectance } => reflectance * FRAC_1_PI,
            Self::Rough(rough) => rough.value(view, towards, normal),
            Self::Mirror { .. } | Self::Dielectric { .. } => DVec3::ZERO,
        }
    }

    /// The density with which [`Bsdf::sample`] chooses a direction that is not specular [sr⁻¹].
    #[inline]
    pub fn pdf(&self, view: DVec3, towards: DVec3, normal: DVec3) -> f64 {
        let cosine = normal.dot(towards);
        match self {
            _ if cosine <= 0.0 => 0.0,
            Self::Lambert { .. } => cosine * FRAC_1_PI,
            Self::Rough(rough) => rough.pdf(view, towards, normal),
            Self::Mirror { .. } | Self::Dielectric { .. } => 0.0,
        }
    }

    /// A random direction for a path to go on in; `None` where it ends.
    #[inline]
    pub fn sample(&self, view: DVec3, normal: DVec3, rng: &mut Random) -> Option<Sample> {
        match self {
            Self::Lambert { reflectance } => {
                let towards = cosine_direction(normal, rng);
                let density = normal.dot(towards) * FRAC_1_PI;
                (density > 0.0).then_some(Sample { towards, weight: *reflectance, density: Some(density) })
            }
            Self::Rough(rough) => {
                let towards = rough.sample(view, normal, rng);
                let (density, cosine) = (rough.pdf(view, towards, normal), normal.dot(towards));
                if cosine <= 0.0 || density <= 0.0 {
                    return None;
                }
                let weight = rough.value(view, towards, normal) * (cosine / density);
                Some(Sample { towards, weight, density: Some(density) })
            }
            Self::Mirror { reflectance } => {
                let towards = specular::reflected(view, normal)?;
                Some(Sample { towards, weight: *reflectance, density: None })
            }
            Self::Dielectric { eta } => specular::sample(*eta, view, normal, rng),
        }
    }
}

/// A random direction on the normal's side, its density cosθ/π.
pub fn cosine_direction(normal: DVec3, rng: &mut Random) -> DVec3 {
    let (square, phi) = (rng.uniform(), TAU * rng.uniform());
    let (x, y) = normal.any_orthonormal_pair();
    let (sin_phi, cos_phi) = phi.sin_cos();
    let sine = square.sqrt();
    (x * (sine * cos_phi) + y * (sine * sin_phi) + normal * (1.0 - square).sqrt()).normalize()
}
