//! Numbers as scene files accept them: each kind is a serde adapter (`#[serde(with = "Positive")]`) that refuses what
//! is out of range with a message stating what is accepted, and gives the JSON Schema the same bounds.

mod counts;

use std::borrow::Cow;

use glam::Vec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserializer, Visitor};
use serde::{Deserialize, Serialize, Serializer};

use crate::field::MAX_OCTAVES;
use crate::particles::RADII;
pub use counts::{ByteCount, FilmSize, MAX_FILM_SIDE, VoxelCounts};

/// Declares a scalar kind: its name, what is accepted in words, the test, and the schema's bounds.
macro_rules! scalar {
    ($(#[$doc:meta])* $name:ident, $accepted:literal, $test:expr, { $($bound:tt)* }) => {
        $(#[$doc])*
        pub struct $name;

        impl $name {
            /// Reads the number, or says what was found and what is accepted.
            pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
                let value = deserializer.deserialize_any(Number($accepted))? as f32;
                let test: fn(f32) -> bool = $test;
                if value.is_finite() && test(value) {
                    return Ok(value);
                }
                Err(de::Error::invalid_value(de::Unexpected::Float(value as f64), &$accepted))
            }

            /// Writes the number.
            pub fn serialize<S: Serializer>(value: &f32, serializer: S) -> Result<S::Ok, S::Error> {
                value.serialize(serializer)
            }
        }

        impl JsonSchema for $name {
            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }
            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!({ "type": "number", "description": $accepted, $($bound)* })
            }
        }
    };
}

scalar!(
    /// Any finite number.
    Finite, "a finite number", |_| true, {}
);
scalar!(
    /// Zero or more.
    NonNegative, "a finite number >= 0", |x| x >= 0.0, { "minimum": 0 }
);
scalar!(
    /// More than zero.
    Positive, "a finite number > 0", |x| x > 0.0, { "exclusiveMinimum": 0 }
);
scalar!(
    /// From zero to one.
    Fraction, "a number from 0 to 1", |x| (0.0..=1.0).contains(&x), { "minimum": 0, "maximum": 1 }
);
scalar!(
    /// The mean cosine of a phase function: strictly between -1 and 1.
    MeanCosine, "a number between -0.999 and 0.999", |x| x.abs() <= 0.999, { "minimum": -0.999, "maximum": 0.999 }
);
scalar!(
    /// The weight of cos²θ in Draine's phase function.
    DraineAlpha, "a number from 0 to 1000", |x| (0.0..=1000.0).contains(&x), { "minimum": 0, "maximum": 1000 }
);
scalar!(
    /// The diameter of water droplets [µm], as far as their phase function is fitted.
    Diameter, "a diameter in micrometres > 0 and at most 50", |x| x > 0.0 && x <= 50.0,
    { "exclusiveMinimum": 0, "maximum": 50 }
);
scalar!(
    /// The radius of particles [µm].
    Radius, "a radius from 0.001 to 1000 micrometres", |x| (0.001..=1000.0).contains(&x),
    { "minimum": 0.001, "maximum": 1000 }
);
scalar!(
    /// The geometric standard deviation of a log-normal distribution.
    GeometricDeviation, "a number from 1 to 4", |x| (1.0..=4.0).contains(&x), { "minimum": 1, "maximum": 4 }
);
scalar!(
    /// An angle from straight on to straight back.
    PolarAngle, "an angle from 0 to 180 degrees", |x| (0.0..=180.0).contains(&x), { "minimum": 0, "maximum": 180 }
);
scalar!(
    /// A field of view or a cone's half-angle in degrees, strictly between 0 and 180.
    Degrees, "an angle in degrees between 0 and 180 (exclusive)", |x| x > 0.0 && x < 180.0,
    { "exclusiveMinimum": 0, "exclusiveMaximum": 180 }
);

scalar!(
    /// How many times finer an octave of noise is than the one before.
    Lacunarity, "a number from 1 to 8", |x| (1.0..=8.0).contains(&x), { "minimum": 1, "maximum": 8 }
);

scalar!(
    /// The radius of a particle or fibre [m].
    BodyRadius, "a radius from 1e-7 to 1e6 metres", |x| (RADII[0]..=RADII[1]).contains(&x),
    { "minimum": 1e-7, "maximum": 1e6 }
);

/// Declares a kind of whole numbers: its name, what is accepted in words, and its bounds.
macro_rules! whole {
    ($(#[$doc:meta])* $name:ident, $accepted:literal, $min:expr, $max:expr) => {
        $(#[$doc])*
        pub struct $name;

        impl $name {
            /// Reads the number, or says what was found and what is accepted.
            pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
                let value = deserializer.deserialize_any(Number($accepted))?;
                if value.fract() == 0.0 && (f64::from($min)..=f64::from($max)).contains(&value) {
                    return Ok(value as u32);
                }
                Err(de::Error::invalid_value(de::Unexpected::Float(value), &$accepted))
            }

            /// Writes the number.
            pub fn serialize<S: Serializer>(value: &u32, serializer: S) -> Result<S::Ok, S::Error> {
                value.serialize(serializer)
            }
        }

        impl JsonSchema for $name {
            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }
            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!({ "type": "integer", "description": $accepted, "minimum": $min, "maximum": $max })
            }
        }
    };
}

whole!(
    /// Octaves of a fractal.
    Octaves, "a whole number from 1 to 12", 1u32, MAX_OCTAVES
);
whole!(
    /// What starts random numbers.
    Seed, "a whole number from 0 to 4294967295", 0u32, u32::MAX
);

whole!(
    /// How many particles or strands.
    BodyCount, "a whole number from 1 to 16777216", 1u32, 1u32 << 24
);
whole!(
    /// How many parts a strand has.
    Steps, "a whole number from 1 to 1000", 1u32, 1000u32
);
whole!(
    /// How many clumps hair has.
    Clumps, "a whole number from 1 to 4096", 1u32, 4096u32
);
whole!(
    /// The place of a vertex in a list.
    VertexIndex, "a whole number from 0 to 4294967295", 0u32, u32::MAX
);

/// A number written as integer or float.
struct Number(&'static str);

impl Visitor<'_> for Number {
    type Value = f64;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(self.0)
    }
    fn visit_f64<E>(self, value: f64) -> Result<f64, E> {
        Ok(value)
    }
    fn visit_i64<E>(self, value: i64) -> Result<f64, E> {
        Ok(value as f64)
    }
    fn visit_u64<E>(self, value: u64) -> Result<f64, E> {
        Ok(value as f64)
    }
}

/// Declares a three-component kind over [`Triple`]: its name, what is accepted, whether a single number stands for three
/// equal ones, the test, and the schema's bounds of each component.
macro_rules! triple {
    ($(#[$doc:meta])* $name:ident, $accepted:literal, splat: $splat:literal, $test:expr, { $($bound:tt)* }) => {
        $(#[$doc])*
        pub struct $name;

        impl $name {
            /// Reads the vector, or says what was found and what is accepted.
            pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec3, D::Error> {
                let value = deserializer.deserialize_any(Triple { accepted: $accepted, splat: $splat })?;
                let test: fn(Vec3) -> bool = $test;
                if value.is_finite() && test(value) {
                    return Ok(value);
                }
                let found = format!("{:?}", value.to_array());
                Err(de::Error::invalid_value(de::Unexpected::Other(&found), &$accepted))
            }

            /// Writes the vector as `[x, y, z]`.
            pub fn serialize<S: Serializer>(value: &Vec3, serializer: S) -> Result<S::Ok, S::Error> {
                value.serialize(serializer)
            }
        }

        impl JsonSchema for $name {
            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }
            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                let array = json_schema!({
                    "type": "array", "items": { "type": "number", $($bound)* }, "minItems": 3, "maxItems": 3,
                    "description": $accepted
                });
                if !$splat {
                    return array;
                }
                json_schema!({ "anyOf": [{ "type": "number", $($bound)* }, array], "description": $accepted })
            }
        }
    };
}

triple!(
    /// A position or displacement.
    Vector, "three finite numbers [x, y, z]", splat: false, |_| true, {}
);
triple!(
    /// A direction: of any length whose square a number holds.
    Direction, "three finite numbers [x, y, z], not all 0", splat: false, |v| v.length_squared().is_normal(),
    {}
);
triple!(
    /// A spectrum as linear Rec. 709 RGB; one number is grey.
    Rgb, "a number >= 0, or three of them [r, g, b]", splat: true, |v| v.min_element() >= 0.0, { "minimum": 0 }
);
triple!(
    /// Wavelengths that stand for red, green and blue [nm].
    Wavelengths, "three wavelengths [r, g, b] from 100 to 20000 nanometres", splat: false,
    |v| v.min_element() >= 100.0 && v.max_element() <= 20000.0, { "minimum": 100, "maximum": 20000 }
);
triple!(
    /// Scale factors along x, y, z; one number scales all three.
    Scale, "a number > 0, or three of them [x, y, z]", splat: true, |v| v.min_element() > 0.0,
    { "exclusiveMinimum": 0 }
);

triple!(
    /// A share of light as linear Rec. 709 RGB; one number is grey.
    Tint, "a number from 0 to 1, or three of them [r, g, b]", splat: true,
    |v| v.min_element() >= 0.0 && v.max_element() <= 1.0, { "minimum": 0, "maximum": 1 }
);

/// Declares a kind that may be left out (`default`, `skip_serializing_if = "Option::is_none"`).
macro_rules! optional {
    ($(#[$doc:meta])* $name:ident, $kind:ident, $type:ty) => {
        $(#[$doc])*
        pub struct $name;

        impl $name {
            /// Reads the value, or says what is accepted.
            pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<$type>, D::Error> {
                $kind::deserialize(deserializer).map(Some)
            }

            /// Writes the value.
            pub fn serialize<S: Serializer>(value: &Option<$type>, serializer: S) -> Result<S::Ok, S::Error> {
                value.serialize(serializer)
            }
        }

        impl JsonSchema for $name {
            fn schema_name() -> Cow<'static, str> {
                $kind::schema_name()
            }
            fn json_schema(generator: &mut SchemaGenerator) -> Schema {
                $kind::json_schema(generator)
            }
        }
    };
}

optional!(
    /// [`Rgb`] that may be left out.
    OptionalRgb, Rgb, Vec3
);
optional!(
    /// [`Tint`] that may be left out.
    OptionalTint, Tint, Vec3
);
optional!(
    /// [`Fraction`] that may be left out.
    OptionalFraction, Fraction, f32
);
optional!(
    /// [`BodyRadius`] that may be left out.
    OptionalRadius, BodyRadius, f32
);

/// A component of a vector.
#[derive(Clone, Copy)]
struct Component(f32);

impl<'de> Deserialize<'de> for Component {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self(deserializer.deserialize_any(Number("a finite number"))? as f32))
    }
}

struct Triple {
    accepted: &'static str,
    splat: bool,
}

impl Triple {
    fn splat<E: de::Error>(&self, value: f64) -> Result<Vec3, E> {
        if self.splat {
            return Ok(Vec3::splat(value as f32));
        }
        Err(E::invalid_type(de::Unexpected::Float(value), &self.accepted))
    }
}

impl<'de> Visitor<'de> for Triple {
    type Value = Vec3;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(self.accepted)
    }
    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Vec3, E> {
        self.splat(value)
    }
    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Vec3, E> {
        self.splat(value as f64)
    }
    fn visit_u64<E: de::Error>(self, value: u64) -> Result<Vec3, E> {
        self.splat(value as f64)
    }
    fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<Vec3, A::Error> {
        let mut value = [0.0f32; 3];
        for (i, slot) in value.iter_mut().enumerate() {
            let component = seq.next_element::<Component>()?;
            *slot = component.ok_or_else(|| de::Error::invalid_length(i, &self.accepted))?.0;
        }
        if seq.next_element::<de::IgnoredAny>()?.is_some() {
            return Err(de::Error::invalid_length(4, &self.accepted));
        }
        Ok(Vec3::from(value))
    }
}

/// A refractive index n + ik as `[n, k]`.
pub struct RefractiveIndex;

impl RefractiveIndex {
    const MAX: f32 = 20.0;

    /// Reads the index, or says what is accepted.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f32; 2], D::Error> {
        deserializer.deserialize_any(RefractiveIndex)
    }

    /// Writes the index.
    pub fn serialize<S: Serializer>(value: &[f32; 2], serializer: S) -> Result<S::Ok, S::Error> {
        value.serialize(serializer)
    }
}

impl<'de> Visitor<'de> for RefractiveIndex {
    type Value = [f32; 2];

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "[n, k] with 0 < n <= {0} and 0 <= k <= {0}", Self::MAX)
    }
    fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<[f32; 2], A::Error> {
        let mut part = |i| seq.next_element::<Component>()?.ok_or_else(|| de::Error::invalid_length(i, &self));
        let [n, k] = [part(0)?.0, part(1)?.0];
        if seq.next_element::<de::IgnoredAny>()?.is_some() {
            return Err(de::Error::invalid_length(3, &self));
        }
        if n > 0.0 && n <= Self::MAX && (0.0..=Self::MAX).contains(&k) {
            return Ok([n, k]);
        }
        Err(de::Error::invalid_value(de::Unexpected::Seq, &self))
    }
}

impl JsonSchema for RefractiveIndex {
    fn schema_name() -> Cow<'static, str> {
        "RefractiveIndex".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "array", "minItems": 2, "maxItems": 2,
            "prefixItems": [
                { "type": "number", "exclusiveMinimum": 0, "maximum": Self::MAX },
                { "type": "number", "minimum": 0, "maximum": Self::MAX }
            ],
            "description": "[n, k]"
        })
    }
}
