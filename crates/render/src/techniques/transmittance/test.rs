//! Maps of transmittance against closed forms and the inner march.

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
            let begun = cpu();
            for _ in 0..4 {
                frame.render();
            }
            gpu.wait().unwrap();
            wall = (cpu() - begun) / 4.0;
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
    let dark = world_of(&scene.replace("irradiance = [20, 18.5, 16]", "irradiance = 0"), &shipped());
    let mut frame = pollster::block_on(crate::Frame::new(&gpu, &dark)).unwrap();
    for _ in 0..3 {
        let begun = cpu();
        frame.render();
        gpu.wait().unwrap();
        println!("error dark {}", cpu() - begun);
    }
    show("[techniques.march]\nlight_step = 1", Some(&march));
    show("[techniques.march]\nlight_step = 0.5", Some(&march));
    show("[techniques.march]\nmodel = \"absorption\"", Some(&march));
    for settings in std::env::var("EXPLORE").unwrap_or_default().split(';') {
        show(&format!("[techniques.transmittance]\n{}", settings.replace(',', "\n")), Some(&march));
    }
}

fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").unwrap();
    let _ = text;
    let mut sum = 0.0;
    for entry in std::fs::read_dir("/proc/self/task").unwrap() {
        let text = std::fs::read_to_string(entry.unwrap().path().join("schedstat")).unwrap();
        sum += text.split_whitespace().next().unwrap().parse::<f64>().unwrap() * 1e-9;
    }
    sum
}
