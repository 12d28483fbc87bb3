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
    /// The camera of a scene that has none: its field of view, 0, can stand in no file. [`crate::World::load`] puts another in
    /// its place: that of a file, or one that sees everything.
    pub(crate) fn none() -> Self {
        Self { fov: 0.0, ..Self::default() }
    }

    /// Whether the scene has no camera.
    pub fn is_none(&self) -> bool {
        self.fov == 0.0
    }

    /// A camera from the front and above that sees a whole box [m] on a film of this size; `None` where it cannot.
    pub(crate) fn framing([low, high]: [Vec3; 2], [width, height]: [u32; 2]) -> Option<Self> {
        let (target, radius) = ((low + high) / 2.0, (high - low).length() / 2.0);
        let half = (fov() / 2.0).to_radians();
        // The narrower of both directions counts.
        let half = half.min((half.tan() * width as f32 / height as f32).atan());
        let position = target + Vec3::new(0.5, 0.35, 1.0).normalize() * (radius / half.sin());
        let camera = Self { position, target, ..Self::default() };
        (position.is_finite() && radius > 0.0 && camera.frame().is_some()).then_some(camera)
    }

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
