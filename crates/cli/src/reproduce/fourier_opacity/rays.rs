//! Light rays with what absorbs along them.

use glam::DVec3;
use tyndall::math::transmittance::{Basis, absorbance};
use tyndall_scene::Field;
use tyndall_scene::World;
use tyndall_scene::strands::Segment;

/// What lies along a ray, at depths from 0 to 1.
#[derive(Clone, Default)]
pub struct Ray {
    /// Depth and absorbance of primitives.
    pub primitives: Vec<(f64, f64)>,
    /// Where segments begin and end, and their extinction per unit of depth.
    pub segments: Vec<([f64; 2], f64)>,
}

impl Ray {
    /// The optical depth from 0 to a depth, exactly.
    pub fn optical_depth(&self, depth: f64) -> f64 {
        let primitives = self.primitives.iter().filter(|(z, _)| *z < depth).map(|(_, absorbance)| absorbance);
        let inside = |[begin, end]: [f64; 2]| (depth.min(end) - begin).max(0.0);
        primitives.sum::<f64>() + self.segments.iter().map(|&(span, extinction)| inside(span) * extinction).sum::<f64>()
    }

    /// What a basis keeps of the ray.
    pub fn sums(&self, basis: &dyn Basis) -> Vec<f64> {
        let mut sums = vec![0.0; basis.count()];
        self.primitives.iter().for_each(|&(depth, absorbance)| basis.deposit(&mut sums, depth, absorbance));
        self.segments.iter().for_each(|&(span, extinction)| basis.deposit_segment(&mut sums, span, extinction));
        sums
    }

    /// The ray with depths mapped by z ↦ scale·z + offset.
    pub fn moved(&self, scale: f64, offset: f64) -> Self {
        let place = |z: f64| scale * z + offset;
        Self {
            primitives: self.primitives.iter().map(|&(z, a)| (place(z), a)).collect(),
            segments: self.segments.iter().map(|&(span, extinction)| (span.map(place), extinction / scale)).collect(),
        }
    }

    /// The ray with depths that begin where something is and end where `deepest` is reached; `None` where nothing is.
    pub fn with_own_range(&self, deepest: f64) -> Option<Self> {
        let starts = self.primitives.iter().map(|p| p.0).chain(self.segments.iter().map(|s| s.0[0]));
        let begin = starts.reduce(f64::min)?;
        let ends = self.primitives.iter().map(|p| p.0).chain(self.segments.iter().map(|s| s.0[1]));
        let mut ends: Vec<f64> = ends.collect();
        ends.sort_by(f64::total_cmp);
        let end = ends.iter().copied().find(|&z| self.optical_depth(z) >= deepest).or(ends.last().copied())?;
        let length = (end - begin).max(1e-6);
        let within = |z: f64| z <= end + 1e-12;
        let kept = Self {
            primitives: self.primitives.iter().copied().filter(|p| within(p.0)).collect(),
            segments: self.segments.iter().copied().filter(|s| within(s.0[1])).collect(),
        };
        Some(kept.moved(1.0 / length, -begin / length))
    }
}

/// Three puffs of smoke, each a parabola of primitives.
pub fn puffs() -> Ray {
    let puff = |center: f64, width: f64, absorbance: f64| {
        (0..200).map(move |i| {
            let x = (f64::from(i) + 0.5) / 100.0 - 1.0;
            (center + width * x, absorbance * 0.0075 * (1.0 - x * x))
        })
    };
    let primitives = puff(0.3, 0.12, 1.2).chain(puff(0.55, 0.08, 0.8)).chain(puff(0.72, 0.1, 1.0)).collect();
    Ray { primitives, segments: Vec::new() }
}

/// A few thin layers, at depths that differ from ray to ray.
pub fn layers(seed: u32) -> Ray {
    let spread = |i: u32| (f64::from(seed * 7 + i) * 0.618_033_988_75).fract();
    Ray { primitives: (0..3).map(|i| (0.1 + 0.8 * spread(i), absorbance(0.5))).collect(), segments: Vec::new() }
}

/// The puffs in the first tenth, and one that is far behind them.
pub fn outlier() -> Ray {
    let mut ray = puffs().moved(0.25, 0.0);
    ray.primitives.push((0.97, absorbance(0.3)));
    ray
}

/// Rays of parallel light from −x through the first medium of a world, `side`² of them, with segments of a 256th: row by row along z,
/// the lowest first.
pub fn through(world: &World, side: u32) -> Vec<Ray> {
    let Some(volume) = world.volumes.first() else { return Vec::new() };
    const SEGMENTS: u32 = 256;
    let share = |i: u32, n: u32| (i as f32 + 0.5) / n as f32;
    let length = volume.world_from_unit.x_axis.length();
    let ray = |y: u32, z: u32| {
        let segments = (0..SEGMENTS).filter_map(|i| {
            let unit = glam::Vec3::new(share(i, SEGMENTS), share(y, side), share(z, side));
            let sigma_t = volume.coefficients(volume.world_from_unit.transform_point3(unit))?.sigma_t().x;
            let place = |i: u32| f64::from(i) / f64::from(SEGMENTS);
            (sigma_t > 0.0).then(|| ([place(i), place(i + 1)], f64::from(sigma_t * length)))
        });
        Ray { primitives: Vec::new(), segments: segments.collect() }
    };
    (0..side * side).map(|i| ray(i / side, i % side)).collect()
}

/// Texels of parallel light from above through the strands of a world, `side`² of them, as far as they meet any: a fibre is a primitive,
/// of its σ times the chord, in the share of a texel's rays that meet it.
pub fn through_strands(world: &World, side: u32) -> Vec<Ray> {
    /// Rays a texel, a side.
    const RAYS: u32 = 8;
    let strands = world.volumes.iter().find_map(|volume| match &volume.field {
        Field::Strands(strands) => Some(strands),
        _ => None,
    });
    let Some((strands, [low, high])) = strands.and_then(|strands| Some((strands, strands.bounds()?))) else {
        return Vec::new();
    };
    let [low, high] = [low.as_dvec3(), high.as_dvec3()];
    let length = high.y - low.y;
    let share = |i: u32| (f64::from(i) + 0.5) / f64::from(side * RAYS);
    let texel = |i: u32| {
        let mut texel = Ray::default();
        for k in 0..RAYS * RAYS {
            let [x, z] = [i % side * RAYS + k % RAYS, i / side * RAYS + k / RAYS].map(share);
            let origin = DVec3::new(low.x + x * (high.x - low.x), high.y, low.z + z * (high.z - low.z));
            strands.hierarchy().along(origin, DVec3::NEG_Y, 0.0, length, |body, end| {
                let segment = strands.segment(body);
                if let Some((distance, chord)) = crossing(&segment, origin) {
                    let absorbance = segment.density() * chord / f64::from(RAYS * RAYS);
                    texel.primitives.push((distance / length, absorbance));
                }
                end
            });
        }
        texel
    };
    (0..side * side).map(texel).filter(|texel| !texel.primitives.is_empty()).collect()
}

/// Where a ray downwards meets a fibre: the distance of the point next to its axis, and how far it runs within.
fn crossing(segment: &Segment, origin: DVec3) -> Option<(f64, f64)> {
    let [from, to] = segment.ends.map(|end| end.as_dvec3());
    let (axis, down) = (to - from, DVec3::NEG_Y);
    let across = axis.cross(down);
    let sine = across.length() / axis.length();
    if sine.is_nan() || sine < 1e-3 {
        return None;
    }
    let apart = (from - origin).dot(across) / across.length();
    let radius = f64::from(segment.radius);
    let along = (origin - from).cross(down).dot(across) / across.length_squared();
    let distance = (from - origin).cross(axis).dot(down.cross(axis)) / across.length_squared();
    let inside = apart.abs() < radius && (0.0..1.0).contains(&along);
    inside.then(|| (distance.max(0.0), 2.0 * (radius * radius - apart * apart).sqrt() / sine))
}
