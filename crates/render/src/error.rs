use tyndall_scene::{FieldError, LoadError};

use crate::graph::BindingError;

/// Why a picture cannot be rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// No adapter at all.
    #[error("no GPU adapter found, and no CPU driver either.\n{}", crate::gpu::INSTALL_HELP)]
    NoAdapter,
    /// No adapter of the name asked for.
    #[error("no adapter matches \"{wanted}\"; there {}: {}", if available.len() == 1 { "is" } else { "are" }, available.join(", "))]
    NoSuchAdapter {
        /// The name asked for.
        wanted: String,
        /// The names there are.
        available: Vec<String>,
    },
    /// The adapter gives no device.
    #[error("adapter {adapter} gives no device: {reason}")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
    /// The driver lost the device (reset, unplugged, a hung shader).
    #[error(
        "the GPU device was lost: {reason}. Nothing was written; run again, or choose another adapter with --adapter"
    )]
    DeviceLost {
        /// The driver's words.
        reason: String,
    },
    /// The device ran out of memory.
    #[error("the device ran out of memory at {what}, which takes {bytes} bytes: {reason}")]
    OutOfMemory {
        /// What was being allocated.
        what: String,
        /// Its size [bytes].
        bytes: u64,
        /// The driver's words.
        reason: String,
    },
    /// Something exceeds what the device can hold.
    #[error("{what}: found {found}; this device accepts at most {limit}. {advice}")]
    Limit {
        /// What is too large.
        what: String,
        /// Its size.
        found: String,
        /// The device's limit.
        limit: String,
        /// What would fit.
        advice: String,
    },
    /// A pass and its shader do not match.
    #[error(transparent)]
    Binding(#[from] BindingError),
    /// The device refused a pass.
    #[error("pass \"{pass}\": {message}")]
    Pass {
        /// The pass.
        pass: String,
        /// The validation error.
        message: String,
    },
    /// The device refused something as it ran; its words name the pass.
    #[error("the device refused to go on: {message}")]
    Device {
        /// The device's words.
        message: String,
    },
    /// A setting that a technique does not accept.
    #[error(transparent)]
    Setting(#[from] FieldError),
    /// The scene asks for a technique that is not there.
    #[error("techniques.{found}: found an unknown technique; accepted: {accepted}")]
    NoSuchTechnique {
        /// The name in the scene.
        found: String,
        /// The techniques there are.
        accepted: String,
    },
    /// A scene that cannot be loaded.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
}
