//! Damaged and hostile scene files: an error, never a panic, a hang or an exhausted stack.

use std::time::{Duration, Instant};

use proptest::prelude::*;
use tyndall_scene::assets::Embedded;
use tyndall_scene::volume::Budget;
use tyndall_scene::{Document, World};

use crate::{CAMERA, SCENES};

/// The shipped scenes in both languages.
fn texts() -> Vec<(&'static str, String)> {
    let mut texts = Vec::new();
    for (name, text) in SCENES {
        let json = serde_json::to_string_pretty(&Document::new(name, text).parse().unwrap()).unwrap();
        texts.extend([("s.toml", text.to_owned()), ("s.json", json)]);
    }
    texts
}

/// Reads a scene as far as it goes; what is accepted must also survive loading, where assets are missing.
fn read(name: &str, bytes: Vec<u8>) {
    let Ok(document) = Document::from_bytes(name, bytes) else { return };
    match document.parse() {
        Ok(scene) => {
            scene.check().unwrap();
            match World::load(scene, &Embedded::default(), Budget(1 << 20)) {
                Ok(world) => check_finite(&world),
                Err(error) => check_message(&error.locate(&document).to_string()),
            }
        }
        Err(error) => check_message(&error.to_string()),
    }
}

pub fn check_finite(world: &World) {
    for volume in &world.volumes {
        assert!(volume.unit_from_world.is_finite() && volume.world_from_unit.is_finite());
        let value = volume.field.value(tyndall_scene::glam::Vec3::splat(0.5));
        assert!(value.is_finite() && value >= 0.0, "{value} of {:?}", volume.field);
    }
}

fn check_message(message: &str) {
    assert!(message.len() < 1000, "{} bytes of message", message.len());
    assert!(!message.chars().any(char::is_control), "{message:?}");
}

#[test]
fn every_truncation() {
    for (name, text) in texts() {
        for end in 0..text.len() {
            read(name, text.as_bytes()[..end].to_vec());
        }
    }
}

#[test]
fn every_removed_line() {
    for (name, text) in texts() {
        for gone in 0..text.lines().count() {
            let rest: Vec<_> = text.lines().enumerate().filter(|&(i, _)| i != gone).map(|(_, line)| line).collect();
            read(name, rest.join("\n").into_bytes());
        }
    }
}

#[test]
fn deep_nesting_and_long_tokens() {
    let n = 100_000;
    let hostile = [
        "[".repeat(n),
        "{".repeat(n),
        format!("a = {}", "[".repeat(n)),
        format!("a = {}{}", "[".repeat(n), "]".repeat(n)),
        format!("a = {}", "{a=".repeat(n)),
        format!("{}a = 1", "a.".repeat(n)),
        format!("[{}a]", "a.".repeat(n)),
        format!("[[{}a]]", "a.".repeat(n)),
        "[[a]]\n".repeat(n),
        (0..n / 10).map(|i| format!("[lights.l{i}]\n")).collect(),
        (0..n).map(|i| format!("k{i}=1\n")).collect(),
        "[a]\n".repeat(n),
        format!("{CAMERA}fov = {}", "9".repeat(n)),
        format!("{CAMERA}fov = 0x{}", "f".repeat(n)),
        format!("{CAMERA}fov = 1e{}", "9".repeat(n)),
        format!("{CAMERA}fov = 0.{}", "0".repeat(n)),
        format!("{CAMERA}fov = \"{}\"", "\\u00e9".repeat(n)),
        format!("{CAMERA}{} = 1", "k".repeat(n)),
        format!("{CAMERA}up = [{}]", "0,".repeat(n)),
        format!("{CAMERA}up = \"{}", "\\".repeat(n)),
        format!("{}{}", "[".repeat(n), "]".repeat(n)),
        format!("{{\"camera\": {}{}}}", "[".repeat(n), "]".repeat(n)),
        format!("{}1{}", "{\"a\":".repeat(n), "}".repeat(n)),
        format!("{{\"camera\": {}}}", "9".repeat(n)),
        format!("{{\"camera\": \"{}\"}}", "\\u00e9".repeat(n)),
        format!("{{{}\"a\": 1}}", "\"a\": 1,".repeat(n)),
        format!("{{\"camera\": {{\"position\": [{}0]}}}}", "0,".repeat(n)),
        "\"".repeat(n),
        "\u{1b}[31m".repeat(n),
        "\0".repeat(n),
        "\r".repeat(n),
        "=\n".repeat(n),
    ];
    for text in hostile {
        for name in ["s.toml", "s.json"] {
            let started = Instant::now();
            read(name, text.clone().into_bytes());
            let head: String = text.chars().take(20).collect();
            let took = started.elapsed();
            assert!(took < Duration::from_secs(5), "{name} {head:?} of {} bytes took {took:?}", text.len());
        }
    }
}

/// Replacements that a random byte seldom makes.
const FRAGMENTS: [&str; 24] = [
    "nan",
    "inf",
    "-inf",
    "1e38",
    "-3.4e38",
    "1e-38",
    "1e-45",
    "1e400",
    "-0",
    "0",
    "-1",
    "99999999999999999999",
    "[]",
    "{}",
    "\"\"",
    "null",
    "true",
    "[1, 2, 3]",
    "\"hg\"",
    "1979-05-27",
    "[[",
    "\n",
    "=",
    "é",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1024))]

    #[test]
    fn random_bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        read("s.toml", bytes.clone());
        read("s.json", bytes);
    }

    #[test]
    fn changed_bytes(
        which in 0..2 * SCENES.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let (name, text) = texts().swap_remove(which);
        let mut bytes = text.into_bytes();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        read(name, bytes);
    }

    /// Numbers and words in place of others: most are accepted by the syntax, many by the schema.
    #[test]
    fn changed_values(
        which in 0..2 * SCENES.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(FRAGMENTS.to_vec())), 1..3),
    ) {
        let (name, mut text) = texts().swap_remove(which);
        for (place, fragment) in changes {
            let tokens = tokens(&text);
            let range = tokens[place.index(tokens.len())].clone();
            text.replace_range(range, fragment);
        }
        read(name, text.into_bytes());
    }

    #[test]
    fn located_anywhere(which in 0..2 * SCENES.len(), path in "[a-z.0-9\\[\\]é]{0,40}") {
        let (name, text) = texts().swap_remove(which);
        let error = Document::new(name, text.clone()).at(&path, "message");
        if let Some((line, column)) = error.place {
            let lines: Vec<_> = text.split('\n').collect();
            prop_assert!(line >= 1 && column >= 1 && line <= lines.len());
            prop_assert!(column <= lines[line - 1].chars().count() + 1);
        }
        Document::new("broken.toml", "[").at(&path, "message");
    }
}

/// The ranges of the words and numbers of a text.
fn tokens(text: &str) -> Vec<std::ops::Range<usize>> {
    let mut tokens = Vec::new();
    let mut start = None;
    for (i, c) in text.char_indices().chain([(text.len(), ' ')]) {
        let inside = c.is_ascii_alphanumeric() || "._-+".contains(c);
        match (inside, start) {
            (true, None) => start = Some(i),
            (false, Some(begin)) => {
                tokens.push(begin..i);
                start = None;
            }
            _ => {}
        }
    }
    tokens
}

#[test]
fn places_are_those_of_the_values() {
    let document = Document::new("fog.toml", SCENES[2].1);
    for (path, expected) in [
        ("camera.fov", "fov = "),
        ("lights.lamp.spot.outer_angle", "outer_angle = "),
        ("media.fog.optics.coefficients.phase.hg.g", "optics.coefficients"),
        ("media.smoke.density.grid.file", "density.grid = "),
        // By default: the table around it.
        ("camera.up", "[camera]"),
        ("camera.position.7", "position"),
        ("media.fog.transform.scale", "[media.fog]"),
    ] {
        let (line, column) = document.at(path, "").place.unwrap();
        let line = SCENES[2].1.lines().nth(line - 1).unwrap();
        assert!(line.starts_with(expected), "{path} is at {line}");
        assert!(column <= line.len());
    }
    for path in ["", "x", "techniques.march.step", "camer"] {
        assert_eq!(document.at(path, "").place, None, "{path}");
    }
}
