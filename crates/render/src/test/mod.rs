//! Tests that span the crate, and what tests share: the device, tolerances, probes, small worlds.

mod bindings;
mod display;
mod golden;
mod layout;
mod limits;
pub mod maps;
mod media;
mod moving;
pub mod probe;
pub mod tolerance;

use std::sync::Arc;

use glam::Mat4;
use tyndall_scene::assets::{Assets, Embedded};
use tyndall_scene::image::Image;
use tyndall_scene::volume::{Budget, Grid, Voxels};
use tyndall_scene::{Document, Field, World};

use crate::{AdapterChoice, Gpu, RenderError};

/// The CPU driver, on which all figures of the tests hold. Without one the calling test is skipped and says so, unless
/// `TYNDALL_REQUIRE_ADAPTER` is set.
pub fn gpu() -> Option<Gpu> {
    match pollster::block_on(Gpu::open(&AdapterChoice::Cpu)) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            assert!(std::env::var_os("TYNDALL_REQUIRE_ADAPTER").is_none(), "{error}");
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// A world from a scene's text and files in memory.
pub fn world_of(text: &str, assets: &dyn Assets) -> World {
    let scene = Document::new("test.toml", text).parse().unwrap_or_else(|error| panic!("{error}"));
    World::load(scene, assets, Budget(1 << 30)).unwrap_or_else(|error| panic!("{error}"))
}

/// A world without files.
pub fn world(text: &str) -> World {
    world_of(text, &Embedded::default())
}

/// A picture of a world.
pub fn picture(gpu: &Gpu, world: &World) -> Image {
    render(gpu, world).unwrap_or_else(|error| panic!("{error}")).image
}

/// A rendering of a world, or why there is none.
pub fn render(gpu: &Gpu, world: &World) -> Result<crate::Rendering, RenderError> {
    pollster::block_on(crate::render(gpu, world, &mut |_| std::ops::ControlFlow::Continue(())))
}

/// A Gaussian blob that absorbs and emits, in 32³ voxels of a turned box, on a film wider than a tile, with the
/// settings of a technique.
pub fn blob(technique: &str) -> World {
    let mut world = world(&format!(
        "camera = {{ position = [1.1, 0.7, 1.4], target = [0, 0, 0], fov = 40 }}\nfilm.size = [140, 60]\n\
         lights.sky.constant.radiance = [0.1, 0.2, 0.4]\n{technique}\n[media.blob]\n\
         density.homogeneous = {{ min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }}\n\
         optics.coefficients = {{ sigma_a = 8, emission = [9, 4, 1] }}\ntransform.rotate = [20, 30, 40]"
    ));
    let radius = |i: usize| (i as f32 - 15.5) / 32.0;
    let value = |i: usize| {
        let squared = radius(i % 32).powi(2) + radius(i / 32 % 32).powi(2) + radius(i / 1024).powi(2);
        (-squared / (2.0 * 0.15 * 0.15)).exp()
    };
    let voxels = Voxels::F32((0..32 * 32 * 32).map(value).collect());
    world.volumes[0].field = Field::Grid(Arc::new(Grid::dense([32; 3], voxels, Mat4::IDENTITY)));
    world
}

/// The shipped plume with emission and absorption alone, small, with the settings of a technique.
pub fn glowing_plume(technique: &str) -> World {
    let scattering = "sigma_s = 45, sigma_a = 1, phase.hg.g = 0.1";
    assert!(PLUME.contains(scattering));
    let text = PLUME.replace("[640, 480]", "[80, 60]").replace(scattering, "sigma_a = 46, emission = [50, 30, 10]");
    world_of(&format!("{text}\n{technique}"), &shipped())
}

/// The shipped fire, small, with the settings of a technique.
pub fn small_fire(technique: &str) -> World {
    world_of(&format!("{}\n{technique}", FIRE.replace("[640, 480]", "[80, 60]")), &shipped())
}

/// The shipped plume.
pub const PLUME: &str = include_str!("../../../../scenes/plume.toml");
/// The shipped plume as fire.
pub const FIRE: &str = include_str!("../../../../scenes/fire.toml");
/// The shipped fog with a spot light.
pub const FOG: &str = include_str!("../../../../scenes/fog.toml");

/// The files of the shipped scenes.
pub fn shipped() -> Embedded<'static> {
    Embedded(vec![("smoke.vdb", include_bytes!("../../../../scenes/smoke.vdb"))])
}
