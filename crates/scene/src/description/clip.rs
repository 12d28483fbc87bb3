use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::{empty_box, invalid};
use super::quantity::{Direction, Vector};
use crate::FieldError;

/// What is cut away of a medium, in world coordinates: what any of the planes cuts away, and what is outside the box.
/// A box counts as six planes, of which there may be eight in all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Clip {
    /// Cutting planes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub planes: Vec<Cut>,
    /// The box that is kept.
    #[serde(rename = "box", default, skip_serializing_if = "Option::is_none")]
    pub kept: Option<Bounds>,
}

/// A plane that cuts away the side its normal points to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cut {
    /// A point of the plane [m].
    #[serde(with = "Vector")]
    pub point: Vec3,
    /// Points into the half-space that is cut away.
    #[serde(with = "Direction")]
    pub normal: Vec3,
}

/// A box along the axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// The lowest corner [m].
    #[serde(with = "Vector")]
    pub min: Vec3,
    /// The highest corner [m].
    #[serde(with = "Vector")]
    pub max: Vec3,
}

/// A plane that keeps the half-space of the points x with normal·x ≤ distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Of length 1; points away from what is kept.
    pub normal: Vec3,
    /// The plane's distance from the origin, along the normal [m].
    pub distance: f32,
}

impl Plane {
    /// Whether the plane keeps a point [m].
    pub fn keeps(&self, point: Vec3) -> bool {
        self.normal.dot(point) <= self.distance
    }
}

impl Clip {
    /// The most planes, those of the box included.
    pub const MAX_PLANES: usize = 8;

    /// All planes, those of the box among them; what every one of them keeps is kept.
    pub fn planes(&self) -> Vec<Plane> {
        let cut = |cut: &Cut| {
            let normal = cut.normal.as_dvec3().normalize();
            let distance = normal.dot(cut.point.as_dvec3());
            // A distance that 32 bits do not hold is beyond everything either way.
            let distance = distance.clamp(f32::MIN.into(), f32::MAX.into()) as f32;
            Plane { normal: normal.as_vec3(), distance }
        };
        let mut planes: Vec<_> = self.planes.iter().map(cut).collect();
        if let Some(Bounds { min, max }) = self.kept {
            for (axis, normal) in Vec3::AXES.into_iter().enumerate() {
                planes.push(Plane { normal: -normal, distance: -min[axis] });
                planes.push(Plane { normal, distance: max[axis] });
            }
        }
        planes
    }

    pub(super) fn check(&self, path: &str) -> Result<(), FieldError> {
        if let Some(Bounds { min, max }) = self.kept
            && min.cmpge(max).any()
        {
            return empty_box(&format!("{path}.box.max"), min, max);
        }
        let allowed = Self::MAX_PLANES - if self.kept.is_some() { 6 } else { 0 };
        if self.planes.len() > allowed {
            let accepted = match self.kept {
                Some(_) => format!("at most {allowed} planes beside a box"),
                None => format!("at most {allowed} planes"),
            };
            return invalid(&format!("{path}.planes"), format!("{} planes", self.planes.len()), &accepted);
        }
        Ok(())
    }
}
