//! The scene description: what a scene file says, with units, before any asset is read.
//!
//! Files are TOML, or JSON of the same schema. Every struct refuses unknown fields and every number is checked as it
//! is read ([`quantity`]), so an error always knows its line. Lengths are metres, radiances W·sr⁻¹·m⁻², angles in
//! files degrees; y is up and the world is right-handed.

mod bodies;
mod camera;
mod check;
mod clip;
mod color_map;
mod grids;
mod light;
mod medium;
mod phase;
pub mod quantity;
mod surface;
mod transfer;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use bodies::{BodyFile, Emitter, Head};
pub use camera::{Camera, Film};
pub use clip::{Bounds, Clip, Cut, Plane};
pub use color_map::ColorMap;
pub use grids::{ColorGrids, TemperatureGrid};
pub use light::Light;
pub use medium::{Coefficients, Density, Medium, Optics, Raw, Transform};
pub use phase::{Angle, Mie, Phase, Relative};
pub use surface::{Corner, Edge, Material, Shape, Surface};
pub use transfer::{GradientStop, Isosurface, Shading, Stop, Transfer, Window};

use crate::parameter::Value;

/// A scene: everything a picture depends on, as a file states it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Where the picture is taken from. Without one it is the first camera of the surfaces' files, or one that sees all there
    /// is.
    #[serde(default = "Camera::none", skip_serializing_if = "Camera::is_none")]
    pub camera: Camera,
    /// The picture's size and exposure.
    #[serde(default)]
    pub film: Film,
    /// Light sources by name.
    #[serde(default)]
    pub lights: BTreeMap<String, Light>,
    /// Participating media by name; where several overlap, their coefficients add.
    #[serde(default)]
    pub media: BTreeMap<String, Medium>,
    /// What surfaces do to light, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, Material>,
    /// Surfaces by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub surfaces: BTreeMap<String, Surface>,
    /// Settings of rendering techniques, by technique and parameter name; what is absent keeps its default.
    #[serde(default)]
    pub techniques: BTreeMap<String, BTreeMap<String, Value>>,
}

impl Scene {
    /// The JSON Schema of scene files.
    pub fn schema() -> schemars::Schema {
        schemars::schema_for!(Scene)
    }
}
