//! The light of a black body, as a camera with the eye's colours sees it.

use std::sync::LazyLock;

use glam::{DMat3, DVec3, Vec3};

/// 2hc² [W·m²·sr⁻¹] and hc/k [m·K], from the exact constants of the SI.
const C1: f64 = 1.191_042_972_397_188e-16;
const C2: f64 = 1.438_776_877_503_933e-2;

/// Linear Rec. 709 from XYZ: the inverse of the primaries' matrix. [ITU-R BT.709-6]
const RGB_FROM_XYZ: DMat3 = DMat3::from_cols(
    DVec3::new(3.240_969_94, -0.969_243_64, 0.055_630_08),
    DVec3::new(-1.537_383_18, 1.875_967_5, -0.203_976_96),
    DVec3::new(-0.498_610_76, 0.041_555_06, 1.056_971_51),
);

/// From where to where visible light is integrated, and in what steps [nm]: with these the trapezoidal rule is within 1e-3 of
/// finer ones.
const FIRST: f64 = 360.0;
const STEP: f64 = 5.0;
const STEPS: usize = 95;

/// The temperature above which a body counts as having this one [K], lest its radiance overflow.
pub const HOTTEST: f32 = 1e6;

/// Radiance of a black body \[Planck01\], linear Rec. 709 [W·sr⁻¹·m⁻²]: X, Y, Z are the spectral radiance weighted by the CIE 1931
/// colour matching functions (so Y is luminance over 683 lm/W), which turn into red, green and blue such that Y of
/// (1, 1, 1) is 1. Blue light that would be negative (below 1900 K, more red than Rec. 709 shows) is 0. So is all light at
/// 0 K and below.
pub fn black_body(kelvin: f32) -> Vec3 {
    /// hc/(kλ) [K], and what spectral radiance at λ is weighted by times 2hc²/λ⁵.
    static WEIGHTS: LazyLock<[(f64, DVec3); STEPS]> = LazyLock::new(|| {
        std::array::from_fn(|i| {
            let nanometres = FIRST + STEP * i as f64;
            let metres = nanometres * 1e-9;
            (C2 / metres, RGB_FROM_XYZ * matching(nanometres) * (C1 / metres.powi(5) * STEP * 1e-9))
        })
    });
    if kelvin.is_nan() || kelvin <= 0.0 {
        return Vec3::ZERO;
    }
    let kelvin = f64::from(kelvin.min(HOTTEST));
    let rgb: DVec3 = WEIGHTS.iter().map(|(scale, weight)| weight / (scale / kelvin).exp_m1()).sum();
    rgb.max(DVec3::ZERO).as_vec3()
}

/// The CIE 1931 colour matching functions x̄, ȳ, z̄ at a wavelength [nm], as sums of Gaussians. [Wyman13 (4), table 1]
fn matching(nanometres: f64) -> DVec3 {
    let lobe = |weight: f64, middle: f64, below: f64, above: f64| {
        let width = if nanometres < middle { below } else { above };
        let x = (nanometres - middle) / width;
        weight * (-0.5 * x * x).exp()
    };
    DVec3::new(
        lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    )
}

#[cfg(test)]
mod test {
    use super::*;

    /// Luminance and chromaticity of colour-science 0.4.6 (`planck_law` under the tabulated CIE 1931 2° observer, 1 nm). The
    /// Gaussians of [Wyman13] are that close to the table, and less so in the far red.
    #[test]
    fn as_colour_science_has_it() {
        let xyz_from_rgb = RGB_FROM_XYZ.inverse();
        for (kelvin, luminance, [x, y], close) in [
            (2000.0, 678.873_6, [0.526_681, 0.413_296], 0.0035),
            (3000.0, 44_237.255, [0.436_935, 0.404_075], 0.0015),
            (6500.0, 4_498_268.4, [0.313_528, 0.323_630], 0.0002),
            (6504.0, 4_509_545.1, [0.313_465, 0.323_569], 0.0002),
            (10_000.0, 19_414_120.0, [0.280_634, 0.288_289], 0.0002),
        ] {
            let xyz = xyz_from_rgb * black_body(kelvin).as_dvec3();
            let sum = xyz.element_sum();
            assert!((xyz.y / luminance - 1.0).abs() < 0.004, "{kelvin} K: Y = {}", xyz.y);
            let off = [(xyz.x / sum - x).abs(), (xyz.y / sum - y).abs()];
            assert!(off[0] < close && off[1] < close, "{kelvin} K: {} {}", xyz.x / sum, xyz.y / sum);
        }
        // Beyond Rec. 709: the table gives 0.018088, 0.000156, −0.000354.
        let dull = black_body(1000.0);
        assert!((dull - Vec3::new(0.018_088, 0.000_156, 0.0)).abs().max_element() < 0.001, "{dull}");
        assert_eq!(dull.z, 0.0);
    }

    /// Near 6500 K it is white; luminance rises as exp(−hc/(kλT)) with λ near 555 nm or longer, then as T.
    #[test]
    fn from_red_to_blue() {
        let white = black_body(6504.0);
        assert!((white / white.y - Vec3::ONE).abs().max_element() < 0.07, "{white}");
        let luminance = |kelvin: f32| black_body(kelvin).dot(Vec3::new(0.2126, 0.7152, 0.0722)).ln();
        let slope = (luminance(3000.0) - luminance(2900.0)) / (3000f32.ln() - 2900f32.ln());
        // d ln B/d ln T = hc/(kλT)·(1 + 1/(e^x − 1)): 8.4 at 3000 K for 570 nm.
        assert!((slope - 8.5).abs() < 0.3, "{slope}");
        let slope = (luminance(1e6) - luminance(5e5)) / 2f32.ln();
        assert!((slope - 1.0).abs() < 0.03, "{slope}");
    }

    #[test]
    fn extremes_are_finite() {
        for kelvin in [f32::MIN, -1.0, 0.0, -0.0, f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(black_body(kelvin), Vec3::ZERO, "{kelvin}");
        }
        assert_eq!(black_body(1.0), Vec3::ZERO);
        assert_eq!(black_body(f32::INFINITY), black_body(HOTTEST));
        assert!(black_body(f32::MAX).is_finite() && black_body(f32::MIN_POSITIVE).is_finite());
    }
}
