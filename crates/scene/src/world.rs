//! A scene with its assets in memory: what the renderers read.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

use glam::{Mat4, Vec3};

use crate::assets::Assets;
use crate::description::{Density, Light, Optics, Scene};
use crate::volume::{Budget, Grid, VolumeError, read_nifti, read_vdb, vdb_grid_names};
use crate::{EnvironmentError, EnvironmentMap, FieldError, document};

/// A loaded scene.
#[derive(Clone, Debug)]
pub struct World {
    /// The description it was loaded from.
    pub scene: Scene,
    /// The media, in the order of their names.
    pub volumes: Vec<Volume>,
    /// The environment map; what light there is from a constant environment comes on top.
    pub environment: Option<Arc<EnvironmentMap>>,
    /// BLAKE3 of the description and of every asset's bytes, in hexadecimal: two worlds of one hash are one world. How
    /// techniques are to render it does not count.
    pub hash: String,
}

/// A medium in the world: a field over the unit cube, a map into it, and its optics.
#[derive(Clone, Debug)]
pub struct Volume {
    /// The medium's name in the scene.
    pub name: String,
    /// The density over the unit cube.
    pub field: Field,
    /// Maps world positions [m] to the unit cube; affine and invertible.
    pub unit_from_world: Mat4,
    /// The inverse of `unit_from_world`.
    pub world_from_unit: Mat4,
    /// What the medium does to light.
    pub optics: Optics,
}

/// A scalar field over the unit cube [0,1]³, 0 outside it.
#[derive(Clone, Debug)]
pub enum Field {
    /// 1.
    Homogeneous,
    /// exp(−(y − base)/scale), with y, `base` and `scale` in unit-cube lengths.
    Exponential {
        /// The height at which the field is 1.
        base: f32,
        /// The height over which it falls by e.
        scale: f32,
    },
    /// Voxels: voxel (i,j,k) of n has its centre at ((i,j,k) + ½)/n.
    Grid(Arc<Grid>),
}

impl Field {
    /// The field at a position in the unit cube, trilinear between voxel centres and constant beyond the outermost.
    pub fn value(&self, unit: Vec3) -> f32 {
        if unit.cmplt(Vec3::ZERO).any() || unit.cmpgt(Vec3::ONE).any() {
            return 0.0;
        }
        match self {
            Field::Homogeneous => 1.0,
            Field::Exponential { base, scale } => (-(unit.y - base) / scale).exp(),
            Field::Grid(grid) => grid.trilinear(unit),
        }
    }
}

/// Why a scene's world cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The description contradicts itself.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// An asset cannot be read.
    #[error("{path}: cannot read {file:?}: {source}")]
    Asset {
        /// The field that names the asset.
        path: String,
        /// The file.
        file: String,
        /// Why.
        source: io::Error,
    },
    /// An asset is not what it should be.
    #[error("{path}: {file:?}: {source}")]
    Volume {
        /// The field that names the asset.
        path: String,
        /// The file.
        file: String,
        /// What is wrong with it.
        source: VolumeError,
    },
    /// An environment map is not what it should be.
    #[error("{path}: {file:?}: {source}")]
    Environment {
        /// The field that names the asset.
        path: String,
        /// The file.
        file: String,
        /// What is wrong with it.
        source: EnvironmentError,
    },
    /// A medium's transforms overflow or cannot be inverted.
    #[error("{path}: {SINGULAR}")]
    Singular {
        /// The medium's transform.
        path: String,
    },
}

const SINGULAR: &str = "found a map from the medium to the world that 32-bit numbers do not hold or that has no inverse; \
                        accepted: a scale and a box that are neither too large nor too small together";

impl LoadError {
    /// The error at its place in the scene's text.
    pub fn locate(&self, document: &document::Document) -> document::SceneError {
        let message = match self {
            LoadError::Field(error) => return document.locate(error),
            LoadError::Asset { file, source, .. } => {
                let hint = match source.kind() {
                    io::ErrorKind::NotFound => "; accepted: a path relative to the scene file",
                    _ => "",
                };
                format!("cannot read {file:?}: {source}{hint}")
            }
            LoadError::Volume { file, source, .. } => format!("{file:?}: {source}"),
            LoadError::Environment { file, source, .. } => format!("{file:?}: {source}"),
            LoadError::Singular { .. } => SINGULAR.into(),
        };
        let (LoadError::Field(FieldError { path, .. })
        | LoadError::Asset { path, .. }
        | LoadError::Volume { path, .. }
        | LoadError::Environment { path, .. }
        | LoadError::Singular { path }) = self;
        document.at(path, &message)
    }
}

impl World {
    /// Loads a scene's assets; voxels and pixels may take at most `budget` in all.
    ///
    /// # Errors
    /// A scene that contradicts itself, and assets that are missing, corrupt or too large.
    pub fn load(scene: Scene, assets: &dyn Assets, budget: Budget) -> Result<Self, LoadError> {
        scene.check()?;
        let mut hasher = blake3::Hasher::new();
        let depicted = Scene { techniques: BTreeMap::new(), ..scene.clone() };
        hasher.update(serde_json::to_string(&depicted).expect("a scene has only string keys").as_bytes());
        let mut loader = Loader { assets, left: budget, hasher, grids: BTreeMap::new() };
        let mut volumes = Vec::new();
        for (name, medium) in &scene.media {
            let (field, local_from_unit) = loader.field(name, &medium.density)?;
            let world_from_unit = medium.transform.matrix() * local_from_unit;
            // In double precision a medium of a micrometre has an inverse, too.
            let unit_from_world = world_from_unit.as_dmat4().inverse().as_mat4();
            if !unit_from_world.is_finite() || !world_from_unit.is_finite() {
                return Err(LoadError::Singular { path: format!("media.{name}.transform") });
            }
            let optics = medium.optics.clone();
            volumes.push(Volume { name: name.clone(), field, unit_from_world, world_from_unit, optics });
        }
        let environment = loader.environment(&scene)?;
        let hash = loader.hasher.finalize().to_hex().to_string();
        Ok(Self { scene, volumes, environment, hash })
    }
}

struct Loader<'a> {
    assets: &'a dyn Assets,
    left: Budget,
    hasher: blake3::Hasher,
    grids: BTreeMap<(String, Option<String>), Arc<Grid>>,
}

impl<'a> Loader<'a> {
    /// A density as a field over the unit cube, and the map from that cube to the medium's space.
    fn field(&mut self, medium: &str, density: &Density) -> Result<(Field, Mat4), LoadError> {
        let box_map = |min: &Vec3, max: &Vec3| Mat4::from_translation(*min) * Mat4::from_scale(max - min);
        Ok(match density {
            Density::Homogeneous { min, max } => (Field::Homogeneous, box_map(min, max)),
            Density::Exponential { min, max, base, scale_height } => {
                let height = max.y - min.y;
                let field = Field::Exponential { base: (base - min.y) / height, scale: scale_height / height };
                (field, box_map(min, max))
            }
            Density::Grid { file, name } => {
                let grid = self.grid(medium, file, name)?;
                let map = grid.world_from_unit();
                (Field::Grid(grid), map)
            }
        })
    }

    fn grid(&mut self, medium: &str, file: &str, name: &Option<String>) -> Result<Arc<Grid>, LoadError> {
        let key = (file.to_owned(), name.clone());
        if let Some(grid) = self.grids.get(&key) {
            return Ok(grid.clone());
        }
        let path = format!("media.{medium}.density.grid.file");
        if let Some(name) = name.as_ref().filter(|_| is_nifti(file)) {
            let path = format!("media.{medium}.density.grid.name");
            let accepted = "no name with a NIfTI file, which holds one volume".into();
            return Err(FieldError { path, found: format!("{name:?}"), accepted }.into());
        }
        let bytes = self.read(&path, file)?;
        let grid = read_grid(file, &bytes, name.as_deref(), self.left).map_err(|source| {
            let path = match source {
                VolumeError::NoSuchGrid { .. } | VolumeError::NoGridNamed { .. } => {
                    format!("media.{medium}.density.grid.name")
                }
                _ => path,
            };
            LoadError::Volume { path, file: file.into(), source }
        })?;
        self.keep(&bytes, grid.voxels.bytes());
        let grid = Arc::new(grid);
        self.grids.insert(key, grid.clone());
        Ok(grid)
    }

    /// The environment map, if there is one; [`Scene::check`] allows no second.
    fn environment(&mut self, scene: &Scene) -> Result<Option<Arc<EnvironmentMap>>, LoadError> {
        for (name, light) in &scene.lights {
            let Light::Environment { file, rotate, scale } = light else { continue };
            let path = format!("lights.{name}.environment.file");
            let bytes = self.read(&path, file)?;
            let map = EnvironmentMap::decode(&bytes, *rotate, *scale, self.left)
                .map_err(|source| LoadError::Environment { path, file: file.into(), source })?;
            self.keep(&bytes, size_of_val(map.pixels.as_slice()) as u64);
            return Ok(Some(Arc::new(map)));
        }
        Ok(None)
    }

    /// The bytes of an asset that the field at `path` names.
    fn read(&self, path: &str, file: &str) -> Result<Cow<'a, [u8]>, LoadError> {
        let (path, file) = (path.to_owned(), file.to_owned());
        self.assets.read(&file, self.left.0).map_err(|source| LoadError::Asset { path, file, source })
    }

    /// Counts an asset's bytes into the hash, and what was made of them against the budget.
    fn keep(&mut self, bytes: &[u8], memory: u64) {
        // With its length, so that bytes cannot move from one asset to the next unseen.
        self.hasher.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
        self.left.0 = self.left.0.saturating_sub(memory);
    }
}

fn is_nifti(file: &str) -> bool {
    let lower = file.to_ascii_lowercase();
    lower.ends_with(".nii") || lower.ends_with(".nii.gz")
}

/// A grid from a file's bytes; the file's name tells its format. Without a name the file must hold just one grid.
fn read_grid(file: &str, bytes: &[u8], name: Option<&str>, budget: Budget) -> Result<Grid, VolumeError> {
    if is_nifti(file) {
        return read_nifti(bytes, budget);
    }
    let lower = file.to_ascii_lowercase();
    if !lower.ends_with(".vdb") {
        let found = lower.rsplit_once('.').map_or("no file extension".into(), |(_, e)| format!("extension .{e}"));
        return Err(VolumeError::Unsupported { found, accepted: ".vdb, .nii or .nii.gz" });
    }
    match name {
        Some(name) => read_vdb(bytes, name, budget),
        None => match vdb_grid_names(bytes)?.as_slice() {
            [only] => read_vdb(bytes, only, budget),
            available => Err(VolumeError::NoGridNamed { available: available.to_vec() }),
        },
    }
}
