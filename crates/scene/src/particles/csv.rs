//! Particles from a table of text: a header that names the columns, then a particle a line.

use super::Particles;
use super::columns::{COLUMNS, NAMES, Rows, column};
use crate::description::BodyFile;
use crate::volume::{Budget, VolumeError};

/// Reads a table, its fields parted by commas. Columns of other names are ignored, and so are empty lines and what follows
/// a `#` at a line's start.
pub(super) fn read(bytes: &[u8], given: &BodyFile, budget: Budget) -> Result<Particles, VolumeError> {
    let text = str::from_utf8(bytes)
        .map_err(|error| VolumeError::Truncated { what: "a line that is no UTF-8", at: error.valid_up_to() as u64 })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = text.lines().enumerate().map(|(number, line)| (number + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (_, header) = lines.next().ok_or_else(|| VolumeError::not("a CSV", bytes, "a line that names the columns"))?;
    let columns: Vec<_> = header.split(',').map(|name| column(&name.trim().to_ascii_lowercase())).collect();
    let mut present = [false; COLUMNS];
    for index in columns.iter().flatten() {
        if std::mem::replace(&mut present[*index], true) {
            return Err(VolumeError::corrupt(format!("two of its columns are {:?}", NAMES[*index])));
        }
    }
    let mut rows = Rows::new(given, present, lines.clone().count() as u64, budget)?;
    for (number, line) in lines {
        let mut row = [0.0; COLUMNS];
        let mut fields = line.split(',');
        for column in &columns {
            let Some(field) = fields.next() else {
                let what = format!("line {number} has fewer than {} fields", columns.len());
                return Err(VolumeError::corrupt(what));
            };
            if let Some(index) = column {
                row[*index] = field.trim().parse().map_err(|_| {
                    let field: String = field.chars().take(20).collect();
                    VolumeError::corrupt(format!("line {number}: {} is {field:?}; it must be a number", NAMES[*index]))
                })?;
            }
        }
        if fields.next().is_some() {
            return Err(VolumeError::corrupt(format!("line {number} has more than {} fields", columns.len())));
        }
        rows.push(row, present[5])?;
    }
    Ok(rows.finish())
}
