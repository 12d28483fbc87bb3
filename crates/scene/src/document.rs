//! Scene files as text: parsing, and errors that know their place.

use std::fmt;
use std::str::FromStr;

use serde::de::{DeserializeSeed, Deserializer, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::Value as Json;

use crate::Scene;

/// The languages a scene file may be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// TOML 1.0.
    Toml,
    /// JSON, of the same schema.
    Json,
}

/// The text of a scene file, kept so that what is found wrong later can still be located in it.
#[derive(Clone, Debug)]
pub struct Document {
    name: String,
    text: String,
    format: Format,
}

/// A value of a scene that cannot be, by its path.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{path}: found {found}; accepted: {accepted}")]
pub struct FieldError {
    /// Dotted path of the field in the scene.
    pub path: String,
    /// What stands there.
    pub found: String,
    /// What may stand there.
    pub accepted: String,
}

/// What is wrong with a scene file, and where.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct SceneError {
    /// The file, as it was named.
    pub file: String,
    /// Line and column, from 1, where known.
    pub place: Option<(usize, usize)>,
    /// Dotted path of the field; empty where the text itself cannot be read.
    pub path: String,
    /// What was found and what is accepted.
    pub message: String,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}", self.file)?;
        if let Some((line, column)) = self.place {
            write!(f, ":{line}:{column}")?;
        }
        if !self.path.is_empty() && self.path != "." {
            write!(f, ": {}", self.path)?;
        }
        write!(f, ": {}", self.message)
    }
}

/// The largest scene text that is read [bytes].
pub const MAX_TEXT: usize = 16 << 20;

impl Document {
    /// A scene text; `name` stands in messages, and its ending `.json` makes it JSON, anything else TOML.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        let name = name.into();
        let format = if name.to_ascii_lowercase().ends_with(".json") { Format::Json } else { Format::Toml };
        Self { name, text: text.into(), format }
    }

    /// Parses and checks the scene.
    ///
    /// # Errors
    /// Syntax, unknown or missing fields, wrong types, values out of range, contradictions between fields.
    pub fn parse(&self) -> Result<Scene, SceneError> {
        if self.text.len() > MAX_TEXT {
            let message = format!("found {} bytes; accepted: at most {MAX_TEXT}", self.text.len());
            return Err(SceneError { file: self.name.clone(), place: None, path: String::new(), message });
        }
        let scene: Scene = match self.format {
            Format::Toml => {
                let deserializer =
                    toml::Deserializer::parse(&self.text).map_err(|error| self.toml_error("", &error))?;
                serde_path_to_error::deserialize(deserializer)
                    .map_err(|error| self.toml_error(&error.path().to_string(), error.inner()))?
            }
            Format::Json => {
                let mut deserializer = serde_json::Deserializer::from_str(&self.text);
                let scene = serde_path_to_error::deserialize(&mut deserializer)
                    .map_err(|error| self.json_error(&error.path().to_string(), error.inner()))?;
                deserializer.end().map_err(|error| self.json_error("", &error))?;
                scene
            }
        };
        scene.check().map_err(|error| self.locate(&error))?;
        Ok(scene)
    }

    /// The error of a field, at its place in this text (without one where the text leaves the field to its default).
    pub fn locate(&self, error: &FieldError) -> SceneError {
        let message = format!("found {}; accepted: {}", error.found, error.accepted);
        self.at(&error.path, &message)
    }

    /// A message about the field with this path, at its place in this text.
    pub fn at(&self, path: &str, message: &str) -> SceneError {
        let segments: Vec<&str> = path.split('.').collect();
        let trap = Trap { path: &segments, message };
        let found = match self.format {
            Format::Toml => toml::Deserializer::parse(&self.text)
                .and_then(|deserializer| trap.deserialize(deserializer))
                .err()
                .map(|error| self.toml_error(path, &error)),
            Format::Json => trap
                .deserialize(&mut serde_json::Deserializer::from_str(&self.text))
                .err()
                .map(|error| self.json_error(path, &error)),
        };
        found.unwrap_or_else(|| SceneError {
            file: self.name.clone(),
            place: None,
            path: path.into(),
            message: message.into(),
        })
    }

    fn toml_error(&self, path: &str, error: &toml::de::Error) -> SceneError {
        SceneError {
            file: self.name.clone(),
            place: error.span().map(|span| line_and_column(&self.text, span.start)),
            path: path.into(),
            message: error.message().into(),
        }
    }

    fn json_error(&self, path: &str, error: &serde_json::Error) -> SceneError {
        let place = (error.line(), error.column());
        let message = error.to_string();
        let suffix = format!(" at line {} column {}", place.0, place.1);
        SceneError {
            file: self.name.clone(),
            place: (place.0 > 0).then_some(place),
            path: path.into(),
            message: message.strip_suffix(&suffix).unwrap_or(&message).into(),
        }
    }
}

/// Line and column, from 1 and in characters, of a byte offset.
fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// Fails with `message` when it reaches the value at `path`, so that the format's own error says where that is.
struct Trap<'a> {
    path: &'a [&'a str],
    message: &'a str,
}

impl<'a> Trap<'a> {
    fn further(&self) -> Trap<'a> {
        Trap { path: &self.path[1..], message: self.message }
    }
}

impl<'de> DeserializeSeed<'de> for Trap<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        if self.path.is_empty() {
            return Err(D::Error::custom(self.message));
        }
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Trap<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a table or an array")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(key) = map.next_key::<String>()? {
            if key == self.path[0] {
                map.next_value_seed(self.further())?;
            } else {
                map.next_value::<IgnoredAny>()?;
            }
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        let wanted = usize::from_str(self.path[0]).ok();
        for i in 0.. {
            let more = if Some(i) == wanted {
                seq.next_element_seed(self.further())?.is_some()
            } else {
                seq.next_element::<IgnoredAny>()?.is_some()
            };
            if !more {
                break;
            }
        }
        Ok(())
    }
}

impl Scene {
    /// Sets the field at a dotted path, such as `media.plume.optics.coefficients.sigma_s`, to a value in TOML's
    /// notation (a bare word counts as text).
    ///
    /// # Errors
    /// No such field, or a value it does not accept.
    pub fn set(&mut self, path: &str, value: &str) -> Result<(), SceneError> {
        let error = |message: String| SceneError {
            file: format!("--set {path}={value}"),
            place: None,
            path: String::new(),
            message,
        };
        let parsed = toml::from_str::<toml::Table>(&format!("value = {value}"))
            .ok()
            .and_then(|mut table| table.remove("value"))
            .map_or_else(|| Ok(Json::from(value)), serde_json::to_value)
            .map_err(|e| error(e.to_string()))?;
        let mut tree = serde_json::to_value(&*self).map_err(|e| error(e.to_string()))?;
        let mut node = &mut tree;
        for segment in path.split('.') {
            node = match node {
                Json::Object(fields) => fields.entry(segment).or_insert_with(|| Json::Object(Default::default())),
                Json::Array(items) => {
                    let len = items.len();
                    let item = usize::from_str(segment).ok().and_then(|i| items.get_mut(i));
                    item.ok_or_else(|| error(format!("found `{segment}`; accepted: an index below {len}")))?
                }
                leaf => return Err(error(format!("there is nothing below {leaf} to set"))),
            };
        }
        *node = parsed;
        let scene: Scene =
            serde_path_to_error::deserialize(tree).map_err(|e| error(format!("{}: {}", e.path(), e.inner())))?;
        scene.check().map_err(|e| error(e.to_string()))?;
        *self = scene;
        Ok(())
    }
}
