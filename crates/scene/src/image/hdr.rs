//! Linear images from Radiance bytes (`.hdr`, `.pic`): RGBE, a mantissa of 8 bits a channel and one exponent \[Ward91\].
//!
//! A channel is c·2^(e−136), and 0 where e = 0. `EXPOSURE` and `COLORCORR` of the header, by which the values were
//! multiplied, are divided out. Primaries are taken for Rec. 709, as is usual: files with others are refused.

use super::{Image, ImageError, check_expansion, pixel_count};
use crate::volume::Budget;

/// The first bytes of a Radiance file: one of these.
pub const SIGNATURES: [&[u8]; 2] = [b"#?RADIANCE", b"#?RGBE"];

/// Decodes a picture whose rows go from top to bottom and from left to right (`-Y height +X width`); run lengths of both
/// styles, or none.
///
/// # Errors
/// [`ImageError::Hdr`] for damaged data, XYZ instead of RGB, other primaries and other orders of pixels;
/// [`ImageError::Empty`], [`ImageError::TooLarge`], [`ImageError::Expansion`] or [`ImageError::Budget`] for absurd sizes.
pub fn decode(bytes: &[u8], budget: Budget) -> Result<Image, ImageError> {
    if !SIGNATURES.iter().any(|signature| bytes.starts_with(signature)) {
        return Err(damaged("it does not begin with #?RADIANCE or #?RGBE"));
    }
    let mut reader = Reader(bytes);
    let header = Header::read(&mut reader)?;
    let (width, height) = (header.width, header.height);
    let count = pixel_count(width, height)?;
    let decoded = count * size_of::<[f32; 3]>() as u64;
    check_expansion(bytes.len(), decoded)?;
    let line = u64::from(width) * size_of::<[u8; 4]>() as u64;
    if decoded + line > budget.0 {
        return Err(ImageError::Budget { width, height, bytes: decoded + line, budget: budget.0 });
    }
    let mut pixels = Vec::with_capacity(count as usize);
    let mut line = vec![[0; 4]; width as usize];
    for row in 0..height {
        reader.line_of_pixels(&mut line).map_err(|what| damaged(format!("{what}, in row {row} of {height}")))?;
        pixels.extend(line.iter().map(|&[r, g, b, e]| {
            let unit = if e == 0 { 0.0 } else { 2f64.powi(i32::from(e) - 136) };
            let channel = |c: usize, mantissa: u8| (f64::from(mantissa) * unit / header.factor[c]) as f32;
            [channel(0, r), channel(1, g), channel(2, b)]
        }));
    }
    Ok(Image { width, height, pixels, ..Image::default() })
}

fn damaged(what: impl Into<String>) -> ImageError {
    ImageError::Hdr(what.into())
}

/// What the header says.
struct Header {
    width: u32,
    height: u32,
    /// What the channels were multiplied by.
    factor: [f64; 3],
}

impl Header {
    fn read(reader: &mut Reader) -> Result<Self, ImageError> {
        let mut factor = [1.0; 3];
        loop {
            let line = reader.line_of_text()?;
            if line.is_empty() {
                break;
            }
            let Some((key, value)) = line.split_once('=') else { continue };
            let shown: String = value.trim().chars().take(40).collect();
            let numbers = || value.split_whitespace().map(str::parse::<f64>).collect::<Result<Vec<_>, _>>();
            match (key.trim(), numbers().as_deref()) {
                ("FORMAT", _) if shown != "32-bit_rle_rgbe" => {
                    return Err(damaged(format!("found FORMAT={shown:?}; accepted: 32-bit_rle_rgbe")));
                }
                ("EXPOSURE", Ok([x])) if x.is_normal() && *x > 0.0 => factor = factor.map(|f| f * x),
                ("COLORCORR", Ok(&[r, g, b])) if [r, g, b].iter().all(|x| x.is_normal() && *x > 0.0) => {
                    factor = [factor[0] * r, factor[1] * g, factor[2] * b];
                }
                ("PRIMARIES", Ok(found)) if is_near_rec_709(found) => {}
                ("EXPOSURE", _) => {
                    return Err(damaged(format!("found EXPOSURE={shown:?}; accepted: a number > 0")));
                }
                ("COLORCORR", _) => {
                    return Err(damaged(format!("found COLORCORR={shown:?}; accepted: three numbers > 0")));
                }
                ("PRIMARIES", _) => {
                    return Err(damaged(format!("found PRIMARIES={shown:?}; accepted: those of Rec. 709")));
                }
                _ => {}
            }
        }
        let line = reader.line_of_text()?;
        let words: Vec<_> = line.split_whitespace().collect();
        if let ["-Y", height, "+X", width] = words[..]
            && let (Ok(width), Ok(height)) = (width.parse(), height.parse())
        {
            return Ok(Self { width, height, factor });
        }
        let shown: String = line.chars().take(40).collect();
        Err(damaged(format!("found the size {shown:?}; accepted: -Y HEIGHT +X WIDTH, rows from the top")))
    }
}

/// Rec. 709 [ITU-R BT.709-6], and Radiance's own default, which differs in nothing but its white point and a hundredth
/// of green's x.
fn is_near_rec_709(found: &[f64]) -> bool {
    const REC_709: [f64; 8] = [0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290];
    found.len() == 8 && found.iter().zip(REC_709).all(|(a, b)| (a - b).abs() < 0.03)
}

/// The bytes not yet read.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    /// A line of the header, without its end.
    fn line_of_text(&mut self) -> Result<std::borrow::Cow<'a, str>, ImageError> {
        let end = self.0.iter().position(|&byte| byte == b'\n').ok_or_else(|| damaged("it ends within its header"))?;
        let (line, rest) = (&self.0[..end], &self.0[end + 1..]);
        self.0 = rest;
        Ok(String::from_utf8_lossy(line.strip_suffix(b"\r").unwrap_or(line)))
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (bytes, rest) = self.0.split_first_chunk().ok_or("it ends too early")?;
        self.0 = rest;
        Ok(*bytes)
    }

    fn line_of_pixels(&mut self, line: &mut [[u8; 4]]) -> Result<(), String> {
        let first = self.bytes()?;
        // A pixel that no normalised colour has tells the newer style, which has a length of 15 bits.
        if let [2, 2, high @ 0..128, low] = first
            && (8..1 << 15).contains(&line.len())
        {
            let found = usize::from(u16::from_be_bytes([high, low]));
            if found != line.len() {
                return Err(format!("found {found} pixels; accepted: {}", line.len()));
            }
            return (0..4).try_for_each(|channel| self.channel(line, channel));
        }
        self.old_style(first, line)
    }

    /// A channel of a line, in runs: a length above 128 repeats a byte, another is followed by so many bytes.
    fn channel(&mut self, line: &mut [[u8; 4]], channel: usize) -> Result<(), String> {
        let mut at = 0;
        while at < line.len() {
            let [code] = self.bytes()?;
            let (count, repeated) = match code {
                129.. => (usize::from(code - 128), Some(self.bytes::<1>()?[0])),
                _ => (usize::from(code), None),
            };
            let run = line.get_mut(at..at + count).filter(|run| !run.is_empty());
            for pixel in run.ok_or_else(|| format!("found a run of {count} bytes at pixel {at}"))? {
                pixel[channel] = match repeated {
                    Some(value) => value,
                    None => self.bytes::<1>()?[0],
                };
            }
            at += count;
        }
        Ok(())
    }

    /// Pixels as they are, but that (1, 1, 1, n) repeats the last one n times, the next such n·2⁸ times, and so on.
    fn old_style(&mut self, first: [u8; 4], line: &mut [[u8; 4]]) -> Result<(), String> {
        let (mut pixel, mut at, mut place) = (first, 0, 0u32);
        loop {
            let (count, value);
            (count, value, place) = match pixel {
                // A shift beyond the word is a run beyond the line.
                [1, 1, 1, n] if at > 0 => (usize::from(n).checked_shl(8 * place), line[at - 1], place + 1),
                _ => (Some(1), pixel, 0),
            };
            let run = count.and_then(|count| line.get_mut(at..at.checked_add(count)?));
            let run = run.ok_or_else(|| format!("found a run beyond the line at pixel {at}"))?;
            run.fill(value);
            at += run.len();
            if at == line.len() {
                return Ok(());
            }
            pixel = self.bytes()?;
        }
    }
}

#[cfg(test)]
mod test;
