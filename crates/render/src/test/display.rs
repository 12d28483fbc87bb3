//! A frame on a caller's own device shows what the image's tone map shows.

use tyndall_scene::image::tonemap;

use super::{PLUME, gpu, picture, shipped, tolerance, world_of};
use crate::{Frame, Gpu};

#[test]
fn a_callers_texture_shows_the_tone_mapped_film() {
    let Some(own) = gpu() else { return };
    let gpu = Gpu::from_device(own.device.clone(), own.queue.clone());
    let world = world_of(&PLUME.replace("[640, 480]", "[64, 40]"), &shipped());
    let expected = tonemap::display(&picture(&gpu, &world), world.scene.film.exposure);

    let target = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("window"),
        size: wgpu::Extent3d { width: 64, height: 40, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let mut frame = pollster::block_on(Frame::new(&gpu, &world)).unwrap();
    frame.render();
    pollster::block_on(frame.show(&target)).unwrap();

    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 256 * 40,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        target.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(256), rows_per_image: None },
        },
        target.size(),
    );
    gpu.queue.submit([encoder.finish()]);
    let bytes = pollster::block_on(crate::renderer::map(&gpu, &buffer)).unwrap();
    assert!(expected.pixels.iter().any(|p| p[0] > 0.4), "there is a plume to see");
    for (found, expected) in bytes.chunks(4).zip(&expected.pixels) {
        for c in 0..3 {
            let difference = (f64::from(found[c]) / 255.0 - f64::from(expected[c])).abs();
            assert!(difference <= 0.5 / 255.0 + tolerance::PROBE_AGX, "{found:?} for {expected:?}");
        }
    }
}

#[test]
fn a_moved_camera_shows_in_the_next_rendering() {
    let Some(gpu) = gpu() else { return };
    for technique in ["march", "project", "slicing", "splatting"] {
        let text = format!("{}\n[techniques.{technique}]", PLUME.replace("[640, 480]", "[32, 24]"));
        let mut world = world_of(&text, &shipped());
        let mut frame = pollster::block_on(Frame::new(&gpu, &world)).unwrap();
        world.scene.camera.position.x = -1.5;
        frame.set_camera(&world.scene.camera);
        frame.render();
        let moved = pollster::block_on(crate::renderer::read_film(&gpu, frame.film())).unwrap();
        assert_eq!(moved, picture(&gpu, &world).pixels);
    }
}
