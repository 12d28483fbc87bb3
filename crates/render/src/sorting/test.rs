//! The sort against that of the standard library.

use wgpu::BufferUsages;

use super::Order;
use crate::Gpu;
use crate::graph::{Graph, Tile};
use crate::test::gpu;

/// Keys in no order, many of them equal.
fn pairs(count: u32) -> Vec<[u32; 2]> {
    (0..count).map(|i| [i.wrapping_mul(2_654_435_761) >> (8 + i % 20) | 1, i]).collect()
}

/// What the device makes of pairs.
fn sorted(gpu: &Gpu, pairs: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let mut order = Order::new(gpu, pairs.len() as u32);
    let (size, usage) = (order.buffer.size(), BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC);
    let buffer = |label, usage| {
        gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
    };
    order.buffer = buffer("pairs", usage);
    gpu.queue.write_buffer(&order.buffer, 0, bytemuck::cast_slice(pairs));
    let mut graph = Graph::new(gpu);
    pollster::block_on(order.record(&mut graph)).unwrap();
    let mut profiler = wgpu_profiler::GpuProfiler::new(&gpu.device, Default::default()).unwrap();
    graph.submit(Tile { size: glam::UVec2::ONE, ..Default::default() }, &mut profiler);
    let readable = buffer("readable", BufferUsages::MAP_READ | BufferUsages::COPY_DST);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(&order.buffer, 0, &readable, 0, size);
    gpu.queue.submit([encoder.finish()]);
    let bytes = pollster::block_on(crate::renderer::map(gpu, &readable)).unwrap();
    bytemuck::cast_slice(&bytes).to_vec()
}

/// Of as many as there are, and what is beyond them, which has no key, comes last.
#[test]
fn the_highest_come_first() {
    let Some(gpu) = gpu() else { return };
    for count in [3, 64, 257, 5000] {
        let mut expected = pairs(count);
        let found = sorted(&gpu, &expected);
        assert_ne!(found[..count as usize], expected[..], "they were in no order");
        expected.sort_unstable_by(|a, b| b.cmp(a));
        expected.resize(found.len(), [0, 0]);
        assert_eq!(found, expected, "{count}");
    }
}

/// As many as one dispatch reaches, and no more than fit a buffer.
#[test]
fn room_is_a_power_of_two() {
    let Some(gpu) = gpu() else { return };
    assert!(Order::most(&gpu).is_power_of_two() && Order::most(&gpu) >= 1 << 22);
    assert_eq!(Order::new(&gpu, 257).workgroups(), [2, 1, 1]);
    assert_eq!(Order::new(&gpu, 0).buffer.size(), 16);
}
