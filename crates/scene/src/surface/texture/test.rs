use image::{ImageFormat, RgbaImage};
use proptest::prelude::*;

use super::*;
use crate::volume::tests::{BUDGET, apply, damage, damaged_cases};

/// Four texels: red, green over blue, white of half alpha.
fn picture(format: ImageFormat) -> Vec<u8> {
    let texels = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 128]].concat();
    let picture = image::DynamicImage::from(RgbaImage::from_raw(2, 2, texels).unwrap());
    let mut bytes = Cursor::new(Vec::new());
    match format {
        ImageFormat::Jpeg => picture.into_rgb8().write_to(&mut bytes, format).unwrap(),
        _ => picture.write_to(&mut bytes, format).unwrap(),
    }
    bytes.into_inner()
}

#[test]
fn texels_are_rows_from_the_top() {
    let texture = Texture::decode(&picture(ImageFormat::Png), false, BUDGET).unwrap();
    assert_eq!((texture.width, texture.height, texture.bytes()), (2, 2, 16));
    assert_eq!(texture.at(Vec2::new(0.25, 0.25)), Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert_eq!(texture.at(Vec2::new(0.75, 0.25)), Vec4::new(0.0, 1.0, 0.0, 1.0));
    assert_eq!(texture.at(Vec2::new(0.25, 0.75)), Vec4::new(0.0, 0.0, 1.0, 1.0));
    // Between texels, and repeated.
    assert_eq!(texture.at(Vec2::new(0.5, 0.25)), Vec4::new(0.5, 0.5, 0.0, 1.0));
    assert_eq!(texture.at(Vec2::new(3.0, -0.75)), Vec4::new(0.5, 0.5, 0.0, 1.0));
    let jpeg = Texture::decode(&picture(ImageFormat::Jpeg), true, BUDGET).unwrap();
    assert_eq!((jpeg.width, jpeg.height), (2, 2));
    assert!(jpeg.texels.iter().all(|texel| texel[3] == 255));
}

/// sRGB 188 is about half the light, alpha is linear.
#[test]
fn colours_are_linear_after_decoding() {
    let texture = Texture { width: 1, height: 1, texels: vec![[188, 0, 255, 188]], srgb: true };
    let value = texture.at(Vec2::ZERO);
    assert!((value.x - 0.5).abs() < 0.005, "{value}");
    assert_eq!([value.y, value.z, value.w], [0.0, 1.0, 188.0 / 255.0]);
    assert_eq!(Texture { srgb: false, ..texture }.at(Vec2::ZERO).x, 188.0 / 255.0);
}

#[test]
fn what_is_no_texture() {
    let message = |bytes: &[u8], budget| Texture::decode(bytes, true, Budget(budget)).unwrap_err().to_string();
    assert_eq!(message(b"GIF89a      ", 1 << 20), "found neither a PNG nor a JPEG file; accepted: these two");
    assert_eq!(message(b"", 1 << 20), "found neither a PNG nor a JPEG file; accepted: these two");
    let png = picture(ImageFormat::Png);
    assert_eq!(message(&png, 31), "a picture of 2 x 2 pixels needs 32 bytes; the budget is 31");
    assert!(Texture::decode(&png, true, Budget(32 << 10)).is_ok());
    // A claim of 2³¹ − 1 pixels a side.
    let mut huge = png.clone();
    huge[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    assert!(Texture::decode(&huge, true, BUDGET).is_err());
}

#[test]
fn every_truncation() {
    for format in [ImageFormat::Png, ImageFormat::Jpeg] {
        let bytes = picture(format);
        for end in 0..bytes.len() {
            if let Ok(texture) = Texture::decode(&bytes[..end], true, BUDGET) {
                assert_eq!(texture.texels.len(), (texture.width * texture.height) as usize);
            }
        }
    }
}

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged(jpeg in any::<bool>(), damage in damage()) {
        let mut bytes = picture(if jpeg { ImageFormat::Jpeg } else { ImageFormat::Png });
        apply(&mut bytes, &damage);
        match Texture::decode(&bytes, true, BUDGET) {
            Ok(texture) => prop_assert_eq!(texture.texels.len(), (texture.width * texture.height) as usize),
            Err(error) => prop_assert!(error.to_string().len() < 500),
        }
    }
}
