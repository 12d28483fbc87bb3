//! `tyndall render` and `tyndall demo`, where there is an adapter.

use tyndall_scene::image::{Image, Picture};

use crate::{Place, adapter};

#[test]
fn pictures_of_both_formats() {
    if !adapter() {
        return;
    }
    let place = Place::new();
    let run = place.tyndall("render scene.toml -o a.exr").exits(0);
    // Drivers may say something of their own on standard error.
    assert!(run.out.is_empty(), "{}", run.out);
    let image = Image::read(&place.path("a.exr")).unwrap();
    assert_eq!((image.width, image.height), (16, 12));
    assert!(image.pixels.iter().flatten().all(|value| value.is_finite() && *value > 0.0));
    assert_eq!(image.attributes["software"], concat!("tyndall ", env!("CARGO_PKG_VERSION")));
    assert_eq!(image.attributes["scene hash"].len(), 64);
    assert!(!image.attributes["adapter"].is_empty());
    for time in ["seconds rendering", "seconds on the device"] {
        assert!(image.attributes[time].parse::<f64>().unwrap() >= 0.0, "{time}");
    }

    place.tyndall("render scene.toml -o a.png --size 20x10").exits(0);
    let picture = Picture::read(&place.path("a.png")).unwrap();
    assert_eq!(picture.size(), (20, 10));
    assert!(matches!(picture, Picture::Display(_)));
    assert_eq!(place.names(), ["a.exr", "a.png", "scene.toml"]);
}

/// Where nothing gives light, and something waits for it, a picture is black, and says why.
#[test]
fn darkness_is_told() {
    if !adapter() {
        return;
    }
    let place = Place::new();
    let media = "media.box = { density.homogeneous = { min = [-1, -1, -1], max = [1, 1, 1] }, optics.coefficients = { sigma_s = 1, sigma_a = 1 } }";
    for (glow, told) in [("", true), ("media.box.optics.coefficients.emission=1", false)] {
        let text = format!("camera = {{ position = [0, 0, 4], target = [0, 0, 0] }}\nfilm.size = [8, 8]\n{media}\n");
        std::fs::write(place.path("dark.toml"), text).unwrap();
        let set = if glow.is_empty() { String::new() } else { format!(" --set {glow}") };
        let run = place.tyndall(&format!("render dark.toml -o a.exr{set}")).exits(0);
        assert_eq!(run.err.contains("lights: there are none, and nothing emits"), told, "{}", run.err);
        let image = Image::read(&place.path("a.exr")).unwrap();
        assert_eq!(image.pixels.iter().all(|pixel| pixel[0] == 0.0), told);
    }
}

#[test]
fn set_takes_effect() {
    if !adapter() {
        return;
    }
    let place = Place::new();
    let mean = |name: &str| {
        let image = Image::read(&place.path(name)).unwrap();
        (image.pixels.iter().flatten().sum::<f32>() / image.pixels.len() as f32, image.attributes["scene hash"].clone())
    };
    place.tyndall("render scene.toml -o a.exr").exits(0);
    place.tyndall("render scene.toml -o b.exr --set lights.sun.directional.irradiance=400").exits(0);
    let ((a, hash_a), (b, hash_b)) = (mean("a.exr"), mean("b.exr"));
    assert!(b > 2.0 * a, "{a} {b}");
    assert_ne!(hash_a, hash_b);
}

#[test]
fn timings_name_the_adapter() {
    if !adapter() {
        return;
    }
    let out = Place::new().tyndall("render scene.toml -o a.exr --timings").exits(0).out;
    for part in ["load ", "adapter ", "pass", "total "] {
        assert!(out.contains(part), "{out}");
    }
}

#[test]
fn adapters_are_chosen_by_name() {
    if !adapter() {
        return;
    }
    let place = Place::new();
    let run = place.tyndall("render scene.toml -o a.exr --adapter nonesuch").exits(2).says(&["\"nonesuch\""]);
    // The message lists those that `info` lists.
    let info = place.tyndall("info").exits(0).out;
    let names =
        info.lines().filter_map(|line| line.strip_prefix("Adapter ")).filter_map(|line| line.split(" (").next());
    let names: Vec<_> = names.collect();
    assert!(!names.is_empty());
    for name in names {
        assert!(run.err.contains(name), "{name} is not in {}", run.err);
        place.run(["render", "scene.toml", "-o", "a.exr", "--adapter", &name.to_uppercase()]).exits(0);
    }
}

#[test]
fn an_old_picture_stays_where_the_new_one_fails() {
    if !adapter() {
        return;
    }
    let place = Place::new();
    place.write("a.exr", "before");
    place.tyndall("render scene.toml -o a.exr --set camera.fov=0").exits(2);
    assert_eq!(std::fs::read(place.path("a.exr")).unwrap(), b"before");
    place.tyndall("render scene.toml -o a.exr").exits(0);
    assert!(Image::read(&place.path("a.exr")).is_ok());
}

/// Light of surfaces that emit, and of virtual lights, is not dimmed by bodies, which a warning says; that of a lamp is.
#[test]
fn light_that_bodies_do_not_dim_is_warned_about() {
    if !adapter() {
        return;
    }
    let place = Place::new();
    let smoke = "[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\n[lights.lamp.point]\nposition = [0, 2, 0]\nintensity = 1\n\
                 [media.smoke]\ndensity.emitter = { number = 2, time = 0.1 }\noptics.coefficients.sigma_s = 1\n";
    let panel =
        "[surfaces.panel]\nshape.quad = { corner = [-1, 2, -1], edges = [[2, 0, 0], [0, 0, 2]] }\nradiance = 1\n";
    for (more, warning) in [
        ("", None),
        (panel, Some("surfaces.panel: what it emits has no maps of transmittance")),
        (format!("{panel}[techniques.particles]\narea_points = 0\n").as_str(), None),
        (
            format!("{panel}[techniques.instant_radiosity]\npaths = 4\nsamples = 1\n").as_str(),
            Some("techniques.instant_radiosity: its virtual lights have no maps of transmittance"),
        ),
    ] {
        place.write("smoke.toml", format!("{smoke}{more}"));
        let run = place.tyndall("render smoke.toml -o a.png --size 8x8").exits(0);
        match warning {
            Some(warning) => assert!(run.err.contains(warning), "{}", run.err),
            None => assert!(!run.err.contains("no maps of transmittance"), "{}", run.err),
        }
    }
}
