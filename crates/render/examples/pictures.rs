//! What a picture costs where the device is open and shaders are compiled: a scene is rendered once, and so many times more.
//! Prints JSON: CPU seconds of all threads and seconds of the clock of each further picture. `cargo xtask bench radiosity` calls it.
//!
//!     cargo run -p tyndall --example pictures -- SCENE OUT.exr COUNT PATH=VALUE...

mod clock;

use std::error::Error;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use tyndall::scene::assets::Directory;
use tyndall::scene::volume::Budget;
use tyndall::scene::{Document, World};
use tyndall::{AdapterChoice, Gpu};

use clock::cpu_seconds;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [scene, output, count, settings @ ..] = &words[..] else {
        return Err("accepted: SCENE OUT.exr COUNT PATH=VALUE...".into());
    };
    let document = Document::new(scene.clone(), fs::read_to_string(scene)?);
    let mut description = document.parse()?;
    for setting in settings {
        let (path, value) = setting.split_once('=').ok_or("accepted: PATH=VALUE")?;
        description.set(path, value)?;
    }
    let assets = Directory(Path::new(scene).parent().unwrap_or(Path::new("")).into());
    let world = World::load(description, &assets, Budget(1 << 30)).map_err(|error| error.locate(&document))?;
    let gpu = pollster::block_on(Gpu::open(&AdapterChoice::Cpu))?;
    let render = || pollster::block_on(tyndall::render(&gpu, &world, &mut |_| ControlFlow::Continue(())));
    render()?.image.write(output.as_ref(), 0.0)?;
    let count = count.parse::<u32>()?;
    let (begun, spent) = (Instant::now(), cpu_seconds());
    for _ in 0..count {
        render()?;
    }
    let each = |seconds: f64| seconds / f64::from(count);
    let (cpu, clock) = (each(cpu_seconds() - spent), each(begun.elapsed().as_secs_f64()));
    println!("{{\"cpu\": {cpu}, \"clock\": {clock}}}");
    Ok(())
}
