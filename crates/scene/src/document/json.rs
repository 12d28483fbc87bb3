//! JSON as a tree.

use std::fmt;

use serde::de::{Deserializer, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::value::RawValue;

use super::node::{Entry, Node, Value, plain};

/// How deep arrays and objects may nest; a scene needs eight levels.
const MAX_DEPTH: usize = 64;

/// Parses a JSON text, or says at which byte it cannot be read and why.
pub(super) fn parse(text: &str) -> Result<Node, (usize, String)> {
    // The whole text first: skipping values needs no stack, and where this fails is the error's place.
    serde_json::from_str::<IgnoredAny>(text).map_err(|error| (offset(text, &error), explain(&error)))?;
    let raw = serde_json::from_str::<&RawValue>(text).map_err(|error| (0, explain(&error)))?;
    Parser { text }.node(raw, 0)
}

/// Reads the values of a text level by level, each as the piece of the text that it is.
struct Parser<'a> {
    text: &'a str,
}

impl Parser<'_> {
    /// Where a piece of the text begins.
    fn start(&self, piece: &RawValue) -> usize {
        piece.get().as_ptr().addr() - self.text.as_ptr().addr()
    }

    fn node(&self, raw: &RawValue, depth: usize) -> Result<Node, (usize, String)> {
        let (at, text) = (self.start(raw), raw.get());
        let failed = |error: serde_json::Error| (at, explain(&error));
        if depth > MAX_DEPTH {
            return Err((at, format!("found more than {MAX_DEPTH} nested levels; accepted: fewer")));
        }
        let value = match text.as_bytes().first() {
            Some(b'{') => self.table(text, depth).map_err(|(place, message)| (place.unwrap_or(at), message))?,
            Some(b'[') => {
                let items = serde_json::Deserializer::from_str(text).deserialize_seq(Items).map_err(failed)?;
                let items: Result<_, _> = items.into_iter().map(|item| self.node(item, depth + 1)).collect();
                Value::List(items?)
            }
            Some(b'"') => Value::Text(serde_json::from_str(text).map_err(failed)?),
            Some(b't' | b'f') => Value::Switch(text == "true"),
            Some(b'n') => Value::Null,
            _ => Value::Number(text.parse().unwrap_or(f64::NAN), text.into()),
        };
        Ok(Node { at, value })
    }

    fn table(&self, text: &str, depth: usize) -> Result<Value, (Option<usize>, String)> {
        let fields = serde_json::Deserializer::from_str(text)
            .deserialize_map(Fields)
            .map_err(|error| (None, explain(&error)))?;
        let mut entries = Vec::<Entry>::new();
        let mut seen = std::collections::BTreeSet::new();
        for (raw, value) in fields {
            let at = self.start(raw);
            let key: String = serde_json::from_str(raw.get()).map_err(|error| (Some(at), explain(&error)))?;
            if !seen.insert(key.clone()) {
                return Err((Some(at), format!("found `{}` twice; accepted: every field once", plain(&key))));
            }
            let node = self.node(value, depth + 1).map_err(|(at, message)| (Some(at), message))?;
            entries.push(Entry { key, at, node });
        }
        Ok(Value::Table(entries))
    }
}

/// The elements of an array, unread.
struct Items;

impl<'de> Visitor<'de> for Items {
    type Value = Vec<&'de RawValue>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an array")
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = seq.next_element()? {
            items.push(item);
        }
        Ok(items)
    }
}

/// The fields of an object, unread.
struct Fields;

impl<'de> Visitor<'de> for Fields {
    type Value = Vec<(&'de RawValue, &'de RawValue)>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an object")
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut fields = Vec::new();
        while let Some(key) = map.next_key().map_err(A::Error::custom)? {
            fields.push((key, map.next_value()?));
        }
        Ok(fields)
    }
}

/// serde_json's message without the place that it repeats.
fn explain(error: &serde_json::Error) -> String {
    let message = error.to_string();
    let suffix = format!(" at line {} column {}", error.line(), error.column());
    message.strip_suffix(&suffix).unwrap_or(&message).into()
}

/// The byte that serde_json's line and column (in bytes, from 1) point at.
fn offset(text: &str, error: &serde_json::Error) -> usize {
    let before: usize = text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
    let mut at = (before + error.column().saturating_sub(1)).min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}
