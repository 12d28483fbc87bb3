use super::*;
use crate::image::{DisplayImage, Statistics};

fn image(width: u32, height: u32, value: f32) -> Image {
    Image { width, height, pixels: vec![[value; 3]; (width * height) as usize], ..Image::default() }
}

fn with_statistics(mut image: Image, variance: f32, samples: u32) -> Image {
    let count = image.pixels.len();
    image.statistics = Some(Statistics { variance: vec![[variance; 3]; count], samples: vec![samples; count] });
    image
}

fn compare_linear(a: Image, b: Image) -> Result<Report, MetricError> {
    compare(&Picture::Linear(a), &Picture::Linear(b), &Options::default())
}

#[test]
fn equal_images_are_equal_by_every_measure() {
    let a = with_statistics(image(20, 14, 0.3), 0.1, 16);
    let report = compare_linear(a.clone(), a).unwrap();
    let linear = report.linear.as_ref().unwrap();
    assert_eq!((linear.rmse, linear.relative_rmse, linear.relative_bias), (0.0, 0.0, Some(0.0)));
    assert_eq!(report.psnr_db, f64::INFINITY);
    assert!((report.ssim - 1.0).abs() < 1e-6);
    assert_eq!((report.flip_mean, report.flip_p99), (0.0, 0.0));
    assert!(report.z_test.as_ref().unwrap().pass);
    assert_eq!(report.flip_map.len(), 20 * 14);
    assert!(serde_json::to_string(&report).unwrap().contains("\"psnr_db\":null"));
}

#[test]
fn different_images_are_flagged_by_every_measure() {
    let a = with_statistics(image(20, 14, 0.6), 0.1, 16);
    let b = with_statistics(image(20, 14, 0.3), 0.1, 16);
    let report = compare_linear(a, b).unwrap();
    let linear = report.linear.unwrap();
    assert!((linear.rmse - 0.3).abs() < 1e-6 && (linear.relative_rmse - 1.0).abs() < 1e-6);
    assert!(linear.relative_bias.unwrap() > 0.9);
    assert!(report.psnr_db < 25.0, "{}", report.psnr_db);
    assert!(report.ssim < 0.99, "{}", report.ssim);
    assert!(report.flip_mean > 0.1 && report.flip_p99 > 0.1, "{}", report.flip_mean);
    assert!(!report.z_test.unwrap().pass);
}

#[test]
fn display_pictures_have_no_linear_measures() {
    let shown = |v: f32| Picture::Display(DisplayImage { width: 12, height: 12, pixels: vec![[v; 3]; 144] });
    let report = compare(&shown(0.5), &shown(0.6), &Options::default()).unwrap();
    assert!((report.psnr_db - 20.0).abs() < 1e-4, "{}", report.psnr_db);
    let mixed = compare(&Picture::Linear(image(12, 12, 0.18)), &shown(0.5), &Options::default()).unwrap();
    assert!(mixed.psnr_db > 40.0, "middle grey is 0.5 on the display: {}", mixed.psnr_db);
    for report in [report, mixed] {
        assert!(report.linear.is_none() && report.z_test.is_none());
    }
}

#[test]
fn the_z_test_needs_both_variances() {
    let report = compare_linear(with_statistics(image(4, 4, 1.0), 1.0, 4), image(4, 4, 1.0)).unwrap();
    assert!(report.z_test.is_none());
    let linear = report.linear.unwrap();
    assert!((linear.noise.unwrap() - 0.5).abs() < 1e-6);
    assert_eq!(linear.reference_noise, None);
}

#[test]
fn sizes_are_named() {
    let error = compare_linear(image(4, 3, 1.0), image(3, 4, 1.0)).unwrap_err().to_string();
    assert!(error.contains("4×3") && error.contains("3×4"), "{error}");
}

#[test]
fn bad_pixels_are_named() {
    for value in [f32::NAN, f32::INFINITY] {
        let mut bad = image(4, 3, 1.0);
        bad.pixels[6][1] = value;
        let error = compare_linear(image(4, 3, 1.0), bad).unwrap_err().to_string();
        assert!(error.contains("reference") && error.contains("x = 2, y = 1, channel G"), "{error}");
    }
}

#[test]
fn bad_statistics_are_named() {
    for (variance, samples) in [(f32::NAN, 4), (-1.0, 4), (f32::INFINITY, 4), (1.0, 0)] {
        let mut bad = with_statistics(image(4, 3, 1.0), 1.0, 4);
        let statistics = bad.statistics.as_mut().unwrap();
        statistics.variance[9][0] = variance;
        statistics.samples[9] = samples;
        let error = compare_linear(bad, image(4, 3, 1.0)).unwrap_err().to_string();
        assert!(error.contains("image") && error.contains("x = 1, y = 2"), "{error}");
    }
}

#[test]
fn empty_and_malformed_images_are_refused() {
    assert!(matches!(
        compare_linear(image(0, 3, 1.0), image(0, 3, 1.0)),
        Err(MetricError::Malformed { side: Side::Image, source: ImageError::Empty { .. } })
    ));
    let mut short = image(4, 3, 1.0);
    short.pixels.pop();
    assert!(matches!(
        compare_linear(image(4, 3, 1.0), short),
        Err(MetricError::Malformed { side: Side::Reference, source: ImageError::Length { .. } })
    ));
}

#[test]
fn options_out_of_range_are_refused() {
    let one = Picture::Linear(image(1, 1, 1.0));
    let default = Options::default();
    for (options, name) in [
        (Options { exposure: f32::NAN, ..default }, "exposure"),
        (Options { pixels_per_degree: 0.0, ..default }, "pixels_per_degree"),
        (Options { z_block: 0, ..default }, "z_block"),
    ] {
        assert!(compare(&one, &one, &options).unwrap_err().to_string().contains(name));
    }
    assert!(compare(&one, &one, &default).is_ok(), "one pixel is enough");
}
