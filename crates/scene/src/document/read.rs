//! A tree as serde reads it, so that every error knows its place and says what was found and what is accepted.

use std::fmt::{self, Display};

use serde::de::value::StrDeserializer;
use serde::de::{
    self, DeserializeSeed, Deserializer, EnumAccess, Expected, IntoDeserializer as _, MapAccess, SeqAccess, Unexpected,
    VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;

use super::node::{Entry, Node, Value, plain};

/// What is wrong with a value of a tree.
#[derive(Debug)]
pub(super) struct Fault {
    /// The keys that lead to the value, innermost first.
    path: Vec<String>,
    /// The byte of the text; `None` until the value is known.
    pub at: Option<usize>,
    found: Option<String>,
    accepted: String,
}

impl Fault {
    fn new(accepted: impl Into<String>) -> Self {
        Self { path: Vec::new(), at: None, found: None, accepted: accepted.into() }
    }

    fn found(self, found: impl Into<String>) -> Self {
        Self { found: Some(found.into()), ..self }
    }

    /// The fault as one of this value, unless it is already known to be of one within.
    fn of(mut self, node: &Node) -> Self {
        self.at.get_or_insert(node.at);
        self.found.get_or_insert_with(|| node.quote());
        self
    }

    fn below(mut self, key: impl Into<String>) -> Self {
        self.path.push(key.into());
        self
    }

    /// The dotted path of the value at fault, what was found and what is accepted.
    pub fn into_error(self) -> super::FieldError {
        let path = self.path.iter().rev().map(String::as_str).collect::<Vec<_>>().join(".");
        super::FieldError { path, found: self.found.unwrap_or_default(), accepted: self.accepted }
    }
}

impl Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.accepted)
    }
}

impl std::error::Error for Fault {}

impl de::Error for Fault {
    fn custom<T: Display>(message: T) -> Self {
        Fault::new(message.to_string())
    }
    fn invalid_type(_: Unexpected, accepted: &dyn Expected) -> Self {
        Fault::new(accepted.to_string())
    }
    fn invalid_value(_: Unexpected, accepted: &dyn Expected) -> Self {
        Fault::new(accepted.to_string())
    }
    fn invalid_length(_: usize, accepted: &dyn Expected) -> Self {
        Fault::new(accepted.to_string())
    }
    fn unknown_variant(_: &str, variants: &'static [&'static str]) -> Self {
        Fault::new(one_of(variants))
    }
    fn unknown_field(field: &str, fields: &'static [&'static str]) -> Self {
        Fault::new(one_of(fields)).found(format!("unknown field `{}`", plain(field)))
    }
    fn missing_field(field: &'static str) -> Self {
        Fault::new(format!("a table with `{field}`, which has no default")).found(format!("no `{field}`"))
    }
}

fn listed(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

fn one_of(names: &[&str]) -> String {
    if names.len() > 1 { format!("one of {}", listed(names)) } else { listed(names) }
}

impl<'de> Deserializer<'de> for &'de Node {
    type Error = Fault;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match &self.value {
            Value::Null => visitor.visit_unit(),
            Value::Switch(value) => visitor.visit_bool(*value),
            Value::Number(value, _) => visitor.visit_f64(*value),
            Value::Text(text) => visitor.visit_borrowed_str(text),
            Value::Date(_) => Err(de::Error::invalid_type(Unexpected::Other("date"), &visitor)),
            Value::List(items) => visitor.visit_seq(Items { items: items.iter(), index: 0 }),
            Value::Table(entries) => visitor.visit_map(Fields { entries: entries.iter(), value: None }),
        }
        .map_err(|fault| fault.of(self))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        if self.value == Value::Null { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        match self.value {
            Value::Table(_) => self.deserialize_any(visitor),
            _ => Err(Fault::new(format!("a table with {}", listed(fields))).of(self)),
        }
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self.value {
            Value::Table(_) => self.deserialize_any(visitor),
            _ => Err(Fault::new("a table").of(self)),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self.value {
            Value::List(_) => self.deserialize_any(visitor),
            _ => Err(Fault::new("a list [...]").of(self)),
        }
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self.value {
            Value::Text(_) => self.deserialize_any(visitor),
            _ => Err(Fault::new("text in quotes").of(self)),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        let fault = Fault::new(one_of(variants));
        match &self.value {
            Value::Text(name) => visitor.visit_enum(Variant { name, key: self, node: None }),
            Value::Table(entries) => match entries.as_slice() {
                [Entry { key, at, node }] => visitor.visit_enum(Variant {
                    name: key,
                    key: &Node { at: *at, value: Value::Null },
                    node: Some(node),
                }),
                [] => Err(fault.found("an empty table")),
                [first, second, ..] => Err(Fault { at: Some(second.at), ..fault }.found(format!(
                    "both `{}` and `{}`",
                    plain(&first.key),
                    plain(&second.key)
                ))),
            },
            _ => Err(fault),
        }
        .map_err(|fault| fault.of(self))
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str bytes byte_buf unit unit_struct tuple
        tuple_struct identifier
    }
}

/// The elements of a list.
struct Items<'de> {
    items: std::slice::Iter<'de, Node>,
    index: usize,
}

impl<'de> SeqAccess<'de> for Items<'de> {
    type Error = Fault;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Fault> {
        let Some(item) = self.items.next() else { return Ok(None) };
        let index = self.index;
        self.index += 1;
        seed.deserialize(item).map(Some).map_err(|fault| fault.of(item).below(index.to_string()))
    }
}

/// The fields of a table.
struct Fields<'de> {
    entries: std::slice::Iter<'de, Entry>,
    value: Option<&'de Entry>,
}

impl<'de> MapAccess<'de> for Fields<'de> {
    type Error = Fault;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Fault> {
        let Some(entry) = self.entries.next() else { return Ok(None) };
        self.value = Some(entry);
        let key: StrDeserializer<Fault> = entry.key.as_str().into_deserializer();
        seed.deserialize(key).map(Some).map_err(|fault| Fault { at: Some(entry.at), ..fault }.below(&entry.key))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Fault> {
        let entry = self.value.take().ok_or_else(|| Fault::new("a key before its value"))?;
        seed.deserialize(&entry.node).map_err(|fault| fault.of(&entry.node).below(&entry.key))
    }
}

/// One of an enum's variants: its name and, unless it stands alone as text, its fields.
struct Variant<'a, 'de> {
    name: &'a str,
    /// Where the name stands.
    key: &'a Node,
    node: Option<&'de Node>,
}

impl<'de> EnumAccess<'de> for Variant<'_, 'de> {
    type Error = Fault;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), Fault> {
        let name: StrDeserializer<Fault> = self.name.into_deserializer();
        let chosen = seed
            .deserialize(name)
            .map_err(|fault| Fault { at: Some(self.key.at), ..fault }.found(format!("`{}`", plain(self.name))))?;
        Ok((chosen, self))
    }
}

impl<'de> VariantAccess<'de> for Variant<'_, 'de> {
    type Error = Fault;

    fn unit_variant(self) -> Result<(), Fault> {
        let Some(node) = self.node else { return Ok(()) };
        Err(Fault::new(format!("the word \"{}\" in place of the table", self.name)).of(node).below(self.name))
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Fault> {
        let Some(node) = self.node else { return Err(self.alone()) };
        seed.deserialize(node).map_err(|fault| fault.below(self.name))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Fault> {
        let Some(node) = self.node else { return Err(self.alone()) };
        node.deserialize_seq(visitor).map_err(|fault| fault.below(self.name))
    }

    fn struct_variant<V: Visitor<'de>>(self, fields: &'static [&'static str], visitor: V) -> Result<V::Value, Fault> {
        let Some(node) = self.node else {
            return Err(Fault::new(format!("a table `{}` with {}", self.name, listed(fields))));
        };
        node.deserialize_struct("", fields, visitor).map_err(|fault| fault.below(self.name))
    }
}

impl Variant<'_, '_> {
    /// The fault of a name without the value that it needs.
    fn alone(&self) -> Fault {
        Fault::new(format!("`{}` with its value", self.name))
    }
}
