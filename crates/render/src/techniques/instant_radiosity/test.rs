//! Instant radiosity against closed forms.

mod scenes;

use glam::Vec3;
use tyndall_scene::World;
use tyndall_scene::image::{Image, Picture};
use tyndall_scene::metrics;
use tyndall_scene::parameter::Settings;
use tyndall_scene::surface::{Bsdf, Material};

use super::vpl::Vpl;
use super::{TECHNIQUE, Walk, Walkthrough, walk};
use crate::test::{gpu, picture, tolerance, world};

/// A cube of quads that face inwards, of reflectance and radiance, seen from within.
pub(crate) fn furnace(reflectance: f32, radiance: f32, settings: &str) -> World {
    let quad = |name: &str, corner: [f32; 3], u: [f32; 3], v: [f32; 3]| {
        format!(
            "[surfaces.{name}]\nshape.quad = {{ corner = {corner:?}, edges = [{u:?}, {v:?}] }}\nmaterial = \"m\"\nradiance = {radiance}\n"
        )
    };
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    world(&format!(
        "camera = {{ position = [0.5, 0.45, 0.9], target = [0.3, 0.2, 0], fov = 90 }}\nfilm.size = [32, 32]\n\
         [materials.m.lambert]\nreflectance = {reflectance}\n[techniques.instant_radiosity]\n{settings}\n{}{}{}{}{}{}",
        quad("back", [0.0; 3], x, y),
        quad("front", z, y, x),
        quad("bottom", [0.0; 3], z, x),
        quad("top", y, x, z),
        quad("left", [0.0; 3], y, z),
        quad("right", x, z, y),
    ))
}

/// L = L_e/(1 − ρ) everywhere [truth 1].
#[test]
fn furnace_with_compensation() {
    let Some(gpu) = gpu() else { return };
    let mean = |settings: &str| {
        let image = picture(&gpu, &furnace(0.5, 1.0, settings));
        image.pixels.iter().map(|p| p[0]).sum::<f32>() / image.pixels.len() as f32
    };
    let compensated = mean("paths = 256\nclamp = 0.2");
    let clamped = mean("paths = 256\nclamp = 0.2\ncompensation = \"off\"");
    println!("furnace 2: {compensated} with compensation, {clamped} clamped: {:.1} % lost", 50.0 * (2.0 - clamped));
    assert!((compensated / 2.0 - 1.0).abs() < tolerance::FURNACE, "{compensated}");
    assert!(clamped < 2.0 * (1.0 - 2.0 * tolerance::FURNACE), "{clamped}: clamping must be seen");
}

/// The Cornell box: a cube of a metre with a light in its ceiling, and two blocks.
pub(crate) fn cornell(size: u32, settings: &str, more: &str) -> World {
    world(&format!(
        "camera = {{ position = [0.5, 0.5, 2.4], target = [0.5, 0.5, 0], fov = 38 }}\nfilm.size = [{size}, {size}]\n\
         [techniques.instant_radiosity]\n{settings}\n{CORNELL}\n{more}"
    ))
}

const CORNELL: &str = r#"
[materials.white.lambert]
reflectance = 0.73
[materials.red.lambert]
reflectance = [0.63, 0.065, 0.05]
[materials.green.lambert]
reflectance = [0.14, 0.45, 0.09]
[surfaces.floor]
shape.quad = { corner = [0, 0, 0], edges = [[0, 0, 1], [1, 0, 0]] }
material = "white"
[surfaces.ceiling]
shape.quad = { corner = [0, 1, 0], edges = [[1, 0, 0], [0, 0, 1]] }
material = "white"
[surfaces.back]
shape.quad = { corner = [0, 0, 0], edges = [[1, 0, 0], [0, 1, 0]] }
material = "white"
[surfaces.left]
shape.quad = { corner = [0, 0, 0], edges = [[0, 1, 0], [0, 0, 1]] }
material = "red"
[surfaces.right]
shape.quad = { corner = [1, 0, 0], edges = [[0, 0, 1], [0, 1, 0]] }
material = "green"
[surfaces.lamp]
shape.quad = { corner = [0.38, 0.998, 0.4], edges = [[0.24, 0, 0], [0, 0, 0.2]] }
material = "white"
radiance = [17, 12, 5]
[surfaces.tall]
shape.box = { min = [-0.15, 0, -0.15], max = [0.15, 0.6, 0.15] }
material = "white"
transform = { rotate = [0, 17, 0], translate = [0.33, 0, 0.35] }
[surfaces.short]
shape.box = { min = [-0.15, 0, -0.15], max = [0.15, 0.3, 0.15] }
material = "white"
transform = { rotate = [0, -16, 0], translate = [0.67, 0, 0.65] }
"#;

/// The reference's picture of a world, of light scattered up to `depth` times.
pub(crate) fn reference(world: &World, depth: Option<u32>, samples: u32, caustics: bool) -> Image {
    let options = tyndall_reference::Options { samples: Some(samples), depth, caustics, ..Default::default() };
    tyndall_reference::render(world, &options, None, &mut |_| std::ops::ControlFlow::Continue(())).unwrap()
}

/// The same as it lies in `tests/references`. TYNDALL_BLESS makes it anew.
fn kept(name: &str, world: &World, depth: Option<u32>, samples: u32, caustics: bool) -> Image {
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/references"));
    let path = folder.join(format!("radiosity-{name}.exr"));
    if std::env::var_os("TYNDALL_BLESS").is_some() {
        reference(world, depth, samples, caustics).write(&path, 0.0).unwrap();
    }
    let image = Image::read(&path).unwrap_or_else(|error| panic!("{error} (TYNDALL_BLESS=1 makes it)"));
    let distance = noises(&reference(world, depth, 64, caustics), &image);
    println!("{name}: the reference is {distance:.2} from its scene");
    assert!(
        distance < tolerance::KEPT,
        "{name}: {distance}: the reference is of another scene (TYNDALL_BLESS=1 makes it)"
    );
    image
}

/// The mean square of the difference between a quick picture and a kept one, over its variance by what samples of the kept one vary: 1 if
/// both are of one scene.
fn noises(quick: &Image, kept: &Image) -> f64 {
    let [few, many] = [quick, kept].map(|image| image.statistics.as_ref().unwrap());
    let of = |(i, c): (usize, usize)| {
        let samples = 1.0 / f64::from(few.samples[i]) + 1.0 / f64::from(many.samples[i]);
        let [a, b] = [quick, kept].map(|image| f64::from(image.pixels[i][c]));
        // What does not vary, as lamps, is the same but for roundings.
        (a - b).powi(2) / (f64::from(many.variance[i][c]) * samples + (1e-4 * b).powi(2) + 1e-12)
    };
    let count = quick.pixels.len();
    (0..count).flat_map(|i| (0..3).map(move |c| (i, c))).map(of).sum::<f64>() / (3 * count) as f64
}

/// A kept reference of another scene is found out: a lamp that is brighter by a tenth, a wall of another colour.
#[test]
fn references_of_other_scenes_are_found_out() {
    let kept = reference(&cornell(16, "", ""), Some(4), 512, true);
    let of = |from: &str, to: &str| {
        let changed = world(&format!(
            "camera = {{ position = [0.5, 0.5, 2.4], target = [0.5, 0.5, 0], fov = 38 }}\nfilm.size = [16, 16]\n{}",
            CORNELL.replace(from, to)
        ));
        noises(&reference(&changed, Some(4), 64, true), &kept)
    };
    let [same, brighter, redder] = [of("", ""), of("[17, 12, 5]", "[18.7, 13.2, 5.5]"), of("0.63", "0.8")];
    println!("noises: {same:.2}; a brighter lamp {brighter:.2}, a redder wall {redder:.2}");
    assert!(same < tolerance::KEPT && brighter > tolerance::KEPT && redder > tolerance::KEPT);
}

/// The virtual lights of a world, by its scene's settings.
fn vpls(world: &World) -> Vec<Vpl> {
    let given = world.scene.techniques.get(TECHNIQUE.name);
    let settings = Settings::new(TECHNIQUE.name, TECHNIQUE.parameters, given).unwrap();
    Walk::new(world, &settings).unwrap().lights()
}

/// The counts of survivors are those of the paper's loop, and there are fewer than N/(1 − ρ̄) images. [Keller97]
#[test]
fn survivors_are_the_papers() {
    for paths in [1u32, 2, 10, 64, 1000] {
        for reflectivity in [0.0, 0.1, 0.5, 0.77, 0.99] {
            let counts = walk::survivors(paths, reflectivity, 1000);
            let images: u32 = counts.iter().sum();
            assert!(f64::from(images) < f64::from(paths) / (1.0 - reflectivity) + 1e-9);
            let (mut start, mut end, mut reflections) = (f64::from(paths), paths, 0);
            let mut rendered = vec![0; counts.len()];
            while end > 0 {
                start *= reflectivity;
                for _ in start as u32..end {
                    (0..=reflections).for_each(|j: usize| rendered[j] += 1);
                }
                reflections += 1;
                end = start as u32;
            }
            assert_eq!(rendered, counts, "{paths} paths, {reflectivity}");
        }
    }
    assert_eq!(walk::survivors(64, 0.5, 2), [64, 32, 16]);
}

/// In a closed enclosure bounce j has ρʲ of the power, whatever the sequence.
#[test]
fn power_is_conserved_per_bounce() {
    for sequence in ["jittered", "halton", "rooks", "random"] {
        let list = vpls(&furnace(0.5, 1.0, &format!("paths = 128\nsequence = \"{sequence}\"")));
        for bounce in 0..8 {
            let power: f32 = list.iter().filter(|v| v.bounce == bounce).map(|v| v.power.x * std::f32::consts::PI).sum();
            let expected = 6.0 * std::f32::consts::PI * 0.5f32.powi(bounce as i32);
            assert!((power / expected - 1.0).abs() < 1e-4, "{sequence}: {power} for {expected} at bounce {bounce}");
        }
        assert_eq!(list.len(), 128 + 64 + 32 + 16 + 8 + 4 + 2 + 1);
    }
}

/// The first points lie evenly on the lights: in each of 16 strips of a light about as many, each light by its power.
#[test]
fn first_points_are_even() {
    let list = vpls(&cornell(8, "paths = 1024\nbounces = 0\nsequence = \"halton\"", ""));
    assert_eq!(list.len(), 1024);
    for strip in 0..16 {
        let inside = |v: &&Vpl| ((v.position.x - 0.38) / 0.24 * 16.0) as i32 == strip;
        let count = list.iter().filter(inside).count();
        assert!((58..=70).contains(&count), "{count} in strip {strip}");
    }
    let area: f32 = list.iter().map(|v| v.power.x).sum();
    assert!((area / (17.0 * 0.24 * 0.2) - 1.0).abs() < 1e-4, "{area}");
}

/// The relative bias over the pixels that show no lamp: a lamp is so bright that it is most of what errors are relative to.
pub(crate) fn without_lamp(world: &World, image: &Image, truth: &Image) -> f64 {
    let lamps = reference(world, Some(0), 64, true);
    let kept = (0..truth.pixels.len()).filter(|&i| lamps.pixels[i] == [0.0; 3]);
    let statistics = truth.statistics.as_ref().unwrap();
    let (mut error, mut power) = (0.0, 0.0);
    for (i, c) in kept.flat_map(|i| (0..3).map(move |c| (i, c))) {
        let noise = f64::from(statistics.variance[i][c]) / f64::from(statistics.samples[i]);
        error += f64::from(image.pixels[i][c] - truth.pixels[i][c]).powi(2) - noise;
        power += f64::from(truth.pixels[i][c]).powi(2);
    }
    (error.max(0.0) / power).sqrt()
}

/// The relative bias (the RMSE but for the reference's noise) of the whole picture and without lamps, and the mean FLIP.
fn errors(world: &World, image: &Image, truth: &Image) -> [f64; 3] {
    let room = without_lamp(world, image, truth);
    let options = metrics::Options { exposure: world.scene.film.exposure, ..Default::default() };
    let [image, truth] = [image, truth].map(|image| Picture::Linear(image.clone()));
    let report = metrics::compare(&image, &truth, &options).unwrap();
    [report.linear.unwrap().relative_bias.unwrap(), room, report.flip_mean]
}

/// Holds a picture against the kept reference of a name.
fn assert_near(gpu: &crate::Gpu, name: &str, world: &World, depth: Option<u32>, samples: u32, tolerated: f64) {
    let [image, truth] = [picture(gpu, world), kept(name, world, depth, samples, true)];
    let [bias, room, flip] = errors(world, &image, &truth);
    println!("{name}: relative RMSE {:.2} %, without lamps {:.2} %, FLIP {flip:.4}", 100.0 * bias, 100.0 * room);
    assert!(bias <= tolerated, "{name}: {bias}");
    assert!(flip <= tolerance::RADIOSITY_FLIP, "{name}: FLIP {flip}");
}

#[test]
fn the_cornell_box_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    assert_near(&gpu, "cornell", &cornell(32, "paths = 256", ""), None, 4096, tolerance::RADIOSITY);
}

/// The tall block is a mirror, seen and lighting what is before it.
#[test]
fn the_cornell_box_with_a_mirror_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let mut world = cornell(32, "paths = 256\nsamples = 64", "");
    let tall = world.surfaces.iter_mut().find(|surface| surface.name == "tall").unwrap();
    tall.material =
        std::sync::Arc::new(Material { bsdf: Bsdf::Mirror { reflectance: Vec3::ONE }, ..Material::default() });
    assert_near(&gpu, "mirror", &world, None, 65536, tolerance::RADIOSITY);
}

/// Lamps of every kind, one after the other, in an open room, and the first light that it reflects.
#[test]
fn every_light_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let lights = [
        ("point", "point = { position = [0.6, 0.55, 0.6], intensity = [0.5, 0.6, 0.7] }"),
        (
            "spot",
            "spot = { position = [0.5, 0.9, 0.9], direction = [-0.2, -1, -0.4], intensity = 3, inner_angle = 20, outer_angle = 35 }",
        ),
        ("directional", "directional = { direction = [-0.2, -0.5, -1], irradiance = [2, 3, 4] }"),
        ("constant", "constant.radiance = [0.3, 0.5, 0.9]"),
    ];
    for (name, light) in lights {
        // With so many paths short rays are noisier than single lights are bright: they are kept short.
        let settings = "paths = 2048\nsamples = 64\nbounces = 1\nclamp = 0.05";
        let mut world = cornell(32, settings, &format!("[lights]\nl.{light}"));
        world.surfaces.retain(|surface| surface.name != "lamp" && surface.name != "short");
        if name == "constant" {
            // Into a room few of the sky's lights shine.
            world.surfaces.retain(|surface| !matches!(surface.name.as_str(), "ceiling" | "left" | "right"));
        }
        assert_near(&gpu, name, &world, Some(2), 2048, tolerance::RADIOSITY);
    }
}

/// Pixels that share out virtual lights show the same light as those that gather all, but for edges of shadows.
#[test]
fn interleaved_pixels_show_the_same_light() {
    let Some(gpu) = gpu() else { return };
    let of = |interleaving: u32| {
        picture(&gpu, &cornell(96, &format!("paths = 64\nsamples = 9\ninterleaving = {interleaving}"), ""))
    };
    let [truth, shared] = [of(1), of(3)];
    let mean = |image: &Image| image.pixels.iter().flatten().sum::<f32>() / (3 * image.pixels.len()) as f32;
    let bias = mean(&shared) / mean(&truth) - 1.0;
    let error = metrics::linear::linear_errors(&shared, &truth).relative_rmse;
    println!("interleaved: {:.3} % of the light, {:.2} % of difference", 100.0 * bias, 100.0 * error);
    assert!(bias.abs() < tolerance::INTERLEAVED_MEAN, "{bias}");
    assert!(error > 0.0 && error < tolerance::INTERLEAVED, "{error}");
}

/// A room whose lamp is behind a partition: all light that is seen has been reflected.
#[test]
fn a_room_lit_indirectly_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let scene = include_str!("../../../../../scenes/indirect.toml").replace("[512, 512]", "[32, 32]");
    let world = world(&format!("{scene}\n[techniques.instant_radiosity]\npaths = 256\nsamples = 64"));
    assert_near(&gpu, "indirect", &world, None, 8192, tolerance::RADIOSITY);
}

/// Rough metal and a glossy dielectric.
#[test]
fn glossy_surfaces_agree_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let mut world = cornell(32, "paths = 256", "");
    for (name, metallic, roughness) in [("tall", 1.0, 0.6), ("floor", 0.0, 0.5)] {
        let surface = world.surfaces.iter_mut().find(|surface| surface.name == name).unwrap();
        let bsdf = Bsdf::MetallicRoughness {
            base_color: Vec3::new(0.8, 0.6, 0.3),
            base_color_map: None,
            metallic,
            roughness,
            metallic_roughness_map: None,
        };
        surface.material = std::sync::Arc::new(Material { bsdf, ..Material::default() });
    }
    assert_near(&gpu, "glossy", &world, None, 8192, tolerance::RADIOSITY);
}

/// The error falls faster than random points': the slope of the RMS error against N, by least squares in logarithms over means
/// of several seeds. Light that is clamped is left out on both sides.
#[test]
fn the_error_falls_faster_than_by_chance() {
    let Some(gpu) = gpu() else { return };
    let of = |sequence: &str, paths: u32, seed: u32| {
        let settings = format!(
            "paths = {paths}\nseed = {seed}\nsequence = \"{sequence}\"\nwalks = 1\nsamples = 1\nclamp = 0.1\ncompensation = \"off\"\nbounces = 1"
        );
        let mut world = cornell(12, &settings, "");
        world.surfaces.retain(|surface| surface.name != "short");
        picture(&gpu, &world)
    };
    let truth = of("jittered", 4096, 1);
    let slope = |sequence: &str| {
        let counts = [8u32, 32, 128, 512];
        let log = |paths: u32| {
            let seeds = 2..8;
            let squared: f64 = seeds
                .map(|seed| metrics::linear::linear_errors(&of(sequence, paths, seed), &truth).relative_rmse.powi(2))
                .sum();
            0.5 * (squared / 6.0).ln()
        };
        let points: Vec<_> = counts.map(|n| (f64::from(n).ln(), log(n))).into();
        let mean = points.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / 4.0, m.1 + p.1 / 4.0));
        let (xy, xx) = points
            .iter()
            .fold((0.0, 0.0), |s, p| (s.0 + (p.0 - mean.0) * (p.1 - mean.1), s.1 + (p.0 - mean.0).powi(2)));
        let slope = xy / xx;
        let residual: f64 = points.iter().map(|p| (p.1 - mean.1 - slope * (p.0 - mean.0)).powi(2)).sum();
        (slope, (residual / 2.0 / xx).sqrt())
    };
    let ((jittered, interval), (random, _)) = (slope("jittered"), slope("random"));
    println!("slopes: jittered {jittered:.2} +- {interval:.2}, random {random:.2}");
    assert!(jittered + 2.0 * interval < -0.5, "{jittered} +- {interval}");
    assert!(random > jittered + 0.1, "{random}");
}

/// Many frames of a still scene give the picture of as many samples as paths; a frame renders one path.
#[test]
fn a_still_walkthrough_becomes_the_picture() {
    let Some(gpu) = gpu() else { return };
    let world = cornell(24, "paths = 16\nwalks = 1\nsamples = 16", "");
    let still = picture(&gpu, &world);
    let mut walkthrough = pollster::block_on(Walkthrough::new(&gpu, &world)).unwrap();
    for _ in 0..40 {
        assert!(walkthrough.render() <= 6, "a path's virtual lights");
    }
    let moving = pollster::block_on(walkthrough.image()).unwrap();
    let error = metrics::linear::linear_errors(&moving, &still).relative_rmse;
    // Half floats, and other short rays at random.
    assert!(error < 0.02, "{error}");
}

/// A moving camera and a moving block for 120 frames: no frame flickers, and what is shown keeps up with the converged picture.
#[test]
fn a_walkthrough_does_not_flicker() {
    let Some(gpu) = gpu() else { return };
    let mut world = cornell(24, "paths = 32\nsamples = 32", "");
    let mut walkthrough = pollster::block_on(Walkthrough::new(&gpu, &world)).unwrap();
    let mut before: Option<Image> = None;
    let (mut flicker, mut lag) = (0f64, Vec::new());
    let short = world.surfaces.iter().position(|surface| surface.name == "short").unwrap();
    let place = world.surfaces[short].world_from_object;
    for frame in 0..120 {
        let t = frame as f32 / 120.0;
        world.scene.camera.position.x = 0.5 + 0.1 * t;
        world.surfaces[short].world_from_object =
            glam::Mat4::from_translation(Vec3::new(-0.1 * t, 0.1 * t, 0.0)) * place;
        walkthrough.set_camera(&world.scene.camera);
        walkthrough.set_transform("short", world.surfaces[short].world_from_object).unwrap();
        walkthrough.render();
        let image = pollster::block_on(walkthrough.image()).unwrap();
        if let Some(before) = before.filter(|_| frame > 32) {
            flicker = flicker.max(metrics::linear::linear_errors(&image, &before).relative_rmse);
        }
        if frame % 40 == 39 {
            lag.push(metrics::linear::linear_errors(&image, &picture(&gpu, &world)).relative_rmse);
        }
        before = Some(image);
    }
    println!("flicker {flicker:.4}, against the converged frame {lag:.4?}");
    assert!(flicker < tolerance::FLICKER, "{flicker}");
    assert!(lag.iter().all(|error| *error < tolerance::LAG), "{lag:?}");
    assert!(walkthrough.set_transform("nothing", place).is_err());
}

/// Media take of virtual lights' light on its way: fog that fills the room, and a ball of smoke before the wall. Both absorb alone, as
/// what media scatter onto surfaces is not in the model.
#[test]
fn media_dim_virtual_lights() {
    let Some(gpu) = gpu() else { return };
    let fog = "[media.m]\ndensity.homogeneous = { min = [0, 0, 0], max = [1, 1, 1] }\noptics.coefficients = { sigma_s = 0, sigma_a = [0.5, 0.8, 0.3] }";
    let smoke = "[media.m]\ndensity.sphere = { center = [0.5, 0.7, 0.2], radius = 0.2, falloff = 0.1 }\noptics.coefficients = { sigma_s = 0, sigma_a = 8 }";
    for (name, medium) in [("fog", fog), ("smoke", smoke)] {
        assert_near(&gpu, name, &cornell(32, "paths = 256", medium), None, 4096, tolerance::RADIOSITY);
    }
}

/// Smoke near a red wall turns red: media scatter the virtual lights, which surfaces hide from them.
#[test]
fn virtual_lights_light_media() {
    let Some(gpu) = gpu() else { return };
    let fog = |settings: &str, more: &str| {
        let mut world = world(&format!(
            "camera = {{ position = [0.5, 0.5, 2.4], target = [0.5, 0.5, 0], fov = 24 }}\nfilm.size = [24, 24]\n{settings}\n{CORNELL}\n{more}\n\
             [media.smoke]\ndensity.homogeneous = {{ min = [0.02, 0.3, 0.3], max = [0.3, 0.6, 0.6] }}\noptics.coefficients.sigma_s = 1"
        ));
        world.surfaces.retain(|surface| !matches!(surface.name.as_str(), "tall" | "short"));
        world
    };
    let settings = "[techniques.instant_radiosity]\npaths = 128\n[techniques.march]\nstep = 4";
    let world = fog(settings, "");
    // A black room, and none: what the smoke itself sends to the eye.
    let [lit, truth] = [picture(&gpu, &world), reference(&world, Some(3), 512, true)];
    let smoke = |image: &Image| {
        let inside = (8..14).flat_map(|y| (5..9).map(move |x| image.pixels[y * 24 + x]));
        inside.fold(Vec3::ZERO, |sum, pixel| sum + Vec3::from(pixel) / 24.0)
    };
    let (found, expected) = (smoke(&lit), smoke(&truth));
    println!("smoke: {found} for {expected}");
    assert!((found / expected - 1.0).abs().max_element() < tolerance::LIT_SMOKE, "{found} for {expected}");
}

/// Virtual lights take the place of the sky's directions in a medium, and have none of the maps that those have: what they light is
/// as it is without maps, in a sky which has some and in the dark.
#[test]
fn virtual_lights_have_no_maps() {
    let Some(gpu) = gpu() else { return };
    let smoke = |maps: &str| {
        let mut world = world(&format!(
            "camera = {{ position = [0.5, 0.5, 2.4], target = [0.5, 0.5, 0], fov = 24 }}\nfilm.size = [24, 24]\n\
             [lights.sky.constant]\nradiance = 0.01\n[techniques.instant_radiosity]\npaths = 16\n\
             [techniques.march]\nlight_step = 1\n{maps}\n{CORNELL}\n\
             [media.smoke]\ndensity.homogeneous = {{ min = [0.02, 0.3, 0.3], max = [0.4, 0.7, 0.7] }}\noptics.coefficients.sigma_s = 9"
        ));
        world.surfaces.retain(|surface| !matches!(surface.name.as_str(), "tall" | "short"));
        picture(&gpu, &world)
    };
    let [without, with] = ["", "[techniques.transmittance]\nresolution = 32"].map(smoke);
    let error = metrics::linear::linear_errors(&with, &without).relative_rmse;
    assert!(error < tolerance::UNMAPPED, "{error}");
}
