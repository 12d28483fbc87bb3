//! What Tyndall renders, and what comes out: scene files, volumes, images and the metrics that compare them.
//!
//! Data goes one way: a [`Document`] (text with line numbers) is parsed into a [`Scene`] (plain values with units),
//! which is loaded with its [`Assets`] into a [`World`] (densities in memory), which `tyndall` and `tyndall-reference`
//! render. Nothing here touches a GPU, and everything but file access builds for wasm32.

pub mod assets;
mod blackbody;
pub mod description;
mod document;
mod environment;
pub mod field;
pub mod image;
pub mod metrics;
pub mod parameter;
pub mod particles;
pub mod phase;
mod placed;
pub mod strands;
pub mod surface;
pub mod volume;
mod world;

pub use assets::Assets;
pub use blackbody::{HOTTEST, black_body};
pub use description::Scene;
pub use document::{Document, FieldError, Format, MAX_TEXT, SceneError};
pub use environment::{EnvironmentError, EnvironmentMap};
pub use glam;
pub use placed::{Color, PlacedGrid, Temperature};
pub use world::{Field, LoadError, Volume, World};
