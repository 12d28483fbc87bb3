//! Maps of transmittance against closed forms and the inner march.

use tyndall_scene::World;
use tyndall_scene::image::Image;
use tyndall_scene::metrics;

use super::numbers;
use crate::resident::Transmittance;
use crate::test::{PLUME, gpu, picture, render, shipped, tolerance, world, world_of};
use crate::{Gpu, RenderError};

/// Looks along −z through the middle of the unit cube around the origin, into a narrow field.
const CAMERA: &str = "camera = { position = [0, 0, 5], target = [0, 0, 0], fov = 0.001 }\nfilm.size = [2, 2]\n";
const BOX: &str = "density.homogeneous = { min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }\n";

fn error(found: &Image, expected: &Image) -> f64 {
    metrics::linear::linear_errors(found, expected).relative_rmse
}

/// Of constant extinction every basis that promises the ends knows all: single scattering in the unit cube, light from above
/// onto its top face, 0.5 m over the camera's ray: L = E σ_s/4π e^{−σ_t/2} (1 − e^{−σ_t}) / σ_t, in every channel.
#[test]
fn a_homogeneous_cube_is_exact() {
    let Some(gpu) = gpu() else { return };
    for settings in [
        "basis = \"fourier\"",
        "basis = \"slices\"\ncoefficients = 5",
        "basis = \"haar\"\ncoefficients = 8",
        "basis = \"cosine\"\nwindow = \"fejer\"",
        "basis = \"legendre\"\ndepths = \"light\"",
    ] {
        let text = format!(
            "{CAMERA}lights.sun.directional = {{ direction = [0, -1, 0], irradiance = [1, 10, 100] }}\n\
             [media.slab]\n{BOX}optics.coefficients = {{ sigma_s = [1, 2, 3], sigma_a = [0, 0.5, 3] }}\n\
             [techniques.transmittance]\nresolution = 16\ndeepest = 100\n{settings}"
        );
        let image = picture(&gpu, &world(&text));
        for pixel in &image.pixels {
            for (c, (e, sigma_s, sigma_t)) in
                [(1.0, 1.0, 1.0), (10.0, 2.0, 2.5), (100.0, 3.0, 6.0f64)].into_iter().enumerate()
            {
                let scattered = e * sigma_s / (4.0 * std::f64::consts::PI) * (-0.5 * sigma_t).exp();
                let expected = scattered * -(-sigma_t).exp_m1() / sigma_t;
                let off = (f64::from(pixel[c]) / expected - 1.0).abs();
                assert!(off < tolerance::SINGLE_SCATTERING + tolerance::MAPPED, "{pixel:?} for {expected}, {settings}");
            }
        }
    }
}

/// A cube with a light of each kind, seen from a corner, with the inner march at fine steps or with maps.
fn lit_cube(gpu: &Gpu, light: &str, technique: &str) -> Image {
    let text = format!(
        "camera = {{ position = [1.5, 1.2, 2], target = [0, 0, 0] }}\nfilm.size = [40, 30]\n{light}\n{technique}\n\
         [techniques.march]\nlight_step = 0.5\n[media.ball]\n\
         density.sphere = {{ center = [0, 0, 0], radius = 0.5, falloff = 0.3 }}\n\
         optics.coefficients = {{ sigma_s = 6, sigma_a = 2 }}"
    );
    picture(gpu, &world(&text))
}

/// From the sun, a spot light with a wide cone, a lamp outside, and a lamp within the medium, maps say what an inner march says.
#[test]
fn every_light_has_a_map() {
    let Some(gpu) = gpu() else { return };
    for (light, most) in [
        ("lights.a.directional = { direction = [1, -2, 0.5], irradiance = 3 }", tolerance::MAPPED_BALL),
        (
            "lights.a.spot = { position = [0.9, 0.9, 0.2], direction = [-1, -1, 0], intensity = 3, inner_angle = 30, outer_angle = 80 }",
            tolerance::MAPPED_BALL,
        ),
        ("lights.a.point = { position = [-0.4, 0.7, 0.6], intensity = 3 }", tolerance::MAPPED_BALL),
        ("lights.a.point = { position = [0.05, 0.1, 0.02], intensity = 3 }", tolerance::MAPPED_WITHIN),
    ] {
        let exact = lit_cube(&gpu, light, "");
        let found = lit_cube(
            &gpu,
            light,
            "techniques.transmittance = { coefficients = 15, resolution = 96, light_step = 0.5 }",
        );
        let off = error(&found, &exact);
        assert!(off < most, "{off} with {light}");
        let deep =
            lit_cube(&gpu, light, "techniques.transmittance = { basis = \"deep\", resolution = 96, light_step = 0.5 }");
        let deep = error(&deep, &exact);
        assert!(deep < tolerance::MAPPED_DEEP, "{deep} with {light}");
        let coarse = lit_cube(&gpu, light, "techniques.transmittance = { coefficients = 1, resolution = 8 }");
        assert!(error(&coarse, &exact) > most, "the test sees that one coefficient is too few");
    }
}

fn plume(technique: &str) -> World {
    world_of(&format!("{}\n{technique}", PLUME.replace("[640, 480]", "[96, 72]")), &shipped())
}

/// The plume with maps against the inner march: more coefficients, closer; ranges of depths for every texel are worth more than
/// twice the coefficients; half floats cost little.
#[test]
fn the_plume_looks_as_marched() {
    let Some(gpu) = gpu() else { return };
    let marched = picture(&gpu, &plume("[techniques.march]\nlight_step = 1"));
    let with = |settings: &str| {
        let settings = format!("[techniques.transmittance]\nresolution = 192\n{settings}");
        error(&picture(&gpu, &plume(&settings)), &marched)
    };
    let (seven, fifteen) = (with(""), with("coefficients = 15"));
    let cosine = with("basis = \"cosine\"\ncoefficients = 11\ndeepest = 8");
    let whole = with("coefficients = 15\ndepths = \"light\"");
    let half = with("precision = \"half\"");
    let slices = with("basis = \"slices\"");
    // As the inner march does, a deep map takes each of its steps to be homogeneous.
    let deep = with("basis = \"deep\"");
    assert!(deep < tolerance::MAPPED_DEEP, "{deep}");
    assert!(seven < tolerance::MAPPED_PLUME_7, "{seven}");
    assert!(fifteen < tolerance::MAPPED_PLUME, "{fifteen}");
    assert!(cosine < tolerance::MAPPED_PLUME, "{cosine}");
    assert!(whole > seven, "{whole} with one range for all, {seven} with half the coefficients");
    assert!((half - seven).abs() < 0.005, "{half} with half floats, {seven} without");
    assert!(slices > 1.15 * seven, "{slices} with slices, {seven} with as many coefficients");
}

/// The march through one grid finds once a ray what the one through any media finds at every sample, which a tolerance too small to
/// take two steps together asks for: of one sun, of lights of colours, and of a sky.
#[test]
fn what_is_found_once_a_ray_is_the_same() {
    let Some(gpu) = gpu() else { return };
    let blue = "[lights.blue.directional]\ndirection = [-1, 0, 0.3]\nirradiance = [0, 1, 9]\n";
    let sky = "[lights.sky]\nconstant.radiance = [1, 2, 3]\n";
    for lights in ["", blue, sky] {
        let with = |tolerance: f64| {
            let settings = format!(
                "{lights}[techniques.march]\nenvironment_directions = 5\ntolerance = {tolerance}\n\
                 [techniques.transmittance]\nresolution = 32\n"
            );
            picture(&gpu, &world_of(&format!("{}\n{settings}", PLUME.replace("[640, 480]", "[48, 36]")), &shipped()))
        };
        let off = error(&with(0.0), &with(1e-9));
        assert!(off < tolerance::MAPPED_ALONG, "{off} with {lights:?}");
    }
}

/// Moments know a thick ball far less well than harmonics do.
#[test]
fn moments_are_looked_up() {
    let Some(gpu) = gpu() else { return };
    let sun = "lights.a.directional = { direction = [1, -2, 0.5], irradiance = 3 }";
    let exact = lit_cube(&gpu, sun, "");
    for basis in ["moments", "trigonometric"] {
        let settings = format!("{{ basis = \"{basis}\", coefficients = 9, resolution = 48, light_step = 1 }}");
        let off = error(&lit_cube(&gpu, sun, &format!("techniques.transmittance = {settings}")), &exact);
        assert!(off < tolerance::MAPPED_MOMENTS, "{off} with {basis}");
    }
}

/// A sky's directions have maps, too.
#[test]
fn a_sky_is_looked_up() {
    let Some(gpu) = gpu() else { return };
    let sky = "lights.sky.constant.radiance = [1, 2, 3]";
    let exact = lit_cube(&gpu, sky, "");
    let found =
        lit_cube(&gpu, sky, "techniques.transmittance = { coefficients = 15, resolution = 64, light_step = 0.5 }");
    let off = error(&found, &exact);
    assert!(off < tolerance::MAPPED_BALL, "{off}");
}

/// What stands in shadow of smoke is darker by what the smoke takes: a white square under the cube, in the sun.
#[test]
fn surfaces_look_up_what_arrives() {
    let Some(gpu) = gpu() else { return };
    let scene = |technique: &str| {
        let text = format!(
            "camera = {{ position = [0, -0.9, 1.5], target = [0, -1, 0], fov = 30 }}\nfilm.size = [24, 16]\n\
             lights.sun.directional = {{ direction = [0, -1, 0], irradiance = 3 }}\n{technique}\n\
             materials.white.lambert.reflectance = 0.8\n\
             surfaces.floor = {{ shape.quad = {{ corner = [-2, -1, 2], edges = [[4, 0, 0], [0, 0, -4]] }}, material = \"white\" }}\n\
             [media.cube]\n{BOX}optics.coefficients = {{ sigma_s = 1, sigma_a = 1 }}"
        );
        picture(&gpu, &world(&text))
    };
    let off = error(&scene("techniques.transmittance.resolution = 64"), &scene(""));
    assert!(off < tolerance::MAPPED_FLOOR, "{off}");
}

/// A filter of the maps filters the extinction: the shadow of a thin cube on a floor is softer, and takes as much light.
#[test]
fn filtered_shadows_are_soft() {
    let Some(gpu) = gpu() else { return };
    let shadow = |settings: &str| {
        let text = format!(
            "camera = {{ position = [0, 2, 0], target = [0, -1, 0], up = [0, 0, -1], fov = 50 }}\nfilm.size = [48, 48]\n\
             lights.sun.directional = {{ direction = [0, -1, 0], irradiance = 3 }}\n\
             materials.white.lambert.reflectance = 0.8\n\
             surfaces.floor = {{ shape.quad = {{ corner = [-2, -1, 2], edges = [[4, 0, 0], [0, 0, -4]] }}, material = \"white\" }}\n\
             [media.frame]\ndensity.homogeneous = {{ min = [-1, -0.9, -1], max = [1, -0.8, 1] }}\noptics.coefficients.sigma_a = 1e-6\n\
             [media.cube]\ndensity.homogeneous = {{ min = [-0.4, -0.9, -0.4], max = [0.4, -0.8, 0.4] }}\n\
             optics.coefficients.sigma_a = 0.5\n[techniques.march]\nmodel = \"absorption\"\n\
             [techniques.transmittance]\nresolution = 64\ndepths = \"light\"\n{settings}"
        );
        picture(&gpu, &world(&text)).pixels
    };
    // What the eye's own way through the cube takes is the same in both.
    let sum = |pixels: &[[f32; 3]]| pixels.iter().map(|p| f64::from(p[0])).sum::<f64>();
    let sharp = shadow("");
    let change = |pixels: &[[f32; 3]]| {
        let row = &pixels[24 * 48..25 * 48];
        row.windows(2).map(|pair| (pair[1][0] - pair[0][0]).abs()).fold(0.0, f32::max)
    };
    let lit = f64::from(sharp[0][0]) * 48.0 * 48.0;
    for kind in ["box", "gaussian", "mips"] {
        let soft = shadow(&format!("prefilter = 8\nprefilter_kind = \"{kind}\""));
        let (lost, before) = (lit - sum(&soft), lit - sum(&sharp));
        assert!((lost / before - 1.0).abs() < tolerance::FILTERED_SHADOW, "{lost} of light taken, {before} unfiltered");
        assert!(
            change(&soft) < 0.8 * change(&sharp),
            "{} from pixel to pixel, {} unfiltered",
            change(&soft),
            change(&sharp)
        );
    }
}

/// Memory is as computed: side² texels of 8 or 16 bytes a set, the range among them, channel and light.
#[test]
fn memory_is_as_computed() {
    let Some(gpu) = gpu() else { return };
    let bytes = |settings: &str| -> Transmittance {
        let world = plume(&format!("[techniques.transmittance]\nresolution = 64\n{settings}"));
        pollster::block_on(crate::Frame::new(&gpu, &world)).unwrap().resident().transmittance.clone()
    };
    for (settings, sets, size) in [
        ("", 3, 16),
        ("precision = \"half\"", 3, 8),
        ("coefficients = 15", 5, 16),
        ("depths = \"light\"", 2, 16),
        ("basis = \"moments\"\ncoefficients = 9\ndepths = \"light\"", 3, 16),
        ("basis = \"trigonometric\"\ncoefficients = 9\ndepths = \"light\"", 3, 16),
    ] {
        let made = bytes(settings);
        assert_eq!(made.bytes(), 64 * 64 * sets * size, "{settings}");
        assert_eq!(made.mapped, 1);
    }
    // Levels of 64, 32, 16 and 8 texels a side, for a filter of 7.
    let mips = bytes("depths = \"light\"\nprefilter = 3\nprefilter_kind = \"mips\"");
    assert_eq!(mips.bytes(), (64 * 64 + 32 * 32 + 16 * 16 + 8 * 8) * 2 * 16);
    assert_eq!(
        [numbers("fourier", 8).0, numbers("slices", 8).0, numbers("moments", 8).0, numbers("moments", 31).0],
        [9, 8, 7, 9]
    );
}

/// Moments need 32 bits; filters need what is linear, mips tiles that can be halved.
#[test]
fn what_cannot_be_is_refused() {
    let Some(gpu) = gpu() else { return };
    for (settings, expected) in [
        ("basis = \"moments\"\nprecision = \"half\"", "moments in 16-bit numbers"),
        ("basis = \"trigonometric\"\nprecision = \"half\"", "moments in 16-bit numbers"),
        ("prefilter = 2", "ranges of depths for each texel"),
        ("prefilter = 2\nprefilter_kind = \"mips\"\ndepths = \"light\"\nresolution = 100", "a multiple of 8"),
    ] {
        let world = plume(&format!("[techniques.transmittance]\n{settings}"));
        let error = render(&gpu, &world).map(|_| "a picture").unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// What does not fit a texture is said before it is allocated.
#[test]
fn too_many_texels() {
    let Some(gpu) = gpu() else { return };
    let light = |i: u32| format!("[lights.l{i}.directional]\ndirection = [0, -1, {i}]\nirradiance = 1\n");
    let lights: String = (1..20).map(light).collect();
    let world = plume(&format!("{lights}[techniques.transmittance]\nresolution = 4096\ncoefficients = 31"));
    match render(&gpu, &world) {
        Err(error @ RenderError::Limit { .. }) => assert!(error.to_string().contains("180 tiles of 4096"), "{error}"),
        other => panic!("{:?}", other.map(|_| "a picture")),
    }
}
