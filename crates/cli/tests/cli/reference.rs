//! `tyndall reference`: samples, continuation, interruption.

use tyndall_scene::image::Image;

use crate::{Place, SCENE};

fn image(place: &Place) -> Image {
    Image::read(&place.path("a.exr")).unwrap()
}

fn samples(image: &Image) -> (u32, u32) {
    let samples = &image.statistics.as_ref().unwrap().samples;
    (*samples.iter().min().unwrap(), *samples.iter().max().unwrap())
}

#[test]
fn samples_are_taken_and_continued() {
    let place = Place::new();
    let run = place.tyndall("reference scene.toml -o a.exr --samples 8").exits(0).says(&["a.exr: 8 samples a pixel"]);
    assert!(run.out.is_empty());
    let first = image(&place);
    assert_eq!((first.width, first.height), (16, 12));
    assert_eq!(samples(&first), (8, 8));
    assert!(first.pixels.iter().flatten().all(|value| value.is_finite()));
    assert_eq!(first.attributes["software"], concat!("tyndall ", env!("CARGO_PKG_VERSION")));
    assert_eq!(first.attributes["depth"], "any");
    let seconds = |image: &Image| image.attributes["seconds rendering"].parse::<f64>().unwrap();

    place.tyndall("reference scene.toml -o a.exr --samples 16").exits(0);
    let second = image(&place);
    assert_eq!(samples(&second), (16, 16));
    assert_ne!(second.pixels, first.pixels);
    assert!(seconds(&second) >= seconds(&first));
    assert_eq!(second.attributes["scene hash"], first.attributes["scene hash"]);

    // As good as sixteen at once, but for rounding.
    std::fs::remove_file(place.path("a.exr")).unwrap();
    place.tyndall("reference scene.toml -o a.exr --samples 16").exits(0);
    for (a, b) in image(&place).pixels.iter().flatten().zip(second.pixels.iter().flatten()) {
        assert!((a - b).abs() <= 1e-5 * a.abs().max(1e-3), "{a} {b}");
    }
    // There are enough already.
    place.tyndall("reference scene.toml -o a.exr --samples 4").exits(0);
    assert_eq!(samples(&image(&place)), (16, 16));
}

/// What has nothing in it gives a picture and a warning; of one sample no error is known.
#[test]
fn nothing_is_warned_about() {
    let place = Place::new();
    place.write("none.csv", "x,y,z,radius,opacity\n");
    place.write("none.obj", "# nothing\n");
    let none = "[media.smoke]\ndensity.particles.file = \"none.csv\"\noptics.coefficients.sigma_s = 1\n\
                [surfaces.thing]\nshape.mesh.file = \"none.obj\"\n";
    place.write("scene.toml", format!("{SCENE}{none}"));
    let warnings = ["media.smoke: there are no particles", "thing: has no triangles"];
    let run = place.tyndall("reference scene.toml -o a.exr --samples 1").exits(0).says(&warnings);
    run.says(&["a.exr: 1 samples a pixel, relative standard error unknown"]);
}

#[test]
fn an_error_is_reached() {
    let place = Place::new();
    place.tyndall("reference scene.toml -o a.exr --error 0.05").exits(0).says(&["relative standard error"]);
    assert!(samples(&image(&place)).0 >= 16);
}

#[test]
fn another_picture_is_not_continued() {
    let place = Place::new();
    place.tyndall("reference scene.toml -o a.exr --samples 1").exits(0);
    let before = std::fs::read(place.path("a.exr")).unwrap();
    for (argument, different) in [
        ("--set camera.fov=50", "of another scene"),
        ("--size 8x8", "of another scene"),
        ("--depth 1", "of another depth"),
        ("--seed 7", "of another seed"),
        ("--no-caustics", "with caustics"),
    ] {
        let run = place.tyndall(&format!("reference scene.toml -o a.exr --samples 2 {argument}"));
        run.exits(2).says(&["output a.exr: found a picture ", different]);
    }
    assert_eq!(std::fs::read(place.path("a.exr")).unwrap(), before);
    place.write("a.exr", "no picture");
    place.tyndall("reference scene.toml -o a.exr --samples 2").exits(2).says(&["a.exr"]);
    assert_eq!(std::fs::read(place.path("a.exr")).unwrap(), b"no picture");
    let plain = Image { width: 16, height: 12, pixels: vec![[0.0; 3]; 192], ..Image::default() };
    plain.write(&place.path("a.exr"), 0.0).unwrap();
    place.tyndall("reference scene.toml -o a.exr --samples 2").exits(2).says(&["of another scene"]);
}

#[test]
fn depth_limits_scattering() {
    let place = Place::new();
    let sum = |image: Image| image.pixels.iter().flatten().sum::<f32>();
    let mut brighter = 0.0;
    for depth in 0..3 {
        place.tyndall(&format!("reference scene.toml -o a.exr --samples 32 --depth {depth}")).exits(0);
        let image = image(&place);
        assert_eq!(image.attributes["depth"], depth.to_string());
        let sum = sum(image);
        assert!(sum > brighter, "depth {depth}: {sum} after {brighter}");
        brighter = sum;
        std::fs::remove_file(place.path("a.exr")).unwrap();
    }
}

/// Interrupts a command that would take for ever.
#[cfg(unix)]
pub fn interrupted(place: &Place, line: &str) {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    let mut command = place.command();
    command.args(line.split_whitespace());
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > Duration::from_secs(20) {
            child.kill().unwrap();
            panic!("Ctrl-C did not end it");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    crate::Run::new(child.wait_with_output().unwrap()).exits(130).says(&["interrupted"]);
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_there_is() {
    let place = Place::new();
    place.write("scene.toml", SCENE.replace("[16, 12]", "[4, 3]"));
    interrupted(&place, "reference scene.toml -o a.exr --samples 100000000");
    let first = image(&place);
    let (least, most) = samples(&first);
    assert!(least >= 1 && most - least <= 1, "{least} to {most} samples");
    assert!(first.pixels.iter().flatten().all(|value| value.is_finite()));
    assert_eq!(place.names(), ["a.exr", "scene.toml"]);

    place.tyndall(&format!("reference scene.toml -o a.exr --samples {}", most + 4)).exits(0);
    assert_eq!(samples(&image(&place)), (most + 4, most + 4));
}
