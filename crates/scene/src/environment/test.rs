use std::f32::consts::FRAC_PI_2;

use proptest::prelude::*;

use super::*;

const ENOUGH: Budget = Budget(1 << 24);

/// Three equal channels.
fn map(width: u32, height: u32, rotation: f32, value: impl Fn(u32, u32) -> f32) -> EnvironmentMap {
    let pixels = (0..width * height).map(|i| [value(i % width, i / width); 3]).collect();
    EnvironmentMap::new(Image { width, height, pixels, ..Image::default() }, rotation).unwrap()
}

/// −z is in the middle, +x a quarter to its right, +y above; who looks along −z with +y up has +x on the right.
#[test]
fn directions() {
    let map = map(4, 2, 0.0, |_, _| 0.0);
    for (direction, u, v) in [
        (Vec3::NEG_Z, 0.5, 0.5),
        (Vec3::X, 0.75, 0.5),
        (Vec3::NEG_X, 0.25, 0.5),
        (Vec3::Z, 0.0, 0.5),
        (Vec3::new(0.0, 1.0, -1e-3), 0.5, 1e-3 / std::f64::consts::PI),
        (Vec3::new(2.0, -2.0, 0.0), 0.75, 0.75),
    ] {
        let found = map.uv(direction.as_dvec3());
        assert!((found - DVec2::new(u, v)).abs().max_element() < 1e-6, "{direction}: {found}");
    }
}

/// A texel's centre shows the texel, and the middle between four of them their mean: the definition.
#[test]
fn bilinear() {
    let map = map(8, 4, 0.3, |i, j| (i * i + 10 * j) as f32);
    let seen = |i: f64, j: f64| map.radiance(map.direction(DVec2::new((i + 0.5) / 8.0, (j + 0.5) / 4.0)).as_vec3()).x;
    let truth = |i: u32, j: u32| (i * i + 10 * j) as f32;
    let near = |a: f32, b: f32| assert!((a - b).abs() < 1e-4, "{a} should be {b}");
    for (i, j) in [(0, 0), (3, 1), (7, 3)] {
        near(seen(i.into(), j.into()), truth(i, j));
    }
    near(seen(2.5, 1.5), (truth(2, 1) + truth(3, 1) + truth(2, 2) + truth(3, 2)) / 4.0);
    near(seen(2.25, 1.0), truth(2, 1) + 0.25 * (truth(3, 1) - truth(2, 1)));
    // Round the back, and towards both poles.
    near(seen(7.5, 2.0), (truth(7, 2) + truth(0, 2)) / 2.0);
    near(seen(-0.5, 2.0), (truth(7, 2) + truth(0, 2)) / 2.0);
    near(seen(5.0, -0.4), truth(5, 0));
    near(seen(5.0, 3.4), truth(5, 3));
}

/// A map turned by 90° shows at −x what it showed at −z; any rotation equals looking the other way round.
#[test]
fn rotation() {
    let value = |i, j| (i * 7 % 5 + j) as f32;
    let (still, turned) = (map(8, 4, 0.0, value), map(8, 4, FRAC_PI_2, value));
    let at =
        |direction| (still.radiance(direction) - turned.radiance(glam::Quat::from_rotation_y(FRAC_PI_2) * direction)).x;
    for direction in [Vec3::NEG_Z, Vec3::new(0.3, 0.5, 0.2), Vec3::new(-0.3, -0.9, 0.7)] {
        assert!(at(direction).abs() < 1e-5, "{direction}");
    }
    assert_eq!(turned.radiance(Vec3::NEG_X), still.radiance(Vec3::NEG_Z));
    assert_ne!(turned.radiance(Vec3::NEG_Z), still.radiance(Vec3::NEG_Z));
}

#[test]
fn a_single_texel_is_everywhere() {
    let map = map(1, 1, 1.0, |_, _| 3.0);
    for direction in [Vec3::X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z, Vec3::new(-1e-30, 1.0, 1e-30)] {
        assert_eq!(map.radiance(direction), Vec3::splat(3.0));
    }
}

#[test]
fn files() {
    let image = Image { width: 2, height: 1, pixels: vec![[1.0, 2.0, 3.0], [4.0; 3]], ..Image::default() };
    let bytes = exr::encode(&image).unwrap();
    let map = EnvironmentMap::decode(&bytes, -90.0, Vec3::new(1.0, 2.0, 0.5), ENOUGH).unwrap();
    assert_eq!(map.pixels, [[1.0, 4.0, 1.5], [4.0, 8.0, 2.0]]);
    assert!((map.rotation - 3.0 * FRAC_PI_2).abs() < 1e-6);
    let hdr = b"#?RGBE\n\n-Y 1 +X 1\n\x80\x80\x80\x81";
    assert_eq!(EnvironmentMap::decode(hdr, 0.0, Vec3::ONE, ENOUGH).unwrap().pixels, [[1.0; 3]]);
}

#[test]
fn what_is_refused() {
    let refusal = |pixels: Vec<[f32; 3]>, scale| {
        let image = Image { width: 2, height: 2, pixels, ..Image::default() };
        let bytes = exr::encode(&image).unwrap();
        EnvironmentMap::decode(&bytes, 0.0, Vec3::splat(scale), ENOUGH).unwrap_err().to_string()
    };
    let with = |value| vec![[0.0; 3], [0.0; 3], [0.0, value, 0.0], [-1.0; 3]];
    let accepted = "accepted: three finite numbers >= 0 (from 0 at the top left)";
    let expected = |value| format!("the pixel in column 0, row 1, scaled, is [0.0, {value}, 0.0]; {accepted}");
    assert_eq!(refusal(with(-0.5), 1.0), expected("-0.5"));
    assert_eq!(refusal(with(f32::INFINITY), 1.0), expected("inf"));
    assert_eq!(refusal(with(1e38), 10.0), expected("inf"));
    assert!(refusal(with(f32::NAN), 1.0).contains("[0.0, NaN, 0.0]"));
    let error = EnvironmentMap::decode(b"GIF89a", 0.0, Vec3::ONE, ENOUGH).unwrap_err().to_string();
    assert_eq!(error, "found neither an OpenEXR nor a Radiance file; accepted: these two");
    let image = Image { width: 100, height: 50, pixels: vec![[0.0; 3]; 5000], ..Image::default() };
    let bytes = exr::encode(&image).unwrap();
    let decode = |budget| EnvironmentMap::decode(&bytes, 0.0, Vec3::ONE, Budget(budget)).map_err(|e| e.to_string());
    decode(5000 * 24).unwrap();
    assert_eq!(
        decode(5000 * 24 - 1).unwrap_err(),
        "a picture of 100 x 50 pixels needs 120000 bytes; the budget is 119999"
    );
}

proptest! {
    /// Place to direction to place; and the radiance is within the texels' range, for any direction there is.
    #[test]
    fn places(u in 0.0..1.0, v in 0.01..0.99, rotation in -9.0f32..9.0) {
        let map = map(5, 3, rotation, |i, j| (i + j) as f32);
        let direction = map.direction(DVec2::new(u, v));
        let found = map.uv(direction);
        prop_assert!((found.y - v).abs() < 1e-12 && (found.x - u + 0.5).rem_euclid(1.0) - 0.5 < 1e-9, "{found}");
        prop_assert!((direction.length() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn any_direction(direction in prop::array::uniform3(prop::num::f32::ANY), rotation in prop::num::f32::NORMAL) {
        let map = map(5, 3, rotation % 7.0, |i, j| (i + j) as f32);
        let radiance = map.radiance(Vec3::from(direction)).x;
        prop_assert!(direction.iter().any(|x| !x.is_finite()) || (0.0..=6.001).contains(&radiance), "{radiance}");
    }
}
