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
fn reference(world: &World, side: u32) -> Image {
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
