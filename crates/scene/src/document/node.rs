//! A scene text as a tree of values that know their place, the same for TOML and JSON.

use std::fmt;
use std::str::FromStr;

use serde_json::Value as Json;

/// A value and the byte at which it begins.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    pub at: usize,
    pub value: Value,
}

/// What a scene text can hold.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Null,
    Switch(bool),
    /// A number, and how it was written.
    Number(f64, String),
    Text(String),
    /// TOML's dates and times, of which a scene has none.
    Date(String),
    List(Vec<Node>),
    Table(Vec<Entry>),
}

/// A field of a table, and the byte at which its key begins.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub key: String,
    pub at: usize,
    pub node: Node,
}

impl Node {
    /// The place of the value at a dotted path or, where the text does not have it, of the nearest table around it;
    /// `None` where the text has nothing of the path. A key may itself contain dots.
    pub fn find(&self, path: &str) -> Option<usize> {
        self.nearest(path).filter(|&(_, matched)| matched > 0).map(|(at, _)| at)
    }

    /// The deepest value on a path, and how much of the path leads to it.
    fn nearest(&self, path: &str) -> Option<(usize, usize)> {
        let here = Some((self.at, 0));
        let below = |key: &str, node: &Node| {
            let (at, matched) = node.nearest(below(path, key)?)?;
            Some((at, matched + key.len().max(1)))
        };
        let deeper = match &self.value {
            Value::Table(entries) => {
                entries.iter().filter_map(|entry| below(&entry.key, &entry.node)).max_by_key(|&(_, matched)| matched)
            }
            Value::List(items) => {
                let index = path.split('.').next()?;
                usize::from_str(index).ok().and_then(|i| below(index, items.get(i)?))
            }
            _ => None,
        };
        deeper.or(here)
    }
}

/// What is left of a dotted path below a key, if it leads there.
pub(super) fn below<'p>(path: &'p str, key: &str) -> Option<&'p str> {
    let rest = path.strip_prefix(key)?;
    if rest.is_empty() { Some(rest) } else { rest.strip_prefix('.') }
}

impl From<Json> for Node {
    /// The tree of a value that stands in no text.
    fn from(json: Json) -> Self {
        let value = match json {
            Json::Null => Value::Null,
            Json::Bool(value) => Value::Switch(value),
            Json::Number(number) => Value::Number(number.as_f64().unwrap_or(f64::INFINITY), number.to_string()),
            Json::String(text) => Value::Text(text),
            Json::Array(items) => Value::List(items.into_iter().map(Node::from).collect()),
            Json::Object(fields) => {
                let entry = |(key, json)| Entry { key, at: 0, node: Node::from(json) };
                Value::Table(fields.into_iter().map(entry).collect())
            }
        };
        Node { at: 0, value }
    }
}

/// The most characters of a value that a message quotes.
const QUOTED: usize = 60;

impl Node {
    /// The value as TOML writes it, cut where it is long, without control characters.
    pub fn quote(&self) -> String {
        let mut quoted = Quote { text: String::new(), left: QUOTED };
        match quoted.node(self) {
            Ok(()) => quoted.text,
            Err(fmt::Error) => quoted.text + "…",
        }
    }
}

/// Text up to a limit, so that quoting a huge value costs nothing.
struct Quote {
    text: String,
    left: usize,
}

impl fmt::Write for Quote {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for character in text.chars() {
            self.left = self.left.checked_sub(1).ok_or(fmt::Error)?;
            self.text.push(character);
        }
        Ok(())
    }
}

impl Quote {
    fn node(&mut self, node: &Node) -> fmt::Result {
        use fmt::Write as _;
        match &node.value {
            Value::Null => self.write_str("null"),
            Value::Switch(value) => write!(self, "{value}"),
            Value::Number(_, text) | Value::Date(text) => self.write_str(text),
            Value::Text(text) => write!(self, "{text:?}"),
            Value::List(items) => {
                for (i, item) in items.iter().enumerate() {
                    self.write_str(if i == 0 { "[" } else { ", " })?;
                    self.node(item)?;
                }
                self.write_str(if items.is_empty() { "[]" } else { "]" })
            }
            Value::Table(entries) => {
                for (i, entry) in entries.iter().enumerate() {
                    self.write_str(if i == 0 { "{ " } else { ", " })?;
                    write!(self, "{} = ", plain(&entry.key))?;
                    self.node(&entry.node)?;
                }
                self.write_str(if entries.is_empty() { "{}" } else { " }" })
            }
        }
    }
}

/// Text from a file as a message may show it: without control characters, and not too long.
pub(super) fn plain(text: &str) -> String {
    let clean = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
    let mut shown: String = text.chars().take(QUOTED).map(clean).collect();
    if text.chars().nth(QUOTED).is_some() {
        shown.push('…');
    }
    shown
}
