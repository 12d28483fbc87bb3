//! Why a command did not succeed, and the exit code that says so.

use std::process::ExitCode;

use tyndall::RenderError;
use tyndall_reference::ReferenceError;
use tyndall_scene::SceneError;
use tyndall_scene::image::ImageError;
use tyndall_scene::metrics::MetricError;

use crate::say;

/// Why a command did not succeed.
#[derive(Debug)]
pub enum Failure {
    /// Usage or input is wrong: exit code 2.
    Input(anyhow::Error),
    /// The work could not be done: exit code 1.
    Failed(anyhow::Error),
    /// Ctrl-C: exit code 130.
    Interrupted,
}

impl Failure {
    /// Prints the failure and gives its exit code.
    pub fn report(&self) -> ExitCode {
        match self {
            Failure::Input(error) => {
                say::note(&format!("error: {}", said(error)));
                ExitCode::from(2)
            }
            Failure::Failed(error) => {
                say::note(&format!("error: {}", said(error)));
                ExitCode::FAILURE
            }
            Failure::Interrupted => {
                say::note("interrupted");
                ExitCode::from(130)
            }
        }
    }
}

/// An error and its causes, but for those that it has in its own words.
fn said(error: &anyhow::Error) -> String {
    error
        .chain()
        .map(ToString::to_string)
        .reduce(|said, cause| if said.ends_with(&cause) { said } else { said + ": " + &cause })
        .unwrap_or_default()
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Failure::Input(error.into())
    }
}

impl From<MetricError> for Failure {
    fn from(error: MetricError) -> Self {
        Failure::Input(error.into())
    }
}

impl From<ReferenceError> for Failure {
    fn from(error: ReferenceError) -> Self {
        Failure::Input(error.into())
    }
}

impl From<ImageError> for Failure {
    /// A file that the system does not let be read or written is a failure; what is in it, or its name, is input.
    fn from(error: ImageError) -> Self {
        match error {
            ImageError::Io { .. } => Failure::Failed(error.into()),
            _ => Failure::Input(error.into()),
        }
    }
}

impl From<RenderError> for Failure {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::Interrupted => Failure::Interrupted,
            RenderError::NoSuchAdapter { .. }
            | RenderError::Limit { .. }
            | RenderError::Setting(_)
            | RenderError::NoSuchTechnique { .. }
            | RenderError::Load(_) => Failure::Input(error.into()),
            _ => Failure::Failed(error.into()),
        }
    }
}
