use glam::{EulerRot, Mat4, Quat, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::phase::Phase;
use super::quantity::{
    ByteCount, Finite, Fraction, Lacunarity, NonNegative, Octaves, Positive, Rgb, Scale, Seed, Vector, VoxelCounts,
};
use super::{BodyFile, Clip, ColorGrids, Emitter, Head, TemperatureGrid, Transfer};
use crate::volume::Stored;

/// A participating medium: a density in space, and what a unit of it does to light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Medium {
    /// Where the medium is, and how dense.
    pub density: Density,
    /// What it does to light.
    pub optics: Optics,
    /// Moves the density's own space into the world.
    #[serde(default)]
    pub transform: Transform,
    /// What is cut away of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clip: Option<Clip>,
    /// How hot it is, so that it glows; with `optics.coefficients`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<TemperatureGrid>,
    /// The colour of what it scatters; with `optics.coefficients`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<ColorGrids>,
}

/// A scalar field within a box; outside the box it is 0. Negative values count as 0 density.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Density {
    /// 1 everywhere in the box.
    Homogeneous {
        /// The box's lowest corner [m].
        #[serde(with = "Vector")]
        min: Vec3,
        /// The box's highest corner [m].
        #[serde(with = "Vector")]
        max: Vec3,
    },
    /// exp(−(y − base)/scale_height): fog that thins with height.
    Exponential {
        /// The box's lowest corner [m].
        #[serde(with = "Vector")]
        min: Vec3,
        /// The box's highest corner [m].
        #[serde(with = "Vector")]
        max: Vec3,
        /// The height y at which the density is 1 [m].
        #[serde(with = "Finite", default)]
        base: f32,
        /// The height over which the density falls by e [m].
        #[serde(with = "Positive")]
        scale_height: f32,
    },
    /// A ball: 1 within, falling to 0 at its surface as 3t² − 2t³, with t = (radius − distance from the centre)/falloff.
    Sphere {
        /// The centre [m].
        #[serde(with = "Vector")]
        center: Vec3,
        /// The radius [m].
        #[serde(with = "Positive")]
        radius: f32,
        /// The length over which the density falls, inside the surface [m]; 0 is a hard edge.
        #[serde(with = "NonNegative", default)]
        falloff: f32,
    },
    /// Fractional Brownian motion: max(0, Σ gain^k · noise(lacunarity^k · p/scale) − threshold), k from 0 to octaves − 1,
    /// of gradient noise, whose standard deviation is 0.19 and which is at most ±1.5 (`docs/fields.md`).
    Noise {
        /// The box's lowest corner [m].
        #[serde(with = "Vector")]
        min: Vec3,
        /// The box's highest corner [m].
        #[serde(with = "Vector")]
        max: Vec3,
        /// The size of the largest features [m].
        #[serde(with = "Positive")]
        scale: f32,
        /// How many sizes of features there are.
        #[serde(with = "Octaves", default = "octaves")]
        octaves: u32,
        /// How strong each is, relative to the next larger.
        #[serde(with = "Fraction", default = "half")]
        gain: f32,
        /// How many times smaller each is than the next larger.
        #[serde(with = "Lacunarity", default = "two")]
        lacunarity: f32,
        /// The sum that counts as no density; 0 leaves half of the box empty, less fills more of it.
        #[serde(with = "Finite", default)]
        threshold: f32,
        /// Which noise it is.
        #[serde(with = "Seed", default)]
        seed: u32,
    },
    /// A formula of the position, clamped to [0, highest]; what is no finite number counts as 0.
    Expression {
        /// The box's lowest corner [m].
        #[serde(with = "Vector")]
        min: Vec3,
        /// The box's highest corner [m].
        #[serde(with = "Vector")]
        max: Vec3,
        /// One WGSL expression of type f32 of `p`, the position in the medium's own space [m], a vec3f: with numbers, bools,
        /// vectors of them, WGSL's functions of these, and `noise(p)` and `fbm(p, octaves)`, whose largest features are 1
        /// m.
        wgsl: String,
        /// The highest density; higher values count as this.
        #[serde(with = "Positive", default = "one")]
        highest: f32,
    },
    /// Voxels from a file, interpolated trilinearly: OpenVDB `.vdb`, NanoVDB `.nvdb`, NIfTI `.nii` or `.nii.gz`, NRRD
    /// `.nrrd` or `.nhdr`, MetaImage `.mha` or `.mhd`, VTK `.vti`, NumPy `.npy`, or without header `.raw`, `.bin`, `.dat`;
    /// or from a folder, a series of DICOM slices. The file's own transform applies, then the medium's. Patients' space is
    /// right-anterior-superior, its millimetres become metres; a VTK file's lengths are taken as metres. A NumPy array is
    /// indexed [z][y][x]; it fills a box around the origin whose longest edge is 1 m.
    Grid {
        /// Path relative to the scene file; that of a folder may end in `/`.
        file: String,
        /// Which grid of a `.vdb` or `.nvdb` file, array of a `.vti` file, or series of a folder (its SeriesInstanceUID);
        /// may be left out where there is only one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// What a file without header (`.raw`, `.bin`, `.dat`) does not say of itself.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        raw: Option<Raw>,
    },
    /// An unstructured mesh from a VTK file (`.vtu`) of tetrahedra, hexahedra, wedges or pyramids: linear in each
    /// tetrahedron, into which the others are divided. Its lengths are taken as metres. Outside of its cells there is no
    /// medium. Rendered by the technique `cells`.
    Mesh {
        /// Path relative to the scene file.
        file: String,
        /// Which array of scalars, on points or cells; may be left out where there is only one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
    },
    /// Soft balls from a file, as a medium whose extinction is per metre and unit of σ_s + σ_a: PLY `.ply`, NumPy `.npz` and
    /// `.npy`, `.csv` (`docs/particles.md`). The transform moves them and scales their radii; it scales all axes alike.
    Particles(BodyFile),
    /// The same from a source of smoke.
    Emitter(Emitter),
    /// Fibres such as hair from a file, as a medium whose extinction is per metre and unit of σ_s + σ_a: `.hair`, or text
    /// `.txt` (`docs/particles.md`). The transform moves them and scales their radii; it scales all axes alike.
    Strands(BodyFile),
    /// The same on a head.
    Head(Head),
}

impl Density {
    /// What the density is called in a file, of one that is made of bodies: particles or strands.
    pub fn bodies(&self) -> Option<&'static str> {
        match self {
            Density::Particles(_) => Some("particles"),
            Density::Emitter(_) => Some("emitter"),
            Density::Strands(_) => Some("strands"),
            Density::Head(_) => Some("head"),
            _ => None,
        }
    }
}

/// Voxels without header, x fastest; the grid is centred at the origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Raw {
    /// Voxels along x, y, z.
    #[serde(with = "VoxelCounts")]
    pub dims: [u32; 3],
    /// How a voxel is stored.
    #[serde(rename = "type")]
    pub sample: Stored,
    /// Distance of voxel centres along x, y, z [m].
    #[serde(with = "Scale")]
    pub spacing: Vec3,
    /// Whether the highest byte of a voxel comes first.
    #[serde(default)]
    pub big_endian: bool,
    /// Bytes before the first voxel.
    #[serde(with = "ByteCount", default)]
    pub offset: u64,
}

/// What a medium does to light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Optics {
    /// Coefficients per unit density.
    Coefficients {
        /// Scattering coefficient σ_s [m⁻¹ per unit density].
        #[serde(with = "Rgb", default)]
        sigma_s: Vec3,
        /// Absorption coefficient σ_a [m⁻¹ per unit density].
        #[serde(with = "Rgb", default)]
        sigma_a: Vec3,
        /// Emitted radiance per length [W·sr⁻¹·m⁻³ per unit density].
        #[serde(with = "Rgb", default)]
        emission: Vec3,
        /// Where scattered light goes.
        #[serde(default)]
        phase: Phase,
    },
    /// A transfer function: the density's value is data (a CT number, a temperature), mapped to colour and opacity.
    Transfer(Transfer),
}

/// What a medium does to light at one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coefficients {
    /// Scattering coefficient σ_s [m⁻¹].
    pub sigma_s: Vec3,
    /// Absorption coefficient σ_a [m⁻¹].
    pub sigma_a: Vec3,
    /// Emitted radiance per length [W·sr⁻¹·m⁻³].
    pub emission: Vec3,
}

impl Coefficients {
    /// Extinction coefficient σ_t = σ_s + σ_a [m⁻¹].
    pub fn sigma_t(&self) -> Vec3 {
        self.sigma_s + self.sigma_a
    }
}

impl Optics {
    /// The coefficients where the density has this value.
    pub fn at(&self, value: f32) -> Coefficients {
        match self {
            Optics::Coefficients { sigma_s, sigma_a, emission, .. } => {
                let density = value.max(0.0);
                Coefficients { sigma_s: sigma_s * density, sigma_a: sigma_a * density, emission: emission * density }
            }
            Optics::Transfer(transfer) => {
                let sigma_a = transfer.sigma_a(value);
                Coefficients {
                    sigma_s: Vec3::ZERO,
                    sigma_a: Vec3::splat(sigma_a),
                    emission: transfer.color(value) * (transfer.radiance * sigma_a),
                }
            }
        }
    }

    /// The phase function; isotropic for a transfer function, which does not scatter.
    pub fn phase(&self) -> Phase {
        match self {
            Optics::Coefficients { phase, .. } => phase.clone(),
            Optics::Transfer(_) => Phase::Isotropic,
        }
    }
}

fn one() -> f32 {
    1.0
}

fn octaves() -> u32 {
    5
}

fn half() -> f32 {
    0.5
}

fn two() -> f32 {
    2.0
}

/// Scale, then rotate, then translate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Transform {
    /// Scale factors.
    #[serde(with = "Scale", default = "ones")]
    pub scale: Vec3,
    /// Rotation about the x, then the y, then the z axis [degrees].
    #[serde(with = "Vector", default)]
    pub rotate: Vec3,
    /// Displacement [m].
    #[serde(with = "Vector", default)]
    pub translate: Vec3,
}

fn ones() -> Vec3 {
    Vec3::ONE
}

impl Default for Transform {
    fn default() -> Self {
        Self { scale: ones(), rotate: Vec3::ZERO, translate: Vec3::ZERO }
    }
}

impl Transform {
    /// The matrix that maps the medium's space to the world.
    pub fn matrix(&self) -> Mat4 {
        let [x, y, z] = self.rotate.to_array().map(f32::to_radians);
        Mat4::from_scale_rotation_translation(self.scale, Quat::from_euler(EulerRot::ZYX, z, y, x), self.translate)
    }
}
