//! A scene built in code, rendered without a window: two overlapping puffs of coloured smoke before a sky.
//!
//!     cargo run -p tyndall --example headless -- puffs.png

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use tyndall::scene::World;
use tyndall::scene::assets::Embedded;
use tyndall::scene::description::{Camera, Density, Film, Light, Medium, Optics, Phase, Scene, Transform};
use tyndall::scene::glam::{Vec3, vec3};
use tyndall::scene::volume::Budget;
use tyndall::{AdapterChoice, Gpu};

fn puff(position: Vec3, sigma_s: Vec3) -> Medium {
    Medium {
        density: Density::Homogeneous { min: Vec3::splat(-0.5), max: Vec3::splat(0.5) },
        optics: Optics::Coefficients {
            sigma_s,
            sigma_a: Vec3::splat(0.2),
            emission: Vec3::ZERO,
            phase: Phase::Hg { g: 0.3 },
        },
        transform: Transform { translate: position, rotate: vec3(20.0, 35.0, 0.0), ..Default::default() },
        clip: None,
        temperature: None,
        color: None,
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sun = Light::Directional { direction: vec3(-0.4, -1.0, -0.6), irradiance: Vec3::splat(12.0) };
    let sky = Light::Constant { radiance: vec3(0.15, 0.25, 0.45) };
    let scene = Scene {
        camera: Camera { position: vec3(0.0, 0.6, 4.0), ..Default::default() },
        film: Film { size: [480, 320], exposure: 0.0 },
        lights: BTreeMap::from([("sun".into(), sun), ("sky".into(), sky)]),
        media: BTreeMap::from([
            ("left".into(), puff(vec3(-0.4, 0.0, 0.0), vec3(6.0, 2.0, 1.0))),
            ("right".into(), puff(vec3(0.4, 0.1, 0.2), vec3(1.0, 2.0, 6.0))),
        ]),
        ..Default::default()
    };
    let world = World::load(scene, &Embedded::default(), Budget(1 << 30))?;
    let gpu = pollster::block_on(Gpu::open(&AdapterChoice::Best))?;
    let rendering = pollster::block_on(tyndall::render(&gpu, &world, &mut |_| ControlFlow::Continue(())))?;
    let path = std::env::args().nth(1).unwrap_or("puffs.png".into());
    rendering.image.write(path.as_ref(), world.scene.film.exposure)?;
    println!("{path} on {}: {:?}", gpu.name(), rendering.passes);
    Ok(())
}
