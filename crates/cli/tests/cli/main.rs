//! The `tyndall` command as a user meets it: exit codes, messages, files.

mod bake;
mod compare;
mod input;
mod output;
mod probe;
mod reference;
mod render;
mod usage;

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

use tempfile::TempDir;

/// A box of fog with every kind of thing in it but an asset, small enough to be rendered in no time.
const SCENE: &str = r#"[camera]
position = [0, 0, 3]
target = [0, 0, 0]

[film]
size = [16, 12]

[lights.sky.constant]
radiance = [0.2, 0.3, 0.5]

[lights.sun.directional]
direction = [0, -1, -0.5]
irradiance = 4

[media.fog]
density.homogeneous = { min = [-1, -1, -1], max = [1, 1, 1] }
optics.coefficients = { sigma_s = 1, sigma_a = 0.2 }
"#;

/// How a run ended.
struct Run {
    code: Option<i32>,
    out: String,
    err: String,
}

impl Run {
    fn new(output: Output) -> Self {
        let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        assert!(!err.contains("panicked"), "{err}");
        assert!(!out.contains('\u{1b}') && !err.contains('\u{1b}'), "escape codes in a pipe: {out}{err}");
        Self { code: output.status.code(), out, err }
    }

    /// The run, which must have ended with this exit code.
    #[track_caller]
    fn exits(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "\n{}\n{}", self.out, self.err);
        self
    }

    /// What it said on standard error must hold all of these.
    #[track_caller]
    fn says(self, parts: &[&str]) -> Self {
        for part in parts {
            assert!(self.err.contains(part), "`{part}` is not in: {}", self.err);
        }
        self
    }
}

/// A folder of its own, with `scene.toml` in it.
struct Place(TempDir);

impl Place {
    fn new() -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        place.write("scene.toml", SCENE);
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), text).unwrap();
    }

    fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tyndall"));
        command.current_dir(self.0.path()).stdin(Stdio::null()).env_remove("RUST_LOG");
        command
    }

    fn run<I: IntoIterator<Item: AsRef<OsStr>>>(&self, arguments: I) -> Run {
        Run::new(self.command().args(arguments).output().unwrap())
    }

    /// A command line with spaces between its arguments.
    fn tyndall(&self, line: &str) -> Run {
        self.run(line.split_whitespace())
    }

    fn exists(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    /// The names of the files that are there.
    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name)
}

/// Whether there is an adapter to render on. Without one the test is skipped, and says so, unless one is required.
fn adapter() -> bool {
    static THERE: OnceLock<bool> = OnceLock::new();
    let there = *THERE.get_or_init(|| match Place::new().tyndall("info").code {
        Some(0) => true,
        Some(1) => false,
        other => panic!("`tyndall info` ended with {other:?}"),
    });
    if !there {
        assert!(std::env::var_os("TYNDALL_REQUIRE_ADAPTER").is_none(), "an adapter is required, and there is none");
        println!("skipped: no adapter");
    }
    there
}
