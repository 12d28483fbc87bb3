//! The XML of a VTK file, and what it says of how arrays are stored.

use std::borrow::Cow;
use std::str::FromStr;

use roxmltree::{Node, ParsingOptions};

use super::blocks::{Codec, Layout};
use crate::volume::VolumeError;

/// Elements and texts of a file, at most; each array takes a few.
const MOST_NODES: u32 = 1 << 16;

/// A parsed file.
pub(super) struct Document<'f> {
    /// The element of the data set, within `VTKFile`.
    pub content: Element<'f>,
    /// How bytes are packed.
    pub layout: Layout,
    /// The bytes of appended arrays, and whether they are in base64.
    pub appended: Option<(&'f [u8], bool)>,
}

/// The file's XML: all of it, or what stands before appended data, which need not be text, and the tags that close it.
pub(super) fn text(bytes: &[u8]) -> Result<Cow<'_, str>, VolumeError> {
    let utf8 = |bytes| std::str::from_utf8(bytes).map_err(|error| not_vtk(format!("it is not UTF-8: {error}")));
    Ok(match appended(bytes) {
        Some((tag, _)) => Cow::Owned(utf8(&bytes[..tag])?.to_owned() + "</AppendedData></VTKFile>"),
        None => Cow::Borrowed(utf8(bytes)?),
    })
}

/// Parses the file's XML.
pub(super) fn parse(text: &str) -> Result<roxmltree::Document<'_>, VolumeError> {
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..Default::default() };
    roxmltree::Document::parse_with_options(text, options).map_err(|error| not_vtk(error.to_string()))
}

/// Where the tag that opens appended data ends, and where the data begins, after an underscore.
fn appended(bytes: &[u8]) -> Option<(usize, usize)> {
    const TAG: &[u8] = b"<AppendedData";
    let tag = bytes.windows(TAG.len()).position(|window| window == TAG)?;
    let end = tag + bytes[tag..].iter().position(|&byte| byte == b'>')? + 1;
    let start = end + bytes[end..].iter().position(|byte| !byte.is_ascii_whitespace())?;
    (bytes[start] == b'_').then_some((end, start + 1))
}

impl<'f> Document<'f> {
    /// The data set of a kind, and how its arrays are stored.
    pub fn new(bytes: &'f [u8], xml: &'f roxmltree::Document<'f>, kind: &'static str) -> Result<Self, VolumeError> {
        let file = Element(xml.root_element());
        if file.name() != "VTKFile" {
            return Err(not_vtk(format!("its root is <{}>, not <VTKFile>", file.name())));
        }
        let big_endian = match file.attribute("byte_order") {
            None | Some("LittleEndian") => false,
            Some("BigEndian") => true,
            Some(other) => return Err(unsupported("byte_order", other, "LittleEndian or BigEndian")),
        };
        let wide = match file.attribute("header_type") {
            None | Some("UInt32") => false,
            Some("UInt64") => true,
            Some(other) => return Err(unsupported("header_type", other, "UInt32 or UInt64")),
        };
        let codec = match file.attribute("compressor") {
            None | Some("") => None,
            Some("vtkZLibDataCompressor") => Some(Codec::Zlib),
            Some("vtkLZ4DataCompressor") => Some(Codec::Lz4),
            Some(other) => {
                return Err(unsupported("compressor", other, "vtkZLibDataCompressor, vtkLZ4DataCompressor or none"));
            }
        };
        let found = file.attribute("type").unwrap_or("no type").to_owned();
        if found != kind {
            let accepted = if kind == "ImageData" { "ImageData in a .vti" } else { "UnstructuredGrid in a .vtu" };
            return Err(VolumeError::Unsupported { found: format!("a VTK file of {found:?}"), accepted });
        }
        let base64 = match file.child("AppendedData") {
            Ok(element) => match element.attribute("encoding") {
                Some("base64") | None => true,
                Some("raw") => false,
                Some(other) => return Err(unsupported("encoding", other, "raw or base64")),
            },
            Err(_) => false,
        };
        let appended = appended(bytes).map(|(_, start)| (&bytes[start..], base64));
        Ok(Self { content: file.child(kind)?, layout: Layout { big_endian, wide, codec }, appended })
    }

    /// The data set's only piece.
    pub fn piece(&self) -> Result<Element<'f>, VolumeError> {
        match self.content.children("Piece").count() {
            1 => self.content.child("Piece"),
            count => Err(VolumeError::Unsupported {
                found: format!("{count} pieces"),
                accepted: "one piece; merge several into one",
            }),
        }
    }
}

/// An element of the file.
#[derive(Clone, Copy)]
pub(super) struct Element<'f>(Node<'f, 'f>);

impl<'f> Element<'f> {
    /// Its tag.
    pub fn name(self) -> &'f str {
        self.0.tag_name().name()
    }

    /// An attribute.
    pub fn attribute(self, name: &str) -> Option<&'f str> {
        self.0.attribute(name)
    }

    /// Its first text that is not blank.
    pub fn text(self) -> &'f str {
        let mut texts = self.0.children().filter_map(|child| child.text().filter(|_| child.is_text()));
        texts.find(|text| !text.trim().is_empty()).unwrap_or_default()
    }

    /// The elements of a tag within it.
    pub fn children(self, name: &'static str) -> impl Iterator<Item = Element<'f>> {
        self.0.children().filter(move |child| child.has_tag_name(name)).map(Element)
    }

    /// The first element of a tag within it.
    pub fn child(self, name: &'static str) -> Result<Element<'f>, VolumeError> {
        let found = self.children(name).next();
        found.ok_or_else(|| VolumeError::corrupt(format!("<{}> has no <{name}>", self.name())))
    }

    /// An attribute that is a number.
    pub fn number<T: FromStr>(self, name: &str) -> Result<T, VolumeError> {
        let [number] = self.numbers(name)?;
        Ok(number)
    }

    /// An attribute that is several numbers.
    pub fn numbers<T: FromStr, const N: usize>(self, name: &str) -> Result<[T; N], VolumeError> {
        let text = self.attribute(name).unwrap_or_default();
        let numbers: Vec<T> = text.split_ascii_whitespace().map_while(|word| word.parse().ok()).collect();
        let found = || {
            let shown: String = text.chars().take(80).collect();
            VolumeError::corrupt(format!("{name} of <{}> is {shown:?}; it must be {N} numbers", self.name()))
        };
        if text.split_ascii_whitespace().count() != N {
            return Err(found());
        }
        numbers.try_into().map_err(|_| found())
    }

    /// As [`numbers`](Self::numbers), of an attribute that may be left out.
    pub fn numbers_or<const N: usize>(self, name: &str, default: [f64; N]) -> Result<[f64; N], VolumeError> {
        if self.attribute(name).is_some() { self.numbers(name) } else { Ok(default) }
    }
}

fn not_vtk(found: String) -> VolumeError {
    VolumeError::NotVtk { found }
}

fn unsupported(what: &str, found: &str, accepted: &'static str) -> VolumeError {
    let shown: String = found.chars().take(80).collect();
    VolumeError::Unsupported { found: format!("{what} {shown:?}"), accepted }
}
