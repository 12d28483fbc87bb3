//! Keller, Instant Radiosity, 1997: the sequence of pictures, the error by kind of points, how many images, and their time.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use glam::{Mat4, Vec3};
use serde_json::{Value, json};
use tyndall::Gpu;
use tyndall::techniques::instant_radiosity::{self, Walkthrough, walk};
use tyndall_plot::{Axes, Line, curves, log_log, slope};
use tyndall_scene::assets::Embedded;
use tyndall_scene::image::{Image, Picture, tonemap};
use tyndall_scene::parameter;
use tyndall_scene::{Document, World, metrics};

use super::Experiment;
use super::page::Page;
use crate::failure::Failure;
use crate::input::memory_budget;
use crate::interrupt::Interrupt;
use crate::say;

const SCENE: &str = include_str!("../../../../../scenes/cornell.toml");

const EXPERIMENTS: [Experiment<Bench>; 4] = [
    ("the sequence", sequence),
    ("figure 6: error by kind of points", points),
    ("how many images", images),
    ("walking through", walk_through),
];

/// Runs all experiments.
pub fn page(gpu: Gpu, interrupt: Interrupt, folder: &Path) -> Result<(), Failure> {
    let bench = Bench { gpu, interrupt };
    super::page("Instant radiosity", &EXPERIMENTS, &bench, &bench.interrupt, folder)
}

struct Bench {
    gpu: Gpu,
    interrupt: Interrupt,
}

impl Bench {
    /// A picture of the Cornell box of so many pixels a side, and the seconds that it took.
    fn render(&self, side: u32, settings: &[(&str, Value)]) -> Result<(Image, f64), Failure> {
        self.picture(&cornell(side, settings)?)
    }

    /// A world's picture, and the seconds that it took.
    fn picture(&self, world: &World) -> Result<(Image, f64), Failure> {
        let begun = Instant::now();
        let rendering = pollster::block_on(tyndall::render(&self.gpu, world, &mut |_| {
            if self.interrupt.pressed() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }))?;
        Ok((rendering.image, begun.elapsed().as_secs_f64()))
    }
}

/// The Cornell box with settings of instant radiosity.
fn cornell(side: u32, settings: &[(&str, Value)]) -> Result<World, Failure> {
    let document = Document::new("cornell.toml (embedded)", SCENE);
    let mut scene = document.parse()?;
    scene.film.size = [side; 2];
    let value = |value: &Value| match value {
        Value::String(word) => parameter::Value::Choice(word.clone()),
        other => parameter::Value::Number(other.as_f64().unwrap_or_default()),
    };
    let settings: BTreeMap<_, _> = settings.iter().map(|(name, of)| ((*name).to_owned(), value(of))).collect();
    scene.techniques = BTreeMap::from([(instant_radiosity::TECHNIQUE.name.to_owned(), settings)]);
    World::load(scene, &Embedded::default(), memory_budget()).map_err(|error| Failure::from(error.locate(&document)))
}

/// Pictures of more and more paths, against the reference; and the time that a virtual light takes.
fn sequence(bench: &Bench, page: &mut Page) -> Result<(), Failure> {
    const SIDE: u32 = 128;
    say::note("the reference's picture");
    let options = tyndall_reference::Options { samples: Some(256), ..Default::default() };
    let truth = tyndall_reference::render(&cornell(SIDE, &[])?, &options, None, &mut |_| {
        if bench.interrupt.pressed() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    page.section(
        "The sequence",
        &format!(
            "The Cornell box, {SIDE} x {SIDE}, with N = 1, 10, 64, 256 paths, and by the reference (256 samples a pixel). M is how many \
             virtual lights that are. The error is the relative RMSE without the reference's noise. Rendered on {}.",
            bench.gpu.name()
        ),
    );
    let (mut rows, mut times) = (Vec::new(), Vec::new());
    for paths in [1u32, 10, 64, 256] {
        say::note(&format!("{paths} paths"));
        let settings = [("paths", json!(paths)), ("walks", json!(1))];
        let lights = instant_radiosity::count(&cornell(SIDE, &settings)?)?;
        let (image, seconds) = bench.render(SIDE, &settings)?;
        page.picture(
            &format!("cornell-{paths}"),
            &format!("N = {paths}, M = {lights}"),
            &tonemap::display(&image, 0.0),
        )?;
        let [a, b] = [image, truth.clone()].map(Picture::Linear);
        let linear = metrics::compare(&a, &b, &Default::default())?.linear;
        let error = linear.and_then(|linear| linear.relative_bias).unwrap_or(f64::NAN);
        let each = 1e3 * seconds / f64::from(lights);
        rows.push(vec![json!(paths), json!(lights), json!(error), json!(seconds), json!(each)]);
        times.push((f64::from(lights), seconds));
    }
    page.picture("cornell-reference", "the reference", &tonemap::display(&truth, 0.0))?;
    page.table("sequence", &["N", "M", "relative error", "time [s]", "time per virtual light [ms]"], &rows);
    let lines = [Line { name: "time".into(), points: times }];
    page.plot(&log_log("Time", "M, virtual lights", "time [s]", &lines).map_err(Failure::Failed)?);
    Ok(())
}

/// Figure 6: the error against N, by kind of points, of direct light alone.
fn points(bench: &Bench, page: &mut Page) -> Result<(), Failure> {
    const SIDE: u32 = 48;
    const SEEDS: u32 = 4;
    let settings = |kind: &str, paths: u32, seed: u32| {
        [
            ("sequence", json!(kind)),
            ("paths", json!(paths)),
            ("walks", json!(1)),
            ("samples", json!(1)),
            ("seed", json!(seed)),
            ("bounces", json!(0)),
            ("clamp", json!(0)),
        ]
    };
    page.section(
        "Error by kind of points",
        &format!(
            "Soft shadows of the Cornell box, {SIDE} x {SIDE}, direct light alone, against 640 samples (jittered Hammersley of another \
             seed). One camera ray a pixel, the same for all, so that nothing but the points on the light differs; the paper \
             also moves it. RMS over {SEEDS} seeds, relative to a picture in which the lamp is seen. The slope is of the \
             least-squares line in logarithms, with its standard error; random points are expected to have -1/2."
        ),
    );
    let (truth, _) = bench.render(SIDE, &settings("hammersley", 640, 1))?;
    let (mut lines, mut rows) = (Vec::new(), Vec::new());
    for (kind, name) in [
        ("random", "random"),
        ("rooks", "N-rooks"),
        ("halton", "Halton"),
        ("jittered", "jittered Halton"),
        ("hammersley", "jittered Hammersley"),
    ] {
        say::note(name);
        let mut line = Line { name: name.into(), points: Vec::new() };
        for paths in [1u32, 2, 4, 8, 16, 32, 64] {
            let mut squared = 0.0;
            for seed in 2..2 + SEEDS {
                let (image, _) = bench.render(SIDE, &settings(kind, paths, seed))?;
                squared += metrics::linear::linear_errors(&image, &truth).relative_rmse.powi(2) / f64::from(SEEDS);
            }
            line.points.push((f64::from(paths), squared.sqrt()));
        }
        let (fitted, error) = slope(&line.points);
        let last = line.points.last().map_or(f64::NAN, |point| point.1);
        rows.push(vec![json!(name), json!(last), json!(fitted), json!(error)]);
        lines.push(line);
    }
    page.table("points", &["points", "relative RMS error at N = 64", "slope", "standard error"], &rows);
    page.plot(&log_log("Error by kind of points", "N", "relative RMS error", &lines).map_err(Failure::Failed)?);
    Ok(())
}

/// How many images there are: M against N and the mean reflectivity.
fn images(_: &Bench, page: &mut Page) -> Result<(), Failure> {
    page.section(
        "Images",
        "M, the sum of the survivors of all reflections, against N and the mean reflectivity r: less than N/(1 - r).",
    );
    let counts = [1u32, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
    let (mut lines, mut rows) = (Vec::new(), Vec::new());
    for reflectivity in [0.2, 0.5, 0.7, 0.9] {
        let of = |paths: u32| walk::survivors(paths, reflectivity, u32::MAX).iter().sum::<u32>();
        let points = counts.iter().map(|&n| (f64::from(n), f64::from(of(n)))).collect();
        lines.push(Line { name: format!("r = {reflectivity}"), points });
        for paths in [10u32, 64, 128, 256] {
            let bound = f64::from(paths) / (1.0 - reflectivity);
            rows.push(vec![json!(reflectivity), json!(paths), json!(of(paths)), json!(bound)]);
        }
    }
    page.table("images", &["r", "N", "M", "N/(1 - r)"], &rows);
    page.plot(&log_log("Images", "N, paths", "M, images", &lines).map_err(Failure::Failed)?);
    Ok(())
}

/// A camera and a block that move: what a frame costs, how much it differs from the one before, and how wrong it is.
fn walk_through(bench: &Bench, page: &mut Page) -> Result<(), Failure> {
    const SIDE: u32 = 96;
    const FRAMES: u32 = 120;
    const PATHS: u32 = 32;
    const BLOCK: &str = "short_block";
    let mut world = cornell(SIDE, &[("paths", json!(PATHS)), ("samples", json!(PATHS)), ("walks", json!(1))])?;
    let start = world.scene.camera.position.x;
    let block = |world: &mut World, shift: Vec3| {
        let mut found = world.surfaces.iter_mut().filter(|surface| surface.name == BLOCK);
        found.next().map(|surface| {
            surface.world_from_object = Mat4::from_translation(shift) * surface.world_from_object;
            surface.world_from_object
        })
    };
    page.section(
        "Walking through",
        &format!(
            "The Cornell box, {SIDE} x {SIDE}, {PATHS} paths, {FRAMES} frames: camera and short block go 12 cm to the left, \
             and the block as far up. A frame renders one path, which takes the place of the oldest. Changes from frame to frame and errors against the \
             converged picture of the same moment, with as many paths, are relative RMS."
        ),
    );
    let mut walkthrough = pollster::block_on(Walkthrough::new(&bench.gpu, &world))?;
    let (mut changes, mut errors) = (Vec::new(), Vec::new());
    let (mut seconds, mut whole, mut lights) = (Vec::new(), Vec::new(), 0);
    let mut before: Option<Image> = None;
    for frame in 0..FRAMES {
        if bench.interrupt.pressed() {
            return Err(Failure::Interrupted);
        }
        let progress = f64::from(frame) / f64::from(FRAMES);
        world.scene.camera.position.x = start + 0.12 * progress as f32;
        let place = block(&mut world, Vec3::new(0.001, 0.001, 0.0));
        walkthrough.set_camera(&world.scene.camera);
        if let Some(place) = place {
            walkthrough.set_transform(BLOCK, place)?;
        }
        let begun = Instant::now();
        lights = lights.max(walkthrough.render());
        let image = pollster::block_on(walkthrough.image())?;
        seconds.push(begun.elapsed().as_secs_f64());
        if let Some(before) = before {
            changes.push((progress, metrics::linear::linear_errors(&image, &before).relative_rmse));
        }
        if frame % 8 == 7 {
            let (converged, taken) = bench.picture(&world)?;
            errors.push((progress, metrics::linear::linear_errors(&image, &converged).relative_rmse));
            whole.push(taken);
        }
        before = Some(image);
    }
    page.picture("walkthrough", "the last frame", &tonemap::display(&before.unwrap_or_default(), 0.0))?;
    let filled = f64::from(PATHS) / f64::from(FRAMES);
    let most = |points: &[(f64, f64)]| {
        points.iter().filter(|point| point.0 >= filled).fold(0f64, |most, point| most.max(point.1))
    };
    let median = |mut list: Vec<f64>| {
        list.sort_by(f64::total_cmp);
        list.get(list.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let (largest, worst) = (most(&changes), most(&errors));
    page.table(
        "walkthrough",
        &[
            "paths",
            "virtual lights of a frame, at most",
            "a frame [s]",
            "the slowest [s]",
            "a whole picture [s]",
            "largest change with all paths",
            "largest error with all paths",
        ],
        &[vec![
            json!(PATHS),
            json!(lights),
            json!(median(seconds.clone())),
            json!(seconds.iter().copied().fold(0.0, f64::max)),
            json!(median(whole)),
            json!(largest),
            json!(worst),
        ]],
    );
    let axes = Axes { title: "Walking through", x: "frames / 120", y: "relative RMS", top: 4.0 * worst.max(largest) };
    let named = |name: &str, points| Line { name: name.into(), points };
    let lines = [named("error against the converged frame", errors), named("change from the frame before", changes)];
    page.plot(&curves(&axes, &lines).map_err(Failure::Failed)?);
    Ok(())
}
