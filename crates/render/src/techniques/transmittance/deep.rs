//! Deep shadow maps [Lokovic00], uncompressed: each texel keeps all that its ray meets, in the order of depth. Exact but for what
//! lies between texels, as large as that takes, and what the bases are measured against.
//!
//! Events are counted when passes are recorded, so that there is room for them, or an error that says how much it would take. A
//! frame counts them again, gives every texel its place among them, writes them there in any order, merges ever
//! longer runs of them, and adds them up. A body is one event, where the bases have it; a segment of the march is two, between which
//! extinction is constant.

use tyndall_scene::parameter::Settings;

use super::draw::Drawing;
use super::{Deposit, TECHNIQUE};
use crate::graph::{Graph, Shader, Tile, shader};
use crate::renderer::map;
use crate::resident::Resident;
use crate::{Gpu, RenderError};

static BODIES: Shader = shader!("techniques/transmittance/deep_bodies");
static MEDIA: Shader = shader!("techniques/transmittance/deep_media");
static PLACE: Shader = shader!("techniques/transmittance/deep_place");
static SORT: Shader = shader!("techniques/transmittance/deep_sort");
static FINISH: Shader = shader!("techniques/transmittance/deep_finish");

/// Bytes of a list.
pub(crate) const LIST: u64 = 12;
/// Bytes of an event.
const EVENT: u64 = 16;

/// Workgroups along x in `deep_bodies.wesl`, and wherever there is one for so many lists.
const ROW: u32 = 32768;

/// Events in a row of their texture (`resident/transmittance.wesl`).
const EVENT_ROW: u32 = 4096;

/// What all passes work on.
struct Lists<'r> {
    lights: u32,
    deposit: &'r wgpu::Buffer,
    lists: wgpu::Buffer,
    total: wgpu::Buffer,
}

/// Records the passes that fill deep maps, after `bounds` has recorded, into any graph, those that fit them.
///
/// # Errors
/// More events than the device holds, or than one texel may have.
pub(super) async fn record(
    graph: &mut Graph<'_>,
    resident: &mut Resident,
    settings: &Settings,
    deposit: Deposit,
    bounds: impl AsyncFn(&mut Graph<'_>, &Resident) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    let gpu = graph.gpu();
    let deposit = gpu.buffer("deposit", &deposit);
    let lights = resident.transmittance.mapped;
    let channels = if resident.traits.grey { 1 } else { 3 };
    let texels = u64::from(resident.transmittance.resolution).pow(2);
    let number = u64::from(lights * channels) * texels;
    let resolution = settings.number("resolution");
    let refused = |found: String, limit: String| RenderError::Limit {
        what: format!("techniques.{}.resolution", TECHNIQUE.name),
        found,
        limit,
        advice: format!("Use fewer than {resolution} texels a side, or a basis in place of \"deep\"."),
    };
    let limits = gpu.device.limits();
    let room = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if number * LIST > room {
        return Err(refused(format!("deep maps of {number} texels"), format!("{} texels", room / LIST)));
    }
    let make = || Lists {
        lights,
        deposit: &deposit,
        lists: gpu.scratch("lists", number * LIST),
        total: gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("total"),
            size: 8,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        }),
    };
    let none = gpu.scratch("no events", EVENT);
    let counted = make();
    let mut counting = Graph::new(gpu);
    bounds(&mut counting, resident).await?;
    events(&mut counting, resident, &counted, &none, false).await?;
    place(&mut counting, &counted).await?;
    let [count, longest] = run(gpu, &counting, &counted.total).await?;
    let most = (room / EVENT).min(u64::from(limits.max_texture_dimension_2d) * u64::from(EVENT_ROW));
    if u64::from(count) > most {
        return Err(refused(format!("deep maps of {count} events"), format!("{most} events, {EVENT} bytes each")));
    }
    if longest > gpu.iterations() - 64 {
        return Err(refused(format!("{longest} events along a ray"), format!("{}", gpu.iterations() - 64)));
    }
    let rows = count.div_ceil(EVENT_ROW).max(1);
    let format = wgpu::TextureFormat::Rgba32Float;
    let usage = wgpu::TextureUsages::STORAGE_BINDING;
    resident.transmittance.events = gpu.texture_2d("events", [EVENT_ROW, rows], format, usage).await?;
    let size = u64::from(count.max(1)) * EVENT;
    let [first, merged] = ["events", "merged"].map(|label| gpu.scratch(label, size));
    let made = make();
    events(graph, resident, &made, &first, false).await?;
    place(graph, &made).await?;
    events(graph, resident, &made, &first, true).await?;
    // As many rounds as bring them back to where they were.
    let rounds = longest.max(1).next_power_of_two().ilog2().next_multiple_of(2);
    let tile = graph.tile();
    let groups = (number as u32).div_ceil(64);
    if rounds > 0 {
        graph
            .compute("transmittance.sort", &SORT)
            .read("tile", &tile)
            .write("lists", &made.lists)
            .write("events", &first)
            .write("merged", &merged)
            .dispatch([groups.min(ROW), groups.div_ceil(ROW), 1], rounds)
            .await?;
    }
    let side = resident.transmittance.resolution.div_ceil(8);
    let heads = resident.transmittance.texels.clone();
    let written = resident.transmittance.events.clone();
    graph
        .compute("transmittance.finish", &FINISH)
        .world(resident)
        .write("total", &made.total)
        .write("written", &written)
        .write("heads", &heads)
        .write("lists", &made.lists)
        .write("events", &first)
        .dispatch([side, side, lights * channels], 1)
        .await
}

/// Records the passes that count events, or write them.
async fn events(
    graph: &mut Graph<'_>,
    resident: &Resident,
    made: &Lists<'_>,
    events: &wgpu::Buffer,
    fill: bool,
) -> Result<(), RenderError> {
    let bodies = resident.bodies.ball_count + resident.bodies.segment_count;
    if bodies > 0 {
        for light in 0..made.lights {
            let drawing = graph.gpu().buffer("drawing", &Drawing { light, channel: 0, first: 0 });
            graph
                .compute("transmittance.bodies", &BODIES)
                .constant("FILL", fill)
                .world(resident)
                .read("drawing", &drawing)
                .write("lists", &made.lists)
                .write("events", events)
                .dispatch([bodies.min(ROW), bodies.div_ceil(ROW), 1], 1)
                .await?;
        }
    }
    if resident.traits.count == 0 {
        return Ok(());
    }
    let side = resident.transmittance.resolution.div_ceil(8);
    graph
        .compute("transmittance.media", &MEDIA)
        .constant("FILL", fill)
        .world(resident)
        .read("deposit", made.deposit)
        .write("lists", &made.lists)
        .write("events", events)
        .dispatch([side, side, made.lights], 1)
        .await
}

/// Records the pass that gives lists their places.
async fn place(graph: &mut Graph<'_>, made: &Lists<'_>) -> Result<(), RenderError> {
    let groups = (made.lists.size() / LIST).div_ceil(256) as u32;
    graph
        .compute("transmittance.place", &PLACE)
        .write("total", &made.total)
        .write("lists", &made.lists)
        .dispatch([groups.min(ROW), groups.div_ceil(ROW), 1], 1)
        .await
}

/// Runs passes now, and reads what they have counted.
async fn run(gpu: &Gpu, graph: &Graph<'_>, total: &wgpu::Buffer) -> Result<[u32; 2], RenderError> {
    let mut profiler = wgpu_profiler::GpuProfiler::new(&gpu.device, Default::default())
        .map_err(|error| RenderError::Pass { pass: "profiler".into(), message: error.to_string() })?;
    graph.submit(Tile::default(), &mut profiler);
    let readable = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("readable"),
        size: 8,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(total, 0, &readable, 0, 8);
    gpu.queue.submit([encoder.finish()]);
    let bytes = map(gpu, &readable).await?;
    let [events, longest] =
        [0, 4].map(|at| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]));
    Ok([events, longest])
}
