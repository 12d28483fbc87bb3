//! Point lights within media, without the fireflies of their inverse square.
//!
//! Near a light, next-event estimation from a path's collisions meets 1/r² without bound. So single scattering is
//! divided between two estimators by a partition of unity around the light: with s = (1 − r²/R²)² within a ball of
//! radius R and 0 beyond, collisions count 1 − s of the light, which is bounded, and the share s is sought along every
//! flight through the ball by equiangular sampling [Kulla12], whose density goes as 1/r² too.

use glam::DVec3;

use crate::Random;
use crate::light::Lamp;
use crate::medium::Medium;

/// The ball around a point light within which flights look for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ball {
    /// [m]; 0 where there is no scattering medium about the light.
    radius: f64,
}

impl Ball {
    /// A quarter of the medium, or a mean free path where that is shorter: beyond it, light does not come straight.
    pub fn new(lamp: &Lamp, media: &[Medium]) -> Self {
        const PART: f64 = 0.25;
        let Lamp::Bulb { position, .. } = lamp else { return Self { radius: 0.0 } };
        let radius = media.iter().filter(|medium| medium.scatters()).filter_map(|medium| {
            let unit = medium.unit_from_world.transform_point3(*position);
            let about = (unit - 0.5).abs().max_element() < 0.5 + PART;
            let free_path = 1.0 / (medium.steepest * medium.strength(unit));
            about.then(|| free_path.min(PART * medium.diagonal))
        });
        let radius = radius.fold(f64::INFINITY, f64::min);
        Self { radius: if radius.is_finite() { radius } else { 0.0 } }
    }

    /// The share of the light at a distance that is left to flights.
    pub fn share(self, distance: f64) -> f64 {
        if distance >= self.radius {
            return 0.0;
        }
        let x = distance / self.radius;
        (1.0 - x * x) * (1.0 - x * x)
    }

    /// A random distance along a flight at which it is in the ball around `position`, and its density [m⁻¹]: uniform
    /// in the angle seen from the light. `None` where it misses.
    pub fn sample(self, position: DVec3, origin: DVec3, direction: DVec3, rng: &mut Random) -> Option<(f64, f64)> {
        let offset = position - origin;
        let middle = offset.dot(direction);
        let closest = (offset - direction * middle).length();
        if closest >= self.radius || closest < Lamp::NEAREST {
            return None;
        }
        let half = (self.radius * self.radius - closest * closest).sqrt();
        if middle + half <= 0.0 {
            return None;
        }
        let first = (-half).max(-middle);
        let [a, b] = [first, half].map(|s| (s / closest).atan());
        // [Kulla12]
        let s = closest * (a + (b - a) * rng.uniform()).tan();
        let density = closest / ((b - a) * (closest * closest + s * s));
        (density.is_finite() && density > 0.0).then_some(((middle + s).max(0.0), density))
    }
}

#[cfg(test)]
mod test {
    use super::*;

    /// The density is that of the samples: the mean of 1/density is the chord's length, as much as lies ahead.
    #[test]
    fn density_integrates_to_the_chord() {
        let ball = Ball { radius: 2.0 };
        for (x, length) in [(-5.0, 2.0 * 3f64.sqrt()), (0.5, 3f64.sqrt() - 0.5), (3.0, 0.0)] {
            let n = 100_000;
            let mean = (0..n).fold(0.0, |sum, i| {
                let sample = ball.sample(DVec3::Y, DVec3::X * x, DVec3::X, &mut Random::new(1, 0, i));
                sum + sample.map_or(0.0, |(_, density)| 1.0 / density) / n as f64
            });
            assert!((mean - length).abs() < 0.02, "{mean} should be {length}");
        }
        assert_eq!((ball.share(2.0), ball.share(5.0), ball.share(0.0)), (0.0, 0.0, 1.0));
    }
}
