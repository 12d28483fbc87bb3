//! Haar's wavelets.

use super::Linear;

/// 1, then ψ_{j,m} = 2^{j/2} on the left half of [m, m + 1]/2^j and −2^{j/2} on the right, for number 2^j + m [Haar10]. As many as
/// a power of two span what so many [`Slices`](super::Slices) do, and say the same of a ray; any other count is finer at its front.
#[derive(Clone, Copy, Debug)]
pub struct Haar {
    /// Functions, the constant among them; at least 1.
    pub count: usize,
}

impl Linear for Haar {
    fn count(&self) -> usize {
        self.count
    }

    fn dual(&self, k: usize, z: f64) -> f64 {
        if k == 0 {
            return 1.0;
        }
        let (scale, place) = within(k, z);
        // The last wavelet of a level has both its ends.
        let inside = (0.0..1.0).contains(&place) || (place == 1.0 && z == 1.0);
        if !inside {
            return 0.0;
        }
        if place < 0.5 { scale.sqrt() } else { -scale.sqrt() }
    }

    fn dual_integral(&self, k: usize, z: f64) -> f64 {
        self.integral(k, z)
    }

    fn integral(&self, k: usize, d: f64) -> f64 {
        if k == 0 {
            return d;
        }
        let (scale, place) = within(k, d);
        place.min(1.0 - place).max(0.0) / scale.sqrt()
    }
}

/// 2^j of wavelet k, and where z is in its interval: from 0 to 1 if inside.
fn within(k: usize, z: f64) -> (f64, f64) {
    let level = 1 << k.ilog2();
    (level as f64, z * level as f64 - (k - level) as f64)
}
