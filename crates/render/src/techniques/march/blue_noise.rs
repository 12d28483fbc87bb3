//! Blue noise: neighbouring pixels differ as much as they can, so that the error of jittered samples has no large patches.

use crate::{Gpu, RenderError};

/// Pixels a side of the tile, which repeats.
const SIDE: usize = 64;

/// The tile as a texture of values in [0, 1); of one texel where nothing is jittered.
pub(super) async fn texture(gpu: &Gpu, jitter: bool) -> Result<wgpu::Texture, RenderError> {
    let side = if jitter { SIDE } else { 1 };
    let ranks = if jitter { tile() } else { vec![0] };
    let values: Vec<f32> = ranks.iter().map(|&rank| (rank as f32 + 0.5) / (side * side) as f32).collect();
    let format = wgpu::TextureFormat::R32Float;
    gpu.table("blue noise", [side as u32; 2], format, bytemuck::cast_slice(&values)).await
}

/// The pixels' ranks, by the void-and-cluster method [Ulichney93]: from an even pattern, the pixel in the tightest cluster
/// is taken away again and again to rank those below it, and the one in the largest void is filled to rank those above.
fn tile() -> Vec<u32> {
    const COUNT: usize = SIDE * SIDE;
    let mut field = Field::new();
    // A tenth of the pixels, at first spread by irrational steps.
    for i in 0..COUNT / 10 {
        let at = |step: f64| ((i as f64 * step).fract() * SIDE as f64) as usize;
        field.set(at(0.754_877_666) + SIDE * at(0.569_840_291), true);
    }
    loop {
        let cluster = field.extreme(true);
        field.set(cluster, false);
        let void = field.extreme(false);
        field.set(void, true);
        if void == cluster {
            break;
        }
    }
    let even = field.clone();
    let ones = even.on.iter().filter(|&&on| on).count();
    let mut ranks = vec![0; COUNT];
    for rank in (0..ones).rev() {
        let cluster = field.extreme(true);
        field.set(cluster, false);
        ranks[cluster] = rank as u32;
    }
    field = even;
    for rank in ones..COUNT {
        let void = field.extreme(false);
        field.set(void, true);
        ranks[void] = rank as u32;
    }
    ranks
}

/// A pattern of pixels, and how crowded each place is.
#[derive(Clone)]
struct Field {
    on: Vec<bool>,
    energy: Vec<f32>,
    /// Gaussian of the distance on the torus, from pixel 0.
    kernel: Vec<f32>,
}

impl Field {
    fn new() -> Self {
        const VARIANCE: f32 = 1.5 * 1.5;
        let squared = |i: usize| (i.min(SIDE - i) * i.min(SIDE - i)) as f32;
        let gaussian = |i: usize| (-(squared(i % SIDE) + squared(i / SIDE)) / (2.0 * VARIANCE)).exp();
        let kernel = (0..SIDE * SIDE).map(gaussian).collect();
        Self { on: vec![false; SIDE * SIDE], energy: vec![0.0; SIDE * SIDE], kernel }
    }

    fn set(&mut self, at: usize, on: bool) {
        if self.on[at] == on {
            return;
        }
        self.on[at] = on;
        let sign = if on { 1.0 } else { -1.0 };
        let (x, y) = (at % SIDE, at / SIDE);
        for row in 0..SIDE {
            let from = (row + SIDE - y) % SIDE * SIDE;
            for column in 0..SIDE {
                self.energy[row * SIDE + column] += sign * self.kernel[from + (column + SIDE - x) % SIDE];
            }
        }
    }

    /// The most crowded pixel that is on, or the least crowded that is off.
    fn extreme(&self, on: bool) -> usize {
        let sign = if on { 1.0 } else { -1.0 };
        let all = (0..self.on.len()).filter(|&i| self.on[i] == on);
        all.max_by(|&a, &b| (sign * self.energy[a]).total_cmp(&(sign * self.energy[b]))).unwrap_or(0)
    }
}

#[cfg(test)]
mod test {
    use super::*;

    /// Every rank once; and the mean over 4 x 4 pixels varies far less than that of independent numbers would, 1/12/16.
    #[test]
    fn the_noise_is_blue() {
        let ranks = tile();
        let mut sorted = ranks.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(i, &rank)| rank == i as u32));
        let variance = |value: &dyn Fn(usize, usize) -> f64| {
            let means = (0..SIDE * SIDE).map(|i| {
                let block = (0..16).map(|k| value((i % SIDE + k % 4) % SIDE, (i / SIDE + k / 4) % SIDE));
                block.sum::<f64>() / 16.0 - 0.5
            });
            means.map(|mean| mean * mean).sum::<f64>() / (SIDE * SIDE) as f64
        };
        let blue = variance(&|x, y| (f64::from(ranks[y * SIDE + x]) + 0.5) / (SIDE * SIDE) as f64);
        let ramp = variance(&|x, y| ((y * SIDE + x) as f64 + 0.5) / (SIDE * SIDE) as f64);
        assert!(blue < 0.25 / 12.0 / 16.0 && ramp > 1.0 / 12.0 / 16.0, "{blue} {ramp}");
    }
}
