//! Where a scene's files come from: a folder, or memory.

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::io;

/// A source of the files that a scene names.
pub trait Assets {
    /// The bytes of a file, by its path as the scene gives it; at most `limit` of them.
    ///
    /// # Errors
    /// Whatever keeps the file from being read, and a longer file, which is not read at all.
    fn read(&self, file: &str, limit: u64) -> io::Result<Cow<'_, [u8]>>;

    /// The files in a folder, but not in folders within it: their paths as the scene would give them, in order.
    ///
    /// # Errors
    /// Whatever keeps the folder from being read; that there is none.
    fn list(&self, folder: &str) -> io::Result<Vec<String>>;
}

/// Assets that enter a hash as they are read: each file once, with its length, so that bytes cannot move from one to
/// the next unseen.
pub(crate) struct Hashed<'a> {
    assets: &'a dyn Assets,
    hasher: RefCell<&'a mut blake3::Hasher>,
    seen: RefCell<BTreeSet<String>>,
}

impl<'a> Hashed<'a> {
    pub fn new(assets: &'a dyn Assets, hasher: &'a mut blake3::Hasher) -> Self {
        Self { assets, hasher: RefCell::new(hasher), seen: RefCell::default() }
    }
}

impl Assets for Hashed<'_> {
    fn read(&self, file: &str, limit: u64) -> io::Result<Cow<'_, [u8]>> {
        let bytes = self.assets.read(file, limit)?;
        if self.seen.borrow_mut().insert(file.to_owned()) {
            self.hasher.borrow_mut().update(&(bytes.len() as u64).to_le_bytes()).update(&bytes);
        }
        Ok(bytes)
    }

    fn list(&self, folder: &str) -> io::Result<Vec<String>> {
        self.assets.list(folder)
    }
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

    fn list(&self, folder: &str) -> io::Result<Vec<String>> {
        let prefix = format!("{}/", folder.trim_end_matches('/'));
        let within = |name: &str| name.strip_prefix(&prefix).is_some_and(|rest| !rest.contains('/'));
        let mut files: Vec<_> =
            self.0.iter().filter(|(name, _)| within(name)).map(|(name, _)| name.to_string()).collect();
        if files.is_empty() {
            return Err(io::Error::new(io::ErrorKind::NotFound, "no embedded file in a folder of that name"));
        }
        files.sort();
        Ok(files)
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

    fn list(&self, folder: &str) -> io::Result<Vec<String>> {
        let mut files = Vec::new();
        for entry in std::fs::read_dir(self.0.join(folder))? {
            let entry = entry?;
            // Through links, too. A name that is no Unicode cannot stand in a scene.
            if let (true, Ok(name)) = (entry.path().is_file(), entry.file_name().into_string()) {
                files.push(format!("{}/{name}", folder.trim_end_matches('/')));
            }
        }
        files.sort();
        Ok(files)
    }
}

fn check_length(length: u64, limit: u64) -> io::Result<()> {
    if length <= limit {
        return Ok(());
    }
    let message = format!("it has {length} bytes or more; with the memory there is, at most {limit} are read");
    Err(io::Error::new(io::ErrorKind::FileTooLarge, message))
}
