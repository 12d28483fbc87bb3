//! The environment map as a light: directions in proportion to what comes from them.
//!
//! Between the centres of four texels the map is bilinear, so it is cut into cells there: w columns and, with the half rows
//! at the poles, h + 1 rows. A cell is chosen in proportion to the mean of its corners times its solid angle, and a direction
//! in it uniformly. Where light comes from, the density is positive, and nowhere is radiance over density more than four times
//! the integral of the radiance.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use tyndall_scene::EnvironmentMap;

use crate::Random;

/// An environment map with its distribution.
pub struct Sky {
    map: Arc<EnvironmentMap>,
    /// Running sum of the cells' powers, row by row, without the leading 0.
    sums: Vec<f64>,
}

impl Sky {
    /// Sums up a map.
    pub fn new(map: Arc<EnvironmentMap>) -> Self {
        let (width, height) = (map.width as usize, map.height as usize);
        // All channels count the same in the error of a picture. No sum of 32-bit numbers overflows.
        let power = |row: usize, column: usize| {
            map.pixels[row * width + column % width].iter().map(|&x| f64::from(x)).sum::<f64>()
        };
        let mut sums = Vec::with_capacity(width * (height + 1));
        let mut sum = 0.0;
        for row in 0..=height {
            let (upper, lower) = (row.saturating_sub(1), row.min(height - 1));
            let [top, bottom] = cosines(row, height);
            for column in 0..width {
                let corners = [upper, lower].map(|row| power(row, column) + power(row, column + 1));
                sum += (corners[0] + corners[1]) * (top - bottom);
                sums.push(sum);
            }
        }
        Self { map, sums }
    }

    /// The radiance from a unit direction [W·sr⁻¹·m⁻²].
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        self.map.radiance(direction.as_vec3()).as_dvec3()
    }

    /// A random direction to the light, and its density [sr⁻¹]; `None` where all is black.
    pub fn sample(&self, rng: &mut Random) -> Option<(DVec3, f64)> {
        let total = *self.sums.last()?;
        let chosen = rng.uniform() * total;
        let cell = self.sums.partition_point(|&sum| sum <= chosen);
        let (width, height) = (self.map.width as usize, self.map.height as usize);
        // Rounding may give the total itself.
        let cell = (total > 0.0).then_some(cell.min(self.sums.len() - 1))?;
        let [top, bottom] = cosines(cell / width, height);
        let v = (bottom + (top - bottom) * rng.uniform()).clamp(-1.0, 1.0).acos() / PI;
        let u = ((cell % width) as f64 + 0.5 + rng.uniform()) / width as f64;
        Some((self.map.direction(DVec2::new(u, v)), self.density(cell)))
    }

    /// The density of [`Sky::sample`] in a unit direction [sr⁻¹].
    pub fn pdf(&self, direction: DVec3) -> f64 {
        let (width, height) = (self.map.width as usize, self.map.height as usize);
        let uv = self.map.uv(direction);
        let column = (uv.x * width as f64 - 0.5).rem_euclid(width as f64) as usize;
        let row = (uv.y * height as f64 + 0.5) as usize;
        self.density(row.min(height) * width + column.min(width - 1))
    }

    /// The density in a cell [sr⁻¹].
    fn density(&self, cell: usize) -> f64 {
        let (width, height) = (self.map.width as usize, self.map.height as usize);
        let Some(&total) = self.sums.last().filter(|&&total| total > 0.0) else { return 0.0 };
        let before = if cell == 0 { 0.0 } else { self.sums[cell - 1] };
        let [top, bottom] = cosines(cell / width, height);
        (self.sums[cell] - before) / total * width as f64 / (TAU * (top - bottom))
    }
}

/// The cosines of the angles to the zenith between which a row of cells lies: from the centres of the row of texels above
/// to those of the row below, or to the pole.
fn cosines(row: usize, height: usize) -> [f64; 2] {
    let at = |row: f64| (PI * (row / height as f64).clamp(0.0, 1.0)).cos();
    [at(row as f64 - 0.5), at(row as f64 + 0.5)]
}
