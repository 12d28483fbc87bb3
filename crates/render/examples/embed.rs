//! A frame on an application's own device, shown in an application's own texture (here one that stands for a window's).
//!
//!     cargo run -p tyndall --example embed -- scenes/plume.toml

use std::path::Path;

use tyndall::scene::assets::Directory;
use tyndall::scene::description::{Optics, Phase};
use tyndall::scene::glam::{Mat4, Vec3};
use tyndall::scene::volume::Budget;
use tyndall::scene::{Document, World};
use tyndall::{Frame, Gpu, wgpu};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The application's: instance, device, queue, and a texture to show things in.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let window = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("window"),
        size: wgpu::Extent3d { width: 320, height: 240, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Bgra8UnormSrgb,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });

    // Tyndall's: a world, and a frame of it on that device.
    let path = std::env::args().nth(1).unwrap_or("scenes/plume.toml".into());
    let mut scene = Document::new(path.as_str(), std::fs::read_to_string(&path)?).parse()?;
    scene.film.size = [320, 240];
    let folder = Path::new(&path).parent().unwrap_or(Path::new("."));
    let mut world = World::load(scene, &Directory(folder.into()), Budget(1 << 30))?;
    let gpu = Gpu::from_device(device.clone(), queue);
    let mut frame = pollster::block_on(Frame::new(&gpu, &world))?;

    // Every frame: move the camera, render, show. Nothing is allocated and nothing read back.
    let mut camera = world.scene.camera.clone();
    for step in 0..5 {
        camera.position.x -= 0.2;
        frame.set_camera(&camera);
        frame.render();
        pollster::block_on(frame.show(&window))?;
        device.poll(wgpu::PollType::wait_indefinitely())?;
        println!("frame {step}: {:?}", frame.timings());
    }

    // A thing moves, with its light and its shadow.
    if let Some(surface) = world.surfaces.first() {
        let place = Mat4::from_translation(Vec3::new(0.1, 0.0, 0.0)) * surface.world_from_object;
        frame.set_transform(&surface.name, place)?;
        frame.render();
    }

    // A knob is turned: what a medium does to light is another, and no voxel is uploaded.
    if let Some(medium) = world.volumes.first().map(|volume| volume.name.clone()) {
        let (sigma_s, sigma_a, emission) = (Vec3::ZERO, Vec3::new(4.0, 8.0, 16.0), Vec3::ZERO);
        world.set_optics(&medium, Optics::Coefficients { sigma_s, sigma_a, emission, phase: Phase::Isotropic })?;
        pollster::block_on(frame.set_media(&world))?;
        frame.render();
    }
    Ok(())
}
