//! Pictures on surfaces, packed into one texture.

use glam::UVec2;
use tyndall_scene::surface::Map;

use crate::{Gpu, RenderError};

/// Texels in a row: `TEXEL_ROW` in `surface.wesl`, what every device's textures have.
const ROW: u32 = 8192;

/// The bit of a map's first texel that says that it is sRGB: `MAP_SRGB` in `surface.wesl`.
const SRGB: u32 = 1 << 31;

/// Pictures, each once, one after the other.
#[derive(Default)]
pub(super) struct Maps {
    texels: Vec<[u8; 4]>,
    placed: Vec<(Map, UVec2)>,
    /// The size of the first picture that is larger than shaders can address.
    oversized: Option<[u32; 2]>,
}

impl Maps {
    /// Where a picture is, as shaders see it; one without texels is none.
    pub(super) fn place(&mut self, map: &Map) -> UVec2 {
        if let Some((_, place)) = self.placed.iter().find(|(known, _)| known == map) {
            return *place;
        }
        let texture = &map.0;
        if texture.texels.is_empty() {
            return UVec2::ZERO;
        }
        let size = [texture.width, texture.height];
        let end = self.texels.len() as u64 + texture.texels.len() as u64;
        if size[0] > 0xffff || size[1] > 0xffff || end > u64::from(SRGB) {
            self.oversized.get_or_insert(size);
            return UVec2::ZERO;
        }
        let first = self.texels.len() as u32 | if texture.srgb { SRGB } else { 0 };
        let place = UVec2::new(first, size[0] | size[1] << 16);
        self.texels.extend(&texture.texels);
        self.placed.push((map.clone(), place));
        place
    }

    /// Uploads them all.
    ///
    /// # Errors
    /// More texels than the device's textures hold, and a lack of memory.
    pub(super) async fn texture(mut self, gpu: &Gpu) -> Result<wgpu::Texture, RenderError> {
        let limit = |found: String, limit: String| RenderError::Limit {
            what: "surfaces: pictures".into(),
            found,
            limit,
            advice: "Use smaller pictures.".into(),
        };
        if let Some([width, height]) = self.oversized {
            let most = format!("65535 a side, and {SRGB} texels in all");
            return Err(limit(format!("one of {width} x {height} texels"), most));
        }
        let rows = gpu.device.limits().max_texture_dimension_2d;
        let count = self.texels.len().max(1);
        if count as u64 > u64::from(ROW) * u64::from(rows) {
            return Err(limit(format!("{count} texels"), format!("{} texels", u64::from(ROW) * u64::from(rows))));
        }
        let height = count.div_ceil(ROW as usize) as u32;
        let width = if height == 1 { count as u32 } else { ROW };
        self.texels.resize(width as usize * height as usize, [0; 4]);
        let format = wgpu::TextureFormat::Rgba8Unorm;
        gpu.table("texels", [width, height], format, bytemuck::cast_slice(&self.texels)).await
    }
}
