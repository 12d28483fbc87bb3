//! Tyndall renders light through things that are not opaque (smoke, fog, clouds, CT and MRI volumes) on wgpu.
//!
//! [`render`] makes a picture without a window; a [`Frame`] renders into textures of the caller's own device. Both take
//! a [`World`](tyndall_scene::World), a scene with its assets in memory.
//!
//! The order of a frame stands in [`mod@frame`], what is rendered how in [`techniques`], the list of passes in [`graph`].

pub mod display;
mod error;
pub mod frame;
mod gpu;
pub mod graph;
pub mod layers;
pub mod math;
mod probe;
mod renderer;
pub mod resident;
pub mod shadows;
pub mod sorting;
pub mod surfaces;
pub mod techniques;
#[cfg(test)]
mod test;

pub use error::RenderError;
pub use frame::Frame;
pub use gpu::{AdapterChoice, Gpu, INSTALL_HELP, adapters};
pub use probe::{Sample, probe};
pub use renderer::{Rendering, render};
pub use tyndall_scene as scene;
pub use wgpu;
