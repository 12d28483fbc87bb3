//! Turbulence without sources: the curl of noise.

use glam::{UVec3, Vec3};

use super::noise::{fade, hash, pcg3d};

/// A velocity field that is the curl of a vector potential, so that its divergence is 0 [Bridson07]. Each component of the
/// potential is gradient noise on the lattice of [`gradient_noise`](super::gradient_noise), of a hash that all three share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curl {
    /// How many sizes of eddies there are, each half as large as the one before and 2^(−1/3) times as fast, as in an
    /// inertial range [Kolmogorov41].
    pub octaves: u32,
    /// Each has a field of its own.
    pub seed: u32,
}

/// The root mean square of the curl of one octave, measured over many points.
const ROOT_MEAN_SQUARE: f32 = 1.2206;

impl Curl {
    /// The velocity at `x`, in cells of the coarsest lattice. Its root mean square over space is 1.
    pub fn value(&self, x: Vec3) -> Vec3 {
        let (mut sum, mut power) = (Vec3::ZERO, 0.0);
        let (mut frequency, mut speed) = (1.0, 1.0);
        for octave in 0..self.octaves {
            let key = pcg3d(UVec3::new(self.seed, octave, 1));
            // As in a fractal: lest all octaves be 0 at the same points.
            let shift = (key >> 8u32).as_vec3() * (1.0 / 16_777_216.0);
            sum += speed * curl(x * frequency + shift, key);
            power += speed * speed;
            frequency *= 2.0;
            speed *= 0.5f32.cbrt();
        }
        sum / (ROOT_MEAN_SQUARE * power.sqrt())
    }
}

/// ∇ × ψ.
fn curl(x: Vec3, key: UVec3) -> Vec3 {
    let [a, b, c] = slopes(x, key);
    Vec3::new(c.y - b.z, a.z - c.x, b.x - a.y)
}

/// The gradients of the three components of ψ. Each is Σ w·g·(t − corner) over the corners of a cell, with w the product
/// over the axes of fade(t) or 1 − fade(t): its gradient is Σ w·g + ∇w·(g·(t − corner)).
fn slopes(x: Vec3, key: UVec3) -> [Vec3; 3] {
    let low = x.floor();
    let t = x - low;
    let s = fade(t);
    // 30t⁴ − 60t³ + 30t².
    let slope = 30.0 * t * t * (t * (t - 2.0) + 1.0);
    let mut sums = [Vec3::ZERO; 3];
    for i in 0..8 {
        let corner = UVec3::new(i & 1, i >> 1 & 1, i >> 2);
        let far = corner.as_vec3();
        let weight = far * s + (1.0 - far) * (1.0 - s);
        let rise = slope * (2.0 * far - 1.0);
        let w = weight.x * weight.y * weight.z;
        let dw = rise * Vec3::new(weight.y * weight.z, weight.z * weight.x, weight.x * weight.y);
        let bits = hash(low, corner, key).to_array();
        for (sum, bits) in sums.iter_mut().zip(bits) {
            let g = gradient(bits);
            *sum += w * g + dw * g.dot(t - far);
        }
    }
    sums
}

/// Evenly distributed in [−1, 1]³, of 10 bits a component.
fn gradient(bits: u32) -> Vec3 {
    UVec3::new(bits >> 22, bits >> 12 & 1023, bits >> 2 & 1023).as_vec3() * (1.0 / 512.0) - (1.0 - 0.5 / 512.0)
}

#[cfg(test)]
mod test {
    use super::*;

    fn somewhere(i: u32) -> Vec3 {
        (pcg3d(UVec3::new(i, 17, 4)) >> 8u32).as_vec3() * (80.0 / 16_777_216.0) - 40.0
    }

    /// div v = 0, by central differences, whose error is that of single precision; ∂v/∂x is of the order of 1.
    #[test]
    fn nothing_wells_up() {
        let curl = Curl { octaves: 3, seed: 5 };
        let h = 1.0 / 128.0;
        let (mut worst, mut steepest) = (0.0f32, 0.0f32);
        for i in 0..2000 {
            let x = somewhere(i) * 0.1;
            let slope = |axis: Vec3| (curl.value(x + h * axis) - curl.value(x - h * axis)).dot(axis) / (2.0 * h);
            let parts = [Vec3::X, Vec3::Y, Vec3::Z].map(slope);
            worst = worst.max(parts.iter().sum::<f32>().abs());
            steepest = steepest.max(parts[0].abs());
        }
        assert!(worst < 0.02 * steepest, "divergence {worst}, of slopes up to {steepest}");
    }

    /// The analytic slopes are those of the potential, and velocities have a root mean square of 1.
    #[test]
    fn velocities_are_normal() {
        for octaves in [1, 4] {
            let curl = Curl { octaves, seed: 3 };
            let n = 40_000;
            let mean = (0..n).map(|i| curl.value(somewhere(i)).length_squared()).sum::<f32>() / n as f32;
            assert!((mean.sqrt() - 1.0).abs() < 0.02, "{octaves} octaves: {}", mean.sqrt());
        }
        assert_ne!(Curl { octaves: 1, seed: 1 }.value(Vec3::ONE), Curl { octaves: 1, seed: 2 }.value(Vec3::ONE));
    }
}
