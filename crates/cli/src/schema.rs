use tyndall_scene::Scene;

use crate::failure::Failure;
use crate::say;

/// Print the JSON Schema of scene files
///
/// It says of every field what it means, its unit and its range; editors check and complete scene files with it. The
/// parameters of techniques are listed by `tyndall info`.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  tyndall schema > scene.schema.json")]
pub struct Arguments {}

impl Arguments {
    /// Prints the schema.
    pub fn run(&self) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(&Scene::schema()).map_err(|error| Failure::Failed(error.into()))?;
        say::result(&(text + "\n"))
    }
}
