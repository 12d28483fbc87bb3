//! Grids that say more of a medium than its density.

use std::sync::Arc;

use glam::{Mat4, Vec3};

use crate::black_body;
use crate::volume::Grid;

/// A grid in the world, with a box of its own.
#[derive(Clone, Debug)]
pub struct PlacedGrid {
    /// Its values.
    pub grid: Arc<Grid>,
    /// Maps world positions [m] to the grid's unit cube; affine and invertible.
    pub unit_from_world: Mat4,
}

impl PlacedGrid {
    /// The grid's value at a point [m], trilinear; `None` outside its box.
    pub fn value(&self, point: Vec3) -> Option<f32> {
        let unit = self.unit_from_world.transform_point3(point);
        let inside = unit.cmpge(Vec3::ZERO).all() && unit.cmple(Vec3::ONE).all();
        inside.then(|| self.grid.trilinear(unit))
    }
}

/// How hot a medium is: it glows as a black body.
#[derive(Clone, Debug)]
pub struct Temperature {
    /// The temperature in a unit of its own, 0 outside.
    pub grid: PlacedGrid,
    /// Temperature of a unit of the grid [K].
    pub kelvin: f32,
    /// Temperature where the grid is 0 [K].
    pub offset: f32,
    /// Factor on the radiance.
    pub radiance_scale: f32,
}

impl Temperature {
    /// Temperature at a point [K]; 0 or less where nothing glows.
    pub fn at(&self, point: Vec3) -> f32 {
        self.grid.value(point).unwrap_or(0.0) * self.kelvin + self.offset
    }

    /// Radiance of an opaque body of the temperature at a point [W·sr⁻¹·m⁻²]: emission is σ_a times that.
    pub fn radiance(&self, point: Vec3) -> Vec3 {
        black_body(self.at(point)) * self.radiance_scale
    }
}

/// The colour of what a medium scatters.
#[derive(Clone, Debug)]
pub struct Color {
    /// Red, green and blue, linear Rec. 709; 1 outside.
    pub grids: [PlacedGrid; 3],
}

impl Color {
    /// The share of σ_s that is scattered at a point, from 0 to 1; the rest is absorbed.
    pub fn at(&self, point: Vec3) -> Vec3 {
        Vec3::from_array([0, 1, 2].map(|channel| self.grids[channel].value(point).unwrap_or(1.0).clamp(0.0, 1.0)))
    }
}
