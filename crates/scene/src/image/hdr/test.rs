use proptest::prelude::*;

use super::*;

const ENOUGH: Budget = Budget(1 << 20);
const HEADER: &str = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";

/// A file of 16 × 4 pixels that Mitsuba 3.9.1 wrote, in runs: `Bitmap(a).write(..)` with a[y][x] = (x, y, xy)/8, and
/// 1000 for every channel in the last row.
const MITSUBA: &[u8] = include_bytes!("../fixtures/mitsuba.hdr");

fn file(header: &str, size: &str, pixels: &[u8]) -> Vec<u8> {
    [header.as_bytes(), size.as_bytes(), b"\n", pixels].concat()
}

fn message(bytes: &[u8]) -> String {
    decode(bytes, ENOUGH).map_or_else(|error| error.to_string(), |image| format!("{image:?}"))
}

/// Within the half unit of 8 bits under the largest channel.
#[test]
fn another_writer() {
    let image = decode(MITSUBA, ENOUGH).unwrap();
    assert_eq!((image.width, image.height), (16, 4));
    for (i, found) in image.pixels.iter().enumerate() {
        let (x, y) = ((i % 16) as f32, (i / 16) as f32);
        let truth = if y == 3.0 { [1000.0; 3] } else { [x, y, x * y].map(|v| v / 8.0) };
        let unit = truth.into_iter().fold(0.0, f32::max) / 128.0;
        assert!(found.iter().zip(truth).all(|(a, b)| (a - b).abs() <= unit), "{x}, {y}: {found:?}, {truth:?}");
    }
}

/// Mantissa times 2^(e−136), divided by exposures and colour corrections; e = 0 is black.
#[test]
fn values() {
    let header = "#?RGBE\n# a comment\nmade by hand\nEXPOSURE=2\nEXPOSURE= 0.5\nCOLORCORR=1 2 4\r\nEXPOSURE=2\n\n";
    let bytes = file(header, "-Y 1 +X 3", &[128, 64, 32, 129, 128, 64, 32, 0, 255, 0, 1, 136]);
    let image = decode(&bytes, ENOUGH).unwrap();
    assert_eq!(image.pixels, [[0.5, 0.125, 0.03125], [0.0; 3], [127.5, 0.0, 0.125]]);
}

/// Runs of the old style: a count of 2, then 1·2⁸ more.
#[test]
fn old_runs() {
    let pixels = [[9, 8, 7, 130], [1, 1, 1, 2], [1, 1, 1, 1], [6, 6, 6, 130]].concat();
    let image = decode(&file(HEADER, "-Y 1 +X 260", &pixels), ENOUGH).unwrap();
    assert!(image.pixels[..259].iter().all(|pixel| *pixel == image.pixels[0]));
    assert_eq!(image.pixels[259], [6.0 / 64.0; 3]);
    assert!(message(&file(HEADER, "-Y 1 +X 259", &pixels)).contains("259"), "what follows a picture is ignored");
}

#[test]
fn what_is_refused() {
    let size = "-Y 2 +X 8";
    let line = [2, 2, 0, 8, 136, 1, 136, 2, 136, 3, 136, 4];
    let bad_run = [2, 2, 0, 8, 137, 1];
    let endless = [[5; 4], [1, 1, 1, 0]].concat().into_iter().chain([1, 1, 1, 0].repeat(9)).collect::<Vec<u8>>();
    for (bytes, expected) in [
        (file("#?RADIANC\n\n", size, &[]), "Radiance: it does not begin with #?RADIANCE or #?RGBE"),
        (b"#?RADIANCE\nEXPOSURE=1".to_vec(), "Radiance: it ends within its header"),
        (
            file("#?RGBE\nFORMAT=32-bit_rle_xyze\n\n", size, &[]),
            "found FORMAT=\"32-bit_rle_xyze\"; accepted: 32-bit_rle_rgbe",
        ),
        (file("#?RGBE\nEXPOSURE=0\n\n", size, &[]), "found EXPOSURE=\"0\"; accepted: a number > 0"),
        (file("#?RGBE\nCOLORCORR=1 2\n\n", size, &[]), "found COLORCORR=\"1 2\"; accepted: three numbers > 0"),
        (file("#?RGBE\nPRIMARIES=.7 .3 .2 .8 .1 0 .3 .3\n\n", size, &[]), "accepted: those of Rec. 709"),
        (
            file(HEADER, "+X 8 -Y 2", &[]),
            "found the size \"+X 8 -Y 2\"; accepted: -Y HEIGHT +X WIDTH, rows from the top",
        ),
        (file(HEADER, "-Y 2 +X -8", &[]), "found the size \"-Y 2 +X -8\""),
        (file(HEADER, "-Y 0 +X 8", &[]), "the image is empty (8×0 pixels)"),
        (file(HEADER, "-Y 4294967295 +X 4294967295", &[]), "an image of 4294967295×4294967295 pixels was found"),
        (file(HEADER, "-Y 10000 +X 10000", &[]), "claims to hold 1200000000 bytes of pixels: it is damaged"),
        (file(HEADER, "-Y 400 +X 400", &[]), "needs 1921600 bytes; the budget is 1048576"),
        (file(HEADER, size, &line), "Radiance: it ends too early, in row 1 of 2"),
        (file(HEADER, size, &[2, 2, 0, 9, 0]), "Radiance: found 9 pixels; accepted: 8, in row 0 of 2"),
        (file(HEADER, size, &bad_run), "Radiance: found a run of 9 bytes at pixel 0, in row 0 of 2"),
        (file(HEADER, size, &[2, 2, 0, 8, 0, 1]), "found a run of 0 bytes at pixel 0"),
        (file(HEADER, size, &[5, 5, 5, 5, 1, 1, 1, 8]), "Radiance: found a run beyond the line at pixel 1"),
        (file(HEADER, size, &endless), "Radiance: found a run beyond the line at pixel 1"),
    ] {
        let message = message(&bytes);
        assert!(message.contains(expected), "{message}\n  should contain {expected}");
    }
}

#[test]
fn every_truncation() {
    for end in 0..MITSUBA.len() {
        assert!(decode(&MITSUBA[..end], ENOUGH).is_err(), "{end} bytes");
    }
}

proptest! {
    /// Bytes changed anywhere, and any bytes after a header, give a picture or an error.
    #[test]
    fn damage(changes in prop::collection::vec((0..MITSUBA.len(), any::<u8>()), 1..20)) {
        let mut bytes = MITSUBA.to_vec();
        for (at, value) in changes {
            bytes[at] = value;
        }
        let _ = decode(&bytes, ENOUGH);
    }

    #[test]
    fn noise(width in 0u32..40, height in 0u32..9, pixels in prop::collection::vec(prop_oneof![0u8..4, any::<u8>()], 0..300)) {
        if let Ok(image) = decode(&file(HEADER, &format!("-Y {height} +X {width}"), &pixels), ENOUGH) {
            image.check().unwrap();
        }
    }
}
