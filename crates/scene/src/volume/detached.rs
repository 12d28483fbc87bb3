//! Voxels that are in another file than their header.

use super::{Budget, VolumeError};
use crate::assets::Assets;

/// Gives `read` the bytes of the file `name`, which the header `file` names relative to its own folder.
///
/// Errors: [`VolumeError::Unreadable`]; [`VolumeError::Unsupported`] for a list of files; [`VolumeError::Within`] for
/// those of `read`.
pub(super) fn read_detached<T>(
    file: &str,
    name: &str,
    assets: &dyn Assets,
    budget: Budget,
    read: impl FnOnce(&[u8]) -> Result<T, VolumeError>,
) -> Result<T, VolumeError> {
    // Both NRRD and MetaImage write a list of names, or a pattern of printf.
    if name.starts_with("LIST") || name.contains('%') {
        return Err(VolumeError::Unsupported {
            found: format!("voxels in several files ({name})"),
            accepted: "all in one file",
        });
    }
    let folder = file.rfind(['/', '\\']).map_or("", |end| &file[..=end]);
    let name = name.strip_prefix("./").unwrap_or(name);
    let path = if name.starts_with(['/', '\\']) { name.to_owned() } else { format!("{folder}{name}") };
    let bytes = assets
        .read(&path, budget.0)
        .map_err(|error| VolumeError::Unreadable { file: path.clone(), reason: error.to_string() })?;
    read(&bytes).map_err(|source| VolumeError::Within { file: path, source: Box::new(source) })
}
