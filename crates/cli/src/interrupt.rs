//! Ctrl-C as a flag that long work asks for.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether Ctrl-C was pressed. A second Ctrl-C ends the program at once.
#[derive(Clone)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Watches Ctrl-C from now on: before there is something to keep it ends the program at once.
    pub fn watch() -> Self {
        let flag = Arc::new(AtomicBool::new(false));
        let set = flag.clone();
        let watching = ctrlc::set_handler(move || {
            if set.swap(true, Ordering::SeqCst) {
                std::process::exit(130);
            }
        });
        if let Err(error) = watching {
            tracing::warn!("Ctrl-C ends the program without writing anything: {error}");
        }
        Self(flag)
    }

    /// Whether to stop.
    pub fn pressed(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}
