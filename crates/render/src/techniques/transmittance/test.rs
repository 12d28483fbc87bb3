//! Maps of transmittance against closed forms and the inner march.

use std::time::Instant;

use tyndall_scene::image::Image;
use tyndall_scene::metrics;

use crate::test::{FOG, PLUME, gpu, shipped, tolerance, world, world_of};

fn error(found: &Image, expected: &Image) -> f64 {
    metrics::linear::linear_errors(found, expected).relative_rmse
}

#[test]
fn explore() {
    let Some(gpu) = gpu() else { return };
    let scene = PLUME.replace("[640, 480]", "[320, 240]");
    let show = |settings: &str, expected: Option<&Image>| {
        let world = world_of(&format!("{scene}\n{settings}"), &shipped());
        let mut frame = pollster::block_on(crate::Frame::new(&gpu, &world)).unwrap_or_else(|error| panic!("{error}"));
        let mut wall = 0.0;
        let mut times = Vec::new();
        for _ in 0..3 {
            frame.timings();
            let begun = Instant::now();
            frame.render();
            gpu.wait().unwrap();
            wall = begun.elapsed().as_secs_f64();
            times = frame.timings();
        }
        let mut sums = std::collections::BTreeMap::new();
        times.into_iter().for_each(|(label, time)| *sums.entry(label).or_insert(0.0) += time);
        let pixels = pollster::block_on(crate::renderer::read_film(&gpu, frame.film())).unwrap();
        let [width, height] = world.scene.film.size;
        let image = Image { width, height, pixels, ..Default::default() };
        let error = expected.map_or(0.0, |expected| error(&image, expected));
        println!("{settings:?}: error {error:.4}, wall {wall:.4}, {sums:.4?}");
        image
    };
    let march = show("", None);
    show("[techniques.march]\nlight_step = 1", Some(&march));
    show("[techniques.march]\nlight_step = 0.5", Some(&march));
    show("[techniques.march]\nmodel = \"absorption\"", Some(&march));
    for settings in std::env::var("EXPLORE").unwrap_or_default().split(';') {
        show(&format!("[techniques.transmittance]\n{}", settings.replace(',', "\n")), Some(&march));
    }
}
