//! Strands as a participating medium: hair, fur, grass. `docs/particles.md` states what they do to light.
//!
//! A strand is a chain of cylinders with flat ends, each full of a homogeneous medium: a ray's optical depth is the chord
//! within times −ln(1 − α)/(2R), where R is the fibre's radius and α its opacity for a ray that crosses the axis at a right
//! angle. Where cylinders overlap, extinctions add; where a strand bends, what two of them share inside the bend is as much
//! as they leave open outside.

mod file;
mod head;
#[cfg(test)]
mod tests;

use std::sync::OnceLock;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

pub(crate) use file::read_strands;
pub use head::grow;

use crate::description::Transform;
use crate::particles::{FARTHEST, Here, Hierarchy, MAX_DEPTH, RADII, outward};
use crate::volume::VolumeError;

/// A point of a strand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// On the axis [m].
    pub position: Vec3,
    /// The fibre's radius [m].
    pub radius: f32,
    /// The share of σ_s that is scattered, 0 to 1, linear Rec. 709; the rest is absorbed.
    pub color: Vec3,
    /// The optical depth of a crossing at a right angle through the axis, per unit of the medium's σ_t; at most [`MAX_DEPTH`].
    pub depth: f32,
}

impl Knot {
    fn check(&self, index: usize) -> Result<(), VolumeError> {
        let wrong = |what: &str, value: String, accepted: &str| {
            Err(VolumeError::corrupt(format!(
                "{what} of point {index} of the strands is {value}; accepted: {accepted}"
            )))
        };
        let Self { position, radius, color, depth } = *self;
        if !(position.is_finite() && position.abs().max_element() <= FARTHEST) {
            return wrong("the position", format!("{:?}", position.to_array()), "at most 1e9 m from the origin");
        }
        if !(RADII[0]..=RADII[1]).contains(&radius) {
            return wrong("the radius", format!("{radius:?}"), "1e-7 to 1e6 m");
        }
        if !(color.is_finite() && color.min_element() >= 0.0 && color.max_element() <= 1.0) {
            return wrong("the colour", format!("{:?}", color.to_array()), "0 to 1");
        }
        if !(0.0..=MAX_DEPTH).contains(&depth) {
            return wrong("the optical depth", format!("{depth:?}"), "0 to 10");
        }
        Ok(())
    }
}

/// A piece of a strand between two points: a cylinder of the mean of what they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// The ends of its axis [m].
    pub ends: [Vec3; 2],
    /// Its radius [m].
    pub radius: f32,
    /// As of a [`Knot`].
    pub color: Vec3,
    /// As of a [`Knot`].
    pub depth: f32,
}

impl Segment {
    /// The extinction within [m⁻¹ per unit of the medium's σ_t].
    pub fn density(&self) -> f64 {
        f64::from(self.depth) / (2.0 * f64::from(self.radius))
    }

    /// Whether a point [m] is within.
    pub fn contains(&self, point: DVec3) -> bool {
        let [from, to] = self.ends.map(|end| end.as_dvec3());
        let axis = to - from;
        let along = (point - from).dot(axis);
        let radius = f64::from(self.radius);
        let length = axis.length_squared();
        (0.0..=length).contains(&along)
            && length > 0.0
            && (point - from - axis * (along / length)).length_squared() <= radius * radius
    }
}

/// Strands in the world.
#[derive(Clone, Debug, Default)]
pub struct Strands {
    knots: Vec<Knot>,
    /// The first point of each strand, and the number of all points.
    starts: Vec<u32>,
    /// The first point of each segment.
    segments: Vec<u32>,
    bounds: Option<[Vec3; 2]>,
    hierarchy: OnceLock<Hierarchy>,
}

impl Strands {
    /// Bytes that a point takes, with its segment's part of the hierarchy.
    pub const BYTES: u64 = size_of::<Knot>() as u64 + 8 + Hierarchy::BYTES;

    /// Strands in the world [m]: all their points, and the number of points of each.
    ///
    /// # Errors
    /// [`VolumeError::Corrupt`] for a point that is not finite, has no radius, or a colour or depth out of range; for counts
    /// that do not sum up to the points there are, and for a strand of fewer than two.
    pub fn new(knots: Vec<Knot>, counts: &[u32]) -> Result<Self, VolumeError> {
        knots.iter().enumerate().try_for_each(|(index, knot)| knot.check(index))?;
        let total: u64 = counts.iter().map(|&count| u64::from(count)).sum();
        if total != knots.len() as u64 {
            let what = format!("its strands have {total} points in all; there are {}", knots.len());
            return Err(VolumeError::corrupt(what));
        }
        let (mut starts, mut segments) = (vec![0], Vec::with_capacity(knots.len()));
        let mut start = 0;
        for (strand, &count) in counts.iter().enumerate() {
            if count < 2 {
                let what = format!("strand {strand} has {count} points; accepted: 2 or more");
                return Err(VolumeError::corrupt(what));
            }
            segments.extend(start..start + count - 1);
            start += count;
            starts.push(start);
        }
        let corners = knots.par_iter().map(|knot| [knot.position - knot.radius, knot.position + knot.radius]);
        let bounds = corners.reduce_with(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        Ok(Self { knots, starts, segments, bounds, hierarchy: OnceLock::new() })
    }

    /// Moved into the world: positions by the transform, radii by its scale, opacities as they are.
    ///
    /// # Errors
    /// As for [`new`](Self::new), where that leaves the range of numbers.
    pub fn moved(mut self, transform: &Transform) -> Result<Self, VolumeError> {
        let matrix = transform.matrix();
        self.knots.par_iter_mut().for_each(|knot| {
            knot.position = matrix.transform_point3(knot.position);
            knot.radius *= transform.scale.x;
        });
        let counts: Vec<_> = self.starts.windows(2).map(|ends| ends[1] - ends[0]).collect();
        Self::new(self.knots, &counts)
    }

    /// All points, strand by strand.
    pub fn knots(&self) -> &[Knot] {
        &self.knots
    }

    /// The points of each strand, from its root on.
    pub fn strands(&self) -> impl ExactSizeIterator<Item = &[Knot]> {
        self.starts.windows(2).map(|ends| &self.knots[ends[0] as usize..ends[1] as usize])
    }

    /// How many segments there are.
    pub fn count(&self) -> usize {
        self.segments.len()
    }

    /// A segment, by its number.
    ///
    /// # Panics
    /// If there are not as many, as indexing a slice does.
    pub fn segment(&self, index: usize) -> Segment {
        let first = self.segments[index] as usize;
        let [a, b] = [self.knots[first], self.knots[first + 1]];
        Segment {
            ends: [a.position, b.position],
            radius: 0.5 * (a.radius + b.radius),
            color: 0.5 * (a.color + b.color),
            depth: 0.5 * (a.depth + b.depth),
        }
    }

    /// The lowest and highest corner of the box around all strands [m]; `None` where there are none.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        self.bounds
    }

    /// The hierarchy over the segments, made when it is first asked for.
    pub fn hierarchy(&self) -> &Hierarchy {
        self.hierarchy.get_or_init(|| {
            let corners = |index| {
                let Segment { ends: [a, b], radius, .. } = self.segment(index);
                outward(a.min(b) - radius, a.max(b) + radius)
            };
            Hierarchy::new(&(0..self.count()).into_par_iter().map(corners).collect::<Vec<_>>())
        })
    }

    /// What the strands are at a point [m].
    pub fn at(&self, point: DVec3) -> Here {
        Here::sum(|add| {
            self.hierarchy().at(point, |index| {
                let segment = self.segment(index);
                if segment.contains(point) {
                    add(segment.density(), segment.color);
                }
            });
        })
    }
}
