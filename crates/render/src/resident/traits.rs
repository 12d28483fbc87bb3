//! What pipelines are specialised for.

use tyndall_scene::description::Optics;
use tyndall_scene::field::MAX_OCTAVES;
use tyndall_scene::phase::PhaseFunction;
use tyndall_scene::volume::BRICK_CELLS;
use tyndall_scene::{Field, Volume};

use super::bodies::is_bodies;
use super::volume::{diagonal, voxel};

/// What the volumes of a world make use of, so that shaders can be specialised for it.
#[derive(Clone, Debug)]
pub struct Traits {
    /// How many volumes there are that rays are marched through: all but those that are made of bodies.
    pub count: u32,
    /// Some have voxels.
    pub grids: bool,
    /// Some thin out exponentially.
    pub exponentials: bool,
    /// Some are balls, noise or expressions.
    pub spheres: bool,
    /// See `spheres`.
    pub noises: bool,
    /// See `spheres`.
    pub expressions: bool,
    /// Some have transfer functions.
    pub transfers: bool,
    /// Some are shaded by their gradients.
    pub shaded: bool,
    /// Some show isosurfaces.
    pub surfaces: bool,
    /// Some are cut by planes.
    pub planes: bool,
    /// No extinction differs among the channels.
    pub grey: bool,
    /// Some glow by a temperature or are coloured by grids.
    pub tinted: bool,
    /// Some have tables for phase functions.
    pub phase_tables: bool,
    /// Loop iterations that a look at all fields takes.
    pub loops: u32,
    /// The longest way through each volume [voxels].
    pub diagonals: Vec<f32>,
    /// The shortest voxel edge [m]; 1 where there is no volume.
    pub voxel: f32,
}

impl Traits {
    /// Of media in the order that shaders have: those that are made of bodies come last.
    pub(super) fn of(volumes: &[Volume]) -> Self {
        let fields = &volumes[..volumes.partition_point(|volume| !is_bodies(volume))];
        let transfers = || {
            volumes.iter().filter_map(|v| match &v.optics {
                Optics::Transfer(transfer) => Some(transfer),
                Optics::Coefficients { .. } => None,
            })
        };
        Self {
            count: fields.len() as u32,
            grids: volumes.iter().any(|v| matches!(v.field, Field::Grid(_))),
            exponentials: volumes.iter().any(|v| matches!(v.field, Field::Exponential { .. })),
            transfers: volumes.iter().any(|v| matches!(v.optics, Optics::Transfer(_))),
            spheres: volumes.iter().any(|v| matches!(v.field, Field::Sphere(_))),
            noises: volumes.iter().any(|v| matches!(v.field, Field::Noise(_))),
            expressions: volumes.iter().any(|v| matches!(v.field, Field::Expression(_))),
            shaded: transfers().any(|t| t.shading.is_some() || !t.gradient_opacity.is_empty()),
            surfaces: transfers().any(|t| !t.isosurfaces.is_empty()),
            planes: volumes.iter().any(|v| !v.clip.is_empty()),
            grey: volumes.iter().all(|v| {
                let one = v.optics.at(1.0).sigma_t();
                one == glam::Vec3::splat(one.x)
            }),
            tinted: volumes.iter().any(|v| v.temperature.is_some() || v.color.is_some()),
            phase_tables: volumes.iter().any(|v| matches!(v.phase, PhaseFunction::Table(_))),
            loops: fields.iter().map(loops).sum(),
            diagonals: fields.iter().map(diagonal).collect(),
            voxel: fields.iter().map(voxel).reduce(f32::min).unwrap_or(1.0),
        }
    }
}

impl Traits {
    /// Whether there is one volume, with voxels, of which nothing but the value varies in space.
    pub fn one_grid(&self) -> bool {
        self.count == 1 && self.grids && !self.surfaces && !self.tinted
    }

    /// Loop iterations that a march to a light takes at most, with steps of so many voxels. Every loop counts, also those that a
    /// compiler would unroll.
    pub fn iterations(&self, step: f32) -> u64 {
        // A ray steps through each volume, and once more at each of its boundaries. A volume may be absurdly long.
        let count = |step: f32| {
            let steps = self.diagonals.iter().map(|voxels| ((voxels / step).ceil() as u64).saturating_add(2));
            steps.fold(1u64, u64::saturating_add)
        };
        let per_step = 2 + 3 * u64::from(self.count) + u64::from(self.loops);
        // Bricks on the way, each of which may be passed over in an iteration; or a step, if that is longer.
        let bricks = count(step.max(BRICK_CELLS as f32 / 3.0));
        count(step).saturating_add(bricks).saturating_mul(per_step).saturating_add(u64::from(self.count))
    }
}

/// Loop iterations that a look at a field takes.
fn loops(volume: &Volume) -> u32 {
    match &volume.field {
        Field::Noise(noise) => noise.fractal.octaves,
        Field::Expression(expression) => {
            let calls = ["noise", "fbm"].map(|name| expression.formula.text().matches(name).count() as u32);
            calls.iter().sum::<u32>() * MAX_OCTAVES
        }
        _ => 0,
    }
}
