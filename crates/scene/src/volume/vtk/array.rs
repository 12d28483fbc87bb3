//! Data arrays: numbers, however they are stored.

use std::io::{BufReader, ErrorKind, Read};
use std::str::SplitAsciiWhitespace;

use super::blocks::{Base64, Layout};
use super::document::{Document, Element};
use crate::volume::VolumeError;

/// An array of a file, unread.
pub(super) struct Array<'f> {
    name: String,
    components: u32,
    scalar: Scalar,
    layout: Layout,
    source: Source<'f>,
}

#[derive(Clone, Copy)]
enum Source<'f> {
    Text(&'f str),
    Base64(&'f [u8]),
    Raw(&'f [u8]),
}

/// The type of an array's numbers.
#[derive(Clone, Copy)]
enum Scalar {
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Float32,
    Float64,
}

impl<'f> Array<'f> {
    pub fn new(document: &Document<'f>, element: Element<'f>) -> Result<Self, VolumeError> {
        let scalar = match element.attribute("type") {
            Some("Int8") => Scalar::Int8,
            Some("UInt8") => Scalar::UInt8,
            Some("Int16") => Scalar::Int16,
            Some("UInt16") => Scalar::UInt16,
            Some("Int32") => Scalar::Int32,
            Some("UInt32") => Scalar::UInt32,
            Some("Int64") => Scalar::Int64,
            Some("UInt64") => Scalar::UInt64,
            Some("Float32") => Scalar::Float32,
            Some("Float64") => Scalar::Float64,
            other => {
                return Err(VolumeError::Unsupported {
                    found: format!("an array of type {:?}", other.unwrap_or_default()),
                    accepted: "Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Float32, Float64",
                });
            }
        };
        let name = element.attribute("Name").unwrap_or_default().to_owned();
        let source = match element.attribute("format") {
            None | Some("ascii") => Source::Text(element.text()),
            Some("binary") => Source::Base64(element.text().as_bytes()),
            Some("appended") => {
                let offset: usize = element.number("offset")?;
                let appended = document.appended.and_then(|(bytes, base64)| Some((bytes.get(offset..)?, base64)));
                match appended {
                    Some((bytes, true)) => Source::Base64(bytes),
                    Some((bytes, false)) => Source::Raw(bytes),
                    None => {
                        let what = format!("the array {name:?} lies at {offset} of appended data that is not there");
                        return Err(VolumeError::corrupt(what));
                    }
                }
            }
            Some(other) => {
                return Err(VolumeError::Unsupported {
                    found: format!("an array of format {other:?}"),
                    accepted: "ascii, binary, appended",
                });
            }
        };
        let components = match element.attribute("NumberOfComponents") {
            Some(_) => element.number("NumberOfComponents")?,
            None => 1,
        };
        Ok(Self { name, components, scalar, layout: document.layout, source })
    }

    /// Errors: another number of components.
    pub fn check_components(&self, expected: u32) -> Result<(), VolumeError> {
        if self.components == expected {
            return Ok(());
        }
        let found = format!("the array {:?} of {} components", self.name, self.components);
        let accepted = if expected == 1 { "scalars: arrays of 1 component" } else { "points of 3 components" };
        Err(VolumeError::Unsupported { found, accepted })
    }

    /// Its numbers, from the first.
    pub fn values(&self) -> Result<Values<'_>, VolumeError> {
        let numbers = match self.source {
            Source::Text(text) => Ok(Numbers::Text(text.split_ascii_whitespace())),
            Source::Base64(text) => self.layout.open(Base64::new(text)).map(Numbers::bytes),
            Source::Raw(bytes) => self.layout.open(bytes).map(Numbers::bytes),
        };
        let mut values = Values { array: self, numbers: Numbers::Text("".split_ascii_whitespace()), count: 0 };
        values.numbers = numbers.map_err(|error| values.failed(&error))?;
        Ok(values)
    }
}

/// The numbers of an array, one after the other.
pub(super) struct Values<'f> {
    array: &'f Array<'f>,
    numbers: Numbers<'f>,
    /// How many have been read.
    count: u64,
}

enum Numbers<'f> {
    Text(SplitAsciiWhitespace<'f>),
    Bytes(BufReader<Box<dyn Read + 'f>>),
}

impl<'f> Numbers<'f> {
    fn bytes(reader: Box<dyn Read + 'f>) -> Self {
        Self::Bytes(BufReader::new(reader))
    }
}

impl Values<'_> {
    /// The next number, rounded to double precision.
    pub fn next(&mut self) -> Result<f64, VolumeError> {
        let number = match &mut self.numbers {
            Numbers::Text(words) => match words.next() {
                None => Err(ErrorKind::UnexpectedEof.into()),
                Some(word) => word.parse().map_err(|_| {
                    let shown: String = word.chars().take(40).collect();
                    std::io::Error::new(ErrorKind::InvalidData, format!("{shown:?} is no number"))
                }),
            },
            Numbers::Bytes(bytes) => self.array.scalar.read(bytes, self.array.layout.big_endian),
        };
        self.count += 1;
        number.map_err(|error| self.failed(&error))
    }

    /// The next number, which must be whole.
    pub fn next_index(&mut self) -> Result<u64, VolumeError> {
        // The largest f64 below 2⁶⁴ is an index of nothing, too.
        let number = self.next()?;
        if number >= 0.0 && number.fract() == 0.0 {
            return Ok(number as u64);
        }
        let what = format!("number {} of the array {:?} is {number}; it must be an index", self.count, self.array.name);
        Err(VolumeError::corrupt(what))
    }

    fn failed(&self, error: &std::io::Error) -> VolumeError {
        let (name, count) = (&self.array.name, self.count);
        VolumeError::corrupt(match error.kind() {
            ErrorKind::UnexpectedEof => format!("the array {name:?} ends at number {count}; it must have more"),
            _ => format!("the array {name:?}, at number {count}: {error}"),
        })
    }
}

impl Scalar {
    fn read(self, bytes: &mut impl Read, big_endian: bool) -> std::io::Result<f64> {
        Ok(match self {
            Self::Int8 => f64::from(i8::from_le_bytes(take(bytes, big_endian)?)),
            Self::UInt8 => f64::from(u8::from_le_bytes(take(bytes, big_endian)?)),
            Self::Int16 => f64::from(i16::from_le_bytes(take(bytes, big_endian)?)),
            Self::UInt16 => f64::from(u16::from_le_bytes(take(bytes, big_endian)?)),
            Self::Int32 => f64::from(i32::from_le_bytes(take(bytes, big_endian)?)),
            Self::UInt32 => f64::from(u32::from_le_bytes(take(bytes, big_endian)?)),
            Self::Int64 => i64::from_le_bytes(take(bytes, big_endian)?) as f64,
            Self::UInt64 => u64::from_le_bytes(take(bytes, big_endian)?) as f64,
            Self::Float32 => f64::from(f32::from_le_bytes(take(bytes, big_endian)?)),
            Self::Float64 => f64::from_le_bytes(take(bytes, big_endian)?),
        })
    }
}

/// The next bytes, the lowest first.
fn take<const N: usize>(bytes: &mut impl Read, big_endian: bool) -> std::io::Result<[u8; N]> {
    let mut taken = [0; N];
    bytes.read_exact(&mut taken)?;
    if big_endian {
        taken.reverse();
    }
    Ok(taken)
}
