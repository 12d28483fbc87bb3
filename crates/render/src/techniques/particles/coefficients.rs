//! Bodies without an order: the absorbance along each camera ray, in coefficients, says what hides what.

use super::Shared;
use crate::graph::{Graph, Shader, shader};
use crate::resident::Transmittance;
use crate::{RenderError, layers};

static DEPOSIT: Shader = shader!("techniques/particles/deposit");
static UNSORTED: Shader = shader!("techniques/particles/unsorted");
static RESOLVE: Shader = shader!("techniques/particles/resolve");

/// Records the passes that draw bodies with so many numbers a pixel, by way of `target`, and fill the film.
pub(super) async fn record(
    graph: &mut Graph<'_>,
    shared: &Shared<'_>,
    coefficients: u32,
    target: &wgpu::Texture,
    film: &wgpu::Texture,
) -> Result<(), RenderError> {
    let (gpu, resident) = (graph.gpu(), shared.resident);
    // A constant and pairs; the first number of the first set is left out.
    let count = 2 * ((coefficients - 1) / 2) + 1;
    let sets = (count + 1).div_ceil(4);
    // The world, with the numbers of camera rays in place of those of light rays.
    let mut world = resident.clone();
    world.transmittance = Transmittance { basis: 0, count, sets, ..world.transmittance };
    let mut numbers = Vec::new();
    for _ in 0..sets {
        numbers.push(layers::texture(gpu, resident.film).await?);
    }
    for (set, texture) in numbers.iter().enumerate() {
        let declared = graph.raster("particles.deposit", &DEPOSIT).constant("SET", set as u32).world(&world);
        shared.on(declared).draw(shared.all(texture, layers::SUM)).await?;
    }
    let declared = graph.raster("particles", &UNSORTED).world(&world);
    let names = ["numbers0", "numbers1", "numbers2", "numbers3"];
    let declared = names
        .into_iter()
        .enumerate()
        .fold(declared, |declared, (set, name)| declared.read(name, numbers.get(set).unwrap_or(&numbers[0])));
    shared.on(declared).draw(shared.all(target, layers::SUM)).await?;
    let tile = graph.tile();
    graph
        .compute("particles.resolve", &RESOLVE)
        .constant("BEHIND", shared.behind.is_some())
        .world(resident)
        .read("view", &resident.view)
        .read("tile", &tile)
        .read("layers", target)
        .read("numbers0", &numbers[0])
        .read("behind", shared.behind.unwrap_or(target))
        .write("film", film)
        .over_film(1)
        .await
}
