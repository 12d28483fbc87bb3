//! Drawn bodies against closed forms.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use tyndall_reference::Options;
use tyndall_scene::metrics::linear::linear_errors;
use tyndall_scene::particles::{Particle, Particles};
use tyndall_scene::strands::{Knot, Strands};
use tyndall_scene::{Field, World};

use crate::graph::{Shader, shader};
use crate::math::bodies::{ball_passage, ball_profile_before};
use crate::math::fibre::fibre_opacity;
use crate::surfaces::test::{through, view_of};
use crate::test::probe::{assert_close, probe, spread};
use crate::test::{gpu, picture, render, tolerance, world};

/// A world whose medium `smoke` is made of these balls.
pub fn of_balls(text: &str, optics: &str, list: Vec<Particle>) -> World {
    of(text, optics, Field::Particles(Arc::new(Particles::new(list).unwrap())))
}

/// A world whose medium `smoke` is made of these bodies.
fn of(text: &str, optics: &str, bodies: Field) -> World {
    let head = "density.head = { number = 1, segments = 2 }";
    let mut world = world(&format!("{text}\n[media.smoke]\n{head}\noptics.coefficients = {{ {optics} }}"));
    world
        .volumes
        .iter_mut()
        .filter(|volume| volume.name == "smoke")
        .for_each(|volume| volume.set_bodies(bodies.clone()));
    world
}

fn ball(position: Vec3, radius: f32, depth: f32) -> Particle {
    Particle { position, radius, color: Vec3::ONE, depth }
}

/// Balls of all sizes in a cube of 2 m around the origin.
fn cloud(count: usize) -> Vec<Particle> {
    let at = |i| Vec3::from([0, 1, 2].map(|d| 2.0 * spread(i, d) - 1.0));
    let color = |i| Vec3::from([3, 4, 5].map(|d| spread(i, d)));
    (0..count)
        .map(|i| Particle { color: color(i), ..ball(at(i), 0.1 + 0.4 * spread(i, 4), 0.6 * spread(i, 5)) })
        .collect()
}

/// The direction through the middle of each pixel.
fn rays(world: &World) -> impl Iterator<Item = DVec3> {
    let view = view_of(world);
    (0..view.width * view.height)
        .map(move |i| through(&view, glam::vec2((i % view.width) as f32, (i / view.width) as f32) + 0.5))
}

/// The depth of balls along a ray up to a distance.
fn depth(list: &[Particle], eye: DVec3, direction: DVec3, limit: f64) -> f64 {
    let of = |ball: &Particle| {
        let radius = f64::from(ball.radius);
        let passage = ball_passage(ball.position.as_dvec3(), radius, eye, direction);
        let at = |t: f64| ball_profile_before(passage.y, (t - passage.x) / radius);
        f64::from(ball.depth) * (at(limit) - at(0.0))
    };
    list.iter().map(of).sum()
}

/// Holds what comes through to the eye from an environment of radiance 1, or a surface, against e^{−Στ}, each τ in closed form.
fn assert_transmittance(world: &World, list: &[Particle], limit: impl Fn(DVec3) -> f64, tolerance: f64) {
    let Some(gpu) = gpu() else { return };
    let eye = world.scene.camera.position.as_dvec3();
    let mut least = 1.0f64;
    for (direction, pixel) in rays(world).zip(&picture(&gpu, world).pixels) {
        let expected = (-depth(list, eye, direction, limit(direction))).exp();
        least = least.min(expected);
        assert!((f64::from(pixel[0]) - expected).abs() < tolerance, "{pixel:?} for {expected} towards {direction}");
    }
    assert!(least < 0.8, "there is something to see: {least}");
}

const ORDERS: [&str; 2] = ["order = \"sorted\"", "order = \"coefficients\""];

fn camera(z: f32, fov: f32, order: &str) -> String {
    format!(
        "camera = {{ position = [0.1, 0.05, {z}], target = [0, 0, 0], fov = {fov} }}\nfilm.size = [24, 20]\n\
         lights.sky.constant.radiance = 1\ntechniques.particles = {{ model = \"absorption\", area_points = 0, {order} }}"
    )
}

/// From afar, from near its rim, from within, with the ball before and behind the eye: e^{−τ₀(1 − b²/r²)^{5/2}}, in part from
/// within.
#[test]
fn a_ball_is_its_closed_form() {
    for order in ORDERS {
        for (z, fov) in [(3.0, 40.0), (1.02, 80.0), (0.999, 90.0), (0.3, 100.0), (-0.4, 120.0)] {
            let list = vec![ball(Vec3::ZERO, 1.0, 1.5)];
            let world = of_balls(&camera(z, fov, order), "sigma_a = 1", list.clone());
            assert_transmittance(&world, &list, |_| f64::INFINITY, tolerance::BALLS);
        }
    }
}

/// However many overlap, and with the eye among them, what comes through is exact: it depends on no order.
#[test]
fn many_balls_are_their_closed_form() {
    for order in ORDERS {
        for z in [4.0, 0.2] {
            let list = cloud(150);
            let world = of_balls(&camera(z, 60.0, order), "sigma_a = 0.4, sigma_s = 0.1", list.clone());
            let halved: Vec<_> = list.iter().map(|b| Particle { depth: 0.5 * b.depth, ..*b }).collect();
            assert_transmittance(&world, &halved, |_| f64::INFINITY, tolerance::MANY_BALLS);
        }
    }
}

/// A surface cuts a ball at its own distance, whichever part is before it.
#[test]
fn a_surface_cuts_balls() {
    for order in ORDERS {
        for z in [-0.6, 0.0, 0.5] {
            let wall = format!(
                "{}\nsurfaces.wall = {{ shape.quad = {{ corner = [-9, -9, {z}], edges = [[18, 0, 0], [0, 18, 0]] }}, radiance = 1, material = \"black\" }}\nmaterials.black.lambert.reflectance = 0\ntechniques.direct.area_points = 0",
                camera(3.0, 40.0, order)
            );
            let list = vec![ball(Vec3::ZERO, 1.0, 1.5), ball(Vec3::new(0.2, 0.1, 0.3), 0.5, 0.7)];
            let world = of_balls(&wall, "sigma_a = 1", list.clone());
            let eye = world.scene.camera.position.as_dvec3();
            let limit = |direction: DVec3| (z - eye.z) / direction.z;
            assert_transmittance(&world, &list, limit, tolerance::CUT_BALLS);
        }
    }
}

/// Planes cut balls as they cut rays.
#[test]
fn planes_cut_balls() {
    let Some(gpu) = gpu() else { return };
    let list = vec![ball(Vec3::ZERO, 1.0, 1.5)];
    let text = camera(3.0, 40.0, "");
    let mut cut = of_balls(&text, "sigma_a = 1", list.clone());
    let plane = tyndall_scene::description::Plane { normal: Vec3::Z, distance: 0.0 };
    cut.volumes[0].clip = vec![plane];
    let eye = cut.scene.camera.position.as_dvec3();
    for (direction, pixel) in rays(&cut).zip(&picture(&gpu, &cut).pixels) {
        let all = depth(&list, eye, direction, f64::INFINITY);
        let expected = (depth(&list, eye, direction, -eye.z / direction.z) - all).exp();
        assert!((f64::from(pixel[0]) - expected).abs() < tolerance::BALLS, "{pixel:?} for {expected}");
    }
}

/// A lamp of 1 W/m², so far away that it lights all alike; surfaces that emit have no maps, so that nothing is lost on the way.
pub const LAMP: &str =
    "surfaces.lamp = { shape.quad = { corner = [-0.5, 100, -0.5], edges = [[1, 0, 0], [0, 0, 1]] }, radiance = 1e4 }";

/// The nearer hides the farther, from either side; and without a sort nearly as much.
#[test]
fn the_nearer_hides_the_farther() {
    let Some(gpu) = gpu() else { return };
    let list = vec![
        Particle { color: Vec3::X, ..ball(Vec3::NEG_Z, 0.5, 3.0) },
        Particle { color: Vec3::Y, ..ball(Vec3::Z, 0.5, 3.0) },
    ];
    for order in ORDERS {
        for (z, near, far) in [(5, 1, 0), (-5, 0, 1)] {
            let text = format!(
                "camera = {{ position = [0, 0, {z}], target = [0, 0, 0], fov = 0.01 }}\nfilm.size = [2, 2]\n\
                 {LAMP}\ntechniques.particles = {{ area_points = 1, {order} }}"
            );
            let pixel = picture(&gpu, &of_balls(&text, "sigma_s = 1", list.clone())).pixels[0];
            let alpha = 1.0 - (-3f64).exp();
            let source = 0.25 * std::f64::consts::FRAC_1_PI;
            let tolerance = if order == ORDERS[0] { tolerance::THIN_BALL } else { tolerance::HIDDEN };
            assert!((f64::from(pixel[near]) / source - alpha).abs() < tolerance, "{order}: {pixel:?}");
            assert!((f64::from(pixel[far]) / source - alpha * (1.0 - alpha)).abs() < tolerance, "{order}: {pixel:?}");
        }
    }
}

/// Single scattering of every kind of light by thin balls: L = σ_s·color·p·E·τ, and none where an opaque surface is before the light.
#[test]
fn thin_balls_scatter_light() {
    let Some(gpu) = gpu() else { return };
    let list = vec![Particle { color: Vec3::new(1.0, 0.5, 0.25), ..ball(Vec3::ZERO, 0.1, 1e-3) }];
    let hg = |cosine: f64| 0.25 * std::f64::consts::FRAC_1_PI * 0.75 / (1.25 - cosine).powf(1.5);
    for lighting in ["body", "pixel"] {
        for (light, irradiance, cosine) in [
            ("lamp.directional = { direction = [0, -1, 0], irradiance = 2 }", 2.0, 0.0),
            ("lamp.directional = { direction = [0, 0, 1], irradiance = 2 }", 2.0, 1.0),
            ("lamp.point = { position = [0, 2, 0], intensity = 2 }", 0.5, 0.0),
            (
                "lamp.spot = { position = [0, 0, 2], direction = [0, 0, -1], intensity = 2, inner_angle = 8, outer_angle = 9 }",
                0.5,
                -1.0,
            ),
        ] {
            let scene = |more: &str| {
                let text = format!(
                    "camera = {{ position = [0, 0, 5], target = [0, 0, 0], fov = 0.01 }}\nfilm.size = [2, 2]\nlights.{light}\n\
                     techniques.particles = {{ lighting = \"{lighting}\" }}\n{more}"
                );
                of_balls(&text, "sigma_s = 1, phase.hg.g = 0.5", list.clone())
            };
            let pixel = picture(&gpu, &scene("")).pixels[0];
            for (c, color) in [1.0, 0.5, 0.25].into_iter().enumerate() {
                let expected = color * irradiance * hg(cosine) * 1e-3;
                assert!((f64::from(pixel[c]) / expected - 1.0).abs() < tolerance::THIN_BALL, "{light}: {pixel:?}");
            }
            // Around the ball, but not between it and the eye.
            let lid = "surfaces.lid.shape.quad = { corner = [-3, 0.5, -0.5], edges = [[6, 0, 0], [0, 0, 1]] }\n\
                       surfaces.back.shape.quad = { corner = [-3, -3, -0.5], edges = [[6, 0, 0], [0, 6, 0]] }";
            if cosine >= 0.0 {
                let pixel = picture(&gpu, &scene(lid)).pixels[0];
                let behind = picture(&gpu, &{
                    let mut world = scene(lid);
                    world.volumes.clear();
                    world
                })
                .pixels[0];
                assert!((pixel[0] - behind[0]).abs() <= 2e-3 * behind[0] + 1e-9, "{light}: {pixel:?} {behind:?}");
            }
        }
    }
}

/// The environment shines from all around: on a thin ball it is as if it were not there but for what it absorbs.
#[test]
fn the_environment_lights_bodies() {
    let Some(gpu) = gpu() else { return };
    let text = "camera = { position = [0, 0, 5], target = [0, 0, 0], fov = 0.01 }\nfilm.size = [2, 2]\nlights.sky.constant.radiance = [1, 2, 3]";
    for (optics, lost) in [("sigma_s = 1", 0.0), ("sigma_s = 0.5, sigma_a = 0.5", 0.005)] {
        let pixel = picture(&gpu, &of_balls(text, optics, vec![ball(Vec3::ZERO, 0.1, 0.01)])).pixels[0];
        for c in 0..3 {
            assert!((pixel[c] / (c + 1) as f32 - 1.0 + lost).abs() < 1e-4, "{pixel:?}");
        }
    }
}

#[test]
fn mean_opacities_of_fibres_equal_their_twins() {
    static FIBRE: Shader = shader!("test/probes/fibre");
    let Some(gpu) = gpu() else { return };
    let input: Vec<_> = (0..640)
        .map(|i| {
            let [a, b] = [spread(i, 0), spread(i, 1)].map(|x| 2.4 * x - 1.2);
            let part = if i % 4 == 0 { [-1.0, 1.0] } else { [a.min(b).max(-1.0), a.max(b).clamp(-1.0, 1.0)] };
            glam::Vec4::new(part[0], part[1], (6.0 * spread(i, 2) - 4.0).exp2(), spread(i, 3))
        })
        .filter(|x| x.x < x.y)
        .collect();
    let whole = &input[..input.len() / 64 * 64];
    for (x, found) in whole.iter().zip(probe(&gpu, &FIBRE, whole)) {
        let twin = fibre_opacity([x.x.into(), x.y.into()], x.z.into(), x.w.into(), 4000);
        assert_close(found.x.into(), twin, tolerance::PROBE_FIBRE, x);
    }
}

/// Opacity summed over pixels is the mean opacity over the width times what a fibre covers, at any width and angle, with
/// joints; and nothing is left out or counted twice where segments meet.
#[test]
fn a_fibre_takes_as_much_light_at_any_width() {
    let Some(gpu) = gpu() else { return };
    // A pixel is 1/32 m wide, seen from so far away that rays are parallel.
    let scene = |knots: &[Vec3], radius: f32| {
        let text = "camera = { position = [0, 0, 300], target = [0, 0, 0], fov = 0.3819681 }\nfilm.size = [64, 64]\n\
                    lights.sky.constant.radiance = 1\ntechniques.particles.model = \"absorption\"";
        let knots: Vec<_> =
            knots.iter().map(|&position| Knot { position, radius, color: Vec3::ONE, depth: 2.0 }).collect();
        let count = knots.len() as u32;
        let strands = Strands::new(knots, &[count]).unwrap();
        picture(&gpu, &of(text, "sigma_a = 0.5", Field::Strands(Arc::new(strands))))
    };
    let bent: Vec<Vec3> =
        (0..17).map(|i| Vec3::new(i as f32 / 10.0 - 0.8, 0.3 * (0.5 * i as f32).sin(), 0.0)).collect();
    for radius in [0.001, 0.01, 0.03, 0.12] {
        for knots in [&[Vec3::new(-0.7, -0.31, 0.0), Vec3::new(0.7, 0.4, 0.0)][..], &bent] {
            // In several places, as ends lie in the middle of pixels.
            let moved = (0..4).map(|k| knots.iter().map(|&p| p + Vec3::X * k as f32 / 128.0).collect::<Vec<_>>());
            let all = moved.flat_map(|knots| scene(&knots, radius).pixels);
            let sum = all.map(|p| 1.0 - f64::from(p[0])).sum::<f64>() / 4096.0;
            let length: f64 = knots.windows(2).map(|ends| f64::from(ends[0].distance(ends[1]))).sum();
            let mean = 0.5 * fibre_opacity([-1.0, 1.0], 2.0, 0.5, 1000);
            let expected = 2.0 * f64::from(radius) * length * mean;
            assert!((sum / expected - 1.0).abs() < tolerance::FIBRE, "{sum} for {expected} with {radius}");
        }
    }
    // A strand cut into many is as one.
    let straight: Vec<_> =
        (0..40).map(|i| Vec3::new(-0.7, -0.31, 0.0).lerp(Vec3::new(0.7, 0.4, 0.0), i as f32 / 39.0)).collect();
    for radius in [0.005, 0.05] {
        let (one, many) = (scene(&[straight[0], straight[39]], radius), scene(&straight, radius));
        let differ = |(a, b): (&[f32; 3], &[f32; 3])| (a[0] - b[0]).abs() > 1e-3;
        assert_eq!(one.pixels.iter().zip(&many.pixels).filter(|&pair| differ(pair)).count(), 0, "{radius}");
    }
}

/// Smoke over a floor in the sun against the reference at the same depth: what is left of the relative error without the reference's
/// noise.
#[test]
fn smoke_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let text = include_str!("../../../../../scenes/particles.toml").replace("number = 16384", "number = 3000");
    let text = text.replace("opacity = 0.05", "opacity = 0.2").replace("[480, 480]", "[36, 36]");
    let few = "environment_directions = 4";
    let text = format!("{text}\n[techniques.transmittance]\ncoefficients = 15");
    let world = world(&format!("{text}\n[techniques.particles]\n{few}\n[techniques.direct]\n{few}"));
    let options = Options { depth: Some(1), samples: Some(64), ..Options::default() };
    let truth =
        tyndall_reference::render(&world, &options, None, &mut |_| std::ops::ControlFlow::Continue(())).unwrap();
    let errors = linear_errors(&picture(&gpu, &world), &truth);
    assert!(errors.relative_bias.unwrap() < tolerance::DRAWN_SMOKE, "{errors:?}");
}

/// What cannot be shown is refused, with what is accepted.
#[test]
fn what_cannot_be_shown_is_refused() {
    let Some(gpu) = gpu() else { return };
    let refused = |world: &World| render(&gpu, world).err().map(|error| error.to_string()).unwrap_or_default();
    let text = camera(3.0, 40.0, "");
    let list = || vec![ball(Vec3::ZERO, 1.0, 1.5)];
    let coloured = refused(&of_balls(&text, "sigma_a = [1, 2, 3]", list()));
    assert!(coloured.contains("media.smoke.optics.coefficients: found an extinction"), "{coloured}");
    let both = text.replace("model = \"absorption\"", "order = \"coefficients\", lighting = \"pixel\"");
    let both = refused(&of_balls(&both, "sigma_a = 1", list()));
    assert!(both.contains("techniques.particles.lighting"), "{both}");
    let fog =
        "[media.fog]\ndensity.homogeneous = { min = [0, 0, 0], max = [1, 1, 1] }\noptics.coefficients.sigma_a = 1";
    let beside = refused(&of_balls(&format!("{text}\n{fog}"), "sigma_a = 1", Vec::new()));
    assert!(beside.contains("media.fog.density: found a medium that is not made of particles"), "{beside}");
    let marched = refused(&of_balls(
        &format!("{}\n{fog}", text.replace("techniques.particles", "techniques.march").replace(", }", " }")),
        "sigma_a = 1",
        list(),
    ));
    assert!(marched.contains("techniques.particles"), "{marched}");
}

/// Nothing, and balls beyond the film, leave the environment as it is.
#[test]
fn nothing_is_the_environment() {
    let Some(gpu) = gpu() else { return };
    for order in ORDERS {
        for list in [Vec::new(), vec![ball(Vec3::new(0.0, 0.0, 90.0), 1.0, 1.0)]] {
            let image = picture(&gpu, &of_balls(&camera(3.0, 40.0, order), "sigma_a = 1", list));
            assert_eq!(image.pixels, vec![[1.0; 3]; 480], "{order}");
        }
    }
}
