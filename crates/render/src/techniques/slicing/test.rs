//! Slicing against closed forms and the marcher.

use tyndall_scene::image::Image;
use tyndall_scene::metrics::linear::linear_errors;

use crate::test::{blob, glowing_plume, gpu, picture, render, small_fire, tolerance, world};
use crate::{Gpu, RenderError};

const SKY: &str = "lights.sky.constant.radiance = 1\n";
const SLAB: &str = "[media.slab]\ndensity.homogeneous = { min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }\n\
                    transform.rotate = [20, 30, 40]\n";

/// A film wider than a tile.
fn camera(position: &str) -> String {
    format!("camera = {{ position = {position}, target = [0, 0, 0], fov = 50 }}\nfilm.size = [150, 30]\n{SKY}")
}

fn relative_rmse(found: &Image, expected: &Image) -> f64 {
    assert!(expected.pixels.iter().any(|p| p.iter().any(|&c| c > 0.0)), "there is something to compare");
    linear_errors(found, expected).relative_rmse
}

/// [ground truth 2] A homogeneous box has e^{−σL} along every ray from any side, from within, and at any distance of slices:
/// the marcher is exact there.
#[test]
fn a_homogeneous_box_is_exact_from_anywhere() {
    let Some(gpu) = gpu() else { return };
    for position in ["[0, 0, 1.5]", "[1.1, 0.9, -1.2]", "[-0.8, 1.4, 0.3]", "[0.1, 0.2, 0.15]", "[0.01, -1.4, 0.02]"] {
        let scene = |technique: &str| {
            format!(
                "{}{technique}\n{SLAB}optics.coefficients = {{ sigma_a = 3, emission = [1, 2, 3] }}",
                camera(position)
            )
        };
        let expected = picture(&gpu, &world(&scene("techniques.march = { model = \"emission\", termination = 0 }")));
        for slices in [1.0, 7.3] {
            let found = picture(&gpu, &world(&scene(&format!("techniques.slicing.slices = {slices}"))));
            let error = relative_rmse(&found, &expected);
            assert!(error <= tolerance::EXACT, "{error} from {position} with slices at {slices} voxels");
        }
    }
}

/// [ground truth 2] e^{−σL} itself, through the middle of the box.
#[test]
fn beers_law() {
    let Some(gpu) = gpu() else { return };
    let text = format!(
        "camera = {{ position = [0, 0, 5], target = [0, 0, 0], fov = 0.001 }}\nfilm.size = [2, 2]\n{SKY}\
         techniques.slicing.model = \"absorption\"\n{}optics.coefficients.sigma_a = 3",
        SLAB.replace("transform.rotate = [20, 30, 40]\n", "")
    );
    for pixel in picture(&gpu, &world(&text)).pixels {
        assert!((f64::from(pixel[0]) / (-3f64).exp() - 1.0).abs() < tolerance::EXACT, "{pixel:?}");
    }
}

/// Pictures of the blob, the plume and the fire with a technique's settings.
fn pictures(gpu: &Gpu, settings: &str) -> [Image; 3] {
    let technique = format!("[techniques.{settings}");
    [blob, glowing_plume, small_fire].map(|scene| picture(gpu, &scene(&technique)))
}

/// Slices of a voxel against steps of a voxel; of half a voxel in the fire, whose transfer function turns the data's slopes into
/// steeper ones.
#[test]
fn slices_agree_with_the_marcher() {
    let Some(gpu) = gpu() else { return };
    let errors = |slices: &str, step: &str| {
        let sliced = pictures(&gpu, &format!("slicing]\nslices = {slices}"));
        let marched = pictures(&gpu, &format!("march]\nmodel = \"emission\"\nstep = {step}"));
        let errors = [0, 1, 2].map(|i| relative_rmse(&sliced[i], &marched[i]));
        eprintln!("slices of {slices} and steps of {step}: {errors:?} (blob, plume, fire)");
        errors
    };
    let [blob, plume, _] = errors("1", "1");
    let [_, _, fire] = errors("0.5", "0.5");
    for (name, error) in [("blob", blob), ("plume", plume), ("fire", fire)] {
        assert!(error <= tolerance::SLICES, "{name}: {error}");
    }
    assert!(errors("16", "1")[1] > tolerance::SLICES, "the test sees slices that are too far apart");
}

#[test]
fn both_orders_give_one_picture() {
    let Some(gpu) = gpu() else { return };
    let back_to_front = pictures(&gpu, "slicing]\norder = \"back_to_front\"");
    let front_to_back = pictures(&gpu, "slicing]\norder = \"front_to_back\"");
    for (a, b) in back_to_front.iter().zip(&front_to_back) {
        let error = relative_rmse(a, b);
        eprintln!("{error:.2e} between the orders");
        assert!(error <= tolerance::BLENDING, "{error}");
    }
}

/// Overlapping media are one with the sum of their coefficients.
#[test]
fn overlapping_media_add_up() {
    let Some(gpu) = gpu() else { return };
    let scene = |media: &[(f32, f32)]| {
        let media: String = media
            .iter()
            .enumerate()
            .map(|(i, (sigma_a, emission))| {
                let medium = SLAB.replace("slab", &format!("slab{i}"));
                format!("{medium}optics.coefficients = {{ sigma_a = {sigma_a}, emission = {emission} }}\n")
            })
            .collect();
        picture(&gpu, &world(&format!("{}techniques.slicing = {{}}\n{media}", camera("[1.1, 0.9, -1.2]"))))
    };
    let error = relative_rmse(&scene(&[(1.0, 2.0), (2.0, 3.0)]), &scene(&[(3.0, 5.0)]));
    assert!(error <= tolerance::EXACT, "{error}");
}

/// Where a device blends no 32-bit floats, layers have 16 bits.
#[test]
fn half_floats_do() {
    let Some(gpu) = gpu() else { return };
    let Some(poor) = pollster::block_on(crate::adapters()).into_iter().find_map(|adapter| {
        let info = adapter.get_info();
        let descriptor = wgpu::DeviceDescriptor {
            required_features: wgpu::Features::FLOAT32_FILTERABLE,
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let device = pollster::block_on(adapter.request_device(&descriptor)).ok()?;
        (info.device_type == wgpu::DeviceType::Cpu).then_some(device)
    }) else {
        return;
    };
    let poor = Gpu::from_device(poor.0, poor.1);
    let scene = pictures(&gpu, "slicing]");
    for (found, expected) in pictures(&poor, "slicing]").iter().zip(&scene) {
        let error = relative_rmse(found, expected);
        eprintln!("{error:.2e} with 16-bit layers");
        assert!(error > 0.0 && error <= tolerance::HALF_FLOAT_LAYERS, "{error}");
    }
}

#[test]
fn what_layers_cannot_show_is_refused() {
    let Some(gpu) = gpu() else { return };
    let scene = |technique: &str, optics: &str| world(&format!("{}{technique}\n{SLAB}{optics}", camera("[0, 0, 2]")));
    let coloured = "optics.coefficients = { sigma_s = 1, sigma_a = [1, 2, 3] }";
    for technique in ["slicing", "splatting"] {
        match render(&gpu, &scene(&format!("techniques.{technique} = {{}}"), coloured)) {
            Err(RenderError::Setting(error)) => {
                assert_eq!(error.path, "media.slab.optics.coefficients");
                assert!(error.accepted.contains("technique march has three"), "{error}");
            }
            other => panic!("{:?}", other.map(|_| "a picture")),
        }
        let text = format!("techniques.{technique}.model = \"single_scattering\"");
        match render(&gpu, &scene(&text, "optics.coefficients.sigma_a = 1")) {
            Err(RenderError::Setting(error)) => assert_eq!(error.path, format!("techniques.{technique}.model")),
            other => panic!("{:?}", other.map(|_| "a picture")),
        }
    }
    let long = scene("techniques.slicing = {}", "transform.scale = [1e6, 1, 1]\noptics.coefficients.sigma_a = 1");
    assert!(matches!(render(&gpu, &long), Err(RenderError::Limit { .. })));
}
