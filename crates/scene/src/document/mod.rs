//! Scene files as text: parsing, and errors that know their place.

mod json;
mod node;
mod read;
mod set;
mod toml;

use std::fmt;

use serde::Deserialize as _;

use crate::assets::Assets;
use crate::{Scene, surface};
use node::{Node, plain};

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
    /// Nobody wrote the text, so that places in it say nothing.
    made: bool,
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
        if !self.path.is_empty() {
            write!(f, ": {}", plain_path(&self.path))?;
        }
        write!(f, ": {}", self.message)
    }
}

/// The largest scene text that is read [bytes]. Data belongs into assets.
pub const MAX_TEXT: usize = 1 << 20;

impl Document {
    /// A scene text; `name` stands in messages, and its ending `.json` makes it JSON, anything else TOML.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        let (name, text) = (name.into(), text.into());
        let format = if name.to_ascii_lowercase().ends_with(".json") { Format::Json } else { Format::Toml };
        // Some editors begin a file with a byte order mark.
        let text = text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text);
        Self { name, text, format, made: false }
    }

    /// The scene that a file of surfaces is by itself (`.gltf`, `.glb`, `.obj`, `.ply`), by its path as `assets` take it: it
    /// alone, as `surfaces.model`, taken by its first camera, or by one that sees all of it. Where it has no light that is
    /// an even sky, `lights.sky`.
    pub fn model(file: &str, assets: &dyn Assets) -> Self {
        let mut scene = serde_json::json!({ "surfaces": { "model": { "shape": { "mesh": { "file": file } } } } });
        if !surface::gives_light(file, assets) {
            scene["lights"] = serde_json::json!({ "sky": { "constant": { "radiance": 1.0 } } });
        }
        Self { name: file.into(), text: scene.to_string(), format: Format::Json, made: true }
    }

    /// Whether a file of this name is one that [`Document::model`] takes.
    pub fn is_model(name: &str) -> bool {
        surface::Format::of(name).is_some()
    }

    /// A scene file's bytes, as [`Document::new`] takes a text.
    ///
    /// # Errors
    /// Bytes that are not UTF-8, and more than [`MAX_TEXT`] of them.
    pub fn from_bytes(name: impl Into<String>, bytes: Vec<u8>) -> Result<Self, SceneError> {
        let name = name.into();
        if bytes.len() > MAX_TEXT {
            return Err(too_long(&name));
        }
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Self::new(name, text)),
            Err(error) => {
                let valid = error.utf8_error().valid_up_to();
                let text = String::from_utf8_lossy(&error.as_bytes()[..valid]);
                let place = Some(line_and_column(&text, valid));
                let message = format!("found the byte 0x{:02x}; accepted: text in UTF-8", error.as_bytes()[valid]);
                Err(SceneError { file: name, place, path: String::new(), message })
            }
        }
    }

    /// Parses and checks the scene.
    ///
    /// # Errors
    /// Syntax, unknown or missing fields, wrong types, values out of range, contradictions between fields.
    pub fn parse(&self) -> Result<Scene, SceneError> {
        let tree = self.tree()?;
        let scene = Scene::deserialize(&tree).map_err(|fault| {
            let at = fault.at;
            self.error(at, &fault.into_error())
        })?;
        scene.check_relations().map_err(|error| {
            let whole = error.path.is_empty().then_some(tree.at);
            self.error(whole.or_else(|| tree.find(&error.path)), &error)
        })?;
        Ok(scene)
    }

    /// The error of a field, at its place in this text.
    pub fn locate(&self, error: &FieldError) -> SceneError {
        self.at(&error.path, &error.message())
    }

    /// A message about the field with this path, at its place in this text. Where the text leaves the field to its
    /// default that is the place of the table around it; where there is none, the message has no place.
    pub fn at(&self, path: &str, message: &str) -> SceneError {
        let at = self.tree().ok().and_then(|tree| tree.find(path));
        SceneError { file: self.name.clone(), place: self.place(at), path: path.into(), message: message.into() }
    }

    fn tree(&self) -> Result<Node, SceneError> {
        if self.text.len() > MAX_TEXT {
            return Err(too_long(&self.name));
        }
        let parsed = match self.format {
            Format::Toml => toml::parse(&self.text),
            Format::Json => json::parse(&self.text),
        };
        parsed.map_err(|(at, message)| SceneError {
            file: self.name.clone(),
            place: self.place(Some(at)),
            path: String::new(),
            message,
        })
    }

    fn error(&self, at: Option<usize>, error: &FieldError) -> SceneError {
        let message = error.message();
        SceneError { file: self.name.clone(), place: self.place(at), path: error.path.clone(), message }
    }

    fn place(&self, at: Option<usize>) -> Option<(usize, usize)> {
        at.filter(|_| !self.made).map(|at| line_and_column(&self.text, at))
    }
}

impl FieldError {
    fn message(&self) -> String {
        format!("found {}; accepted: {}", self.found, self.accepted)
    }
}

fn too_long(name: &str) -> SceneError {
    let message = format!("found a longer text; accepted: at most {MAX_TEXT} bytes");
    SceneError { file: name.into(), place: None, path: String::new(), message }
}

/// A path as a message may show it: keys are free text.
fn plain_path(path: &str) -> String {
    path.split('.').map(plain).collect::<Vec<_>>().join(".")
}

/// Line and column, from 1 and in characters, of a byte offset.
fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}
