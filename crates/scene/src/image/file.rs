//! Image files: read by content, written by extension, whole or not at all.

use std::io::Write as _;
use std::path::Path;

use super::{Image, ImageError, Picture, exr, png, tonemap};

/// Writes `bytes` to `path` so that a reader sees either the whole file or what stood there before: a temporary file in
/// the same directory is written, flushed to the disk, then renamed.
///
/// # Errors
/// [`ImageError::Io`] with the path if any step fails (full disk, missing directory, ...); `path` is then untouched and
/// the temporary file removed.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let write = || -> std::io::Result<()> {
        let directory = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".tyndall-");
        // The umask applies: as readable as any other new file, not private like a temporary one.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut file = builder.tempfile_in(directory)?;
        file.write_all(bytes)?;
        file.as_file().sync_all()?;
        file.persist(path)?;
        Ok(())
    };
    write().map_err(|source| ImageError::Io { path: path.display().to_string(), source })
}

impl Image {
    /// Reads an EXR file.
    ///
    /// # Errors
    /// [`ImageError::Io`], or [`ImageError::InFile`] with what [`exr::decode`] reports.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        in_file(path, exr::decode(&read_bytes(path)?))
    }

    /// Writes to `path` by its extension: `.exr` holds the linear image with its statistics and attributes; `.png`
    /// shows it after `exposure` [EV, used for PNG only] and [`tonemap::agx`].
    ///
    /// # Errors
    /// [`ImageError::UnknownExtension`] for any other extension, what the encoder reports, and [`ImageError::Io`].
    pub fn write(&self, path: &Path, exposure: f32) -> Result<(), ImageError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        let encoded = match extension.as_str() {
            "exr" => exr::encode(self),
            "png" => self.check().and_then(|()| png::encode(&tonemap::display(self, exposure))),
            _ => {
                let found = if extension.is_empty() { extension } else { format!(".{extension}") };
                return Err(ImageError::UnknownExtension { path: path.display().to_string(), found });
            }
        };
        write_atomically(path, &in_file(path, encoded)?)
    }
}

impl Picture {
    /// Reads an EXR or PNG file; which of the two, its first bytes say.
    ///
    /// # Errors
    /// [`ImageError::Io`], or [`ImageError::InFile`] with what [`Picture::decode`] reports.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        in_file(path, Self::decode(&read_bytes(path)?))
    }
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, ImageError> {
    std::fs::read(path).map_err(|source| ImageError::Io { path: path.display().to_string(), source })
}

fn in_file<T>(path: &Path, result: Result<T, ImageError>) -> Result<T, ImageError> {
    result.map_err(|error| ImageError::InFile { path: path.display().to_string(), source: Box::new(error) })
}

#[cfg(test)]
mod test {
    use super::*;

    fn image() -> Image {
        Image { width: 2, height: 1, pixels: vec![[0.18; 3], [1.0, 0.5, 20.0]], ..Image::default() }
    }

    #[test]
    fn the_extension_chooses_the_format() {
        let directory = tempfile::tempdir().unwrap();
        let (linear, display) = (directory.path().join("a.exr"), directory.path().join("a.PNG"));
        image().write(&linear, 3.0).unwrap();
        image().write(&display, 1.0).unwrap();
        assert_eq!(Picture::read(&linear).unwrap(), Picture::Linear(image()));
        assert_eq!(Image::read(&linear).unwrap(), image());
        let Picture::Display(shown) = Picture::read(&display).unwrap() else { panic!("a PNG is display-referred") };
        let expected = tonemap::display(&image(), 1.0);
        for (a, b) in shown.pixels.iter().flatten().zip(expected.pixels.iter().flatten()) {
            assert!((a - b).abs() <= 0.5 / 255.0 + 1e-6);
        }
        assert!(matches!(Image::read(&display), Err(ImageError::InFile { .. })));
    }

    #[test]
    fn other_extensions_are_refused_by_name() {
        for (name, found) in [("out.jpg", ".jpg"), ("out", "")] {
            let error = image().write(Path::new(name), 0.0).unwrap_err();
            assert!(matches!(&error, ImageError::UnknownExtension { found: f, .. } if f == found));
            assert!(error.to_string().contains(".exr") && error.to_string().contains(".png"));
        }
    }

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let directory = tempfile::tempdir().unwrap();
        let missing = directory.path().join("no/such/a.exr");
        assert!(image().write(&missing, 0.0).unwrap_err().to_string().contains("no/such/a.exr"));
        // A directory stands where the file should go, so the last step, the rename, fails.
        let taken = directory.path().join("taken.exr");
        std::fs::create_dir(&taken).unwrap();
        assert!(matches!(image().write(&taken, 0.0), Err(ImageError::Io { .. })));
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1, "a temporary file was left");
        // What cannot be encoded does not reach the disk.
        let kept = directory.path().join("kept.exr");
        std::fs::write(&kept, b"before").unwrap();
        assert!(Image::default().write(&kept, 0.0).is_err());
        assert_eq!(std::fs::read(&kept).unwrap(), b"before");
    }

    #[test]
    fn an_existing_file_is_replaced() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.bin");
        write_atomically(&path, b"a longer first version").unwrap();
        write_atomically(&path, b"second").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
    }

    #[cfg(unix)]
    #[test]
    fn files_are_as_readable_as_others() {
        use std::os::unix::fs::PermissionsExt as _;
        let directory = tempfile::tempdir().unwrap();
        let (ours, plain) = (directory.path().join("ours"), directory.path().join("plain"));
        write_atomically(&ours, b"x").unwrap();
        std::fs::write(&plain, b"x").unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}
