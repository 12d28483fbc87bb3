//! Where a scene's files come from: a folder, or memory.

use std::borrow::Cow;
use std::io;

/// A source of the files that a scene names.
pub trait Assets {
    /// The bytes of a file, by its path as the scene gives it; at most `limit` of them.
    ///
    /// # Errors
    /// Whatever keeps the file from being read, and a longer file, which is not read at all.
    fn read(&self, file: &str, limit: u64) -> io::Result<Cow<'_, [u8]>>;
}

/// Files in memory, by name.
#[derive(Clone, Debug, Default)]
pub struct Embedded<'a>(pub Vec<(&'a str, &'a [u8])>);

impl Assets for Embedded<'_> {
    fn read(&self, file: &str, limit: u64) -> io::Result<Cow<'_, [u8]>> {
        let found = self.0.iter().find(|(name, _)| *name == file);
        let (_, bytes) =
            found.ok_or_else(|| io::Error::new(io::ErrorKind::NotFound, "no embedded file of that name"))?;
        check_length(bytes.len() as u64, limit)?;
        Ok(Cow::Borrowed(bytes))
    }
}

/// Files below a folder.
#[cfg(not(target_arch = "wasm32"))]
#[derive(Clone, Debug)]
pub struct Directory(pub std::path::PathBuf);

#[cfg(not(target_arch = "wasm32"))]
impl Assets for Directory {
    fn read(&self, file: &str, limit: u64) -> io::Result<Cow<'_, [u8]>> {
        use io::Read as _;
        let file = std::fs::File::open(self.0.join(file))?;
        let length = file.metadata()?.len();
        check_length(length, limit)?;
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX))?;
        // A device file has no length of its own.
        file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
        check_length(bytes.len() as u64, limit)?;
        Ok(Cow::Owned(bytes))
    }
}

fn check_length(length: u64, limit: u64) -> io::Result<()> {
    if length <= limit {
        return Ok(());
    }
    let message = format!("it has {length} bytes or more; with the memory there is, at most {limit} are read");
    Err(io::Error::new(io::ErrorKind::FileTooLarge, message))
}
