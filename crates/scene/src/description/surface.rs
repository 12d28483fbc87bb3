use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Transform;
use super::quantity::{Fraction, Positive, Rgb, Vector};

/// A surface: a shape of a material, which may glow. Light does not pass through it but where its material says so.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// Its shape.
    pub shape: Shape,
    /// One of the scene's materials; a file's own where it has some, else grey Lambert of reflectance 0.5.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Emitted radiance of its front side, on top of what the material emits [W·sr⁻¹·m⁻²]: an area light.
    #[serde(with = "Rgb", default)]
    pub radiance: Vec3,
    /// Moves the shape into the world.
    #[serde(default)]
    pub transform: Transform,
}

/// Where a surface is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A parallelogram; its front is the side from which `edges` turn counter-clockwise (their cross product points there).
    Quad {
        /// A corner [m].
        #[serde(with = "Vector")]
        corner: Vec3,
        /// From the corner to its two neighbours [m].
        edges: [Edge; 2],
    },
    /// A box, its front outside.
    Box {
        /// The lowest corner [m].
        #[serde(with = "Vector")]
        min: Vec3,
        /// The highest corner [m].
        #[serde(with = "Vector")]
        max: Vec3,
    },
    /// A sphere, its front outside.
    Sphere {
        /// The centre [m].
        #[serde(with = "Vector")]
        center: Vec3,
        /// The radius [m].
        #[serde(with = "Positive")]
        radius: f32,
    },
    /// A disc.
    Disc {
        /// The centre [m].
        #[serde(with = "Vector")]
        center: Vec3,
        /// Where its front faces.
        #[serde(with = "super::quantity::Direction")]
        normal: Vec3,
        /// The radius [m].
        #[serde(with = "Positive")]
        radius: f32,
    },
}

/// A vector of a shape [m].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Edge(#[serde(with = "Vector")] pub Vec3);

/// What a surface does to light. Both sides reflect alike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Material {
    /// Perfectly diffuse.
    Lambert {
        /// The share of light that is reflected.
        #[serde(with = "Rgb")]
        reflectance: Vec3,
    },
    /// A microfacet model of metals and rough dielectrics over a diffuse base, as in glTF 2.0, appendix B.
    MetallicRoughness {
        /// The reflectance of the diffuse base, or of a metal at normal incidence.
        #[serde(with = "Rgb", default = "ones")]
        base_color: Vec3,
        /// From dielectric, 0, to metal, 1.
        #[serde(with = "Fraction", default = "one")]
        metallic: f32,
        /// The square root of the width α of the facets' distribution (GGX).
        #[serde(with = "Fraction", default = "one")]
        roughness: f32,
    },
    /// A perfect mirror.
    Mirror {
        /// The share of light that is reflected.
        #[serde(with = "Rgb", default = "ones")]
        reflectance: Vec3,
    },
    /// A smooth dielectric such as glass, which reflects and refracts by Fresnel's equations.
    Dielectric {
        /// The refractive index of what is behind the front side, relative to what is before it.
        #[serde(with = "Positive", default = "glass")]
        ior: f32,
    },
}

fn ones() -> Vec3 {
    Vec3::ONE
}

fn one() -> f32 {
    1.0
}

fn glass() -> f32 {
    1.5
}
