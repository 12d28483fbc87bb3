//! Paints the shipped sky, `scenes/sky.exr`: a clear afternoon as half floats, 256 × 128 texels, in the public domain (CC0).
//!
//! ```text
//! cargo run -p tyndall-scene --example sky -- scenes/sky.exr
//! ```
//!
//! The sun is soft, a few degrees wide, and only some hundred times as bright as the sky: a sky for few samples.

use std::error::Error;
use std::path::PathBuf;

use exr::prelude::{
    Blocks, Compression, Encoding, Image, Layer, LayerAttributes, LineOrder, SpecificChannels, Vec2, WritableImage as _,
};
use glam::{DVec2, DVec3, Vec3};
use half::f16;
use tyndall_scene::EnvironmentMap;

const WIDTH: u32 = 256;
const HEIGHT: u32 = 128;

/// Towards the sun: where the plume's directional light comes from.
const SUN: Vec3 = Vec3::new(-0.72, 0.48, 0.1);

fn main() -> Result<(), Box<dyn Error>> {
    let path: PathBuf = std::env::args_os().nth(1).ok_or("accepted: the file to write")?.into();
    // The map's own convention says which direction a texel is.
    let map = EnvironmentMap { width: WIDTH, height: HEIGHT, pixels: Vec::new(), rotation: 0.0 };
    let channels = SpecificChannels::rgb(|Vec2(x, y)| {
        let center = (DVec2::new(x as f64, y as f64) + 0.5) / DVec2::new(WIDTH.into(), HEIGHT.into());
        let [r, g, b] = radiance(map.direction(center)).to_array().map(f16::from_f64);
        (r, g, b)
    });
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let layer = Layer::new((WIDTH as usize, HEIGHT as usize), LayerAttributes::default(), encoding, channels);
    Ok(Image::from_layer(layer).write().to_file(path)?)
}

/// The radiance from a unit direction [W·sr⁻¹·m⁻²].
fn radiance(direction: DVec3) -> DVec3 {
    let zenith = DVec3::new(0.22, 0.42, 0.90);
    let horizon = DVec3::new(0.85, 0.95, 1.05);
    let ground = DVec3::new(0.16, 0.14, 0.11);
    let sunlight = DVec3::new(1.0, 0.9, 0.75);

    let from_sun = direction.angle_between(SUN.as_dvec3()).to_degrees();
    let glow = sunlight * 0.9 * (-from_sun / 15.0).exp();
    let disc = sunlight * 400.0 * (1.0 - smoothstep(1.5, 4.5, from_sun));
    let sky = horizon.lerp(zenith, direction.y.max(0.0).powf(0.6)) + glow + disc;
    // A hazy horizon, two degrees wide.
    ground.lerp(sky, smoothstep(-1.0, 1.0, direction.y.asin().to_degrees()))
}

fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
