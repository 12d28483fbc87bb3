//! What media take of particles' light on the way from surface to surface: the host's march, where the shader has
//! `resident/optical_depth.wesl`.

use glam::{DVec3, Vec3};
use tyndall_scene::{Field, Volume, World};

use crate::resident::{is_bodies, voxel};

/// The media of a world but for those that are made of bodies, which dim nothing here.
#[derive(Clone, Debug, Default)]
pub struct Media {
    volumes: Vec<Volume>,
    /// The longest step [voxels].
    step: f32,
}

/// Steps through a volume, at most.
const MOST_STEPS: f64 = 4096.0;

impl Media {
    /// The media of a world, through which steps are that long [voxels].
    pub fn new(world: &World, step: f32) -> Self {
        let volumes = world.volumes.iter().filter(|volume| !is_bodies(volume)).cloned().collect();
        Self { volumes, step }
    }

    /// The transmittance of each channel along a ray of a unit direction, up to a distance [m], which may be infinite: by the midpoint
    /// rule.
    pub fn transmittance(&self, origin: DVec3, direction: DVec3, distance: f64) -> DVec3 {
        let mut depth = DVec3::ZERO;
        for volume in &self.volumes {
            let unit_from_world = volume.unit_from_world.as_dmat4();
            let (o, d) = (unit_from_world.transform_point3(origin), unit_from_world.transform_vector3(direction));
            let safe = d.map(|x| if x.abs() < 1e-20 { 1e-20 } else { x });
            let (a, b) = (-o / safe, (DVec3::ONE - o) / safe);
            let (near, far) = (a.min(b).max_element().max(0.0), a.max(b).min_element().min(distance));
            if near >= far {
                continue;
            }
            let even = matches!(volume.field, Field::Homogeneous) && volume.clip.is_empty();
            let longest = if even { f64::INFINITY } else { f64::from(self.step * voxel(volume)) };
            let steps = ((far - near) / longest).ceil().clamp(1.0, MOST_STEPS);
            let length = (far - near) / steps;
            for i in 0..steps as u32 {
                let at = origin + (near + (f64::from(i) + 0.5) * length) * direction;
                let here = volume.coefficients(at.as_vec3());
                depth += here.map_or(Vec3::ZERO, |here| here.sigma_t()).as_dvec3() * length;
            }
        }
        (-depth).exp()
    }
}

#[cfg(test)]
mod test {
    use super::*;
    use crate::test::world;

    /// exp(-∫σ) along rays: of a box, of a box that a plane cuts, and of a hard ball.
    #[test]
    fn transmittance_is_that_of_closed_forms() {
        let of = |medium: &str| {
            let optics = "optics.coefficients = { sigma_s = 0.5, sigma_a = [0.5, 1, 2] }";
            Media::new(
                &world(&format!(
                    "camera = {{ position = [0, 0, 9], target = [0, 0, 0] }}\n[media.m]\n{medium}\n{optics}"
                )),
                0.5,
            )
        };
        let sigma = DVec3::new(1.0, 1.5, 2.5);
        let x = DVec3::X;
        let near = |media: &Media, origin: DVec3, distance: f64, length: f64, tolerance: f64| {
            let (found, expected) = (media.transmittance(origin, x, distance), (-sigma * length).exp());
            assert!((found - expected).abs().max_element() < tolerance, "{found} for {expected}");
        };
        let cube = "density.homogeneous = { min = [0, 0, 0], max = [1, 1, 1] }";
        let inside = DVec3::new(0.25, 0.5, 0.5);
        near(&of(cube), inside, f64::INFINITY, 0.75, 1e-6);
        near(&of(cube), inside, 0.5, 0.5, 1e-6);
        near(&of(cube), inside - x, 0.5, 0.0, 1e-6);
        let cut = format!("{cube}\nclip.planes = [{{ point = [0.5, 0, 0], normal = [1, 0, 0] }}]");
        near(&of(&cut), inside - x, f64::INFINITY, 0.5, 0.02);
        let ball = "density.sphere = { center = [0, 0, 0], radius = 1 }";
        near(&of(ball), DVec3::new(-3.0, 0.6, 0.0), f64::INFINITY, 1.6, 0.02);
    }
}
