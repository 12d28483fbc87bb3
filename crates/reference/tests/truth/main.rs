//! The tracer against closed forms and against itself. The comment above a test is its specification; every bound
//! stands in `tolerance`.

mod agreement;
mod beer;
mod bodies;
mod bsdf;
mod caustics;
mod clip;
mod enclosed;
mod furnace;
mod glow;
mod half_space;
mod materials;
mod mesh;
mod phases;
mod pictures;
mod probe;
mod radiosity;
mod robust;
mod single;
mod sky;
mod surfaces;
mod tolerance;
mod worlds;
