//! Which loader reads a file of particles: its extension tells.

use super::{Particles, csv, npz, ply};
use crate::assets::Assets;
use crate::description::BodyFile;
use crate::volume::{Budget, FileError, VolumeError};

const ACCEPTED: &str = ".ply, .npz, .npy, .csv";

/// Reads the particles of a file; what the scene gives stands for what the file has.
pub(crate) fn read_particles(
    file: &str,
    given: &BodyFile,
    assets: &dyn Assets,
    budget: Budget,
) -> Result<Particles, FileError> {
    let lower = file.to_ascii_lowercase();
    let read = match lower.rsplit_once('.').map_or("", |(_, extension)| extension) {
        "ply" => ply::read,
        "npz" => npz::read_npz,
        "npy" => npz::read_npy,
        "csv" => csv::read,
        extension => {
            let found = format!("a file of particles with the extension {extension:?}");
            return Err(VolumeError::Unsupported { found, accepted: ACCEPTED }.into());
        }
    };
    Ok(read(&assets.read(file, budget.0)?, given, budget)?)
}
