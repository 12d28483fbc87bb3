//! Few virtual lights that stand for many.
//!
//! Particles are cheap to walk, and what they leave is dear to gather. So more of them walk than there are to be virtual lights; all that
//! they leave is cut into parts that lie close together and count alike for the picture, and of each part one light stands for all: the
//! representative of a cluster [Walter05]. It is drawn by what lights count, and its brightness is divided by the chance of that, so that
//! the mean is kept. What a light counts for the picture is what a few points that the eye sees receive of it [Georgiev10]. It shines in
//! the colour of all of its part: what is lit is off by how much colours differ within a part, which vanishes as parts become small.

use glam::{DVec3, Vec3};

use super::sequence::uniform;
use super::vpl::{PARALLEL, Vpl};

/// The share of all lights, at least, that stands for light that surfaces and sky emit: what the eye does not see of it, short rays do.
const EMITTED: f64 = 0.15;

/// How many lights emitted light has, relative to what it counts: lamps are small, and their lights more alike than those all over a room.
const EMITTED_WEIGHT: f64 = 1.0 / 3.0;

/// A share of a virtual light, by its number.
#[derive(Clone, Copy)]
struct Share {
    light: usize,
    share: f64,
}

/// How lights are told apart.
pub struct Likeness {
    /// How far apart lights are that differ as much as two whose normals are at right angles, over √2 [m].
    pub length: f32,
    /// Up to how many reflections lights are kept apart by their number; emitted light always is.
    pub bounces: u32,
}

/// The lights that are to be represented, a weight each, and how far each extends along six axes: place and normal.
struct Cut<'a> {
    lights: &'a [Vpl],
    weights: &'a [f64],
    axes: Vec<[f32; 6]>,
    seed: u32,
    made: Vec<Vpl>,
}

/// About `count` virtual lights with the power of all: each stands for about the same of `weights`, of which there is one a light, ≥ 0.
/// Their paths are numbers from 0 on.
pub fn representatives(lights: &[Vpl], weights: &[f64], count: usize, likeness: &Likeness, seed: u32) -> Vec<Vpl> {
    let kind = |i: usize| (lights[i].kind, lights[i].bounce.min(likeness.bounces.max(1)));
    let mut order: Vec<usize> = (0..lights.len()).filter(|&i| weights[i] > 0.0).collect();
    order.sort_by_key(|&i| kind(i));
    let axes = lights.iter().map(|vpl| axes(vpl, likeness.length)).collect();
    let mut cut = Cut { lights, weights, axes, seed, made: Vec::new() };
    let factor = |vpl: &Vpl| if vpl.bounce == 0 { EMITTED_WEIGHT } else { 1.0 };
    let total: f64 = lights.iter().zip(weights).map(|(vpl, weight)| factor(vpl) * weight).sum();
    for alike in order.chunk_by(|&a, &b| kind(a) == kind(b)) {
        let list: Vec<_> = alike.iter().map(|&light| Share { light, share: 1.0 }).collect();
        let first = &lights[alike[0]];
        let least = if first.bounce == 0 { EMITTED } else { 0.0 };
        let parts = (count as f64 * (factor(first) * cut.weight(&list) / total).max(least)).round();
        cut.split(list, (parts as usize).clamp(1, alike.len()));
    }
    cut.made
}

fn axes(vpl: &Vpl, length: f32) -> [f32; 6] {
    let normal = length * vpl.normal;
    let place = if vpl.kind == PARALLEL { Vec3::ZERO } else { vpl.position };
    [place.x, place.y, place.z, normal.x, normal.y, normal.z]
}

impl Cut<'_> {
    fn weight(&self, list: &[Share]) -> f64 {
        list.iter().map(|of| of.share * self.weights[of.light]).sum()
    }

    /// Cuts lights into parts of the same weight, again and again across the axis along which they extend farthest.
    fn split(&mut self, mut list: Vec<Share>, parts: usize) {
        if parts <= 1 {
            self.represent(&list);
            return;
        }
        let extent = |axis: usize| {
            let places = list.iter().map(|of| self.axes[of.light][axis]);
            let (low, high) = places.fold((f32::MAX, f32::MIN), |(low, high), x| (low.min(x), high.max(x)));
            high - low
        };
        let extents: [f32; 6] = std::array::from_fn(extent);
        let axis = (1..6).fold(0, |most, axis| if extents[axis] > extents[most] { axis } else { most });
        list.sort_by(|a, b| self.axes[a.light][axis].total_cmp(&self.axes[b.light][axis]));
        let low = parts / 2;
        let mut left = self.weight(&list) * low as f64 / parts as f64;
        let (mut first, mut second) = (Vec::new(), Vec::new());
        for of in list {
            let weight = of.share * self.weights[of.light];
            let share = of.share * (left / weight).clamp(0.0, 1.0);
            left = (left - weight).max(0.0);
            first.extend((share > 0.0).then_some(Share { share, ..of }));
            second.extend((share < of.share).then_some(Share { share: of.share - share, ..of }));
        }
        self.split(first, low);
        self.split(second, parts - low);
    }

    /// One light for a part: its own brightness over the chance that it was drawn, in the mean colour of the part.
    fn represent(&mut self, part: &[Share]) {
        let path = self.made.len() as u32;
        let brightness = |of: &Share| f64::from(self.lights[of.light].power.element_sum());
        let weight = |of: &Share| of.share * self.weights[of.light];
        let total = self.weight(part);
        let mut left = uniform(self.seed, path, u32::MAX) * total;
        let drawn = part.iter().find(|of| {
            left -= weight(of);
            left < 0.0
        });
        let Some(of) = drawn.or(part.last()) else { return };
        let sum: DVec3 = part.iter().map(|of| of.share * self.lights[of.light].power.as_dvec3()).sum();
        let power = sum / sum.element_sum().max(1e-300) * (brightness(of) * total / self.weights[of.light]);
        self.made.push(Vpl { power: power.as_vec3(), path, ..self.lights[of.light] });
    }
}

#[cfg(test)]
mod test {
    use super::*;

    fn row(count: u32) -> Vec<Vpl> {
        let place = |i: u32| DVec3::new(f64::from(i) / f64::from(count), 0.0, 0.0);
        (0..count).map(|i| Vpl::cosine(place(i), DVec3::Y, DVec3::new(1.0, f64::from(i % 7), 2.0))).collect()
    }

    const LIKENESS: Likeness = Likeness { length: 0.5, bounces: 1 };

    /// As many as asked for, with the power of all where that is what counts, and evenly spread.
    #[test]
    fn power_and_places_are_kept() {
        let mut lights = row(1000);
        let weights = |lights: &[Vpl]| lights.iter().map(|vpl| f64::from(vpl.power.element_sum())).collect::<Vec<_>>();
        let made = representatives(&lights, &weights(&lights), 30, &LIKENESS, 3);
        let sum = |list: &[Vpl]| list.iter().map(|vpl| vpl.power.as_dvec3()).sum::<DVec3>();
        assert!((sum(&made) / sum(&lights) - 1.0).abs().max_element() < 1e-6);
        // Whatever counts, the mean over seeds is the power.
        let odd: Vec<f64> = (0..1000).map(|i| 1.0 + f64::from(i % 3)).collect();
        let mean = (0..64).map(|seed| sum(&representatives(&lights, &odd, 30, &LIKENESS, seed)) / 64.0).sum::<DVec3>();
        assert!((mean / sum(&lights) - 1.0).abs().max_element() < 0.02, "{mean}");
        lights.iter_mut().for_each(|vpl| vpl.power = Vec3::ONE);
        let made = representatives(&lights, &weights(&lights), 30, &LIKENESS, 3);
        assert_eq!(made.len(), 30);
        let mut places: Vec<f32> = made.iter().map(|vpl| vpl.position.x * 30.0).collect();
        places.sort_by(f32::total_cmp);
        assert!((0u16..).zip(places).all(|(i, x)| (x - f32::from(i)).abs() <= 1.001), "one in each strip");
    }

    /// Where lights count twice as much there are twice as many.
    #[test]
    fn what_counts_more_has_more() {
        let weights: Vec<f64> = (0..1000).map(|i| if i < 500 { 2.0 } else { 1.0 }).collect();
        let made = representatives(&row(1000), &weights, 30, &LIKENESS, 0);
        assert_eq!(made.iter().filter(|vpl| vpl.position.x < 0.5).count(), 20);
    }

    /// Light that is emitted, and light that is reflected, has lights of its own; nothing is made of nothing.
    #[test]
    fn kinds_are_apart() {
        let mut lights = row(10);
        lights[9].bounce = 1;
        let made = representatives(&lights, &[1.0; 10], 2, &LIKENESS, 0);
        assert_eq!(made.iter().map(|vpl| vpl.bounce).collect::<Vec<_>>(), [0, 0, 1]);
        assert_eq!(made[2].power, lights[9].power);
        assert!(representatives(&[], &[], 8, &LIKENESS, 0).is_empty());
    }
}
