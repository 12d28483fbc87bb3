//! Functions of one number as shaders see them: transfer functions, black bodies, phase functions.

use glam::Vec3;
use tyndall_scene::description::{Optics, Transfer};
use tyndall_scene::phase::PhaseFunction;
use tyndall_scene::{Temperature, black_body};

use crate::{Gpu, RenderError};

/// Entries of a transfer function's table; a value takes the nearest one.
pub(super) const TRANSFER_ENTRIES: u32 = 4096;

/// How much a metre of a medium can change a ray, at most, where its values lie between two [m⁻¹]: its extinction, and its
/// emission for those that do not absorb.
pub(super) fn majorant(optics: &Optics) -> impl Fn(f32, f32) -> f32 {
    let (knots, entry) = match optics {
        Optics::Coefficients { .. } => (Vec::new(), 0.0),
        // As shaders look it up: at the nearest entry.
        Optics::Transfer(transfer) => {
            let (first, last) = domain(transfer);
            (transfer.knots(), (last - first) / (TRANSFER_ENTRIES - 1) as f32)
        }
    };
    move |low, high| match optics {
        Optics::Coefficients { .. } => {
            let most = optics.at(high);
            most.sigma_t().max_element() + most.emission.max_element()
        }
        Optics::Transfer(transfer) => {
            let (low, high) = (low - entry, high + entry);
            // A surface is seen even where nothing absorbs.
            let surface = transfer.isosurfaces.iter().any(|surface| (low..=high).contains(&surface.value));
            let within = knots.iter().copied().filter(|value| (low..=high).contains(value));
            let volume = within.chain([low, high]).map(|value| transfer.sigma_a(value)).fold(0.0, f32::max);
            if surface { volume.max(1.0 / transfer.unit_length) } else { volume }
        }
    }
}

/// The values between which a transfer function changes; never empty.
pub(super) fn domain(transfer: &Transfer) -> (f32, f32) {
    match transfer.knots().as_slice() {
        [first, .., last] if first < last => (*first, *last),
        [only, ..] => (*only, *only + 1.0),
        [] => (0.0, 1.0),
    }
}

/// The gradient [m⁻¹] at which the opacity's factor changes last; `None` where it does not depend on the gradient.
pub(super) fn steepest(transfer: &Transfer) -> Option<f32> {
    transfer.gradient_opacity.last().map(|stop| stop.gradient.max(f32::MIN_POSITIVE))
}

/// The lowest and highest temperature of a grid and of what is around it [K]; never alike.
pub(super) fn temperatures(temperature: &Temperature) -> [f32; 2] {
    let bricks = temperature.grid.grid.bricks().iter();
    let ends = bricks.flat_map(|brick| [brick.low, brick.high]).map(|value| value * temperature.kelvin);
    let ends = ends.chain([0.0]).map(|kelvin| (kelvin + temperature.offset).max(0.0));
    let [low, high] = ends.fold([f32::INFINITY, 0.0], |[low, high], t| [low.min(t), high.max(t)]);
    [low, high.max(low + 1.0)]
}

/// Tables of the media, three rows a medium: the response (colour, the radiance of an opaque body, and extinction [m⁻¹]), or
/// the radiance of a black body; the integral of the response; and the gradient's factor of opacity.
pub(super) async fn transfers(gpu: &Gpu, volumes: &[tyndall_scene::Volume]) -> Result<wgpu::Texture, RenderError> {
    let height = 3 * volumes.len().max(1);
    let mut rows = vec![vec![[0.0; 4]; TRANSFER_ENTRIES as usize]; height];
    for (rows, volume) in rows.chunks_exact_mut(3).zip(volumes) {
        if let Some(temperature) = &volume.temperature {
            let [coldest, hottest] = temperatures(temperature);
            rows[0] = sampled(coldest, hottest, |t| black_body(t) * temperature.radiance_scale, |_| 0.0);
        }
        if let Optics::Transfer(transfer) = &volume.optics {
            let (low, high) = domain(transfer);
            let color = |value| transfer.color(value) * transfer.radiance;
            rows[0] = sampled(low, high, color, |value| transfer.sigma_a(value));
            rows[1] = integrals(&rows[0]);
            if let Some(steepest) = steepest(transfer) {
                rows[2] = sampled(0.0, steepest, |slope| Vec3::splat(transfer.gradient_factor(slope)), |_| 1.0);
            }
        }
    }
    let size = [TRANSFER_ENTRIES, height as u32];
    gpu.table("transfers", size, wgpu::TextureFormat::Rgba32Float, bytemuck::cast_slice(&rows.concat())).await
}

/// Phase functions that are tables, a row a medium, linear between their nodes.
pub(super) async fn phases(gpu: &Gpu, volumes: &[tyndall_scene::Volume]) -> Result<wgpu::Texture, RenderError> {
    let tables = volumes.iter().map(|volume| match &volume.phase {
        PhaseFunction::Table(table) => table.values(),
        _ => &[],
    });
    let width = tables.clone().map(<[_]>::len).max().unwrap_or(0).max(1);
    let mut texels = vec![[0.0; 4]; width * volumes.len().max(1)];
    for (row, values) in texels.chunks_exact_mut(width).zip(tables) {
        for (texel, value) in row.iter_mut().zip(values) {
            *texel = value.extend(0.0).to_array();
        }
    }
    let size = [width as u32, volumes.len().max(1) as u32];
    gpu.table("phases", size, wgpu::TextureFormat::Rgba32Float, bytemuck::cast_slice(&texels)).await
}

/// A function at equal distances from `low` to `high`.
fn sampled(low: f32, high: f32, rgb: impl Fn(f32) -> Vec3, alpha: impl Fn(f32) -> f32) -> Vec<[f32; 4]> {
    let at = |i: u32| low + (high - low) * i as f32 / (TRANSFER_ENTRIES - 1) as f32;
    (0..TRANSFER_ENTRIES).map(at).map(|x| rgb(x).extend(alpha(x)).to_array()).collect()
}

/// The running integral of a table over its entries, the radiance multiplied by the extinction.
fn integrals(response: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let emission = |[r, g, b, sigma]: [f32; 4]| [r * sigma, g * sigma, b * sigma, sigma].map(f64::from);
    let mut sum = [0.0; 4];
    let mut before = emission(response[0]);
    let step = |texel: &[f32; 4]| {
        let here = emission(*texel);
        for c in 0..4 {
            sum[c] += 0.5 * (before[c] + here[c]);
        }
        before = here;
        sum.map(|sum| sum as f32)
    };
    std::iter::once([0.0; 4]).chain(response[1..].iter().map(step)).collect()
}

#[cfg(test)]
mod test {
    use tyndall_scene::description::Stop;

    use super::*;

    /// A value takes the nearest of 4096 entries: half an entry's slope is the most that it can be wrong by.
    #[test]
    fn the_table_is_as_fine_as_it_says() {
        let stop = |value, opacity, color| Stop { value, opacity, color: Some(Vec3::splat(color)) };
        let stops = vec![stop(10.0, 0.0, 0.0), stop(20.0, 0.5, 1.0), stop(60.0, 0.2, 0.5)];
        let transfer = Transfer { unit_length: 1.0, radiance: 1.0, stops, ..Transfer::default() };
        let (low, high) = domain(&transfer);
        let table = sampled(low, high, |value| transfer.color(value), |value| transfer.sigma_a(value));
        let entry = (high - low) / (TRANSFER_ENTRIES - 1) as f32;
        // The steepest slopes: 1 in 10 of the colour, 1/(1 − ½) · 0.5 in 10 of the extinction.
        for i in 0..5000 {
            let value = low + (high - low) * i as f32 / 4999.0;
            let [color, .., sigma] = table[((value - low) / entry + 0.5) as usize];
            assert!((color - transfer.color(value).x).abs() <= 0.5 * entry * 0.1 * 1.01);
            assert!((sigma - transfer.sigma_a(value)).abs() <= 0.5 * entry * 0.1 * 1.01);
        }
    }

    /// The bound of a range of values is that of all its entries, and not much more.
    #[test]
    fn majorants_bound() {
        let stop = |value, opacity| Stop { value, opacity, color: Some(Vec3::ONE) };
        let stops = vec![stop(0.0, 0.0), stop(1.0, 0.0), stop(1.5, 0.6), stop(2.0, 0.0)];
        let optics = Optics::Transfer(Transfer { unit_length: 1.0, radiance: 1.0, stops, ..Transfer::default() });
        let bound = majorant(&optics);
        assert_eq!(bound(0.0, 0.9), 0.0);
        assert_eq!(bound(2.1, 3.0), 0.0);
        assert!((bound(0.0, 3.0) - 0.6f32.mul_add(-1.0, 1.0).ln().abs()).abs() < 1e-3);
        assert!(bound(1.2, 1.3) > 0.2 && bound(1.2, 1.3) < 0.6);
    }
}
