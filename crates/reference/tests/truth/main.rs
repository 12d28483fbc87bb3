//! The tracer against closed forms and against itself. The comment above a test is its specification; every bound
//! stands in `tolerance`.

mod agreement;
mod beer;
mod bodies;
mod clip;
mod furnace;
mod glow;
mod half_space;
mod mesh;
mod phases;
mod pictures;
mod probe;
mod robust;
mod single;
mod sky;
mod tolerance;
mod worlds;
