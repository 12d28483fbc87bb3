//! Small pictures that stay as they are, on the CPU driver. `cargo xtask bless` writes them anew.

use std::path::PathBuf;

use tyndall_scene::image::{Picture, file::write_atomically, png, tonemap};
use tyndall_scene::metrics;

use super::{FIRE, FOG, PLUME, gpu, picture, shipped, tolerance, world_of};

/// Renders a scene small and compares it with `tests/goldens/<name>.png`.
fn golden(name: &str, text: &str) {
    let Some(gpu) = gpu() else { return };
    let text = text.replace("[640, 480]", "[160, 120]");
    let world = world_of(&text, &shipped());
    let shown = png::encode(&tonemap::display(&picture(&gpu, &world), world.scene.film.exposure)).unwrap();
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/goldens")).join(format!("{name}.png"));
    if std::env::var_os("TYNDALL_BLESS").is_some() {
        assert!(shown.len() <= 64 << 10, "{name} has {} bytes", shown.len());
        write_atomically(&path, &shown).unwrap();
        return;
    }
    let expected = Picture::read(&path).unwrap_or_else(|error| panic!("{error} (cargo xtask bless makes it)"));
    // Both in 8 bits: of a bright picture the steps of one alone would be seen by the metric.
    let report = metrics::compare(&Picture::decode(&shown).unwrap(), &expected, &Default::default()).unwrap();
    if report.flip_mean > tolerance::GOLDEN_FLIP {
        let found = std::env::temp_dir().join(format!("tyndall-{name}.png"));
        write_atomically(&found, &shown).unwrap();
        panic!("{name}: FLIP {} (at most {}); see {}", report.flip_mean, tolerance::GOLDEN_FLIP, found.display());
    }
}

#[test]
fn plume() {
    golden("plume", PLUME);
}

#[test]
fn fire() {
    golden("fire", FIRE);
}

#[test]
fn fog() {
    golden("fog", FOG);
}

#[test]
fn plume_floor() {
    golden("plume-floor", include_str!("../../../../scenes/plume-floor.toml"));
}

#[test]
fn particles() {
    let text = include_str!("../../../../scenes/particles.toml").replace("[480, 480]", "[120, 120]");
    golden("particles", &format!("{text}\n[techniques.transmittance]\ncoefficients = 15"));
}

/// Of fewer strands, which are as much thicker.
#[test]
fn hair() {
    let text = include_str!("../../../../scenes/hair.toml").replace("[480, 480]", "[120, 120]");
    let text = text.replace("number = 10000", "number = 600").replace("thickness = 90e-6", "thickness = 600e-6");
    golden("hair", &text);
}

#[test]
fn a_change_that_can_be_seen_is_caught() {
    let Some(gpu) = gpu() else { return };
    let shown = |text: &str| {
        let world = world_of(&text.replace("[640, 480]", "[80, 60]"), &shipped());
        Picture::Display(tonemap::display(&picture(&gpu, &world), 1.0))
    };
    let dimmer = PLUME.replace("sigma_s = 45", "sigma_s = 38");
    let report = metrics::compare(&shown(&dimmer), &shown(PLUME), &Default::default()).unwrap();
    assert!(report.flip_mean > tolerance::GOLDEN_FLIP, "{}", report.flip_mean);
}
