//! Stepping along a ray through the majorant cells of all media at once.
//!
//! The ray is cut where it enters or leaves a cell of any medium. On each piece the strengths of all media have
//! constant bounds, which add up.

use glam::DVec3;
use tyndall_scene::description::Plane;

use crate::medium::{Medium, height};

/// A ray's walk; kept between rays for its memory.
#[derive(Default)]
pub(crate) struct March {
    start: f64,
    end: f64,
    limit: f64,
    cursors: Vec<Cursor>,
}

/// A ray's place in the cells of one medium. Distances are the world's, along the ray [m].
pub(crate) struct Cursor {
    /// Index of the medium.
    pub medium: usize,
    /// Bounds of the strength from here to the next boundary; 0 before the ray enters.
    pub range: [f64; 2],
    /// The ray in the medium's unit cube.
    origin: DVec3,
    direction: DVec3,
    /// Where the range ends.
    next: f64,
    inside: bool,
    exit: f64,
    /// Where the ray crosses the next cell boundary on each axis, and how far apart those are.
    crossing: [f64; 3],
    spacing: [f64; 3],
    /// The cell, how many more there are on each axis, and the steps of its number.
    cell: usize,
    left: [usize; 3],
    stride: [isize; 3],
}

impl March {
    /// Starts along a ray from `origin` in the unit `direction`, up to a distance [m].
    pub fn start(&mut self, media: &[Medium], origin: DVec3, direction: DVec3, limit: f64) {
        self.cursors.clear();
        self.limit = limit;
        for (index, medium) in media.iter().enumerate() {
            let kept = kept(&medium.clip, origin, direction);
            let origin = medium.unit_from_world.transform_point3(origin);
            let direction = medium.unit_from_world.transform_vector3(direction);
            if let (Some(cube), Some(kept)) = (unit_cube(origin, direction), kept)
                && let [enter, exit] = [cube[0].max(kept[0]), cube[1].min(kept[1])]
                && enter < exit.min(limit)
            {
                let mut cursor = Cursor {
                    medium: index,
                    range: [0.0; 2],
                    origin,
                    direction,
                    next: enter,
                    inside: false,
                    exit,
                    crossing: [f64::INFINITY; 3],
                    spacing: [f64::INFINITY; 3],
                    cell: 0,
                    left: [0; 3],
                    stride: [0; 3],
                };
                if enter <= 0.0 {
                    cursor.enter(medium, 0.0);
                }
                self.cursors.push(cursor);
            }
        }
        self.start = 0.0;
        self.end = self.nearest();
    }

    /// The piece of the ray it stands at [m], or `None` beyond the last medium or the limit.
    #[inline]
    pub fn piece(&self) -> Option<(f64, f64)> {
        (!self.cursors.is_empty() && self.start < self.limit).then_some((self.start, self.end))
    }

    /// Goes on to the next piece.
    #[inline]
    pub fn advance(&mut self, media: &[Medium]) {
        self.start = self.end;
        let here = self.start;
        let mut i = 0;
        while i < self.cursors.len() {
            let cursor = &mut self.cursors[i];
            if cursor.next > here || cursor.step(&media[cursor.medium]) {
                i += 1;
            } else {
                self.cursors.swap_remove(i);
            }
        }
        self.end = self.nearest();
    }

    /// The media whose boxes the ray has not left yet.
    #[inline]
    pub fn cursors(&self) -> &[Cursor] {
        &self.cursors
    }

    fn nearest(&self) -> f64 {
        self.cursors.iter().fold(self.limit, |nearest, cursor| nearest.min(cursor.next)).max(self.start)
    }
}

impl Cursor {
    /// The unit-cube position at a distance along the ray [m].
    #[inline]
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }

    /// Whether there may be anything of the medium on this piece.
    #[inline]
    pub fn occupied(&self) -> bool {
        self.range[1] > 0.0
    }

    /// Goes on to the next cell; false where there is none.
    #[inline]
    fn step(&mut self, medium: &Medium) -> bool {
        if !self.inside {
            self.enter(medium, self.next);
            return true;
        }
        let [x, y, z] = self.crossing;
        let axis = if x <= y && x <= z {
            0
        } else if y <= z {
            1
        } else {
            2
        };
        if self.left[axis] == 0 || self.next >= self.exit {
            return false;
        }
        self.left[axis] -= 1;
        self.crossing[axis] += self.spacing[axis];
        self.cell = self.cell.wrapping_add_signed(self.stride[axis]);
        self.look(medium);
        true
    }

    /// Finds the cell at a distance along the ray at which it is in the unit cube.
    fn enter(&mut self, medium: &Medium, distance: f64) {
        let cells = medium.bounds.cells;
        let strides = [1, cells[0], cells[0] * cells[1]];
        let position = self.at(distance).clamp(DVec3::ZERO, DVec3::ONE).to_array();
        let (origin, direction) = (self.origin.to_array(), self.direction.to_array());
        self.inside = true;
        for axis in 0..3 {
            let n = cells[axis] as f64;
            let cell = ((position[axis] * n) as usize).min(cells[axis] - 1);
            self.cell += cell * strides[axis];
            let forward = direction[axis] > 0.0;
            self.left[axis] = if forward { cells[axis] - 1 - cell } else { cell };
            if direction[axis] != 0.0 {
                let boundary = (if forward { cell + 1 } else { cell }) as f64 / n;
                self.crossing[axis] = (boundary - origin[axis]) / direction[axis];
                self.spacing[axis] = 1.0 / (n * direction[axis].abs());
                self.stride[axis] = if forward { strides[axis] as isize } else { -(strides[axis] as isize) };
            }
        }
        self.look(medium);
    }

    #[inline]
    fn look(&mut self, medium: &Medium) {
        self.range = medium.bounds.range(self.cell).map(f64::from);
        let [x, y, z] = self.crossing;
        self.next = x.min(y).min(z).min(self.exit);
    }
}

/// Where a ray from a point is in the unit cube: distances at entry (at least 0) and exit.
fn unit_cube(origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
    let (mut enter, mut exit) = (0.0f64, f64::INFINITY);
    for (o, d) in origin.to_array().into_iter().zip(direction.to_array()) {
        if d == 0.0 {
            if !(0.0..=1.0).contains(&o) {
                return None;
            }
            continue;
        }
        let (a, b) = (-o / d, (1.0 - o) / d);
        enter = enter.max(a.min(b));
        exit = exit.min(a.max(b));
    }
    (enter < exit && exit.is_finite()).then_some([enter, exit])
}

/// Where a ray from a point is kept by all planes: distances from (at least 0) and to, which may be infinite.
pub(crate) fn kept(clip: &[Plane], origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
    let (mut enter, mut exit) = (0.0f64, f64::INFINITY);
    for plane in clip {
        let (above, climb) = (height(plane, origin), plane.normal.as_dvec3().dot(direction));
        if climb > 0.0 {
            exit = exit.min(-above / climb);
        } else if climb < 0.0 {
            enter = enter.max(-above / climb);
        } else if above > 0.0 {
            return None;
        }
    }
    (enter < exit).then_some([enter, exit])
}

#[cfg(test)]
mod test {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_ray_is_kept_on_the_near_side_of_planes() {
        let plane = |normal, distance| Plane { normal, distance };
        let slab = [plane(Vec3::X, 2.0), plane(Vec3::NEG_X, -1.0)];
        assert_eq!(kept(&slab, DVec3::ZERO, DVec3::X), Some([1.0, 2.0]));
        assert_eq!(kept(&slab, DVec3::X * 1.5, DVec3::NEG_X), Some([0.0, 0.5]));
        assert_eq!(kept(&slab, DVec3::X * 3.0, DVec3::X), None);
        // Along a plane: what lies in it is kept.
        assert_eq!(kept(&slab, DVec3::X * 2.0, DVec3::Y), Some([0.0, f64::INFINITY]));
        assert_eq!(kept(&slab, DVec3::X * 2.5, DVec3::Y), None);
        assert_eq!(kept(&[], DVec3::X, DVec3::Y), Some([0.0, f64::INFINITY]));
    }

    #[test]
    fn a_ray_meets_the_cube_where_it_does() {
        assert_eq!(unit_cube(DVec3::new(-1.0, 0.5, 0.5), DVec3::X), Some([1.0, 2.0]));
        assert_eq!(unit_cube(DVec3::splat(0.5), DVec3::Z), Some([0.0, 0.5]));
        assert_eq!(unit_cube(DVec3::new(2.0, 0.5, 0.5), DVec3::X), None);
        // Along a face: the face belongs to the cube; beside it there is nothing.
        assert_eq!(unit_cube(DVec3::new(-1.0, 1.0, 0.5), DVec3::X), Some([1.0, 2.0]));
        assert_eq!(unit_cube(DVec3::new(-1.0, 1.0 + 1e-9, 0.5), DVec3::X), None);
    }
}
