//! Surfaces that shine: a point on one of them, chosen by power.

use glam::DVec3;

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

/// A point on a light.
pub(crate) struct LightPoint {
    pub face: usize,
    /// What each corner counts.
    pub weights: [f64; 3],
    /// [m]
    pub point: DVec3,
    /// Unit normal of the front.
    pub normal: DVec3,
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

    /// A random point, uniform on each face.
    pub fn sample(&self, faces: impl Fn(usize) -> Face, rng: &mut Random) -> Option<LightPoint> {
        let chosen = rng.uniform() * self.sums.last()?;
        // Rounding may give the total itself.
        let place = self.sums.partition_point(|&sum| sum <= chosen).min(self.sums.len() - 1);
        let index = self.faces[place];
        let triangle = faces(index).triangle;
        let (root, v) = (rng.uniform().sqrt(), rng.uniform());
        let weights = [1.0 - root, root * (1.0 - v), root * v];
        let [a, b, c] = triangle.0;
        let point = a * weights[0] + b * weights[1] + c * weights[2];
        let normal = triangle.area_vector().normalize();
        Some(LightPoint { face: index, weights, point, normal })
    }

    /// The density of [`AreaLights::sample`] on a face, as that of directions from a point that sees it at a distance [m]
    /// and under a cosine [sr⁻¹].
    pub fn chance(&self, face: usize, distance: f64, cosine: f64) -> f64 {
        self.densities.get(face).map_or(0.0, |density| density * distance * distance / cosine)
    }
}
