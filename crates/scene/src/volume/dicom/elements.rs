//! The data elements of a DICOM file.
//!
//! Source of the format: DICOM PS3.5, chapter 7 and annex A, and PS3.10, chapter 7.

use crate::volume::VolumeError;

const PREAMBLE: usize = 128;
const MAGIC: &[u8] = b"DICM";
const TRANSFER_SYNTAX: u32 = 0x0002_0010;
/// The length of what ends with a delimiter.
const UNDEFINED: u32 = u32::MAX;
const ITEM_DELIMITER: u32 = 0xfffe_e00d;
const SEQUENCE_DELIMITER: u32 = 0xfffe_e0dd;
/// The value representations whose length has 32 bits; that of others has 16.
const LONG: [&[u8]; 13] = [b"OB", b"OD", b"OF", b"OL", b"OV", b"OW", b"SQ", b"SV", b"UC", b"UN", b"UR", b"UT", b"UV"];

/// Whether the bytes are a DICOM file.
pub fn is_dicom(bytes: &[u8]) -> bool {
    bytes.get(PREAMBLE..).is_some_and(|rest| rest.starts_with(MAGIC))
}

/// Calls `visit` with the tag, value and place \[byte\] of every element of the file, not with those within sequences.
///
/// Errors: [`VolumeError::Truncated`]; [`VolumeError::Unsupported`] for compressed or big-endian files; those of
/// `visit`.
pub fn visit<'a>(
    bytes: &'a [u8],
    mut visit: impl FnMut(u32, &'a [u8], usize) -> Result<(), VolumeError>,
) -> Result<(), VolumeError> {
    let mut elements = Elements { bytes, at: PREAMBLE + MAGIC.len(), explicit: true };
    // The first group, whose length need not be believed, is always explicit.
    let mut explicit = None;
    while bytes.get(elements.at..).is_some_and(|rest| rest.starts_with(&[2, 0])) {
        let (tag, value, _) = elements.next()?;
        if tag == TRANSFER_SYNTAX {
            explicit = Some(is_explicit(value)?);
        }
    }
    elements.explicit = explicit.ok_or_else(|| VolumeError::corrupt("it has no TransferSyntaxUID"))?;
    while elements.at < bytes.len() {
        let (tag, value, at) = elements.next()?;
        visit(tag, value, at)?;
    }
    Ok(())
}

/// Whether elements say how their values are represented.
fn is_explicit(transfer_syntax: &[u8]) -> Result<bool, VolumeError> {
    match transfer_syntax.trim_ascii_end().strip_suffix(b"\0").unwrap_or(transfer_syntax) {
        b"1.2.840.10008.1.2" => Ok(false),
        b"1.2.840.10008.1.2.1" => Ok(true),
        other => Err(VolumeError::Unsupported {
            found: format!("the transfer syntax {}", other.escape_ascii()),
            accepted: "1.2.840.10008.1.2 and 1.2.840.10008.1.2.1: not compressed, little-endian",
        }),
    }
}

struct Elements<'a> {
    bytes: &'a [u8],
    at: usize,
    explicit: bool,
}

impl<'a> Elements<'a> {
    /// The next element; of one with undefined length the value is empty, and what is within is passed over.
    fn next(&mut self) -> Result<(u32, &'a [u8], usize), VolumeError> {
        let (tag, length, implicit) = self.header()?;
        let at = self.at;
        if length != UNDEFINED {
            return Ok((tag, self.take(length as usize)?, at));
        }
        let explicit = self.explicit;
        self.explicit &= !implicit;
        let mut depth = 1;
        while depth > 0 {
            match self.header()? {
                (ITEM_DELIMITER | SEQUENCE_DELIMITER, _, _) => depth -= 1,
                (_, UNDEFINED, _) => depth += 1,
                (_, length, _) => drop(self.take(length as usize)?),
            }
        }
        self.explicit = explicit;
        Ok((tag, &[], at))
    }

    /// Tag and length of what comes next, and whether what is within has no representations: so it is within unknown
    /// elements. [PS3.5, 6.2.2]
    fn header(&mut self) -> Result<(u32, u32, bool), VolumeError> {
        let [a, b, c, d] = self.array()?;
        let tag = u32::from(u16::from_le_bytes([a, b])) << 16 | u32::from(u16::from_le_bytes([c, d]));
        if !self.explicit || tag >> 16 == 0xfffe {
            return Ok((tag, u32::from_le_bytes(self.array()?), false));
        }
        let [v, r, a, b] = self.array()?;
        if !LONG.contains(&[v, r].as_slice()) {
            return Ok((tag, u16::from_le_bytes([a, b]).into(), false));
        }
        Ok((tag, u32::from_le_bytes(self.array()?), [v, r] == *b"UN"))
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], VolumeError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], VolumeError> {
        let rest = self.bytes.get(self.at..).and_then(|rest| rest.get(..count));
        self.at += rest.map_or(0, <[u8]>::len);
        rest.ok_or(VolumeError::Truncated { what: "a data element", at: self.bytes.len() as u64 })
    }
}
