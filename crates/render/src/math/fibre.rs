//! The Rust twin of `fibre.wesl`.

use super::slab::mean_transmittance;

/// Opacity per unit of extinction in the mean over a part of a fibre's width, of which x goes from −1 to 1, where a ray has the
/// depth `depth`·√(1 − x²): by so many rectangles over ψ, where x = sin ψ.
pub fn fibre_opacity(part: [f64; 2], depth: f64, extinction: f64, rectangles: u32) -> f64 {
    let [from, to] = part.map(|x| x.clamp(-1.0, 1.0).asin());
    let (mut sum, mut width) = (0.0, 0.0);
    for i in 0..rectangles {
        let cosine = (from + (to - from) * (f64::from(i) + 0.5) / f64::from(rectangles)).cos();
        let there = depth * cosine;
        sum += cosine * there * mean_transmittance(extinction * there);
        width += cosine;
    }
    sum / width
}
