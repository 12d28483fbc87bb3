//! The bytes of a glTF file: its JSON, and its buffers.

use std::borrow::Cow;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use gltf::Document;
use gltf::buffer::{Source as Place, View};

use super::super::SurfaceError;
use super::super::file::Source;

/// The JSON text and, in a `.glb`, the binary chunk.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), SurfaceError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let ended = || SurfaceError::corrupt("it ends within its chunks");
    let word = |at: usize| bytes.get(at..at + 4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    match word(4).ok_or_else(ended)? {
        2 => {}
        version => {
            let found = format!("binary glTF of version {version}");
            return Err(SurfaceError::Unsupported { found, accepted: "version 2" });
        }
    }
    if word(8).ok_or_else(ended)? as usize > bytes.len() {
        return Err(ended());
    }
    let chunk = |at: usize| {
        let (length, kind) = (word(at)? as usize, word(at + 4)?);
        let body = bytes.get(at + 8..(at + 8).checked_add(length)?)?;
        Some((kind, body))
    };
    let Some((0x4e4f_534a, text)) = chunk(12) else {
        return Err(SurfaceError::corrupt("its first chunk is no JSON that ends within the file"));
    };
    let after = 12 + 8 + text.len();
    if after + 8 > bytes.len() {
        return Ok((text, None));
    }
    match chunk(after).ok_or_else(ended)? {
        (0x004e_4942, blob) => Ok((text, Some(blob))),
        _ => Ok((text, None)),
    }
}

/// Every buffer of a document.
pub(super) struct Buffers(Vec<Vec<u8>>);

impl Buffers {
    /// Reads the buffers, from the file itself, from URIs of data, or from files beside it.
    pub fn read(source: &Source, document: &Document, blob: Option<&[u8]>) -> Result<Self, SurfaceError> {
        let mut buffers = Vec::new();
        let mut left = source.left.0;
        for buffer in document.buffers() {
            let bytes = match buffer.source() {
                Place::Bin => match blob {
                    Some(blob) => blob.to_vec(),
                    None => {
                        return Err(SurfaceError::corrupt(format!(
                            "buffer {} is of a .glb's second chunk, which is not there",
                            buffer.index()
                        )));
                    }
                },
                Place::Uri(uri) => self::bytes(source, uri, left)?,
            };
            left = left.checked_sub(bytes.len() as u64).ok_or(SurfaceError::TooLarge {
                what: "its buffers",
                bytes: bytes.len() as u64,
                budget: left,
            })?;
            buffers.push(bytes);
        }
        Ok(Self(buffers))
    }

    /// The bytes of a view.
    pub fn view(&self, view: &View) -> Result<&[u8], SurfaceError> {
        let buffer = &self.0[view.buffer().index()];
        let end = view.offset().checked_add(view.length());
        end.and_then(|end| buffer.get(view.offset()..end)).ok_or_else(|| {
            let (from, length, bytes) = (view.offset(), view.length(), buffer.len());
            SurfaceError::corrupt(format!("view {} has {length} bytes from {from} on of {bytes}", view.index()))
        })
    }
}

/// The bytes that a URI stands for, at most `limit`.
pub(super) fn bytes(source: &Source, uri: &str, limit: u64) -> Result<Vec<u8>, SurfaceError> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, data) = data.split_once(',').unwrap_or(("", ""));
        if !kind.ends_with(";base64") {
            return Err(SurfaceError::corrupt("data that is not base64"));
        }
        super::super::error::check_budget("its data", data.len() as u64, 1, crate::volume::Budget(limit))?;
        return STANDARD
            .decode(data)
            .map_err(|error| SurfaceError::corrupt(format!("data that is not base64: {error}")));
    }
    let file = source.beside(&decoded(uri));
    let read = source.assets.read(&file, limit).map(Cow::into_owned);
    read.map_err(|error| SurfaceError::Part { file, reason: error.to_string() })
}

/// A relative URI as the path of a file: %20 is a space.
pub(super) fn decoded(uri: &str) -> String {
    let mut path = Vec::new();
    let mut rest = uri.as_bytes();
    while let [byte, ahead @ ..] = rest {
        let code = ahead.get(..2).filter(|_| *byte == b'%').and_then(|hex| std::str::from_utf8(hex).ok());
        match code.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(code) => {
                path.push(code);
                rest = &ahead[2..];
            }
            None => {
                path.push(*byte);
                rest = ahead;
            }
        }
    }
    String::from_utf8(path).unwrap_or_else(|_| uri.into())
}
