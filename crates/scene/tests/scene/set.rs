//! Fields set by their path.

use proptest::prelude::*;
use tyndall_scene::description::{Density, Light, Optics, Phase};
use tyndall_scene::glam::Vec3;
use tyndall_scene::parameter::Value;
use tyndall_scene::{Document, Scene};

use crate::{BOX, CAMERA, SCENES};

fn scene(index: usize) -> Scene {
    let (name, text) = SCENES[index];
    Document::new(name, text).parse().unwrap()
}

#[test]
fn values_of_every_kind() {
    let mut fog = scene(2);
    for (path, value) in [
        ("camera.fov", "55"),
        ("camera.position.1", "2.5"),
        ("film.size", "[320, 240]"),
        ("lights.sky.constant.radiance", "[1, 2, 3]"),
        ("media.fog.optics.coefficients.sigma_s", "0.5"),
        ("media.fog.optics.coefficients.phase", "rayleigh"),
        ("media.smoke.density.grid.file", "other smoke.vdb"),
        ("media.smoke.density.grid.name", "\"7\""),
        ("techniques.march.model", "emission"),
        ("techniques.march.step", "0.25"),
        ("lights.new", "{ point = { position = [0, 1, 0], intensity = 2 } }"),
    ] {
        fog.set(path, value).unwrap_or_else(|error| panic!("{path} = {value}: {error}"));
    }
    assert_eq!(fog.camera.fov, 55.0);
    assert_eq!(fog.camera.position, Vec3::new(0.0, 2.5, 7.0));
    assert_eq!(fog.film.size, [320, 240]);
    assert_eq!(fog.lights["sky"], Light::Constant { radiance: Vec3::new(1.0, 2.0, 3.0) });
    assert_eq!(fog.lights["new"], Light::Point { position: Vec3::Y, intensity: Vec3::splat(2.0) });
    let Optics::Coefficients { sigma_s, phase, .. } = &fog.media["fog"].optics else { panic!() };
    assert_eq!((*sigma_s, phase), (Vec3::splat(0.5), &Phase::Rayleigh));
    let file = Density::Grid { file: "other smoke.vdb".into(), name: Some("7".into()), raw: None };
    assert_eq!(fog.media["smoke"].density, file);
    assert_eq!(fog.techniques["march"]["model"], Value::Choice("emission".into()));
    assert_eq!(fog.techniques["march"]["step"], Value::Number(0.25));
    // A word gives way to a table.
    fog.set("media.fog.optics.coefficients.phase.hg.g", "-0.4").unwrap();
    let Optics::Coefficients { phase, .. } = &fog.media["fog"].optics else { panic!() };
    assert_eq!(*phase, Phase::Hg { g: -0.4 });
    // What is not said stays.
    assert_eq!(fog.media["fog"].density, scene(2).media["fog"].density);
}

#[test]
fn names_with_dots() {
    let text = SCENES[0].1.replace("media.plume]", "media.\"a.b\"]");
    let mut plume = Document::new("s.toml", text).parse().unwrap();
    plume.set("media.a.b.transform.scale", "2").unwrap();
    assert_eq!(plume.media["a.b"].transform.scale, Vec3::splat(2.0));
}

#[test]
fn what_cannot_be_set() {
    let transfer = "optics.transfer = { unit_length = 1, stops = [{ value = 60, opacity = 0, color = 1 }, \
                    { value = 110, opacity = 1, color = 1 }] }";
    let scene = Document::new("s.toml", format!("{CAMERA}fov = 30\n{BOX}{transfer}")).parse().unwrap();
    for (path, value, expected) in [
        ("camera.fov", "180", "camera.fov: found 180; accepted: an angle in degrees between 0 and 180 (exclusive)"),
        ("camera.fov", "", "camera.fov: found \"\"; accepted: an angle in degrees between 0 and 180 (exclusive)"),
        (
            "camera.fov",
            "40 # degrees\nx = 3",
            "camera.fov: found \"40 # degrees\\nx = 3\"; accepted: an angle in degrees between 0 and 180 (exclusive)",
        ),
        (
            "camera.fovy",
            "40",
            "camera.fovy: found unknown field `fovy`; accepted: one of `position`, `target`, `up`, `fov`",
        ),
        ("camera.fov.x", "1", "camera.fov.x: found x; accepted: no name here: what is to the left of it is no table"),
        ("camera..fov", "1", "camera..fov: found an empty name in the path; accepted: a path such as film.exposure"),
        ("", "1", ": found an empty name in the path; accepted: a path such as film.exposure"),
        (
            "media.a.optics.transfer.stops.9.value",
            "1",
            "media.a.optics.transfer.stops.9.value: found 9; accepted: an index from 0 to 1",
        ),
        (
            "media.a.optics.transfer.stops.1.value",
            "1",
            "media.a.optics.transfer.stops.1.value: found 1 after 60; accepted: values in ascending order",
        ),
        (
            "media.a.optics.coefficients.sigma_s",
            "1",
            "media.a.optics: found both `transfer` and `coefficients`; accepted: one of `coefficients`, `transfer`",
        ),
        (
            "media.other.transform.scale",
            "1",
            "media.other: found no `density`; accepted: a table with `density`, which \
             has no default",
        ),
    ] {
        let mut changed = scene.clone();
        let message = changed.set(path, value).unwrap_err().to_string();
        assert_eq!(message, expected);
        assert_eq!(changed, scene, "a refused value changed the scene");
    }
}

#[test]
fn a_long_path_is_refused() {
    let message = scene(0).set(&"a.".repeat(100_000), "1").unwrap_err().to_string();
    assert!(message.len() < 300, "{message}");
    let message = scene(0).set(&format!("{}a", "a.".repeat(100_000)), "1").unwrap_err().to_string();
    assert!(message.len() < 300, "{message}");
}

proptest! {
    #[test]
    fn anything_may_be_set_without_panic(path in "[a-z_.0-9\"]{0,30}", value in ".{0,30}") {
        let _ = scene(2).set(&path, &value);
    }

    #[test]
    fn known_fields_take_anything_without_panic(
        path in prop::sample::select(vec![
            "camera", "camera.up.0", "film.size", "lights", "lights.lamp.spot", "media.fog", "media.fog.density",
            "media.smoke.transform.rotate.2", "techniques", "techniques.march.step", "media.fog.optics.coefficients.phase",
        ]),
        value in "[-\\[\\]{}=,.0-9einfa\" ]{0,20}",
    ) {
        let mut scene = scene(2);
        if scene.set(path, &value).is_ok() {
            prop_assert_eq!(scene.check(), Ok(()));
        }
    }
}
