use super::*;

/// A generator of standard normal numbers: twelve uniforms less six.
struct Normal(u64);

impl Normal {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// An image of mean `mean` and given noise, with the true variance.
fn noisy(size: (u32, u32), mean: f32, variance: f32, samples: u32, seed: u64) -> Image {
    let (width, height) = size;
    let count = (width * height) as usize;
    let mut normal = Normal(seed);
    let sigma = f64::from(variance / samples as f32).sqrt();
    let mut value = || mean + (sigma * normal.next()) as f32;
    Image {
        width,
        height,
        pixels: (0..count).map(|_| [value(), value(), value()]).collect(),
        statistics: Some(Statistics { variance: vec![[variance; 3]; count], samples: vec![samples; count] }),
        ..Image::default()
    }
}

#[test]
fn two_estimates_of_one_thing_pass() {
    for (seed, block) in [(1, 1), (2, 4), (3, 8), (4, 1000)] {
        let (a, b) = (noisy((61, 43), 1.0, 4.0, 16, seed), noisy((61, 43), 1.0, 2.0, 64, seed + 100));
        let test = z_test(&a, &b, block).unwrap();
        assert!(test.pass, "{test:?}");
        if test.tests > 100 {
            assert!((test.mean_z_squared.unwrap() - 1.0).abs() < 0.3, "{test:?}");
        }
    }
}

#[test]
fn a_small_bias_is_found() {
    // 15 % of bias in one channel under 50 % of noise a pixel, which a block of 32² brings to 1.6 %.
    let a = noisy((256, 256), 1.0, 4.0, 16, 1);
    let mut b = noisy((256, 256), 1.0, 4.0, 16, 2);
    assert!(z_test(&a, &b, 32).unwrap().pass);
    for pixel in &mut b.pixels[..256 * 64] {
        pixel[1] *= 1.15;
    }
    let test = z_test(&a, &b, 32).unwrap();
    assert!(!test.pass && test.y < 64 && test.min_p < test.threshold_p, "{test:?}");
}

#[test]
fn underestimated_variance_is_found() {
    let (mut a, b) = (noisy((64, 64), 1.0, 4.0, 16, 1), noisy((64, 64), 1.0, 4.0, 16, 2));
    a.statistics = b.statistics.clone().map(|s| Statistics { variance: vec![[0.0; 3]; s.samples.len()], ..s });
    let test = z_test(&a, &b, 8).unwrap();
    assert!(test.mean_z_squared.unwrap() > 1.5, "{test:?}");
}

#[test]
fn z_is_the_formula() {
    let mut a = noisy((1, 1), 0.0, 0.08, 4, 1);
    let mut b = noisy((1, 1), 0.0, 0.32, 16, 2);
    (a.pixels, b.pixels) = (vec![[1.4, 1.0, 1.0]], vec![[1.0; 3]]);
    let test = z_test(&a, &b, 1).unwrap();
    // √(0.02 + 0.02) = 0.2
    assert!((test.max_z - 2.0).abs() < 1e-3, "{test:?}");
    assert!((test.min_p - 0.0455).abs() < 1e-4);
    assert!((test.mean_z_squared.unwrap() - 4.0 / 3.0).abs() < 1e-3);
    assert_eq!(test.tests, 3);
    assert!((test.threshold_p - (1.0 - 0.99f64.powf(1.0 / 3.0))).abs() < 1e-15);
}

#[test]
fn without_noise_only_rounding_passes() {
    let a = noisy((5, 5), 3.0, 0.0, 16, 1);
    let mut b = a.clone();
    b.pixels[7][2] *= 1.0 + 0.5e-5;
    let test = z_test(&a, &b, 1).unwrap();
    assert!(test.pass && test.max_z == 0.0 && test.mean_z_squared.is_none());
    b.pixels[7][2] *= 1.0 + 3e-5;
    let test = z_test(&a, &b, 1).unwrap();
    assert!(!test.pass && test.max_z == f64::INFINITY && test.min_p == 0.0);
    assert_eq!((test.x, test.y), (2, 1));
}

#[test]
fn partial_blocks_count() {
    let a = noisy((17, 9), 1.0, 1.0, 1, 1);
    let mut b = noisy((17, 9), 1.0, 1.0, 1, 2);
    assert_eq!(z_test(&a, &b, 8).unwrap().tests, 3 * 2 * 3);
    b.pixels[17 * 9 - 1][0] += 100.0;
    let test = z_test(&a, &b, 8).unwrap();
    assert_eq!((test.pass, test.x, test.y), (false, 16, 8));
}

#[test]
fn erfc_is_accurate() {
    // C library of the GNU project, correctly rounded to within one unit in the last place.
    for (x, expected) in [
        (0.0, 1.0),
        (0.5, 0.479_500_122_186_953_5),
        (1.0, 0.157_299_207_050_285_13),
        (2.0, 4.677_734_981_047_265e-3),
        (3.0, 2.209_049_699_858_544e-5),
        (5.0, 1.537_459_794_428_035e-12),
        (10.0, 2.088_487_583_762_545e-45),
    ] {
        assert!((erfc(x) / expected - 1.0f64).abs() < 1e-12, "{x}: {} {expected}", erfc(x));
    }
    assert!((erfc(2.0 - 1e-13) / erfc(2.0) - 1.0).abs() < 1e-10, "the two branches must meet");
    assert_eq!(erfc(f64::INFINITY), 0.0);
}

#[test]
fn quantiles_are_those_of_the_tables() {
    for (p, z) in [(0.05, 1.959_963_985), (0.01, 2.575_829_304), (1e-6, 4.891_638_475)] {
        assert!((z_of_p(p) - z).abs() < 1e-8, "{p}: {}", z_of_p(p));
        assert!((p_of_z(z) / p - 1.0).abs() < 1e-7);
    }
}
