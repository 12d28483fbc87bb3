//! A medium's grids of temperature and colour: how they are loaded, where they are, and mistakes with their messages.

use tyndall_scene::assets::Embedded;
use tyndall_scene::glam::Vec3;
use tyndall_scene::volume::Budget;
use tyndall_scene::{Document, World, black_body};

use crate::{BOX, CAMERA, refusal};

const SMOKE: &[u8] = include_bytes!("../../../../scenes/smoke.vdb");

fn load(medium: &str) -> Result<World, String> {
    let document = Document::new("s.toml", format!("{CAMERA}{medium}"));
    let scene = document.parse().map_err(|error| error.to_string())?;
    let assets = Embedded(vec![("smoke.vdb", SMOKE)]);
    World::load(scene, &assets, Budget(1 << 30)).map_err(|error| error.locate(&document).to_string())
}

const PLUME: &str = "[media.a]\ndensity.grid = { file = \"smoke.vdb\", name = \"density\" }\n\
                     optics.coefficients = { sigma_s = 6, sigma_a = 4 }\n\
                     transform = { scale = 2, translate = [1, 0, 0] }\n";

#[test]
fn grids_follow_the_medium() {
    let world = load(&format!(
        "{PLUME}temperature = {{ file = \"smoke.vdb\", name = \"temperature\", kelvin = 800, offset = 300, \
         radiance_scale = 0.5 }}\ncolor = {{ file = \"smoke.vdb\", names = [\"density\", \"temperature\", \"density\"] }}"
    ))
    .unwrap();
    let volume = &world.volumes[0];
    let (temperature, color) = (volume.temperature.as_ref().unwrap(), volume.color.as_ref().unwrap());
    let grid = &temperature.grid.grid;
    let world_from_unit = temperature.grid.unit_from_world.inverse();
    // A point on the plume's axis where the temperature's grid is about ½, so that green is, too.
    let axis = (0..256).map(|j| Vec3::new(0.5, (j as f32 + 0.5) / 256.0, 0.5));
    let off = |unit: &Vec3| (grid.trilinear(*unit) - 0.5).abs();
    let unit = axis.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
    let (value, point) = (grid.trilinear(unit), world_from_unit.transform_point3(unit));
    let kelvin = 800.0 * value + 300.0;
    assert!((value - 0.5).abs() < 0.1 && (temperature.at(point) - kelvin).abs() < 0.01 * kelvin, "{value} at {point}");
    // σ_t stays; what colour takes from σ_s goes to σ_a; and that glows.
    let plain = load(PLUME).unwrap();
    let (here, before) = (volume.coefficients(point).unwrap(), plain.volumes[0].coefficients(point).unwrap());
    assert!((here.sigma_t() - before.sigma_t()).abs().max_element() < 1e-4 * before.sigma_t().x);
    let c = color.at(point);
    assert!(before.sigma_s.x > 0.0 && (c.y - value).abs() < 0.01, "{c}");
    assert!((here.sigma_s - before.sigma_s * c).abs().max_element() < 1e-4 * before.sigma_s.x);
    let glow = here.sigma_a * black_body(temperature.at(point)) * 0.5;
    assert!((here.emission - glow).abs().max_element() <= 1e-5 * glow.max_element());
    // Outside: cold, and white.
    let far = Vec3::splat(1e3);
    assert_eq!((temperature.at(far), color.at(far), volume.coefficients(far)), (300.0, Vec3::ONE, None));
    // What is read counts.
    assert_ne!(world.hash, plain.hash);
}

#[test]
fn mistakes() {
    let transfer = format!("{BOX}optics.transfer = {{ unit_length = 1, window = {{ level = 0, width = 1 }} }}\n");
    let cases = [
        (
            format!("{PLUME}temperature = {{ file = \"smoke.vdb\", name = \"heat\" }}"),
            "s.toml:8:44: media.a.temperature.name: \"smoke.vdb\": found no grid named \"heat\"; accepted: the grids \
             \"density\", \"temperature\"",
        ),
        (
            format!("{PLUME}temperature.file = \"no.vdb\""),
            "s.toml:8:20: media.a.temperature.file: cannot read \"no.vdb\": no embedded file of that name; accepted: a \
             path relative to the scene file",
        ),
        (
            format!("{PLUME}color = {{ file = \"smoke.vdb\", names = [\"density\", \"g\", \"b\"] }}"),
            "s.toml:8:51: media.a.color.names.1: \"smoke.vdb\": found no grid named \"g\"; accepted: the grids \
             \"density\", \"temperature\"",
        ),
        (
            format!("{transfer}temperature.file = \"smoke.vdb\""),
            "s.toml:7:1: media.a.temperature: found `temperature` with `optics.transfer`; accepted: it with \
             `optics.coefficients`",
        ),
        (
            format!("{transfer}color = {{ file = \"smoke.vdb\", names = [\"r\", \"g\", \"b\"] }}"),
            "s.toml:7:9: media.a.color: found `color` with `optics.transfer`; accepted: it with `optics.coefficients`",
        ),
        (
            format!("{PLUME}temperature = {{ file = \"smoke.vdb\", kelvin = 0 }}"),
            "s.toml:8:46: media.a.temperature.kelvin: found 0; accepted: a finite number > 0",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(load(&text).unwrap_err(), expected);
    }
    let short = refusal("s.toml", &format!("{CAMERA}{PLUME}color = {{ file = \"smoke.vdb\", names = [\"r\"] }}"));
    assert!(short.starts_with("s.toml:8:39: media.a.color.names: found [\"r\"]; accepted: an array of"), "{short}");
}
