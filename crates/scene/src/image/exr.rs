//! Linear images to and from OpenEXR bytes, losslessly.
//!
//! | in the file | in [`Image`] |
//! |---|---|
//! | channels `R`, `G`, `B` (float) | `pixels` |
//! | channels `variance.R`, `variance.G`, `variance.B` (float) | `statistics.variance` |
//! | channel `samples` (uint) | `statistics.samples` |
//! | `channels`, by their names (float); not read | `channels` |
//! | text attributes `tyndall:NAME` | `attributes["NAME"]` |
//!
//! Written with ZIP compression and no `chromaticities`, which by the OpenEXR standard means Rec. 709. Attributes stand
//! in the file in no fixed order, so two files of one image hold the same, but may differ in their bytes.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

use ::exr::image::read::read;
use ::exr::meta::attribute::Chromaticities;
use ::exr::meta::header::Header;
use ::exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatImage, FlatSamples, Image as ExrImage,
    Layer, LayerAttributes, LineOrder, ReadChannels as _, ReadLayers as _, SmallVec, Text, Vec2, WritableImage as _,
};

use super::{Image, ImageError, MAX_PIXELS, Statistics, check_expansion, pixel_count};
use crate::volume::Budget;

/// The first bytes of every OpenEXR file.
pub const SIGNATURE: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Stands before the name of each of [`Image::attributes`] in the file.
const PREFIX: &str = "tyndall:";
/// The longest attribute name that OpenEXR has room for [byte].
const MAX_NAME: usize = 255;

const COLOURS: [&str; 3] = ["R", "G", "B"];
const VARIANCES: [&str; 3] = ["variance.R", "variance.G", "variance.B"];
const SAMPLES: &str = "samples";

/// Encodes the image with its statistics and attributes; every value comes back bit by bit, NaN included.
///
/// # Errors
/// What [`Image::check`] reports; [`ImageError::Exr`] for an attribute whose name is empty or too long.
pub fn encode(image: &Image) -> Result<Vec<u8>, ImageError> {
    image.check()?;
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    let mut add = |names: [&str; 3], values: &[[f32; 3]]| {
        for (c, name) in names.into_iter().enumerate() {
            let plane = FlatSamples::F32(values.iter().map(|v| v[c]).collect());
            channels.push(AnyChannel::new(name, plane));
        }
    };
    add(COLOURS, &image.pixels);
    if let Some(statistics) = &image.statistics {
        add(VARIANCES, &statistics.variance);
        channels.push(AnyChannel::new(SAMPLES, FlatSamples::U32(statistics.samples.clone())));
    }

    for (name, values) in &image.channels {
        channels.push(AnyChannel::new(name.as_str(), FlatSamples::F32(values.clone())));
    }

    let mut attributes = LayerAttributes { software_name: Some(Text::from("Tyndall")), ..LayerAttributes::default() };
    for (name, value) in &image.attributes {
        let full = format!("{PREFIX}{name}");
        if name.is_empty() || full.len() > MAX_NAME || name.contains('\0') {
            let most = MAX_NAME - PREFIX.len();
            return Err(ImageError::Exr(format!(
                "the attribute name `{name}` is not accepted: it needs 1 to {most} bytes, none of them zero"
            )));
        }
        let value = AttributeValue::Text(Text::from_slice_unchecked(value.as_bytes()));
        attributes.other.insert(Text::from_slice_unchecked(full.as_bytes()), value);
    }

    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (image.width as usize, image.height as usize);
    let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let mut bytes = Vec::new();
    ExrImage::from_layer(layer)
        .write()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(|error| ImageError::Exr(error.to_string()))?;
    Ok(bytes)
}

/// Decodes the first layer that has the channels `R`, `G` and `B`, whatever program wrote it: half, float or uint, scan
/// lines or tiles (the largest level), any compression but the lossy B44 and DWA. Alpha and other channels are ignored;
/// the size is that of the data window. NaN and infinite pixels are kept.
///
/// The header is checked against [`MAX_PIXELS`] and against the length of `bytes` before the pixels are allocated.
///
/// # Errors
/// [`ImageError::Exr`] for damaged data, missing or subsampled channels, lossy compression, or primaries other than
/// Rec. 709; [`ImageError::Empty`], [`ImageError::TooLarge`] or [`ImageError::Expansion`] for absurd sizes.
pub fn decode(bytes: &[u8]) -> Result<Image, ImageError> {
    decode_within(bytes, Budget(u64::MAX))
}

/// As [`decode`], within a budget of memory.
///
/// # Errors
/// As [`decode`], and [`ImageError::Budget`].
pub fn decode_within(bytes: &[u8], budget: Budget) -> Result<Image, ImageError> {
    // The decoder panics on some damaged files (overflow in sizes). Its state is dropped with the panic, so nothing
    // broken is seen afterwards. It is kept on this thread, since a panic in a thread pool ends the process.
    catch_unwind(AssertUnwindSafe(|| decode_checked(bytes, budget)))
        .unwrap_or_else(|_| Err(ImageError::Exr("the data are damaged".to_owned())))
}

fn decode_checked(bytes: &[u8], budget: Budget) -> Result<Image, ImageError> {
    let failed = |error: ::exr::error::Error| ImageError::Exr(error.to_string());
    let reader = ::exr::block::read(Cursor::new(bytes), false).map_err(failed)?;
    check_headers(reader.headers(), bytes.len(), budget)?;
    let file: FlatImage = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .pedantic()
        .from_chunks(reader)
        .map_err(failed)?;
    if let Some(found) = file.attributes.chromaticities {
        check_primaries(found)?;
    }

    let Some(layer) = file.layer_data.iter().find(|layer| COLOURS.iter().all(|name| channel(layer, name).is_some()))
    else {
        let found: Vec<String> =
            file.layer_data.iter().flat_map(|l| &l.channel_data.list).map(|c| c.name.to_string()).collect();
        return Err(ImageError::Exr(format!(
            "the channels {} were found; one layer with R, G and B is needed",
            found.join(", ")
        )));
    };

    let texts = file.attributes.other.iter().chain(&layer.attributes.other);
    let attributes = texts.filter_map(|(name, value)| {
        let name = text(name);
        let AttributeValue::Text(value) = value else {
            return None;
        };
        Some((name.strip_prefix(PREFIX)?.to_owned(), text(value)))
    });
    let image = Image {
        width: layer.size.width() as u32,
        height: layer.size.height() as u32,
        pixels: colours(layer, COLOURS)?,
        statistics: statistics(layer)?,
        channels: Default::default(),
        attributes: attributes.collect(),
    };
    image.check()?;
    Ok(image)
}

/// Bounds what the pixels will take, before they are allocated.
fn check_headers(headers: &[Header], file: usize, budget: Budget) -> Result<(), ImageError> {
    let mut decoded = 0u64;
    for header in headers {
        // Damaged data of these make the decoder allocate without bound, or panic.
        use Compression::{B44, B44A, DWAA, DWAB};
        if let B44 | B44A | DWAA(_) | DWAB(_) = header.compression {
            return Err(ImageError::Exr(format!(
                "{} was found, which loses precision; ZIP, PIZ, PXR24, RLE or no compression is needed",
                header.compression
            )));
        }
        let (width, height) = (header.layer_size.width() as u64, header.layer_size.height() as u64);
        let (Ok(w), Ok(h)) = (u32::try_from(width), u32::try_from(height)) else {
            return Err(ImageError::TooLarge { width, height });
        };
        let count = pixel_count(w, h)?;
        decoded = decoded.saturating_add(count.saturating_mul(header.channels.bytes_per_pixel as u64));
        // The decoder's planes and our pixels are in memory together.
        let needed = decoded.saturating_add(count * size_of::<[f32; 3]>() as u64);
        if needed > budget.0 {
            return Err(ImageError::Budget { width: w, height: h, bytes: needed, budget: budget.0 });
        }
    }
    // A layer of many channels may be within the pixel limit and still be absurd: 64 bytes a pixel have room for all of
    // Tyndall's channels twice.
    if decoded > MAX_PIXELS * 64 {
        return Err(ImageError::Expansion { file: file as u64, decoded });
    }
    check_expansion(file, decoded)
}

fn check_primaries(found: Chromaticities) -> Result<(), ImageError> {
    // [ITU-R BT.709-6]
    const REC_709: [[f32; 2]; 4] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]];
    let found = [found.red, found.green, found.blue, found.white].map(|Vec2(x, y)| [x, y]);
    let near = |(a, b): (&f32, &f32)| (a - b).abs() < 1e-3;
    if found.as_flattened().iter().zip(REC_709.as_flattened()).all(near) {
        Ok(())
    } else {
        Err(ImageError::Exr(format!("the primaries and white point {found:?} were found; Rec. 709 is needed")))
    }
}

fn channel<'a>(layer: &'a Layer<AnyChannels<FlatSamples>>, name: &str) -> Option<&'a AnyChannel<FlatSamples>> {
    layer.channel_data.list.iter().find(|c| c.name.as_slice() == name.as_bytes())
}

/// The three named channels, interleaved.
fn colours(layer: &Layer<AnyChannels<FlatSamples>>, names: [&str; 3]) -> Result<Vec<[f32; 3]>, ImageError> {
    let mut pixels = vec![[0.0; 3]; layer.size.area()];
    for (c, name) in names.into_iter().enumerate() {
        let Some(channel) = channel(layer, name) else {
            return Err(ImageError::Exr(format!(
                "the channel `{name}` is missing; `variance.R`, `variance.G`, `variance.B` and `samples` go together"
            )));
        };
        if channel.sampling != Vec2(1, 1) {
            return Err(ImageError::Exr(format!("the channel `{name}` is subsampled, which is not supported")));
        }
        for (pixel, value) in pixels.iter_mut().zip(channel.sample_data.values_as_f32()) {
            pixel[c] = value;
        }
    }
    Ok(pixels)
}

fn statistics(layer: &Layer<AnyChannels<FlatSamples>>) -> Result<Option<Statistics>, ImageError> {
    let samples = channel(layer, SAMPLES);
    if samples.is_none() && VARIANCES.iter().all(|name| channel(layer, name).is_none()) {
        return Ok(None);
    }
    let variance = colours(layer, VARIANCES)?;
    match samples.map(|channel| &channel.sample_data) {
        Some(FlatSamples::U32(samples)) => Ok(Some(Statistics { variance, samples: samples.clone() })),
        Some(_) => Err(ImageError::Exr("the channel `samples` holds floats; uint is needed".to_owned())),
        None => Err(ImageError::Exr("the channel `samples` is missing beside `variance.R`".to_owned())),
    }
}

fn text(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

#[cfg(test)]
mod test;
