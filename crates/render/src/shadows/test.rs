//! Shadows against rays cast on the host: floor, wall, box and a ball of facets.

use glam::{DVec3, Vec2, Vec3};
use tyndall_scene::World;

use crate::resident::surfaces::triangles;
use crate::surfaces::test::{SCENE, cast, through, view_of};
use crate::test::{gpu, picture, tolerance, world};

/// Light as the test knows it: where it comes from at a point, and the irradiance on a perpendicular plane there.
type Lamp = fn(DVec3) -> (DVec3, f64);

const SUN: (&str, Lamp) = ("directional = { direction = [-2, -1.5, -1], irradiance = 3 }", |_| {
    (1e6 * DVec3::new(2.0, 1.5, 1.0).normalize(), 3.0)
});
const GRAZING: (&str, Lamp) = ("directional = { direction = [-10, -1, -3], irradiance = 3 }", |_| {
    (1e6 * DVec3::new(10.0, 1.0, 3.0).normalize(), 3.0)
});
const POINT: (&str, Lamp) = ("point = { position = [0.9, 1.6, 1.2], intensity = 2 }", |point| {
    let to_light = DVec3::new(0.9, 1.6, 1.2) - point;
    (to_light, 2.0 / to_light.length_squared())
});
const SPOT: (&str, Lamp) = (
    "spot = { position = [2, 1.5, 1], direction = [-2, -1.5, -1], intensity = 2, inner_angle = 40, outer_angle = 50 }",
    |point| {
        let (place, axis) = (DVec3::new(2.0, 1.5, 1.0), DVec3::new(-2.0, -1.5, -1.0).normalize());
        let to_light = place - point;
        let [inner, outer] = [40.0f64, 50.0].map(|angle| angle.to_radians().cos());
        let cone = ((-to_light.normalize().dot(axis) - outer) / (inner - outer)).clamp(0.0, 1.0);
        (to_light, 2.0 * cone * cone / to_light.length_squared())
    },
);

/// A world of surfaces in this light, with these settings.
fn lit(light: &str, settings: &str) -> World {
    world(&format!("{SCENE}\n[lights]\nlamp.{light}\n[techniques.direct]\n{settings}"))
}

/// Of the pixels that a light would light: how many there are, how many are in shadow, and how many have another shadow than
/// there is, though there is no edge of a shadow within so many metres, as `footprint` says at a distance from the light, along
/// the surface.
fn errors(world: &World, lamp: Lamp, footprint: impl Fn(f64) -> f64) -> Option<[usize; 3]> {
    let gpu = gpu()?;
    let image = picture(&gpu, world);
    let (vertices, list) = triangles(&world.surfaces);
    let corners: Vec<_> =
        list.iter().map(|t| [t.x, t.y, t.z].map(|i| vertices[i as usize].position.as_dvec3())).collect();
    let view = view_of(world);
    let eye = view.position.as_dvec3();
    // Whether light comes to a point beside a surface.
    let reached = |point: DVec3, normal: DVec3| {
        let (to_light, _) = lamp(point);
        let start = point + 1e-9 * normal;
        cast(&corners, start, to_light).is_none_or(|(_, t)| t >= 1.0)
    };
    let mut count = [0; 3];
    for (i, found) in image.pixels.iter().enumerate().step_by(3) {
        let film = Vec2::new((i % 141) as f32, (i / 141) as f32) + 0.5;
        let Some((number, distance)) = cast(&corners, eye, through(&view, film)) else { continue };
        let point = eye + distance * through(&view, film);
        let [a, b, c] = corners[number];
        let mut normal = (b - a).cross(c - a).normalize();
        normal *= -normal.dot(point - eye).signum();
        let surface = &world.surfaces[list[number].w as usize].name;
        let shading = if surface == "ball" { (point - DVec3::new(0.2, 0.5, 0.0)).normalize() } else { normal };
        let (to_light, irradiance) = lamp(point);
        let cosine = shading.dot(to_light.normalize());
        let slant = normal.dot(to_light.normalize());
        if slant <= 1e-3 || cosine < 0.03 || irradiance < 1e-3 {
            continue;
        }
        let visible = f64::from(found[0]) / (0.5 / std::f64::consts::PI * irradiance * cosine);
        let truth = if reached(point, normal) { 1.0 } else { 0.0 };
        count[0] += 1;
        count[1] += usize::from(truth == 0.0);
        if (visible - truth).abs() > tolerance::SHADOW {
            // On the surface, a texel is stretched along the light.
            let reach = footprint(to_light.length()) / slant;
            let (x, y) = normal.any_orthonormal_pair();
            let edge = (0..256).any(|k| {
                let (angle, r) = (f64::from(k) * 2.399_963, reach * (f64::from(k + 1) / 256.0).sqrt());
                reached(point + r * (angle.cos() * x + angle.sin() * y), normal) != (truth == 1.0)
            });
            // Nor is it one of the surface itself, which a rasteriser rounds.
            let same = [(0.01, 0.0), (-0.01, 0.0), (0.0, 0.01), (0.0, -0.01)].iter().all(|&(x, y)| {
                let hit = cast(&corners, eye, through(&view, film + Vec2::new(x, y)));
                hit.is_some_and(|(other, _)| list[other].w == list[number].w)
            });
            if !edge && same {
                count[2] += 1;
            }
        }
    }
    Some(count)
}

/// Holds all pixels against rays; `share` is the least share of them that is in shadow.
fn assert_shadows(world: &World, lamp: Lamp, share: f64, footprint: impl Fn(f64) -> f64) {
    let Some([lit, shadowed, wrong]) = errors(world, lamp, footprint) else { return };
    assert!(lit > 1300 && shadowed as f64 > share * lit as f64, "{shadowed} of {lit} pixels are in shadow");
    assert_eq!(wrong, 0, "of {lit} pixels, {shadowed} in shadow");
}

/// How far the filter reaches, with its border, from the middle of the texel that a point is in [texels].
const REACH: f64 = 1.0 + std::f64::consts::SQRT_2;

/// The ball around all casters, and the texels that a map of it has across.
fn ball(world: &World) -> f64 {
    let (vertices, _) = triangles(&world.surfaces);
    let [low, high] = vertices
        .iter()
        .map(|v| [v.position; 2])
        .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
        .unwrap_or([Vec3::ZERO; 2]);
    f64::from((high - low).length())
}

#[test]
fn parallel_light() {
    for (light, lamp) in [SUN, GRAZING] {
        let world = lit(light, "cascades = 1\nshadow_resolution = 512");
        let texel = ball(&world) / (512.0 - 4.0);
        assert_shadows(&world, lamp, 0.04, |_| REACH * texel);
    }
}

/// Cascades are finer where the camera is near: nowhere coarser than one map.
#[test]
fn cascades() {
    let world = lit(SUN.0, "cascades = 4\nshadow_resolution = 512");
    let texel = ball(&world) / (512.0 - 4.0);
    assert_shadows(&world, SUN.1, 0.04, |_| REACH * texel);
}

#[test]
fn light_at_a_point() {
    let world = lit(POINT.0, "shadow_resolution = 512");
    // Towards the corners of a face texels are seen from farther.
    assert_shadows(&world, POINT.1, 0.04, |distance| REACH * 2.0 * distance / (256.0 - 4.0));
}

#[test]
fn light_in_a_cone() {
    let world = lit(SPOT.0, "shadow_resolution = 512");
    let tangent = 50f64.to_radians().tan();
    assert_shadows(&world, SPOT.1, 0.04, |distance| REACH * 2.0 * tangent * distance / (512.0 - 4.0));
}

/// A kernel as wide as it goes: no surface shadows itself, and no shadow leaves its caster.
#[test]
fn wide_filters() {
    for (light, lamp) in [SUN, POINT] {
        let world = lit(light, "cascades = 1\nshadow_resolution = 512\nshadow_radius = 4");
        let texel = ball(&world).max(2.0 * 4.0) / (256.0 - 10.0);
        assert_shadows(&world, lamp, 0.04, |_| (4.0 + REACH) * texel);
    }
}

/// What the test would see of a light that comes from elsewhere.
#[test]
fn another_light_is_caught() {
    let world = lit("directional = { direction = [-2, -1.5, -1.2], irradiance = 3 }", "shadow_resolution = 512");
    let texel = ball(&world) / (512.0 - 4.0);
    let Some([_, _, wrong]) = errors(&world, SUN.1, |_| REACH * texel) else { return };
    assert!(wrong > 30, "{wrong}");
}
