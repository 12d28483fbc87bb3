//! Help, the schema, and command lines that are wrong.

use std::process::Stdio;

use crate::{Place, Run};

const COMMANDS: [&str; 10] =
    ["bake", "demo", "render", "reference", "compare", "probe", "reproduce", "info", "schema", "vpls"];

#[test]
fn help_shows_examples() {
    let place = Place::new();
    let help = place.tyndall("--help").exits(0).out;
    assert!(help.contains("Exit codes: 0 done, 1 failed, 2 usage or bad input, 130 interrupted"), "{help}");
    for command in COMMANDS {
        assert!(help.contains(&format!("\n  {command} ")), "{command} is not in {help}");
        for flag in ["--help", "-h"] {
            let help = place.tyndall(&format!("{command} {flag}")).exits(0).out;
            assert!(help.contains("Example") && help.contains(&format!("  tyndall {command}")), "{help}");
        }
    }
    assert!(place.tyndall("--version").exits(0).out.starts_with("tyndall 0."));
}

#[test]
fn wrong_usage_is_2() {
    let place = Place::new();
    for line in [
        "",
        "paint",
        "render",
        "render scene.toml",
        "render scene.toml -o a.png --size 10",
        "render scene.toml -o a.png --size axb",
        "render scene.toml -o a.png --set film.exposure",
        "reference scene.toml -o a.exr --samples 0",
        "reference scene.toml -o a.exr --samples -1",
        "reference scene.toml -o a.exr --error 1.5",
        "reference scene.toml -o a.exr --error nan",
        "reference scene.toml -o a.exr --depth x",
        "compare a.exr",
        "compare a.exr b.exr --fail-over rmse",
        "compare a.exr b.exr --fail-over rmse=x",
        "compare a.exr b.exr --fail-over rmse=nan",
        "compare a.exr b.exr --exposure inf",
        "probe scene.toml",
        "probe scene.toml --pixel 3",
        "probe scene.toml --pixel 3,-1",
        "probe scene.toml --pixel 3,1 --samples 1",
        "probe scene.toml --pixel 3,1 --points 1",
        "probe scene.toml --pixel 3,1 -o a.txt",
        "probe scene.toml --pixel 3,1 --plot a.png",
        "schema now",
    ] {
        let run = place.tyndall(line).exits(2);
        assert!(run.out.is_empty() && !run.err.is_empty(), "{line}: {}", run.err);
    }
    assert_eq!(place.names(), ["scene.toml"]);
}

#[test]
fn the_schema_is_json() {
    let schema: serde_json::Value = serde_json::from_str(&Place::new().tyndall("schema").exits(0).out).unwrap();
    assert_eq!(schema["title"], "Scene");
    assert!(schema["$defs"]["Camera"]["properties"]["fov"].is_object());
}

#[test]
fn info_lists_adapters_and_parameters() {
    let run = Place::new().tyndall("info");
    assert!(run.out.contains("Technique march:") && run.out.contains("techniques.march.step = "), "{}", run.out);
    match run.code {
        Some(0) => assert!(run.out.contains("Adapter ")),
        Some(1) => drop(run.says(&["mesa-vulkan-drivers"])),
        other => panic!("{other:?}"),
    }
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_panic() {
    let place = Place::new();
    for command in ["schema", "info", "--help", "compare --help"] {
        let mut child =
            place.command().args(command.split(' ')).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let run = Run::new(child.wait_with_output().unwrap());
        assert!(matches!(run.code, Some(0 | 1)), "{command}: {:?} {}", run.code, run.err);
    }
    // Nobody listens to the error either.
    let mut child = place.command().args(["render", "no.toml", "-o", "a.png"]).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(2));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_standard_output_is_1() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = Place::new().command().arg("schema").stdout(full).output().unwrap();
    Run::new(output).exits(1).says(&["cannot write to standard output"]);
}
