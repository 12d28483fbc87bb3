use super::*;

/// Largest difference from NVIDIA's implementation in any pixel. Both work in f32; theirs rounds the colour matrices to
/// four or five digits.
const TOLERANCE: f32 = 2e-4;

type Codes = Vec<[u8; 3]>;

fn decoded(codes: &Codes) -> Vec<[f32; 3]> {
    codes.iter().map(|p| p.map(|c| f32::from(c) / 255.0)).collect()
}

fn agrees(name: &str, a: &Codes, b: &Codes, width: usize, pixels_per_degree: f32) {
    let (w, h) = (width as u32, (a.len() / width) as u32);
    let theirs = |codes: &Codes| nv_flip::FlipImageRgb8::with_data(w, h, codes.as_flattened());
    let expected = nv_flip::flip(theirs(b), theirs(a), pixels_per_degree).to_vec();
    let found = flip(&decoded(a), &decoded(b), width, pixels_per_degree);
    assert_eq!(found.len(), expected.len());
    let worst = found.iter().zip(&expected).map(|(f, e)| (f - e).abs()).fold(0.0, f32::max);
    assert!(worst < TOLERANCE, "{name}: a pixel differs by {worst}");
    assert!((mean(&found) - mean(&expected)).abs() < 5e-5, "{name}: {} {}", mean(&found), mean(&expected));
    assert!(mean(&expected) > 1e-3, "{name}: the images should differ visibly");
}

fn random(count: usize, mut seed: u32) -> Codes {
    let mut next = || {
        seed = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (seed >> 24) as u8
    };
    (0..count).map(|_| [next(), next(), next()]).collect()
}

fn drawn(width: usize, height: usize, colour: impl Fn(usize, usize) -> [u8; 3]) -> Codes {
    (0..width * height).map(|i| colour(i % width, i / width)).collect()
}

#[test]
fn random_images_agree_with_nv_flip() {
    for (width, height) in [(64, 48), (7, 33), (1, 1), (3, 2)] {
        let count = width * height;
        agrees("random", &random(count, 1), &random(count, 2), width, PIXELS_PER_DEGREE);
    }
}

#[test]
fn gradients_agree_with_nv_flip() {
    let a = drawn(96, 40, |x, y| [(x * 2) as u8, (y * 6) as u8, 128]);
    let b = drawn(96, 40, |x, y| [(x * 2 + 20) as u8, (y * 5) as u8, 90]);
    agrees("gradient", &a, &b, 96, PIXELS_PER_DEGREE);
}

#[test]
fn shifted_edges_agree_with_nv_flip() {
    let edge = |at: usize| drawn(64, 64, move |x, y| if x + y / 3 < at { [240, 20, 10] } else { [10, 60, 250] });
    for shift in [1, 2, 9] {
        agrees("edge", &edge(30), &edge(30 + shift), 64, PIXELS_PER_DEGREE);
    }
}

#[test]
fn saturated_colours_agree_with_nv_flip() {
    let colours = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255], [0, 0, 0], [255, 255, 0]];
    let a = drawn(60, 60, |x, y| colours[(x / 10 + y / 10) % 6]);
    let b = drawn(60, 60, |x, y| colours[(x / 10 + y / 20 + 1) % 6]);
    agrees("colours", &a, &b, 60, PIXELS_PER_DEGREE);
}

#[test]
fn other_viewing_distances_agree_with_nv_flip() {
    let (a, b) = (random(50 * 40, 5), random(50 * 40, 6));
    for pixels_per_degree in [10.0, 30.0, 120.0] {
        agrees("distance", &a, &b, 50, pixels_per_degree);
    }
}

#[test]
fn equal_images_have_no_error() {
    let image = decoded(&random(40 * 30, 3));
    assert!(flip(&image, &image, 40, PIXELS_PER_DEGREE).iter().all(|&e| e == 0.0));
}

#[test]
fn the_largest_error_is_one() {
    let plain = |colour: [f32; 3]| vec![colour; 900];
    let error = |a, b| mean(&flip(&plain(a), &plain(b), 30, PIXELS_PER_DEGREE));
    assert!((error([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]) - 1.0).abs() < 1e-3);
    let black_white = error([0.0; 3], [1.0; 3]);
    assert!((0.95..1.0).contains(&black_white), "{black_white}");
}

#[test]
fn percentiles_are_of_the_sorted_errors() {
    let errors: Vec<f32> = (1..=200).rev().map(|i| i as f32).collect();
    assert_eq!(percentile(&errors, 0.99), 198.0);
    assert_eq!(percentile(&errors, 0.5), 100.0);
    assert_eq!(percentile(&errors, 0.0), 1.0);
    assert_eq!(percentile(&[7.0], 0.99), 7.0);
    assert_eq!(mean(&[1.0, 2.0]), 1.5);
}
