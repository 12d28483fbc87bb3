use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Transform;
use super::check::{empty_box, invalid};
use super::quantity::{Fraction, Positive, Rgb, Vector, VertexIndex};
use crate::FieldError;

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
    /// A picture that multiplies what is emitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radiance_map: Option<String>,
    /// Whether its back emits, too.
    #[serde(default)]
    pub double_sided: bool,
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
    /// Flat convex polygons; a front is the side from which the corners turn counter-clockwise. Texture coordinates are 0.
    Polygons {
        /// Corners [m].
        vertices: Vec<Edge>,
        /// Indices of the corners of each polygon, three or more.
        faces: Vec<Vec<Corner>>,
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

/// A vector or a point of a shape [m].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Edge(#[serde(with = "Vector")] pub Vec3);

/// A corner of a polygon, as an index of its vertices.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Corner(#[serde(with = "VertexIndex")] pub u32);

/// What a surface does to light. Both sides reflect alike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Material {
    /// Perfectly diffuse.
    Lambert {
        /// The share of light that is reflected.
        #[serde(with = "Rgb")]
        reflectance: Vec3,
        /// A picture (`.png` or `.jpg`, relative to the scene file) that multiplies it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        reflectance_map: Option<String>,
        /// A picture of normals in tangent space that bends those for shading.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        normal_map: Option<String>,
    },
    /// A microfacet model of metals and rough dielectrics over a diffuse base, as in glTF 2.0, appendix B.
    MetallicRoughness {
        /// The reflectance of the diffuse base, or of a metal at normal incidence.
        #[serde(with = "Rgb", default = "ones")]
        base_color: Vec3,
        /// A picture (`.png` or `.jpg`, relative to the scene file) that multiplies it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        base_color_map: Option<String>,
        /// From dielectric, 0, to metal, 1.
        #[serde(with = "Fraction", default = "one")]
        metallic: f32,
        /// The square root of the width α of the facets' distribution (GGX).
        #[serde(with = "Fraction", default = "one")]
        roughness: f32,
        /// A picture whose green multiplies `roughness`, its blue `metallic`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        metallic_roughness_map: Option<String>,
        /// A picture of normals in tangent space that bends those for shading.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        normal_map: Option<String>,
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

impl Surface {
    /// Checks what holds between the fields of the surface at `path`.
    pub(super) fn check(&self, path: &str) -> Result<(), FieldError> {
        let path = format!("{path}.shape");
        match &self.shape {
            Shape::Quad { edges: [Edge(u), Edge(v)], .. } if !has_area(*u, *v) => {
                let found = format!("{:?} and {:?}", u.to_array(), v.to_array());
                invalid(&format!("{path}.quad.edges"), found, "two edges that span an area")
            }
            Shape::Box { min, max } if min.cmpge(*max).any() => empty_box(&format!("{path}.box.max"), *min, *max),
            Shape::Polygons { vertices, faces } => check_polygons(&format!("{path}.polygons"), vertices, faces),
            _ => Ok(()),
        }
    }
}

/// Whether two edges span an area that 32-bit numbers hold.
fn has_area(u: Vec3, v: Vec3) -> bool {
    let normal = u.as_dvec3().cross(v.as_dvec3());
    normal.length_squared() > 1e-12 * u.as_dvec3().length_squared() * v.as_dvec3().length_squared()
        && (normal.length() as f32).is_normal()
}

fn check_polygons(path: &str, vertices: &[Edge], faces: &[Vec<Corner>]) -> Result<(), FieldError> {
    if faces.is_empty() {
        return invalid(&format!("{path}.faces"), "none".into(), "one face or more");
    }
    for (i, face) in faces.iter().enumerate() {
        let path = format!("{path}.faces.{i}");
        if face.len() < 3 {
            return invalid(&path, format!("{} corners", face.len()), "three or more");
        }
        if let Some(&Corner(index)) = face.iter().find(|&&Corner(index)| index as usize >= vertices.len()) {
            let found = format!("{index}, of {} vertices", vertices.len());
            return invalid(&path, found, "indices of vertices, from 0");
        }
        let corner = |k: usize| vertices[face[k].0 as usize].0;
        for k in 2..face.len() {
            if !has_area(corner(k - 1) - corner(0), corner(k) - corner(0)) {
                let found = format!("no area between the corners 0, {} and {k}", k - 1);
                return invalid(&path, found, "a convex polygon whose first corner is on no line through two others");
            }
        }
    }
    Ok(())
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
