//! Sorting on the device: keys, each with the number of what it belongs to, the highest first.
//!
//! A bitonic sort [Batcher68]: of 2ⁿ elements in n(n + 1)/2 dispatches, which do not depend on the keys. Equal keys are in the
//! order of their numbers, the highest first, so that what is sorted is always sorted alike.

#[cfg(test)]
mod test;

use crate::graph::{Graph, Shader, shader};
use crate::{Gpu, RenderError};

static SORT: Shader = shader!("sorting/sort");

/// Threads of a workgroup in `sort.wesl`, and in shaders that write keys.
const WORKGROUP: u32 = 256;

/// Keys and numbers, which a pass of its owner's writes and [`record`](Self::record) sorts.
#[derive(Clone, Debug)]
pub struct Order {
    /// Pairs of `u32`: a key, as `sorting/order.wesl` makes them, and a number; key 0 where there is nothing. Sorted, those with
    /// a key come first.
    pub buffer: wgpu::Buffer,
    /// How many pairs it has: a power of two.
    padded: u32,
}

impl Order {
    /// Room for so many; at most [`most`](Self::most).
    pub fn new(gpu: &Gpu, count: u32) -> Self {
        let padded = count.max(2).next_power_of_two();
        Self { buffer: gpu.scratch("order", u64::from(padded) * 8), padded }
    }

    /// How many can be sorted.
    pub fn most(gpu: &Gpu) -> u32 {
        let limits = gpu.device.limits();
        // One dispatch reaches so many keys; their number is rounded up to a power of two.
        let threads = u64::from(limits.max_compute_workgroups_per_dimension) * u64::from(WORKGROUP);
        let pairs = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / 8;
        1 << threads.min(pairs).min(1 << 31).ilog2()
    }

    /// The dispatch that reaches all keys, for the pass that writes them: workgroups of 256 along x.
    pub fn workgroups(&self) -> [u32; 3] {
        [self.padded.div_ceil(WORKGROUP), 1, 1]
    }

    /// Records the passes that sort.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub async fn record(&self, graph: &mut Graph<'_>) -> Result<(), RenderError> {
        let tile = graph.tile();
        let stages = self.padded.ilog2();
        graph
            .compute("sort", &SORT)
            .read("tile", &tile)
            .write("order", &self.buffer)
            .dispatch([(self.padded / 2).div_ceil(WORKGROUP), 1, 1], stages * (stages + 1) / 2)
            .await
    }
}
