//! Named colour maps.

use std::sync::LazyLock;

use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::image::tonemap::srgb_decode;

/// A colour map, linear between 256 colours. They are those of the crate `colorous` (as in d3-scale-chromatic, `cividis`
/// and `turbo` as polynomials), decoded from sRGB to linear Rec. 709.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ColorMap {
    /// Black to white, in equal steps of sRGB.
    Grey,
    /// Violet over green to yellow; perceptually uniform.
    Viridis,
    /// Black over magenta to pale yellow; perceptually uniform.
    Magma,
    /// Black over red to pale yellow; perceptually uniform.
    Inferno,
    /// Blue over magenta to yellow; perceptually uniform.
    Plasma,
    /// Blue over grey to yellow, the same to eyes that do not tell red from green; perceptually uniform.
    Cividis,
    /// A rainbow without false edges, for detail rather than order.
    Turbo,
    /// Blue over white to red (ColorBrewer's RdBu from its end), for values on both sides of a middle.
    BlueRed,
}

/// Colours in a map.
const COLORS: usize = 256;

impl ColorMap {
    /// Every map.
    pub const ALL: [ColorMap; 8] = [
        ColorMap::Grey,
        ColorMap::Viridis,
        ColorMap::Magma,
        ColorMap::Inferno,
        ColorMap::Plasma,
        ColorMap::Cividis,
        ColorMap::Turbo,
        ColorMap::BlueRed,
    ];

    /// The colour at `t`, linear Rec. 709; beyond 0 and 1 the map's ends.
    pub fn color(self, t: f32) -> Vec3 {
        static COLORS_OF: LazyLock<[[Vec3; COLORS]; ColorMap::ALL.len()]> =
            LazyLock::new(|| ColorMap::ALL.map(|map| std::array::from_fn(|i| map.sample(i))));
        let colors = &COLORS_OF[self as usize];
        let position = t.clamp(0.0, 1.0) * (COLORS - 1) as f32;
        let below = (position as usize).min(COLORS - 2);
        colors[below].lerp(colors[below + 1], position - below as f32)
    }

    /// Colour `i` of [`COLORS`].
    fn sample(self, i: usize) -> Vec3 {
        let gradient = match self {
            ColorMap::Grey => return Vec3::splat(srgb_decode(i as f32 / (COLORS - 1) as f32)),
            ColorMap::Viridis => colorous::VIRIDIS,
            ColorMap::Magma => colorous::MAGMA,
            ColorMap::Inferno => colorous::INFERNO,
            ColorMap::Plasma => colorous::PLASMA,
            ColorMap::Cividis => colorous::CIVIDIS,
            ColorMap::Turbo => colorous::TURBO,
            ColorMap::BlueRed => return decode(colorous::RED_BLUE.eval_rational(COLORS - 1 - i, COLORS)),
        };
        decode(gradient.eval_rational(i, COLORS))
    }
}

/// 8-bit sRGB as linear Rec. 709.
fn decode(color: colorous::Color) -> Vec3 {
    Vec3::from([color.r, color.g, color.b].map(|byte| srgb_decode(f32::from(byte) / 255.0)))
}
