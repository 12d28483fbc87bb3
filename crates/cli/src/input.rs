//! A scene from the command line: file, overrides, assets.

use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use tyndall_scene::assets::Directory;
use tyndall_scene::volume::Budget;
use tyndall_scene::{Document, MAX_TEXT, Scene, SceneError, World};

use crate::failure::Failure;

/// What `render`, `reference` and `probe` are told of the scene.
#[derive(clap::Args)]
pub struct Input {
    /// Scene file (TOML, or JSON if it ends in .json), or a model alone (.gltf, .glb, .obj, .ply)
    pub scene: PathBuf,
    /// Picture size in pixels, in place of film.size
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Set a field of the scene, by its path (repeatable): --set media.plume.optics.coefficients.sigma_s=20
    #[arg(long, value_name = "PATH=VALUE", value_parser = assignment)]
    set: Vec<(String, String)>,
}

impl Input {
    /// Reads, overrides, checks and loads the scene.
    pub fn load(&self) -> Result<World, Failure> {
        let folder = Directory(self.scene.parent().unwrap_or(Path::new("")).into());
        let document = self.document(&folder)?;
        let mut scene = document.parse()?;
        for (path, value) in &self.set {
            let set = scene.set(path, value);
            set.map_err(|error| Failure::Input(anyhow!("--set {path}={value}: {error}")))?;
        }
        if let Some([width, height]) = self.size {
            let set = scene.set("film.size", &format!("[{width}, {height}]"));
            set.map_err(|error| Failure::Input(anyhow!("--size {width}x{height}: {error}")))?;
        }
        self.check_settings(&scene, &document)?;
        let started = std::time::Instant::now();
        let world =
            World::load(scene, &folder, memory_budget()).map_err(|error| self.blame(error.locate(&document)))?;
        tracing::info!(volumes = world.volumes.len(), surfaces = world.surfaces.len(), hash = &world.hash[..16], time = ?started.elapsed(), "loaded");
        Ok(world)
    }

    /// The scene's text; of a model alone, the scene that it is.
    fn document(&self, folder: &Directory) -> Result<Document, Failure> {
        let name = self.scene.file_name().unwrap_or_default().to_string_lossy();
        if Document::is_model(&name) {
            return Ok(Document::model(&name, folder));
        }
        Ok(Document::from_bytes(self.scene.display().to_string(), self.read()?)?)
    }

    /// The scene file's bytes, and no more of them than a scene may have.
    fn read(&self) -> Result<Vec<u8>, Failure> {
        let mut bytes = Vec::new();
        File::open(&self.scene)
            .and_then(|file| file.take(MAX_TEXT as u64 + 1).read_to_end(&mut bytes))
            .with_context(|| format!("cannot read the scene {}", self.scene.display()))
            .map_err(Failure::Input)?;
        Ok(bytes)
    }

    /// Holds technique settings against what the techniques declare, so that an error knows its line.
    fn check_settings(&self, scene: &Scene, document: &Document) -> Result<(), Failure> {
        match tyndall::techniques::chosen(scene) {
            Ok(_) => Ok(()),
            Err(tyndall::RenderError::Setting(error)) => Err(self.blame(document.locate(&error))),
            Err(tyndall::RenderError::NoSuchTechnique { found, accepted }) => {
                let path = format!("techniques.{found}");
                Err(self.blame(document.at(&path, &format!("found technique {found:?}; accepted: {accepted}"))))
            }
            Err(other) => Err(other.into()),
        }
    }

    /// An error as one of the command line, where that and not the file gave the value at fault.
    fn blame(&self, error: SceneError) -> Failure {
        let within =
            |inner: &str, outer: &str| inner.strip_prefix(outer).is_some_and(|r| r.is_empty() || r.starts_with('.'));
        let set = self.set.iter().rev().find(|(path, _)| within(path, &error.path) || within(&error.path, path));
        match set {
            Some((path, value)) => Failure::Input(anyhow!("--set {path}={value}: {}: {}", error.path, error.message)),
            None => error.into(),
        }
    }
}

/// What voxels may take: half of the memory that is free now, so that a copy for the device fits beside them
/// (4 GiB where the system does not say).
pub fn memory_budget() -> Budget {
    let free = sysinfo::System::new().map(|mut system| {
        system.refresh_memory();
        system.available_memory()
    });
    match free {
        Ok(free) if free > 0 => Budget(free / 2),
        _ => Budget(4 << 30),
    }
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once(['x', 'X']).map(|(w, h)| (w.parse(), h.parse()));
    match sides {
        Some((Ok(width), Ok(height))) => Ok([width, height]),
        _ => Err("accepted: WIDTHxHEIGHT in pixels, such as 1280x720".into()),
    }
}

fn assignment(text: &str) -> Result<(String, String), String> {
    let (path, value) = text.split_once('=').ok_or("accepted: PATH=VALUE, such as film.exposure=1.5")?;
    Ok((path.trim().into(), value.trim().into()))
}

/// Where a picture goes: refused before any work where nothing could be written there.
pub fn check_output(path: &Path, extensions: &[&str]) -> Result<(), Failure> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    if !extensions.contains(&extension.as_str()) {
        let accepted = extensions.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(" or ");
        return Err(Failure::Input(anyhow!("output {}: accepted: a name that ends in {accepted}", path.display())));
    }
    if path.is_dir() {
        return Err(Failure::Input(anyhow!("output {}: there is a folder of that name", path.display())));
    }
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(Failure::Input(anyhow!("output {}: there is no folder {}", path.display(), folder.display())));
    }
    Ok(())
}
