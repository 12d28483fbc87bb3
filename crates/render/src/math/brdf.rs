//! The Rust twin of `brdf.wesl`: what surfaces reflect, in double precision.

use std::f64::consts::PI;

use glam::DVec3;

/// A material at a point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brdf {
    /// 0: Lambert, 1: metallic-roughness, 2: mirror, 3: dielectric.
    pub kind: u32,
    /// The reflectance of a diffuse base or a mirror; of a metal at normal incidence.
    pub base: DVec3,
    /// From dielectric, 0, to metal, 1.
    pub metallic: f64,
    /// The width of the facets' distribution, roughness², at least 0.001.
    pub alpha: f64,
}

impl Brdf {
    /// The BRDF [sr⁻¹] for unit vectors towards the light and the viewer and the unit normal; 0 where one of them is behind
    /// it, and for what reflects like a mirror.
    pub fn value(&self, normal: DVec3, light: DVec3, viewer: DVec3) -> DVec3 {
        let (n_l, n_v) = (normal.dot(light), normal.dot(viewer));
        if n_l <= 0.0 || self.kind > 1 {
            return DVec3::ZERO;
        }
        if self.kind == 0 {
            return self.base / PI;
        }
        let h = (light + viewer).normalize();
        let squared = self.alpha * self.alpha;
        // [glTF2, B.3]
        let d = squared / (PI * (normal.dot(h).powi(2) * (squared - 1.0) + 1.0).powi(2));
        // [Heitz14 (99)]
        let lambda = |n_x: f64| (squared + (1.0 - squared) * n_x * n_x).sqrt();
        let v = if n_v > 0.0 { 0.5 / (n_v * lambda(n_l) + n_l * lambda(n_v)) } else { 0.0 };
        let grazing = (1.0 - viewer.dot(h)).max(0.0).powi(5);
        let metal = (self.base + (1.0 - self.base) * grazing) * d * v;
        let f = 0.04 + 0.96 * grazing;
        let dielectric = (1.0 - f) * self.base / PI + f * d * v;
        dielectric.lerp(metal, self.metallic)
    }
}
