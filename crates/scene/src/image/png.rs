//! Display-referred images to and from PNG bytes.

use std::io::Cursor;

use ::image::codecs::png::{PngDecoder, PngEncoder};
use ::image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, Limits};

use super::{DisplayImage, ImageError, check_expansion, pixel_count};

/// The first bytes of every PNG file.
pub const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// Encodes as 8-bit sRGB RGB; values are clamped to 0..=1 and rounded to the nearest of 256 steps.
///
/// # Errors
/// What [`DisplayImage::check`] reports; [`ImageError::Png`] if the encoder fails.
pub fn encode(image: &DisplayImage) -> Result<Vec<u8>, ImageError> {
    image.check()?;
    let codes: Vec<u8> = image.pixels.iter().flatten().map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8).collect();
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(&codes, image.width, image.height, ExtendedColorType::Rgb8)
        .map_err(|error| ImageError::Png(error.to_string()))?;
    Ok(bytes)
}

/// Decodes 8- or 16-bit grey, grey + alpha, RGB or RGBA (and palettes) to sRGB-encoded values in 0..=1.
///
/// Alpha is dropped, since a finished picture is opaque. `gAMA` and `iCCP` chunks are not read: sRGB is assumed.
///
/// # Errors
/// [`ImageError::Png`] for damaged data, [`ImageError::Empty`], [`ImageError::TooLarge`] or [`ImageError::Expansion`]
/// for absurd sizes.
pub fn decode(bytes: &[u8]) -> Result<DisplayImage, ImageError> {
    let failed = |error: ::image::ImageError| ImageError::Png(error.to_string());
    let mut decoder = PngDecoder::new(Cursor::new(bytes)).map_err(failed)?;
    let (width, height) = decoder.dimensions();
    pixel_count(width, height)?;
    check_expansion(bytes.len(), decoder.total_bytes())?;
    let mut limits = Limits::default();
    // The pixels, checked above, and what the decoder needs beside them.
    limits.max_alloc = Some(decoder.total_bytes() + (64 << 20));
    decoder.set_limits(limits).map_err(failed)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(failed)?;
    let pixels = decoded.into_rgb32f().pixels().map(|p| p.0).collect();
    Ok(DisplayImage { width, height, pixels })
}

#[cfg(test)]
mod test {
    use super::*;
    use proptest::prelude::*;

    fn ramp(width: u32, height: u32) -> DisplayImage {
        let pixels = (0..width * height).map(|i| [(i % 256) as f32 / 255.0, (i * 7 % 256) as f32 / 255.0, 1.0]);
        DisplayImage { width, height, pixels: pixels.collect() }
    }

    #[test]
    fn eight_bit_values_round_trip() {
        let image = ramp(32, 9);
        let back = decode(&encode(&image).unwrap()).unwrap();
        assert_eq!((back.width, back.height), (32, 9));
        for (a, b) in image.pixels.iter().flatten().zip(back.pixels.iter().flatten()) {
            assert!((a - b).abs() < 1e-6);
        }
    }

    #[test]
    fn values_outside_the_display_are_clamped() {
        let image =
            DisplayImage { width: 2, height: 1, pixels: vec![[-1.0, 2.0, f32::NAN], [f32::INFINITY, 0.5, 0.0]] };
        let back = decode(&encode(&image).unwrap()).unwrap();
        assert_eq!(back.pixels, vec![[0.0, 1.0, 0.0], [1.0, 128.0 / 255.0, 0.0]]);
    }

    /// PNG bytes of one pixel in the given layout.
    fn one_pixel(samples: &[u8], layout: ExtendedColorType) -> Vec<u8> {
        let mut bytes = Vec::new();
        PngEncoder::new(&mut bytes).write_image(samples, 1, 1, layout).unwrap();
        bytes
    }

    #[test]
    fn other_layouts_decode() {
        let half = 51.0 / 255.0;
        for (samples, layout, expected) in [
            (&[51u8][..], ExtendedColorType::L8, [half; 3]),
            (&[51, 9], ExtendedColorType::La8, [half; 3]),
            (&[51, 0, 255, 9], ExtendedColorType::Rgba8, [half, 0.0, 1.0]),
            (&0x3333u16.to_ne_bytes(), ExtendedColorType::L16, [half; 3]),
            (&[0x33, 0x33, 0, 0, 255, 255], ExtendedColorType::Rgb16, [half, 0.0, 1.0]),
            (&[0x33, 0x33, 0, 0, 255, 255, 1, 2], ExtendedColorType::Rgba16, [half, 0.0, 1.0]),
        ] {
            let pixel = decode(&one_pixel(samples, layout)).unwrap().pixels[0];
            for c in 0..3 {
                assert!((pixel[c] - expected[c]).abs() < 1e-6, "{layout:?}: {pixel:?}");
            }
        }
    }

    #[test]
    fn absurd_sizes_are_refused_before_decoding() {
        let mut bytes = encode(&ramp(4, 4)).unwrap();
        bytes[16..20].copy_from_slice(&0x7fff_ffff_u32.to_be_bytes());
        bytes[20..24].copy_from_slice(&0x7fff_ffff_u32.to_be_bytes());
        assert!(decode(&bytes).is_err());
    }

    #[test]
    fn every_truncation_is_an_error_or_an_image() {
        let bytes = encode(&ramp(16, 16)).unwrap();
        for length in 0..bytes.len() {
            if let Ok(image) = decode(&bytes[..length]) {
                // Only the trailing IEND chunk may be missing.
                assert_eq!(image, decode(&bytes).unwrap());
            }
        }
        assert!(decode(&bytes[..bytes.len() / 2]).is_err());
    }

    proptest! {
        #[test]
        fn flipped_bits_never_panic(flips in prop::collection::vec((0usize..4096, 0u8..8), 1..8)) {
            let mut bytes = encode(&ramp(16, 16)).unwrap();
            for (at, bit) in flips {
                let at = at % bytes.len();
                bytes[at] ^= 1 << bit;
            }
            if let Ok(image) = decode(&bytes) {
                prop_assert!(image.check().is_ok());
            }
        }
    }
}
