//! How pictures lie on surfaces: the rasteriser, rays of instant radiosity and the reference show them alike.

use std::sync::Arc;

use glam::{Affine2, DVec3, Vec2, Vec3};
use tyndall_reference::{Random, Tracer};
use tyndall_scene::World;
use tyndall_scene::image::Image;
use tyndall_scene::metrics::linear::linear_errors;
use tyndall_scene::surface::{Bsdf, Map, Texture, Wrap};

use super::{gpu, picture, tolerance, world};
use crate::surfaces::test::{through, view_of};

/// Six squares that emit a picture: one as it is, two that go on as a mirror and by their edge, one that is turned, one in the
/// second set of texture coordinates, and one whose alpha, in that set, cuts it out.
fn squares(technique: &str) -> World {
    let square = |i: usize| {
        let (x, y) = (1.1 * (i % 3) as f32 - 1.6, 1.1 * (i / 3) as f32 - 1.05);
        format!(
            "surfaces.s{i} = {{ shape.quad = {{ corner = [{x}, {y}, 0], edges = [[1, 0, 0], [0, 1, 0]] }}, radiance = 1, material = \"black\" }}\n"
        )
    };
    let mut world = world(&format!(
        "camera = {{ position = [0, 0, 5], target = [0, 0, 0], fov = 28 }}\nfilm.size = [120, 84]\n\
         materials.black.lambert.reflectance = 0\n{technique}\n{}",
        (0..6).map(square).collect::<String>()
    ));
    let level = |i: u32| ((i * 73) % 251) as u8;
    let texels = (0..12).map(|i| [level(i), level(i + 40), level(i + 80), if i % 5 == 0 { 0 } else { 255 }]);
    let plain = Map::new(Texture { width: 4, height: 3, texels: texels.collect(), srgb: true });
    let turned = Affine2::from_scale_angle_translation(Vec2::new(0.8, -0.6), 0.7, Vec2::new(0.2, 0.4));
    let maps = [
        plain.clone(),
        Map { wrap: [Wrap::Mirror, Wrap::Repeat], ..plain.clone() },
        Map { wrap: [Wrap::Clamp, Wrap::Mirror], ..plain.clone() },
        Map { transform: turned, wrap: [Wrap::Repeat, Wrap::Clamp], ..plain.clone() },
        Map { second: true, ..plain.clone() },
        plain.clone(),
    ];
    for (i, (surface, map)) in world.surfaces.iter_mut().zip(maps).enumerate() {
        let mesh = Arc::make_mut(&mut surface.mesh);
        mesh.second_texcoords = mesh.texcoords.iter().map(|uv| Vec2::new(1.5 * uv.y, 2.0 - uv.x)).collect();
        mesh.texcoords.iter_mut().for_each(|uv| *uv = 2.5 * *uv - 0.8);
        let material = Arc::make_mut(&mut surface.material);
        material.emission_map = Some(map);
        if i == 5 {
            let cut = Map { second: true, wrap: [Wrap::Clamp, Wrap::Mirror], ..plain.clone() };
            material.bsdf = Bsdf::Lambert { reflectance: Vec3::ZERO, map: Some(cut) };
            material.alpha_cutoff = Some(0.5);
        }
    }
    world
}

/// The reference through points of a grid of so many a side in every pixel.
pub fn reference(world: &World, side: u32) -> Image {
    let tracer = Tracer::new(world).unwrap();
    let view = view_of(world);
    let mut rng = Random::new(1, 0, 0);
    let pixels = (0..view.width * view.height).map(|i| {
        let corner = Vec2::new((i % view.width) as f32, (i / view.width) as f32);
        let points = (0..side * side).map(|k| (Vec2::new((k % side) as f32, (k / side) as f32) + 0.5) / side as f32);
        let seen = points
            .map(|point| tracer.radiance(view.position.as_dvec3(), through(&view, corner + point), Some(1), &mut rng));
        (seen.sum::<DVec3>() / f64::from(side * side)).as_vec3().to_array()
    });
    Image { width: view.width, height: view.height, pixels: pixels.collect(), ..Default::default() }
}

/// Through the middle of pixels all is exact, but on edges.
#[test]
fn rasterised_pictures_lie_as_the_reference_has_them() {
    let Some(gpu) = gpu() else { return };
    let world = squares("");
    let (found, expected) = (picture(&gpu, &world), reference(&world, 1));
    let differ = |(a, b): &(&[f32; 3], &[f32; 3])| (0..3).any(|c| (a[c] - b[c]).abs() > tolerance::PROBE_MAP as f32);
    let others = found.pixels.iter().zip(&expected.pixels).filter(differ).count();
    println!("{others} of {} pixels differ", found.pixels.len());
    assert!(others <= tolerance::EDGE_PIXELS, "{others} pixels");
    assert!(found.pixels.iter().filter(|pixel| pixel[0] > 0.0).count() > 4000);
}

/// A picture of so many texels a side of what is between black and white, sRGB.
fn noise(side: u32) -> Texture {
    let level = |i: u32| (i.wrapping_mul(2_654_435_761) >> 24) as u8;
    let texels = (0..side * side).map(|i| [level(i), level(i + 7919), level(i + 104_729), 255]);
    Texture { width: side, height: side, texels: texels.collect(), srgb: true }
}

/// A picture of half as many texels a side: means of 2 x 2.
fn halved(texture: &Texture) -> Texture {
    let side = texture.width / 2;
    let map = Map { wrap: [Wrap::Clamp; 2], ..Map::new(texture.clone()) };
    // Bilinear in the middle of four texels is their mean.
    let middle = |i: u32| Vec2::new((i % side) as f32 + 0.5, (i / side) as f32 + 0.5) / side as f32;
    Texture::of_light([side; 2], (0..side * side).map(|i| map.at([middle(i); 2]).truncate()))
}

/// Four squares face the camera, 32 pixels a side each, with a picture of 64 texels: what is seen is interpolated between
/// the two levels of which a pixel has as many texels as the longer of its sides says, however pictures lie and go on.
#[test]
fn pictures_are_averaged_over_pixels() {
    let Some(gpu) = gpu() else { return };
    let square = |i: usize| {
        let (x, y) = (2.0 * (i % 2) as f32 - 2.0, 2.0 * (i / 2) as f32 - 2.0);
        format!(
            "surfaces.s{i} = {{ shape.quad = {{ corner = [{x}, {y}, 0], edges = [[2, 0, 0], [0, 2, 0]] }}, radiance = 1, material = \"black\" }}\n"
        )
    };
    let mut world = world(&format!(
        "camera = {{ position = [0, 0, 2], target = [0, 0, 0], fov = 90 }}\nfilm.size = [64, 64]\n\
         materials.black.lambert.reflectance = 0\n{}",
        (0..4).map(square).collect::<String>()
    ));
    let mut levels = vec![Arc::new(noise(64))];
    (0..6).for_each(|k| levels.push(Arc::new(halved(&levels[k]))));
    let plain = Map { texture: levels[0].clone(), ..Map::new(Texture::default()) };
    let maps = [
        plain.clone(),
        Map { wrap: [Wrap::Mirror; 2], ..plain.clone() },
        Map {
            wrap: [Wrap::Clamp, Wrap::Repeat],
            transform: Affine2::from_scale(Vec2::new(3.0, -1.2)),
            ..plain.clone()
        },
        Map { second: true, ..plain.clone() },
    ];
    // Texture coordinates by places on the square: the first set, and the second.
    let texcoords = |i: usize, at: Vec2| [[1.5, 2.5, 1.0, 8.0][i] * at - 0.4, 1.3 * Vec2::new(at.y, 1.0 - at.x)];
    for (i, (surface, map)) in world.surfaces.iter_mut().zip(&maps).enumerate() {
        let mesh = Arc::make_mut(&mut surface.mesh);
        let corner = mesh.positions[0];
        let places: Vec<_> = mesh.positions.iter().map(|p| (*p - corner).truncate() / 2.0).collect();
        [mesh.texcoords, mesh.second_texcoords] =
            [0, 1].map(|set| places.iter().map(|&at| texcoords(i, at)[set]).collect());
        Arc::make_mut(&mut surface.material).emission_map = Some(map.clone());
    }
    let found = picture(&gpu, &world);
    for (number, pixel) in found.pixels.iter().enumerate() {
        let (column, row) = (number % 64, number / 64);
        let i = column / 32 + 2 * (1 - row / 32);
        let at = |dx: f32, dy: f32| {
            let (x, y) = ((column % 32) as f32 + 0.5 + dx, (row % 32) as f32 + 0.5 + dy);
            texcoords(i, Vec2::new(x, 32.0 - y) / 32.0)
        };
        let (here, map) = (at(0.0, 0.0), &maps[i]);
        let sides = [at(1.0, 0.0), at(0.0, 1.0)].map(|next| 64.0 * (map.place(next) - map.place(here)));
        let level = sides[0].abs().max(sides[1].abs()).max_element().log2();
        assert!(level > 1.0, "all are smaller than their pictures");
        let of = |level: f32| Map { texture: levels[level as usize].clone(), ..map.clone() }.at(here);
        let expected = of(level.floor()).lerp(of(level.floor() + 1.0), level.fract());
        for c in 0..3 {
            assert!((pixel[c] - expected[c]).abs() < tolerance::MIPS as f32, "{column} {row}: {pixel:?} {expected}");
        }
    }
}

/// A floor of small squares, up to the horizon: without mip maps it is what the reference sees through the middle of pixels.
#[test]
fn a_chequered_floor_is_nearer_to_the_reference_with_mips() {
    let Some(gpu) = gpu() else { return };
    let mut world = world(
        "camera = { position = [0, 0.4, 0], target = [0.3, 0, -2], fov = 50 }\nfilm.size = [96, 64]\n\
         lights.sun.directional = { direction = [-1, -2, -1], irradiance = 3 }\n\
         surfaces.floor.shape.quad = { corner = [-20, 0, 1], edges = [[40, 0, 0], [0, 0, -40]] }",
    );
    let texels = (0..64 * 64).map(|i| [if (i / 8 + i / 512) % 2 == 0 { 20 } else { 235 }; 4]).collect();
    let map = Map::new(Texture { width: 64, height: 64, texels, srgb: true });
    Arc::make_mut(&mut world.surfaces[0].material).bsdf = Bsdf::Lambert { reflectance: Vec3::ONE, map: Some(map) };
    Arc::make_mut(&mut world.surfaces[0].mesh).texcoords.iter_mut().for_each(|uv| *uv *= 60.0);
    let whole = reference(&world, 12);
    let [with, without] =
        [picture(&gpu, &world), reference(&world, 1)].map(|image| linear_errors(&image, &whole).relative_rmse);
    println!("relative RMSE {with:.4} with mip maps, {without:.4} without");
    assert!(with < tolerance::CHEQUERED * without, "{with} {without}");
    // Each of several rays stands for a part of the pixel.
    let of = "camera = { position = [0, 0, 1], target = [0, 0, 0] }\ntechniques.direct.samples = 16";
    world.scene.techniques = super::world(of).scene.techniques;
    let several = linear_errors(&picture(&gpu, &world), &whole).relative_rmse;
    println!("with 16 rays a pixel {several:.4}");
    assert!(several < tolerance::CHEQUERED * with, "{several} {with}");
}

/// Rays go through many points of a pixel.
#[test]
fn traced_pictures_lie_as_the_reference_has_them() {
    let Some(gpu) = gpu() else { return };
    let world = squares("techniques.instant_radiosity = { paths = 64 }");
    let found = picture(&gpu, &world);
    let error = linear_errors(&found, &reference(&world, 8)).relative_rmse;
    println!("relative RMSE {error:.4}");
    assert!(error <= tolerance::LAID, "{error}");
    // Of a square whose picture lies in another way, that is seen.
    for i in 1..6 {
        let mut other = squares("");
        let material = Arc::make_mut(&mut other.surfaces[i].material);
        let map = material.emission_map.take().expect("each has one");
        let texture = map.texture.clone();
        material.emission_map = Some(Map { texture, ..Map::new(Texture::default()) });
        if i == 5 {
            material.bsdf = Bsdf::Lambert { reflectance: Vec3::ZERO, map: material.emission_map.clone() };
        }
        let error = linear_errors(&found, &reference(&other, 2)).relative_rmse;
        assert!(error > 5.0 * tolerance::LAID, "square {i}: {error}");
    }
}
