//! Tests that span the crate, and what tests share: the device, tolerances, probes, small worlds.

mod bindings;
mod display;
mod golden;
mod layout;
mod limits;
mod probe;
pub mod tolerance;

use tyndall_scene::assets::{Assets, Embedded};
use tyndall_scene::image::Image;
use tyndall_scene::volume::Budget;
use tyndall_scene::{Document, World};

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
