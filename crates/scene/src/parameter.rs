//! What a technique declares of its parameters; scene files, the command line and the documentation are driven by it.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::de::{self, Deserializer, Visitor};
use serde::{Deserialize, Serialize};

use crate::FieldError;

/// A parameter's value as a scene file gives it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Value {
    /// `true` or `false`.
    Switch(bool),
    /// A number.
    Number(f64),
    /// A word.
    Choice(String),
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnyValue)
    }
}

struct AnyValue;

impl Visitor<'_> for AnyValue {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("true, false, a finite number or a word in quotes")
    }
    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Switch(value))
    }
    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Value, E> {
        if value.is_finite() {
            return Ok(Value::Number(value));
        }
        Err(E::invalid_value(de::Unexpected::Float(value), &self))
    }
    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(Value::Number(value as f64))
    }
    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(Value::Number(value as f64))
    }
    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(Value::Choice(value.into()))
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Value::Switch(value) => write!(f, "{value}"),
            Value::Number(value) => write!(f, "{value}"),
            Value::Choice(value) => write!(f, "{value:?}"),
        }
    }
}

/// One parameter of a technique.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Its name in scene files.
    pub name: &'static str,
    /// One line of help.
    pub help: &'static str,
    /// Its unit, empty for a pure number.
    pub unit: &'static str,
    /// What it accepts, and its default.
    pub kind: Kind,
}

/// What a parameter accepts, and its default.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// A real number.
    Number {
        /// The least.
        min: f64,
        /// The greatest.
        max: f64,
        /// Where a scene is silent.
        default: f64,
    },
    /// A whole number.
    Count {
        /// The least.
        min: u32,
        /// The greatest.
        max: u32,
        /// Where a scene is silent.
        default: u32,
    },
    /// One of some words; the first is the default.
    Choice(&'static [&'static str]),
}

impl Kind {
    /// The default value.
    pub fn default_value(&self) -> Value {
        match *self {
            Kind::Number { default, .. } => Value::Number(default),
            Kind::Count { default, .. } => Value::Number(default.into()),
            Kind::Choice(words) => Value::Choice(words[0].into()),
        }
    }

    fn accepts(&self, value: &Value) -> bool {
        match (self, value) {
            (Kind::Number { min, max, .. }, Value::Number(x)) => (min..=max).contains(&x),
            (Kind::Count { min, max, .. }, Value::Number(x)) => {
                x.fract() == 0.0 && (f64::from(*min)..=f64::from(*max)).contains(x)
            }
            (Kind::Choice(words), Value::Choice(word)) => words.contains(&word.as_str()),
            _ => false,
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Kind::Number { min, max, .. } => write!(f, "a number from {min} to {max}"),
            Kind::Count { min, max, .. } => write!(f, "a whole number from {min} to {max}"),
            Kind::Choice(words) => write!(f, "one of \"{}\"", words.join("\", \"")),
        }
    }
}

/// A technique's parameters with the values that hold: every one declared is present, valid and has its default where
/// the scene is silent.
#[derive(Clone, Debug)]
pub struct Settings(BTreeMap<&'static str, Value>);

impl Settings {
    /// Checks what a scene says of one technique against what the technique declares.
    pub fn new(
        technique: &str,
        declared: &[Parameter],
        given: Option<&BTreeMap<String, Value>>,
    ) -> Result<Self, FieldError> {
        let mut settings: BTreeMap<_, _> =
            declared.iter().map(|parameter| (parameter.name, parameter.kind.default_value())).collect();
        for (name, value) in given.into_iter().flatten() {
            let path = format!("techniques.{technique}.{name}");
            let Some(parameter) = declared.iter().find(|parameter| parameter.name == name) else {
                let names: Vec<_> = declared.iter().map(|parameter| parameter.name).collect();
                let accepted = format!("one of {}", names.join(", "));
                return Err(FieldError { path, found: format!("unknown parameter `{name}`"), accepted });
            };
            if !parameter.kind.accepts(value) {
                let accepted = format!("{} {}", parameter.kind, parameter.unit).trim_end().to_owned();
                return Err(FieldError { path, found: value.to_string(), accepted });
            }
            settings.insert(parameter.name, value.clone());
        }
        Ok(Self(settings))
    }

    /// The value of a number or count.
    ///
    /// # Panics
    /// Where the technique asks for a parameter that it does not declare: a mistake in the technique, not in a scene.
    pub fn number(&self, name: &str) -> f32 {
        match self.0.get(name) {
            Some(Value::Number(value)) => *value as f32,
            other => panic!("`{name}` is no declared number: {other:?}"),
        }
    }

    /// The chosen word.
    ///
    /// # Panics
    /// Where the technique asks for a parameter that it does not declare.
    pub fn choice(&self, name: &str) -> &str {
        match self.0.get(name) {
            Some(Value::Choice(word)) => word,
            other => panic!("`{name}` is no declared choice: {other:?}"),
        }
    }
}
