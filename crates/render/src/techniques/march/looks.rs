//! What media can be and look like, in the marcher, against closed forms; and what its optimisations may change.

use std::sync::Arc;

use glam::{Mat4, Vec3};
use tyndall_scene::description::Phase;
use tyndall_scene::image::{Image, Picture};
use tyndall_scene::phase::PhaseFunction;
use tyndall_scene::volume::{Grid, Voxels};
use tyndall_scene::{Field, PlacedGrid, Temperature, World, black_body, metrics};

use super::TECHNIQUE;
use crate::renderer::read_film;
use crate::resident::Resident;
use crate::test::{FIRE, PLUME, gpu, picture, shipped, tolerance, world, world_of};
use crate::{Frame, Gpu};

/// Looks along −z through the middle of the unit cube around the origin, nearly perpendicular to its faces.
const CAMERA: &str = "camera = { position = [0, 0, 5], target = [0, 0, 0], fov = 0.001 }\nfilm.size = [2, 2]\n";
const SKY: &str = "lights.sky.constant.radiance = 1\n";
const BOX: &str = "{ min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }";

fn assert_radiance(image: &Image, expected: [f64; 3], tolerance: f64) {
    for pixel in &image.pixels {
        for c in 0..3 {
            let error = (f64::from(pixel[c]) - expected[c]).abs() / expected[c].abs().max(1e-6);
            assert!(error <= tolerance, "{pixel:?} for {expected:?}");
        }
    }
}

/// A world with the media of `text`, and its picture.
fn seen(gpu: &Gpu, text: &str) -> Image {
    picture(gpu, &world(&format!("{CAMERA}{text}")))
}

/// Replaces the first medium's field by a grid of 32 voxels a side over the unit cube.
fn with_grid(mut world: World, value: impl Fn(Vec3) -> f32) -> World {
    world.volumes[0].field = Field::Grid(grid(value));
    world
}

fn grid(value: impl Fn(Vec3) -> f32) -> Arc<Grid> {
    const SIDE: u32 = 32;
    let at = |i: u32| Vec3::new((i % SIDE) as f32, (i / SIDE % SIDE) as f32, (i / SIDE / SIDE) as f32) + 0.5;
    let voxels = (0..SIDE.pow(3)).map(|i| value(at(i) / SIDE as f32)).collect();
    Arc::new(Grid::dense([SIDE; 3], Voxels::F32(voxels), Mat4::IDENTITY))
}

/// A ball: e^{−σ 2r} through its middle, at fine steps, as its edge is hard.
#[test]
fn a_ball() {
    let Some(gpu) = gpu() else { return };
    let image = seen(
        &gpu,
        &format!(
            "{SKY}techniques.march = {{ model = \"absorption\", step = 0.1 }}\n[media.ball]\n\
             density.sphere = {{ center = [0, 0, 0], radius = 0.4, falloff = 0 }}\noptics.coefficients.sigma_a = 2"
        ),
    );
    assert_radiance(&image, [(-2.0f64 * 0.8).exp(); 3], 5e-3);
}

/// An expression of an exponential is the exponential: its integral along y in closed form.
#[test]
fn an_expression() {
    let Some(gpu) = gpu() else { return };
    let text = "camera = { position = [0.5, -3, 0.5], target = [0.5, 0, 0.5], up = [0, 0, 1], fov = 0.001 }\n\
        film.size = [2, 2]\nlights.sky.constant.radiance = 1\ntechniques.march.model = \"absorption\"\n[media.other]\n\
        density.expression = { min = [0, 0, 0], max = [1, 1, 1], wgsl = \"exp(-p.y / 0.3)\" }\n\
        optics.coefficients.sigma_a = 4";
    let depth = 4.0 * 0.3 * -(-1.0f64 / 0.3).exp_m1();
    assert_radiance(&picture(&gpu, &world(text)), [(-depth).exp(); 3], tolerance::SMOOTH);
}

/// Noise on the device is that of the scene: the mean of its values along the ray, by the scene's own.
#[test]
fn noise() {
    let Some(gpu) = gpu() else { return };
    let world = world(&format!(
        "{CAMERA}{SKY}techniques.march.model = \"absorption\"\n[media.other]\noptics.coefficients.sigma_a = 3\n\
         density.noise = {{ min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5], scale = 0.4, octaves = 3, threshold = -0.2 }}"
    ));
    let value = |z: f64| f64::from(world.volumes[0].field.value(Vec3::new(0.5, 0.5, z as f32)));
    let mean = (0..4000).map(|i| value((f64::from(i) + 0.5) / 4000.0)).sum::<f64>() / 4000.0;
    assert!(mean > 0.05, "{mean}");
    assert_radiance(&picture(&gpu, &world), [(-3.0 * mean).exp(); 3], 1e-3);
}

/// A plane cuts half of a slab away.
#[test]
fn a_clip_plane() {
    let Some(gpu) = gpu() else { return };
    let image = seen(
        &gpu,
        &format!(
            "{SKY}techniques.march.model = \"absorption\"\n[media.slab]\ndensity.homogeneous = {BOX}\n\
             clip.planes = [{{ point = [0, 0, 0], normal = [0, 0, 1] }}]\noptics.coefficients.sigma_a = [0.5, 2, 8]"
        ),
    );
    assert_radiance(&image, [0.25f64, 1.0, 4.0].map(|depth| (-depth).exp()), tolerance::EXACT);
}

fn hot(kelvin: f32) -> Temperature {
    let unit_from_world = Mat4::from_translation(Vec3::splat(0.5));
    let grid = PlacedGrid { grid: grid(|_| 1.0), unit_from_world };
    Temperature { grid, kelvin, offset: 0.0, radiance_scale: 1e-3 }
}

/// A slab at one temperature: (1 − e^{−σ_a}) B(T).
#[test]
fn a_black_body() {
    let Some(gpu) = gpu() else { return };
    let mut world = world(&format!(
        "{CAMERA}techniques.march.model = \"emission\"\n[media.slab]\ndensity.homogeneous = {BOX}\n\
         optics.coefficients.sigma_a = 2"
    ));
    world.volumes[0].temperature = Some(hot(2500.0));
    let expected = (black_body(2500.0) * 1e-3).as_dvec3() * -(-2f64).exp_m1();
    assert_radiance(&picture(&gpu, &world), expected.to_array(), 1e-3);
}

/// A grey of one half takes half of what is scattered, and keeps the extinction.
#[test]
fn a_colour_grid() {
    let Some(gpu) = gpu() else { return };
    let scene = |sigma_s: f32, sigma_a: f32| {
        world(&format!(
            "{CAMERA}lights.sun.directional = {{ direction = [0, -1, 0], irradiance = 3 }}\n[media.slab]\n\
             density.homogeneous = {BOX}\noptics.coefficients = {{ sigma_s = {sigma_s}, sigma_a = {sigma_a} }}"
        ))
    };
    let mut grey = scene(2.0, 1.0);
    let placed = |value: f32| PlacedGrid {
        grid: grid(move |_| value),
        unit_from_world: Mat4::from_translation(Vec3::splat(0.5)),
    };
    grey.volumes[0].color = Some(tyndall_scene::Color { grids: [placed(0.5), placed(1.0), placed(0.0)] });
    let [half, full, none] =
        [scene(1.0, 2.0), scene(2.0, 1.0), scene(0.0, 3.0)].map(|w| picture(&gpu, &w).pixels[0][0]);
    // The same pixel: the rows of the picture differ by a ten-thousandth.
    let found = Image { width: 1, height: 1, pixels: picture(&gpu, &grey).pixels[..1].to_vec(), ..Default::default() };
    assert_radiance(&found, [half, full, none].map(f64::from), tolerance::EXACT);
}

/// A table of Henyey–Greenstein's values scatters as the formula does; one of another g does not.
#[test]
fn a_phase_table() {
    let Some(gpu) = gpu() else { return };
    let scene = || {
        world(&format!(
            "{CAMERA}lights.sun.directional = {{ direction = [0.3, -1, -0.6], irradiance = 3 }}\n[media.slab]\n\
             density.homogeneous = {BOX}\noptics.coefficients = {{ sigma_s = 2, phase.hg.g = 0.6 }}"
        ))
    };
    let expected = picture(&gpu, &scene()).pixels[0].map(f64::from);
    let table = |g: f64| {
        let hg = |theta: f64| (1.0 - g * g) / (1.0 + g * g - 2.0 * g * theta.to_radians().cos()).powf(1.5);
        let angles: Vec<_> = (0..=720).map(|i| f64::from(i) / 4.0).collect();
        let values: Vec<_> = angles.iter().map(|angle| hg(*angle)).collect();
        let text = format!(
            "{CAMERA}[media.slab]\ndensity.homogeneous = {BOX}\n[media.slab.optics.coefficients]\nsigma_s = 2\n\
             phase.tabulated = {{ angles = {angles:?}, values = {values:?} }}"
        );
        let mut tabulated = scene();
        let phase: Phase = world(&text).volumes[0].optics.phase();
        tabulated.volumes[0].phase = PhaseFunction::new(&phase, "phase").unwrap();
        picture(&gpu, &tabulated)
    };
    assert_radiance(&table(0.6), expected, 1e-3);
    let other = f64::from(table(0.4).pixels[0][0]);
    assert!((other / expected[0] - 1.0).abs() > 0.05, "{other} for {expected:?}");
}

/// A thin isotropic medium scatters σ_s times the mean radiance of any sky: what the map's lights together have.
#[test]
fn a_sky() {
    let Some(gpu) = gpu() else { return };
    let mut assets = shipped();
    assets.0.push(("sky.exr", include_bytes!("../../../../../scenes/sky.exr")));
    let scene = |directions: u32| {
        world_of(
            &format!(
                "{CAMERA}lights.sky.environment.file = \"sky.exr\"\ntechniques.march.environment_directions = {directions}\n\
                 [media.slab]\ndensity.homogeneous = {BOX}\noptics.coefficients = {{ sigma_s = 0.01, sigma_a = 0 }}"
            ),
            &assets,
        )
    };
    let world = scene(0);
    let map = world.environment.clone().unwrap();
    let behind = map.radiance(Vec3::NEG_Z).as_dvec3();
    // Devices may be wrong by 4096 roundings in the angles of a direction [WGSL, accuracy of atan2].
    assert_radiance(&picture(&gpu, &world), (behind * (-0.01f64).exp()).to_array(), 5e-4);
    let row = |y: u32| (std::f64::consts::PI * (f64::from(y) + 0.5) / f64::from(map.height)).sin();
    let (mut mean, mut weight) = (glam::DVec3::ZERO, 0.0);
    for (i, pixel) in map.pixels.iter().enumerate() {
        let w = row(i as u32 / map.width);
        mean += Vec3::from(*pixel).as_dvec3() * w;
        weight += w;
    }
    let scattered = mean / weight * 0.01;
    // To first order in the depth of 0.01; it is the sky's light that is under test, not what is behind.
    let image = picture(&gpu, &scene(32));
    for c in 0..3 {
        let found = f64::from(image.pixels[0][c]) - behind[c] * (-0.01f64).exp();
        assert!((found / scattered[c] - 1.0).abs() < 0.02, "{found} for {}", scattered[c]);
    }
}

/// In a thin medium nothing is attenuated: octaves of strength a add up to 1 + a + a².
#[test]
fn octaves_add_up() {
    let Some(gpu) = gpu() else { return };
    let with = |octaves: u32| {
        let text = format!(
            "lights.sun.directional = {{ direction = [0, -1, 0], irradiance = 3 }}\n\
             techniques.march = {{ octaves = {octaves}, octave_strength = 0.5 }}\n[media.slab]\n\
             density.homogeneous = {BOX}\noptics.coefficients.sigma_s = 1e-4"
        );
        f64::from(seen(&gpu, &text).pixels[0][0])
    };
    assert!((with(2) / with(0) / 1.75 - 1.0).abs() < 1e-3);
}

const RAMP: &str = "[media.slab]\ndensity.homogeneous = { min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }\n\
    [media.slab.optics.transfer]\nunit_length = 1\n\
    stops = [{ value = -1, opacity = 0.5, color = [0, 0, 0] }, { value = 2, opacity = 0.5, color = [0, 0, 0] }]\n";

/// An opaque surface where a ramp has a value, behind as much of a medium as there is before it: e^{−σ_a d} of its colour, at
/// coarse steps, too, as the surface is found within the step.
#[test]
fn an_isosurface() {
    let Some(gpu) = gpu() else { return };
    for step in [1.0, 7.3] {
        let world = with_grid(
            world(&format!(
                "{CAMERA}techniques.march = {{ model = \"emission\", step = {step} }}\n{RAMP}\
                 isosurfaces = [{{ value = 0.3, color = [1, 0.5, 0.25], opacity = 1 }}]"
            )),
            |p| p.z,
        );
        // From z = 0.5 to where the ramp, z + 0.5, is 0.3.
        let passed = 0.5f64.powf(0.7);
        let expected = [passed, 0.5 * passed, 0.25 * passed];
        assert_radiance(&picture(&gpu, &world), expected, 2e-4);
    }
}

/// Blinn–Phong by the light at the eye, face on: colour·(ambient + diffuse) + specular.
#[test]
fn shading() {
    let Some(gpu) = gpu() else { return };
    let text = format!(
        "{CAMERA}techniques.march.model = \"emission\"\n{}shading = {{ ambient = 0.2, diffuse = 0.5, specular = 0.1, shininess = 8 }}",
        RAMP.replace("[0, 0, 0]", "[1, 0.5, 0]")
    );
    let world = with_grid(world(&text), |p| p.z);
    // Within half a voxel of the faces the ramp is flat, where colours are as they are.
    let expected = [0.8, 0.45, 0.1].map(|c| c * 0.5);
    assert_radiance(&picture(&gpu, &world), expected, 0.03);
}

/// Where the gradient says that nothing is seen, nothing is.
#[test]
fn opacity_by_the_gradient() {
    let Some(gpu) = gpu() else { return };
    let seen = |slope: f32| {
        let text = format!(
            "{CAMERA}{SKY}techniques.march.model = \"absorption\"\n{RAMP}\
             gradient_opacity = [{{ gradient = 0, factor = 0 }}, {{ gradient = 1, factor = 1 }}]"
        );
        f64::from(picture(&gpu, &with_grid(world(&text), move |p| p.z * slope)).pixels[0][0])
    };
    // At the faces, where the grid goes on as it ends, central differences see half the slope for half a voxel.
    assert!((seen(0.0) - 1.0).abs() < 1e-5, "{}", seen(0.0));
    assert!((seen(1.0) - 0.5).abs() < 0.02, "{}", seen(1.0));
    assert!((seen(0.5) - 0.5f64.sqrt()).abs() < 0.02, "{}", seen(0.5));
}

/// The relative RMSE of the plume, or of the fire, with some settings against the same with others.
fn difference(gpu: &Gpu, scene: &str, settings: &str, against: &str) -> f64 {
    let render = |settings: &str| {
        let text = format!("{}\n[techniques.march]\n{settings}", scene.replace("[640, 480]", "[80, 60]"));
        picture(gpu, &world_of(&text, &shipped()))
    };
    let (found, expected) = (Picture::Linear(render(settings)), Picture::Linear(render(against)));
    metrics::compare(&found, &expected, &Default::default()).unwrap().linear.unwrap().relative_rmse
}

/// What is passed over is empty: the picture does not change.
#[test]
fn skipping_changes_nothing() {
    let Some(gpu) = gpu() else { return };
    for scene in [PLUME, FIRE] {
        let error = difference(&gpu, scene, "empty_space_skipping = \"on\"", "empty_space_skipping = \"off\"");
        assert!(error <= tolerance::ROUNDS, "{error}");
    }
}

/// One volume with voxels has a march of its own (`grid.wesl`), which is that of any media: a second medium, out of sight,
/// makes it one of many. Gradients are taken across bricks, also those that are all alike.
#[test]
fn one_grid_is_marched_as_many_media() {
    let Some(gpu) = gpu() else { return };
    let stops = "unit_length = 0.1, stops = [{ value = 0.1, opacity = 0, color = [1, 0.2, 0.1] }, \
                 { value = 0.8, opacity = 0.4, color = [0.2, 0.4, 1] }]";
    let shading = "shading = { ambient = 0.1, diffuse = 0.6, specular = 0.3, shininess = 20 }";
    let slopes = "gradient_opacity = [{ gradient = 0, factor = 0 }, { gradient = 3, factor = 1 }]";
    for (optics, settings) in [
        ("coefficients = { sigma_a = [2, 4, 8], emission = [9, 4, 1] }".into(), "model = \"absorption\""),
        (format!("transfer = {{ {stops} }}"), "model = \"emission\"\njitter = \"blue_noise\""),
        (format!("transfer = {{ {stops}, {shading}, {slopes} }}"), "model = \"emission\""),
    ] {
        let seen = |settings: &str, other: &str| {
            let scene = format!(
                "camera = {{ position = [1.1, 0.7, 1.4], target = [0, 0, 0], fov = 50 }}\nfilm.size = [40, 30]\n\
                 lights.sky.constant.radiance = 0.1\n[techniques.march]\ntermination = 0\n{settings}\n[media.blob]\n\
                 density.homogeneous = {BOX}\nclip.planes = [{{ point = [0.2, 0.1, 0], normal = [1, 1, 0] }}]\noptics.{optics}\n{other}"
            );
            // A brick in its middle is all alike, and so are those at its rim.
            let ball = |p: Vec3| 0.6 * ((0.45 - (p - 0.4).length()) / 0.1).clamp(0.0, 1.0);
            picture(&gpu, &with_grid(world(&scene), ball))
        };
        let other = "[media.other]\ndensity.homogeneous = { min = [5, 5, 5], max = [6, 6, 6] }\noptics.coefficients.sigma_a = 0";
        let (found, expected) = (Picture::Linear(seen(settings, "")), Picture::Linear(seen(settings, other)));
        let errors = metrics::compare(&found, &expected, &Default::default()).unwrap().linear.unwrap();
        assert!(errors.relative_rmse <= tolerance::ONE_GRID, "{optics}, {settings}: {}", errors.relative_rmse);
    }
}

/// One read of a stored gradient gives what six reads of values give, in a grid that is alone and beside another medium, with
/// bricks that are all alike and without.
#[test]
fn stored_gradients_are_those_of_six_neighbours() {
    let Some(gpu) = gpu() else { return };
    let ball = |p: Vec3| 0.6 * ((0.45 - (p - 0.4).length()) / 0.1).clamp(0.0, 1.0);
    let waves = |p: Vec3| 0.4 + 0.2 * (p * Vec3::new(9.0, 14.0, 23.0)).element_sum().sin() + 0.1 * p.x;
    for (flat, other) in [
        (false, ""),
        (true, ""),
        (
            true,
            "[media.other]\ndensity.homogeneous = { min = [-1, -1, -1], max = [1, 1, 1] }\noptics.coefficients.sigma_a = 0.1",
        ),
    ] {
        let text = format!(
            "camera = {{ position = [1.1, 0.7, 1.4], target = [0, 0, 0], fov = 50 }}\nfilm.size = [40, 30]\n\
             [techniques.march]\nmodel = \"emission\"\n[media.grid]\ndensity.homogeneous = {BOX}\n\
             optics.transfer = {{ unit_length = 0.1, stops = [{{ value = 0.1, opacity = 0, color = [1, 0.2, 0.1] }}, \
             {{ value = 0.8, opacity = 0.4, color = [0.2, 0.4, 1] }}], \
             shading = {{ ambient = 0.1, diffuse = 0.6, specular = 0.3, shininess = 20 }}, \
             gradient_opacity = [{{ gradient = 0, factor = 0 }}, {{ gradient = 3, factor = 1 }}] }}\n{other}"
        );
        let world = if flat { with_grid(world(&text), ball) } else { with_grid(world(&text), waves) };
        let seen = |stored: bool| {
            let resident = pollster::block_on(async {
                let resident = Resident::new(&gpu, &world).await?;
                assert!(resident.has_gradients() && resident.flat == flat);
                if stored { Ok(resident) } else { resident.without_gradients(&gpu).await }
            });
            let chosen = crate::techniques::chosen(&world.scene).unwrap();
            let (_, settings) = chosen.iter().find(|(technique, _)| technique.name == TECHNIQUE.name).unwrap();
            let frame = Frame::record(&gpu, &world, resident.unwrap(), settings, TECHNIQUE.record);
            let mut frame = pollster::block_on(frame).unwrap();
            frame.render();
            let pixels = pollster::block_on(read_film(&gpu, frame.film())).unwrap();
            let [width, height] = world.scene.film.size;
            Picture::Linear(Image { width, height, pixels, ..Default::default() })
        };
        let errors = metrics::compare(&seen(true), &seen(false), &Default::default()).unwrap().linear.unwrap();
        assert!(errors.relative_rmse <= tolerance::STORED_GRADIENTS, "{flat}, {other}: {}", errors.relative_rmse);
    }
}

/// Both orders of compositing give one picture, but for what termination leaves out.
#[test]
fn both_orders_agree() {
    let Some(gpu) = gpu() else { return };
    for scene in [PLUME, FIRE] {
        let error = difference(&gpu, scene, "order = \"back_to_front\"", "termination = 0");
        assert!(error <= 1e-4, "{error}");
    }
}

/// Longer steps in thin parts, pre-integration, jitter and a lower resolution cost what docs/volumes.md says, and no more;
/// and each does something.
#[test]
fn optimisations_are_bounded() {
    let Some(gpu) = gpu() else { return };
    for (scene, settings, least, most) in [
        (PLUME, "tolerance = 0.02", 1e-6, 0.01),
        (FIRE, "preintegration = \"on\"", 1e-6, 0.03),
        (PLUME, "jitter = \"blue_noise\"", 1e-4, 0.04),
        (PLUME, "resolution = \"half\"", 1e-4, 0.25),
    ] {
        let error = difference(&gpu, scene, &format!("samples = 64\n{settings}"), "samples = 64");
        assert!((least..most).contains(&error), "{settings}: {error}");
    }
}

/// A thin shell in smooth data: pre-integration has all of it at steps that pass over it, where the middle of the step sees
/// nothing, or too much.
#[test]
fn preintegration_pays() {
    let Some(gpu) = gpu() else { return };
    let seen = |preintegration: &str| {
        let text = format!(
            "{CAMERA}{SKY}techniques.march = {{ model = \"absorption\", step = 7, preintegration = \"{preintegration}\" }}\n\
             [media.slab]\ndensity.homogeneous = {BOX}\n[media.slab.optics.transfer]\nunit_length = 0.01\n\
             stops = [{{ value = 0, opacity = 0, color = [0, 0, 0] }}, {{ value = 0.6, opacity = 0, color = [0, 0, 0] }}, \
             {{ value = 0.601, opacity = 0.2, color = [0, 0, 0] }}, {{ value = 0.61, opacity = 0.2, color = [0, 0, 0] }}, \
             {{ value = 0.611, opacity = 0, color = [0, 0, 0] }}, {{ value = 1, opacity = 0, color = [0, 0, 0] }}]"
        );
        f64::from(picture(&gpu, &with_grid(world(&text), |p| p.z)).pixels[0][0])
    };
    // The flat part is 0.009 long, the flanks, over which opacity is linear, add their integral.
    let flank = (0..1000).map(|i| -(-0.2 * (f64::from(i) + 0.5) / 1000.0f64).ln_1p() * 1e-6).sum::<f64>();
    let expected = (-(0.009 * -(-0.2f64).ln_1p() + 2.0 * flank) / 0.01).exp();
    let (with, without) = (seen("on"), seen("off"));
    assert!((with / expected - 1.0).abs() < 5e-3, "{with} for {expected}");
    assert!((without / expected - 1.0).abs() > 0.1, "{without} for {expected}");
}

/// Opacity is corrected for the step: 1 − (1 − α)^{length/unit}, however long the steps are.
#[test]
fn opacity_does_not_depend_on_the_step() {
    let Some(gpu) = gpu() else { return };
    for step in [0.3, 1.0, 7.3] {
        let settings = format!("techniques.march = {{ model = \"absorption\", step = {step} }}\n");
        let text = format!("{CAMERA}{SKY}{settings}{}", RAMP.replace("unit_length = 1", "unit_length = 0.25"));
        assert_radiance(&picture(&gpu, &with_grid(world(&text), |p| p.z)), [0.5f64.powi(4); 3], tolerance::EXACT);
    }
}

/// Rays are cut from where they enter a volume, not from the eye: an eye that moves along its rays sees the same.
#[test]
fn the_ray_starts_at_the_volume() {
    let Some(gpu) = gpu() else { return };
    let from = |z: f64| {
        let text = format!(
            "camera = {{ position = [0, 0, {z}], target = [0, 0, 0], fov = 0.001 }}\nfilm.size = [2, 2]\n\
             techniques.march = {{ model = \"emission\", step = 3 }}\n{}",
            RAMP.replace("color = [0, 0, 0] }, { value = 2", "color = [1, 0, 0] }, { value = 2")
        );
        picture(&gpu, &with_grid(world(&text), |p| (40.0 * p.z).sin())).pixels[0].map(f64::from)
    };
    let (near, far) = (from(4.0), from(4.013));
    assert!(near[0] > 0.01 && (near[0] / far[0] - 1.0).abs() < 1e-4, "{near:?} {far:?}");
}
