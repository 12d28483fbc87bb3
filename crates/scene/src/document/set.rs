//! A field set by its path, as the command line does.

use std::str::FromStr;

use serde::Deserialize as _;

use super::node::{Entry, Node, Value, below, plain};
use super::{FieldError, toml};
use crate::Scene;

impl Scene {
    /// Sets the field at a dotted path, such as `media.plume.optics.coefficients.sigma_s`, to a value in TOML's
    /// notation (what is no TOML counts as text). Tables that the path leads through are added where they are not there.
    /// On an error the scene is as before.
    ///
    /// # Errors
    /// No such field, or a value that it does not accept.
    pub fn set(&mut self, path: &str, value: &str) -> Result<(), FieldError> {
        let mut tree = self.tree();
        let value = toml::value(value).unwrap_or_else(|| Node { at: 0, value: Value::Text(value.into()) });
        if path.split('.').any(str::is_empty) {
            let accepted = "a path such as film.exposure".into();
            return Err(FieldError { path: plain(path), found: "an empty name in the path".into(), accepted });
        }
        *tree.place(path, path)? = value;
        let scene = Scene::deserialize(&tree).map_err(|fault| fault.into_error())?;
        scene.check_relations()?;
        *self = scene;
        Ok(())
    }

    /// The scene as a file would hold it.
    fn tree(&self) -> Node {
        serde_json::to_value(self).expect("a scene has only string keys").into()
    }

    /// Checks every number and word as if it was read from a file, which a scene built in code was not.
    pub(crate) fn check_values(&self) -> Result<(), FieldError> {
        Scene::deserialize(&self.tree()).map(drop).map_err(|fault| fault.into_error())
    }
}

/// How deep a path may lead; a scene has eight levels.
const MAX_DEPTH: usize = 64;

impl Node {
    /// The value at what is left of a path, added where it is not there.
    fn place(&mut self, rest: &str, path: &str) -> Result<&mut Node, FieldError> {
        if path.split('.').count() > MAX_DEPTH {
            let accepted = format!("at most {MAX_DEPTH} names");
            return Err(FieldError { path: plain(path), found: "a longer path".into(), accepted });
        }
        if rest.is_empty() {
            return Ok(self);
        }
        // A word, such as an isotropic phase, gives way to the table that is asked for.
        if let Value::Text(_) | Value::Null = self.value {
            self.value = Value::Table(Vec::new());
        }
        let segment = rest.split('.').next().unwrap_or_default();
        let refuse = |accepted: String| Err(FieldError { path: plain(path), found: plain(segment), accepted });
        match &mut self.value {
            Value::Table(entries) => {
                // A key may itself contain dots: the longest that leads there.
                let fits = |entry: &Entry| below(rest, &entry.key).map(|_| entry.key.len());
                let found = (0..entries.len()).filter(|&i| fits(&entries[i]).is_some());
                let index = found.max_by_key(|&i| fits(&entries[i])).unwrap_or_else(|| {
                    entries.push(Entry {
                        key: segment.into(),
                        at: 0,
                        node: Node { at: 0, value: Value::Table(Vec::new()) },
                    });
                    entries.len() - 1
                });
                let Entry { key, node, .. } = &mut entries[index];
                node.place(below(rest, key).unwrap_or_default(), path)
            }
            Value::List(items) => {
                let len = items.len();
                match usize::from_str(segment).ok().and_then(|i| items.get_mut(i)) {
                    Some(item) => item.place(below(rest, segment).unwrap_or_default(), path),
                    None if len == 0 => refuse("no index: the list is empty".into()),
                    None => refuse(format!("an index from 0 to {}", len - 1)),
                }
            }
            _ => refuse("no name here: what is to the left of it is no table".into()),
        }
    }
}
