//! Light maps: what surfaces send out, in textures, once and for all views [Keller97].
//!
//! Every side of a surface that light reaches is unwrapped into one texture; a texel's middle gathers the virtual lights of all paths
//! as a pixel does (`gather.wesl`), with the same clamping and its compensation, and as many short rays as `samples` says. No lights
//! stand for others (`walks`), as that goes by what an eye sees:
//!
//! L(x) = L_e(x) + ρ(x)/π · E(x)
//!
//! That is the radiance in every direction of a Lambertian surface. Of another only what is Lambertian is kept, and gloss goes with
//! it: a metallic-roughness surface counts as if it were Lambertian with its base colour as reflectance, which keeps about as much
//! light and spreads it evenly. Mirrors and glass are left as they are.
//!
//! A surface of the result emits that radiance and reflects nothing, so it looks the same wherever it is rendered, without lights.

mod atlas;
#[cfg(test)]
mod test;

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3};
use tyndall_scene::World;
use tyndall_scene::parameter::Settings;
use tyndall_scene::surface::{Bsdf, Exported, Map, Material, Surface, Texture, TriangleMesh};

use super::batches::{batches, grouped};
use super::gathering::Gathering;
use super::geometry::Geometry;
use super::vpl::{PARALLEL, Vpl};
use super::{TECHNIQUE, Walk, check_size, per_round, walk};
use crate::frame::film_texture;
use crate::graph::{Graph, Shader, Tile, shader};
use crate::renderer::read_film;
use crate::resident::{Resident, surfaces};
use crate::techniques::instant_radiosity::sequence::radical_inverse;
use crate::{Gpu, RenderError};
use atlas::{Atlas, Side, broken};

static BAKE: Shader = shader!("techniques/instant_radiosity/bake/bake");

/// What is told the finished share of the work, and may break it off.
pub type Progress<'p> = dyn FnMut(f64) -> ControlFlow<()> + Send + 'p;

/// A world's surfaces with their light.
#[derive(Clone, Debug)]
pub struct Baked {
    /// Surfaces that emit what the world's send out, in the world [m]; mirrors and glass as they were. All maps are one texture; a
    /// surface's emission is the brightest of it, so that 8 bits a channel, in sRGB, are fine for each.
    pub surfaces: Vec<Exported>,
    /// Columns and rows of the light map.
    pub size: [u32; 2],
    /// How many virtual lights there were, without images in mirrors.
    pub vpls: usize,
}

/// How many pairs of a point and a virtual light are tried to find whether light reaches a side.
const TRIES: u32 = 1024;

/// Bakes the light of a world's surfaces, by its settings of the technique, into a map of at most `side` × `side` texels, from 16 to
/// 4096. Media neither dim it nor scatter.
///
/// # Errors
/// Settings that are not accepted, meshes that do not fit the map, what the device lacks, and [`RenderError::Interrupted`] where
/// `progress` broke off.
pub async fn bake(gpu: &Gpu, world: &World, side: u32, progress: &mut Progress<'_>) -> Result<Baked, RenderError> {
    let given = world.scene.techniques.get(TECHNIQUE.name);
    let settings = Settings::new(TECHNIQUE.name, TECHNIQUE.parameters, given)?;
    // What lights and is lit.
    let world = &World { volumes: Vec::new(), ..world.clone() };
    let walk = Walk::new(world, &settings)?;
    if world.surfaces.iter().any(|surface| surface.material.alpha_cutoff.is_some()) {
        tracing::warn!("surfaces: what alpha cuts away is there in light maps");
    }
    let lights = walk.lights();
    let vpls = lights.len();
    let sides = sides(world, &walk.geometry, &lights);
    let atlas = Atlas::new(&sides, side.clamp(16, 4096), progress)?;
    tracing::info!(vpls, sides = sides.len(), size = ?atlas.size, "light map");
    let mut light = gathered(gpu, world, &settings, &walk, &lights, &atlas, progress).await?;
    fill(&mut light, &atlas);
    Ok(Baked { surfaces: exported(world, &sides, &atlas, &light), size: atlas.size, vpls })
}

/// The sides of surfaces that a light map can show and light reaches; the front of those that it does not reach at all.
fn sides(world: &World, geometry: &Geometry, lights: &[Vpl]) -> Vec<Side> {
    let mut first = 0;
    let mut sides = Vec::new();
    for (number, surface) in world.surfaces.iter().enumerate() {
        let (vertices, triangles) = surfaces::triangles(std::slice::from_ref(surface));
        let side =
            |back| Side { surface: number, back, first, vertices: vertices.clone(), triangles: triangles.clone() };
        if matches!(surface.material.bsdf, Bsdf::Lambert { .. } | Bsdf::MetallicRoughness { .. }) {
            let emits = surface.material.emission != Vec3::ZERO;
            let count = triangles.len() as u32;
            let back = (emits && surface.material.double_sided) || reached(geometry, lights, first, count, true);
            if !back || emits || reached(geometry, lights, first, count, false) {
                sides.push(side(false));
            }
            if back {
                sides.push(side(true));
            }
        }
        first += triangles.len() as u32;
    }
    sides
}

/// Whether light comes to one side of these triangles straight from any virtual light.
fn reached(geometry: &Geometry, lights: &[Vpl], first: u32, count: u32, back: bool) -> bool {
    let radius = geometry.sphere().1;
    let tried = |i: u32| {
        let light = &lights[(i as usize * 104_729) % lights.len()];
        let triangle = first + (u64::from(i) * 7919 % u64::from(count)) as u32;
        let (root, other) = (radical_inverse(2, i).sqrt(), radical_inverse(3, i));
        let Some(point) = geometry.point(triangle, [root * (1.0 - other), root * other]) else { return false };
        let normal = if back { -point.normal } else { point.normal };
        let start = point.position + 1e-4 * radius * normal;
        let shining = light.normal.as_dvec3();
        let way = if light.kind == PARALLEL { 4.0 * radius * shining } else { light.position.as_dvec3() - start };
        let faces = light.is_lamp() || light.kind == PARALLEL || shining.dot(way) < 0.0;
        // Not as far as the surface that the light is on.
        faces && normal.dot(way) > 0.0 && !geometry.bvh.occluded(start.as_vec3(), way.as_vec3(), 0.9999)
    };
    !lights.is_empty() && count > 0 && (0..TRIES).any(tried)
}

/// The radiance that each texel sends out [W·sr⁻¹·m⁻²].
async fn gathered(
    gpu: &Gpu,
    world: &World,
    settings: &Settings,
    walk: &Walk,
    lights: &[Vpl],
    atlas: &Atlas,
    progress: &mut Progress<'_>,
) -> Result<Vec<Vec3>, RenderError> {
    // With the map in place of the film.
    let mut world = world.clone();
    world.scene.film.size = atlas.size;
    let resident = Resident::new(gpu, &world).await?;
    let film = film_texture(gpu, atlas.size, "light map").await?;
    let paths = settings.number("paths") as u32;
    let groups = walk::groups(paths, (settings.number("samples") as u32).min(paths));
    let (list, ranges) = grouped(lights, &groups, &walk.mirrors);
    check_size(gpu, list.len())?;
    let vpls = list.len() as u64;
    let mut gather = walk.gather(&resident, settings);
    let batches = batches(&ranges, per_round(gpu, &resident, walk, &list, &gather)?);
    gather.rounds = batches.len() as u32;
    gather.vpls = if list.is_empty() { vec![Vpl::BLACK] } else { list };
    let gathering = Gathering::by_rays(gpu, walk.geometry.bvh.textures(gpu).await?, &gather, &batches).await?;
    let places =
        gpu.table("places", atlas.size, wgpu::TextureFormat::Rgba32Uint, bytemuck::cast_slice(&atlas.places)).await?;
    let mut graph = Graph::new(gpu);
    let (tile, tile_side) = (graph.tile(), gpu.tile_side());
    let sums = gpu.scratch("sums", u64::from(tile_side).pow(2) * 16);
    gathering
        .read_by(graph.compute("bake", &BAKE), gpu, &walk.geometry)
        .world(&resident)
        .read("view", &resident.view)
        .read("tile", &tile)
        .read("places", &places)
        .write("sums", &sums)
        .write("film", &film)
        .over_film(gathering.rounds)
        .await?;
    let mut profiler = wgpu_profiler::GpuProfiler::new(&gpu.device, wgpu_profiler::GpuProfilerSettings::default())
        .map_err(|error| RenderError::Pass { pass: "profiler".into(), message: error.to_string() })?;
    // Tiles of many virtual lights are smaller, so that work can be broken off.
    let mut tiled = tile_side;
    while tiled > 16 && u64::from(tiled).pow(2) * vpls > u64::from(tile_side).pow(2) * 256 {
        tiled /= 2;
    }
    let tiles: Vec<_> = Tile::cover(atlas.size, tiled, 0).collect();
    for (done, &tile) in tiles.iter().enumerate() {
        graph.submit(tile, &mut profiler);
        gpu.wait()?;
        broken(progress, (done + 1) as f64 / tiles.len() as f64)?;
    }
    Ok(read_film(gpu, &film).await?.into_iter().map(Vec3::from).collect())
}

/// What no light reaches at all is inside something: such texels, up to two of them, take the mean of their neighbours, so that no
/// shadow shows beside what stands there.
fn fill(light: &mut [Vec3], atlas: &Atlas) {
    let [width, height] = atlas.size.map(|n| n as usize);
    for _ in 0..2 {
        let before = light.to_vec();
        for (texel, value) in
            light.iter_mut().enumerate().filter(|(i, _)| atlas.sides[*i] != 0 && before[*i] == Vec3::ZERO)
        {
            let (x, y) = (texel % width, texel / width);
            let (mut sum, mut count) = (Vec3::ZERO, 0.0);
            for v in y.saturating_sub(1)..(y + 2).min(height) {
                for u in x.saturating_sub(1)..(x + 2).min(width) {
                    let other = v * width + u;
                    if atlas.sides[other] == atlas.sides[texel] && before[other] != Vec3::ZERO {
                        sum += before[other];
                        count += 1.0;
                    }
                }
            }
            *value = if count > 0.0 { sum / count } else { Vec3::ZERO };
        }
    }
}

/// The surfaces of the result.
fn exported(world: &World, sides: &[Side], atlas: &Atlas, light: &[Vec3]) -> Vec<Exported> {
    let mut brightest = vec![0f32; sides.len() + 1];
    for (value, &side) in light.iter().zip(&atlas.sides) {
        brightest[side as usize] = brightest[side as usize].max(value.max_element());
    }
    let relative = light.iter().zip(&atlas.sides).map(|(value, &side)| {
        let most = brightest[side as usize];
        if side > 0 && most > 0.0 { *value / most } else { Vec3::ZERO }
    });
    // Charts are but texels apart.
    let map = Map { mips: false, ..Map::new(Texture::of_light(atlas.size, relative)) };
    let mut list: Vec<_> = world
        .surfaces
        .iter()
        .enumerate()
        .filter(|(number, _)| sides.iter().all(|side| side.surface != *number))
        .map(|(_, surface)| Exported { surface: surface.clone(), light_map_texcoords: Vec::new() })
        .collect();
    for (number, (side, mesh)) in sides.iter().zip(&atlas.meshes).enumerate() {
        let original = &world.surfaces[side.surface];
        let name = if side.back { format!("{}, back", original.name) } else { original.name.clone() };
        let turn = if side.back { -1.0 } else { 1.0 };
        let mut triangles = TriangleMesh::default();
        for vertex in &mesh.vertices {
            let from = &side.vertices[vertex.xref as usize];
            triangles.positions.push(from.position);
            triangles.normals.push((turn * from.normal).normalize_or(Vec3::Y));
            triangles.texcoords.push(Vec2::new(from.u, from.v));
        }
        triangles.triangles = mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        let material = Material {
            name: original.material.name.clone(),
            bsdf: Bsdf::Lambert { reflectance: Vec3::ZERO, map: None },
            emission: Vec3::splat(brightest[number + 1]),
            emission_map: Some(map.clone()),
            ..Material::default()
        };
        list.push(Exported {
            surface: Surface {
                name,
                mesh: Arc::new(triangles),
                world_from_object: Mat4::IDENTITY,
                material: Arc::new(material),
            },
            light_map_texcoords: mesh.vertices.iter().map(|vertex| Vec2::from(vertex.uv)).collect(),
        });
    }
    list.sort_by(|a, b| a.surface.name.cmp(&b.surface.name));
    list
}
