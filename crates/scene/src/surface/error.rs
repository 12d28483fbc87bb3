//! What can be wrong with a file of surfaces.

use std::io;

use crate::volume::Budget;

/// Why a file's surfaces could not be loaded. Each message says what was found and what is accepted.
#[derive(Debug, thiserror::Error)]
pub enum SurfaceError {
    /// The file cannot be had.
    #[error("cannot be read: {0}")]
    Read(#[from] io::Error),
    /// A file that belongs to it cannot be had.
    #[error("cannot read {file:?}, which it names: {reason}")]
    Part {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// The file contradicts itself or its format.
    #[error("the file is corrupt: {0}")]
    Corrupt(String),
    /// The file is well formed, but uses something that is not supported.
    #[error("unsupported: {found}; accepted: {accepted}")]
    Unsupported {
        /// What the file has.
        found: String,
        /// What it may have.
        accepted: &'static str,
    },
    /// There is no memory for it. Nothing was allocated.
    #[error("{what} need {bytes} bytes; the budget is {budget}")]
    TooLarge {
        /// What would need them.
        what: &'static str,
        /// Bytes that it would need (saturated).
        bytes: u64,
        /// Bytes allowed.
        budget: u64,
    },
    /// The file has no camera of the name that was asked for.
    #[error("found no camera named {name:?}; accepted: {}", listed(available))]
    NoSuchCamera {
        /// The name that was asked for.
        name: String,
        /// The names of the file's perspective cameras.
        available: Vec<String>,
    },
}

impl SurfaceError {
    pub(super) fn corrupt(what: impl Into<String>) -> Self {
        Self::Corrupt(what.into())
    }
}

/// Refuses `count` things of `size` bytes each where they are beyond a budget.
pub(super) fn check_budget(what: &'static str, count: u64, size: usize, budget: Budget) -> Result<(), SurfaceError> {
    let bytes = count.saturating_mul(size as u64);
    if bytes > budget.0 {
        return Err(SurfaceError::TooLarge { what, bytes, budget: budget.0 });
    }
    Ok(())
}

fn listed(names: &[String]) -> String {
    match names {
        [] => "no name, as it has no perspective camera".into(),
        names => names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", "),
    }
}
