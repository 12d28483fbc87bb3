use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ColorMap;
use super::check::invalid;
use super::quantity::{Finite, Fraction, NonNegative, OptionalRgb, Positive, Rgb};
use crate::FieldError;

/// Colour and opacity over the data's value, as in the emission–absorption model of scientific visualisation:
/// σ_a(v) = −ln(1 − opacity(v))/unit_length, emission = color(v)·radiance·σ_a, no scattering.
///
/// The function is given by `stops` or by a `window`, or it is 0 and there are only `isosurfaces`. `shading`,
/// `gradient_opacity` and `isosurfaces` help to see shapes in data; they are no physics, and the reference refuses them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Transfer {
    /// The length over which `opacity` is what the function says [m].
    #[serde(with = "Positive")]
    pub unit_length: f32,
    /// Radiance of an opaque body of colour 1 [W·sr⁻¹·m⁻²].
    #[serde(with = "Positive", default = "one")]
    pub radiance: f32,
    /// Opacity of the whole, 0 to 1: that at the window's upper end, and a factor on those of stops.
    #[serde(with = "Fraction", default = "one")]
    pub opacity: f32,
    /// Stops in order of value, piecewise linear between them; beyond the first and last, theirs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(min = 1))]
    pub stops: Vec<Stop>,
    /// In place of stops: opacity rises from 0 to `opacity` over a range of values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<Window>,
    /// The colours from the first to the last stop, in place of theirs, or over the window (there `grey` where it is left
    /// out).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<ColorMap>,
    /// Shades the colour by the gradient of the data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shading: Option<Shading>,
    /// A factor on the extinction, piecewise linear over the magnitude of the data's gradient, in its order; beyond the
    /// first and last, theirs. Shows boundaries and hides what is alike.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gradient_opacity: Vec<GradientStop>,
    /// Surfaces where the data has a value, in the order of their values, eight at most.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 8))]
    pub isosurfaces: Vec<Isosurface>,
}

/// One stop of a transfer function.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    /// The data's value.
    #[serde(with = "Finite")]
    pub value: f32,
    /// Opacity over `unit_length`, 0 to 1; 1 would be an infinite extinction and counts as 0.9999.
    #[serde(with = "Fraction")]
    pub opacity: f32,
    /// Colour, linear Rec. 709; left out where a `map` gives it.
    #[serde(with = "OptionalRgb", default, skip_serializing_if = "Option::is_none")]
    pub color: Option<Vec3>,
}

/// A range of values, as radiology states it: from level − width/2 to level + width/2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Window {
    /// The middle value.
    #[serde(with = "Finite")]
    pub level: f32,
    /// The range's width, in the data's unit.
    #[serde(with = "Positive")]
    pub width: f32,
}

/// How the gradient of the data shades its colour \[Blinn77\]: c·(ambient + Σ diffuse·E·|n·l|) + Σ specular·E·|n·h|^shininess,
/// with n the direction of the gradient (both of its sides are lit), l that to the light and h halfway between l and the
/// eye. The light is a headlight at the eye with E = 1; where the scene has directional lights, it is those instead, with
/// E = irradiance/π, unshadowed. Without a gradient, c is as it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Shading {
    /// Share of the colour that needs no light.
    #[serde(with = "NonNegative", default = "Shading::ambient")]
    pub ambient: f32,
    /// Share of the colour that light falling along the gradient shows.
    #[serde(with = "NonNegative", default = "Shading::diffuse")]
    pub diffuse: f32,
    /// Strength of highlights; they have the light's colour.
    #[serde(with = "NonNegative", default = "Shading::specular")]
    pub specular: f32,
    /// Exponent of highlights: the higher, the smaller they are.
    #[serde(with = "Positive", default = "Shading::shininess")]
    pub shininess: f32,
}

/// One stop of a factor over the gradient's magnitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GradientStop {
    /// Magnitude of the gradient [the data's unit per m].
    #[serde(with = "NonNegative")]
    pub gradient: f32,
    /// Factor on the extinction, 0 to 1.
    #[serde(with = "Fraction")]
    pub factor: f32,
}

/// A surface where the data has a value. It adds color·radiance·opacity, shaded where there is `shading`, and lets
/// 1 − opacity of what is behind it pass, at whatever angle it is seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Isosurface {
    /// The data's value on the surface.
    #[serde(with = "Finite")]
    pub value: f32,
    /// Colour, linear Rec. 709.
    #[serde(with = "Rgb")]
    pub color: Vec3,
    /// Opacity of the surface itself, 0 to 1.
    #[serde(with = "Fraction", default = "one")]
    pub opacity: f32,
}

fn one() -> f32 {
    1.0
}

impl Default for Transfer {
    /// Nothing to be seen, over a unit length of a metre.
    fn default() -> Self {
        Self {
            unit_length: 1.0,
            radiance: 1.0,
            opacity: 1.0,
            stops: Vec::new(),
            window: None,
            map: None,
            shading: None,
            gradient_opacity: Vec::new(),
            isosurfaces: Vec::new(),
        }
    }
}

impl Shading {
    fn ambient() -> f32 {
        0.3
    }
    fn diffuse() -> f32 {
        0.7
    }
    fn specular() -> f32 {
        0.2
    }
    fn shininess() -> f32 {
        20.0
    }
}

impl Transfer {
    /// The highest opacity that still has a finite extinction.
    pub const MAX_OPACITY: f32 = 0.9999;
    /// The most isosurfaces.
    pub const MAX_ISOSURFACES: usize = 8;

    /// Colour where the data has a value, linear Rec. 709.
    pub fn color(&self, value: f32) -> Vec3 {
        if let Some(window) = self.window {
            return self.map.unwrap_or(ColorMap::Grey).color(window.position(value));
        }
        if let (Some(map), [first, .., last]) = (self.map, self.stops.as_slice()) {
            return map.color(share(first.value.into(), last.value.into(), value));
        }
        between(&self.stops, |stop| stop.value, value)
            .map_or(Vec3::ZERO, |(a, b, t)| a.color.unwrap_or_default().lerp(b.color.unwrap_or_default(), t))
    }

    /// Opacity over the unit length where the data has a value, from 0 to [`Transfer::MAX_OPACITY`].
    pub fn opacity_at(&self, value: f32) -> f32 {
        let opacity = match self.window {
            Some(window) => window.position(value),
            None => between(&self.stops, |stop| stop.value, value)
                .map_or(0.0, |(a, b, t)| a.opacity + t * (b.opacity - a.opacity)),
        };
        (opacity * self.opacity).min(Self::MAX_OPACITY)
    }

    /// Extinction where the data has a value [m⁻¹]; monotonic between [`Transfer::knots`].
    pub fn sigma_a(&self, value: f32) -> f32 {
        -(-self.opacity_at(value)).ln_1p() / self.unit_length
    }

    /// The values at which the function bends, in ascending order; before the first and after the last it is constant.
    /// None where it is 0 everywhere.
    pub fn knots(&self) -> Vec<f32> {
        match self.window {
            Some(window) => window.knots().into(),
            None => self.stops.iter().map(|stop| stop.value).collect(),
        }
    }

    /// The factor on the extinction where the data's gradient has this magnitude [the data's unit per m].
    pub fn gradient_factor(&self, gradient: f32) -> f32 {
        between(&self.gradient_opacity, |stop| stop.gradient, gradient)
            .map_or(1.0, |(a, b, t)| a.factor + t * (b.factor - a.factor))
    }

    /// The name of a field that is set and no physics, if there is one.
    pub fn unphysical(&self) -> Option<&'static str> {
        let fields = [
            ("shading", self.shading.is_some()),
            ("gradient_opacity", !self.gradient_opacity.is_empty()),
            ("isosurfaces", !self.isosurfaces.is_empty()),
        ];
        fields.into_iter().find_map(|(name, set)| set.then_some(name))
    }

    pub(super) fn check(&self, path: &str) -> Result<(), FieldError> {
        if self.stops.is_empty() && self.window.is_none() && self.isosurfaces.is_empty() {
            return invalid(&format!("{path}.stops"), "none".into(), "at least one stop, a `window`, or `isosurfaces`");
        }
        if !self.stops.is_empty() && self.window.is_some() {
            return invalid(&format!("{path}.window"), "both `stops` and `window`".into(), "one of them");
        }
        ascending(&format!("{path}.stops"), "value", self.stops.iter().map(|stop| stop.value))?;
        for (i, stop) in self.stops.iter().enumerate() {
            let path = format!("{path}.stops.{i}");
            match (stop.color, self.map) {
                (None, None) => {
                    return invalid(&path, "no `color`".into(), "a table with `color`, or a `map` for all stops");
                }
                (Some(_), Some(_)) => {
                    return invalid(&format!("{path}.color"), "a color beside `map`".into(), "one of them");
                }
                _ => {}
            }
        }
        if self.map.is_some() && self.window.is_none() && self.stops.len() < 2 {
            let accepted = "at least two stops to spread it over, or a `window`";
            return invalid(&format!("{path}.map"), format!("a map for {} stops", self.stops.len()), accepted);
        }
        let gradients = self.gradient_opacity.iter().map(|stop| stop.gradient);
        ascending(&format!("{path}.gradient_opacity"), "gradient", gradients)?;
        if self.isosurfaces.len() > Self::MAX_ISOSURFACES {
            let accepted = format!("at most {}", Self::MAX_ISOSURFACES);
            return invalid(
                &format!("{path}.isosurfaces"),
                format!("{} isosurfaces", self.isosurfaces.len()),
                &accepted,
            );
        }
        ascending(&format!("{path}.isosurfaces"), "value", self.isosurfaces.iter().map(|surface| surface.value))
    }
}

impl Window {
    /// The values between which it lies.
    fn ends(self) -> [f64; 2] {
        let (level, half) = (f64::from(self.level), 0.5 * f64::from(self.width));
        [level - half, level + half]
    }

    /// The ends in single precision, rounded outwards; apart even where 32 bits do not tell them apart.
    fn knots(self) -> [f32; 2] {
        let [low, high] = self.ends();
        let [below, above] = [low as f32, high as f32];
        let rises = f64::from(above) < high || above == below;
        let below = if f64::from(below) > low { below.next_down() } else { below };
        let above = if rises { above.next_up() } else { above };
        [below.max(f32::MIN), above.min(f32::MAX)]
    }

    /// Where a value lies in the window, from 0 to 1.
    fn position(self, value: f32) -> f32 {
        let [low, high] = self.ends();
        share(low, high, value)
    }
}

/// Where a value lies between two, from 0 to 1. In double precision, where the distance of any two is finite.
fn share(low: f64, high: f64, value: f32) -> f32 {
    // A window may be narrower than its level has digits.
    let width = (high - low).max(f64::MIN_POSITIVE);
    ((f64::from(value) - low) / width).clamp(0.0, 1.0) as f32
}

/// The stops on both sides of a value and where it lies between them, from 0 to 1; `None` where there is no stop.
fn between<T>(stops: &[T], value_of: impl Fn(&T) -> f32, value: f32) -> Option<(&T, &T, f32)> {
    let after = stops.partition_point(|stop| value_of(stop) <= value);
    let (Some(a), Some(b)) = (stops.get(after.wrapping_sub(1)), stops.get(after)) else {
        let end = if after == 0 { stops.first() } else { stops.last() };
        return end.map(|end| (end, end, 0.0));
    };
    Some((a, b, share(value_of(a).into(), value_of(b).into(), value)))
}

fn ascending(path: &str, field: &str, values: impl Iterator<Item = f32>) -> Result<(), FieldError> {
    let mut previous = None;
    for (i, value) in values.enumerate() {
        if let Some(previous) = previous
            && previous >= value
        {
            let found = format!("{value} after {previous}");
            return invalid(&format!("{path}.{i}.{field}"), found, "values in ascending order");
        }
        previous = Some(value);
    }
    Ok(())
}
