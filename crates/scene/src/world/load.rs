//! A world out of a scene and its assets.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Mat4, Vec3};

use super::{Field, LoadError, Volume, World};
use crate::assets::{Assets, Hashed};
use crate::description::{Camera, Clip, Density, Light, Medium, Optics, Raw, Scene, TemperatureGrid};
use crate::field::{Expression, Formula, Fractal, Noise, Sphere};
use crate::particles::{Emission, FARTHEST, Particles, read_particles};
use crate::phase::PhaseFunction;
use crate::strands::{Strands, grow, read_strands};
use crate::surface::{self, Surface};
use crate::volume::{Budget, FileError, Grid, Mesh, VolumeError, read_grid, read_mesh};
use crate::{Color, EnvironmentMap, FieldError, PlacedGrid, Temperature};

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
        let mut loader = Loader { assets, left: budget, hasher, grids: Vec::new(), meshes: Vec::new() };
        let mut volumes = Vec::new();
        for (name, medium) in &scene.media {
            let (field, world_from_unit) = loader.field(name, medium)?;
            let unit_from_world = inverse(name, world_from_unit)?;
            let optics = medium.optics.clone();
            let temperature = loader.temperature(name, medium)?;
            let color = loader.color(name, medium)?;
            let clip = medium.clip.as_ref().map(Clip::planes).unwrap_or_default();
            let phase = PhaseFunction::new(&optics.phase(), &format!("media.{name}.optics.coefficients.phase"))?;
            let name = name.clone();
            volumes.push(Volume {
                name,
                field,
                unit_from_world,
                world_from_unit,
                optics,
                phase,
                clip,
                temperature,
                color,
            });
        }
        let assets = Hashed::new(loader.assets, &mut loader.hasher);
        let surface::Loaded { surfaces, mut lights, camera } = surface::load(&scene, &assets, &mut loader.left)?;
        surfaces.iter().try_for_each(within_reach)?;
        lights.extend(scene.lights.clone());
        let mut scene = scene;
        if scene.camera.is_none() {
            scene.camera = match camera {
                Some(camera) => camera,
                None => framing(&scene, &surfaces, &volumes)?,
            };
        }
        let environment = loader.environment(&scene)?;
        let hash = loader.hasher.finalize().to_hex().to_string();
        let world = Self { scene, volumes, surfaces, lights, environment, hash };
        if is_dark(&world) {
            tracing::warn!("lights: there are none, and nothing emits: the picture is black");
        }
        Ok(world)
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

/// Refuses a surface so far away that single precision has no depths for it.
fn within_reach(surface: &Surface) -> Result<(), FieldError> {
    let out = |corner: &Vec3| !(corner.is_finite() && corner.abs().max_element() <= FARTHEST);
    match surface.bounds().into_iter().flatten().find(out) {
        None => Ok(()),
        Some(corner) => Err(FieldError {
            path: format!("surfaces.{}", surface.name),
            found: format!("a corner at {:?}", corner.to_array()),
            accepted: "at most 1e9 m from the origin".into(),
        }),
    }
}

/// Whether there is what scatters or reflects light, and nothing that gives any.
fn is_dark(world: &World) -> bool {
    let scatters = |volume: &Volume| match &volume.optics {
        Optics::Coefficients { sigma_s, .. } => *sigma_s != Vec3::ZERO,
        Optics::Transfer(_) => false,
    };
    let glows = |volume: &Volume| match &volume.optics {
        Optics::Coefficients { emission, .. } => *emission != Vec3::ZERO || volume.temperature.is_some(),
        Optics::Transfer(_) => true,
    };
    let waits = !world.surfaces.is_empty() || world.volumes.iter().any(scatters);
    let emits = world.surfaces.iter().any(|surface| surface.material.emission != Vec3::ZERO);
    waits && world.lights.is_empty() && !emits && !world.volumes.iter().any(glows)
}

/// A camera that sees every surface and medium.
fn framing(scene: &Scene, surfaces: &[Surface], volumes: &[Volume]) -> Result<Camera, FieldError> {
    let corners = (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32));
    let points = |volume: &Volume| {
        let map = volume.world_from_unit;
        corners.clone().map(move |corner| [map.transform_point3(corner); 2])
    };
    let boxes = surfaces.iter().filter_map(Surface::bounds).chain(volumes.iter().flat_map(points));
    let all = boxes.reduce(|[a, b], [low, high]| [a.min(low), b.max(high)]);
    all.and_then(|bounds| Camera::framing(bounds, scene.film.size)).ok_or_else(|| FieldError {
        path: "camera".into(),
        found: "no `camera`, and nothing that one can be put before".into(),
        accepted: "a camera, or surfaces or media of some size".into(),
    })
}

struct Loader<'a> {
    assets: &'a dyn Assets,
    left: Budget,
    hasher: blake3::Hasher,
    /// What was read already, with what says so.
    grids: Vec<(Source, Arc<Grid>)>,
    meshes: Vec<(Density, Arc<Mesh>)>,
}

/// Where a grid comes from.
#[derive(PartialEq)]
struct Source {
    file: String,
    name: Option<String>,
    raw: Option<Raw>,
}

impl Loader<'_> {
    /// A medium's density as a field over the unit cube, and the map from that cube to the world.
    fn field(&mut self, name: &str, medium: &Medium) -> Result<(Field, Mat4), LoadError> {
        let world = medium.transform.matrix();
        let box_map = |min: &Vec3, max: &Vec3| world * Mat4::from_translation(*min) * Mat4::from_scale(max - min);
        Ok(match &medium.density {
            Density::Homogeneous { min, max } => (Field::Homogeneous, box_map(min, max)),
            Density::Exponential { min, max, base, scale_height } => {
                let height = max.y - min.y;
                let field = Field::Exponential { base: (base - min.y) / height, scale: scale_height / height };
                (field, box_map(min, max))
            }
            Density::Sphere { center, radius, falloff } => {
                let field = Field::Sphere(Sphere { falloff: falloff / radius });
                (field, box_map(&(center - radius), &(center + radius)))
            }
            Density::Noise { min, max, scale, octaves, gain, lacunarity, threshold, seed } => {
                let fractal = Fractal { octaves: *octaves, gain: *gain, lacunarity: *lacunarity, seed: *seed };
                let (origin, extent) = (min / scale, (max - min) / scale);
                (Field::Noise(Noise { fractal, threshold: *threshold, origin, extent }), box_map(min, max))
            }
            Density::Expression { min, max, wgsl, highest } => {
                let formula = Formula::parse(wgsl).map_err(|error| error.of(name))?;
                let field = Expression { formula, min: *min, size: max - min, highest: *highest };
                (Field::Expression(Arc::new(field)), box_map(min, max))
            }
            Density::Grid { file, name: of, raw } => {
                let source = Source { file: file.clone(), name: of.clone(), raw: raw.clone() };
                let grid = self.grid(source, &format!("media.{name}.density.grid"), "name")?;
                let map = world * grid.world_from_unit();
                (Field::Grid(grid), map)
            }
            density @ Density::Mesh { file, name: of } => {
                let mesh = match self.meshes.iter().find(|(known, _)| known == density) {
                    Some((_, mesh)) => mesh.clone(),
                    None => {
                        let assets = Hashed::new(self.assets, &mut self.hasher);
                        let mesh = read_mesh(file, of.as_deref(), &assets, self.left)
                            .map_err(|error| wrong(&format!("media.{name}.density.mesh"), "name", file, error))?;
                        self.left.0 = self.left.0.saturating_sub(mesh.bytes());
                        let mesh = Arc::new(mesh);
                        self.meshes.push((density.clone(), mesh.clone()));
                        mesh
                    }
                };
                let map = world * mesh.world_from_unit();
                (Field::Mesh(mesh), map)
            }
            Density::Particles(given) => {
                let assets = Hashed::new(self.assets, &mut self.hasher);
                let particles = read_particles(&given.file, given, &assets, self.left)
                    .map_err(|error| wrong(&format!("media.{name}.density.particles"), "name", &given.file, error))?;
                self.particles(name, medium, particles)?
            }
            Density::Emitter(emitter) => {
                let emission = Emission::new(emitter, self.left);
                let particles = emission.and_then(|mut emission| emission.at(emitter.time.into()));
                self.particles(
                    name,
                    medium,
                    particles.map_err(|error| unmade(format!("media.{name}.density.emitter"), &error))?,
                )?
            }
            Density::Strands(given) => {
                let assets = Hashed::new(self.assets, &mut self.hasher);
                let strands = read_strands(&given.file, given, &assets, self.left)
                    .map_err(|error| wrong(&format!("media.{name}.density.strands"), "name", &given.file, error))?;
                self.strands(name, medium, strands)?
            }
            Density::Head(head) => {
                let strands =
                    grow(head, self.left).map_err(|error| unmade(format!("media.{name}.density.head"), &error))?;
                self.strands(name, medium, strands)?
            }
        })
    }

    /// Particles where a medium's transform puts them.
    fn particles(&mut self, name: &str, medium: &Medium, particles: Particles) -> Result<(Field, Mat4), LoadError> {
        let particles =
            particles.moved(&medium.transform).map_err(|error| unmade(format!("media.{name}.transform"), &error))?;
        if particles.list().is_empty() {
            tracing::warn!("media.{name}: there are no particles");
        }
        self.left.0 = self.left.0.saturating_sub(Particles::BYTES * particles.list().len() as u64);
        let field = Field::Particles(Arc::new(particles));
        let map = field.world_from_unit();
        Ok((field, map))
    }

    /// The same of strands.
    fn strands(&mut self, name: &str, medium: &Medium, strands: Strands) -> Result<(Field, Mat4), LoadError> {
        let strands =
            strands.moved(&medium.transform).map_err(|error| unmade(format!("media.{name}.transform"), &error))?;
        if strands.count() == 0 {
            tracing::warn!("media.{name}: there are no strands");
        }
        self.left.0 = self.left.0.saturating_sub(Strands::BYTES * strands.knots().len() as u64);
        let field = Field::Strands(Arc::new(strands));
        let map = field.world_from_unit();
        Ok((field, map))
    }

    fn temperature(&mut self, name: &str, medium: &Medium) -> Result<Option<Temperature>, LoadError> {
        let Some(temperature) = &medium.temperature else { return Ok(None) };
        let source = Source { file: temperature.file.clone(), name: temperature.name.clone(), raw: None };
        let grid = self.grid(source, &format!("media.{name}.temperature"), "name")?;
        let &TemperatureGrid { kelvin, offset, radiance_scale, .. } = temperature;
        Ok(Some(Temperature { grid: placed(name, medium, grid)?, kelvin, offset, radiance_scale }))
    }

    fn color(&mut self, name: &str, medium: &Medium) -> Result<Option<Color>, LoadError> {
        let Some(color) = &medium.color else { return Ok(None) };
        let mut channel = |i: usize| {
            let source = Source { file: color.file.clone(), name: Some(color.names[i].clone()), raw: None };
            let grid = self.grid(source, &format!("media.{name}.color"), &format!("names.{i}"))?;
            placed(name, medium, grid)
        };
        Ok(Some(Color { grids: [channel(0)?, channel(1)?, channel(2)?] }))
    }

    /// The environment map, if there is one; [`Scene::check`] allows no second.
    fn environment(&mut self, scene: &Scene) -> Result<Option<Arc<EnvironmentMap>>, LoadError> {
        for (name, light) in &scene.lights {
            let Light::Environment { file, rotate, scale } = light else { continue };
            let (path, file) = (format!("lights.{name}.environment.file"), file.to_owned());
            let assets = Hashed::new(self.assets, &mut self.hasher);
            let bytes = match assets.read(&file, self.left.0) {
                Ok(bytes) => bytes,
                Err(source) => return Err(LoadError::Asset { path, file, source }),
            };
            let map = EnvironmentMap::decode(&bytes, *rotate, *scale, self.left)
                .map_err(|source| LoadError::Environment { path, file, source })?;
            self.left.0 = self.left.0.saturating_sub(size_of_val(map.pixels.as_slice()) as u64);
            return Ok(Some(Arc::new(map)));
        }
        Ok(None)
    }

    /// A grid of a file that the table at `path` names, where `name_field` names one of several.
    fn grid(&mut self, source: Source, path: &str, name_field: &str) -> Result<Arc<Grid>, LoadError> {
        if let Some((_, grid)) = self.grids.iter().find(|(known, _)| *known == source) {
            return Ok(grid.clone());
        }
        let assets = Hashed::new(self.assets, &mut self.hasher);
        let grid = read_grid(&source.file, source.name.as_deref(), source.raw.as_ref(), &assets, self.left)
            .map_err(|error| wrong(path, name_field, &source.file, error))?;
        self.left.0 = self.left.0.saturating_sub(grid.bytes());
        let grid = Arc::new(grid);
        self.grids.push((source, grid.clone()));
        Ok(grid)
    }
}

/// What is wrong with bodies that no file says, but a scene's numbers: those of the table at `path`, or how many there are to be.
fn unmade(path: String, error: &VolumeError) -> LoadError {
    LoadError::Field(match error {
        VolumeError::Corrupt { what } => {
            let (found, accepted) = what.split_once("; accepted: ").unwrap_or((what, "other numbers"));
            FieldError { path, found: found.into(), accepted: accepted.into() }
        }
        other => {
            FieldError { path: path + ".number", found: other.to_string(), accepted: "as many as memory holds".into() }
        }
    })
}

/// A grid where a medium's transform puts it.
fn placed(name: &str, medium: &Medium, grid: Arc<Grid>) -> Result<PlacedGrid, LoadError> {
    let unit_from_world = inverse(name, medium.transform.matrix() * grid.world_from_unit())?;
    Ok(PlacedGrid { grid, unit_from_world })
}

/// What is wrong with the file of the density at `path`, at the field it is about.
fn wrong(path: &str, name_field: &str, file: &str, error: FileError) -> LoadError {
    use VolumeError::{NoArrayNamed, NoGridNamed, NoSuchArray, NoSuchGrid, WhichSeries, WrongLength};
    let field = match error {
        FileError::Volume(
            NoSuchGrid { .. } | NoGridNamed { .. } | NoSuchArray { .. } | NoArrayNamed { .. } | WhichSeries { .. },
        ) => name_field,
        FileError::Volume(WrongLength { .. }) => "raw",
        _ => "file",
    };
    let (path, file) = (format!("{path}.{field}"), file.to_owned());
    match error {
        FileError::Read(source) => LoadError::Asset { path, file, source },
        FileError::Volume(source) => LoadError::Volume { path, file, source },
    }
}
