//! Trilinear samples per second of the marcher against a bare loop of fetches on the same device; prints JSON.
//! `cargo xtask bench volumes` calls it.
//!
//!     cargo run -p tyndall --example fetch -- ROUNDS

use std::error::Error;
use std::ops::ControlFlow;
use std::time::Instant;

use tyndall::Gpu;
use tyndall::scene::assets::Embedded;
use tyndall::scene::volume::Budget;
use tyndall::scene::{Document, World};
use wgpu::util::DeviceExt;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Voxels along a side.
const SIDE: u32 = 128;
/// Samples of a ray. All rays go from face to face, a hundredth of a voxel more than a voxel a step: ⌈128.003/1.01⌉.
const STEPS: u32 = 127;
/// Pixels along a side of the film.
const FILM: u32 = 512;
/// From the middle of the volume, in times of its edge, and the view's width there.
const DISTANCE: f32 = 50.0;
const WIDTH: f32 = 0.7;

/// The loop that bounds every marcher: the same rays, as many samples, and nothing but their sum.
const BARE: &str = "
@group(0) @binding(0) var volume: texture_3d<f32>;
@group(0) @binding(1) var linear: sampler;
@group(0) @binding(2) var film: texture_storage_2d<rgba32float, write>;
@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let across = 0.7 * ((vec2f(id.xy) + 0.5) / 512.0 - 0.5);
    let step = vec3f(across / 50.0, 1.0) * (1.01 / 128.0);
    var at = vec3f(across * (49.5 / 50.0) + 0.5, 0.0) + 0.5 * step;
    var sum = 0.0;
    for (var i = 0u; i < 127u; i++) {
        sum += textureSampleLevel(volume, linear, at, 0.0).x;
        at += step;
    }
    textureStore(film, id.xy, vec4f(sum));
}";

fn main() -> Result<()> {
    let rounds = std::env::args().nth(1).map_or(Ok(3), |word| word.parse::<usize>())?;
    let adapters = pollster::block_on(tyndall::adapters());
    let adapter = adapters.first().ok_or("there is no adapter")?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: adapter.features() & (wgpu::Features::FLOAT32_FILTERABLE | wgpu::Features::TIMESTAMP_QUERY),
        required_limits: adapter.limits(),
        ..Default::default()
    }))?;
    let gpu = Gpu::from_device(device.clone(), queue.clone());
    let voxels = noise();
    let optics = [
        ("coefficients", "coefficients = { sigma_a = 0.1 }"),
        (
            "transfer",
            "transfer = { unit_length = 10, stops = [{ value = 0, opacity = 0, color = 1 }, { value = 255, opacity = 0.5, color = 1 }] }",
        ),
    ];
    let worlds = optics.iter().map(|(_, optics)| world(&voxels, optics)).collect::<Result<Vec<_>>>()?;
    let bare = Bare::new(&device, &queue, &voxels);
    bare.run(&device, &queue)?;
    let samples = f64::from(FILM) * f64::from(FILM) * f64::from(STEPS);
    let mut rates = vec![Vec::new(); optics.len() + 1];
    for round in 0..=rounds {
        let mut seconds = vec![bare.run(&device, &queue)?];
        for world in &worlds {
            let begun = Instant::now();
            let rendering = pollster::block_on(tyndall::render(&gpu, world, &mut |_| ControlFlow::Continue(())))?;
            seconds.push(rendering.passes.get("march").copied().unwrap_or_else(|| begun.elapsed().as_secs_f64()));
        }
        // The first round compiles.
        if round > 0 {
            for (rates, seconds) in rates.iter_mut().zip(seconds) {
                rates.push(samples / seconds);
            }
        }
    }
    println!("{}", report(&gpu.name(), &optics.map(|(name, _)| name), &rates));
    Ok(())
}

/// Rates in samples per second, in the order of the rounds.
fn report(adapter: &str, names: &[&str], rates: &[Vec<f64>]) -> String {
    let names = std::iter::once(&"bare").chain(names);
    let lists: Vec<_> = names.zip(rates).map(|(name, rates)| format!("\"{name}\": {rates:?}")).collect();
    format!("{{ \"adapter\": \"{adapter}\", {} }}", lists.join(", "))
}

/// Random bytes: a linear congruential generator's highest.
fn noise() -> Vec<u8> {
    let mut state = 1u32;
    let next = |_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..SIDE.pow(3)).map(next).collect()
}

fn world(voxels: &[u8], optics: &str) -> Result<World> {
    let fov = 2.0 * (0.5 * WIDTH / DISTANCE).atan().to_degrees();
    let spacing = 1.0 / SIDE as f32;
    let text = format!(
        "camera = {{ position = [0, 0, {DISTANCE}], target = [0, 0, 0], fov = {fov} }}\n\
         film.size = [{FILM}, {FILM}]\n\
         [techniques.march]\nmodel = \"absorption\"\nstep = 1.01\ntermination = 0\nempty_space_skipping = \"off\"\n\
         [media.noise]\n\
         density.grid = {{ file = \"noise.raw\", raw = {{ dims = [{SIDE}, {SIDE}, {SIDE}], type = \"u8\", \
         spacing = [{spacing}, {spacing}, {spacing}] }} }}\noptics.{optics}\n"
    );
    let document = Document::new("fetch.toml", text);
    let assets = Embedded(vec![("noise.raw", voxels)]);
    World::load(document.parse()?, &assets, Budget(1 << 28)).map_err(|error| error.locate(&document).into())
}

/// The bare loop, ready to run.
struct Bare {
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
}

impl Bare {
    fn new(device: &wgpu::Device, queue: &wgpu::Queue, voxels: &[u8]) -> Self {
        let texture = |side: u32, depth, dimension, format, usage| wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: depth },
            mip_level_count: 1,
            sample_count: 1,
            dimension,
            format,
            usage,
            view_formats: &[],
        };
        use wgpu::{TextureDimension as Dimension, TextureFormat as Format, TextureUsages as Usages};
        // Half floats, as the marcher holds bytes.
        let halves: Vec<u8> = voxels.iter().flat_map(|&v| half::f16::from_f32(v.into()).to_le_bytes()).collect();
        let volume = device.create_texture_with_data(
            queue,
            &texture(SIDE, SIDE, Dimension::D3, Format::R16Float, Usages::TEXTURE_BINDING),
            wgpu::util::TextureDataOrder::LayerMajor,
            &halves,
        );
        let film =
            device.create_texture(&texture(FILM, 1, Dimension::D2, Format::Rgba32Float, Usages::STORAGE_BINDING));
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(BARE.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let [volume, film] = [&volume, &film].map(|texture| texture.create_view(&Default::default()));
        let resources = [
            wgpu::BindingResource::TextureView(&volume),
            wgpu::BindingResource::Sampler(&sampler),
            wgpu::BindingResource::TextureView(&film),
        ];
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let layout = pipeline.get_bind_group_layout(0);
        let group =
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries });
        Self { pipeline, group }
    }

    /// Runs once; seconds until it is done.
    fn run(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<f64> {
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.group, &[]);
            pass.dispatch_workgroups(FILM / 8, FILM / 8, 1);
        }
        let begun = Instant::now();
        queue.submit([encoder.finish()]);
        device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(begun.elapsed().as_secs_f64())
    }
}
