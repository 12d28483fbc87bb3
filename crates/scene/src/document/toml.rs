//! TOML as a tree.

use ::toml::de::{DeTable, DeValue};

use super::node::{Entry, Node, Value};

/// The longest text whose mistakes are all collected, to tell the first.
const SHORT: usize = 1 << 16;

/// Parses a TOML text, or says at which byte it cannot be read and why.
pub(super) fn parse(text: &str) -> Result<Node, (usize, String)> {
    let table = DeTable::parse(text).map_err(|error| {
        // The parser works in two passes, so that the first error that it meets need not be the first in the text.
        let others = if text.len() <= SHORT { DeTable::parse_recoverable(text).1 } else { Vec::new() };
        let start = |error: &::toml::de::Error| error.span().map_or(text.len(), |span| span.start);
        let first = others.iter().min_by_key(|error| start(error)).unwrap_or(&error);
        (start(first), first.message().into())
    })?;
    Ok(Node { at: table.span().start, value: entries(table.get_ref()) })
}

/// Parses a value in TOML's notation; `None` where it is none.
pub(super) fn value(text: &str) -> Option<Node> {
    DeValue::parse(text).ok().map(|value| Node { at: 0, value: convert(value.get_ref()) })
}

fn entries(table: &DeTable) -> Value {
    let entry = |(key, value): (&::toml::Spanned<std::borrow::Cow<str>>, &::toml::Spanned<DeValue>)| Entry {
        key: key.get_ref().to_string(),
        at: key.span().start,
        node: Node { at: value.span().start, value: convert(value.get_ref()) },
    };
    let mut entries: Vec<_> = table.iter().map(entry).collect();
    entries.sort_by_key(|entry| entry.at);
    Value::Table(entries)
}

fn convert(value: &DeValue) -> Value {
    match value {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Boolean(value) => Value::Switch(*value),
        DeValue::Float(number) => Value::Number(number.as_str().parse().unwrap_or(f64::NAN), number.to_string()),
        DeValue::Integer(number) => {
            // Beyond 128 bits only decimals keep their value; no field accepts so large a number in any case.
            let exact = i128::from_str_radix(number.as_str(), number.radix()).map(|integer| integer as f64);
            let value = exact.or_else(|_| number.as_str().parse()).unwrap_or(f64::INFINITY);
            Value::Number(value, number.to_string())
        }
        DeValue::Datetime(date) => Value::Date(date.to_string()),
        DeValue::Array(items) => {
            let item = |item: &::toml::Spanned<DeValue>| Node { at: item.span().start, value: convert(item.get_ref()) };
            Value::List(items.iter().map(item).collect())
        }
        DeValue::Table(table) => entries(table),
    }
}
