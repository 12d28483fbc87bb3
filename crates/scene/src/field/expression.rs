//! A density that a formula of the position gives.

use glam::Vec3;

use super::Formula;

/// A formula over a box, within [0, `highest`].
#[derive(Clone, Debug)]
pub struct Expression {
    /// The formula of the position [m].
    pub formula: Formula,
    /// The box's lowest corner [m].
    pub min: Vec3,
    /// The box's size [m].
    pub size: Vec3,
    /// Higher values count as this.
    pub highest: f32,
}

impl Expression {
    /// The density at a position in the unit cube; 0 where the formula's value is no finite number.
    pub fn value(&self, unit: Vec3) -> f32 {
        let value = self.formula.value(self.min + unit * self.size);
        if value.is_finite() { value.clamp(0.0, self.highest) } else { 0.0 }
    }
}
