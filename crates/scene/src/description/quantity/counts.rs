//! Numbers of pixels, voxels and bytes.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserializer, Visitor};
use serde::{Deserialize, Serialize, Serializer};

use super::Number;

/// The largest film side, and so the largest picture: a WebGPU texture at default limits.
pub const MAX_FILM_SIDE: u32 = 8192;

/// A film size `[width, height]` in pixels.
pub struct FilmSize;

impl FilmSize {
    /// Reads the size, or says what is accepted.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[u32; 2], D::Error> {
        deserializer.deserialize_any(FilmSize)
    }

    /// Writes the size.
    pub fn serialize<S: Serializer>(value: &[u32; 2], serializer: S) -> Result<S::Ok, S::Error> {
        value.serialize(serializer)
    }
}

impl<'de> Visitor<'de> for FilmSize {
    type Value = [u32; 2];

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "[width, height] in pixels, each a whole number from 1 to {MAX_FILM_SIDE}")
    }
    fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<[u32; 2], A::Error> {
        let mut sides = Vec::with_capacity(2);
        while let Some(side) = seq.next_element::<Side>()? {
            if sides.len() == 2 {
                return Err(de::Error::invalid_length(3, &self));
            }
            sides.push(side.0);
        }
        <[f64; 2]>::try_from(sides.as_slice())
            .ok()
            .filter(|sides| sides.iter().all(|s| s.fract() == 0.0 && (1.0..=f64::from(MAX_FILM_SIDE)).contains(s)))
            .map(|sides| sides.map(|side| side as u32))
            .ok_or_else(|| de::Error::invalid_value(de::Unexpected::Seq, &self))
    }
}

/// A side of a film, as yet unchecked.
struct Side(f64);

impl<'de> Deserialize<'de> for Side {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Number("a whole number of pixels")).map(Self)
    }
}

impl JsonSchema for FilmSize {
    fn schema_name() -> Cow<'static, str> {
        "FilmSize".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "array", "minItems": 2, "maxItems": 2,
            "items": { "type": "integer", "minimum": 1, "maximum": MAX_FILM_SIDE },
            "description": "[width, height] in pixels"
        })
    }
}

/// Numbers of voxels along x, y, z.
pub struct VoxelCounts;

impl VoxelCounts {
    /// Reads the counts, or says what is accepted.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[u32; 3], D::Error> {
        deserializer.deserialize_any(VoxelCounts)
    }

    /// Writes the counts.
    pub fn serialize<S: Serializer>(value: &[u32; 3], serializer: S) -> Result<S::Ok, S::Error> {
        value.serialize(serializer)
    }
}

impl<'de> Visitor<'de> for VoxelCounts {
    type Value = [u32; 3];

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "[x, y, z] in voxels, each a whole number from 1 to {}", u32::MAX)
    }
    fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<[u32; 3], A::Error> {
        let mut counts = [0; 3];
        for (i, count) in counts.iter_mut().enumerate() {
            let side = seq.next_element::<Side>()?.ok_or_else(|| de::Error::invalid_length(i, &self))?.0;
            if side.fract() != 0.0 || !(1.0..=f64::from(u32::MAX)).contains(&side) {
                return Err(de::Error::invalid_value(de::Unexpected::Seq, &self));
            }
            *count = side as u32;
        }
        if seq.next_element::<de::IgnoredAny>()?.is_some() {
            return Err(de::Error::invalid_length(4, &self));
        }
        Ok(counts)
    }
}

impl JsonSchema for VoxelCounts {
    fn schema_name() -> Cow<'static, str> {
        "VoxelCounts".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "array", "minItems": 3, "maxItems": 3,
            "items": { "type": "integer", "minimum": 1, "maximum": u32::MAX },
            "description": "[x, y, z] in voxels"
        })
    }
}

/// A number of bytes.
pub struct ByteCount;

/// The most that a number in a scene file tells from its neighbours.
const MAX_BYTES: u64 = 1 << 53;

impl ByteCount {
    /// Reads the number, or says what is accepted.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
        const ACCEPTED: &str = "a whole number of bytes";
        let value = deserializer.deserialize_any(Number(ACCEPTED))?;
        if value.fract() == 0.0 && (0.0..=MAX_BYTES as f64).contains(&value) {
            return Ok(value as u64);
        }
        Err(de::Error::invalid_value(de::Unexpected::Float(value), &ACCEPTED))
    }

    /// Writes the number.
    pub fn serialize<S: Serializer>(value: &u64, serializer: S) -> Result<S::Ok, S::Error> {
        value.serialize(serializer)
    }
}

impl JsonSchema for ByteCount {
    fn schema_name() -> Cow<'static, str> {
        "ByteCount".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "integer", "minimum": 0, "maximum": MAX_BYTES, "description": "a whole number of bytes" })
    }
}
