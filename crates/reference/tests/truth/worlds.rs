//! Worlds to test in.

use std::sync::Arc;

use glam::{DVec3, Mat4, Vec3};
use tyndall_reference::{Random, Tracer};
use tyndall_scene::assets::Directory;
use tyndall_scene::description::{Angle, Light, Mie, Optics, Phase, Relative};
use tyndall_scene::phase::PhaseFunction;
use tyndall_scene::volume::{Budget, Grid, Voxels};
use tyndall_scene::{Document, Field, Volume, World};

use crate::tolerance::Estimate;

/// One of each kind of phase function that is the same in all channels, and Henyey–Greenstein's backwards.
pub fn greys() -> Vec<Phase> {
    vec![
        Phase::Isotropic,
        Phase::Rayleigh,
        Phase::Hg { g: 0.85 },
        Phase::Hg { g: -0.5 },
        Phase::CornetteShanks { g: 0.7 },
        Phase::Draine { g: -0.4, alpha: 3.0 },
        Phase::Droplets { diameter: 12.0 },
    ]
}

/// The same and tables.
pub fn phases() -> Vec<Phase> {
    [greys(), vec![coloured_table(), coloured_mie()]].concat()
}

/// Red goes on, green back, blue everywhere.
pub fn coloured_table() -> Phase {
    let values = [[5.0, 0.2, 1.0], [3.0, 0.5, 1.0], [0.5, 0.5, 1.0], [0.1, 2.0, 1.0]];
    Phase::Tabulated {
        angles: [0.0, 30.0, 90.0, 180.0].map(Angle).into(),
        values: values.map(|value| Relative(value.into())).into(),
    }
}

/// Spheres of about a wavelength: forward, the more so in blue.
pub fn coloured_mie() -> Phase {
    Phase::Mie(Mie {
        refractive_index: [1.5, 0.01],
        radius: 0.3,
        spread: 1.2,
        wavelengths: Vec3::new(680.0, 550.0, 440.0),
    })
}

pub fn optics(sigma_s: Vec3, sigma_a: Vec3, phase: Phase) -> Optics {
    Optics::Coefficients { sigma_s, sigma_a, emission: Vec3::ZERO, phase }
}

pub fn grey(sigma_s: f32, sigma_a: f32, phase: Phase) -> Optics {
    optics(Vec3::splat(sigma_s), Vec3::splat(sigma_a), phase)
}

pub fn volume(field: Field, min: Vec3, max: Vec3, optics: Optics) -> Volume {
    moved(field, Mat4::from_translation(min) * Mat4::from_scale(max - min), optics)
}

pub fn moved(field: Field, world_from_unit: Mat4, optics: Optics) -> Volume {
    let phase = PhaseFunction::new(&optics.phase(), "phase").unwrap();
    let unit_from_world = world_from_unit.inverse();
    Volume {
        name: "medium".into(),
        field,
        unit_from_world,
        world_from_unit,
        optics,
        phase,
        clip: Vec::new(),
        temperature: None,
        color: None,
    }
}

/// A homogeneous medium in [0,1]³.
pub fn unit(optics: Optics) -> Volume {
    volume(Field::Homogeneous, Vec3::ZERO, Vec3::ONE, optics)
}

pub fn world(volumes: Vec<Volume>, lights: Vec<Light>) -> World {
    let lights = lights.into_iter().enumerate().map(|(i, light)| (format!("light{i}"), light)).collect();
    World { volumes, lights, ..World::default() }
}

pub fn sky(radiance: f32) -> Light {
    Light::Constant { radiance: Vec3::splat(radiance) }
}

pub fn grid(dims: [u32; 3], value: impl Fn(u32, u32, u32) -> f32) -> Field {
    let [x, y, z] = dims;
    let voxels = (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| (i, j, k))));
    let voxels = Voxels::F32(voxels.map(|(i, j, k)| value(i, j, k)).collect());
    Field::Grid(Arc::new(Grid::dense(dims, voxels, Mat4::IDENTITY)))
}

/// Voxels from 0 to 1 at random, a third of them empty.
pub fn noise(dims: [u32; 3]) -> Field {
    grid(dims, |i, j, k| {
        let voxel = u64::from(i) + 1000 * (u64::from(j) + 1000 * u64::from(k));
        (1.5 * Random::new(77, voxel, 0).uniform() - 0.5).max(0.0) as f32
    })
}

/// Radiance of a ray, from `samples` paths.
pub fn look(world: &World, origin: DVec3, direction: DVec3, depth: Option<u32>, samples: u32) -> Estimate {
    let tracer = Tracer::new(world).unwrap();
    Estimate::of(samples, 1, |rng| tracer.radiance(origin, direction.normalize(), depth, rng))
}

/// Transmittance of a ray, from `samples` flights.
pub fn pass(world: &World, origin: DVec3, direction: DVec3, distance: f64, samples: u32) -> Estimate {
    let tracer = Tracer::new(world).unwrap();
    Estimate::of(samples, 1, |rng| tracer.transmittance(origin, direction.normalize(), distance, rng))
}

/// A world from a scene file's text, without camera.
pub fn scene(text: &str) -> World {
    let text = format!("camera = {{ position = [0, 0, 5], target = [0, 0, 0], fov = 40 }}\n{text}");
    let document = Document::new("test.toml", text);
    let scene = document.parse().unwrap_or_else(|error| panic!("{error}"));
    World::load(scene, &Directory(".".into()), Budget(1 << 20)).unwrap_or_else(|error| panic!("{error}"))
}

/// A quad on each side of the unit cube, by name, its front inside.
pub const CUBE: [(&str, &str); 6] = [
    ("floor", "shape.quad = { corner = [0, 0, 0], edges = [[0, 0, 1], [1, 0, 0]] }"),
    ("ceiling", "shape.quad = { corner = [0, 1, 0], edges = [[1, 0, 0], [0, 0, 1]] }"),
    ("left", "shape.quad = { corner = [0, 0, 0], edges = [[0, 1, 0], [0, 0, 1]] }"),
    ("right", "shape.quad = { corner = [1, 0, 0], edges = [[0, 0, 1], [0, 1, 0]] }"),
    ("back", "shape.quad = { corner = [0, 0, 0], edges = [[1, 0, 0], [0, 1, 0]] }"),
    ("front", "shape.quad = { corner = [0, 0, 1], edges = [[0, 1, 0], [1, 0, 0]] }"),
];

/// The unit cube from within; of each side, what there is besides its shape.
pub fn room(materials: &str, of: impl Fn(&str) -> &'static str) -> World {
    let sides = CUBE.map(|(name, shape)| format!("[surfaces.{name}]\n{shape}\n{}\n", of(name)));
    scene(&format!("{materials}\n{}", sides.concat()))
}

/// What a point of the floor shows upwards, on average over all of the floor; of the ceiling, walls likewise.
pub fn mean_of_side(world: &World, side: &str, depth: Option<u32>, samples: u32) -> Estimate {
    let tracer = Tracer::new(world).unwrap();
    Estimate::of(samples, 7, |rng| {
        let (u, v) = (rng.uniform(), rng.uniform());
        let (point, out) = match side {
            "floor" => (DVec3::new(u, 0.0, v), DVec3::Y),
            "ceiling" => (DVec3::new(u, 1.0, v), DVec3::NEG_Y),
            "left" => (DVec3::new(0.0, u, v), DVec3::X),
            _ => panic!("no such side"),
        };
        tracer.radiance(point + out * 1e-6, -out, depth, rng)
    })
}
