//! WGSL functions, run on the device over many inputs, against their Rust twins.

use glam::{DVec3, UVec3, Vec3, Vec4};
use tyndall_scene::Field;
use tyndall_scene::field::{Fractal, gradient_noise};
use tyndall_scene::image::tonemap;
use tyndall_scene::phase::{Blend, PhaseFunction, PhaseTable};

use super::{gpu, tolerance};
use crate::Gpu;
use crate::graph::{Bindings, Resource, Shader, shader};
use crate::math::{brdf, octahedral, phase, ray, slab};
use crate::resident::expression::Expressions;

/// Runs a probe: a shader that maps `input` to `output`, an invocation an element.
pub fn probe(gpu: &Gpu, shader: &'static Shader, input: &[Vec4]) -> Vec<Vec4> {
    probe_with(gpu, shader, input, &[])
}

/// As [`probe`], with what else the shader reads.
pub fn probe_with(gpu: &Gpu, shader: &Shader, input: &[Vec4], also: &[(&'static str, Resource<'_>)]) -> Vec<Vec4> {
    assert_eq!(input.len() % 64, 0, "whole workgroups");
    let source = gpu.buffer("input", &input.to_vec());
    let size = source.size();
    let target = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("output"),
        size,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let readable = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("readable"),
        size,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let reflection = shader.reflect().unwrap();
    let mut bindings = Bindings::default();
    bindings.read("input", (&source).into());
    bindings.write("output", (&target).into());
    for &(name, resource) in also {
        bindings.read(name, resource);
    }
    bindings.check("probe", &reflection).unwrap();
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(shader.name),
        source: wgpu::ShaderSource::Wgsl(shader.source.clone()),
    });
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(shader.name),
        layout: None,
        module: &module,
        entry_point: None,
        compilation_options: Default::default(),
        cache: None,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bindings.group(gpu, "probe", &pipeline.get_bind_group_layout(0), &reflection), &[]);
    pass.dispatch_workgroups(input.len() as u32 / 64, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&target, 0, &readable, 0, size);
    gpu.queue.submit([encoder.finish()]);
    let bytes = pollster::block_on(crate::renderer::map(gpu, &readable)).unwrap();
    bytemuck::cast_slice::<u8, [f32; 4]>(&bytes).iter().map(|&v| Vec4::from(v)).collect()
}

/// Numbers in [0, 1), evenly spread: the fractional parts of multiples of irrational numbers.
pub fn spread(i: usize, dimension: usize) -> f32 {
    const IRRATIONAL: [f64; 6] =
        [0.754_877_666, 0.569_840_291, 0.618_033_989, 0.414_213_562, 0.732_050_808, 0.236_067_977];
    (i as f64 * IRRATIONAL[dimension]).fract() as f32
}

pub fn assert_close(found: f64, expected: f64, tolerance: f64, at: impl std::fmt::Debug) {
    let error = (found - expected).abs() / expected.abs().max(1.0);
    assert!(error <= tolerance, "{found} for {expected} at {at:?}");
}

#[test]
fn phase_functions_equal_their_twins() {
    static PHASE: Shader = shader!("test/probes/phase");
    let Some(gpu) = gpu() else { return };
    let input: Vec<_> = (0..6400)
        .flat_map(|i| {
            let [g_hg, g_d] = [0, 1].map(|dimension| f64::from(spread(i, dimension)) * 1.8 - 0.9);
            let (alpha, w_d) = (f64::from(spread(i, 2)) * 30.0, f64::from(spread(i, 3)));
            let function = match i % 5 {
                0 => PhaseFunction::Isotropic,
                1 => PhaseFunction::Rayleigh,
                2 => PhaseFunction::HenyeyGreenstein { g: g_hg },
                3 => PhaseFunction::Draine { g: g_d, alpha },
                _ => PhaseFunction::Blend(Blend { g_hg, g_d, alpha, w_d }),
            };
            let (kind, parameters) = phase::encode(&function);
            assert_eq!(kind as usize, i % 5);
            let cos_theta = [-1.0, 1.0, spread(i, 4) * 2.0 - 1.0][(i / 5).min(2)];
            [Vec4::new(kind as f32, cos_theta, 0.0, 0.0), parameters]
        })
        .collect();
    for (pair, found) in input.chunks(2).zip(probe(&gpu, &PHASE, &input).chunks(2)) {
        let (kind, cos_theta, parameters) = (pair[0].x as u32, f64::from(pair[0].y), pair[1]);
        let expected = phase::phase(kind, parameters, cos_theta);
        // Near the peak of a strongly forward lobe, rounding of 1 + g² − 2g cosθ is amplified.
        let amplified =
            [parameters.x, parameters.y].map(|g| 1.0 / f64::from(1.0 + g * g - 2.0 * g * pair[0].y).min(1.0));
        assert_close(found[0].x.into(), expected, tolerance::PROBE * amplified[0].max(amplified[1]), pair);
        let coordinate = phase::phase_table_coordinate(cos_theta);
        assert_close(found[0].y.into(), coordinate, tolerance::PROBE, pair);
        assert!((coordinate - PhaseTable::coordinate(cos_theta)).abs() < 1e-8, "{cos_theta}");
    }
}

#[test]
fn brdfs_equal_their_twin() {
    static BRDF: Shader = shader!("test/probes/brdf");
    let Some(gpu) = gpu() else { return };
    let direction = |i: usize, d: usize| {
        let (z, phi) = (spread(i, d) * 1.1 - 0.1, spread(i, d + 1) * std::f32::consts::TAU);
        Vec3::new((1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z)
    };
    let input: Vec<_> = (0..6400)
        .flat_map(|i| {
            let light = direction(i, 0);
            // Every third viewer is near the mirrored direction, where lobes peak.
            let mirrored = (light * Vec3::new(-1.0, -1.0, 1.0) + 0.02 * direction(i, 1)).normalize();
            let viewer = if i % 3 == 0 { mirrored } else { direction(i, 2) };
            let base = Vec3::new(spread(i, 4), spread(i, 5), 0.5).extend([1, 1, 1, 0, 2, 3][i % 6] as f32);
            let alpha = (spread(i, 3).powi(2)).max(0.001);
            [base, Vec4::new(spread(i, 0), alpha, 0.0, 0.0), light.extend(0.0), viewer.extend(0.0)]
        })
        .collect();
    for (case, found) in input.chunks(4).zip(probe(&gpu, &BRDF, &input).chunks(4)) {
        let [base, b, light, viewer] = [0, 1, 2, 3].map(|k| case[k].as_dvec4());
        let twin = brdf::Brdf { kind: base.w as u32, base: base.truncate(), metallic: b.x, alpha: b.y };
        let expected = twin.value(DVec3::Z, light.truncate(), viewer.truncate());
        // The half vector is rounded by 2⁻²⁴; the lobe changes within α.
        for c in 0..3 {
            assert_close(found[0][c].into(), expected[c], tolerance::PROBE / b.y, case);
        }
    }
}

#[test]
fn directions_come_back_packed() {
    static OCTAHEDRAL: Shader = shader!("test/probes/octahedral");
    let Some(gpu) = gpu() else { return };
    let mut input: Vec<_> =
        (0..6400).map(|i| (Vec3::from([0, 1, 2].map(|d| spread(i, d))) - 0.5).normalize().extend(0.0)).collect();
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis.extend(0.0));
    input[..6].copy_from_slice(&[axes[0], axes[1], axes[2], -axes[0], -axes[1], -axes[2]]);
    for (x, found) in input.iter().zip(probe(&gpu, &OCTAHEDRAL, &input)) {
        let x = x.truncate().as_dvec3();
        let twin = octahedral::unpack_direction(octahedral::pack_direction(x));
        assert!(found.truncate().as_dvec3().distance(x) < tolerance::PROBE_PACKED, "{x} {found}");
        assert!(twin.distance(x) < tolerance::PROBE_PACKED, "{x} {twin}");
    }
}

#[test]
fn unit_cube_spans_equal_their_twins() {
    static RAY: Shader = shader!("test/probes/ray");
    let Some(gpu) = gpu() else { return };
    let input: Vec<_> = (0..6400)
        .map(|i| {
            // Origins in and around the cube, directions all around.
            let scale = if i % 2 == 0 { 2.0 } else { 1.0 };
            let v = Vec3::from([0, 1, 2].map(|d| (spread(i, d) - 0.5) * scale)) + 0.5 * (scale - 1.0);
            // Every fourth direction runs along an axis or a face.
            let mask = if i % 8 == 1 { Vec3::new(1.0, 0.0, (i / 8 % 2) as f32) } else { Vec3::ONE };
            (v * mask).extend(0.0)
        })
        .collect();
    let (mut hits, mut misses) = (0, 0);
    for (pair, found) in input.chunks(2).zip(probe(&gpu, &RAY, &input).chunks(2)) {
        let (origin, direction) = (pair[0].truncate().as_dvec3(), pair[1].truncate().as_dvec3());
        let expected = ray::unit_cube_span(origin, direction);
        let found = DVec3::new(found[0].x.into(), found[0].y.into(), 0.0);
        if expected.x + 1e-4 < expected.y {
            hits += 1;
            // Distances are in lengths of the direction, and lose digits where that is short.
            let scale = 1.0 / direction.abs().min_element().clamp(1e-3, 1.0);
            assert_close(found.x, expected.x, tolerance::PROBE * scale, pair);
            assert_close(found.y, expected.y, tolerance::PROBE * scale, pair);
        } else if expected.x > expected.y + 1e-4 {
            misses += 1;
            assert!(found.x > found.y, "{found} for {expected} at {pair:?}");
        }
    }
    assert!(hits > 500 && misses > 500, "{hits} hits, {misses} misses");
}

#[test]
fn slabs_equal_their_twin() {
    static SLAB: Shader = shader!("test/probes/slab");
    let Some(gpu) = gpu() else { return };
    let mut input: Vec<_> =
        (0..6400).map(|i| Vec4::new(spread(i, 0), spread(i, 1), 1.0, (spread(i, 2) * 40.0 - 30.0).exp2())).collect();
    input[0].w = 0.0;
    for (x, found) in input.iter().zip(probe(&gpu, &SLAB, &input)) {
        let expected = x.as_dvec4() * slab::mean_transmittance(x.w.into());
        for c in 0..4 {
            assert_close(found[c].into(), expected[c], tolerance::PROBE, x);
        }
    }
}

#[test]
fn agx_equals_its_twin() {
    static AGX: Shader = shader!("test/probes/agx");
    let Some(gpu) = gpu() else { return };
    let mut input: Vec<_> =
        (0..6400).map(|i| Vec3::from([0, 1, 2].map(|d| (spread(i, d) * 24.0 - 14.0).exp2())).extend(0.0)).collect();
    input[..3].copy_from_slice(&[Vec4::ZERO, Vec4::splat(-1.0), Vec4::splat(1e30)]);
    for (x, found) in input.iter().zip(probe(&gpu, &AGX, &input)) {
        let expected = tonemap::agx(x.truncate());
        for c in 0..3 {
            assert_close(found[c].into(), expected[c].into(), tolerance::PROBE_AGX, x);
        }
    }
}

#[test]
fn noise_equals_its_twin() {
    static NOISE: Shader = shader!("test/probes/noise");
    let Some(gpu) = gpu() else { return };
    let mut input: Vec<_> = (0..6400)
        .map(|i| {
            let scale = if i % 2 == 0 { 10.0 } else { 3000.0 };
            Vec3::from([0, 1, 2].map(|d| (spread(i, d) - 0.5) * scale)).extend((i % 7) as f32 * 1000.0)
        })
        .collect();
    // Lattice points, and places where no lattice is left.
    input[..3].copy_from_slice(&[
        Vec4::ZERO,
        Vec4::new(-3.0, 2.0, -1.0, 0.0),
        Vec4::new(1e30, -1e10, 2147483648.0, 1.0),
    ]);
    for (x, found) in input.iter().zip(probe(&gpu, &NOISE, &input)) {
        let seed = x.w as u32;
        let fractal = Fractal { octaves: 5, gain: 0.6, lacunarity: 2.0, seed };
        let expected = [gradient_noise(x.truncate(), UVec3::splat(seed)), fractal.value(x.truncate())];
        for c in 0..2 {
            assert_close(found[c].into(), expected[c].into(), tolerance::PROBE, x);
        }
    }
}

/// The same text gives the same density on both sides, bounds and undefined values included.
#[test]
fn expressions_equal_their_twins() {
    const PROBE: Shader = shader!("test/probes/expression");
    let texts = [
        "exp(-4.0*dot(p,p)) * (0.5 + 0.5*sin(2.0*p.x)) // a comment",
        "fbm(3 * p, 4) + 0.5",
        "noise(p.zxy * 5)",
        "select(length(p - 0.5), p.y % 0.3, p.x > 0 && p.y < 0.5)",
        "2.5 * p.x",
        "1.0 / (p.x - p.x)",
        "sqrt(p.x)",
    ];
    let scene: String = texts
        .iter()
        .enumerate()
        .map(|(i, text)| {
            let density = format!("{{ min = [-1, -1, -1], max = [1, 1, 1], wgsl = {text:?}, highest = 0.9 }}");
            format!("[media.m{i}]\noptics.coefficients = {{}}\ndensity.expression = {density}\n")
        })
        .collect();
    let world = super::world(&format!("[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\n{scene}"));
    let source = Expressions::new(&world.volumes).unwrap().splice(&PROBE.source).unwrap();
    let shader: &Shader = Box::leak(Box::new(Shader { name: PROBE.name, source: source.into() }));
    shader.reflect().unwrap();
    let Some(gpu) = gpu() else { return };
    let input: Vec<_> = (0..6400)
        .map(|i| Vec3::from([0, 1, 2].map(|d| spread(i, d) * 2.0 - 1.0)).extend((i % (texts.len() + 1)) as f32))
        .collect();
    for (x, found) in input.iter().zip(probe(&gpu, shader, &input)) {
        let Some(volume) = world.volumes.get(x.w as usize) else {
            assert_eq!(found.x, 0.0);
            continue;
        };
        let Field::Expression(expression) = &volume.field else { unreachable!() };
        let expected = expression.value(0.5 * (x.truncate() + 1.0));
        assert_close(found.x.into(), expected.into(), tolerance::PROBE_EXPRESSION, x);
    }
}

/// Without expressions there is nothing to splice, and without a marker nowhere.
#[test]
fn splicing() {
    let scene = "camera = { position = [0, 0, 3], target = [0, 0, 0] }\n[media.m]\noptics.coefficients = {}\n\
                 density.expression = { min = [-1, -1, -1], max = [1, 1, 1], wgsl = \"p.x\" }";
    let expressions = Expressions::new(&super::world(scene).volumes).unwrap();
    assert_eq!(expressions.splice("fn main() {}"), None);
    assert!(Expressions::new(&[]).is_none());
}

#[test]
#[should_panic(expected = "for 0.5 at")]
fn a_wrong_value_is_caught() {
    assert_close(0.5 + 2.0 * tolerance::PROBE, 0.5, tolerance::PROBE, "a value");
}
