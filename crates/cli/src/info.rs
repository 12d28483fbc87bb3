use std::fmt::{self, Write as _};

use tyndall::techniques::TECHNIQUES;
use tyndall::wgpu;

use crate::failure::Failure;
use crate::say;

/// List adapters with their limits and features, and the techniques with their parameters
///
/// Fails (exit code 1) where there is no adapter.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  tyndall info")]
pub struct Arguments {}

impl Arguments {
    /// Prints what there is.
    pub fn run(&self) -> Result<(), Failure> {
        let adapters = pollster::block_on(tyndall::adapters());
        let text = describe(&adapters).map_err(|error| Failure::Failed(error.into()))?;
        say::result(&text)?;
        if adapters.is_empty() { Err(tyndall::RenderError::NoAdapter.into()) } else { Ok(()) }
    }
}

fn describe(adapters: &[wgpu::Adapter]) -> Result<String, fmt::Error> {
    let mut out = String::new();
    writeln!(out, "tyndall {}\n", env!("CARGO_PKG_VERSION"))?;
    for (i, adapter) in adapters.iter().enumerate() {
        let info = adapter.get_info();
        let limits = adapter.limits();
        let chosen = if i == 0 { ", used unless --adapter says otherwise" } else { "" };
        writeln!(out, "Adapter {} ({:?}, {}{chosen})", info.name, info.device_type, info.backend)?;
        writeln!(out, "  driver             {} {}", info.driver, info.driver_info)?;
        writeln!(out, "  largest 2D texture {} pixels a side", limits.max_texture_dimension_2d)?;
        writeln!(out, "  largest 3D texture {} voxels a side", limits.max_texture_dimension_3d)?;
        writeln!(out, "  largest buffer     {} MiB", limits.max_buffer_size >> 20)?;
        let has = |feature| if adapter.features().contains(feature) { "yes" } else { "no" };
        writeln!(out, "  32-bit voxels are interpolated  {}", has(wgpu::Features::FLOAT32_FILTERABLE))?;
        writeln!(out, "  passes are timed                {}", has(wgpu::Features::TIMESTAMP_QUERY))?;
        let features: Vec<_> = adapter.features().iter_names().map(|(name, _)| name.to_lowercase()).collect();
        writeln!(out, "  features           {}\n", features.join(" "))?;
    }
    for technique in TECHNIQUES {
        writeln!(out, "Technique {}: {}", technique.name, technique.summary)?;
        for parameter in technique.parameters {
            let default = parameter.kind.default_value();
            let setting = format!("techniques.{}.{} = {default} {}", technique.name, parameter.name, parameter.unit);
            writeln!(out, "  {}", setting.trim_end())?;
            writeln!(out, "      {}: {}", parameter.help, parameter.kind)?;
        }
    }
    Ok(out)
}
