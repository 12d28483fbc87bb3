use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Finite, Positive};

/// Makes a medium glow as a black body does: its emission gains σ_a·B(T), with B the radiance of a black body
/// (Kirchhoff's law) and T from a grid, in kelvin: the grid's value times `kelvin`, plus `offset`. Outside the grid its value
/// counts as 0. Below 0 K there is no light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TemperatureGrid {
    /// Path relative to the scene file, as of a density's grid.
    pub file: String,
    /// Which grid of a `.vdb` file; may be left out where there is only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Temperature of a unit of the grid [K].
    #[serde(with = "Positive", default = "one")]
    pub kelvin: f32,
    /// Temperature where the grid is 0 [K].
    #[serde(with = "Finite", default)]
    pub offset: f32,
    /// Factor on the radiance; 1 is physical.
    #[serde(with = "Positive", default = "one")]
    pub radiance_scale: f32,
}

/// The colour of what a medium scatters, from three grids: where it is c, c of the light that σ_s would scatter is scattered
/// and 1 − c is absorbed, so that the extinction stays as it is. Values count from 0 to 1; outside a grid it is 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColorGrids {
    /// Path of a `.vdb` or `.nvdb` file relative to the scene file.
    pub file: String,
    /// The file's grids of red, green and blue, linear Rec. 709. Of a grid of vectors: `["Cd.x", "Cd.y", "Cd.z"]`, with its name.
    pub names: [String; 3],
}

fn one() -> f32 {
    1.0
}
