//! Particles from a PLY file: the scalar properties of its element `vertex`.
//!
//! Source of the format: <https://gamma.cs.unc.edu/POWERPLANT/papers/ply.pdf>.

use super::Particles;
use super::columns::{COLUMNS, Row, Rows, column};
use crate::description::BodyFile;
use crate::volume::{Budget, Stored, VolumeError};

/// The longest header that is looked at.
const MAX_HEADER: usize = 1 << 16;

const ACCEPTED: &str = "ascii, binary_little_endian or binary_big_endian 1.0, with `element vertex` of scalar properties, \
                        before which no element has lists";

/// How numbers stand in the file.
#[derive(Clone, Copy, PartialEq)]
enum Coding {
    Text,
    Binary { big_endian: bool },
}

/// The vertices that a header promises.
struct Header {
    coding: Coding,
    /// Numbers (of text) and bytes (of binary) before the first vertex.
    before: [u64; 2],
    count: u64,
    properties: Vec<Property>,
    /// Bytes of the header.
    length: usize,
}

/// A number of each vertex.
struct Property {
    stored: Stored,
    column: Option<usize>,
}

impl Property {
    /// What a stored colour is divided by: whole numbers of 8 or 16 bits reach from 0 to 1.
    fn scale(&self) -> f64 {
        match (self.column, self.stored) {
            (Some(5..), Stored::U8) => 1.0 / 255.0,
            (Some(5..), Stored::U16) => 1.0 / 65535.0,
            _ => 1.0,
        }
    }
}

/// Reads the vertices; what other elements follow does not matter.
pub(super) fn read(bytes: &[u8], given: &BodyFile, budget: Budget) -> Result<Particles, VolumeError> {
    let header = Header::parse(bytes)?;
    let mut present = [false; COLUMNS];
    header.properties.iter().filter_map(|property| property.column).for_each(|column| present[column] = true);
    let body = &bytes[header.length..];
    let truncated = || VolumeError::Truncated { what: "the vertices", at: bytes.len() as u64 };
    let least = match header.coding {
        // A number and what parts it from the next.
        Coding::Text => (header.properties.len() as u64).saturating_mul(header.count).saturating_mul(2),
        Coding::Binary { .. } => header.stride().saturating_mul(header.count).saturating_add(header.before[1]),
    };
    if least > (body.len() as u64).saturating_add(1) {
        return Err(truncated());
    }
    let mut rows = Rows::new(given, present, header.count, budget)?;
    let has_color = present[5];
    match header.coding {
        Coding::Text => {
            let mut words = body.split(|c| c.is_ascii_whitespace()).filter(|word| !word.is_empty());
            for _ in 0..header.before[0] {
                words.next().ok_or_else(truncated)?;
            }
            for _ in 0..header.count {
                rows.push(header.row(|_| number(words.next().ok_or_else(truncated)?))?, has_color)?;
            }
        }
        Coding::Binary { big_endian } => {
            let stride = header.stride() as usize;
            for vertex in 0..header.count as usize {
                let mut at = header.before[1] as usize + vertex * stride;
                let row = header.row(|property| {
                    let end = at + property.stored.size();
                    let stored = body.get(at..end).ok_or_else(truncated)?;
                    at = end;
                    Ok(property.stored.decode(stored, big_endian))
                })?;
                rows.push(row, has_color)?;
            }
        }
    }
    Ok(rows.finish())
}

fn number(word: &[u8]) -> Result<f64, VolumeError> {
    str::from_utf8(word).ok().and_then(|word| word.parse().ok()).ok_or_else(|| {
        let word = word[..word.len().min(20)].escape_ascii();
        VolumeError::corrupt(format!("a number of a vertex is \"{word}\""))
    })
}

impl Header {
    /// A vertex, its numbers got one by one.
    fn row(&self, mut next: impl FnMut(&Property) -> Result<f64, VolumeError>) -> Result<Row, VolumeError> {
        let mut row = [0.0; COLUMNS];
        for property in &self.properties {
            let value = next(property)? * property.scale();
            if let Some(column) = property.column {
                row[column] = value;
            }
        }
        Ok(row)
    }

    /// Bytes of a vertex.
    fn stride(&self) -> u64 {
        self.properties.iter().map(|property| property.stored.size() as u64).sum()
    }

    fn parse(bytes: &[u8]) -> Result<Self, VolumeError> {
        if !bytes.starts_with(&b"ply"[..bytes.len().min(3)]) || bytes.is_empty() {
            return Err(VolumeError::not("a PLY", bytes, "ply"));
        }
        let mut coding = None;
        let mut before = [0u64; 2];
        // The element that is being declared: its name, count, numbers and bytes, and whether it has a list.
        let mut element: Option<(String, u64, [u64; 2], bool)> = None;
        let mut properties = Vec::new();
        let mut found = None;
        let mut at = 0;
        loop {
            let rest = &bytes[at..bytes.len().min(MAX_HEADER)];
            let Some(end) = rest.iter().position(|&c| c == b'\n') else {
                if bytes.len() < MAX_HEADER {
                    return Err(VolumeError::Truncated { what: "the header", at: bytes.len() as u64 });
                }
                return Err(VolumeError::corrupt(format!("its header has more than {MAX_HEADER} bytes")));
            };
            at += end + 1;
            let line = str::from_utf8(&rest[..end]).map_err(|_| VolumeError::corrupt("its header is no text"))?;
            let unsupported = || VolumeError::Unsupported {
                found: format!("{:?} in the header", line.trim().chars().take(60).collect::<String>()),
                accepted: ACCEPTED,
            };
            let words: Vec<_> = line.split_whitespace().collect();
            match words[..] {
                [] | ["ply"] | ["comment" | "obj_info", ..] => {}
                ["format", name, "1.0"] => {
                    coding = Some(match name {
                        "ascii" => Coding::Text,
                        "binary_little_endian" => Coding::Binary { big_endian: false },
                        "binary_big_endian" => Coding::Binary { big_endian: true },
                        _ => return Err(unsupported()),
                    });
                }
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| unsupported())?;
                    if let Some((name, count, sizes, lists)) = element.take() {
                        match name == "vertex" {
                            true => found = Some(count),
                            // What stands before the vertices is skipped.
                            false if found.is_none() && lists && count > 0 => return Err(unsupported()),
                            false if found.is_none() => {
                                before = [0, 1].map(|i| sizes[i].saturating_mul(count).saturating_add(before[i]));
                            }
                            false => {}
                        }
                    }
                    element = Some((name.into(), count, [0; 2], false));
                }
                ["property", "list", _, _, _] => {
                    let (name, _, _, lists) = element.as_mut().ok_or_else(unsupported)?;
                    if name == "vertex" {
                        return Err(unsupported());
                    }
                    *lists = true;
                }
                ["property", stored, name] => {
                    let stored = stored_as(stored).ok_or_else(unsupported)?;
                    let (element, _, sizes, _) = element.as_mut().ok_or_else(unsupported)?;
                    *sizes = [sizes[0] + 1, sizes[1] + stored.size() as u64];
                    if element == "vertex" && found.is_none() {
                        let column = column(name);
                        if column.is_some() && properties.iter().any(|known: &Property| known.column == column) {
                            return Err(unsupported());
                        }
                        properties.push(Property { stored, column });
                    }
                }
                ["end_header"] => break,
                _ => return Err(unsupported()),
            }
        }
        if let Some((name, count, ..)) = element
            && name == "vertex"
        {
            found = found.or(Some(count));
        }
        let missing =
            |what: &str| VolumeError::Unsupported { found: format!("a header without {what}"), accepted: ACCEPTED };
        let coding = coding.ok_or_else(|| missing("`format`"))?;
        let count = found.ok_or_else(|| missing("`element vertex`"))?;
        Ok(Self { coding, before, count, properties, length: at })
    }
}

/// A scalar type, by its old or its new name.
fn stored_as(name: &str) -> Option<Stored> {
    Some(match name {
        "char" | "int8" => Stored::I8,
        "uchar" | "uint8" => Stored::U8,
        "short" | "int16" => Stored::I16,
        "ushort" | "uint16" => Stored::U16,
        "int" | "int32" => Stored::I32,
        "uint" | "uint32" => Stored::U32,
        "float" | "float32" => Stored::F32,
        "double" | "float64" => Stored::F64,
        _ => return None,
    })
}
