//! Reads little-endian numbers from bytes, and says what was missing where they end.

use crate::volume::VolumeError;

#[derive(Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    pub fn position(&self) -> usize {
        self.at
    }

    /// Errors: [`VolumeError::Truncated`] if `position` lies beyond the bytes.
    pub fn seek(&mut self, position: u64, what: &'static str) -> Result<(), VolumeError> {
        match usize::try_from(position) {
            Ok(at) if at <= self.bytes.len() => {
                self.at = at;
                Ok(())
            }
            _ => Err(self.truncated(what)),
        }
    }

    /// The next `count` bytes.
    ///
    /// Errors: [`VolumeError::Truncated`] if there are fewer.
    pub fn take(&mut self, count: u64, what: &'static str) -> Result<&'a [u8], VolumeError> {
        let rest = &self.bytes[self.at..];
        match usize::try_from(count) {
            Ok(count) if count <= rest.len() => {
                self.at += count;
                Ok(&rest[..count])
            }
            _ => Err(self.truncated(what)),
        }
    }

    fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], VolumeError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N as u64, what)?);
        Ok(array)
    }

    pub fn u8(&mut self, what: &'static str) -> Result<u8, VolumeError> {
        Ok(u8::from_le_bytes(self.array(what)?))
    }

    pub fn u32(&mut self, what: &'static str) -> Result<u32, VolumeError> {
        Ok(u32::from_le_bytes(self.array(what)?))
    }

    pub fn i32(&mut self, what: &'static str) -> Result<i32, VolumeError> {
        Ok(i32::from_le_bytes(self.array(what)?))
    }

    pub fn i64(&mut self, what: &'static str) -> Result<i64, VolumeError> {
        Ok(i64::from_le_bytes(self.array(what)?))
    }

    pub fn u64(&mut self, what: &'static str) -> Result<u64, VolumeError> {
        Ok(u64::from_le_bytes(self.array(what)?))
    }

    pub fn f32(&mut self, what: &'static str) -> Result<f32, VolumeError> {
        Ok(f32::from_le_bytes(self.array(what)?))
    }

    pub fn f64(&mut self, what: &'static str) -> Result<f64, VolumeError> {
        Ok(f64::from_le_bytes(self.array(what)?))
    }

    /// Text after its length (32 bits); what is not UTF-8 is replaced.
    pub fn text(&mut self, what: &'static str) -> Result<String, VolumeError> {
        let length = self.u32(what)?;
        Ok(String::from_utf8_lossy(self.take(length.into(), what)?).into_owned())
    }

    fn truncated(&self, what: &'static str) -> VolumeError {
        VolumeError::Truncated { what, at: self.bytes.len() as u64 }
    }
}
