//! Pictures: passes of one sample a pixel, until there are enough.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use tyndall_scene::World;
use tyndall_scene::image::Image;

use crate::camera::Camera;
use crate::film::{Film, Pixel};
use crate::{Random, ReferenceError, Tracer};

/// What is rendered, and when it is enough. Without `samples` and `error` only the callback of [`render`] ends it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The most scatterings of a path, by surfaces and media alike; `None` for any number. 0: emission, absorption and what is
    /// behind; 1: direct light and single scattering.
    pub depth: Option<u32>,
    /// Whether light counts that comes from where it is made, a surface or the environment, by way of mirrors and glass alone to
    /// where it is first seen to be scattered diffusely (by a medium, or a surface that is neither mirror nor glass). What it lights
    /// from there always counts, and so does what the eye sees in mirrors and through glass. Lamps, which have no size, never have
    /// caustics: no path finds them.
    pub caustics: bool,
    /// Stop when every pixel has this many samples, those of a previous image included.
    pub samples: Option<u32>,
    /// Stop at this relative standard error, as [`Progress::relative_error`] defines it, but not before every pixel has
    /// [`LEAST_SAMPLES`].
    pub error: Option<f64>,
    /// Pictures of different seeds are independent of each other.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { depth: None, caustics: true, samples: None, error: None, seed: 0 }
    }
}

/// Samples a pixel needs before its variance is believed.
pub const LEAST_SAMPLES: u32 = 16;

/// How a rendering goes.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Samples that every pixel has, those of a previous image included.
    pub samples: u32,
    /// √(Σ variance/n / Σ mean²) over all pixels and channels at the last whole pass; infinite before there is one of
    /// at least two samples.
    pub relative_error: f64,
    /// Camera paths traced since the start of this rendering.
    pub paths: u64,
    /// Of this rendering [s⁻¹].
    pub paths_per_second: f64,
    /// Time since the start of this rendering.
    pub elapsed: Duration,
    /// Share of the work that is done, from 0 to 1, where the options have an end.
    pub done: Option<f64>,
    /// Time that is left, where the options have an end and the speed is known.
    pub eta: Option<Duration>,
}

/// Renders a world's picture, as a new one or as the continuation of `previous` (of the same world, depth, caustics and seed).
///
/// The picture depends on world, depth, caustics, seed and number of samples alone: not on threads, nor on interruptions but for
/// rounding. It runs on rayon's current pool and calls `watch` on the calling thread about twenty times a second. Where
/// `watch` breaks, the picture so far is returned, with every sample taken: some pixels may then have one sample more
/// than others, and a continuation begins with those.
///
/// # Errors
/// A world that cannot be traced, and a previous image that does not fit.
pub fn render(
    world: &World,
    options: &Options,
    previous: Option<Image>,
    watch: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Image, ReferenceError> {
    let camera = Camera::new(&world.scene)?;
    let mut film = Film::new(world.scene.film.size, previous)?;
    let mut tracer = Tracer::new(world)?;
    if !options.caustics {
        tracer = tracer.without_caustics();
    }
    let mut clock = Clock::new(&film);
    loop {
        let pass = film.passes();
        clock.relative_error = film.relative_error();
        let progress = clock.progress(options, pass, 0.0);
        if watch(&progress).is_break() || options.reached(&progress) || pass == u32::MAX {
            return Ok(film.into_image());
        }
        let (width, total) = (film.width, film.pixels.len());
        let mut start = 0;
        while start < total {
            let end = (start + clock.batch).min(total);
            let begun = Instant::now();
            let traced = trace(&tracer, &camera, width, options, pass, start, &mut film.pixels[start..end]);
            clock.count(end - start, traced, begun.elapsed());
            start = end;
            let share = start as f64 / total as f64;
            if start < total && watch(&clock.progress(options, pass, share)).is_break() {
                return Ok(film.into_image());
            }
        }
    }
}

/// One sample for each of a run of pixels that does not have it yet; their number.
fn trace(
    tracer: &Tracer,
    camera: &Camera,
    width: u32,
    options: &Options,
    pass: u32,
    start: usize,
    pixels: &mut [Pixel],
) -> u64 {
    /// Pixels that a thread takes at a time.
    const CHUNK: usize = 32;
    let chunks = pixels.par_chunks_mut(CHUNK).enumerate();
    let traced = chunks.map(|(chunk, pixels)| {
        let mut traced = 0;
        for (i, pixel) in pixels.iter_mut().enumerate().filter(|(_, pixel)| pixel.samples == pass) {
            let index = (start + chunk * CHUNK + i) as u64;
            let mut rng = Random::new(options.seed, index, pass.into());
            let [x, y] = [index % u64::from(width), index / u64::from(width)].map(|i| i as u32);
            let (origin, direction) = camera.ray(x, y, &mut rng);
            pixel.add(tracer.radiance(origin, direction, options.depth, &mut rng));
            traced += 1;
        }
        traced
    });
    traced.sum()
}

impl Options {
    fn reached(&self, progress: &Progress) -> bool {
        self.samples.is_some_and(|samples| progress.samples >= samples)
            || self.error.is_some_and(|error| progress.samples >= LEAST_SAMPLES && progress.relative_error <= error)
    }

    /// Samples a pixel that will be enough, as far as can be told.
    fn goal(&self, progress: &Progress) -> Option<f64> {
        let for_error = self.error.filter(|_| progress.relative_error.is_finite()).map(|error| {
            let factor = progress.relative_error / error;
            (f64::from(progress.samples) * factor * factor).max(LEAST_SAMPLES.into())
        });
        let for_samples = self.samples.map(f64::from);
        match (for_samples, for_error) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }
}

/// Measures the speed, and from it how many pixels to trace between two calls of the callback.
struct Clock {
    started: Instant,
    first: u32,
    batch: usize,
    paths: u64,
    relative_error: f64,
}

impl Clock {
    /// Time between two calls of the callback [s].
    const INTERVAL: f64 = 0.05;

    fn new(film: &Film) -> Self {
        let (first, relative_error) = (film.passes(), f64::INFINITY);
        Self { started: Instant::now(), first, batch: 256, paths: 0, relative_error }
    }

    fn count(&mut self, pixels: usize, paths: u64, time: Duration) {
        self.paths += paths;
        let factor = (Self::INTERVAL / time.as_secs_f64().max(1e-9)).clamp(0.25, 4.0);
        self.batch = ((pixels as f64 * factor) as usize).clamp(32, 1 << 24);
    }

    /// The state after a share of a pass.
    fn progress(&self, options: &Options, pass: u32, share: f64) -> Progress {
        let elapsed = self.started.elapsed();
        let mut progress = Progress {
            samples: pass,
            relative_error: self.relative_error,
            paths: self.paths,
            paths_per_second: self.paths as f64 / elapsed.as_secs_f64().max(1e-9),
            elapsed,
            done: None,
            eta: None,
        };
        if let Some(goal) = options.goal(&progress) {
            let done = f64::from(pass) + share;
            let since = done - f64::from(self.first);
            progress.done = Some((done / goal.max(1.0)).min(1.0));
            let left = (goal - done).max(0.0) / since * elapsed.as_secs_f64();
            progress.eta = Duration::try_from_secs_f64(left).ok();
        }
        progress
    }
}
