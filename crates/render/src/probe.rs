//! What the marcher meets along one ray: the march of one pixel, broken off at ever greater distances.

use std::ops::ControlFlow;

use glam::{Vec2, Vec3};
use tyndall_scene::parameter::{Settings, Value};
use tyndall_scene::{Field, FieldError, World};

use crate::frame::Frame;
use crate::renderer::read_film;
use crate::resident::{Resident, View};
use crate::techniques::march;
use crate::{Gpu, RenderError};

/// The marcher's state at a distance along a ray, and its coefficients around it; by channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// From the eye [m].
    pub distance: f64,
    /// Mean extinction of the cell about `distance` [m⁻¹]: −Δ ln T / Δt. Where nothing comes through, it is not known: NaN.
    pub extinction: [f64; 3],
    /// The share of light that comes from here to the eye, T.
    pub transmittance: [f64; 3],
    /// Mean light that the cell emits and scatters to the eye [W·sr⁻¹·m⁻³]: ΔL / ∫T dt. NaN as for `extinction`.
    pub source: [f64; 3],
    /// Of the ray up to here, L = ∫ T·source dt [W·sr⁻¹·m⁻²], without what is behind.
    pub radiance: [f64; 3],
}

/// Probes the marcher along the ray through the middle of a pixel, from its top left: `count` samples, each in the middle
/// of one of as many equal cells of `span` [m].
///
/// It marches as the scene's settings say, but one ray without jitter. Its own segments stay as they are, so that the
/// samples show what a picture is made of; the source is what its `model` has of it.
///
/// # Errors
/// What [`render`](crate::render) reports, and a world that the marcher does not render or the scene has not for it.
pub async fn probe(
    gpu: &Gpu,
    world: &World,
    pixel: [u32; 2],
    span: [f64; 2],
    count: u32,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Vec<Sample>, RenderError> {
    check(world)?;
    let cell = (span[1] - span[0]) / f64::from(count);
    // Twice as many points: the ends of the cells and their middles.
    let reach = Vec2::new(span[0] as f32, (0.5 * cell) as f32);
    let points = 2 * count + 1;
    let radiance = row(gpu, world, pixel, reach, points, None, &mut |done| progress(0.5 * done)).await?;
    // Before an environment of 1 seen through absorption alone, radiance is transmittance.
    let absorption = Some("absorption");
    let transmittance =
        row(gpu, world, pixel, reach, points, absorption, &mut |done| progress(0.5 + 0.5 * done)).await?;
    let cells = radiance.windows(3).zip(transmittance.windows(3)).step_by(2).enumerate();
    let samples = cells.map(|(i, (radiance, transmittance))| {
        let channels = std::array::from_fn(|c| {
            let [before, _, after] = [0, 1, 2].map(|k| f64::from(transmittance[k][c]));
            let gained = f64::from(radiance[2][c]) - f64::from(radiance[0][c]);
            coefficients(before, after, gained, cell)
        });
        Sample {
            distance: span[0] + (i as f64 + 0.5) * cell,
            extinction: channels.map(|(extinction, _): (f64, f64)| extinction),
            transmittance: transmittance[1].map(f64::from),
            source: channels.map(|(_, source)| source),
            radiance: radiance[1].map(f64::from),
        }
    });
    Ok(samples.collect())
}

/// Extinction and source of a cell in which both are constant, from the transmittance at its ends and the radiance it adds:
/// ∫T dt = (T₀ − T₁)/σ_t over the cell.
fn coefficients(before: f64, after: f64, gained: f64, length: f64) -> (f64, f64) {
    if after <= 0.0 {
        return (f64::NAN, f64::NAN);
    }
    let depth = (before / after).ln();
    let mean = if depth.abs() < 1e-4 { 0.5 * (before + after) } else { (before - after) / depth };
    (depth / length, gained / (mean * length))
}

/// The film of a row of pixels that all look along the ray of `pixel`, each as far as `reach` says: without what is behind,
/// or, of a model named here, before an environment of 1.
async fn row(
    gpu: &Gpu,
    world: &World,
    pixel: [u32; 2],
    reach: Vec2,
    points: u32,
    model: Option<&str>,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Vec<[f32; 3]>, RenderError> {
    let environment = if model.is_some() { Vec3::ONE } else { Vec3::ZERO };
    let view = View::new(&world.scene.camera, world.scene.film.size, environment, 0.0);
    let mut world = world.clone();
    world.scene.film.size = [points, 1];
    let given = world.scene.techniques.entry(march::TECHNIQUE.name.into()).or_default();
    given.extend([("samples".into(), Value::Number(1.0))]);
    let words = [("jitter", "off"), ("resolution", "full")].into_iter().chain(model.map(|model| ("model", model)));
    given.extend(words.map(|(name, word)| (name.into(), Value::Choice(word.into()))));
    let settings = Settings::new(march::TECHNIQUE.name, march::TECHNIQUE.parameters, Some(given))?;

    let mut resident = Resident::new(gpu, &world).await?;
    resident.view = gpu.buffer("view", &along(view, pixel, points));
    resident.hide_sky(gpu).await?;
    let mut frame =
        Frame::record(gpu, &world, resident, &settings, |recording| Box::pin(march::record_up_to(recording, reach)))
            .await?;
    let total = frame.tiles().count();
    for (done, tile) in frame.tiles().enumerate() {
        frame.render_tile(tile);
        gpu.wait()?;
        if progress((done + 1) as f64 / total as f64).is_break() {
            return Err(RenderError::Interrupted);
        }
    }
    read_film(gpu, frame.film()).await
}

/// A view of a row of pixels that all look through the middle of one of `view`.
fn along(view: View, pixel: [u32; 2], points: u32) -> View {
    let [x, y] = [0, 1].map(|axis| (pixel[axis] as f32 + 0.5) / [view.width, view.height][axis] as f32);
    let forward = (view.forward + (2.0 * x - 1.0) * view.right + (1.0 - 2.0 * y) * view.up).normalize();
    View { forward, right: Vec3::ZERO, up: Vec3::ZERO, width: points, height: 1, ..view }
}

/// Refuses what the marcher does not render.
fn check(world: &World) -> Result<(), FieldError> {
    if let Some(volume) = world.volumes.iter().find(|volume| matches!(volume.field, Field::Mesh(_))) {
        return Err(FieldError {
            path: format!("media.{}.density.mesh", volume.name),
            found: "a mesh".into(),
            accepted: "every other density: a probe is of techniques.march, which renders no meshes".into(),
        });
    }
    match world.scene.techniques.keys().find(|name| *name != march::TECHNIQUE.name) {
        None => Ok(()),
        Some(other) => Err(FieldError {
            path: format!("techniques.{other}"),
            found: "another technique".into(),
            accepted: "techniques.march or none: a probe is of the marcher".into(),
        }),
    }
}

#[cfg(test)]
mod test {
    use super::*;
    use crate::test::{gpu, tolerance, world};

    /// The unit cube from 0.5 m before it, in a light from above; σ_s by channel, σ_a = 1 m⁻¹.
    fn slab(irradiance: f32) -> World {
        world(&format!(
            "camera = {{ position = [0, 0, 1], target = [0, 0, 0], fov = 0.001 }}\nfilm.size = [3, 3]\n\
             lights.sun.directional = {{ direction = [0, -1, 0], irradiance = {irradiance} }}\n\
             [media.slab]\ndensity.homogeneous = {{ min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }}\n\
             optics.coefficients = {{ sigma_s = [1, 2, 3], sigma_a = 1 }}\n[techniques.march]\ntermination = 0"
        ))
    }

    /// σ_t, T = e^{−σ_t s}, S = E σ_s e^{−σ_t/2}/4π and L = S (1 − e^{−σ_t s})/σ_t at a depth s of the cube, light coming
    /// 0.5 m from its top.
    fn closed_form(sample: &Sample, sigma_s: f64) -> [f64; 4] {
        let (sigma_t, s) = (sigma_s + 1.0, sample.distance - 0.5);
        let source = 4.0 * sigma_s * (-0.5 * sigma_t).exp() / (4.0 * std::f64::consts::PI);
        [sigma_t, (-sigma_t * s).exp(), source, source * -(-sigma_t * s).exp_m1() / sigma_t]
    }

    fn worst_error(irradiance: f32) -> Option<f64> {
        let gpu = gpu()?;
        let world = slab(irradiance);
        let mut on = |_| ControlFlow::Continue(());
        let samples = pollster::block_on(probe(&gpu, &world, [1, 1], [0.5, 1.5], 10, &mut on)).unwrap();
        assert_eq!(samples.len(), 10);
        let mut worst = 0f64;
        for sample in &samples {
            for c in 0..3 {
                let found = [sample.extinction[c], sample.transmittance[c], sample.source[c], sample.radiance[c]];
                for (found, expected) in found.into_iter().zip(closed_form(sample, [1.0, 2.0, 3.0][c])) {
                    worst = worst.max((found / expected - 1.0).abs());
                }
            }
        }
        Some(worst)
    }

    #[test]
    fn a_slab_in_the_sun() {
        let Some(worst) = worst_error(4.0) else { return };
        assert!(worst < tolerance::SINGLE_SCATTERING, "{worst}");
    }

    #[test]
    fn another_sun_is_seen() {
        let Some(worst) = worst_error(4.04) else { return };
        assert!(worst > 10.0 * tolerance::SINGLE_SCATTERING, "{worst}");
    }
}
