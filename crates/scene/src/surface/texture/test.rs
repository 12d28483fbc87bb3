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

/// At the first texture coordinates.
fn at(map: &Map, uv: Vec2) -> Vec4 {
    map.at([uv, Vec2::NAN])
}

#[test]
fn texels_are_rows_from_the_top() {
    let texture = Texture::decode(&picture(ImageFormat::Png), false, BUDGET).unwrap();
    assert_eq!((texture.width, texture.height, texture.bytes()), (2, 2, 16));
    let texture = Map::new(texture);
    assert_eq!(at(&texture, Vec2::new(0.25, 0.25)), Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert_eq!(at(&texture, Vec2::new(0.75, 0.25)), Vec4::new(0.0, 1.0, 0.0, 1.0));
    assert_eq!(at(&texture, Vec2::new(0.25, 0.75)), Vec4::new(0.0, 0.0, 1.0, 1.0));
    // Between texels, and repeated.
    assert_eq!(at(&texture, Vec2::new(0.5, 0.25)), Vec4::new(0.5, 0.5, 0.0, 1.0));
    assert_eq!(at(&texture, Vec2::new(3.0, -0.75)), Vec4::new(0.5, 0.5, 0.0, 1.0));
    let jpeg = Texture::decode(&picture(ImageFormat::Jpeg), true, BUDGET).unwrap();
    assert_eq!((jpeg.width, jpeg.height), (2, 2));
    assert!(jpeg.texels.iter().all(|texel| texel[3] == 255));
}

/// Of a row of texels 0, 51, 102, against a walk over texels by the definition of each mode.
#[test]
fn beyond_the_edges() {
    let row = Texture { width: 3, height: 1, texels: [0, 51, 102].map(|r| [r, 0, 0, 255]).to_vec(), srgb: false };
    let texel = |wrap: Wrap, i: i64| match wrap {
        Wrap::Repeat => i.rem_euclid(3),
        Wrap::Mirror => [0, 1, 2, 2, 1, 0][i.rem_euclid(6) as usize],
        Wrap::Clamp => i.clamp(0, 2),
    };
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        let map = Map { wrap: [wrap, Wrap::Repeat], ..Map::new(row.clone()) };
        for step in -400..400 {
            let u = step as f32 / 60.0;
            let place = u * 3.0 - 0.5;
            let [a, b] = [0, 1].map(|next| 0.2 * texel(wrap, place.floor() as i64 + next) as f32);
            let expected = a + (b - a) * (place - place.floor());
            let found = at(&map, Vec2::new(u, 0.3)).x;
            assert!((found - expected).abs() < 1e-5, "{wrap:?} at {u}: {found} is not {expected}");
        }
    }
    // Whatever a file says, there is a colour.
    for u in [f32::INFINITY, f32::NAN, f32::MAX, -f32::MAX] {
        assert!(at(&Map::new(row.clone()), Vec2::splat(u)).is_finite());
    }
}

#[test]
fn places_of_the_second_set() {
    let transform = Affine2::from_translation(Vec2::new(1.0, 2.0)) * Affine2::from_scale(Vec2::new(3.0, 4.0));
    let texture = Texture { width: 1, height: 1, texels: vec![[0; 4]], srgb: false };
    let map = Map { transform, second: true, ..Map::new(texture) };
    assert_eq!(map.place([Vec2::NAN, Vec2::new(0.5, 0.25)]), Vec2::new(2.5, 3.0));
}

/// sRGB 188 is about half the light, alpha is linear.
#[test]
fn colours_are_linear_after_decoding() {
    let texture = Texture { width: 1, height: 1, texels: vec![[188, 0, 255, 188]], srgb: true };
    let value = at(&Map::new(texture.clone()), Vec2::ZERO);
    assert!((value.x - 0.5).abs() < 0.005, "{value}");
    assert_eq!([value.y, value.z, value.w], [0.0, 1.0, 188.0 / 255.0]);
    assert_eq!(at(&Map::new(Texture { srgb: false, ..texture }), Vec2::ZERO).x, 188.0 / 255.0);
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
