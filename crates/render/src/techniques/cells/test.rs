//! Marching from cell to cell against closed forms and the reference.

use std::sync::Arc;

use glam::DVec3;
use tyndall_reference::{Random, Tracer};
use tyndall_scene::image::Image;
use tyndall_scene::metrics;
use tyndall_scene::volume::{Budget, Cell, Mesh, Values};
use tyndall_scene::{Field, World};

use crate::RenderError;
use crate::test::{gpu, picture, render, shipped, tolerance, world, world_of};

/// Looks along −z through the middle of the unit cube around the origin, into a narrow field.
const CAMERA: &str = "camera = { position = [0, 0, 5], target = [0, 0, 0], fov = 0.001 }\nfilm.size = [2, 2]\n";
const MEDIUM: &str = "[media.m]\ndensity.homogeneous = { min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }\n";

/// The unit cube as n³ hexahedra, those kept that `keep` says; the inner faces of `crooked` ones are not plane.
fn hexahedra(n: u32, crooked: bool, keep: impl Fn(DVec3) -> bool, field: impl Fn(DVec3) -> f64) -> Field {
    let side = n + 1;
    let places = (0..side.pow(3)).map(|v| [v % side, v / side % side, v / (side * side)]);
    let vertices: Vec<DVec3> = places
        .map(|place| {
            let inner = crooked && place.iter().all(|&x| x > 0 && x < n);
            let at = DVec3::from(place.map(f64::from));
            let offset = DVec3::new((at.y * 5.0 + at.z).sin(), (at.z * 3.0 + at.x).sin(), (at.x * 7.0 + at.y).sin());
            (at + if inner { offset * 0.2 } else { DVec3::ZERO }) / f64::from(n)
        })
        .collect();
    let at = |[i, j, k]: [u32; 3]| i + side * (j + side * k);
    let boxes = (0..n.pow(3)).map(|c| [c % n, c / n % n, c / (n * n)]);
    let kept = boxes.filter(|&place| keep((DVec3::from(place.map(f64::from)) + 0.5) / f64::from(n)));
    let cells: Vec<_> = kept
        .map(|[i, j, k]| {
            let around = |k| [[i, j, k], [i + 1, j, k], [i + 1, j + 1, k], [i, j + 1, k]].map(at);
            let ([a, b, c, d], [e, f, g, h]) = (around(k), around(k + 1));
            Cell::Hexahedron([a, b, c, d, e, f, g, h])
        })
        .collect();
    let values = Values::Vertices(vertices.iter().map(|&vertex| field(vertex) as f32).collect());
    Field::Mesh(Arc::new(Mesh::new(&vertices, &cells, values, Budget(1 << 28)).unwrap()))
}

/// The mesh in the unit cube around the origin.
fn meshed(text: &str, field: Field) -> World {
    let mut world = world(text);
    world.volumes[0].field = field;
    world
}

fn assert_radiance(image: &Image, expected: [f64; 3], tolerance: f64) {
    for pixel in &image.pixels {
        for c in 0..3 {
            let error = (f64::from(pixel[c]) - expected[c]).abs() / expected[c].abs().max(1e-6);
            assert!(error <= tolerance, "{pixel:?} for {expected:?}");
        }
    }
}

fn all(_: DVec3) -> bool {
    true
}

/// [ground truth 2] 1 m of constant value on crooked and on even cells, where rays run in faces and edges, σ_a = (0.5, 2, 8)
/// m⁻¹, before an environment of 1: e^{−σ_a}; and the last quarter of it, seen from within.
#[test]
fn beers_law() {
    let Some(gpu) = gpu() else { return };
    for (position, length) in [("[0, 0, 5]", 1.0), ("[0, 0, -0.25]", 0.25)] {
        let text = format!(
            "camera = {{ position = {position}, target = [0, 0, -1], fov = 0.001 }}\nfilm.size = [2, 2]\n\
             lights.sky.constant.radiance = 1\n[techniques.cells]\nmodel = \"absorption\"\ntermination = 0\n\
             {MEDIUM}optics.coefficients.sigma_a = [0.5, 2, 8]"
        );
        let expected = [0.5f64, 2.0, 8.0].map(|k| (-k * length).exp());
        for field in [hexahedra(5, true, all, |_| 1.0), hexahedra(4, false, all, |_| 1.0)] {
            assert_radiance(&picture(&gpu, &meshed(&text, field)), expected, tolerance::EXACT);
        }
    }
}

/// 1 + a·x along a slanted ray, which also glows: τ is σ_a times the length times the value in the middle, and
/// L = (1 − e^{−τ}) k_e/σ_a.
#[test]
fn a_linear_field() {
    let Some(gpu) = gpu() else { return };
    let (from, to) = (DVec3::new(0.3, -0.2, 3.0), DVec3::new(0.1, 0.1, 0.0));
    let text = format!(
        "camera = {{ position = [{}, {}, {}], target = [{}, {}, {}], fov = 0.001 }}\nfilm.size = [2, 2]\n\
         techniques.cells.model = \"emission\"\n{MEDIUM}optics.coefficients = {{ sigma_a = [1, 2, 0], emission = 3 }}",
        from.x, from.y, from.z, to.x, to.y, to.z
    );
    let slope = DVec3::new(0.5, 1.5, -0.8);
    let field = |x: DVec3| 1.0 + slope.dot(x);
    let image = picture(&gpu, &meshed(&text, hexahedra(5, true, all, field)));
    // The middle of the ray's part within the cube lies at z = 0.
    let length = (to - from).length() / (from.z - to.z);
    let density = length * field(to + 0.5);
    let expected = [1.0, 2.0, 1e-9f64].map(|k| 3.0 * -(-k * density).exp_m1() / k);
    assert_radiance(&image, expected, tolerance::EXACT);
}

/// A ray through a hole in the mesh, from outside and from within the hole: two thirds of it are left, and one.
#[test]
fn holes() {
    let Some(gpu) = gpu() else { return };
    for (z, length) in [(5.0, 2.0 / 3.0f64), (0.0, 1.0 / 3.0)] {
        let text = format!(
            "camera = {{ position = [0.1, 0.06, {z}], target = [0.1, 0.06, -1], fov = 0.001 }}\nfilm.size = [2, 2]\n\
             lights.sky.constant.radiance = 1\ntechniques.cells.model = \"absorption\"\n\
             {MEDIUM}optics.coefficients.sigma_a = 2"
        );
        let field = hexahedra(3, false, |middle| (middle.z - 0.5).abs() > 0.2, |_| 1.0);
        assert_radiance(&picture(&gpu, &meshed(&text, field)), [(-2.0 * length).exp(); 3], tolerance::EXACT);
    }
}

/// [ground truth 6] Single scattering in the unit cube: from above onto its top face,
/// L = E σ_s p e^{−σ_t/2} (1 − e^{−σ_t})/σ_t, and from the camera's side, L = E σ_s p (1 − e^{−2σ_t})/(2σ_t).
#[test]
fn single_scattering_in_a_box() {
    let Some(gpu) = gpu() else { return };
    let isotropic = 1.0 / (4.0 * std::f64::consts::PI);
    for (direction, seen) in [
        ("[0, -1, 0]", (|s: f64| (-0.5 * s).exp() * -(-s).exp_m1() / s) as fn(f64) -> f64),
        ("[0, 0, -1]", (|s: f64| -(-2.0 * s).exp_m1() / (2.0 * s)) as fn(f64) -> f64),
    ] {
        let text = format!(
            "{CAMERA}lights.sun.directional = {{ direction = {direction}, irradiance = [1, 10, 100] }}\n\
             techniques.cells.termination = 0\n\
             {MEDIUM}optics.coefficients = {{ sigma_s = [1, 2, 3], sigma_a = [0, 0.5, 3] }}"
        );
        let expected = [(1.0, 1.0, 1.0), (10.0, 2.0, 2.5), (100.0, 3.0, 6.0f64)]
            .map(|(e, sigma_s, sigma_t)| e * sigma_s * isotropic * seen(sigma_t));
        let image = picture(&gpu, &meshed(&text, hexahedra(5, true, all, |_| 1.0)));
        assert_radiance(&image, expected, tolerance::CELLS_SCATTERING);
    }
}

/// A value that rises linearly from 0 to 1 along the ray, and a tent of opacity ½ over [.4, .6] within .1 m:
/// τ = 2·(.1/.5)·∫₀^½ −ln(1 − o) do/.1, and L = 2c (1 − e^{−τ}), as in the reference's tests.
#[test]
fn transfer_function() {
    let Some(gpu) = gpu() else { return };
    let text = format!(
        "{CAMERA}techniques.cells.model = \"emission\"\n{MEDIUM}[media.m.optics.transfer]\nunit_length = 0.1\nradiance = 2\n\
         stops = [ {{ value = 0.4, opacity = 0, color = [1, 0.5, 0.1] }}, {{ value = 0.5, opacity = 0.5, color = [1, 0.5, \
         0.1] }}, {{ value = 0.6, opacity = 0, color = [1, 0.5, 0.1] }} ]"
    );
    let tau = 2.0 * (0.1 / 0.5) * (0.5 - 0.5 * 2f64.ln()) / 0.1;
    let expected = [1.0, 0.5, 0.1].map(|c| 2.0 * c * -(-tau).exp_m1());
    let image = picture(&gpu, &meshed(&text, hexahedra(7, true, all, |x| x.z)));
    assert_radiance(&image, expected, tolerance::CELLS_TRANSFER);
}

/// A curved field with holes, lit by a sun and by a lamp within it, against the reference at depth 1.
#[test]
fn the_reference_agrees() {
    let Some(gpu) = gpu() else { return };
    let curved = |x: DVec3| 1.0 + (6.0 * x.x).sin() * (5.0 * x.y).cos() * x.z;
    for position in [[2.0, 0.6, 0.3], [0.2, 0.3, 3.0], [0.1, -0.2, 0.3]] {
        let text = format!(
            "camera = {{ position = {position:?}, target = [0.02, 0.01, -0.03], fov = 0.001 }}\nfilm.size = [1, 1]\n\
             lights.sun.directional = {{ direction = [1, -1, 0.3], irradiance = 1 }}\n\
             lights.lamp.point = {{ position = [-0.3, 0.3, 0.2], intensity = 0.2 }}\n\
             techniques.cells.depth_step = 0.03\n\
             {MEDIUM}optics.coefficients = {{ sigma_s = [1, 2, 0.5], sigma_a = [0.2, 0.3, 1], phase.hg.g = 0.3 }}"
        );
        let field = hexahedra(4, true, |middle| middle.distance(DVec3::splat(0.5)) < 0.6, curved);
        let world = meshed(&text, field);
        let found = DVec3::from(picture(&gpu, &world).pixels[0].map(f64::from));
        let tracer = Tracer::new(&world).unwrap();
        let from = DVec3::from(position);
        let way = (DVec3::new(0.02, 0.01, -0.03) - from).normalize();
        const SAMPLES: u64 = 100_000;
        let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
        for i in 0..SAMPLES {
            let sample = tracer.radiance(from, way, Some(1), &mut Random::new(5, 0, i));
            sum += sample;
            squares += sample * sample;
        }
        let n = SAMPLES as f64;
        let mean = sum / n;
        let error = ((squares / n - mean * mean) / n).map(f64::sqrt);
        assert!(error.max_element() < 0.01 * mean.max_element(), "{mean} ± {error} says little");
        let bound = 4.5 * error + tolerance::CELLS_SCATTERING * mean;
        assert!((found - mean).abs().cmple(bound).all(), "{found} for {mean} ± {error}");
    }
}

/// The shipped mesh: every pixel is finished, and many short rounds make the picture of few long ones.
#[test]
fn the_shipped_mesh_in_rounds() {
    let Some(mut gpu) = gpu() else { return };
    let text = include_str!("../../../../../scenes/tetrahedra.toml").replace("[640, 480]", "[40, 30]");
    let mut assets = shipped();
    assets.0.push(("tetrahedra.vtu", include_bytes!("../../../../../scenes/tetrahedra.vtu")));
    let world = world_of(&text.replace("depth_step = 0.25", "depth_step = 0.25\nsamples = 2"), &assets);
    let few = picture(&gpu, &world);
    let open = few.pixels.iter().flatten().filter(|value| !value.is_finite()).count();
    assert_eq!(open, 0, "values of pixels are not finished");
    assert!(few.pixels.iter().filter(|pixel| pixel[0] > 0.0).count() > 100, "there is something to see");
    gpu.limit_iterations(30_000);
    let error = metrics::linear::linear_errors(&picture(&gpu, &world), &few).relative_rmse;
    assert!(error <= tolerance::ROUNDS, "relative RMSE {error}");
}

#[test]
fn what_is_no_mesh() {
    let Some(gpu) = gpu() else { return };
    let message = |world: &World| match render(&gpu, world) {
        Err(error @ RenderError::Setting(_)) => error.to_string(),
        other => panic!("{:?}", other.map(|_| "a picture")),
    };
    let scene =
        |technique: &str| format!("{CAMERA}[techniques.{technique}]\n{MEDIUM}optics.coefficients.sigma_a = 1\n");
    assert_eq!(
        message(&world(&scene("cells"))),
        "techniques.cells: found media.m, which is no mesh; accepted: one medium with a density.mesh"
    );
    assert_eq!(
        message(&world(&(scene("cells") + &MEDIUM.replace("media.m", "media.n") + "optics.coefficients.sigma_a = 1"))),
        "techniques.cells: found 2 media; accepted: one medium with a density.mesh"
    );
    assert_eq!(
        message(&meshed(&scene("march"), hexahedra(1, false, all, |_| 1.0))),
        "media.m.density.mesh: found a mesh, with techniques.march; accepted: a mesh with techniques.cells"
    );
}

/// A surface in the middle of a mesh is seen through the half before it, e^{−σ/2}, and the half behind it is not seen; and a roof
/// keeps the sun off.
#[test]
fn cells_end_at_surfaces() {
    let Some(gpu) = gpu() else { return };
    let cells = "techniques.cells = {}\n";
    let optics = "optics.coefficients = { sigma_a = [1, 2, 3], emission = [1, 1, 1] }\n";
    let quad =
        "surfaces.quad = { shape.quad = { corner = [-1, -1, 0], edges = [[2, 0, 0], [0, 2, 0]] }, radiance = 5 }\n";
    let world = meshed(&format!("{CAMERA}{cells}{quad}{MEDIUM}{optics}"), hexahedra(3, true, |_| true, |_| 1.0));
    let expected = [1.0, 2.0, 3.0f64].map(|sigma| {
        let through = (-0.5 * sigma).exp();
        5.0 * through + (1.0 - through) / sigma
    });
    assert_radiance(&picture(&gpu, &world), expected, tolerance::EXACT);

    let sun = "lights.sun.directional = { direction = [0, -1, 0], irradiance = 1 }\n";
    let roof = "surfaces.roof.shape.quad = { corner = [-1, 1, 1], edges = [[2, 0, 0], [0, 0, -2]] }\n";
    let optics = "optics.coefficients.sigma_s = 1\n";
    let lit = |roof: &str| {
        let text = format!("{CAMERA}{cells}{sun}{roof}{MEDIUM}{optics}");
        picture(&gpu, &meshed(&text, hexahedra(3, true, |_| true, |_| 1.0))).pixels[0][0]
    };
    assert!(lit("") > 0.01);
    assert_eq!(lit(roof), 0.0);
}
