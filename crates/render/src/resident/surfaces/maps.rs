//! Pictures on surfaces, packed into one texture.

use std::sync::Arc;

use glam::{Vec2, Vec4};
use tyndall_scene::surface::{Map, Texture, Wrap};

use crate::{Gpu, RenderError};

/// Texels in a row: `TEXEL_ROW` in `surface.wesl`, what every device's textures have.
const ROW: u32 = 8192;

/// The bit of a map's first texel that says that it is sRGB: `MAP_SRGB` in `surface.wesl`.
const SRGB: u32 = 1 << 31;

/// How a map lies on its surface, one bit each, in `surface.wesl`: `MAP_SECOND`, and of a mirror and of a clamp along u; those
/// along v follow.
const SECOND: u32 = 1;
const MIRROR: [u32; 2] = [2, 8];
const CLAMP: [u32; 2] = [4, 16];

/// A picture on a surface as shaders see it; all 0 where there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, encase::ShaderType)]
pub struct Placed {
    /// Its first texel, and whether it is sRGB.
    pub first: u32,
    /// Its width and height, 16 bits each.
    pub size: u32,
    /// How it goes on beyond its edges, and whether it takes the second set of texture coordinates.
    pub how: u32,
    /// Maps texture coordinates to those of the picture: two columns, and what is added.
    pub columns: Vec4,
    /// See `columns`.
    pub offset: Vec2,
}

impl Placed {
    /// Whether it takes the second set of texture coordinates.
    pub(super) fn takes_second(&self) -> bool {
        self.how & SECOND != 0
    }
}

/// Pictures, each once, one after the other.
#[derive(Default)]
pub(super) struct Maps {
    texels: Vec<[u8; 4]>,
    placed: Vec<(Arc<Texture>, [u32; 2])>,
    /// The size of the first picture that is larger than shaders can address.
    oversized: Option<[u32; 2]>,
}

impl Maps {
    /// A map as shaders see it; one without texels is none.
    pub(super) fn place(&mut self, map: &Map) -> Placed {
        let [first, size] = self.texels(&map.texture);
        if size == 0 {
            return Placed::default();
        }
        let bits = |axis: usize| match map.wrap[axis] {
            Wrap::Repeat => 0,
            Wrap::Mirror => MIRROR[axis],
            Wrap::Clamp => CLAMP[axis],
        };
        let how = bits(0) | bits(1) | if map.second { SECOND } else { 0 };
        let columns = Vec4::from_array(map.transform.matrix2.to_cols_array());
        Placed { first, size, how, columns, offset: map.transform.translation }
    }

    /// Where the texels of a picture are, and its size.
    fn texels(&mut self, texture: &Arc<Texture>) -> [u32; 2] {
        if let Some((_, place)) = self.placed.iter().find(|(known, _)| Arc::ptr_eq(known, texture)) {
            return *place;
        }
        if texture.texels.is_empty() {
            return [0; 2];
        }
        let size = [texture.width, texture.height];
        let end = self.texels.len() as u64 + texture.texels.len() as u64;
        if size[0] > 0xffff || size[1] > 0xffff || end > u64::from(SRGB) {
            self.oversized.get_or_insert(size);
            return [0; 2];
        }
        let first = self.texels.len() as u32 | if texture.srgb { SRGB } else { 0 };
        let place = [first, size[0] | size[1] << 16];
        self.texels.extend(&texture.texels);
        self.placed.push((texture.clone(), place));
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
