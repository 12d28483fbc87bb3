//! `tyndall compare`.

use serde_json::Value;
use tyndall_scene::image::{Image, Picture};

use crate::Place;

/// A picture with some structure, a value added to every pixel.
fn write(place: &Place, name: &str, width: u32, added: f32) {
    let pixel = |i: u32| [(i % width) as f32 * 0.05 + added, 0.2 + added, (i / width) as f32 * 0.03 + added];
    let pixels = (0..width * 24).map(pixel).collect();
    Image { width, height: 24, pixels, ..Image::default() }.write(&place.path(name), 0.0).unwrap();
}

fn place() -> Place {
    let place = Place::new();
    write(&place, "a.exr", 32, 0.0);
    write(&place, "b.exr", 32, 0.1);
    write(&place, "wide.exr", 40, 0.0);
    write(&place, "a.png", 32, 0.0);
    place
}

fn json(place: &Place, line: &str) -> Value {
    serde_json::from_str(&place.tyndall(line).exits(0).out).unwrap()
}

#[test]
fn measures() {
    let place = place();
    let same = json(&place, "compare a.exr a.exr --json");
    assert_eq!(same["linear"]["relative_rmse"], 0.0);
    assert_eq!(same["flip_mean"], 0.0);
    let other = json(&place, "compare b.exr a.exr --json");
    let rmse = other["linear"]["rmse"].as_f64().unwrap();
    assert!((rmse - 0.1).abs() < 1e-5, "{rmse}");
    assert!(other["flip_mean"].as_f64().unwrap() > 0.0);
    let text = place.tyndall("compare b.exr a.exr").exits(0).out;
    for part in ["size             32 x 24", "RMSE             0.1", "relative RMSE", "PSNR", "SSIM", "FLIP"] {
        assert!(text.contains(part), "{text}");
    }
    // A screen's picture has no radiance.
    assert!(json(&place, "compare a.png a.exr --json")["linear"].is_null());
}

#[test]
fn limits() {
    let place = place();
    place.tyndall("compare b.exr a.exr --fail-over rmse=0.2 --fail-over ssim=0.1").exits(0);
    let run =
        place.tyndall("compare b.exr a.exr --fail-over rmse=0.05").exits(1).says(&["rmse is 0.1", "the limit 0.05"]);
    assert!(run.out.contains("SSIM"), "the measures are printed all the same");
    place.tyndall("compare b.exr a.exr --fail-over psnr_db=90").exits(1).says(&["psnr_db is "]);
    let run = place.tyndall("compare b.exr a.exr --fail-over beauty=1").exits(2);
    run.says(&["no measure `beauty`; accepted: rmse, relative_rmse"]);
    place.tyndall("compare a.png a.exr --fail-over rmse=1").exits(2).says(&["no measure `rmse`"]);
}

#[test]
fn maps() {
    let place = place();
    place.tyndall("compare b.exr a.exr --map map.png").exits(0);
    assert_eq!(Picture::read(&place.path("map.png")).unwrap().size(), (32, 24));
}

#[test]
fn what_cannot_be_compared() {
    let place = place();
    place.write("text.exr", "no picture");
    let cut = std::fs::read(place.path("a.exr")).unwrap();
    place.write("cut.exr", &cut[..cut.len() / 2]);
    let mut image = Image::read(&place.path("a.exr")).unwrap();
    image.pixels[7][1] = f32::NAN;
    image.write(&place.path("nan.exr"), 0.0).unwrap();
    for (line, expected) in [
        ("compare a.exr wide.exr --map map.png", "40"),
        ("compare a.exr no.exr", "no.exr"),
        ("compare a.exr text.exr", "text.exr"),
        ("compare cut.exr a.exr", "cut.exr"),
        ("compare . a.exr", "`.`"),
        ("compare nan.exr a.exr", "NaN"),
        ("compare a.exr nan.exr", "NaN"),
    ] {
        let run = place.tyndall(line).exits(2);
        assert!(run.out.is_empty() && run.err.contains(expected), "{line}: {}", run.err);
    }
    assert!(!place.exists("map.png"));
}
