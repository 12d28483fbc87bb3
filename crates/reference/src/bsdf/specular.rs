//! Mirrors, and Fresnel's smooth dielectrics.

use glam::DVec3;

use super::Sample;
use crate::Random;

/// The mirrored direction; `None` where the normal is turned away.
pub(super) fn reflected(view: DVec3, normal: DVec3) -> Option<DVec3> {
    let cosine = normal.dot(view);
    (cosine > 0.0).then(|| (normal * (2.0 * cosine) - view).normalize())
}

/// Reflection or refraction, with the probability of each. What is refracted is radiance, of which L/n² stays the same.
pub(super) fn sample(eta: f64, view: DVec3, normal: DVec3, rng: &mut Random) -> Option<Sample> {
    let reflected = reflected(view, normal)?;
    let cosine = normal.dot(view);
    let (reflectance, beyond) = fresnel(eta, cosine);
    if rng.uniform() < reflectance {
        return Some(Sample { towards: reflected, weight: DVec3::ONE, density: None });
    }
    let towards = (normal * (cosine / eta - beyond) - view / eta).normalize();
    Some(Sample { towards, weight: DVec3::splat(1.0 / (eta * eta)), density: None })
}

/// Fresnel's reflectance of unpolarised light, and the cosine of the refracted direction, 0 where all is reflected.
pub(super) fn fresnel(eta: f64, cosine: f64) -> (f64, f64) {
    let square = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
    if square <= 0.0 {
        return (1.0, 0.0);
    }
    let beyond = square.sqrt();
    let parallel = (eta * cosine - beyond) / (eta * cosine + beyond);
    let perpendicular = (cosine - eta * beyond) / (cosine + eta * beyond);
    (0.5 * (parallel * parallel + perpendicular * perpendicular), beyond)
}

#[cfg(test)]
mod test {
    use super::*;

    /// Normal incidence ((η − 1)/(η + 1))², Brewster's angle without the parallel part, and the critical angle.
    #[test]
    fn fresnel_at_known_angles() {
        let (straight, beyond) = fresnel(1.5, 1.0);
        assert!((straight - 0.04).abs() < 1e-15 && beyond == 1.0);
        // tanθ = η: what is left is half the perpendicular part, ((1 − η²)/(1 + η²))².
        let (brewster, _) = fresnel(1.5, 1.0 / 3.25f64.sqrt());
        assert!((brewster - 0.5 * (1.25f64 / 3.25).powi(2)).abs() < 1e-15);
        let critical = (1.0f64 - 1.0 / 2.25).sqrt();
        assert_eq!(fresnel(1.0 / 1.5, critical - 1e-9).0, 1.0);
        assert!(fresnel(1.0 / 1.5, critical + 1e-9).0 < 1.0);
        // The same from both sides.
        let (there, beyond) = fresnel(1.5, 0.3);
        assert!((fresnel(1.0 / 1.5, beyond).0 - there).abs() < 1e-14);
        assert!(fresnel(1.0, 0.3).0 < 1e-30);
    }

    /// Snell's law: the sine beyond is that before over η.
    #[test]
    fn refraction_bends() {
        let view = DVec3::new(0.6, 0.0, 0.8);
        let refracted = (0..20).filter_map(|i| sample(1.5, view, DVec3::Z, &mut Random::new(1, i, 0)));
        let refracted = refracted.filter(|sample| sample.towards.z < 0.0).last().unwrap();
        assert!((refracted.towards.x + 0.4).abs() < 1e-15);
        assert_eq!(refracted.weight, DVec3::splat(1.0 / 2.25));
        assert_eq!(sample(1.5, -view, DVec3::Z, &mut Random::new(1, 0, 0)), None);
    }
}
