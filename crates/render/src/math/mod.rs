//! Functions that shaders share (`*.wesl`), each beside its Rust twin.

pub mod bodies;
pub mod brdf;
pub mod fibre;
pub mod octahedral;
pub mod phase;
pub mod ray;
pub mod slab;
pub mod transmittance;
