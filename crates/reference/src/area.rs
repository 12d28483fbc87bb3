//! Surfaces that shine: a point on one of them, chosen by power.

use crate::Random;
use crate::surface::Face;

/// The faces that emit, with their distribution.
#[derive(Default)]
pub(crate) struct AreaLights {
    faces: Vec<usize>,
    /// Running sum of the faces' powers, without the leading 0.
    sums: Vec<f64>,
    /// The density of [`AreaLights::sample`] on every face, 0 on those that do not emit [m⁻²].
    densities: Vec<f64>,
}

impl AreaLights {
    /// Sums up the faces, each of which has an area times `brightness` as its power.
    pub fn new(faces: &[Face], brightness: impl Fn(&Face) -> f64) -> Self {
        let mut lights = Self::default();
        let mut total = 0.0;
        for (index, face) in faces.iter().enumerate() {
            let brightness = brightness(face);
            if brightness > 0.0 {
                total += brightness * 0.5 * face.triangle.area_vector().length();
                lights.faces.push(index);
                lights.sums.push(total);
            }
        }
        if total > 0.0 {
            lights.densities = faces.iter().map(|face| brightness(face) / total).collect();
        }
        lights
    }

    /// Whether no surface shines.
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// A random face and what its corners count at a point that is uniform on it.
    pub fn sample(&self, rng: &mut Random) -> Option<(usize, [f64; 3])> {
        let chosen = rng.uniform() * self.sums.last()?;
        // Rounding may give the total itself.
        let place = self.sums.partition_point(|&sum| sum <= chosen).min(self.sums.len() - 1);
        let (root, v) = (rng.uniform().sqrt(), rng.uniform());
        Some((self.faces[place], [1.0 - root, root * (1.0 - v), root * v]))
    }

    /// The density of [`AreaLights::sample`] on a face, as that of directions from a point that sees it at a distance [m]
    /// and under a cosine [sr⁻¹].
    pub fn chance(&self, face: usize, distance: f64, cosine: f64) -> f64 {
        self.densities.get(face).map_or(0.0, |density| density * distance * distance / cosine)
    }
}
