//! An emitter in motion: what changes from frame to frame is what moves, not the order of drawing.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use tyndall_scene::description::Density;
use tyndall_scene::particles::{Emission, Particle};
use tyndall_scene::volume::Budget;
use tyndall_scene::{Field, World};

use super::test::LAMP;
use crate::Frame;
use crate::math::bodies::{ball_passage, ball_profile_before};
use crate::surfaces::test::{through, view_of};
use crate::test::{gpu, tolerance, world};

/// Smoke that turns from red to blue, so that it matters which of two balls is before the other, all of it lit alike.
const SCENE: &str = "camera = { position = [0.3, 1.0, 2.2], target = [0, 0.7, 0], fov = 45 }\nfilm.size = [20, 20]\n\
    techniques.particles = { area_points = 1 }\n[media.smoke]\noptics.coefficients.sigma_s = 1\n\
    density.emitter = { number = 400, lifetime = 3, velocity = [0.1, 0.5, 0], turbulence = 0.4, size = 0.15, radius = 0.08, \
    end_radius = 0.3, opacity = 0.3, end_opacity = 0, color = [1, 0, 0], end_color = [0, 0, 1] }";

/// What the smoke's first scattering sends along a ray, integrated over overlapping balls: ∫ T Σ σᵢ colorᵢ dt / 4π.
fn integrated(list: &[Particle], eye: DVec3, direction: DVec3) -> DVec3 {
    let met: Vec<_> = list
        .iter()
        .filter_map(|ball| {
            let radius = f64::from(ball.radius);
            let passage = ball_passage(ball.position.as_dvec3(), radius, eye, direction);
            (passage.y > 0.0).then_some((ball, radius, passage, radius * passage.y.sqrt()))
        })
        .collect();
    let from = met.iter().map(|(.., passage, half)| passage.x - half).fold(f64::INFINITY, f64::min).max(0.0);
    let to = met.iter().map(|(.., passage, half)| passage.x + half).fold(0.0, f64::max);
    const STEPS: u32 = 64;
    let (mut sum, mut depth) = (DVec3::ZERO, 0.0);
    for step in 0..STEPS {
        let at = |k: u32| from + (to - from) * f64::from(k) / f64::from(STEPS);
        let (mut more, mut colored) = (0.0, DVec3::ZERO);
        for &(ball, radius, passage, half) in &met {
            if (at(step) - passage.x).max(passage.x - at(step + 1)) < half {
                let before = |t: f64| ball_profile_before(passage.y, (t - passage.x) / radius);
                let here = f64::from(ball.depth) * (before(at(step + 1)) - before(at(step)));
                more += here;
                colored += here * ball.color.as_dvec3();
            }
        }
        sum += colored * (-depth - 0.5f64 * more).exp();
        depth += more;
    }
    sum * (0.25 * std::f64::consts::FRAC_1_PI)
}

/// Pictures of so many frames: drawn, and integrated.
fn pictures(frames: u32, settings: &str) -> Option<Vec<[Vec<DVec3>; 2]>> {
    let gpu = gpu()?;
    let mut world: World =
        world(&format!("{LAMP}\n{}", SCENE.replace("area_points = 1", &format!("area_points = 1, {settings}"))));
    let Density::Emitter(emitter) = world.scene.media["smoke"].density.clone() else { panic!("an emitter") };
    let mut emission = Emission::new(&emitter, Budget(1 << 28)).unwrap();
    let view = view_of(&world);
    let eye = view.position.as_dvec3();
    let mut frame: Option<Frame> = None;
    let picture = |number: u32| {
        let particles = emission.at(2.0 + f64::from(number) / 30.0).unwrap();
        let list = particles.list().to_vec();
        world.volumes[0].set_bodies(Field::Particles(Arc::new(particles)));
        let frame = match &mut frame {
            Some(frame) => {
                pollster::block_on(frame.set_media(&world)).unwrap();
                frame
            }
            none => none.insert(pollster::block_on(Frame::new(&gpu, &world)).unwrap()),
        };
        frame.render();
        let drawn = pollster::block_on(crate::renderer::read_film(&gpu, frame.film())).unwrap();
        let middle = |i: u32| glam::vec2((i % view.width) as f32, (i / view.width) as f32) + 0.5;
        let of = |i: u32| integrated(&list, eye, through(&view, middle(i)));
        let expected = (0..view.width * view.height).into_par_iter().map(of).collect();
        [drawn.into_iter().map(|pixel| Vec3::from(pixel).as_dvec3()).collect(), expected]
    };
    Some((0..frames).map(picture).collect())
}

/// How much more a pixel changes from one frame to the next than it should, at most, and in the mean of squares, relative to the
/// brightest pixel; and how much a pixel should change at most.
fn popping(pictures: &[[Vec<DVec3>; 2]]) -> [f64; 3] {
    let brightest = pictures.iter().flat_map(|[_, expected]| expected).map(|c| c.max_element()).fold(0.0, f64::max);
    let (mut most, mut squares, mut count, mut motion) = (0.0f64, 0.0, 0.0, 0.0f64);
    for pair in pictures.windows(2) {
        let [[before, before_truth], [after, after_truth]] = [&pair[0], &pair[1]];
        for i in 0..before.len() {
            let should = after_truth[i] - before_truth[i];
            let more = (after[i] - before[i] - should).abs();
            most = most.max(more.max_element());
            motion = motion.max(should.abs().max_element());
            squares += more.length_squared();
            count += 3.0;
        }
    }
    [most / brightest, (squares / count).sqrt() / brightest, motion / brightest]
}

/// 100 frames: what a pixel changes beyond what it should stays below what is seen.
#[test]
fn nothing_pops_in_a_hundred_frames() {
    for (frames, settings) in [(100, "order = \"sorted\""), (30, "order = \"coefficients\"")] {
        let Some(pictures) = pictures(frames, settings) else { return };
        let [most, mean, motion] = popping(&pictures);
        eprintln!("{settings}: at most {most}, {mean} in the mean, of a motion of {motion}");
        assert!(motion > 0.05, "something moves: {motion}");
        assert!(most < tolerance::POPPING && mean < tolerance::POPPING_MEAN, "{settings}: {most} {mean}");
    }
}

/// One frame whose reds and blues have changed places, as where the rear is drawn before the front, is seen.
#[test]
fn an_order_that_is_wrong_once_is_caught() {
    let Some(mut pictures) = pictures(3, "") else { return };
    for color in &mut pictures[1][0] {
        *color = DVec3::new(color.z, color.y, color.x);
    }
    assert!(popping(&pictures)[0] > tolerance::POPPING);
}
