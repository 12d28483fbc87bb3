//! The Rust twin of `bodies.wesl`.

use glam::{DVec2, DVec3};

/// How far along a ray a ball's centre is nearest [m], and q = 1 − b²/r², at most 0 where it misses. `direction` is a unit
/// vector.
pub fn ball_passage(center: DVec3, radius: f64, origin: DVec3, direction: DVec3) -> DVec2 {
    let nearest = (center - origin).dot(direction);
    let aside = center - origin - nearest * direction;
    DVec2::new(nearest, 1.0 - aside.length_squared() / (radius * radius))
}

/// The share of the depth through its centre that a ball has along a ray: q^(5/2).
pub fn ball_profile(q: f64) -> f64 {
    q.max(0.0).powf(2.5)
}

/// The share of it up to a distance s [radii] from where the centre is nearest, negative before it.
pub fn ball_profile_before(q: f64, s: f64) -> f64 {
    let root = q.max(0.0).sqrt();
    let t = s.clamp(-root, root);
    0.5 * ball_profile(q) + 15.0 / 16.0 * (q * q * t - 2.0 / 3.0 * q * t.powi(3) + t.powi(5) / 5.0)
}

/// The part of a ray [m] within a cylinder with flat ends; it ends before it begins where the ray misses.
pub fn cylinder_span(ends: [DVec3; 2], radius: f64, origin: DVec3, direction: DVec3) -> DVec2 {
    let [begin, end] = ends;
    let length = begin.distance(end);
    let along = (end - begin) / length;
    let (height, slope) = ((origin - begin).dot(along), direction.dot(along));
    let (aside, across) = (origin - begin - height * along, direction - slope * along);
    let nearest = -aside.dot(across) / across.length_squared();
    let passing = (aside + nearest * across).length_squared();
    let half_chord = ((radius * radius - passing).max(0.0) / across.length_squared()).sqrt();
    let (a, b) = (-height / slope, (length - height) / slope);
    DVec2::new((nearest - half_chord).max(a.min(b)), (nearest + half_chord).min(a.max(b)))
}
