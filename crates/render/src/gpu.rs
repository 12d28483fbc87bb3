//! The device: chosen, opened, and watched.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

use crate::RenderError;

/// What to install where there is no adapter.
pub const INSTALL_HELP: &str = "\
A driver for the graphics card is best; a CPU driver works too:
  Debian, Ubuntu   sudo apt-get install mesa-vulkan-drivers
  Fedora           sudo dnf install mesa-vulkan-drivers
  Arch             sudo pacman -S vulkan-swrast
  Alpine           sudo apk add mesa-vulkan-swrast
  Windows          a CPU driver (WARP) is part of Windows 10 and later
  macOS            Metal is part of macOS 10.14 and later";

/// Which adapter to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// The best there is: a discrete GPU before an integrated one before a virtual one before a CPU driver.
    #[default]
    Best,
    /// A CPU driver.
    Cpu,
    /// The first whose name contains this text, ignoring case.
    Named(String),
}

/// A device with its queue and the pipelines made for it so far.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    /// What the device runs on.
    pub adapter: wgpu::AdapterInfo,
    pub(crate) pipelines: Arc<Mutex<HashMap<String, wgpu::ComputePipeline>>>,
    /// The pipelines of passes that draw.
    pub(crate) drawings: Arc<Mutex<HashMap<String, wgpu::RenderPipeline>>>,
    iterations: u32,
    trouble: Arc<OnceLock<Trouble>>,
}

/// What went wrong on the device outside of any check.
#[derive(Debug)]
enum Trouble {
    Lost(String),
    Error(String),
}

/// Features that make pictures better where an adapter has them; nothing needs them.
const WANTED: wgpu::Features =
    wgpu::Features::FLOAT32_FILTERABLE.union(wgpu::Features::FLOAT32_BLENDABLE).union(wgpu::Features::TIMESTAMP_QUERY);

/// All adapters, the best first.
pub async fn adapters() -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    // An allocation that would take nearly all memory fails at once instead of taking the system down.
    descriptor.memory_budget_thresholds.for_resource_creation = Some(95);
    let instance = wgpu::Instance::new(descriptor);
    let mut adapters = instance.enumerate_adapters(wgpu::Backends::PRIMARY).await;
    adapters.sort_by_key(|adapter| match adapter.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    adapters
}

impl Gpu {
    /// Opens a device of its own, with the adapter's limits.
    ///
    /// # Errors
    /// No adapter, none of that name, or one that gives no device.
    pub async fn open(choice: &AdapterChoice) -> Result<Self, RenderError> {
        let adapters = adapters().await;
        if adapters.is_empty() {
            return Err(RenderError::NoAdapter);
        }
        let fits = |adapter: &&wgpu::Adapter| {
            let info = adapter.get_info();
            match choice {
                AdapterChoice::Best => true,
                AdapterChoice::Cpu => info.device_type == wgpu::DeviceType::Cpu,
                AdapterChoice::Named(name) => info.name.to_lowercase().contains(&name.to_lowercase()),
            }
        };
        let Some(adapter) = adapters.iter().find(fits) else {
            let wanted = match choice {
                AdapterChoice::Named(name) => name.clone(),
                _ => "cpu".into(),
            };
            let available = adapters.iter().map(|adapter| adapter.get_info().name).collect();
            return Err(RenderError::NoSuchAdapter { wanted, available });
        };
        let info = adapter.get_info();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("tyndall"),
            required_features: adapter.features() & WANTED,
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = adapter
            .request_device(&descriptor)
            .await
            .map_err(|error| RenderError::NoDevice { adapter: info.name.clone(), reason: error.to_string() })?;
        let gpu = Self::from_device(device, queue);
        gpu.watch();
        Ok(gpu)
    }

    /// Uses a caller's own device. Its error and loss callbacks stay the caller's.
    pub fn from_device(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let adapter = device.adapter_info();
        let iterations = if adapter.device_type == wgpu::DeviceType::Cpu { 60_000 } else { 1_000_000 };
        Self {
            device,
            queue,
            adapter,
            pipelines: Arc::default(),
            drawings: Arc::default(),
            iterations,
            trouble: Arc::default(),
        }
    }

    /// The adapter and its driver, in one line.
    pub fn name(&self) -> String {
        let info = &self.adapter;
        format!("{} ({}, {})", info.name, info.backend, format!("{} {}", info.driver, info.driver_info).trim())
    }

    /// Whether a CPU driver stands for the device.
    pub fn is_cpu(&self) -> bool {
        self.adapter.device_type == wgpu::DeviceType::Cpu
    }

    fn watch(&self) {
        let trouble = self.trouble.clone();
        self.device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                // The first trouble is the one to report.
                let _ = trouble.set(Trouble::Lost(format!("{reason:?}: {message}")));
            }
        });
        let trouble = self.trouble.clone();
        self.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            tracing::error!("{error}");
            let _ = trouble.set(Trouble::Error(error.to_string()));
        }));
    }

    /// An error where the device was lost, or refused something outside of any check, since it was opened.
    pub(crate) fn alive(&self) -> Result<(), RenderError> {
        match self.trouble.get() {
            Some(Trouble::Lost(reason)) => Err(RenderError::DeviceLost { reason: reason.clone() }),
            Some(Trouble::Error(message)) => Err(RenderError::Device { message: message.clone() }),
            None => Ok(()),
        }
    }

    /// Lets the device work until it has finished what was submitted. In a browser the event loop does this.
    pub(crate) fn wait(&self) -> Result<(), RenderError> {
        if cfg!(not(target_arch = "wasm32")) {
            self.device
                .poll(wgpu::PollType::wait_indefinitely())
                .map_err(|error| RenderError::DeviceLost { reason: error.to_string() })?;
        }
        self.alive()
    }

    /// How many pixels a side the film's tiles have: enough to fill a GPU, or few enough for a CPU driver to show
    /// progress and be cancelled.
    pub(crate) fn tile_side(&self) -> u32 {
        if self.adapter.device_type == wgpu::DeviceType::Cpu { 128 } else { 1024 }
    }

    /// How many loop iterations, of all its loops together, an invocation may make. Mesa's llvmpipe silently ends all
    /// loops of an invocation after 65535; on a GPU a million takes far less than the seconds after which a driver
    /// gives up.
    pub(crate) fn iterations(&self) -> u32 {
        self.iterations
    }

    #[cfg(test)]
    pub(crate) fn limit_iterations(&mut self, iterations: u32) {
        self.iterations = iterations;
    }

    /// Makes a texture; a lack of memory is an error that says what did not fit.
    pub(crate) async fn texture(&self, descriptor: &wgpu::TextureDescriptor<'_>) -> Result<wgpu::Texture, RenderError> {
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let texture = self.device.create_texture(descriptor);
        match scope.pop().await {
            None => Ok(texture),
            Some(error) => Err(RenderError::OutOfMemory {
                what: descriptor.label.unwrap_or("a texture").into(),
                bytes: texel_count(descriptor.size) * u64::from(descriptor.format.block_copy_size(None).unwrap_or(4)),
                reason: error.to_string(),
            }),
        }
    }

    /// Makes a 2D texture of one level, for shaders to read, and for what `usage` says.
    pub(crate) async fn texture_2d(
        &self,
        label: &str,
        size: [u32; 2],
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Result<wgpu::Texture, RenderError> {
        self.texture_layers(label, size, 1, format, usage).await
    }

    /// The same of so many layers.
    pub(crate) async fn texture_layers(
        &self,
        label: &str,
        [width, height]: [u32; 2],
        layers: u32,
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Result<wgpu::Texture, RenderError> {
        self.texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        })
        .await
    }

    /// Makes a 2D texture of these texels, for shaders to load from.
    pub(crate) async fn table(
        &self,
        label: &str,
        [width, height]: [u32; 2],
        format: wgpu::TextureFormat,
        texels: &[u8],
    ) -> Result<wgpu::Texture, RenderError> {
        let texture = self.texture_2d(label, [width, height], format, wgpu::TextureUsages::COPY_DST).await?;
        let row = width * format.block_copy_size(None).unwrap_or(4);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        self.queue.write_texture(texture.as_image_copy(), texels, layout, texture.size());
        Ok(texture)
    }

    /// Makes a buffer that holds an encase value, for shaders to read.
    ///
    /// All parameters are read-only storage buffers and none is a uniform: Mesa 22.3's CPU driver compiles a shader anew
    /// for every value that a uniform in a condition takes, and corrupts its stack where there are many.
    pub(crate) fn buffer<T>(&self, label: &str, value: &T) -> wgpu::Buffer
    where
        T: encase::ShaderType + encase::internal::WriteInto,
    {
        let bytes = bytes_of(value);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes.len() as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, &bytes);
        buffer
    }

    /// Writes an encase value over what a buffer holds.
    pub(crate) fn write<T>(&self, buffer: &wgpu::Buffer, value: &T)
    where
        T: encase::ShaderType + encase::internal::WriteInto,
    {
        self.queue.write_buffer(buffer, 0, &bytes_of(value));
    }

    /// Makes a buffer of so many bytes that passes alone write and read.
    pub(crate) fn scratch(&self, label: &str, size: u64) -> wgpu::Buffer {
        self.empty(label, size, wgpu::BufferUsages::STORAGE)
    }

    /// A buffer of how many workgroups a pass takes, along x, y and z; none at first.
    pub(crate) fn workgroups(&self, label: &str) -> wgpu::Buffer {
        use wgpu::BufferUsages as Usages;
        self.empty(label, 12, Usages::STORAGE | Usages::INDIRECT | Usages::COPY_DST)
    }

    fn empty(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let label = Some(label);
        self.device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false })
    }
}

fn texel_count(size: wgpu::Extent3d) -> u64 {
    u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers)
}

/// An encase value as shaders read it.
pub(crate) fn bytes_of<T>(value: &T) -> Vec<u8>
where
    T: encase::ShaderType + encase::internal::WriteInto,
{
    let mut bytes = encase::StorageBuffer::new(Vec::new());
    bytes.write(value).expect("a Vec grows as it must");
    bytes.into_inner()
}
