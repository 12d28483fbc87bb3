//! What a camera ray meets on its way to single scattering: the terms of its integral at points along it, with their
//! standard errors.

use std::ops::ControlFlow;

use glam::DVec3;
use rayon::prelude::*;
use tyndall_scene::World;

use crate::camera::Camera;
use crate::film::Pixel;
use crate::{Random, ReferenceError, Tracer};

/// A mean and its standard error, by channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean of the samples.
    pub mean: [f64; 3],
    /// Its standard error, from the samples' variance.
    pub error: [f64; 3],
}

/// The ray's terms at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// From the eye [m].
    pub distance: f64,
    /// Mean extinction of the cell about `distance` [m⁻¹].
    pub extinction: Estimate,
    /// The share of light that comes from here to the eye, T.
    pub transmittance: Estimate,
    /// Mean light that the cell emits and scatters once to the eye [W·sr⁻¹·m⁻³].
    pub source: Estimate,
    /// Of the ray up to here, L = ∫ T·source dt [W·sr⁻¹·m⁻²], without what is behind.
    pub radiance: Estimate,
}

/// Where the ray through the middle of a pixel enters the first box of a medium and leaves the last [m]; `None` where it
/// misses them all.
///
/// # Errors
/// [`ReferenceError::Camera`].
pub fn span(world: &World, pixel: [u32; 2]) -> Result<Option<[f64; 2]>, ReferenceError> {
    let (origin, direction) = through(world, pixel)?;
    let within = world.volumes.iter().filter_map(|volume| {
        let unit_from_world = volume.world_from_unit.as_dmat4().inverse();
        let inverse = unit_from_world.transform_vector3(direction).recip();
        let [a, b] = [0.0, 1.0].map(|face| (face - unit_from_world.transform_point3(origin)) * inverse);
        let (near, far) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
        (near < far).then_some([near, far])
    });
    Ok(within.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]))
}

/// Estimates the terms of single scattering along the ray through the middle of a pixel, from its top left: at `count`
/// points, each in the middle of one of as many equal cells of `span` [m].
///
/// A sample takes a random point in every cell, where the extinction is known, and the source and the transmittance to the
/// eye are estimated each for itself. Their products up to a distance are the sample's radiance there: without bias,
/// and with an error that says what the samples of the whole ray say.
///
/// `None` where `watch`, told the finished fraction after each sample, broke off.
///
/// # Errors
/// A world that cannot be traced.
pub fn probe(
    world: &World,
    pixel: [u32; 2],
    span: [f64; 2],
    count: u32,
    samples: u32,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Option<Vec<Point>>, ReferenceError> {
    let (origin, direction) = through(world, pixel)?;
    let tracer = Tracer::new(world)?;
    let cell = (span[1] - span[0]) / f64::from(count);
    let mut statistics = vec![[Pixel::default(); 4]; count as usize];
    for sample in 0..samples {
        let draw = |i: u32| {
            let mut rng = Random::new(0, i.into(), sample.into());
            let way = |part: f64| span[0] + (f64::from(i) + part) * cell;
            let part = rng.uniform();
            let point = origin + direction * way(part);
            let source = tracer.source(point, direction, &mut rng);
            let share = tracer.transmittance(origin, direction, way(part), &mut rng);
            let transmittance = tracer.transmittance(origin, direction, way(0.5), &mut rng);
            (part, tracer.extinction(point), transmittance, source, share * source * cell)
        };
        let drawn: Vec<_> = (0..count).into_par_iter().map(draw).collect();
        let mut radiance = DVec3::ZERO;
        for ((part, extinction, transmittance, source, light), of_cell) in drawn.into_iter().zip(&mut statistics) {
            // The cell's point counts where it lies before the middle: half of the time.
            let here = if part < 0.5 { radiance + light } else { radiance };
            radiance += light;
            for (term, value) in of_cell.iter_mut().zip([extinction, transmittance, source, here]) {
                term.add(value);
            }
        }
        if watch(f64::from(sample + 1) / f64::from(samples)).is_break() {
            return Ok(None);
        }
    }
    let points = statistics.iter().enumerate().map(|(i, terms)| {
        let [extinction, transmittance, source, radiance] = terms.map(|term| {
            let [mean, error] = term.estimate().map(|value| value.to_array());
            Estimate { mean, error }
        });
        Point { distance: span[0] + (i as f64 + 0.5) * cell, extinction, transmittance, source, radiance }
    });
    Ok(Some(points.collect()))
}

/// The ray through the middle of a pixel.
fn through(world: &World, pixel: [u32; 2]) -> Result<(DVec3, DVec3), ReferenceError> {
    let [u, v] = pixel.map(|i| f64::from(i) + 0.5);
    Ok(Camera::new(&world.scene)?.through(u, v))
}
