//! The metallic-roughness model [glTF2, B]: facets with the normals of Trowbridge and Reitz, over a diffuse base.

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use glam::DVec3;

use super::cosine_direction;
use crate::Random;

/// What the model is made of, at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rough {
    base: DVec3,
    metallic: f64,
    alpha: f64,
}

/// The reflectance of a dielectric at normal incidence.
const DIELECTRIC: f64 = 0.04;

impl Rough {
    /// Base colour and metallic, both from 0 to 1; the square of the roughness is α, at least 0.001.
    pub fn new(base: DVec3, metallic: f64, roughness: f64) -> Self {
        Self { base, metallic, alpha: (roughness * roughness).max(0.001) }
    }

    /// [sr⁻¹]; both directions on the normal's side, but that from behind it the base is seen yet no facet.
    #[inline]
    pub(super) fn value(&self, view: DVec3, towards: DVec3, normal: DVec3) -> DVec3 {
        let half = (view + towards).normalize_or_zero();
        let fifth = fifth(view.dot(half));
        let dielectric = DIELECTRIC + (1.0 - DIELECTRIC) * fifth;
        let base = self.base * ((1.0 - self.metallic) * (1.0 - dielectric) * FRAC_1_PI);
        let (nv, nl) = (normal.dot(view), normal.dot(towards));
        if nv <= 0.0 {
            return base;
        }
        let metal = self.base + (1.0 - self.base) * fifth;
        // G/(4 n·l n·v) of Smith's height-correlated G [Heitz14].
        let visible = 0.5 / (nl * self.slant(nv) + nv * self.slant(nl));
        let facets = self.facets(normal.dot(half)) * visible;
        base + (metal * self.metallic + (1.0 - self.metallic) * dielectric) * facets
    }

    /// The density of [`Rough::sample`] [sr⁻¹].
    #[inline]
    pub(super) fn pdf(&self, view: DVec3, towards: DVec3, normal: DVec3) -> f64 {
        let (nv, nl) = (normal.dot(view), normal.dot(towards));
        let facet = self.facet_chance(nv);
        let mut density = (1.0 - facet) * nl.max(0.0) * FRAC_1_PI;
        if facet > 0.0 {
            // G₁ D/(4 n·v) [Heitz18], with G₁ = 2 n·v/(n·v + √(α² + (1 − α²)(n·v)²)).
            let half = (view + towards).normalize_or_zero();
            density += facet * self.facets(normal.dot(half)) / (2.0 * (nv + self.slant(nv)));
        }
        density
    }

    /// A direction from the base, or from a facet that is seen [Dupuy23]; it may lie behind the normal.
    #[inline]
    pub(super) fn sample(&self, view: DVec3, normal: DVec3, rng: &mut Random) -> DVec3 {
        if rng.uniform() >= self.facet_chance(normal.dot(view)) {
            return cosine_direction(normal, rng);
        }
        let (x, y) = normal.any_orthonormal_pair();
        let stretch = DVec3::new(self.alpha, self.alpha, 1.0);
        let seen = (DVec3::new(x.dot(view), y.dot(view), normal.dot(view)) * stretch).normalize();
        let (sin_phi, cos_phi) = (TAU * rng.uniform()).sin_cos();
        let z = (1.0 - rng.uniform()) * (1.0 + seen.z) - seen.z;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let cap = DVec3::new(radius * cos_phi, radius * sin_phi, z) + seen;
        let facet = (DVec3::new(cap.x, cap.y, cap.z.max(0.0)) * stretch).normalize_or(DVec3::Z);
        let half = x * facet.x + y * facet.y + normal * facet.z;
        (half * (2.0 * half.dot(view)) - view).normalize()
    }

    /// The probability that a facet is sampled, and not the base: about their shares of the light.
    #[inline]
    fn facet_chance(&self, nv: f64) -> f64 {
        if nv <= 0.0 {
            return 0.0;
        }
        let fifth = fifth(nv);
        let dielectric = DIELECTRIC + (1.0 - DIELECTRIC) * fifth;
        let base = self.base.max_element();
        let facets = self.metallic * (base + (1.0 - base) * fifth) + (1.0 - self.metallic) * dielectric;
        let diffuse = (1.0 - self.metallic) * (1.0 - dielectric) * base;
        if diffuse > 0.0 { facets / (facets + diffuse) } else { 1.0 }
    }

    /// The distribution D of facets' normals [sr⁻¹].
    #[inline]
    fn facets(&self, nh: f64) -> f64 {
        let square = self.alpha * self.alpha;
        let spread = (1.0 - nh * nh).max(0.0) + nh * nh * square;
        if nh > 0.0 { square / (PI * spread * spread) } else { 0.0 }
    }

    /// √(α² + (1 − α²)c²).
    #[inline]
    fn slant(&self, cosine: f64) -> f64 {
        let square = self.alpha * self.alpha;
        (square + (1.0 - square) * cosine * cosine).sqrt()
    }
}

/// (1 − c)⁵ [Schlick94].
#[inline]
fn fifth(cosine: f64) -> f64 {
    let x = (1.0 - cosine).clamp(0.0, 1.0);
    x * x * x * x * x
}
