//! Scene files: what is read, what is refused, and what the messages say.

mod bodies;
mod corrupt;
mod density;
mod field;
mod formula;
mod grids;
mod json;
mod model;
mod schema;
mod set;
mod surface;
mod toml;
mod transfer;
mod world;

use tyndall_scene::Document;

/// The shipped scenes, by file name.
const SCENES: [(&str, &str); 14] = [
    ("plume.toml", include_str!("../../../../scenes/plume.toml")),
    ("fire.toml", include_str!("../../../../scenes/fire.toml")),
    ("fog.toml", include_str!("../../../../scenes/fog.toml")),
    ("brain.toml", include_str!("../../../../scenes/brain.toml")),
    ("tetrahedra.toml", include_str!("../../../../scenes/tetrahedra.toml")),
    ("cloud.toml", include_str!("../../../../scenes/cloud.toml")),
    ("sky.toml", include_str!("../../../../scenes/sky.toml")),
    ("cornell.toml", include_str!("../../../../scenes/cornell.toml")),
    ("cornell-mirror.toml", include_str!("../../../../scenes/cornell-mirror.toml")),
    ("furnace.toml", include_str!("../../../../scenes/furnace.toml")),
    ("indirect.toml", include_str!("../../../../scenes/indirect.toml")),
    ("spot.toml", include_str!("../../../../scenes/spot.toml")),
    ("particles.toml", include_str!("../../../../scenes/particles.toml")),
    ("hair.toml", include_str!("../../../../scenes/hair.toml")),
];

/// Three lines that every scene needs.
const CAMERA: &str = "[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\n";

/// Two lines of a medium.
const BOX: &str = "[media.a]\ndensity.homogeneous = { min = [0, 0, 0], max = [1, 1, 1] }\n";

/// What the parser says of a text that it must refuse.
fn refusal(name: &str, text: &str) -> String {
    match Document::new(name, text).parse() {
        Ok(_) => "accepted".into(),
        Err(error) => error.to_string(),
    }
}

/// Holds messages, without the file's name, against what they should be; all that differ are shown together.
fn check_refusals(name: &str, cases: &[(&str, String, &str)]) {
    let mut wrong = String::new();
    for (what, text, expected) in cases {
        let message = refusal(name, text);
        let message = message.strip_prefix(&format!("{name}:")).unwrap_or(&message);
        if message != *expected {
            wrong += &format!("\n{what}\n  is        {message}\n  should be {expected}\n");
        }
        assert!(!message.chars().any(char::is_control), "{message:?}");
    }
    assert!(wrong.is_empty(), "{wrong}");
}
