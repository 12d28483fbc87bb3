//! Camera rays.

use glam::DVec3;
use tyndall_scene::description::Scene;

use crate::{Random, ReferenceError};

/// A pinhole camera with its film.
pub(crate) struct Camera {
    position: DVec3,
    /// The upper left corner of the film, one unit before the eye, relative to it.
    corner: DVec3,
    /// From a pixel to the next on the right, and to the next below.
    step: [DVec3; 2],
}

impl Camera {
    pub fn new(scene: &Scene) -> Result<Self, ReferenceError> {
        let [right, up, backward] = scene.camera.frame().ok_or(ReferenceError::Camera)?.map(|axis| axis.as_dvec3());
        let [width, height] = scene.film.size.map(f64::from);
        let half = (0.5 * f64::from(scene.camera.fov).to_radians()).tan();
        let pixel = 2.0 * half / height;
        let corner = up * half - right * (0.5 * pixel * width) - backward;
        Ok(Self { position: scene.camera.position.as_dvec3(), corner, step: [right * pixel, up * -pixel] })
    }

    /// Origin and unit direction of a ray through a uniformly random point of a pixel: a box filter.
    pub fn ray(&self, x: u32, y: u32, rng: &mut Random) -> (DVec3, DVec3) {
        self.through(f64::from(x) + rng.uniform(), f64::from(y) + rng.uniform())
    }

    /// Origin and unit direction of the ray through a point of the film [pixel].
    pub fn through(&self, u: f64, v: f64) -> (DVec3, DVec3) {
        (self.position, (self.corner + self.step[0] * u + self.step[1] * v).normalize())
    }
}
