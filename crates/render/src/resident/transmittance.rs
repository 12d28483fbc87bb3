//! Maps of the transmittance from lights (`transmittance.wesl`): where they are, and how they are to be read.

use crate::{Gpu, RenderError};

/// The number of deep maps among the bases: every event of a ray is kept.
pub const DEEP: u32 = 7;

/// Maps of the transmittance from the first lights.
#[derive(Clone, Debug)]
pub struct Transmittance {
    /// `Rgba32Float`, four texels a light: where its rays run and have depths.
    pub maps: wgpu::Texture,
    /// `Rgba16Float` or `Rgba32Float`: numbers of the basis, a tile for each light, of it for each channel, and of that for each
    /// set of four.
    pub texels: wgpu::Texture,
    /// `Rgba32Float`: the events of deep maps; of one texel where there are none.
    pub events: wgpu::Texture,
    /// How many lights have maps; 0: there are none.
    pub mapped: u32,
    /// For how many directions of the environment, after the other lights; 0: it has no maps.
    pub directions: u32,
    /// Whether all that have maps are directional.
    pub parallel: bool,
    /// Texels a side of a tile.
    pub resolution: u32,
    /// Whether each texel has a range of depths of its own, in a set before the others.
    pub ranges: bool,
    /// Whether optical depths are interpolated between texels, as ranges jump from one to the next, and not numbers.
    pub apart: bool,
    /// Tiles in a row.
    pub columns: u32,
    /// Which mip level is looked up, between two of them where it is no whole number.
    pub level: f32,
    /// Which basis, as `math/transmittance/basis.wesl` numbers them.
    pub basis: u32,
    /// Numbers that it has.
    pub count: u32,
    /// Sets of four.
    pub sets: u32,
    /// What is mixed into moments; 0: the basis is linear.
    pub bias: f32,
}

impl Transmittance {
    /// No maps.
    ///
    /// # Errors
    /// A lack of memory.
    pub async fn none(gpu: &Gpu) -> Result<Self, RenderError> {
        let zero = bytemuck::cast_slice(&[0f32; 4]);
        let maps = gpu.table("no maps", [1, 1], wgpu::TextureFormat::Rgba32Float, zero).await?;
        // Of half floats: every device interpolates them.
        let events = gpu.table("no events", [1, 1], wgpu::TextureFormat::Rgba32Float, zero).await?;
        let texels = gpu.table("no transmittance", [1, 1], wgpu::TextureFormat::Rgba16Float, &zero[..8]).await?;
        Ok(Self {
            maps,
            texels,
            events,
            mapped: 0,
            parallel: true,
            directions: 0,
            resolution: 1,
            ranges: false,
            apart: false,
            columns: 1,
            level: 0.0,
            basis: 0,
            count: 1,
            sets: 1,
            bias: 0.0,
        })
    }

    /// What shaders that read the maps are specialised for.
    pub fn constants(&self) -> [(&'static str, f64); 11] {
        [
            ("MAPPED", self.mapped.into()),
            ("PARALLEL_MAPS", self.parallel.into()),
            ("RESOLUTION", self.resolution.into()),
            ("RANGES", self.ranges.into()),
            ("APART", self.apart.into()),
            ("COLUMNS", self.columns.into()),
            ("LEVEL", self.level.into()),
            ("BASIS", self.basis.into()),
            ("COUNT", self.count.into()),
            ("SETS", self.sets.into()),
            ("BIAS", self.bias.into()),
        ]
    }

    /// Loop iterations that a look into a light's map takes at most.
    pub fn iterations(&self) -> u64 {
        match (self.mapped, self.bias) {
            (0, _) => 0,
            // Four lists, of at most 2^24 events each.
            (_, 0.0) if self.basis == DEEP => 3 * 4 * 25,
            (_, 0.0) if self.apart => 12 * (u64::from(self.sets) + 1),
            (_, 0.0) => 3 * (u64::from(self.sets) + 1),
            // Four roots, 48 steps and five powers each, and what goes before and after.
            _ => 3 * 1500,
        }
    }

    /// Bytes of the numbers, and of the events, of all maps, their mip levels among them.
    pub fn bytes(&self) -> u64 {
        let events =
            if self.basis == DEEP { 16 * u64::from(self.events.width()) * u64::from(self.events.height()) } else { 0 };
        let texel = self.texels.format().block_copy_size(None).unwrap_or(16);
        let whole = u64::from(self.texels.width()) * u64::from(self.texels.height()) * u64::from(texel);
        (0..self.texels.mip_level_count()).map(|level| whole >> (2 * level)).sum::<u64>() + events
    }
}
