use tyndall::techniques::TECHNIQUES;
use tyndall::wgpu;

use crate::failure::Failure;

/// List adapters with their limits and features, and the techniques with their parameters
///
/// Fails (exit code 1) where there is no adapter.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  tyndall info")]
pub struct Arguments {}

impl Arguments {
    /// Prints what there is.
    pub fn run(&self) -> Result<(), Failure> {
        println!("tyndall {}\n", env!("CARGO_PKG_VERSION"));
        let adapters = pollster::block_on(tyndall::adapters());
        for (i, adapter) in adapters.iter().enumerate() {
            let info = adapter.get_info();
            let limits = adapter.limits();
            let chosen = if i == 0 { ", used unless --adapter says otherwise" } else { "" };
            println!("Adapter {} ({:?}, {}{chosen})", info.name, info.device_type, info.backend);
            println!("  driver             {} {}", info.driver, info.driver_info);
            println!("  largest 2D texture {} pixels a side", limits.max_texture_dimension_2d);
            println!("  largest 3D texture {} voxels a side", limits.max_texture_dimension_3d);
            println!("  largest buffer     {} MiB", limits.max_buffer_size >> 20);
            let has = |feature| if adapter.features().contains(feature) { "yes" } else { "no" };
            println!("  32-bit voxels are interpolated  {}", has(wgpu::Features::FLOAT32_FILTERABLE));
            println!("  passes are timed                {}", has(wgpu::Features::TIMESTAMP_QUERY));
            println!();
        }
        for technique in TECHNIQUES {
            println!("Technique {}: {}", technique.name, technique.summary);
            for parameter in technique.parameters {
                let unit = if parameter.unit.is_empty() { "" } else { " " };
                let default = parameter.kind.default_value();
                println!("  techniques.{}.{} = {default}{unit}{}", technique.name, parameter.name, parameter.unit);
                println!("      {}: {}", parameter.help, parameter.kind);
            }
        }
        if adapters.is_empty() { Err(tyndall::RenderError::NoAdapter.into()) } else { Ok(()) }
    }
}
