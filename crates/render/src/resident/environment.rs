//! The environment as parallel lights.

use glam::{DVec2, DVec3, Vec3};
use tyndall_scene::EnvironmentMap;

use super::{Light, Resident};

/// An environment as at most `count` parallel lights: a map's by median cut [Debevec05], with the constant environment on top of
/// it; a constant one's spread evenly over the sphere.
pub(crate) fn lights(resident: &Resident, count: u32) -> Vec<Light> {
    let mut lights = match &resident.map {
        _ if count == 0 => Vec::new(),
        Some(map) => median_cut(map, resident.environment, count),
        None if resident.environment == Vec3::ZERO => Vec::new(),
        None => spiral(resident.environment, count),
    };
    for light in &mut lights {
        light.sky = 1;
    }
    lights
}

/// Equal lights on a Fibonacci spiral.
fn spiral(radiance: Vec3, count: u32) -> Vec<Light> {
    let golden_angle = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    let light = |i: u32| {
        let y = 1.0 - (2.0 * i as f32 + 1.0) / count as f32;
        let (sin, cos) = (golden_angle * i as f32).sin_cos();
        let ring = (1.0 - y * y).sqrt();
        let direction = Vec3::new(ring * cos, y, ring * sin);
        Light::directional(direction, radiance * (4.0 * std::f32::consts::PI / count as f32))
    };
    (0..count).map(light).collect()
}

/// A rectangle of the map's texels, with its light.
struct Region {
    low: [u32; 2],
    high: [u32; 2],
    energy: f64,
}

/// The map cut into regions of about the same power, a light in the middle of the power of each.
fn median_cut(map: &EnvironmentMap, constant: Vec3, count: u32) -> Vec<Light> {
    let solid_angle = |row: u32| {
        let edge = |row: u32| (std::f64::consts::PI * f64::from(row) / f64::from(map.height)).cos();
        std::f64::consts::TAU / f64::from(map.width) * (edge(row) - edge(row + 1))
    };
    let radiance = |x: u32, y: u32| (Vec3::from(map.pixels[(y * map.width + x) as usize]) + constant).as_dvec3();
    let power = |x: u32, y: u32| radiance(x, y).dot(DVec3::new(0.2126, 0.7152, 0.0722)) * solid_angle(y);
    let region = |low: [u32; 2], high: [u32; 2]| {
        let rows = (low[1]..high[1]).flat_map(|y| (low[0]..high[0]).map(move |x| (x, y)));
        Region { low, high, energy: rows.map(|(x, y)| power(x, y)).sum() }
    };
    let mut regions = vec![region([0, 0], [map.width, map.height])];
    while regions.len() < count as usize {
        let divisible = |r: &Region| r.energy > 0.0 && (r.high[0] - r.low[0]) * (r.high[1] - r.low[1]) > 1;
        let brightest = (0..regions.len()).filter(|&i| divisible(&regions[i]));
        let brightest = brightest.max_by(|&a, &b| regions[a].energy.total_cmp(&regions[b].energy));
        let Some(brightest) = brightest else { break };
        let Region { low, high, energy } = regions.swap_remove(brightest);
        // Across its longer side, as seen from within the sphere.
        let middle = std::f64::consts::PI * f64::from(low[1] + high[1]) * 0.5 / f64::from(map.height);
        let wide = f64::from(high[0] - low[0]) * 2.0 * middle.sin() / f64::from(map.width);
        let tall = f64::from(high[1] - low[1]) / f64::from(map.height);
        let axis = usize::from((tall > wide && high[1] - low[1] > 1) || high[0] - low[0] == 1);
        // Behind the line at which half of the light is passed; at least one line on either side.
        let (mut cut, mut passed) = (low[axis] + 1, 0.0);
        for line in low[axis]..high[axis] - 1 {
            let across = low[1 - axis]..high[1 - axis];
            passed += across.map(|k| if axis == 0 { power(line, k) } else { power(k, line) }).sum::<f64>();
            cut = line + 1;
            if passed >= 0.5 * energy {
                break;
            }
        }
        let (mut end, mut start) = (high, low);
        end[axis] = cut;
        start[axis] = cut;
        regions.extend([region(low, end), region(start, high)]);
    }
    let light = |r: &Region| {
        let (mut irradiance, mut center) = (DVec3::ZERO, DVec3::ZERO);
        for y in r.low[1]..r.high[1] {
            for x in r.low[0]..r.high[0] {
                let uv = DVec2::new(
                    (f64::from(x) + 0.5) / f64::from(map.width),
                    (f64::from(y) + 0.5) / f64::from(map.height),
                );
                irradiance += radiance(x, y) * solid_angle(y);
                center += power(x, y) * map.direction(uv);
            }
        }
        // Light travels from there.
        let travel = -center.try_normalize()?;
        Some(Light::directional(travel.as_vec3(), irradiance.as_vec3()))
    };
    regions.iter().filter_map(light).collect()
}

#[cfg(test)]
mod test {
    use tyndall_scene::image::Image;

    use super::*;

    fn map(bright: impl Fn(u32, u32) -> f32) -> EnvironmentMap {
        let pixels = (0..32 * 16).map(|i| [bright(i % 32, i / 32); 3]).collect();
        EnvironmentMap::new(Image { width: 32, height: 16, pixels, ..Default::default() }, 0.0).unwrap()
    }

    /// However it is cut, all of the light is there; and of a map of one colour the lights are about alike.
    #[test]
    fn no_light_is_lost() {
        for count in [1, 2, 7, 16, 64] {
            let lights = median_cut(&map(|_, _| 1.0), Vec3::splat(0.5), count);
            let total: f32 = lights.iter().map(|light| light.power.x).sum();
            assert_eq!(lights.len(), count as usize);
            assert!((total / (1.5 * 4.0 * std::f32::consts::PI) - 1.0).abs() < 1e-4, "{total}");
            let most = lights.iter().map(|light| light.power.x).fold(0.0, f32::max);
            assert!(most < 2.5 * total / count as f32, "{most} of {total}");
        }
    }

    /// A map with one bright texel has a light there, however many are asked for.
    #[test]
    fn a_sun_is_found() {
        let map = map(|x, y| if (x, y) == (20, 5) { 1.0 } else { 0.0 });
        let lights = median_cut(&map, Vec3::ZERO, 16);
        let expected = map.direction(DVec2::new(20.5 / 32.0, 5.5 / 16.0)).as_vec3();
        assert_eq!(lights.len(), 1);
        assert!(lights[0].place.distance(expected) < 1e-5);
    }
}
