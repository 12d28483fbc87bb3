//! Tables 1 and 2: milliseconds of the maps and of the scene.

use serde_json::json;

use super::bench::{Bench, maps};
use super::pictures::plume;
use crate::failure::Failure;
use crate::reproduce::page::Page;

/// The paper's milliseconds on a GeForce GTX 260 at 1024, 512 and 256 texels a side: the map, then the scene, of Fourier's
/// coefficients and of slices.
type Published = [[f64; 3]; 4];

const TABLES: [(&str, [u32; 2], Published); 2] = [
    ("table_1", [1680, 1050], [[15.5, 4.3, 1.7], [14.0, 12.3, 11.7], [10.1, 3.0, 1.5], [13.3, 12.2, 11.7]]),
    ("table_2", [1280, 800], [[15.9, 4.2, 1.6], [10.1, 7.4, 7.3], [11.1, 2.8, 1.5], [9.9, 7.3, 7.3]]),
];

/// Times of the plume of particles, with seven numbers of Fourier's and seven slices.
pub fn tables(bench: &Bench, page: &mut Page) -> Result<(), Failure> {
    let world = plume(bench, "")?;
    for (number, (key, size, published)) in TABLES.into_iter().enumerate() {
        let film = bench.film(size);
        page.section(
            &format!("Table {}", number + 1),
            &format!(
                "Milliseconds, medians of three turns, with seven coefficients (FOM) and seven slices (OSM), {} particles, maps of 1024, 512 and 256 texels a \
                 side (here {:?}), on a film of {} x {} (the paper's: {} x {}), on {}. The paper's are of a GeForce GTX 260. Map: the \
                 passes that make it; scene: all others.",
                bench.bodies(16384),
                [1024, 512, 256].map(|side| bench.map(side)),
                film[0],
                film[1],
                size[0],
                size[1],
                bench.gpu.name(),
            ),
        );
        let mut rows = Vec::new();
        for (b, (basis, name)) in [("fourier", "FOM"), ("slices", "OSM")].into_iter().enumerate() {
            for (s, side) in [1024, 512, 256].into_iter().enumerate() {
                let shot = bench.timed(&world, film, &maps(basis, 7, bench.map(side)))?;
                rows.push(vec![
                    json!(name),
                    json!(bench.map(side)),
                    json!(shot.maps),
                    json!(published[2 * b][s]),
                    json!(shot.scene),
                    json!(published[2 * b + 1][s]),
                ]);
            }
        }
        let columns = ["", "texels a side", "map [ms]", "paper: map [ms]", "scene [ms]", "paper: scene [ms]"];
        page.table(key, &columns, &rows);
    }
    Ok(())
}
