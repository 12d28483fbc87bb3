//! The Rust twin of `octahedral.wesl`: unit vectors in 32 bits [Cigolle14].

use glam::{DVec2, DVec3};

/// The two coordinates of a unit vector on the unfolded octahedron, 16 bits each, the first the lower.
pub fn pack_direction(direction: DVec3) -> u32 {
    let flat = direction.truncate() / direction.abs().element_sum();
    let flat = if direction.z < 0.0 { folded(flat) } else { flat };
    let bits = |x: f64| u32::from(((x.clamp(-1.0, 1.0) * 32767.0 + 0.5).floor() as i16) as u16);
    bits(flat.x) | bits(flat.y) << 16
}

/// The unit vector of [`pack_direction`], wrong by at most 6.5e-5 rad.
pub fn unpack_direction(packed: u32) -> DVec3 {
    let coordinate = |bits: u32| (f64::from(bits as u16 as i16) / 32767.0).max(-1.0);
    let flat = DVec2::new(coordinate(packed), coordinate(packed >> 16));
    let z = 1.0 - flat.abs().element_sum();
    let flat = if z < 0.0 { folded(flat) } else { flat };
    flat.extend(z).normalize()
}

fn folded(flat: DVec2) -> DVec2 {
    let sign = DVec2::select(flat.cmpge(DVec2::ZERO), DVec2::ONE, DVec2::NEG_ONE);
    (1.0 - DVec2::new(flat.y, flat.x).abs()) * sign
}
