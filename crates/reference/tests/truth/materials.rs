//! Materials, textures and normals as the tracer shows them.

use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

use glam::{DVec3, Mat4, Vec3, Vec4};
use tyndall_reference::Tracer;
use tyndall_scene::World;
use tyndall_scene::surface::{Bsdf, Map, Material, NormalMap, Surface, Texture};

use crate::worlds::*;

/// The square of two metres about the origin, its front up, under a sun straight down of irradiance π: it shows what it
/// reflects of white light.
fn square() -> World {
    scene(
        r#"
        materials.half.lambert.reflectance = 0.5
        [lights.sun.directional]
        direction = [0, -1, 0]
        irradiance = 3.1415927
        [surfaces.square]
        material = "half"
        shape.quad = { corner = [-1, 0, 1], edges = [[2, 0, 0], [0, 0, -2]] }
    "#,
    )
}

fn with(change: impl FnOnce(&mut Surface, &mut Material)) -> World {
    let mut world = square();
    let mut material = (*world.surfaces[0].material).clone();
    change(&mut world.surfaces[0], &mut material);
    world.surfaces[0].material = Arc::new(material);
    world
}

fn picture(texels: &[[u8; 4]]) -> Map {
    Map::new(Texture { width: texels.len() as u32, height: 1, texels: texels.to_vec(), srgb: false })
}

/// What is seen of the point (x, 0, 0) from above.
fn seen(world: &World, x: f64) -> DVec3 {
    look(world, DVec3::new(x, 2.0, 0.0), DVec3::NEG_Y, Some(1), 10).mean
}

#[track_caller]
fn assert_close(a: DVec3, b: DVec3) {
    assert!((a - b).abs().max_element() < 1e-6, "{a} should be {b}");
}

/// E ρ/π · cosθ on either side, and nothing of what arrives on the other.
#[test]
fn lambert_on_both_sides() {
    assert_close(seen(&square(), 0.3), DVec3::splat(0.5));
    let below = look(&square(), DVec3::new(0.3, -2.0, 0.0), DVec3::Y, Some(1), 10).mean;
    assert_eq!(below, DVec3::ZERO);
    let turned = with(|surface, _| surface.world_from_object = Mat4::from_rotation_z(std::f32::consts::PI));
    assert_close(seen(&turned, 0.3), DVec3::splat(0.5));
}

/// Beer's law on the way to the wall and back: ρ e^{−σ(1 + √2)} at 45°.
#[test]
fn wall_in_an_absorbing_medium() {
    let mut world = square();
    let optics = grey(0.0, 0.7, tyndall_scene::description::Phase::Isotropic);
    world.volumes.push(volume(
        tyndall_scene::Field::Homogeneous,
        Vec3::new(-9.0, -1.0, -9.0),
        Vec3::new(9.0, 1.0, 9.0),
        optics,
    ));
    let estimate = look(&world, DVec3::new(-4.0, 4.0, 0.0), DVec3::new(1.0, -1.0, 0.0), None, 10);
    assert_close(estimate.mean, DVec3::splat(0.5 * (-0.7 * (1.0 + 2.0f64.sqrt())).exp()));
}

/// A lamp at height h over a wall gives I cosθ/r².
#[test]
fn lamp_over_a_wall() {
    let mut world = square();
    world.lights.clear();
    let lamp =
        tyndall_scene::description::Light::Point { position: Vec3::new(0.0, 0.5, 0.0), intensity: Vec3::splat(3.0) };
    world.lights.insert("lamp".into(), lamp);
    let square: f64 = 0.25 + 0.36;
    assert_close(seen(&world, 0.6), DVec3::splat(0.5 * FRAC_1_PI * 3.0 * 0.5 / square.powf(1.5)));
}

/// A picture and colours of the vertices multiply the reflectance; where the picture is transparent there is nothing.
#[test]
fn textures() {
    let texels = [[255, 0, 0, 255], [0, 255, 255, 0]];
    let textured = |cutoff| {
        with(|surface, material| {
            material.bsdf = Bsdf::Lambert { reflectance: Vec3::splat(0.5), map: Some(picture(&texels)) };
            material.alpha_cutoff = cutoff;
            Arc::make_mut(&mut surface.mesh).colors = vec![Vec4::new(1.0, 1.0, 0.5, 1.0); 4];
        })
    };
    // The texels' centres are at x = −0.5 and 0.5.
    assert_close(seen(&textured(None), -0.5), DVec3::new(0.5, 0.0, 0.0));
    assert_close(seen(&textured(None), 0.5), DVec3::new(0.0, 0.5, 0.25));
    assert_close(seen(&textured(Some(0.5)), -0.5), DVec3::new(0.5, 0.0, 0.0));
    assert_eq!(seen(&textured(Some(0.5)), 0.5), DVec3::ZERO);
    // Light falls through, too.
    let floor = square().surfaces.remove(0);
    let mut both = textured(Some(0.5));
    both.surfaces.push(Surface { world_from_object: Mat4::from_translation(Vec3::new(0.0, -1.0, 0.0)), ..floor });
    assert_close(seen(&both, 0.5), DVec3::splat(0.5));
    let slanted = look(&both, DVec3::new(1.5, 0.0, 0.0), DVec3::new(-1.0, -1.0, 0.0), Some(1), 10);
    assert_close(slanted.mean, DVec3::splat(0.5));
    let shaded = look(&both, DVec3::new(-1.5, -0.5, 0.0), DVec3::new(1.0, -0.5, 0.0), Some(1), 10);
    assert_close(shaded.mean, DVec3::ZERO);
}

/// Green is roughness and blue is metallic: a texel of both 0 is a smooth dielectric, which shows its base less 4 % straight down.
#[test]
fn metallic_and_roughness_by_texture() {
    let of = |texel: [u8; 4]| {
        let world = with(|_, material| {
            material.bsdf = Bsdf::MetallicRoughness {
                base_color: Vec3::splat(0.5),
                base_color_map: None,
                metallic: 1.0,
                roughness: 1.0,
                metallic_roughness_map: Some(picture(&[texel])),
            }
        });
        look(&world, DVec3::new(-0.4, 0.3, 0.0), DVec3::new(0.8, -0.6, 0.0), Some(1), 10).mean.x
    };
    // Both at once: v·h = cos(θ/2) where the sun stands straight up and cosθ = 0.6, far off a smooth dielectric's highlight.
    let f = 0.04 + 0.96 * (1.0 - 0.8f64.sqrt()).powi(5);
    assert!((of([255, 0, 0, 255]) - (1.0 - f) * 0.5).abs() < 1e-3);
    assert!(of([255, 0, 255, 255]) < 1e-3 && of([255, 255, 255, 255]) > 0.02);
}

/// A map of normals tilts by 36.9° along the picture's axes: the sun's cosine falls to 0.8; and mirrored, it still does, the
/// other way for an eye that a tilt would hide.
#[test]
fn normal_maps() {
    // (2·rgb − 1) = (0.6, 0, 0.8), up to 8 bits.
    let texel = [204u8, 128, 230, 255];
    let bent = texel.map(|x| f64::from(x) / 255.0 * 2.0 - 1.0);
    let normal = DVec3::new(bent[0], bent[1], bent[2]).normalize();
    for mirror in [1.0, -1.0] {
        let world = with(|surface, material| {
            Arc::make_mut(&mut surface.mesh).tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4];
            material.normal_map = Some(NormalMap { map: picture(&[texel]), scale: 1.0 });
            surface.world_from_object = Mat4::from_scale(Vec3::new(mirror, 1.0, 1.0));
        });
        assert_close(seen(&world, 0.2), DVec3::splat(0.5 * normal.z));
        // The tangent is +x, mirrored −x: 80° off the normal on that side, the eye is within 90° of the bent normal only there.
        let from = |x: f64| look(&world, DVec3::new(x, 0.1, 0.0), DVec3::new(-x, -0.1, 0.0), Some(1), 4).mean.x;
        let side = f64::from(mirror) * 0.9;
        assert!(from(side) > 0.3 && from(-side) == 0.0, "{} {}", from(side), from(-side));
    }
}

/// Normals for shading, however they are bent, let no light through: the sun from below shows nothing above.
#[test]
fn nothing_leaks() {
    let world = with(|surface, _| {
        let mesh = Arc::make_mut(&mut surface.mesh);
        mesh.normals = vec![Vec3::new(0.9, 0.3, 0.0).normalize(); 4];
    });
    let mut below = world.clone();
    let sun =
        tyndall_scene::description::Light::Directional { direction: Vec3::new(-1.0, 0.1, 0.0), irradiance: Vec3::ONE };
    below.lights.insert("sun".into(), sun);
    assert_eq!(seen(&below, 0.2), DVec3::ZERO);
    let mut broken = square();
    Arc::make_mut(&mut broken.surfaces[0].mesh).normals = vec![Vec3::NAN; 4];
    assert_close(seen(&broken, 0.2), DVec3::splat(0.5));
}

/// The front emits, and stays the front under a mirroring transform; the back only if it is told to.
#[test]
fn emission_has_a_side() {
    for (mirror, both) in [(1.0, false), (-1.0, false), (1.0, true)] {
        let world = with(|surface, material| {
            (material.emission, material.double_sided) = (Vec3::new(3.0, 2.0, 1.0), both);
            surface.world_from_object = Mat4::from_scale(Vec3::new(1.0, 1.0, mirror));
        });
        let of = |y: f64| look(&world, DVec3::new(0.2, y, 0.1), DVec3::new(0.0, -y, 0.0), Some(0), 4).mean;
        assert_eq!(of(1.0), DVec3::new(3.0, 2.0, 1.0));
        assert_eq!(of(-1.0), if both { DVec3::new(3.0, 2.0, 1.0) } else { DVec3::ZERO });
    }
}

/// A square light over a point: E = L/2 Σ θᵢ cosγᵢ, the angle that each edge takes up times the cosine of its plane's normal
/// [Lambert1760].
#[test]
fn square_light() {
    let world = scene(
        r#"
        materials.white.lambert.reflectance = 1
        [surfaces.floor]
        material = "white"
        shape.quad = { corner = [-5, 0, 5], edges = [[10, 0, 0], [0, 0, -10]] }
        [surfaces.light]
        radiance = [2, 1, 4]
        shape.quad = { corner = [-0.5, 0.4, -0.5], edges = [[1, 0, 0], [0, 0, 1]] }
    "#,
    );
    let corner = |i: usize| {
        let (x, z) = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)][i % 4];
        DVec3::new(x, 0.4, z).normalize()
    };
    let edges = (0..4).map(|i| {
        let (a, b) = (corner(i), corner(i + 1));
        a.dot(b).acos() * a.cross(b).normalize().y.abs()
    });
    let irradiance = 0.5 * edges.sum::<f64>();
    let estimate = look(&world, DVec3::new(0.0, 0.2, 0.0), DVec3::NEG_Y, Some(1), 40_000);
    estimate.assert(DVec3::new(2.0, 1.0, 4.0) * irradiance / PI, 0.003);
}

/// Through a pane of glass that is met straight there comes T = 2n/(n² + 1) of the light, all reflections between its faces
/// included, and 1 − T is reflected.
#[test]
fn pane_of_glass() {
    let world = scene(
        r#"
        materials.glass.dielectric.ior = 1.5
        [surfaces.pane]
        material = "glass"
        shape.box = { min = [-9, 0, -9], max = [9, 0.1, 9] }
        [surfaces.light]
        material = "black"
        radiance = [1, 2, 0]
        double_sided = true
        shape.quad = { corner = [-9, -1, -9], edges = [[18, 0, 0], [0, 0, 18]] }
        [surfaces.other]
        material = "black"
        radiance = [0, 0, 1]
        double_sided = true
        shape.quad = { corner = [-9, 2, -9], edges = [[18, 0, 0], [0, 0, 18]] }
        [materials.black.lambert]
        reflectance = 0
    "#,
    );
    let passed = 2.0 * 1.5 / (1.5f64 * 1.5 + 1.0);
    let estimate = look(&world, DVec3::new(0.3, 1.0, 0.2), DVec3::NEG_Y, None, 40_000);
    estimate.assert(DVec3::new(passed, 2.0 * passed, 1.0 - passed), 0.002);
}

/// A mirror shows what stands before it, by its reflectance, and its depth counts.
#[test]
fn mirror() {
    let world = scene(
        r#"
        materials.mirror.mirror.reflectance = [0.9, 0.5, 0.1]
        [surfaces.mirror]
        material = "mirror"
        shape.quad = { corner = [-1, 0, 1], edges = [[2, 0, 0], [0, 0, -2]] }
        [lights.sky.constant]
        radiance = 2
    "#,
    );
    assert_close(seen(&world, 0.1), DVec3::new(1.8, 1.0, 0.2));
    assert_eq!(look(&world, DVec3::Y, DVec3::NEG_Y, Some(0), 4).mean, DVec3::ZERO);
    assert_close(
        Tracer::new(&world).unwrap().radiance(
            DVec3::Y,
            DVec3::Y,
            Some(0),
            &mut tyndall_reference::Random::new(1, 0, 0),
        ),
        DVec3::splat(2.0),
    );
}
