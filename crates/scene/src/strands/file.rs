//! Strands from files: the binary `.hair`, or text.
//!
//! Source of the binary format: <http://www.cemyuksel.com/research/hairmodels/>.

use glam::Vec3;

use super::{Knot, Strands};
use crate::assets::Assets;
use crate::description::BodyFile;
use crate::particles::{optical_depth, reserve};
use crate::volume::{Budget, FileError, Stored, VolumeError};

/// Reads the strands of a file; what the scene gives stands for what the file has.
pub(crate) fn read_strands(
    file: &str,
    given: &BodyFile,
    assets: &dyn Assets,
    budget: Budget,
) -> Result<Strands, FileError> {
    let lower = file.to_ascii_lowercase();
    let read = match lower.rsplit_once('.').map_or("", |(_, extension)| extension) {
        "hair" => read_hair,
        "txt" => read_text,
        extension => {
            let found = format!("a file of strands with the extension {extension:?}");
            return Err(VolumeError::Unsupported { found, accepted: ".hair, .txt" }.into());
        }
    };
    Ok(read(&assets.read(file, budget.0)?, given, budget)?)
}

/// A point of what a file says and the scene gives.
fn knot(
    given: &BodyFile,
    index: usize,
    position: Vec3,
    radius: f32,
    opacity: f32,
    color: Vec3,
) -> Result<Knot, VolumeError> {
    let opacity = given.opacity.unwrap_or(opacity);
    if !(0.0..=1.0).contains(&opacity) {
        let what = format!("the opacity of point {index} of the strands is {opacity:?}; accepted: 0 to 1");
        return Err(VolumeError::corrupt(what));
    }
    let knot = Knot {
        position,
        radius: given.radius.unwrap_or(radius),
        color: given.color.unwrap_or(color),
        depth: optical_depth(opacity),
    };
    knot.check(index)?;
    Ok(knot)
}

/// Bytes of a header.
const HEADER: usize = 128;

/// Which arrays there are, by the bits of a header.
const SEGMENTS: u32 = 1;
const POINTS: u32 = 2;
const THICKNESS: u32 = 4;
const TRANSPARENCY: u32 = 8;
const COLORS: u32 = 16;

/// Reads a `.hair` file. Its thickness is a diameter, its opacity 1 − transparency.
fn read_hair(bytes: &[u8], given: &BodyFile, budget: Budget) -> Result<Strands, VolumeError> {
    if !bytes.starts_with(&b"HAIR"[..bytes.len().min(4)]) || bytes.is_empty() {
        return Err(VolumeError::not("a HAIR", bytes, "HAIR"));
    }
    let truncated = |what| VolumeError::Truncated { what, at: bytes.len() as u64 };
    let header = bytes.get(..HEADER).ok_or_else(|| truncated("the header"))?;
    let whole = |at: usize| Stored::U32.decode(&header[at..at + 4], false) as u32;
    let real = |at: usize| Stored::F32.decode(&header[at..at + 4], false) as f32;
    let [strands, points, arrays, segments] = [4, 8, 12, 16].map(whole);
    if arrays & POINTS == 0 {
        return Err(VolumeError::corrupt("it has no array of points"));
    }
    // Segments of 2 bytes for each strand, then points, thickness, transparency, colours of 4-byte numbers for each point.
    let has = |array: u32| u64::from(arrays & array != 0);
    let each = 4 * (3 + has(THICKNESS) + has(TRANSPARENCY) + 3 * has(COLORS));
    let needed = HEADER as u64 + 2 * has(SEGMENTS) * u64::from(strands) + each * u64::from(points);
    if needed > bytes.len() as u64 {
        return Err(truncated("the strands"));
    }
    if has(SEGMENTS) == 0 && (u64::from(segments) + 1) * u64::from(strands) != u64::from(points) {
        let what = format!("{strands} strands of {segments} segments each have not {points} points");
        return Err(VolumeError::corrupt(what));
    }
    let mut counts = reserve("strands", strands.into(), 4, budget)?;
    let mut knots = reserve("points of strands", points.into(), Strands::BYTES, budget)?;
    let mut at = HEADER;
    for _ in 0..strands {
        counts.push(match has(SEGMENTS) {
            0 => segments.saturating_add(1),
            _ => {
                at += 2;
                Stored::U16.decode(&bytes[at - 2..at], false) as u32 + 1
            }
        });
    }
    let points = points as usize;
    let mut part = |array: u32, width: usize| {
        let start = at;
        if arrays & array != 0 {
            at += 4 * width * points;
        }
        (arrays & array != 0).then_some(start)
    };
    let places = [part(POINTS, 3), part(THICKNESS, 1), part(TRANSPARENCY, 1), part(COLORS, 3)];
    let number = |place: usize| Stored::F32.decode(&bytes[place..place + 4], false) as f32;
    let triple = |place: usize| Vec3::from([0, 1, 2].map(|k| number(place + 4 * k)));
    for i in 0..points {
        let position = triple(places[0].unwrap_or(HEADER) + 12 * i);
        let thickness = places[1].map_or(real(20), |place| number(place + 4 * i));
        let transparency = places[2].map_or(real(24), |place| number(place + 4 * i));
        let color = places[3].map_or(Vec3::from([28, 32, 36].map(real)), |place| triple(place + 12 * i));
        knots.push(knot(given, i, position, 0.5 * thickness, 1.0 - transparency, color)?);
    }
    Strands::new(knots, &counts)
}

/// Reads text: a point a line, `x y z [radius [opacity [red green blue]]]`, apart by white space or commas; an empty line ends
/// a strand; what follows a `#` is no number.
fn read_text(bytes: &[u8], given: &BodyFile, budget: Budget) -> Result<Strands, VolumeError> {
    let text = str::from_utf8(bytes)
        .map_err(|error| VolumeError::Truncated { what: "a line that is no UTF-8", at: error.valid_up_to() as u64 })?;
    let mut knots = reserve("points of strands", text.lines().count() as u64, Strands::BYTES, budget)?;
    let mut counts = Vec::new();
    let mut count = 0;
    for (number, line) in text.lines().enumerate().map(|(number, line)| (number + 1, line)) {
        let said = line.split('#').next().unwrap_or("");
        if said.trim().is_empty() {
            // A comment alone parts nothing.
            if line.trim().is_empty() && count > 0 {
                counts.push(std::mem::take(&mut count));
            }
            continue;
        }
        let wrong = |found: String| {
            let accepted = "x y z, then radius, opacity, and red green blue where the scene does not give them";
            VolumeError::corrupt(format!("line {number} has {found}; accepted: {accepted}"))
        };
        let mut row = [0.0f32; 8];
        let mut length = 0;
        for word in said.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty()) {
            let word = word.chars().take(20).collect::<String>();
            let slot = row.get_mut(length).ok_or_else(|| wrong("more than 8 numbers".into()))?;
            *slot = word.parse().map_err(|_| wrong(format!("{word:?}")))?;
            length += 1;
        }
        if !matches!(length, 3 | 4 | 5 | 8)
            || (length < 4 && given.radius.is_none())
            || (length < 5 && given.opacity.is_none())
        {
            return Err(wrong(format!("{length} numbers")));
        }
        let [x, y, z, radius, opacity, red, green, blue] = row;
        let color = if length == 8 { Vec3::new(red, green, blue) } else { Vec3::ONE };
        knots.push(knot(given, knots.len(), Vec3::new(x, y, z), radius, opacity, color)?);
        count += 1;
    }
    if count > 0 {
        counts.push(count);
    }
    Strands::new(knots, &counts)
}
