//! A scene with its assets in memory: what the renderers read.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

use glam::{Mat4, Vec3};

use crate::assets::Assets;
use crate::description::{Clip, Coefficients, Density, Medium, Optics, Plane, Scene, TemperatureGrid};
use crate::volume::{Budget, Grid, Mesh, VolumeError, read_nifti, read_vdb, read_vti, read_vtu, vdb_grid_names};
use crate::{Color, FieldError, PlacedGrid, Temperature, document};

/// A loaded scene.
#[derive(Clone, Debug)]
pub struct World {
    /// The description it was loaded from.
    pub scene: Scene,
    /// The media, in the order of their names.
    pub volumes: Vec<Volume>,
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
    /// In the world; the medium is where every one of them keeps it. At most [`Clip::MAX_PLANES`].
    pub clip: Vec<Plane>,
    /// How hot it is; what it emits is on top of that of `optics`.
    pub temperature: Option<Temperature>,
    /// The colour of what it scatters.
    pub color: Option<Color>,
}

impl Volume {
    /// What the medium does to light at a point [m]; `None` outside its box and where it is cut away.
    pub fn coefficients(&self, point: Vec3) -> Option<Coefficients> {
        let unit = self.unit_from_world.transform_point3(point);
        // Outside there is no medium, whatever a transfer function says of the value 0.
        let value = self.field.within(unit)?;
        if !self.clip.iter().all(|plane| plane.keeps(point)) {
            return None;
        }
        let mut here = self.optics.at(value);
        if let Some(color) = &self.color {
            let scattered = here.sigma_s * color.at(point);
            here.sigma_a += here.sigma_s - scattered;
            here.sigma_s = scattered;
        }
        if let Some(temperature) = &self.temperature {
            here.emission += here.sigma_a * temperature.radiance(point);
        }
        Some(here)
    }
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
    /// Tetrahedra; outside of them there is no medium.
    Mesh(Arc<Mesh>),
}

impl Field {
    /// The field at a position in the unit cube, trilinear between voxel centres and constant beyond the outermost; 0
    /// where there is no medium.
    pub fn value(&self, unit: Vec3) -> f32 {
        self.within(unit).unwrap_or(0.0)
    }

    /// As [`value`](Self::value), but `None` where there is no medium: a transfer function may make something of a 0.
    pub fn within(&self, unit: Vec3) -> Option<f32> {
        if unit.cmplt(Vec3::ZERO).any() || unit.cmpgt(Vec3::ONE).any() {
            return None;
        }
        match self {
            Field::Homogeneous => Some(1.0),
            Field::Exponential { base, scale } => Some((-(unit.y - base) / scale).exp()),
            Field::Grid(grid) => Some(grid.trilinear(unit)),
            Field::Mesh(mesh) => mesh.value(unit),
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
            LoadError::Singular { .. } => SINGULAR.into(),
        };
        let (LoadError::Field(FieldError { path, .. })
        | LoadError::Asset { path, .. }
        | LoadError::Volume { path, .. }
        | LoadError::Singular { path }) = self;
        document.at(path, &message)
    }
}

impl World {
    /// Loads a scene's assets; voxels may take at most `budget` in all.
    ///
    /// # Errors
    /// A scene that contradicts itself, and assets that are missing, corrupt or too large.
    pub fn load(scene: Scene, assets: &dyn Assets, budget: Budget) -> Result<Self, LoadError> {
        scene.check()?;
        let mut hasher = blake3::Hasher::new();
        let depicted = Scene { techniques: BTreeMap::new(), ..scene.clone() };
        hasher.update(serde_json::to_string(&depicted).expect("a scene has only string keys").as_bytes());
        let mut loader = Loader { assets, left: budget, hasher, grids: BTreeMap::new(), meshes: BTreeMap::new() };
        let mut volumes = Vec::new();
        for (name, medium) in &scene.media {
            let (field, local_from_unit) = loader.field(name, &medium.density)?;
            let world_from_unit = medium.transform.matrix() * local_from_unit;
            let unit_from_world = inverse(name, world_from_unit)?;
            let optics = medium.optics.clone();
            let temperature = loader.temperature(name, medium)?;
            let color = loader.color(name, medium)?;
            let clip = medium.clip.as_ref().map(Clip::planes).unwrap_or_default();
            let name = name.clone();
            volumes.push(Volume { name, field, unit_from_world, world_from_unit, optics, clip, temperature, color });
        }
        let hash = loader.hasher.finalize().to_hex().to_string();
        Ok(Self { scene, volumes, hash })
    }
}

/// The inverse of a medium's map to the world.
fn inverse(medium: &str, world_from_unit: Mat4) -> Result<Mat4, LoadError> {
    // In double precision a medium of a micrometre has an inverse, too.
    let unit_from_world = world_from_unit.as_dmat4().inverse().as_mat4();
    if !unit_from_world.is_finite() || !world_from_unit.is_finite() {
        return Err(LoadError::Singular { path: format!("media.{medium}.transform") });
    }
    Ok(unit_from_world)
}

struct Loader<'a> {
    assets: &'a dyn Assets,
    left: Budget,
    hasher: blake3::Hasher,
    grids: BTreeMap<(String, Option<String>), Arc<Grid>>,
    meshes: BTreeMap<(String, Option<String>), Arc<Mesh>>,
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
                let path = format!("media.{medium}.density.grid");
                let grid = self.grid(&path, "name", file, name)?;
                let map = grid.world_from_unit();
                (Field::Grid(grid), map)
            }
            Density::Mesh { file, name } => {
                let mesh = self.mesh(medium, file, name)?;
                let map = mesh.world_from_unit();
                (Field::Mesh(mesh), map)
            }
        })
    }

    fn temperature(&mut self, name: &str, medium: &Medium) -> Result<Option<Temperature>, LoadError> {
        let Some(temperature) = &medium.temperature else { return Ok(None) };
        let path = format!("media.{name}.temperature");
        let grid = self.grid(&path, "name", &temperature.file, &temperature.name)?;
        let &TemperatureGrid { kelvin, offset, radiance_scale, .. } = temperature;
        Ok(Some(Temperature { grid: placed(name, medium, grid)?, kelvin, offset, radiance_scale }))
    }

    fn color(&mut self, name: &str, medium: &Medium) -> Result<Option<Color>, LoadError> {
        let Some(color) = &medium.color else { return Ok(None) };
        let path = format!("media.{name}.color");
        let mut channel = |i: usize| {
            let grid = self.grid(&path, &format!("names.{i}"), &color.file, &Some(color.names[i].clone()))?;
            placed(name, medium, grid)
        };
        Ok(Some(Color { grids: [channel(0)?, channel(1)?, channel(2)?] }))
    }

    /// A grid of a file; both may be at fault, by their fields in the table at `path`.
    fn grid(
        &mut self,
        path: &str,
        name_field: &str,
        file: &str,
        name: &Option<String>,
    ) -> Result<Arc<Grid>, LoadError> {
        let key = (file.to_owned(), name.clone());
        if let Some(grid) = self.grids.get(&key) {
            return Ok(grid.clone());
        }
        let (path, name_path) = (format!("{path}.file"), format!("{path}.{name_field}"));
        if let Some(name) = name.as_ref().filter(|_| is_nifti(file)) {
            let accepted = "no name with a NIfTI file, which holds one volume".into();
            return Err(FieldError { path: name_path, found: format!("{name:?}"), accepted }.into());
        }
        let bytes = self.read(&path, file)?;
        let grid = read_grid(file, &bytes, name.as_deref(), self.left)
            .map_err(|source| wrong(&path, &name_path, file, source))?;
        self.left.0 = self.left.0.saturating_sub(grid.bytes());
        let grid = Arc::new(grid);
        self.grids.insert(key, grid.clone());
        Ok(grid)
    }

    fn mesh(&mut self, medium: &str, file: &str, name: &Option<String>) -> Result<Arc<Mesh>, LoadError> {
        let key = (file.to_owned(), name.clone());
        if let Some(mesh) = self.meshes.get(&key) {
            return Ok(mesh.clone());
        }
        let [path, name_path] = ["file", "name"].map(|field| format!("media.{medium}.density.mesh.{field}"));
        let bytes = self.read(&path, file)?;
        let mesh = read_mesh(file, &bytes, name.as_deref(), self.left)
            .map_err(|source| wrong(&path, &name_path, file, source))?;
        self.left.0 = self.left.0.saturating_sub(mesh.bytes());
        let mesh = Arc::new(mesh);
        self.meshes.insert(key, mesh.clone());
        Ok(mesh)
    }

    /// An asset's bytes, which count for the world's hash.
    fn read(&mut self, path: &str, file: &str) -> Result<Cow<'a, [u8]>, LoadError> {
        let bytes = self.assets.read(file, self.left.0).map_err(|source| LoadError::Asset {
            path: path.into(),
            file: file.into(),
            source,
        })?;
        // With its length, so that bytes cannot move from one asset to the next unseen.
        self.hasher.update(&(bytes.len() as u64).to_le_bytes()).update(&bytes);
        Ok(bytes)
    }
}

/// What is wrong with an asset, at the field that names it, or at the one that names a part of it.
fn wrong(path: &str, name_path: &str, file: &str, source: VolumeError) -> LoadError {
    let by_name = matches!(
        source,
        VolumeError::NoSuchGrid { .. }
            | VolumeError::NoGridNamed { .. }
            | VolumeError::NoSuchArray { .. }
            | VolumeError::NoArrayNamed { .. }
    );
    let path = if by_name { name_path } else { path }.into();
    LoadError::Volume { path, file: file.into(), source }
}

/// A grid where a medium's transform puts it.
fn placed(name: &str, medium: &Medium, grid: Arc<Grid>) -> Result<PlacedGrid, LoadError> {
    let unit_from_world = inverse(name, medium.transform.matrix() * grid.world_from_unit())?;
    Ok(PlacedGrid { grid, unit_from_world })
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
    if lower.ends_with(".vti") {
        return read_vti(bytes, name, budget);
    }
    if !lower.ends_with(".vdb") {
        return Err(VolumeError::Unsupported { found: extension(&lower), accepted: ".vdb, .nii, .nii.gz or .vti" });
    }
    match name {
        Some(name) => read_vdb(bytes, name, budget),
        None => match vdb_grid_names(bytes)?.as_slice() {
            [only] => read_vdb(bytes, only, budget),
            available => Err(VolumeError::NoGridNamed { available: available.to_vec() }),
        },
    }
}

/// A mesh from a file's bytes; the file's name tells its format.
fn read_mesh(file: &str, bytes: &[u8], name: Option<&str>, budget: Budget) -> Result<Mesh, VolumeError> {
    let lower = file.to_ascii_lowercase();
    if lower.ends_with(".vtu") {
        return read_vtu(bytes, name, budget);
    }
    Err(VolumeError::Unsupported { found: extension(&lower), accepted: ".vtu" })
}

fn extension(file: &str) -> String {
    file.rsplit_once('.').map_or("no file extension".into(), |(_, extension)| format!("extension .{extension}"))
}
