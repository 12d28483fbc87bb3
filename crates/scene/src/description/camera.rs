use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Degrees, Direction, FilmSize, Finite, Vector};

/// A perspective camera without lens: it looks from `position` to `target`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// The eye [m].
    #[serde(with = "Vector")]
    pub position: Vec3,
    /// The point looked at, in the picture's centre [m].
    #[serde(with = "Vector")]
    pub target: Vec3,
    /// The direction that is up in the picture; need not be perpendicular to the view.
    #[serde(with = "Direction", default = "up")]
    pub up: Vec3,
    /// Vertical field of view [degrees].
    #[serde(with = "Degrees", default = "fov")]
    pub fov: f32,
}

fn up() -> Vec3 {
    Vec3::Y
}

fn fov() -> f32 {
    40.0
}

impl Default for Camera {
    fn default() -> Self {
        Self { position: Vec3::new(0.0, 0.0, 3.0), target: Vec3::ZERO, up: up(), fov: fov() }
    }
}

impl Camera {
    /// Right, up and backward axes (orthonormal, right-handed; the camera looks along −backward), or `None` where
    /// position and target coincide or the view runs along `up`.
    pub fn frame(&self) -> Option<[Vec3; 3]> {
        let backward = (self.position - self.target).try_normalize()?;
        let right = self.up.normalize().cross(backward);
        if right.length() < 1e-6 {
            return None;
        }
        let right = right.normalize();
        Some([right, backward.cross(right), backward])
    }
}

/// The picture's size and exposure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Film {
    /// `[width, height]` in pixels.
    #[serde(with = "FilmSize", default = "size")]
    pub size: [u32; 2],
    /// Exposure in stops (EV) where the picture is tone-mapped: radiance times 2^exposure.
    #[serde(with = "Finite", default)]
    pub exposure: f32,
}

fn size() -> [u32; 2] {
    [640, 480]
}

impl Default for Film {
    fn default() -> Self {
        Self { size: size(), exposure: 0.0 }
    }
}
