//! Which loader reads a file of surfaces: its extension tells.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::Mat4;

use super::{Map, Material, SurfaceError, Texture, TriangleMesh, gltf, obj, ply};
use crate::assets::Assets;
use crate::description::{Camera, Light};
use crate::volume::Budget;

/// What a file holds.
#[derive(Debug, Default)]
pub(super) struct Model {
    pub parts: Vec<Part>,
    /// In the file's space, by name.
    pub lights: BTreeMap<String, Light>,
    /// In the file's space, in the file's order.
    pub cameras: Vec<(String, Camera)>,
}

/// Triangles of one material.
#[derive(Debug)]
pub(super) struct Part {
    pub name: String,
    pub mesh: Arc<TriangleMesh>,
    pub file_from_object: Mat4,
    pub material: Arc<Material>,
}

/// What the extension of a file says it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Format {
    Gltf,
    Obj,
    Ply,
}

const EXTENSIONS: [(&str, Format); 4] =
    [(".gltf", Format::Gltf), (".glb", Format::Gltf), (".obj", Format::Obj), (".ply", Format::Ply)];

impl Format {
    /// The format of a file of this name.
    pub fn of(file: &str) -> Option<Self> {
        let lower = file.to_ascii_lowercase();
        EXTENSIONS.iter().find(|(extension, _)| lower.ends_with(extension)).map(|&(_, format)| format)
    }
}

/// What a loader reads from, and what it may use.
pub(super) struct Source<'a> {
    /// The file, by its path as the scene gives it.
    pub file: &'a str,
    /// What messages call the object.
    pub object: &'a str,
    pub assets: &'a dyn Assets,
    /// What is left of the memory for assets.
    pub left: &'a mut Budget,
    /// Every picture that was read, by its name and whether it is sRGB; `None` where it cannot be had.
    pub textures: &'a mut BTreeMap<(String, bool), Option<Map>>,
}

impl Source<'_> {
    /// Reads the file.
    pub fn read(&mut self) -> Result<Model, SurfaceError> {
        let Some(format) = Format::of(self.file) else {
            let lower = self.file.to_ascii_lowercase();
            let found = lower.rsplit_once('.').map_or("no file extension".into(), |(_, e)| format!("extension .{e}"));
            return Err(SurfaceError::Unsupported { found, accepted: ".gltf, .glb, .obj, .ply" });
        };
        let bytes = self.assets.read(self.file, self.left.0)?;
        match format {
            Format::Gltf => gltf::read(self, &bytes),
            Format::Obj => obj::read(self, &bytes),
            Format::Ply => ply::read(self, &bytes),
        }
    }

    /// The path of a file that stands beside this one.
    pub fn beside(&self, name: &str) -> String {
        match self.file.rsplit_once('/') {
            Some((folder, _)) => format!("{folder}/{name}"),
            None => name.into(),
        }
    }

    /// A picture beside the file; where it cannot be had that is warned about, once, and there is none.
    pub fn picture(&mut self, name: &str, srgb: bool, of: &str) -> Option<Map> {
        let file = self.beside(name);
        self.texture((file.clone(), srgb), of, |source| {
            let bytes = source.assets.read(&file, source.left.0).map_err(|error| error.to_string())?;
            Texture::decode(&bytes, srgb, *source.left).map_err(|error| error.to_string())
        })
    }

    /// A picture by its name; what is wrong with it is warned about, with what it is `of`.
    pub fn texture(
        &mut self,
        key: (String, bool),
        of: &str,
        read: impl FnOnce(&mut Self) -> Result<Texture, String>,
    ) -> Option<Map> {
        if let Some(known) = self.textures.get(&key) {
            return known.clone();
        }
        let map = match read(self) {
            Ok(texture) => {
                self.left.0 = self.left.0.saturating_sub(texture.bytes());
                Some(Map::new(texture))
            }
            Err(reason) => {
                let object = self.object;
                tracing::warn!(
                    "{object}: the picture {:?} of {of} is left out, its plain colour stays: {reason}",
                    key.0
                );
                None
            }
        };
        self.textures.insert(key, map.clone());
        map
    }

    /// Takes what a mesh keeps off the budget.
    pub fn keep(&mut self, mesh: TriangleMesh) -> Result<Arc<TriangleMesh>, SurfaceError> {
        super::error::check_budget("its triangles", mesh.bytes(), 1, *self.left)?;
        self.left.0 -= mesh.bytes();
        Ok(Arc::new(mesh))
    }
}
