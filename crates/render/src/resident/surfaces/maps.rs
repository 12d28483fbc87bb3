//! Pictures on surfaces, packed into one texture with their mip levels [Williams83], which are made on the device (`mips.wesl`):
//! means of light over the texel's part of the picture. Nothing beyond its edges is in them: they go on there as the picture does.

use std::sync::Arc;

use glam::{Vec2, Vec4};
use tyndall_scene::surface::{Map, Texture, Wrap};

use crate::graph::{Graph, Shader, shader};
use crate::{Gpu, RenderError};

static MIPS: Shader = shader!("resident/surfaces/mips");

/// Texels in a row: `TEXEL_ROW` in `surface.wesl`, what every device's textures have.
const ROW: u32 = 8192;

/// The bit of a map's first texel that says that it is sRGB: `MAP_SRGB` in `surface.wesl`.
const SRGB: u32 = 1 << 31;

/// How a map lies on its surface, one bit each, in `surface.wesl`: `MAP_SECOND`, and of a mirror and of a clamp along u; those
/// along v follow; and `MAP_SHARP`, for it is not averaged.
const SECOND: u32 = 1;
const MIRROR: [u32; 2] = [2, 8];
const CLAMP: [u32; 2] = [4, 16];
const SHARP: u32 = 32;

/// A picture on a surface as shaders see it; all 0 where there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, encase::ShaderType)]
pub struct Placed {
    /// Its first texel, and whether it is sRGB.
    pub first: u32,
    /// Its width and height, 16 bits each.
    pub size: u32,
    /// How it goes on beyond its edges, and whether it takes the second set of texture coordinates.
    pub how: u32,
    /// The first texel of its second mip level, which the others follow.
    pub coarser: u32,
    /// Maps texture coordinates to those of the picture: two columns, and what is added.
    pub columns: Vec4,
    /// See `columns`.
    pub offset: Vec2,
}

/// A picture as `mips.wesl` sees it.
#[derive(Clone, Copy, Debug, PartialEq, encase::ShaderType)]
pub(crate) struct Picture {
    first: u32,
    size: u32,
    coarser: u32,
    cut: u32,
}

impl Picture {
    /// The width and height of a mip level.
    fn level(&self, level: u32) -> [u32; 2] {
        [self.size & 0xffff, self.size >> 16].map(|side| (side >> level).max(1))
    }

    /// How many mip levels it has: the last is one texel.
    fn levels(&self) -> u32 {
        1 + self.level(0).into_iter().max().unwrap_or(1).ilog2()
    }
}

/// The buffer `pictures`.
#[derive(encase::ShaderType)]
struct Pictures {
    #[shader(size(runtime))]
    list: Vec<Picture>,
}

/// Pictures, each once, one after the other.
#[derive(Default)]
pub(super) struct Maps {
    texels: Vec<[u8; 4]>,
    pictures: Vec<(Arc<Texture>, Picture)>,
    /// How many texels all mip levels from the second on have.
    coarser: u64,
    /// The size of the first picture that is larger than shaders can address.
    oversized: Option<[u32; 2]>,
}

impl Maps {
    /// A map as shaders see it, its mip levels counted from where those of all pictures will begin; one without texels is none.
    /// `cut`: whether its alpha cuts surfaces away.
    pub(super) fn place(&mut self, map: &Map, cut: bool) -> Placed {
        let Some(picture) = self.picture(&map.texture, cut) else { return Placed::default() };
        let bits = |axis: usize| match map.wrap[axis] {
            Wrap::Repeat => 0,
            Wrap::Mirror => MIRROR[axis],
            Wrap::Clamp => CLAMP[axis],
        };
        let how = bits(0) | bits(1) | if map.second { SECOND } else { 0 } | if map.mips { 0 } else { SHARP };
        let columns = Vec4::from_array(map.transform.matrix2.to_cols_array());
        let Picture { first, size, coarser, .. } = picture;
        Placed { first, size, how, coarser, columns, offset: map.transform.translation }
    }

    /// A picture's place.
    fn picture(&mut self, texture: &Arc<Texture>, cut: bool) -> Option<Picture> {
        let cut = u32::from(cut);
        let known = |(known, picture): &&(Arc<Texture>, Picture)| Arc::ptr_eq(known, texture) && picture.cut == cut;
        if let Some((_, picture)) = self.pictures.iter().find(known) {
            return Some(*picture);
        }
        if texture.texels.is_empty() {
            return None;
        }
        let size = [texture.width, texture.height];
        let end = self.texels.len() as u64 + texture.texels.len() as u64;
        if size[0] > 0xffff || size[1] > 0xffff || end + self.coarser > u64::from(SRGB) / 2 {
            self.oversized.get_or_insert(size);
            return None;
        }
        let first = self.texels.len() as u32 | if texture.srgb { SRGB } else { 0 };
        let picture = Picture { first, size: size[0] | size[1] << 16, coarser: self.coarser as u32, cut };
        self.coarser +=
            (1..picture.levels()).map(|level| picture.level(level).map(u64::from).iter().product::<u64>()).sum::<u64>();
        self.texels.extend(&texture.texels);
        self.pictures.push((texture.clone(), picture));
        Some(picture)
    }

    /// Where mip levels from the second on begin.
    pub(super) fn coarser(&self) -> u32 {
        (self.texels.len() as u32).next_multiple_of(ROW)
    }

    /// Uploads them all, and makes their mip levels.
    ///
    /// # Errors
    /// More texels than the device's textures and buffers hold, and a lack of memory.
    pub(super) async fn texture(self, gpu: &Gpu) -> Result<wgpu::Texture, RenderError> {
        let limit = |found: String, limit: String| RenderError::Limit {
            what: "surfaces: pictures".into(),
            found,
            limit,
            advice: "Use smaller pictures.".into(),
        };
        if let Some([width, height]) = self.oversized {
            let most = format!("65535 a side, and {} texels in all, mip levels among them", SRGB / 2);
            return Err(limit(format!("one of {width} x {height} texels"), most));
        }
        let limits = gpu.device.limits();
        let (own, coarser) = (self.coarser() / ROW, self.coarser.div_ceil(ROW.into()) as u32);
        let (rows, bytes) = (own + coarser, u64::from(coarser) * u64::from(4 * ROW));
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if rows > limits.max_texture_dimension_2d || bytes > most {
            let most = u64::from(limits.max_texture_dimension_2d).min(most / u64::from(ROW)) * u64::from(ROW);
            return Err(limit(
                format!("{} texels, mip levels among them", u64::from(rows) * u64::from(ROW)),
                format!("{most} texels"),
            ));
        }
        let (format, usage) =
            (wgpu::TextureFormat::Rgba8Unorm, wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC);
        let texture = gpu.texture_2d("texels", [ROW, rows.max(1)], format, usage).await?;
        let mut texels = self.texels;
        texels.resize(own as usize * ROW as usize, [0; 4]);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * ROW), rows_per_image: None };
        let size = |height| wgpu::Extent3d { width: ROW, height, depth_or_array_layers: 1 };
        gpu.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&texels), layout, size(own));
        let list: Vec<_> = self.pictures.iter().map(|(_, picture)| *picture).collect();
        let levels = list.iter().map(Picture::levels).max().unwrap_or(1);
        if levels == 1 {
            return Ok(texture);
        }
        let widest = [0, 1].map(|axis| list.iter().map(|picture| picture.level(1)[axis]).max().unwrap_or(1));
        let groups = [widest[0].div_ceil(8), widest[1].div_ceil(8), list.len() as u32];
        let made = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("coarser"),
            size: bytes,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let pictures = gpu.buffer("pictures", &Pictures { list });
        let mut graph = Graph::new(gpu);
        let tile = graph.tile();
        graph
            .compute("mips", &MIPS)
            .read("tile", &tile)
            .read("pictures", &pictures)
            .read("texels", &texture)
            .write("coarser", &made)
            .dispatch(groups, levels - 1)
            .await?;
        graph.run_once()?;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let from = wgpu::TexelCopyBufferInfo { buffer: &made, layout };
        let to =
            wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x: 0, y: own, z: 0 }, ..texture.as_image_copy() };
        encoder.copy_buffer_to_texture(from, to, size(coarser));
        gpu.queue.submit([encoder.finish()]);
        Ok(texture)
    }
}
