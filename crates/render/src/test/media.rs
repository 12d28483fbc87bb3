//! Media of a running frame.

use tyndall_scene::World;
use tyndall_scene::description::Optics;

use super::{blob, gpu, render, world};
use crate::{Frame, Gpu};

/// What a medium does to light, as a scene file says it.
fn optics(text: &str) -> Optics {
    let scene = format!(
        "camera = {{ position = [0, 0, 5], target = [0, 0, 0] }}\n[media.it]\n\
        density.sphere = {{ center = [0, 0, 0], radius = 1 }}\noptics.{text}"
    );
    world(&scene).volumes[0].optics.clone()
}

fn rendered(gpu: &Gpu, frame: &mut Frame) -> Vec<[f32; 3]> {
    frame.render();
    pollster::block_on(crate::renderer::read_film(gpu, frame.film())).unwrap()
}

fn small_blob(technique: &str) -> World {
    let mut world = blob(&format!("[techniques.{technique}]"));
    world.scene.film.size = [32, 24];
    world
}

/// Every knob of the optics, and the change from one kind to the other: as a new frame, in the same texture of voxels.
#[test]
fn changed_optics_show_in_the_next_rendering() {
    let Some(gpu) = gpu() else { return };
    const STOPS: &str = "unit_length = 0.1, stops = [{ value = 0.2, opacity = 0, color = [1, 0.2, 0.1] }, \
                         { value = 0.9, opacity = 0.5, color = [0.2, 0.4, 1] }]";
    let knobs = [
        "coefficients = { sigma_a = 2, emission = [1, 4, 9] }".into(),
        "coefficients = { sigma_s = [3, 5, 8], phase.hg.g = 0.5 }".into(),
        format!("transfer = {{ {STOPS} }}"),
        format!("transfer = {{ {} }}", STOPS.replace("value = 0.2", "value = 0.7")),
        format!(
            "transfer = {{ {STOPS}, shading = {{}}, isosurfaces = [{{ value = 0.6, opacity = 0.5, color = [1, 1, 1] }}] }}"
        ),
        "coefficients = { sigma_a = 8 }".into(),
    ];
    for technique in ["march", "project", "slicing", "splatting"] {
        let mut world = small_blob(technique);
        let mut frame = pollster::block_on(Frame::new(&gpu, &world)).unwrap();
        let (film, atlas) = (frame.film().clone(), frame.resident().atlas.clone());
        let mut pictures = 0;
        for knob in &knobs {
            world.set_optics("blob", optics(knob)).unwrap();
            let changed = pollster::block_on(frame.set_media(&world));
            match render(&gpu, &world) {
                Ok(new) => {
                    changed.unwrap();
                    assert_eq!(rendered(&gpu, &mut frame), new.image.pixels, "{technique}: {knob}");
                    pictures += 1;
                }
                Err(refused) => assert_eq!(changed.unwrap_err().to_string(), refused.to_string()),
            }
        }
        assert!(pictures >= 3, "{technique} shows what it can show");
        assert!(*frame.film() == film && frame.resident().atlas == atlas, "the textures are those that there were");
    }
}

/// What cannot be shown is an error that says why, and the frame goes on as before.
#[test]
fn other_voxels_and_unknown_media_are_refused() {
    let Some(gpu) = gpu() else { return };
    let mut world = small_blob("march");
    let mut frame = pollster::block_on(Frame::new(&gpu, &world)).unwrap();
    let before = rendered(&gpu, &mut frame);
    let refused = world.set_optics("blop", optics("coefficients = { sigma_a = 1 }")).unwrap_err();
    assert_eq!(refused.to_string(), "media.blop: found no such medium; accepted: blob");
    let other = small_blob("march");
    let refused = pollster::block_on(frame.set_media(&other)).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "media.blob: found a grid that the frame was not made with; \
         accepted: the grids of the world that it was made of; for others, a new frame"
    );
    assert_eq!(rendered(&gpu, &mut frame), before);
    // Media without voxels may come and go.
    world.volumes.clear();
    pollster::block_on(frame.set_media(&world)).unwrap();
    assert!(rendered(&gpu, &mut frame).iter().all(|pixel| *pixel == [0.1, 0.2, 0.4]));
}
