//! Named columns of numbers as particles: what the table formats share.

use glam::{DVec3, Vec3};

use super::{Particle, Particles, optical_depth, reserve};
use crate::description::BodyFile;
use crate::volume::{Budget, VolumeError};

/// What a column may be. The order is that of [`NAMES`] and of a row.
pub(super) const COLUMNS: usize = 8;

/// What columns are called, as [`COLUMNS`] counts them.
pub(super) const NAMES: [&str; COLUMNS] = ["x", "y", "z", "radius", "opacity", "red", "green", "blue"];

/// A row of all columns; what is absent does not matter.
pub(super) type Row = [f64; COLUMNS];

/// The column of a name.
pub(super) fn column(name: &str) -> Option<usize> {
    NAMES.iter().position(|known| *known == name)
}

/// Particles in the making, row by row.
#[derive(Debug)]
pub(super) struct Rows<'a> {
    given: &'a BodyFile,
    list: Vec<Particle>,
}

impl<'a> Rows<'a> {
    /// Room for `count` rows that have the columns of `present`.
    pub fn new(given: &'a BodyFile, present: [bool; COLUMNS], count: u64, budget: Budget) -> Result<Self, VolumeError> {
        let missing: Vec<_> = (0..COLUMNS)
            .filter(|&i| match i {
                0..=2 => !present[i],
                3 => !present[i] && given.radius.is_none(),
                4 => !present[i] && given.opacity.is_none(),
                // A colour is whole or not there.
                _ => !present[i] && given.color.is_none() && present[5..].contains(&true),
            })
            .map(|i| NAMES[i])
            .collect();
        if !missing.is_empty() {
            return Err(VolumeError::Unsupported {
                found: format!("particles without {}", missing.join(", ")),
                accepted: "x, y, z [m], radius [m], opacity and, if at all, red, green and blue; `radius`, `opacity` \
                           and `color` of the scene stand for those of the file",
            });
        }
        Ok(Self { given, list: reserve("particles", count, Particles::BYTES, budget)? })
    }

    /// Appends a particle.
    pub fn push(&mut self, row: Row, has_color: bool) -> Result<(), VolumeError> {
        let index = self.list.len();
        let [x, y, z, radius, opacity, red, green, blue] = row;
        let opacity = self.given.opacity.unwrap_or(opacity as f32);
        if !(0.0..=1.0).contains(&opacity) {
            let what = format!("the opacity of particle {index} is {opacity:?}; accepted: 0 to 1");
            return Err(VolumeError::corrupt(what));
        }
        let color = if has_color { DVec3::new(red, green, blue).as_vec3() } else { Vec3::ONE };
        let particle = Particle {
            position: DVec3::new(x, y, z).as_vec3(),
            radius: self.given.radius.unwrap_or(radius as f32),
            color: self.given.color.unwrap_or(color),
            depth: optical_depth(opacity),
        };
        particle.check(index)?;
        self.list.push(particle);
        Ok(())
    }

    pub fn finish(self) -> Particles {
        Particles::of(self.list)
    }
}
