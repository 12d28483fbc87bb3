//! Where a scene's files come from: a folder, or memory.

use std::borrow::Cow;
use std::io;

/// A source of the files that a scene names.
pub trait Assets {
    /// The bytes of a file, by its path as the scene gives it.
    ///
    /// # Errors
    /// Whatever keeps the file from being read.
    fn read(&self, file: &str) -> io::Result<Cow<'_, [u8]>>;
}

/// Files in memory, by name.
#[derive(Clone, Debug, Default)]
pub struct Embedded<'a>(pub Vec<(&'a str, &'a [u8])>);

impl Assets for Embedded<'_> {
    fn read(&self, file: &str) -> io::Result<Cow<'_, [u8]>> {
        let found = self.0.iter().find(|(name, _)| *name == file);
        found
            .map(|(_, bytes)| Cow::Borrowed(*bytes))
            .ok_or_else(|| io::Error::new(io::ErrorKind::NotFound, "no embedded file of that name"))
    }
}

/// Files below a folder.
#[cfg(not(target_arch = "wasm32"))]
#[derive(Clone, Debug)]
pub struct Directory(pub std::path::PathBuf);

#[cfg(not(target_arch = "wasm32"))]
impl Assets for Directory {
    fn read(&self, file: &str) -> io::Result<Cow<'_, [u8]>> {
        std::fs::read(self.0.join(file)).map(Cow::Owned)
    }
}
