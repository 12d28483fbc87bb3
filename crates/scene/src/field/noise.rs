//! Gradient noise on an integer lattice [Perlin85; Perlin02], and its fractal sum [Musgrave03]. The twin in WGSL is
//! `crates/render/src/math/noise.wesl`: gradients come of integer arithmetic, so that both see the same noise.

use glam::{UVec3, Vec3};

/// The most octaves of a fractal.
pub const MAX_OCTAVES: u32 = 12;

/// The largest coordinate on the finest lattice of a fractal: 1/8 of a cell is still told apart there.
pub const MAX_COORDINATE: f32 = (1 << 20) as f32;

/// Three random numbers of three [Jarzynski20, pcg3d].
pub fn pcg3d(v: UVec3) -> UVec3 {
    let mix = |v: UVec3| {
        let x = v.x.wrapping_add(v.y.wrapping_mul(v.z));
        let y = v.y.wrapping_add(v.z.wrapping_mul(x));
        UVec3::new(x, y, v.z.wrapping_add(x.wrapping_mul(y)))
    };
    let v = mix(v.map(|n| n.wrapping_mul(1_664_525).wrapping_add(1_013_904_223)));
    mix(v ^ (v >> 16u32))
}

/// Gradient noise, of mean 0, within ±`LARGEST` and 0 at lattice points. `x` is in lattice cells; each `key` has a noise of
/// its own.
pub fn gradient_noise(x: Vec3, key: UVec3) -> f32 {
    let low = x.floor();
    let t = x - low;
    let ramp = |corner: UVec3| gradient(low, corner, key).dot(t - corner.as_vec3());
    let s = fade(t);
    trilinear(ramp, |a, b, axis| a * (1.0 - s[axis]) + b * s[axis])
}

/// |noise| ≤ 3/2: a mean, of weights w, of g·d with |g| ≤ √3, so at most √3·√(Σ w d²); along an axis Σ w d² is
/// ¼ − 11/4 u² + 10 u⁴ − 12 u⁶ ≤ ¼, with u = t − ½.
const LARGEST: f32 = 1.5;

/// The gradient at a corner of the cell at `low`: evenly distributed in [−1, 1]³.
fn gradient(low: Vec3, corner: UVec3, key: UVec3) -> Vec3 {
    (hash(low, corner, key) >> 8u32).as_vec3() * (1.0 / 8_388_608.0) - 1.0
}

/// Three random numbers of a corner of the cell at `low`.
pub(super) fn hash(low: Vec3, corner: UVec3, key: UVec3) -> UVec3 {
    // Beyond 2³⁰ a float has no fraction, and the noise is that of a lattice point.
    let cell = low.clamp(Vec3::splat(-1073741824.0), Vec3::splat(1073741824.0)).as_ivec3().as_uvec3();
    pcg3d(cell.wrapping_add(corner).wrapping_add(key))
}

/// 6t⁵ − 15t⁴ + 10t³ [Perlin02].
pub(super) fn fade(t: Vec3) -> Vec3 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Interpolates between the corners of a cell, along x, then y, then z.
fn trilinear<T>(at: impl Fn(UVec3) -> T, mix: impl Fn(T, T, usize) -> T) -> T {
    let edge = |y, z| mix(at(UVec3::new(0, y, z)), at(UVec3::new(1, y, z)), 0);
    let face = |z| mix(edge(0, z), edge(1, z), 1);
    mix(face(0), face(1), 2)
}

/// The bounds of [`gradient_noise`] over a box. In a cell the noise interpolates between linear functions with weights that
/// grow along each axis: what interpolation gives of their bounds, at the ends of the box, bounds it.
fn noise_range(low: Vec3, high: Vec3, key: UVec3) -> [f32; 2] {
    let (first, last) = (low.floor(), high.floor());
    if (last - first).max_element() > 1.0 {
        return [-LARGEST, LARGEST];
    }
    let steps = (last - first).as_uvec3();
    let mut range = [f32::INFINITY, f32::NEG_INFINITY];
    for i in 0..8 {
        let step = UVec3::new(i & 1, i >> 1 & 1, i >> 2);
        if step.cmpgt(steps).any() {
            continue;
        }
        let cell = first + step.as_vec3();
        let (a, b) = ((low - cell).max(Vec3::ZERO), (high - cell).min(Vec3::ONE));
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let (s, e) = (fade(a), fade(b));
        let ramp = |corner: UVec3| {
            let g = gradient(cell, corner, key);
            let (center, reach) = (g.dot(middle - corner.as_vec3()), g.abs().dot(half));
            [center - reach, center + reach]
        };
        let here = trilinear(ramp, |a, b, axis| {
            let mix = |end: usize, s: f32| a[end] * (1.0 - s) + b[end] * s;
            [mix(0, s[axis]).min(mix(0, e[axis])), mix(1, s[axis]).max(mix(1, e[axis]))]
        });
        range = [range[0].min(here[0]), range[1].max(here[1])];
    }
    range.map(|value| value.clamp(-LARGEST, LARGEST))
}

/// Fractional Brownian motion: octaves of noise, each finer and weaker than the one before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fractal {
    /// How many, at most [`MAX_OCTAVES`].
    pub octaves: u32,
    /// Amplitude of an octave relative to the one before, 0 to 1.
    pub gain: f32,
    /// Frequency of an octave relative to the one before.
    pub lacunarity: f32,
    /// Each has a noise of its own.
    pub seed: u32,
}

impl Fractal {
    /// Σ gain^k · noise(lacunarity^k · x + shift_k), k from 0; `x` in cells of the coarsest lattice.
    pub fn value(&self, x: Vec3) -> f32 {
        self.layers().map(|layer| layer.amplitude * gradient_noise(layer.place(x), layer.key)).sum()
    }

    /// Bounds of the values in a box.
    pub fn range(&self, low: Vec3, high: Vec3) -> [f32; 2] {
        // Of the largest possible value: roundings of some sums of some numbers.
        const MARGIN: f32 = 4e-6;
        self.layers().fold([0.0; 2], |sum, layer| {
            let range = noise_range(layer.place(low), layer.place(high), layer.key);
            let margin = layer.amplitude * LARGEST * MARGIN;
            [sum[0] + layer.amplitude * range[0] - margin, sum[1] + layer.amplitude * range[1] + margin]
        })
    }

    fn layers(&self) -> impl Iterator<Item = Layer> {
        let (mut amplitude, mut frequency) = (1.0, 1.0);
        let Self { octaves, gain, lacunarity, seed } = *self;
        (0..octaves).map(move |k| {
            let layer = Layer { amplitude, frequency, key: pcg3d(UVec3::new(seed, k, 0)) };
            amplitude *= gain;
            frequency *= lacunarity;
            layer
        })
    }
}

/// One octave.
struct Layer {
    amplitude: f32,
    frequency: f32,
    key: UVec3,
}

impl Layer {
    /// A position on the octave's lattice, which is shifted by a part of a cell, lest all octaves be 0 at the same points.
    fn place(&self, x: Vec3) -> Vec3 {
        x * self.frequency + (self.key >> 8u32).as_vec3() * (1.0 / 16_777_216.0)
    }
}

/// What of a fractal lies above a threshold: max(0, fractal(x) − threshold), x = `origin` + unit·`extent`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// The sum of octaves.
    pub fractal: Fractal,
    /// What counts as 0.
    pub threshold: f32,
    /// The box's lowest corner, in cells of the coarsest lattice.
    pub origin: Vec3,
    /// The box's size, in cells of the coarsest lattice.
    pub extent: Vec3,
}

impl Noise {
    /// The density at a position in the unit cube.
    pub fn value(&self, unit: Vec3) -> f32 {
        (self.fractal.value(self.place(unit)) - self.threshold).max(0.0)
    }

    /// Bounds of the density in a box.
    pub fn range(&self, low: Vec3, high: Vec3) -> [f32; 2] {
        self.fractal.range(self.place(low), self.place(high)).map(|value| (value - self.threshold).max(0.0))
    }

    fn place(&self, unit: Vec3) -> Vec3 {
        self.origin + unit * self.extent
    }
}
