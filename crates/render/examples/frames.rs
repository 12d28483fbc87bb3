//! What frames of a scene take after the first, which compiles; prints JSON. `cargo xtask bench volumes` calls it.
//!
//!     cargo run -p tyndall --example frames -- SCENE.toml FRAMES [PATH=VALUE...]

mod clock;

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use tyndall::scene::assets::Directory;
use tyndall::scene::volume::Budget;
use tyndall::scene::{Document, World};
use tyndall::{Frame, Gpu};

use clock::cpu_seconds;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("no scene")?;
    let frames: u32 = arguments.next().ok_or("no number of frames")?.parse()?;
    let mut scene = Document::from_bytes(file.clone(), std::fs::read(&file)?)?.parse()?;
    for setting in arguments {
        let (path, value) = setting.split_once('=').ok_or("a setting is PATH=VALUE")?;
        scene.set(path, value).map_err(|error| format!("{setting}: {error}"))?;
    }
    let folder = Directory(Path::new(&file).parent().unwrap_or(Path::new("")).into());
    let world = World::load(scene, &folder, Budget(4 << 30)).map_err(|error| error.to_string())?;
    let adapters = pollster::block_on(tyndall::adapters());
    let adapter = adapters.first().ok_or("there is no adapter")?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: adapter.features() & wgpu::Features::FLOAT32_FILTERABLE,
        required_limits: adapter.limits(),
        ..Default::default()
    }))?;
    let gpu = Gpu::from_device(device.clone(), queue);
    let mut frame = pollster::block_on(Frame::new(&gpu, &world))?;
    let mut render = || {
        frame.render();
        device.poll(wgpu::PollType::wait_indefinitely()).map(drop)
    };
    render()?;
    let (begun, before) = (Instant::now(), cpu_seconds());
    for _ in 0..frames {
        render()?;
    }
    let each = |seconds: f64| seconds / f64::from(frames);
    let (wall, cpu) = (each(begun.elapsed().as_secs_f64()), each(cpu_seconds() - before));
    println!("{{ \"adapter\": \"{}\", \"wall\": {wall}, \"cpu\": {cpu} }}", gpu.name());
    Ok(())
}
