use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Degrees, Direction, Finite, Rgb, Vector};

/// A light source. Only the environment, constant or a map, is seen directly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Light {
    /// Parallel light from infinitely far, such as the sun's.
    Directional {
        /// The direction the light travels in.
        #[serde(with = "Direction")]
        direction: Vec3,
        /// Irradiance on a plane perpendicular to the light [W·m⁻²].
        #[serde(with = "Rgb")]
        irradiance: Vec3,
    },
    /// Light from a point, the same in all directions.
    Point {
        /// Where it stands [m].
        #[serde(with = "Vector")]
        position: Vec3,
        /// Radiant intensity [W·sr⁻¹].
        #[serde(with = "Rgb")]
        intensity: Vec3,
    },
    /// Light from a point into a cone: full within `inner_angle`, none beyond `outer_angle`, between them falling as
    /// the square of the cosine's linear ramp (as in glTF's KHR_lights_punctual).
    Spot {
        /// Where it stands [m].
        #[serde(with = "Vector")]
        position: Vec3,
        /// The cone's axis, in the direction the light travels.
        #[serde(with = "Direction")]
        direction: Vec3,
        /// Radiant intensity on the axis [W·sr⁻¹].
        #[serde(with = "Rgb")]
        intensity: Vec3,
        /// Half-angle of the cone of full intensity [degrees], less than `outer_angle`.
        #[serde(with = "Degrees")]
        inner_angle: f32,
        /// Half-angle of the whole cone [degrees].
        #[serde(with = "Degrees")]
        outer_angle: f32,
    },
    /// The same radiance from every direction: a uniform sky all around, seen behind the media.
    Constant {
        /// Radiance [W·sr⁻¹·m⁻²].
        #[serde(with = "Rgb")]
        radiance: Vec3,
    },
    /// Radiance from every direction, from a latitude-longitude picture: a sky all around, seen behind the media. It
    /// adds to constant light; a scene has at most one. The upper edge is the zenith, +y; the middle column is where −z
    /// is, and columns to its right are to the right of who looks there.
    Environment {
        /// The picture, OpenEXR (`.exr`) or Radiance (`.hdr`): radiance [W·sr⁻¹·m⁻²]. Path relative to the scene file.
        file: String,
        /// Rotation about the y axis [degrees]; 90 turns what is at −z to −x.
        #[serde(with = "Finite", default)]
        rotate: f32,
        /// Factor of the picture's radiance.
        #[serde(with = "Rgb", default = "ones")]
        scale: Vec3,
    },
}

fn ones() -> Vec3 {
    Vec3::ONE
}
