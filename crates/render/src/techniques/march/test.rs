//! The marcher against closed forms, its own brute force, and the reference.

use std::sync::Arc;

use glam::{Mat4, Vec3};
use half::f16;
use tyndall_scene::image::{Image, Picture, exr};
use tyndall_scene::metrics;
use tyndall_scene::volume::{Grid, Voxels};
use tyndall_scene::{Field, World};

use crate::test::{FIRE, PLUME, gpu, picture, shipped, tolerance, world, world_of};

/// Looks along −z through the middle of the unit cube around the origin, into a narrow field: every ray is nearly
/// perpendicular to the faces.
const CAMERA: &str = "camera = { position = [0, 0, 5], target = [0, 0, 0], fov = 0.001 }\nfilm.size = [2, 2]\n";
const UNIT_BOX: &str = "{ min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }";

fn assert_radiance(image: &Image, expected: [f64; 3], tolerance: f64) {
    for pixel in &image.pixels {
        for c in 0..3 {
            let error = (f64::from(pixel[c]) - expected[c]).abs() / expected[c].abs().max(1e-6);
            assert!(error <= tolerance, "{pixel:?} for {expected:?}");
        }
    }
}

/// [ground truth 2] A homogeneous slab, σ_a = (0.5, 2, 8) m⁻¹, 1 m, before an environment of 1: e^{−σ_a}.
#[test]
fn beers_law() {
    let Some(gpu) = gpu() else { return };
    let text = format!(
        "{CAMERA}lights.sky.constant.radiance = 1\n[techniques.march]\nmodel = \"absorption\"\ntermination = 0\n\
         [media.slab]\ndensity.homogeneous = {UNIT_BOX}\noptics.coefficients.sigma_a = [0.5, 2, 8]"
    );
    let expected = [0.5f64, 2.0, 8.0].map(|k| (-k).exp());
    assert_radiance(&picture(&gpu, &world(&text)), expected, tolerance::EXACT);
}

/// [ground truth 2] The same seen by a camera within the slab, 0.25 m before its far face.
#[test]
fn beers_law_from_within() {
    let Some(gpu) = gpu() else { return };
    let text = format!(
        "camera = {{ position = [0, 0, -0.25], target = [0, 0, -1], fov = 0.001 }}\nfilm.size = [2, 2]\n\
         lights.sky.constant.radiance = 1\ntechniques.march.model = \"absorption\"\n\
         [media.slab]\ndensity.homogeneous = {UNIT_BOX}\noptics.coefficients.sigma_a = 2"
    );
    assert_radiance(&picture(&gpu, &world(&text)), [(-0.5f64).exp(); 3], tolerance::EXACT);
}

/// [ground truth 2] Emission and absorption: (1 − e^{−kL}) k_e/k, and L·k_e where nothing absorbs.
#[test]
fn emission_and_absorption() {
    let Some(gpu) = gpu() else { return };
    let text = format!(
        "{CAMERA}techniques.march.model = \"emission\"\n[media.slab]\ndensity.homogeneous = {UNIT_BOX}\n\
         optics.coefficients = {{ sigma_a = [0, 0.01, 3], emission = [2, 2, 2] }}"
    );
    let expected = [2.0, 2.0 * -(-0.01f64).exp_m1() / 0.01, 2.0 * -(-3f64).exp_m1() / 3.0];
    assert_radiance(&picture(&gpu, &world(&text)), expected, tolerance::EXACT);
}

/// [ground truth 2] Density e^{−y/H} along the ray: optical depth H (1 − e^{−1/H}) over 1 m. Seen from below.
#[test]
fn exponential_density() {
    let Some(gpu) = gpu() else { return };
    let text = "camera = { position = [0.5, -3, 0.5], target = [0.5, 0, 0.5], up = [0, 0, 1], fov = 0.001 }\n\
        film.size = [2, 2]\nlights.sky.constant.radiance = 1\ntechniques.march.model = \"absorption\"\n[media.fog]\n\
        density.exponential = { min = [0, 0, 0], max = [1, 1, 1], scale_height = 0.3 }\noptics.coefficients.sigma_a = 4";
    let depth = 4.0 * 0.3 * -(-1.0f64 / 0.3).exp_m1();
    assert_radiance(&picture(&gpu, &world(text)), [(-depth).exp(); 3], tolerance::SMOOTH);
}

/// [ground truth 5] A grid of constant density, turned and scaled, gives the homogeneous medium's picture; and two
/// overlapping media that of one with the sum of their coefficients.
#[test]
fn heterogeneous_equals_homogeneous() {
    let Some(gpu) = gpu() else { return };
    let scene = |media: &str| {
        format!(
            "camera = {{ position = [1.5, 1.2, 2], target = [0, 0, 0] }}\nfilm.size = [48, 36]\n\
             lights.sun.directional = {{ direction = [-1, -2, -0.5], irradiance = [3, 2, 1] }}\n\
             lights.lamp.point = {{ position = [0.1, 0.2, 0.3], intensity = [1, 2, 3] }}\n\
             techniques.march = {{ step = 0.5, light_step = 1 }}\n{media}"
        )
    };
    let medium = |name: &str, scattering: f32| {
        format!(
            "[media.{name}]\ndensity.homogeneous = {UNIT_BOX}\ntransform.rotate = [20, 30, 40]\n\
             optics.coefficients = {{ sigma_s = {scattering}, sigma_a = 0.5, phase.hg.g = 0.4 }}\n"
        )
    };
    let one = medium("a", 4.0).replace("sigma_a = 0.5", "sigma_a = 1.0");
    let homogeneous = picture(&gpu, &world(&scene(&one)));

    let mut gridded: World = world(&scene(&one));
    let voxels = Voxels::F16(vec![f16::ONE; 64 * 64 * 64]);
    let grid = Grid::dense([64; 3], voxels, Mat4::IDENTITY);
    gridded.volumes[0].field = Field::Grid(Arc::new(grid));
    assert_same(&picture(&gpu, &gridded), &homogeneous, tolerance::CONSTANT_GRID);

    let two = medium("a", 1.0) + &medium("b", 3.0);
    assert_same(&picture(&gpu, &world(&scene(&two))), &homogeneous, tolerance::CONSTANT_GRID);
}

/// [ground truth 6] Single scattering of parallel light in the unit cube, from above onto its top face. At depth z along
/// the camera's ray and distance s = 0.5 m below the face, L = E σ_s p(0) e^{−σ_t s} (1 − e^{−σ_t}) / σ_t.
#[test]
fn single_scattering_in_a_box() {
    let Some(gpu) = gpu() else { return };
    for (phase, value) in [
        ("\"isotropic\"", 1.0 / (4.0 * std::f64::consts::PI)),
        ("\"rayleigh\"", 3.0 / (16.0 * std::f64::consts::PI)),
        ("{ hg = { g = 0.5 } }", 0.75 / (4.0 * std::f64::consts::PI * 1.25f64.powf(1.5))),
    ] {
        let text = format!(
            "{CAMERA}lights.sun.directional = {{ direction = [0, -1, 0], irradiance = [1, 10, 100] }}\n\
             [media.slab]\ndensity.homogeneous = {UNIT_BOX}\n\
             optics.coefficients = {{ sigma_s = [1, 2, 3], sigma_a = [0, 0.5, 3], phase = {phase} }}"
        );
        let expected = [(1.0, 1.0, 1.0), (10.0, 2.0, 2.5), (100.0, 3.0, 6.0f64)]
            .map(|(e, sigma_s, sigma_t)| e * sigma_s * value * (-0.5 * sigma_t).exp() * -(-sigma_t).exp_m1() / sigma_t);
        assert_radiance(&picture(&gpu, &world(&text)), expected, tolerance::SINGLE_SCATTERING);
    }
}

/// The direction of scattering: with the sun behind the camera light is scattered backward, p(−1), with the sun ahead
/// forward, p(1): for g = 0.5 their ratio is ((1 + g)/(1 − g))³ = 27. Thin, so that nothing else matters.
#[test]
fn forward_is_forward() {
    let Some(gpu) = gpu() else { return };
    let from = |z: i32| {
        let text = format!(
            "{CAMERA}lights.sun.directional = {{ direction = [0, 0, {z}], irradiance = 1 }}\n[media.slab]\n\
             density.homogeneous = {UNIT_BOX}\noptics.coefficients = {{ sigma_s = 1e-4, phase.hg.g = 0.5 }}"
        );
        f64::from(picture(&gpu, &world(&text)).pixels[0][0])
    };
    let ratio = from(1) / from(-1);
    assert!((ratio / 27.0 - 1.0).abs() < 1e-3, "{ratio}");
}

/// The environment's directions integrate a smooth phase function: a thin isotropic medium scatters σ_s L of a constant
/// environment, and lets through 1 − σ_s.
#[test]
fn the_environment_scatters() {
    let Some(gpu) = gpu() else { return };
    let text = format!(
        "{CAMERA}lights.sky.constant.radiance = 2\n[media.slab]\ndensity.homogeneous = {UNIT_BOX}\n\
         optics.coefficients.sigma_s = 1e-3"
    );
    assert_radiance(&picture(&gpu, &world(&text)), [2.0; 3], 1e-4);
}

/// An invocation that may do little needs many rounds, and gives the same picture.
#[test]
fn rounds_do_not_show() {
    let Some(mut gpu) = gpu() else { return };
    let text = PLUME.replace("[640, 480]", "[40, 30]") + "\n[techniques.march]\nsamples = 3\n";
    let world = world_of(&text, &shipped());
    let few = picture(&gpu, &world);
    gpu.limit_iterations(2_000);
    assert_same(&picture(&gpu, &world), &few, tolerance::ROUNDS);
}

/// The plume with sun against the reference at equal scattering depth (`tests/references/plume-single.exr`).
#[test]
fn the_plume_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let reference = exr::decode(include_bytes!("../../../../../tests/references/plume-single.exr")).unwrap();
    let scene = PLUME.replace("[640, 480]", "[320, 240]");
    let error = |settings: &str| {
        let world = world_of(&format!("{scene}\n[techniques.march]\n{settings}"), &shipped());
        let (image, reference) = (Picture::Linear(picture(&gpu, &world)), Picture::Linear(reference.clone()));
        let linear = metrics::compare(&image, &reference, &Default::default()).unwrap().linear.unwrap();
        (linear.relative_bias.unwrap(), linear.reference_noise.unwrap())
    };
    let (default, noise) = error("");
    let (high, _) = error("step = 0.5\nlight_step = 1\nsamples = 8");
    let (coarse, _) = error("step = 12\nlight_step = 24");
    assert!(noise < tolerance::PLUME_DEFAULT, "the reference's noise, {noise}, leaves the test some power");
    assert!(default <= tolerance::PLUME_DEFAULT, "{default}");
    assert!(high <= tolerance::PLUME_HIGH, "{high}");
    assert!(coarse > tolerance::PLUME_DEFAULT, "the test sees that steps of 12 voxels are wrong by {coarse}");
}

/// The plume as fire against the marcher's own brute force: steps ten times shorter than the defaults.
#[test]
fn fire_converges() {
    let Some(gpu) = gpu() else { return };
    let scene = FIRE.replace("[640, 480]", "[40, 30]");
    let render = |settings: &str| {
        let world = world_of(&format!("{scene}\n[techniques.march]\n{settings}"), &shipped());
        picture(&gpu, &world)
    };
    let brute = render("step = 0.1\nlight_step = 0.4\ntermination = 0");
    let error = |image: Image| metrics::linear::linear_errors(&image, &brute).relative_rmse;
    let (default, half) = (error(render("")), error(render("step = 0.5\nlight_step = 1")));
    assert!(default < tolerance::PLUME_DEFAULT, "{default}");
    assert!(half < default, "{half} with half the step, {default} without");
}

fn assert_same(found: &Image, expected: &Image, tolerance: f64) {
    let error = metrics::linear::linear_errors(found, expected).relative_rmse;
    assert!(expected.pixels.iter().any(|p| Vec3::from(*p).max_element() > 0.0), "there is something to compare");
    assert!(error <= tolerance, "relative RMSE {error}");
}

#[test]
#[should_panic(expected = "relative RMSE")]
fn another_picture_is_caught() {
    let image = |value: f32| Image { width: 1, height: 1, pixels: vec![[value; 3]], ..Default::default() };
    assert_same(&image(1.0 + 1e-4), &image(1.0), tolerance::CONSTANT_GRID);
}
