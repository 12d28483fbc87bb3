//! Tyndall's ground truth: a CPU path tracer for participating media and surfaces.
//!
//! [`render`] makes pictures with their statistics, [`Tracer`] estimates single rays. Every estimate is without bias:
//! its mean is the solution of the equation of radiative transfer, and what is left is noise, which is known. It
//! shares the description of scenes with the renderers it judges, but no physics.
//!
//! | module | idea |
//! |---|---|
//! | `path` | from the eye, scattering by scattering |
//! | `vertex` | where a path scatters, in media or at a surface |
//! | `direct` | light that comes straight to there |
//! | `tracking` | flight to the next collision, and transmittance, by null collisions |
//! | `march` | the ray cut at the cells of every medium |
//! | `bodies` | particles and strands, exactly |
//! | `majorant` | bounds of the extinction in each cell |
//! | `medium` | coefficients at a point |
//! | [`phase`] | which way scattered light goes |
//! | `surface` | points of surfaces, with their textures |
//! | `bvh` | which triangle a ray meets first |
//! | [`bsdf`] | how surfaces scatter light |
//! | `area` | surfaces that shine, by power |
//! | `light` | what lamps send to a point |
//! | [`sky`] | the environment map, by importance |
//! | `near` | point lights within media |
//! | `camera`, `film`, `render` | pixels, their mean and variance, passes |
//! | `source` | what a point emits and scatters to the eye |
//! | `probe` | what a camera ray meets on its way |
//! | [`simple`] | the same truth on one page, slow |

mod area;
mod bodies;
pub mod bsdf;
mod bvh;
mod camera;
mod direct;
mod film;
mod light;
mod majorant;
mod march;
mod medium;
mod near;
mod path;
pub mod phase;
mod probe;
mod random;
mod render;
pub mod simple;
pub mod sky;
mod source;
mod surface;
mod tracking;
mod vertex;

pub use path::Tracer;
pub use probe::{Estimate, Point, probe, span};
pub use random::Random;
pub use render::{LEAST_SAMPLES, Options, Progress, render};

/// Why a world cannot be traced.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReferenceError {
    /// A camera without a direction.
    #[error("camera.target: the camera looks nowhere, or straight along `up`")]
    Camera,
    /// Extinction beyond what numbers hold.
    #[error("media.{medium}: the extinction overflows; accepted: a finite density times σ_s + σ_a everywhere")]
    Unbounded {
        /// The medium's name.
        medium: String,
    },
    /// A way of drawing that is not light.
    #[error(
        "media.{medium}.optics.transfer.{field}: found a way of drawing that is no physics; accepted by the \
        reference: a transfer function without it"
    )]
    Unphysical {
        /// The medium's name.
        medium: String,
        /// The field of its transfer function.
        field: &'static str,
    },
    /// A previous image of another size.
    #[error("the image to continue has {}×{} pixels; the scene's film.size is {}×{}", found[0], found[1], expected[0],
        expected[1])]
    Size {
        /// Columns and rows of the image.
        found: [u32; 2],
        /// Columns and rows of the scene's film.
        expected: [u32; 2],
    },
    /// A previous image that does not say how sure it is.
    #[error("the image to continue has no statistics (variance and number of samples)")]
    NoStatistics,
    /// A previous image that is damaged.
    #[error("the image to continue is damaged: {0}")]
    Image(String),
}
