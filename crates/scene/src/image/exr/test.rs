use std::collections::BTreeMap;

use ::exr::prelude::{ImageAttributes, f16};
use proptest::prelude::*;

use super::*;

fn image(width: u32, height: u32) -> Image {
    let count = width * height;
    let value = |i: u32| (i as f32 * 0.37).sin() * 10.0;
    Image {
        width,
        height,
        pixels: (0..count).map(|i| [value(i), value(i + 1), value(i + 2)]).collect(),
        statistics: Some(Statistics {
            variance: (0..count).map(|i| [value(i).abs(), 0.0, 1e-20]).collect(),
            samples: (0..count).map(|i| i * 1_000_003).collect(),
        }),
        channels: BTreeMap::new(),
        attributes: BTreeMap::from([
            ("method".to_owned(), "delta tracking, µ and 雲".to_owned()),
            ("empty".to_owned(), String::new()),
            ("long".to_owned(), "x".repeat(5000)),
        ]),
    }
}

/// The bytes of an EXR file as another program might write it.
fn foreign(size: (usize, usize), channels: Vec<(&str, FlatSamples)>, attributes: Option<ImageAttributes>) -> Vec<u8> {
    foreign_encoded(size, channels, attributes, Encoding::FAST_LOSSLESS)
}

fn foreign_encoded(
    size: (usize, usize),
    channels: Vec<(&str, FlatSamples)>,
    attributes: Option<ImageAttributes>,
    encoding: Encoding,
) -> Vec<u8> {
    let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
    let layer = Layer::new(size, LayerAttributes::default(), encoding, AnyChannels::sort(channels));
    let mut file = ExrImage::from_layer(layer);
    if let Some(attributes) = attributes {
        file.attributes = attributes;
    }
    let mut bytes = Vec::new();
    file.write().to_buffered(Cursor::new(&mut bytes)).unwrap();
    bytes
}

#[test]
fn everything_round_trips() {
    let original = image(37, 21);
    assert_eq!(decode(&encode(&original).unwrap()).unwrap(), original);
    let plain = Image { statistics: None, attributes: BTreeMap::new(), ..original };
    assert_eq!(decode(&encode(&plain).unwrap()).unwrap(), plain);
}

/// Other programs find further channels by their names; and there is a value for every pixel.
#[test]
fn further_channels_are_written() {
    let mut image = image(3, 2);
    image.channels.insert("depth.Z".into(), vec![1.0, 2.0, 3.0, 4.0, 5.0, 1e30]);
    let bytes = encode(&image).unwrap();
    let reader = ::exr::image::read::read().no_deep_data().largest_resolution_level().all_channels();
    let file = reader.all_layers().all_attributes().from_buffered(Cursor::new(&bytes)).unwrap();
    let depth = channel(&file.layer_data[0], "depth.Z").unwrap();
    assert_eq!(depth.sample_data.values_as_f32().collect::<Vec<_>>(), image.channels["depth.Z"]);
    image.channels.insert("depth.Z".into(), vec![1.0]);
    assert!(matches!(encode(&image), Err(ImageError::Length { field: "channels", found: 1, expected: 6 })));
}

#[test]
fn nan_and_infinity_are_kept() {
    let original = Image {
        width: 2,
        height: 1,
        pixels: vec![[f32::NAN, f32::INFINITY, -0.0], [f32::MIN_POSITIVE, f32::MAX, 1e-42]],
        ..Image::default()
    };
    let back = decode(&encode(&original).unwrap()).unwrap();
    let bits = |image: &Image| image.pixels.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&back), bits(&original));
}

#[test]
fn half_rgba_and_mixed_types_decode() {
    let half = |v: [f32; 2]| FlatSamples::F16(v.map(f16::from_f32).to_vec());
    let channels = vec![
        ("R", half([0.5, 1.0])),
        ("G", FlatSamples::F32(vec![0.1, 0.2])),
        ("B", half([0.25, 8.0])),
        ("A", half([1.0, 0.0])),
    ];
    let decoded = decode(&foreign((2, 1), channels, None)).unwrap();
    assert_eq!(decoded.pixels, vec![[0.5, 0.1, 0.25], [1.0, 0.2, 8.0]]);
    assert_eq!(decoded.statistics, None);
}

#[test]
fn missing_channels_are_named() {
    let plane = || FlatSamples::F32(vec![0.0; 2]);
    let error = decode(&foreign((2, 1), vec![("Y", plane()), ("Z", plane())], None)).unwrap_err().to_string();
    assert!(error.contains("Y, Z") && error.contains("R, G and B"), "{error}");
    let channels = vec![("R", plane()), ("G", plane()), ("B", plane()), ("variance.R", plane())];
    let error = decode(&foreign((2, 1), channels, None)).unwrap_err().to_string();
    assert!(error.contains("variance.G"), "{error}");
}

#[test]
fn other_primaries_are_refused() {
    let plane = || FlatSamples::F32(vec![0.0; 2]);
    let file = |red: Vec2<f32>| {
        let mut attributes = ImageAttributes::with_size((2, 1));
        let (green, blue, white) = (Vec2(0.3, 0.6), Vec2(0.15, 0.06), Vec2(0.3127, 0.329));
        attributes.chromaticities = Some(Chromaticities { red, green, blue, white });
        foreign((2, 1), vec![("R", plane()), ("G", plane()), ("B", plane())], Some(attributes))
    };
    assert!(decode(&file(Vec2(0.64, 0.33))).is_ok());
    assert!(decode(&file(Vec2(0.708, 0.292))).unwrap_err().to_string().contains("Rec. 709"));
}

#[test]
fn lossy_compression_is_refused() {
    for compression in [Compression::B44, Compression::DWAA(None)] {
        let encoding = Encoding { compression, ..Encoding::FAST_LOSSLESS };
        let plane = || FlatSamples::F16(vec![f16::ONE; 256]);
        let channels = vec![("R", plane()), ("G", plane()), ("B", plane())];
        let error = decode(&foreign_encoded((16, 16), channels, None, encoding)).unwrap_err();
        assert!(error.to_string().contains("ZIP"), "{error}");
    }
}

#[test]
fn bad_attribute_names_are_refused() {
    for name in [String::new(), "x".repeat(248), "a\0b".to_owned()] {
        let image = Image { attributes: BTreeMap::from([(name, String::new())]), ..image(1, 1) };
        assert!(matches!(encode(&image), Err(ImageError::Exr(_))));
    }
}

/// Replaces the window attribute `name` by one of the given size.
fn with_window(bytes: &[u8], name: &str, width: i32, height: i32) -> Vec<u8> {
    let key = [name.as_bytes(), b"\0box2i\0"].concat();
    let at = bytes.windows(key.len()).position(|w| w == key).unwrap() + key.len() + 4;
    let mut bytes = bytes.to_vec();
    for (i, value) in [0, 0, width - 1, height - 1].into_iter().enumerate() {
        bytes[at + 4 * i..at + 4 * i + 4].copy_from_slice(&value.to_le_bytes());
    }
    bytes
}

#[test]
fn absurd_sizes_are_refused_before_decoding() {
    let bytes = encode(&image(4, 4)).unwrap();
    let too_large = decode(&with_window(&bytes, "dataWindow", 1 << 27, 4));
    assert!(matches!(too_large, Err(ImageError::TooLarge { .. })));
    let expands = decode(&with_window(&bytes, "dataWindow", 1 << 24, 4));
    assert!(matches!(expands, Err(ImageError::Expansion { .. })));
    assert!(decode(&with_window(&bytes, "dataWindow", 1 << 20, 1 << 20)).is_err());
    assert!(decode(&with_window(&bytes, "dataWindow", i32::MAX, i32::MAX)).is_err());
    assert!(decode(&with_window(&bytes, "dataWindow", -5, -5)).is_err());
}

#[test]
fn every_truncation_is_an_error() {
    let bytes = encode(&image(8, 20)).unwrap();
    for length in 0..bytes.len() {
        assert!(decode(&bytes[..length]).is_err(), "{length} of {} bytes were accepted", bytes.len());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn flipped_bits_never_panic(flips in prop::collection::vec((any::<prop::sample::Index>(), 0u8..8), 1..6)) {
        let small = Image { attributes: BTreeMap::new(), ..image(5, 3) };
        let mut bytes = encode(&small).unwrap();
        for (at, bit) in flips {
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
        }
        if let Ok(image) = decode(&bytes) {
            prop_assert!(image.check().is_ok());
        }
    }

    #[test]
    fn flipped_bits_of_other_encodings_never_panic(
        method in 0usize..5,
        tiled in any::<bool>(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0u8..8), 1..6),
    ) {
        use Compression::{PIZ, PXR24, RLE, Uncompressed, ZIP1};
        let encoding = Encoding {
            compression: [PIZ, PXR24, RLE, Uncompressed, ZIP1][method],
            blocks: if tiled { Blocks::Tiles(Vec2(8, 8)) } else { Blocks::ScanLines },
            line_order: LineOrder::Increasing,
        };
        let plane = |scale: f32| FlatSamples::F16((0..200).map(|i| f16::from_f32(i as f32 * scale)).collect());
        let channels = vec![("R", plane(0.1)), ("G", plane(1.0)), ("B", plane(3.0))];
        let mut bytes = foreign_encoded((20, 10), channels, None, encoding);
        prop_assert!(decode(&bytes).is_ok());
        for (at, bit) in flips {
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
        }
        if let Ok(image) = decode(&bytes) {
            prop_assert!(image.check().is_ok());
        }
    }

    #[test]
    fn noise_after_the_signature_never_panics(noise in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(decode(&[&SIGNATURE[..], &[2, 0, 0, 0], &noise].concat()).is_err());
    }
}
