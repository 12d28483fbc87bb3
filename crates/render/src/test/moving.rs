//! Surfaces that move in a running frame.

use glam::{DVec3, Mat4, Vec2, Vec3};
use tyndall_scene::World;
use tyndall_scene::metrics::linear::linear_errors;

use super::{gpu, picture, tolerance, world};
use crate::renderer::{read_film, read_texels};
use crate::surfaces::test::{SCENE, through, view_of};
use crate::{Frame, Gpu};

/// Where the block goes.
fn elsewhere() -> Mat4 {
    let scale = Mat4::from_scale(Vec3::new(1.2, 0.9, 1.1));
    Mat4::from_translation(Vec3::new(-0.3, 0.1, 0.2)) * Mat4::from_rotation_y(0.6) * scale
}

/// A world's surface of this name, moved.
fn moved(mut world: World, name: &str, transform: Mat4) -> World {
    world.surfaces.iter_mut().find(|surface| surface.name == name).unwrap().world_from_object = transform;
    world
}

/// What a frame says of motion, as it last rendered: whether it is a surface of this name, where that is along the ray through a point
/// of the film, and how far it has moved over the film.
fn motions(gpu: &Gpu, frame: &Frame, world: &World, name: &str) -> Vec<(bool, f64, Vec2, Vec2)> {
    let gbuffer = frame.gbuffer().unwrap();
    let place: Vec<[f32; 4]> = pollster::block_on(read_texels(gpu, &gbuffer.place)).unwrap();
    let facing: Vec<[u32; 4]> = pollster::block_on(read_texels(gpu, &gbuffer.facing)).unwrap();
    let motion: Vec<[f32; 2]> = pollster::block_on(read_texels(gpu, &gbuffer.motion)).unwrap();
    let number = world.surfaces.iter().position(|surface| surface.name == name).unwrap();
    let width = world.scene.film.size[0] as usize;
    let of = |(i, motion): (usize, &[f32; 2])| {
        let film = Vec2::new((i % width) as f32, (i / width) as f32) + 0.5;
        let distance = place[i][0];
        (distance < 1e30 && facing[i][2] as usize == number, f64::from(distance), film, Vec2::from(*motion))
    };
    motion.iter().enumerate().map(of).collect()
}

/// Where a point is on the film.
fn projected(view: &crate::resident::View, point: DVec3) -> Vec2 {
    let from_eye = point - view.position.as_dvec3();
    let matrix = glam::DMat3::from_cols(view.right.as_dvec3(), view.up.as_dvec3(), view.forward.as_dvec3());
    let at = matrix.inverse() * from_eye;
    let size = glam::DVec2::new(view.width.into(), view.height.into());
    ((0.5 + glam::DVec2::new(0.5, -0.5) * at.truncate() / at.z) * size).as_vec2()
}

/// Of what has moved, by the projections of where its points were in the last rendering, however often it was moved since, and from
/// where the camera was; of what stands, none, and of what stood in the next rendering, neither.
#[test]
fn motion_is_that_of_objects_too() {
    let Some(gpu) = gpu() else { return };
    let world = world(SCENE);
    let mut frame = pollster::block_on(Frame::new(&gpu, &world)).unwrap();
    frame.render();
    let before = world.surfaces.iter().find(|surface| surface.name == "block").unwrap().world_from_object;
    frame.set_transform("block", Mat4::from_rotation_z(1.0)).unwrap();
    frame.set_transform("block", elsewhere()).unwrap();
    frame.render();
    let view = view_of(&world);
    let back = before.as_dmat4() * elsewhere().as_dmat4().inverse();
    let (mut seen, mut longest) = (0, 0f32);
    for (is_block, distance, film, motion) in motions(&gpu, &frame, &world, "block") {
        if !is_block {
            assert!(motion.length() < tolerance::MOTION as f32, "{film} {motion}");
            continue;
        }
        let point = view.position.as_dvec3() + distance * through(&view, film);
        let expected = film - projected(&view, back.transform_point3(point));
        assert!(motion.distance(expected) < tolerance::MOTION as f32, "{film} {motion} {expected}");
        (seen, longest) = (seen + 1, longest.max(motion.length()));
    }
    assert!(seen > 300 && longest > 3.0, "{seen} {longest}");
    // The camera alone.
    let mut camera = world.scene.camera.clone();
    camera.position.x += 0.1;
    frame.set_camera(&camera);
    frame.render();
    let now = crate::resident::View::new(&camera, world.scene.film.size, Vec3::ZERO, 0.0);
    for (_, distance, film, motion) in motions(&gpu, &frame, &world, "block").into_iter().filter(|(is, ..)| *is) {
        let point = now.position.as_dvec3() + distance * through(&now, film);
        let expected = film - projected(&view, point);
        assert!(motion.distance(expected) < tolerance::MOTION as f32, "{film} {motion} {expected}");
    }
    // Nothing.
    frame.render();
    for (_, _, film, motion) in motions(&gpu, &frame, &world, "block") {
        assert!(motion.length() < tolerance::MOTION as f32, "{film} {motion}");
    }
}

/// A block and a lamp move: shadows and light are those of a new frame, on surfaces and in smoke.
#[test]
fn light_and_shadows_move_along() {
    let Some(gpu) = gpu() else { return };
    let more = "surfaces.lamp = { shape.quad = { corner = [0.2, 1.6, 0], edges = [[0.6, 0, 0], [0, 0, 0.6]] }, radiance = [9, 6, 3] }\n\
        lights.sun.directional = { direction = [-2, -1.5, -1], irradiance = 3 }\ntechniques.march = { area_points = 3 }\n\
        techniques.direct = { area_points = 4 }\n";
    let smoke = "[media.smoke]\noptics.coefficients = { sigma_s = 4, sigma_a = 1 }\n\
        density.sphere = { center = [-0.5, 0.6, 0.7], radius = 0.5, falloff = 0.3 }\n";
    let lit = || world(&format!("{more}{}{smoke}", SCENE.replace("[141, 97]", "[70, 48]")));
    let lamp = Mat4::from_translation(Vec3::new(-0.7, 0.4, 0.5)) * Mat4::from_rotation_z(0.4);
    let mut frame = pollster::block_on(Frame::new(&gpu, &lit())).unwrap();
    frame.render();
    let first = pollster::block_on(read_film(&gpu, frame.film())).unwrap();
    frame.set_transform("block", elsewhere()).unwrap();
    frame.set_transform("lamp", lamp).unwrap();
    frame.render();
    let film = |pixels| tyndall_scene::image::Image { width: 70, height: 48, pixels, ..Default::default() };
    let found = film(pollster::block_on(read_film(&gpu, frame.film())).unwrap());
    let expected = picture(&gpu, &moved(moved(lit(), "block", elsewhere()), "lamp", lamp));
    let error = linear_errors(&found, &expected).relative_rmse;
    assert!(error <= tolerance::MOVED, "{error}");
    let other = linear_errors(&film(first), &expected).relative_rmse;
    assert!(other > 0.3, "the motion is seen: {other}");
    // Media that change leave surfaces where they are.
    pollster::block_on(frame.set_media(&lit())).unwrap();
    frame.render();
    let again = film(pollster::block_on(read_film(&gpu, frame.film())).unwrap());
    let error = linear_errors(&again, &expected).relative_rmse;
    assert!(error <= tolerance::MOVED, "{error}");
}

#[test]
fn what_cannot_move_is_refused() {
    let Some(gpu) = gpu() else { return };
    let of = |text: &str, name: &str, transform| {
        let mut frame = pollster::block_on(Frame::new(&gpu, &world(&format!("{text}\n{SCENE}")))).unwrap();
        frame.set_transform(name, transform).unwrap_err().to_string()
    };
    let message = of("", "blocks", Mat4::IDENTITY);
    assert!(message.contains("\"blocks\"") && message.contains("ball, block, floor, wall"), "{message}");
    let message = of("", "block", Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0)));
    assert!(message.contains("surfaces.block") && message.contains("inverse"), "{message}");
    let message = of("techniques.instant_radiosity.paths = 1", "block", Mat4::IDENTITY);
    assert!(message.contains("techniques.direct"), "{message}");
}
