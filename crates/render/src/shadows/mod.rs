//! Shadow maps [Williams78] of any number of lights, in one atlas.
//!
//! A light has one map (spot), six (point, or a point of an area light: the faces of a cube), or one a cascade (directional). A
//! compute pass fits them to what it finds in the buffers of lights and camera (`Fit`), and one raster pass draws all; so
//! lights may move, and be written by the device itself, without a new recording. Depths are reversed: near/distance, or linear
//! in it for parallel light.
//!
//! **Cascades.** The camera's depths, as far as anything receives shadows, are cut by the practical split scheme [Zhang06 (6)],
//! and each slice gets the ball around it: its size is the same however the camera turns. Its radius goes in steps of 2^⅛ and
//! its centre in whole texels, so that shadows do not shimmer. A ball is never larger than that around all casters.
//!
//! **Bias.** A texel holds the depth of the nearest surface at its centre, which lies beside the point that looks it up. Over
//! the plane of a surface, depth is a linear function of the map's coordinates, both for parallel light and, as 1/distance is,
//! for a light at a point. So the point's own depth is not compared, but that of its plane at the texel's centre
//! [Isidoro06]: a plane casts no shadow on itself, at any angle and under any kernel; nor does a convex surface, which lies
//! behind each of its planes. What is left is rounding: a rasteriser moves vertices by at most 1/32 texel, which
//! changes a plane's depth by at most (|∂z/∂x| + |∂z/∂y|)/32; depths are floats; and the point has been found by a ray from the
//! eye, rounded in proportion to the distance. The sum of the three is the bias. A shadow so begins at most 1/32 texel of
//! slope, and the rounding, behind its caster.
//!
//! **Filter.** The share of a square of texels that is lit [Reeves87]; texels count by the area of them that lies within.

#[cfg(test)]
mod test;

use glam::{UVec2, Vec3, Vec4};
use tyndall_scene::parameter::{Kind, Parameter, Settings};
use wgpu::TextureUsages;

use crate::graph::{Draw, Graph, Region, Shader, shader};
use crate::resident::{Light, Resident};
use crate::{Gpu, RenderError};

static FIT: Shader = shader!("shadows/fit");
static DEPTH: Shader = shader!("shadows/depth");

/// The side of a shadow map.
pub const RESOLUTION: Parameter = Parameter {
    name: "shadow_resolution",
    help: "Side of a shadow map; cubes have half of it, points of area lights and the environment a quarter",
    unit: "texels",
    kind: Kind::Count { min: 64, max: 8192, default: 1024 },
};

/// How many maps parallel light has.
pub const CASCADES: Parameter = Parameter {
    name: "cascades",
    help: "Shadow maps of a directional light, each for a slice of the camera's depths",
    unit: "",
    kind: Kind::Count { min: 1, max: 8, default: 4 },
};

/// The kernel of percentage-closer filtering.
pub const RADIUS: Parameter = Parameter {
    name: "shadow_radius",
    help: "Half the side of the square over which shadows are averaged",
    unit: "texels",
    kind: Kind::Number { min: 0.5, max: 8.0, default: 1.0 },
};

/// The distance from a light before which nothing casts a shadow, relative to the size of the scene.
const NEAREST: f32 = 1e-6;

/// Loop iterations that a look at shadow maps takes in media, at most: cascades, and the filter's rows and texels.
pub(crate) const ITERATIONS: u64 = 12;

/// Maps a submission.
const BATCH: u32 = 64;

/// How large maps are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Side of a map [texels], at least 64.
    pub resolution: u32,
    /// Maps of a directional light.
    pub cascades: u32,
    /// How far filters reach [texels].
    pub radius: f32,
}

impl Options {
    /// For media, whose technique has the parameter [`RESOLUTION`]: what scatters along a ray needs no filter.
    pub(crate) fn of_media(settings: &Settings) -> Self {
        Self { resolution: settings.number(RESOLUTION.name) as u32, cascades: 4, radius: 0.5 }
    }
}

/// A map to be fitted (`fit.wesl`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, encase::ShaderType)]
pub struct Cast {
    /// The number of its light.
    pub light: u32,
    /// Which of the light's maps it is: a cascade, the finest first; or a face, of +x, −x, +y, −y, +z, −z.
    pub part: u32,
    /// How many the light has: 1 or, for a light at a position, 6.
    pub parts: u32,
    /// Its side [texels].
    pub size: u32,
    /// Where it is in the atlas [texels].
    pub origin: UVec2,
}

/// The buffer `casts`.
#[derive(Debug, encase::ShaderType)]
struct Casts {
    #[shader(size(runtime))]
    casts: Vec<Cast>,
}

/// The buffer `fit`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Fit {
    casters: Vec4,
    low: Vec3,
    nearest: f32,
    high: Vec3,
    border: f32,
}

/// The shadow maps of some lights; `shadows/lookup.wesl` reads them.
#[derive(Clone, Debug)]
pub struct Shadows {
    /// A map a row.
    pub maps: wgpu::Texture,
    /// All depths.
    pub atlas: wgpu::Texture,
    /// Whether there are any maps.
    pub any: bool,
}

impl Shadows {
    /// Gives lights their maps, none where no surface casts a shadow: what [`record`](Self::record) is to draw.
    ///
    /// # Errors
    /// More maps than a texture holds.
    pub fn plan(
        gpu: &Gpu,
        resident: &Resident,
        lights: &mut [Light],
        options: &Options,
    ) -> Result<Vec<Cast>, RenderError> {
        let mut casts = Vec::new();
        if resident.surfaces.count == 0 {
            return Ok(casts);
        }
        for (number, light) in lights.iter_mut().enumerate() {
            let (parts, size) = parts(light, options);
            light.maps = UVec2::new(casts.len() as u32, parts);
            casts.extend((0..parts).map(|part| Cast { light: number as u32, part, parts, size, ..Cast::default() }));
        }
        pack(gpu, &mut casts)?;
        Ok(casts)
    }

    /// Records the passes that fit and draw the maps of `lights`, a buffer of [`Light`]s that
    /// [`plan`](Self::plan) has given maps, as seen by the [`View`](crate::resident::View) in `view`; once a frame.
    ///
    /// # Errors
    /// A lack of memory, and whatever the device refuses.
    pub async fn record(
        graph: &mut Graph<'_>,
        resident: &Resident,
        view: &wgpu::Buffer,
        lights: &wgpu::Buffer,
        casts: Vec<Cast>,
        options: &Options,
    ) -> Result<Self, RenderError> {
        let gpu = graph.gpu();
        let regions: Vec<_> =
            casts.iter().map(|cast| Region { origin: cast.origin, size: UVec2::splat(cast.size) }).collect();
        let end = regions.iter().map(|region| region.origin + region.size).fold(UVec2::ONE, UVec2::max);
        let count = casts.len() as u32;
        let format = wgpu::TextureFormat::Rgba32Float;
        let maps = gpu.texture_2d("shadow maps", [6, count.max(1)], format, TextureUsages::STORAGE_BINDING).await?;
        let format = wgpu::TextureFormat::Depth32Float;
        let atlas = gpu.texture_2d("shadow atlas", end.into(), format, TextureUsages::RENDER_ATTACHMENT).await?;
        if casts.is_empty() {
            return Ok(Self { maps, atlas, any: false });
        }
        let options = *options;
        let fitted = gpu.buffer("fit", &fit(resident, &options));
        graph.follow(&fitted, move |resident, _| fit(resident, &options));
        let casts = gpu.buffer("casts", &Casts { casts });
        graph
            .compute("fit shadows", &FIT)
            .read("view", view)
            .read("lights", lights)
            .read("casts", &casts)
            .read("fit", &fitted)
            .write("maps", &maps)
            .dispatch([count.div_ceil(64), 1, 1], 1)
            .await?;
        let surfaces = &resident.surfaces;
        graph
            .raster("shadows", &DEPTH)
            .world(resident)
            .read("maps", &maps)
            .draw(Draw {
                vertices: 3 * surfaces.count,
                instances: count,
                batch: BATCH,
                target: None,
                depth: Some(&atlas),
                regions: Some(&regions),
            })
            .await?;
        Ok(Self { maps, atlas, any: true })
    }
}

/// How many maps a light has, and how large.
fn parts(light: &Light, options: &Options) -> (u32, u32) {
    let Options { resolution, cascades, .. } = *options;
    match light.local {
        Light::DIRECTIONAL if light.sky != 0 => (1, resolution / 4),
        Light::DIRECTIONAL => (cascades, resolution),
        Light::AREA => (6, resolution / 4),
        // Up to 60 degrees from its axis, a cone is seen in one map.
        _ if -light.offset > 0.5 * light.scale => (1, resolution),
        _ => (6, resolution / 2),
    }
}

/// Places maps in an atlas: the largest first, in rows.
fn pack(gpu: &Gpu, casts: &mut [Cast]) -> Result<(), RenderError> {
    let limit = gpu.device.limits().max_texture_dimension_2d;
    let refused = || RenderError::Limit {
        what: "shadow maps".into(),
        found: format!(
            "{} of up to {} texels a side",
            casts.len(),
            casts.iter().map(|cast| cast.size).max().unwrap_or(0)
        ),
        limit: format!("{limit} x {limit} texels in all, and {limit} maps"),
        advice: "Use a lower shadow_resolution, or fewer lights, area_points or environment_directions.".into(),
    };
    if casts.len() > limit as usize {
        return Err(refused());
    }
    let area: u64 = casts.iter().map(|cast| u64::from(cast.size).pow(2)).sum();
    let largest = casts.iter().map(|cast| cast.size).max().unwrap_or(1);
    let width = (area.isqrt() as u32 + 1).next_multiple_of(largest).min(limit);
    let mut order: Vec<_> = (0..casts.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(casts[i].size));
    let mut origins = vec![UVec2::ZERO; casts.len()];
    let (mut at, mut row) = (UVec2::ZERO, 0);
    for i in order {
        let size = casts[i].size;
        if at.x + size > width {
            at = UVec2::new(0, at.y + row);
            row = 0;
        }
        row = row.max(size);
        origins[i] = at;
        at.x += size;
        if origins[i].max_element() + size > limit {
            return Err(refused());
        }
    }
    for (cast, origin) in casts.iter_mut().zip(origins) {
        cast.origin = origin;
    }
    Ok(())
}

/// What maps are fitted to.
fn fit(resident: &Resident, options: &Options) -> Fit {
    let [low, high] = resident.surfaces.bounds.unwrap_or_default();
    // A flat scene has a thickness, too.
    let radius = (0.5 * (high - low).length()).max(1e-30) * 1.0001;
    let casters = (0.5 * (low + high)).extend(radius);
    let [low, high] = resident.bounds.unwrap_or([low, high]);
    Fit { casters, low, high, nearest: NEAREST * radius, border: options.radius.ceil() + 1.0 }
}
