//! Whether a virtual light shines on a point: by a ray, or by the light's shadow map.
//!
//! **Maps.** A virtual light on a surface shines into a hemisphere: its map is a hemicube, one square along the normal and four halves to
//! the sides, where triangles stay triangles and a rasteriser is exact. Parallel light has one plane. All lie in one atlas of at most
//! [`ATLAS`] texels a side. Where it has no room for all lights, passes take turns: the maps of as many as fit are drawn, their light is
//! gathered, and the same texels serve the next, tile by tile of the film.
//!
//! **Bias.** As in `shadows`: over the plane of a surface, 1/distance along a face is linear in the map's coordinates, so that plane's depth
//! at the texel's middle is compared, not the point's own. The plane is taken as far above the surface, and the light as far beside its own,
//! as rays start and end there. What is left is what a rasteriser may move vertices, 1/32 texel, and some roundings of a float.
//!
//! **What stays with rays.** Lamps, whose shadows have edges that are seen (a map's are a texel wide); images of virtual lights in
//! mirrors, that shine through an outline; and short rays, which look for what is there and not whether anything is.

#[cfg(test)]
mod test;

use std::ops::Range;

use glam::{UVec2, Vec3};
use tyndall_scene::FieldError;
use tyndall_scene::parameter::{Kind, Parameter, Settings};
use wgpu::TextureUsages;

use super::batches::Batch;
use super::geometry::Geometry;
use super::vpl::{PARALLEL, Vpl};
use crate::graph::{Draw, Graph, Region, Shader, Turns, shader};
use crate::resident::Resident;
use crate::{Gpu, RenderError};

static DEPTH: Shader = shader!("techniques/instant_radiosity/visibility/depth");

/// How it is found whether virtual lights shine on a point.
pub(super) const VISIBILITY: Parameter = Parameter {
    name: "visibility",
    help: "What finds whether a virtual light shines on a point: shadow maps, or rays; auto goes by the device and the surfaces",
    unit: "",
    kind: Kind::Choice(&["auto", "rays", "maps"]),
};

/// The side of a map.
pub(super) const RESOLUTION: Parameter = Parameter {
    name: "map_resolution",
    help: "Side of the shadow map of a virtual light",
    unit: "texels",
    kind: Kind::Count { min: 16, max: 1024, default: 128 },
};

/// The side of maps [texels] by the settings, for so many lights; `None`: rays. By default there are maps where surfaces have no more
/// triangles than pixels are lit by a drawing of them: all triangles are drawn for each face, and each pixel is spared a ray.
/// Pixels that share out lights cast rays.
///
/// # Errors
/// Maps that are asked for where pixels share out lights.
pub(super) fn side(
    gpu: &Gpu,
    settings: &Settings,
    resident: &Resident,
    lights: usize,
) -> Result<Option<u32>, FieldError> {
    let side = settings.number(RESOLUTION.name) as u32;
    let interleaved = settings.number("interleaving") > 1.0;
    let maps = match settings.choice(VISIBILITY.name) {
        "maps" if interleaved => {
            return Err(FieldError {
                path: "techniques.instant_radiosity.visibility".into(),
                found: "\"maps\", with interleaving".into(),
                accepted: "\"maps\" with interleaving = 1, or \"rays\"".into(),
            });
        }
        "auto" if interleaved => false,
        "auto" => {
            let film = resident.film.map(u64::from).iter().product::<u64>();
            let tile = u64::from(gpu.tile_side()).pow(2);
            let pixels = if lights as u64 > u64::from(Plan::capacity(gpu, side)) { film.min(tile) } else { film };
            u64::from(resident.surfaces.count) < pixels
        }
        choice => choice == "maps",
    };
    Ok(maps.then_some(side))
}

/// Texels a side of the atlas, at most: 64 MiB.
const ATLAS: u32 = 4096;

/// Maps' faces a submission.
const BATCH: u32 = 64;

/// Faces of a map.
const FACES: u32 = 5;

/// What all maps are fitted to, as `hemicube.wesl` has it.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Casters {
    middle: Vec3,
    radius: f32,
}

impl Casters {
    /// The ball around all surfaces.
    pub(super) fn of(geometry: &Geometry) -> Self {
        let (middle, radius) = geometry.sphere();
        Self { middle: middle.as_vec3(), radius: 1.0001 * radius as f32 }
    }
}

/// The buffer `casts`: [`FACES`] times a light's number, and the face.
#[derive(Debug, encase::ShaderType)]
struct Casts {
    #[shader(size(runtime))]
    list: Vec<u32>,
}

/// The atlas of maps.
#[derive(Clone, Debug)]
pub(super) struct Maps {
    /// All depths; of one texel where rays are cast.
    pub atlas: wgpu::Texture,
    /// The height of a map, a strip three times as wide [texels]; 1: rays are cast.
    pub side: u32,
    /// Maps in a row.
    pub columns: u32,
}

impl Maps {
    /// No maps.
    ///
    /// # Errors
    /// A lack of memory.
    pub async fn none(gpu: &Gpu) -> Result<Self, RenderError> {
        Ok(Self { atlas: atlas(gpu, [1, 1]).await?, side: 1, columns: 1 })
    }

    /// Maps for these lights, if the settings want any: what draws them is recorded, and `batches` say which lie there when.
    ///
    /// # Errors
    /// A lack of memory, and whatever the device refuses.
    pub async fn record(
        graph: &mut Graph<'_>,
        resident: &Resident,
        gather: &wgpu::Buffer,
        plan: &Plan,
    ) -> Result<Self, RenderError> {
        let gpu = graph.gpu();
        let Plan { side, columns, rows, casts, regions, turns } = plan;
        if casts.is_empty() {
            return Self::none(gpu).await;
        }
        let atlas = atlas(gpu, [3 * side * columns, side * rows]).await?;
        let vertices = 3 * resident.surfaces.count;
        let instances = casts.len() as u32;
        let casts = gpu.buffer("casts", &Casts { list: casts.clone() });
        let pass =
            graph.raster("maps of virtual lights", &DEPTH).world(resident).read("gather", gather).read("casts", &casts);
        if turns.iter().filter(|turn| !turn.is_empty()).count() > 1 {
            pass.draw_in_turns(Turns { vertices, depth: &atlas, regions, turns }).await?;
        } else {
            let depth = Some(&atlas);
            let regions = Some(&regions[..]);
            pass.draw(Draw { vertices, instances, batch: BATCH, target: None, depth, regions }).await?;
        }
        Ok(Self { atlas, side: *side, columns: *columns })
    }
}

async fn atlas(gpu: &Gpu, size: [u32; 2]) -> Result<wgpu::Texture, RenderError> {
    let usage = TextureUsages::RENDER_ATTACHMENT;
    gpu.texture_2d("maps of virtual lights", size, wgpu::TextureFormat::Depth32Float, usage).await
}

/// Which maps are drawn where, and when.
#[derive(Debug, Default)]
pub(super) struct Plan {
    side: u32,
    columns: u32,
    rows: u32,
    /// As [`Casts`] has them.
    casts: Vec<u32>,
    regions: Vec<Region>,
    /// What each round of the pass that gathers draws before.
    turns: Vec<Range<u32>>,
}

impl Plan {
    /// No maps.
    pub fn none() -> Self {
        Self::default()
    }

    /// How many maps of this side [texels] an atlas has room for.
    pub fn capacity(gpu: &Gpu, side: u32) -> u32 {
        let most = ATLAS.min(gpu.device.limits().max_texture_dimension_2d);
        (most / (3 * side)).max(1) * (most / side)
    }

    /// The maps of all lights, in as few turns as their atlas allows: a batch has a place for each of its lights, counted from its
    /// `first_map`.
    pub fn new(gpu: &Gpu, side: u32, vpls: &[Vpl], batches: &mut [Batch]) -> Self {
        let capacity = Self::capacity(gpu, side);
        let columns = (ATLAS.min(gpu.device.limits().max_texture_dimension_2d) / (3 * side)).max(1);
        let mut plan = Self { side, columns, ..Self::default() };
        // The first light of what lies in the atlas together, and the round before which that is drawn.
        let (mut first, mut turn, mut most) = (0, 0, 0);
        for (round, batch) in batches.iter_mut().enumerate() {
            if round == 0 || batch.end - first > capacity {
                (first, turn) = (batch.begin, round);
            }
            batch.first_map = first;
            most = most.max(batch.end - first);
            let begin = plan.casts.len() as u32;
            plan.turns.push(begin..begin);
            for light in batch.begin..batch.end {
                plan.cast(light, light - first, &vpls[light as usize]);
            }
            plan.turns[turn].end = plan.casts.len() as u32;
        }
        plan.rows = most.div_ceil(columns).max(1);
        plan
    }

    /// Adds the faces of a light's map, in a place of the atlas.
    fn cast(&mut self, light: u32, place: u32, vpl: &Vpl) {
        if !vpl.has_map() {
            return;
        }
        let (side, half) = (self.side, self.side / 2);
        let origin = UVec2::new(3 * (place % self.columns), place / self.columns) * side;
        for face in 0..if vpl.kind == PARALLEL { 1 } else { FACES } {
            let (left, width) = match face {
                0 if vpl.kind == PARALLEL => (0, 3 * side),
                0 => (0, side),
                _ => (side + (face - 1) * half, half),
            };
            self.casts.push(FACES * light + face);
            self.regions.push(Region { origin: origin + UVec2::new(left, 0), size: UVec2::new(width, side) });
        }
    }
}
