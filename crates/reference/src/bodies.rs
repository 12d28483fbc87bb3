//! Particles and strands: media of bodies that are far smaller than the cells of a grid.
//!
//! Their optical depth along a ray is a sum of closed forms over the bodies that the ray meets: no majorant, no chance. A
//! flight to the next collision needs no order among them either: collisions in overlapping media are those of each of
//! them, so that every body has a random collision of its own, or none, and the nearest is that of all.

use glam::DVec3;
use tyndall_scene::Field;
use tyndall_scene::particles::{Particle, Particles};
use tyndall_scene::strands::{Segment, Strands};

use crate::Random;

/// Particles or strands, of which none changes while it is traced.
pub(crate) enum Bodies {
    Particles(std::sync::Arc<Particles>),
    Strands(std::sync::Arc<Strands>),
}

/// A ray's way through a body: where it enters and leaves [m], and how optical depth grows between.
struct Crossing {
    enter: f64,
    exit: f64,
    growth: Growth,
}

enum Growth {
    /// τ₀·15/16·(q²s − ⅔qs³ + s⁵/5), where s = (t − middle)/radius and q = 1 − b²/r² for a ray that passes the centre at b:
    /// the integral of the density 15/(16r)·τ₀·(q − s²)².
    Ball { middle: f64, radius: f64, q: f64, depth: f64 },
    /// σ·t.
    Cylinder { density: f64 },
}

impl Bodies {
    /// The bodies of a field that is made of them.
    pub fn new(field: &Field) -> Option<Self> {
        match field {
            Field::Particles(particles) => Some(Self::Particles(particles.clone())),
            Field::Strands(strands) => Some(Self::Strands(strands.clone())),
            _ => None,
        }
    }

    /// The optical depth between two distances [m] along a ray, per unit of the medium's σ_t.
    pub fn depth(&self, origin: DVec3, direction: DVec3, [from, to]: [f64; 2]) -> f64 {
        let mut sum = 0.0;
        self.along(origin, direction, [from, to], |crossing, end| {
            sum += crossing.depth(from, end);
            end
        });
        sum
    }

    /// The distance [m] along a ray of the first collision between two distances, of those that happen with `rate` times the
    /// density; infinite where there is none.
    pub fn collision(&self, origin: DVec3, direction: DVec3, [from, to]: [f64; 2], rate: f64, rng: &mut Random) -> f64 {
        let mut nearest = f64::INFINITY;
        if rate == 0.0 {
            return nearest;
        }
        self.along(origin, direction, [from, to], |crossing, end| {
            let depth = rng.exponential() / rate;
            if depth >= crossing.depth(from, end) {
                return end;
            }
            nearest = crossing.reach(from, end, depth);
            nearest
        });
        nearest
    }

    /// Visits what bodies a ray meets between two distances; `visit` gives the new end of the ray.
    #[inline]
    fn along(
        &self,
        origin: DVec3,
        direction: DVec3,
        [from, to]: [f64; 2],
        mut visit: impl FnMut(Crossing, f64) -> f64,
    ) {
        if from >= to {
            return;
        }
        let mut crossed = |crossing: Option<Crossing>, end| match crossing {
            Some(crossing) if crossing.enter < end && crossing.exit > from => visit(crossing, end),
            _ => end,
        };
        match self {
            Self::Particles(particles) => particles.hierarchy().along(origin, direction, from, to, |body, end| {
                crossed(Crossing::of_ball(&particles.list()[body], origin, direction), end)
            }),
            Self::Strands(strands) => strands.hierarchy().along(origin, direction, from, to, |body, end| {
                crossed(Crossing::of_cylinder(&strands.segment(body), origin, direction), end)
            }),
        }
    }
}

impl Crossing {
    /// The direction is a unit vector.
    fn of_ball(ball: &Particle, origin: DVec3, direction: DVec3) -> Option<Self> {
        let radius = f64::from(ball.radius);
        let offset = ball.position.as_dvec3() - origin;
        let middle = offset.dot(direction);
        // Of the vector from the centre, not of a difference of squares, which cancels.
        let impact = (offset - direction * middle).length_squared();
        let q = 1.0 - impact / (radius * radius);
        if q <= 0.0 {
            return None;
        }
        let half = radius * q.sqrt();
        let growth = Growth::Ball { middle, radius, q, depth: ball.depth.into() };
        Some(Self { enter: middle - half, exit: middle + half, growth })
    }

    fn of_cylinder(segment: &Segment, origin: DVec3, direction: DVec3) -> Option<Self> {
        let [from, to] = segment.ends.map(|end| end.as_dvec3());
        let length = from.distance(to);
        if length == 0.0 {
            return None;
        }
        let axis = (to - from) / length;
        let offset = origin - from;
        let (height, climb) = (offset.dot(axis), direction.dot(axis));
        // Across the axis the ray is a line in a plane, and the cylinder a circle.
        let (place, way) = (offset - axis * height, direction - axis * climb);
        let radius = f64::from(segment.radius);
        let speed = way.length_squared();
        let (mut enter, mut exit) = (f64::NEG_INFINITY, f64::INFINITY);
        // Along the axis nothing is gained from way, which is rounding.
        if speed > 1e-24 {
            let middle = -place.dot(way) / speed;
            let left = radius * radius - (place + way * middle).length_squared();
            if left <= 0.0 {
                return None;
            }
            let half = (left / speed).sqrt();
            (enter, exit) = (middle - half, middle + half);
        } else if place.length_squared() >= radius * radius {
            return None;
        }
        if climb != 0.0 {
            let (a, b) = (-height / climb, (length - height) / climb);
            (enter, exit) = (enter.max(a.min(b)), exit.min(a.max(b)));
        } else if !(0.0..=length).contains(&height) {
            return None;
        }
        (enter < exit).then_some(Self { enter, exit, growth: Growth::Cylinder { density: segment.density() } })
    }

    /// The optical depth gained between two distances [m].
    fn depth(&self, from: f64, to: f64) -> f64 {
        let (from, to) = (from.max(self.enter), to.min(self.exit));
        if from >= to { 0.0 } else { self.grown(to) - self.grown(from) }
    }

    /// Optical depth within, up to a constant.
    fn grown(&self, distance: f64) -> f64 {
        match self.growth {
            Growth::Ball { middle, radius, q, depth } => {
                let s = (distance - middle) / radius;
                15.0 / 16.0 * depth * s * (q * q + s * s * (-2.0 / 3.0 * q + 0.2 * s * s))
            }
            Growth::Cylinder { density } => density * (distance - self.enter),
        }
    }

    /// The distance [m] after `from` at which optical depth has grown by `depth`, which is less than it grows to `to`.
    fn reach(&self, from: f64, to: f64, depth: f64) -> f64 {
        let (mut low, mut high) = (from.max(self.enter), to.min(self.exit));
        match self.growth {
            Growth::Cylinder { density } => (low + depth / density).min(high),
            Growth::Ball { middle, radius, q, depth: full } => {
                let goal = self.grown(low) + depth;
                let mut at = 0.5 * (low + high);
                // Newton's method, kept between bounds that close in from both sides: growth is monotonic.
                for _ in 0..64 {
                    let error = self.grown(at) - goal;
                    if error < 0.0 {
                        low = at
                    } else {
                        high = at
                    }
                    let s = (at - middle) / radius;
                    let slope = 15.0 / 16.0 * full / radius * (q - s * s) * (q - s * s);
                    let next = at - error / slope;
                    let last = at;
                    at = if low < next && next < high { next } else { 0.5 * (low + high) };
                    if (at - last).abs() <= 1e-12 * radius {
                        break;
                    }
                }
                at
            }
        }
    }
}
