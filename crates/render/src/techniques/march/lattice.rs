//! A march of a lattice of pixels, refined, against a march of every pixel.

use glam::{Mat4, Vec3};
use std::sync::Arc;
use tyndall_scene::image::Image;
use tyndall_scene::volume::{Grid, Voxels};
use tyndall_scene::{Field, World};

use crate::Gpu;
use crate::test::{FIRE, PLUME, gpu, picture, shipped, tolerance, world, world_of};

/// A grid of 64 voxels a side over the unit cube, looked at from the front: 1.5 pixels a voxel.
fn cube(settings: &str, value: impl Fn(Vec3) -> f32) -> World {
    const SIDE: u32 = 64;
    let mut world = world(&format!(
        "camera = {{ position = [0, 0, 3], target = [0, 0, 0], fov = 30 }}\nfilm.size = [150, 110]\n\
         [techniques.march]\nmodel = \"emission\"\n{settings}\n[media.cube]\n\
         density.homogeneous = {{ min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }}\n\
         [media.cube.optics.transfer]\nunit_length = 0.02\nstops = [{{ value = 0.1, opacity = 0, color = [1, 0.5, 0.2] }}, \
         {{ value = 1, opacity = 0.9, color = [1, 0.9, 0.8] }}]"
    ));
    let at = |i: u32| Vec3::new((i % SIDE) as f32, (i / SIDE % SIDE) as f32, (i / SIDE / SIDE) as f32) + 0.5;
    let voxels = (0..SIDE.pow(3)).map(|i| value(at(i) / SIDE as f32)).collect();
    world.volumes[0].field = Field::Grid(Arc::new(Grid::dense([SIDE; 3], Voxels::F32(voxels), Mat4::IDENTITY)));
    world
}

/// A ball with waves on it: a rim, and detail.
fn ball(p: Vec3) -> f32 {
    let waves = 0.2 * (p * Vec3::new(40.0, 55.0, 47.0)).element_sum().sin();
    ((0.4 - (p - 0.5).length()) / 0.04).clamp(0.0, 1.0) * (0.7 + waves)
}

/// The mean and the greatest difference of two pictures, over all channels.
fn differences(found: &Image, expected: &Image) -> (f32, f32) {
    assert_eq!(found.pixels.len(), expected.pixels.len());
    assert!(expected.pixels.iter().any(|p| Vec3::from(*p).max_element() > 0.1), "there is something to compare");
    let each = || found.pixels.iter().flatten().zip(expected.pixels.iter().flatten()).map(|(a, b)| (a - b).abs());
    (each().sum::<f32>() / (3 * found.pixels.len()) as f32, each().fold(0.0, f32::max))
}

fn of(scene: &str, settings: &str) -> World {
    let text = format!("{}\n[techniques.march]\n{settings}", scene.replace("[640, 480]", "[150, 110]"));
    world_of(&text, &shipped())
}

/// With no tolerance the picture is that of a march of every pixel, to the last bit; on a film whose sides are no multiples of
/// the lattice's, with several rays a pixel, and in rounds.
#[test]
fn without_tolerance_every_pixel_is_marched() {
    let Some(mut gpu) = gpu() else { return };
    let check = |gpu: &Gpu, make: &dyn Fn(&str) -> World| {
        let whole = picture(gpu, &make(""));
        for lattice in ["half", "quarter"] {
            let refined = picture(gpu, &make(&format!("resolution = \"{lattice}\"\nresolution_tolerance = 0\n")));
            let (_, most) = differences(&refined, &whole);
            assert!(most <= tolerance::SAME_RAYS, "{lattice}: {most}");
        }
    };
    check(&gpu, &|settings| cube(settings, ball));
    check(&gpu, &|settings| of(PLUME, &format!("samples = 3\n{settings}")));
    gpu.limit_iterations(1_000);
    check(&gpu, &|settings| cube(settings, ball));
}

/// Interpolation is off by the tolerance at most in most pixels, and in the mean by a quarter of it; and less is marched:
/// the pictures differ.
#[test]
fn what_is_interpolated_is_within_the_tolerance() {
    let Some(gpu) = gpu() else { return };
    let scenes: [&dyn Fn(&str) -> World; 3] =
        [&|settings| cube(settings, ball), &|settings| of(PLUME, settings), &|settings| of(FIRE, settings)];
    for (i, make) in scenes.iter().enumerate() {
        let whole = picture(&gpu, &make(""));
        for lattice in ["half", "quarter"] {
            for most in [0.004f32, 0.016] {
                let settings = format!("resolution = \"{lattice}\"\nresolution_tolerance = {most}\n");
                let refined = picture(&gpu, &make(&settings));
                let (mean, greatest) = differences(&refined, &whole);
                let off = |(a, b): (&[f32; 3], &[f32; 3])| (Vec3::from(*a) - Vec3::from(*b)).abs().max_element() > most;
                let beyond = refined.pixels.iter().zip(&whole.pixels).filter(|&pair| off(pair)).count();
                let share = beyond as f64 / whole.pixels.len() as f64;
                eprintln!("scene {i}, {lattice}, {most}: mean {mean}, greatest {greatest}, beyond {share}");
                assert!(greatest > 0.0 && mean <= 0.25 * most, "scene {i}, {lattice}, {most}: mean {mean}");
                assert!(share <= tolerance::INTERPOLATED, "scene {i}, {lattice}, {most}: {share}");
            }
        }
    }
}

/// A filament a voxel thick and a ball of two voxels, alone in empty space, are found wherever they lie between rays of the lattice.
#[test]
fn thin_things_in_empty_space_are_found() {
    let Some(gpu) = gpu() else { return };
    for shift in [0.0, 0.007, 0.014, 0.021, 0.028] {
        let filament = move |p: Vec3| {
            let line = (p - Vec3::new(0.3 + shift, 0.0, 0.4)).reject_from_normalized(Vec3::Y).length();
            let dot = (p - Vec3::new(0.7, 0.4 + shift, 0.5)).length();
            (1.0 - 64.0 * line / 1.5).max(1.0 - 64.0 * dot / 2.0).max(0.0)
        };
        let whole = picture(&gpu, &cube("", filament));
        let refined = picture(&gpu, &cube("resolution = \"quarter\"", filament));
        let sum = |image: &Image| image.pixels.iter().flatten().map(|&v| f64::from(v)).sum::<f64>();
        let (found, expected) = (sum(&refined), sum(&whole));
        let (mean, most) = differences(&refined, &whole);
        eprintln!("{shift}: {found} of {expected}, mean {mean}, most {most}");
        assert!((found / expected - 1.0).abs() <= tolerance::THIN, "{shift}: {found} of {expected}");
    }
}
