//! Densities that are functions of the position. `docs/fields.md` states their formulas and proves their bounds.

mod curl;
mod expression;
mod formula;
mod functions;
mod noise;
mod program;
mod sphere;

pub use curl::Curl;
pub use expression::Expression;
pub use formula::{Formula, FormulaError, MAX_FORMULA};
pub use noise::{Fractal, MAX_COORDINATE, MAX_OCTAVES, Noise, gradient_noise, pcg3d};
pub use sphere::Sphere;
