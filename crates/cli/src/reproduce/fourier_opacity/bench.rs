//! Scenes on the device, at the sizes that were asked for.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use tyndall::Gpu;
use tyndall_scene::assets::Embedded;
use tyndall_scene::image::Image;
use tyndall_scene::{Document, World};

use crate::failure::Failure;
use crate::input::memory_budget;
use crate::interrupt::Interrupt;

/// The device, and how much it is given to do.
pub struct Bench {
    pub gpu: Gpu,
    pub interrupt: Interrupt,
    /// Films as a share of the paper's, a side.
    pub film: f64,
    /// Maps and bodies, likewise.
    pub share: f64,
}

/// A picture, and what its passes took.
pub struct Shot {
    pub image: Image,
    /// Of the maps [ms]; NaN on a device without timestamps.
    pub maps: f64,
    /// Of all else [ms].
    pub scene: f64,
}

const VOLUME: &[u8] = include_bytes!("../../../../../scenes/smoke.vdb");

impl Bench {
    /// The pixels of a film of the paper's.
    pub fn film(&self, size: [u32; 2]) -> [u32; 2] {
        size.map(|side| ((f64::from(side) * self.film).round() as u32).max(16))
    }

    /// The pixels a side of a square picture to look at.
    pub fn picture(&self) -> [u32; 2] {
        [((512.0 * self.film.sqrt() * self.share.sqrt()) as u32).max(16); 2]
    }

    /// The texels a side of one of its maps.
    pub fn map(&self, side: u32) -> u32 {
        ((f64::from(side) * self.share) as u32).max(16)
    }

    /// How many bodies of so many.
    pub fn bodies(&self, number: u32) -> u32 {
        ((f64::from(number) * self.share) as u32).max(64)
    }

    /// A picture with these settings on top of the scene's.
    pub fn render(&self, world: &World, film: [u32; 2], settings: &[(&str, String)]) -> Result<Shot, Failure> {
        let mut world = world.clone();
        world.scene.film.size = film;
        for (path, value) in settings {
            let set = world.scene.set(path, value);
            set.map_err(|error| Failure::Failed(anyhow::anyhow!("{path} = {value}: {error}")))?;
        }
        let rendering = pollster::block_on(tyndall::render(&self.gpu, &world, &mut |_| self.go_on()))?;
        let sum = |maps: bool| {
            let passes: &BTreeMap<String, f64> = &rendering.passes;
            let of = passes.iter().filter(|(name, _)| name.starts_with("transmittance.") == maps);
            if passes.is_empty() { f64::NAN } else { 1e3 * of.map(|(_, seconds)| seconds).sum::<f64>() }
        };
        Ok(Shot { maps: sum(true), scene: sum(false), image: rendering.image })
    }

    /// As [`render`](Self::render), with times that are medians of three turns; of one where little is asked for.
    pub fn timed(&self, world: &World, film: [u32; 2], settings: &[(&str, String)]) -> Result<Shot, Failure> {
        let turns = if self.share < 1.0 { 1 } else { 3 };
        let mut shots = (0..turns).map(|_| self.render(world, film, settings)).collect::<Result<Vec<_>, _>>()?;
        let median = |time: fn(&Shot) -> f64| {
            let mut times: Vec<_> = shots.iter().map(time).collect();
            times.sort_by(f64::total_cmp);
            times[times.len() / 2]
        };
        let (maps, scene) = (median(|shot| shot.maps), median(|shot| shot.scene));
        Ok(Shot { maps, scene, ..shots.swap_remove(0) })
    }

    fn go_on(&self) -> ControlFlow<()> {
        if self.interrupt.pressed() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// A scene from its text, with settings on top.
pub fn world(name: &str, text: &str, settings: &[(&str, String)]) -> Result<World, Failure> {
    let document = Document::new(name, text);
    let mut scene = document.parse()?;
    for (path, value) in settings {
        let set = scene.set(path, value);
        set.map_err(|error| Failure::Failed(anyhow::anyhow!("{name}: {path} = {value}: {error}")))?;
    }
    let assets = Embedded(vec![("smoke.vdb", VOLUME)]);
    World::load(scene, &assets, memory_budget()).map_err(|error| Failure::from(error.locate(&document)))
}

/// Settings of the maps.
pub fn maps(basis: &str, coefficients: usize, resolution: u32) -> Vec<(&'static str, String)> {
    vec![
        ("techniques.transmittance.basis", basis.into()),
        ("techniques.transmittance.coefficients", coefficients.to_string()),
        ("techniques.transmittance.resolution", resolution.to_string()),
    ]
}
