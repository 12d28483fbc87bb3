//! Where pictures go: refused before any work, written whole or not at all.

use crate::{Place, Run};

#[test]
fn names_that_cannot_be_written_are_refused_before_any_work() {
    let place = Place::new();
    std::fs::create_dir(place.path("folder.exr")).unwrap();
    for (output, expected) in [
        ("a.jpg", "output a.jpg: accepted: a name that ends in .exr"),
        ("a", "output a: accepted: a name that ends in .exr"),
        ("no/a.exr", "output no/a.exr: there is no folder no"),
        ("scene.toml/a.exr", "output scene.toml/a.exr: there is no folder scene.toml"),
        ("folder.exr", "output folder.exr: there is a folder of that name"),
    ] {
        // The scene is not there either: the output is looked at first.
        for command in ["reference", "render"] {
            place.tyndall(&format!("{command} no.toml -o {output}")).exits(2).says(&[expected]);
        }
    }
    place.tyndall("demo -o no/a.png").exits(2).says(&["there is no folder no"]);
    place.tyndall("compare a.exr b.exr --map map.exr").exits(2).says(&["a name that ends in .png"]);
    place.tyndall("reference scene.toml -o a.png").exits(2).says(&["a name that ends in .exr"]);
}

#[test]
fn a_page_that_cannot_be_made_is_refused_before_any_work() {
    let run = Place::new().tyndall("reproduce fourier-opacity --out scene.toml --quick").exits(1);
    assert!(run.err.starts_with("error: cannot make scene.toml: "), "{}", run.err);
}

/// A limit on the size of files stands for a full disk.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_1_and_leaves_the_old_file() {
    let place = Place::new();
    place.tyndall("reference scene.toml -o a.exr --samples 2").exits(0);
    let before = std::fs::read(place.path("a.exr")).unwrap();
    let program = env!("CARGO_BIN_EXE_tyndall");
    // The signal of the limit is ignored, so that writing fails as on a full disk.
    let line =
        format!("trap '' XFSZ; ulimit -f 2; exec {program} reference scene.toml -o a.exr --samples 4 --size 16x12");
    let mut shell = std::process::Command::new("sh");
    let run = Run::new(shell.args(["-c", &line]).current_dir(place.0.path()).output().unwrap());
    run.exits(1).says(&["`a.exr`: "]);
    assert_eq!(std::fs::read(place.path("a.exr")).unwrap(), before);
    assert_eq!(place.names(), ["a.exr", "scene.toml"]);
}

#[cfg(unix)]
#[test]
fn a_folder_that_may_not_be_written() {
    use std::fs::Permissions;
    use std::os::unix::fs::PermissionsExt as _;
    let place = Place::new();
    std::fs::create_dir(place.path("shut")).unwrap();
    let mode = |mode| std::fs::set_permissions(place.path("shut"), Permissions::from_mode(mode)).unwrap();
    mode(0o555);
    if std::fs::write(place.path("shut/probe"), "").is_ok() {
        println!("skipped: this user may write everywhere");
    } else {
        place.tyndall("reference scene.toml -o shut/a.exr --samples 1").exits(1).says(&["`shut/a.exr`: "]);
    }
    mode(0o755);
}

/// A paper's page has its plots and pictures in it and its numbers beside it: those of ringing are published; a deep shadow map is what
/// bases are held against, and more of Fourier's coefficients are closer to it. What it works at is told meanwhile.
#[test]
fn a_paper_is_reproduced() {
    let place = Place::new();
    let run = place.tyndall("reproduce fourier-opacity --out page --quick").exits(0).says(&["12/12  all bases"]);
    assert!(run.out.contains("index.html"), "{}", run.out);
    let html = std::fs::read_to_string(place.path("page/index.html")).unwrap();
    assert!(html.matches("<svg").count() >= 3 && html.contains("<table>"));
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(place.path("page/results.json")).unwrap()).unwrap();
    let ringing = json["results"]["figure_8"][0]["greatest T, α = 0.9"].as_f64().unwrap();
    assert!((ringing - 1.24).abs() < 0.005, "{ringing}");
    for name in ["figure-1a", "figure-1b", "figure-10", "figure-4-fourier", "figure-9-slices", "coefficients"] {
        assert!(html.contains(&format!("{name}.png")) && place.path(&format!("page/{name}.png")).exists(), "{name}");
    }
    let counts = json["results"]["figure_4_coefficients"].as_array().unwrap();
    let error = |row: usize| counts[row]["Fourier"].as_f64().unwrap();
    assert!(error(2) < 0.7 * error(0), "{counts:?}");
    assert_eq!(json["results"]["table_1"].as_array().unwrap().len(), 6);
    let bases = json["results"]["bases_32_bytes_pictures"].as_array().unwrap();
    assert_eq!(bases.len(), 9);
    for row in bases {
        for scene in ["plume", "cloud", "hair", "thin layers", "outlier"] {
            let error = row[format!("{scene}: error")].as_f64().unwrap();
            assert!((0.0..1.0).contains(&error), "{error} of {scene}: {row}");
        }
    }
}
