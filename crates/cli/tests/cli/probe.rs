//! `tyndall probe`: the table, the plot, and what is refused.

use crate::{Place, adapter, shipped};

/// Comments, header and lines of numbers of a table.
fn table(text: &str) -> (Vec<&str>, Vec<&str>, Vec<Vec<f64>>) {
    let (comments, rest): (Vec<_>, Vec<_>) = text.lines().partition(|line| line.starts_with('#'));
    let header = rest[0].split(',').collect();
    let number = |cell: &str| cell.parse().unwrap_or_else(|_| panic!("{cell} is no number"));
    (comments, header, rest[1..].iter().map(|line| line.split(',').map(number).collect()).collect())
}

/// How many standard errors, and a hundredth, the marcher is off the reference, at worst.
fn worst(rows: &[Vec<f64>]) -> f64 {
    let cells = rows.iter().flat_map(|row| row[1..].chunks_exact(3));
    cells.map(|cell| (cell[0] - cell[1]).abs() / (cell[2] + 0.01 * cell[1].abs() + 1e-9)).fold(0.0, f64::max)
}

#[test]
fn marcher_and_reference_agree() {
    if !adapter() {
        return;
    }
    let place = Place::new();
    let line =
        "probe scene.toml --pixel 8,6 --points 12 --samples 400 --set techniques.march.environment_directions=64";
    let run = place.tyndall(line).exits(0);
    let (comments, header, rows) = table(&run.out);
    for part in ["# tyndall ", "# scene scene.toml", "# scene hash ", "# pixel 8,6 of 16x12", "# adapter "] {
        assert!(comments.iter().any(|line| line.starts_with(part)), "{part} is not in {comments:?}");
    }
    assert_eq!(header[..3], ["t [m]", "sigma_t red marcher [1/m]", "sigma_t red reference [1/m]"]);
    assert_eq!((header.len(), rows.len()), (37, 12));
    assert!(rows.iter().all(|row| row.len() == 37));
    let worst = worst(&rows);
    assert!(worst < 5.0, "{worst}");
}

/// Where the marcher leaves the sky's scattered light out, the table says so.
#[test]
fn a_difference_is_seen() {
    if !adapter() {
        return;
    }
    let line = "probe scene.toml --pixel 8,6 --points 12 --samples 400 --set techniques.march.environment_directions=0";
    let out = Place::new().tyndall(line).exits(0).out;
    let worst = worst(&table(&out).2);
    assert!(worst > 10.0, "{worst}");
}

#[test]
fn files_are_written() {
    if !adapter() {
        return;
    }
    let place = Place::new();
    let run = place.tyndall("probe scene.toml --pixel 8,6 --points 8 --samples 4 -o a.csv --plot a.svg").exits(0);
    assert!(run.out.is_empty());
    assert_eq!(place.names(), ["a.csv", "a.svg", "scene.toml"]);
    let text = std::fs::read_to_string(place.path("a.csv")).unwrap();
    assert_eq!(table(&text).2.len(), 8);
    let svg = std::fs::read_to_string(place.path("a.svg")).unwrap();
    for part in ["<svg", "scene.toml, pixel 8,6", "transmittance", "W/sr/m^2", "</svg>"] {
        assert!(svg.contains(part), "{part} is not in the plot");
    }
}

#[test]
fn what_cannot_be_probed_is_refused() {
    let place = Place::new();
    let refused = |line: &str, parts: &[&str]| {
        place.tyndall(&format!("probe scene.toml -o a.csv --samples 2 --points 2 {line}")).exits(2).says(parts);
    };
    refused("--pixel 16,0", &["--pixel 16,0: outside the film of 16x12; accepted: 0,0 to 15,11"]);
    refused("--pixel 0,0 --set camera.target=[0,3,9]", &["--pixel 0,0: its ray meets no medium"]);
    refused("--pixel 0,0 --plot no/a.svg", &["there is no folder no"]);
    if adapter() {
        refused("--pixel 8,6 --set techniques.slicing.slices=4", &["techniques.slicing", "techniques.march or none"]);
        let mesh = shipped("tetrahedra.toml");
        let arguments = ["probe", &mesh.display().to_string(), "--pixel", "8,6", "--size", "16x12", "-o", "a.csv"];
        place.run(arguments).exits(2).says(&["found a mesh", "techniques.march, which renders no meshes"]);
    }
    assert_eq!(place.names(), ["scene.toml"]);
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_no_file() {
    if !adapter() {
        return;
    }
    let place = Place::new();
    crate::reference::interrupted(&place, "probe scene.toml --pixel 8,6 -o a.csv --plot a.svg --samples 100000000");
    assert_eq!(place.names(), ["scene.toml"]);
}
