//! Filters of the maps, which are filters of the extinction across light rays [Jansen10]: soft shadows.

use tyndall_scene::FieldError;
use tyndall_scene::parameter::Settings;

use crate::RenderError;
use crate::graph::{Graph, Shader, shader};
use crate::resident::{Resident, Transmittance};

static FILTER_HALF: Shader = shader!("techniques/transmittance/filter_half");
static FILTER_SINGLE: Shader = shader!("techniques/transmittance/filter_single");
static MIP_HALF: Shader = shader!("techniques/transmittance/mip_half");
static MIP_SINGLE: Shader = shader!("techniques/transmittance/mip_single");

/// Which mip level is to be looked up so that a texel is as wide as the filter that is asked for; 0: none.
///
/// # Errors
/// A filter of what is not linear; tiles that cannot be halved so often.
pub(super) fn level(settings: &Settings, linear: bool, resolution: u32) -> Result<f32, FieldError> {
    let radius = settings.number("prefilter");
    if radius > 0.0 && !linear {
        return Err(FieldError {
            path: "techniques.transmittance.prefilter".into(),
            found: "a filter of what is not linear: ranges of depths for each texel, moments, or lists".into(),
            accepted: "depths = \"light\" and another basis, or prefilter = 0".into(),
        });
    }
    if settings.choice("prefilter_kind") != "mips" {
        return Ok(0.0);
    }
    let level = (2.0 * radius + 1.0).log2();
    let multiple = 1 << level.ceil() as u32;
    if !resolution.is_multiple_of(multiple) {
        return Err(FieldError {
            path: "techniques.transmittance.resolution".into(),
            found: format!("{resolution} texels a side, with mips for a filter of {radius} texels"),
            accepted: format!("a multiple of {multiple}, or another prefilter_kind"),
        });
    }
    Ok(level)
}

/// Records the passes that filter the maps.
pub(super) async fn record(graph: &mut Graph<'_>, resident: &Resident, settings: &Settings) -> Result<(), RenderError> {
    let radius = settings.number("prefilter") as u32;
    if radius == 0 {
        return Ok(());
    }
    let half = resident.transmittance.texels.format() == wgpu::TextureFormat::Rgba16Float;
    if settings.choice("prefilter_kind") == "mips" {
        return mips(graph, &resident.transmittance, if half { &MIP_HALF } else { &MIP_SINGLE }).await;
    }
    let texels = &resident.transmittance.texels;
    let size = [texels.width(), texels.height()];
    let between =
        graph.gpu().texture_2d("filtered along x", size, texels.format(), wgpu::TextureUsages::STORAGE_BINDING).await?;
    let shader = if half { &FILTER_HALF } else { &FILTER_SINGLE };
    // Along x into a texture of their own, along y back.
    for (axis, (from, to)) in [(texels, &between), (&between, texels)].into_iter().enumerate() {
        graph
            .compute("transmittance.filter", shader)
            .constant("AXIS", axis as u32)
            .constant("RADIUS", radius)
            .constant("GAUSSIAN", settings.choice("prefilter_kind") == "gaussian")
            .constant("RESOLUTION", resident.transmittance.resolution)
            .read("unfiltered", from)
            .write("written", to)
            .dispatch([size[0].div_ceil(8), size[1].div_ceil(8), 1], 1)
            .await?;
    }
    Ok(())
}

/// Each level from the one before.
async fn mips(graph: &mut Graph<'_>, maps: &Transmittance, shader: &'static Shader) -> Result<(), RenderError> {
    for level in 1..maps.texels.mip_level_count() {
        let groups = [maps.texels.width(), maps.texels.height()].map(|side| (side >> level).div_ceil(8));
        graph
            .compute("transmittance.mip", shader)
            .read("finer", (&maps.texels, level - 1))
            .write("written", (&maps.texels, level))
            .dispatch([groups[0], groups[1], 1], 1)
            .await?;
    }
    Ok(())
}
