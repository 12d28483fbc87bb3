//! Functions that shaders share (`*.wesl`), each beside its Rust twin.

pub mod phase;
pub mod ray;
pub mod slab;
pub mod transmittance;
