//! The Rust twin of `ray.wesl`.

use glam::{DVec2, DVec3};

/// The part [near, far] of a ray, near ≥ 0, that lies in the unit cube; far < near where there is none.
pub fn unit_cube_span(origin: DVec3, direction: DVec3) -> DVec2 {
    let safe = DVec3::select(direction.abs().cmplt(DVec3::splat(1e-20)), DVec3::splat(1e-20), direction);
    let (a, b) = (-origin / safe, (1.0 - origin) / safe);
    DVec2::new(a.min(b).max_element().max(0.0), a.max(b).min_element())
}
