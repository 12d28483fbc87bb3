//! A scene with its assets in memory: what the renderers read.

mod load;

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

use glam::{DVec3, Mat4, Vec3};

use crate::description::{Coefficients, Light, Medium, Optics, Plane, Scene};
use crate::field::{Expression, Noise, Sphere};
use crate::particles::{Here, Particles};
use crate::phase::PhaseFunction;
use crate::strands::Strands;
use crate::surface::{Surface, SurfaceError, TextureError};
use crate::volume::{Grid, Mesh, VolumeError};
use crate::{Color, EnvironmentError, EnvironmentMap, FieldError, Temperature, document};

/// A loaded scene.
#[derive(Clone, Debug, Default)]
pub struct World {
    /// The description it was loaded from.
    pub scene: Scene,
    /// The media, in the order of their names.
    pub volumes: Vec<Volume>,
    /// The surfaces, in the order of their names.
    pub surfaces: Vec<Surface>,
    /// Every light by its name, those of files included; of an environment map only that there is one.
    pub lights: BTreeMap<String, Light>,
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
    /// Where it scatters light to, ready to be evaluated.
    pub phase: PhaseFunction,
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
        let (value, tint) = match self.field.bodies_at(point.as_dvec3()) {
            Some(here) => (here.density as f32, Some(here.color.as_vec3())),
            None => (self.field.within(unit)?, self.color.as_ref().map(|color| color.at(point))),
        };
        if !self.clip.iter().all(|plane| plane.keeps(point)) {
            return None;
        }
        let mut here = self.optics.at(value);
        if let Some(tint) = tint {
            let scattered = here.sigma_s * tint;
            here.sigma_a += here.sigma_s - scattered;
            here.sigma_s = scattered;
        }
        if let Some(temperature) = &self.temperature {
            here.emission += here.sigma_a * temperature.radiance(point);
        }
        Some(here)
    }

    /// Puts particles or strands in place of those it has: the next picture of an animation, as the medium's transform
    /// [moved](Particles::moved) them.
    pub fn set_bodies(&mut self, field: Field) {
        self.world_from_unit = field.world_from_unit();
        self.unit_from_world = self.world_from_unit.as_dmat4().inverse().as_mat4();
        self.field = field;
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
    /// A ball that touches the cube's faces.
    Sphere(Sphere),
    /// Fractal noise above a threshold.
    Noise(Noise),
    /// A formula of the position.
    Expression(Arc<Expression>),
    /// Voxels: voxel (i,j,k) of n has its centre at ((i,j,k) + ½)/n.
    Grid(Arc<Grid>),
    /// Tetrahedra; outside of them there is no medium.
    Mesh(Arc<Mesh>),
    /// Soft balls in the world, over the box around them.
    Particles(Arc<Particles>),
    /// Fibres in the world, over the box around them.
    Strands(Arc<Strands>),
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
            Field::Sphere(sphere) => Some(sphere.value(unit)),
            Field::Noise(noise) => Some(noise.value(unit)),
            Field::Expression(expression) => Some(expression.value(unit)),
            Field::Grid(grid) => Some(grid.trilinear(unit)),
            Field::Mesh(mesh) => mesh.value(unit),
            Field::Particles(_) | Field::Strands(_) => {
                let [low, high] = self.bodies_box();
                Some(self.bodies_at((low + unit * (high - low)).as_dvec3())?.density as f32)
            }
        }
    }

    /// What bodies (particles or strands) are at a point of the world [m]; `None` of a field that is not made of bodies.
    pub fn bodies_at(&self, point: DVec3) -> Option<Here> {
        match self {
            Field::Particles(particles) => Some(particles.at(point)),
            Field::Strands(strands) => Some(strands.at(point)),
            _ => None,
        }
    }

    /// The box around all bodies [m], a little wider than they need; a box about the origin where there are none.
    fn bodies_box(&self) -> [Vec3; 2] {
        let bounds = match self {
            Field::Particles(particles) => particles.bounds(),
            Field::Strands(strands) => strands.bounds(),
            _ => None,
        };
        bounds.map_or([Vec3::splat(-0.5), Vec3::splat(0.5)], |[low, high]| {
            // The map of the box to the unit cube is rounded.
            let margin = 1e-5 * (high - low) + 1e-6 * low.abs().max(high.abs());
            [low - margin, high + margin]
        })
    }

    /// The map from the unit cube to the world of a field that is made of bodies.
    fn world_from_unit(&self) -> Mat4 {
        let [low, high] = self.bodies_box();
        Mat4::from_translation(low) * Mat4::from_scale(high - low)
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
    /// A file of surfaces is not what it should be.
    #[error("{path}: {file:?}: {source}")]
    Surface {
        /// The field that names the asset.
        path: String,
        /// The file.
        file: String,
        /// What is wrong with it.
        source: SurfaceError,
    },
    /// A texture is not what it should be.
    #[error("{path}: {file:?}: {source}")]
    Texture {
        /// The field that names the asset.
        path: String,
        /// The file.
        file: String,
        /// What is wrong with it.
        source: TextureError,
    },
    /// A medium's or surface's transforms overflow or cannot be inverted.
    #[error("{path}: {SINGULAR}")]
    Singular {
        /// The transform.
        path: String,
    },
}

const SINGULAR: &str = "found a map to the world that 32-bit numbers do not hold or that has no inverse; \
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
            LoadError::Surface { file, source, .. } => format!("{file:?}: {source}"),
            LoadError::Texture { file, source, .. } => format!("{file:?}: {source}"),
            LoadError::Singular { .. } => SINGULAR.into(),
        };
        let (LoadError::Field(FieldError { path, .. })
        | LoadError::Asset { path, .. }
        | LoadError::Volume { path, .. }
        | LoadError::Environment { path, .. }
        | LoadError::Surface { path, .. }
        | LoadError::Texture { path, .. }
        | LoadError::Singular { path }) = self;
        document.at(path, &message)
    }
}

impl World {
    /// Changes what a medium does to light, here and in the description. The hash becomes another.
    ///
    /// # Errors
    /// A medium that is not there, and optics that a scene file could not have; nothing is changed then.
    pub fn set_optics(&mut self, medium: &str, optics: Optics) -> Result<(), FieldError> {
        let volume = self.volumes.iter_mut().find(|volume| volume.name == medium);
        let (Some(volume), Some(described)) = (volume, self.scene.media.get(medium)) else {
            let names: Vec<_> = self.scene.media.keys().map(String::as_str).collect();
            return Err(FieldError {
                path: format!("media.{medium}"),
                found: "no such medium".into(),
                accepted: if names.is_empty() { "nothing: there are no media".into() } else { names.join(", ") },
            });
        };
        let changed = Medium { optics, ..described.clone() };
        let mut scene = self.scene.clone();
        scene.media.insert(medium.into(), changed.clone());
        scene.check()?;
        volume.phase =
            PhaseFunction::new(&changed.optics.phase(), &format!("media.{medium}.optics.coefficients.phase"))?;
        let text = serde_json::to_string(&changed).expect("a medium has only string keys");
        self.hash = blake3::hash(format!("{} {medium} {text}", self.hash).as_bytes()).to_hex().to_string();
        volume.optics = changed.optics;
        self.scene = scene;
        Ok(())
    }
}
