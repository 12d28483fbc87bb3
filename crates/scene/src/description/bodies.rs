use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{
    BodyCount, BodyRadius, Clumps, Fraction, NonNegative, Octaves, OptionalFraction, OptionalRadius, OptionalTint,
    PolarAngle, Positive, Seed, Steps, Tint, Vector,
};

/// A file of particles or strands, and what stands for what the file says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyFile {
    /// Path relative to the scene file.
    pub file: String,
    /// Every radius, in place of those of the file [m].
    #[serde(with = "OptionalRadius", default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f32>,
    /// Every opacity, in place of those of the file.
    #[serde(with = "OptionalFraction", default, skip_serializing_if = "Option::is_none")]
    pub opacity: Option<f32>,
    /// Every colour, in place of those of the file.
    #[serde(with = "OptionalTint", default, skip_serializing_if = "Option::is_none")]
    pub color: Option<Vec3>,
}

/// A source of particles that rise, are stirred, grow and fade. The same numbers give the same particles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Emitter {
    /// Where particles are born: the centre of a ball [m].
    #[serde(with = "Vector", default)]
    pub position: Vec3,
    /// The radius of that ball [m].
    #[serde(with = "NonNegative", default = "tenth")]
    pub size: f32,
    /// How many particles there are at a time, once the first have died.
    #[serde(with = "BodyCount", default = "number")]
    pub number: u32,
    /// How long a particle lives [s].
    #[serde(with = "Positive", default = "four")]
    pub lifetime: f32,
    /// The mean velocity [m/s].
    #[serde(with = "Vector", default = "up")]
    pub velocity: Vec3,
    /// Root mean square of the velocity of turbulence, which is added [m/s].
    #[serde(with = "NonNegative", default = "half")]
    pub turbulence: f32,
    /// The size of the largest eddies [m].
    #[serde(with = "Positive", default = "half")]
    pub scale: f32,
    /// How many sizes of eddies there are.
    #[serde(with = "Octaves", default = "two")]
    pub octaves: u32,
    /// The radius at birth [m].
    #[serde(with = "BodyRadius", default = "twentieth")]
    pub radius: f32,
    /// The radius at death [m].
    #[serde(with = "BodyRadius", default = "quarter")]
    pub end_radius: f32,
    /// The opacity through the centre at birth, where it appears within a twentieth of its life.
    #[serde(with = "Fraction", default = "quarter")]
    pub opacity: f32,
    /// The opacity at death.
    #[serde(with = "Fraction", default)]
    pub end_opacity: f32,
    /// The colour of what it scatters at birth.
    #[serde(with = "Tint", default = "ones")]
    pub color: Vec3,
    /// The same at death.
    #[serde(with = "Tint", default = "ones")]
    pub end_color: Vec3,
    /// Which plume it is.
    #[serde(with = "Seed", default)]
    pub seed: u32,
    /// The time since the first particle was born [s].
    #[serde(with = "NonNegative", default = "four")]
    pub time: f32,
    /// Pictures a second: a particle moves in steps of that time [s⁻¹].
    #[serde(with = "Positive", default = "frame_rate")]
    pub frame_rate: f32,
}

/// A head of hair on a sphere, its parting at the top.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// The centre of the scalp [m].
    #[serde(with = "Vector", default)]
    pub center: Vec3,
    /// The radius of the scalp [m].
    #[serde(with = "BodyRadius", default = "tenth")]
    pub radius: f32,
    /// How far hair grows from the top [degrees].
    #[serde(with = "PolarAngle", default = "temples")]
    pub extent: f32,
    /// How many strands.
    #[serde(with = "BodyCount", default = "strands")]
    pub number: u32,
    /// Segments of a strand.
    #[serde(with = "Steps", default = "segments")]
    pub segments: u32,
    /// The mean length of a strand [m]; it varies by a fifth.
    #[serde(with = "Positive", default = "quarter")]
    pub length: f32,
    /// How soon strands bend down: the curvature of one that grows sideways [m⁻¹].
    #[serde(with = "NonNegative", default = "thirty")]
    pub gravity: f32,
    /// The radius of the curls at the tip [m]; they widen from the root on.
    #[serde(with = "NonNegative", default)]
    pub curl: f32,
    /// The length of a turn of a curl along the strand [m].
    #[serde(with = "Positive", default = "twentieth")]
    pub pitch: f32,
    /// How many clumps strands gather to.
    #[serde(with = "Clumps", default = "clumps")]
    pub clumps: u32,
    /// How much: at 1 all tips of a clump meet.
    #[serde(with = "Fraction", default)]
    pub clumping: f32,
    /// The radius of a fibre at its root [m].
    #[serde(with = "BodyRadius", default = "fibre")]
    pub thickness: f32,
    /// The radius at its tip [m].
    #[serde(with = "BodyRadius", default = "tip")]
    pub tip_thickness: f32,
    /// The opacity of a fibre that is crossed at right angles through its axis.
    #[serde(with = "Fraction", default = "half")]
    pub opacity: f32,
    /// The colour of what it scatters at the root.
    #[serde(with = "Tint", default = "ones")]
    pub color: Vec3,
    /// The same at the tip.
    #[serde(with = "Tint", default = "ones")]
    pub tip_color: Vec3,
    /// Which head it is.
    #[serde(with = "Seed", default)]
    pub seed: u32,
}

fn number() -> u32 {
    16384
}

fn strands() -> u32 {
    4000
}

fn segments() -> u32 {
    24
}

fn clumps() -> u32 {
    100
}

fn two() -> u32 {
    2
}

fn twentieth() -> f32 {
    0.05
}

fn tenth() -> f32 {
    0.1
}

fn quarter() -> f32 {
    0.25
}

fn half() -> f32 {
    0.5
}

fn four() -> f32 {
    4.0
}

fn thirty() -> f32 {
    30.0
}

fn temples() -> f32 {
    100.0
}

fn frame_rate() -> f32 {
    30.0
}

fn fibre() -> f32 {
    40e-6
}

fn tip() -> f32 {
    20e-6
}

fn up() -> Vec3 {
    Vec3::Y
}

fn ones() -> Vec3 {
    Vec3::ONE
}
