//! JSON scenes: mistakes with their messages, and that they say the same as TOML ones.

use tyndall_scene::{Document, MAX_TEXT};

use crate::{SCENES, check_refusals, refusal};

const CAMERA: &str = r#"{"camera": {"position": [0, 0, 3], "target": [0, 0, 0]}"#;

fn check(before: &str, cases: &[(&'static str, &'static str)]) {
    let cases: Vec<_> = cases.iter().map(|&(text, expected)| (text, format!("{before}{text}"), expected)).collect();
    check_refusals("s.JSON", &cases);
}

#[test]
fn syntax() {
    check(
        "",
        &[
            ("", "1:1: EOF while parsing a value"),
            ("{", "1:1: EOF while parsing an object"),
            ("{\"camera\": \n  x}", "2:3: expected value"),
            ("{} x", "1:4: trailing characters"),
            (
                "[]",
                "1:1: found []; accepted: a table with `camera`, `film`, `lights`, `media`, `materials`, `surfaces`, `techniques`",
            ),
            ("\"\\ud800\"", "1:1: unexpected end of hex escape"),
            ("{\"é\": 3,\n\"é\": \"\\ud800\"}", "2:1: found `é` twice; accepted: every field once"),
            ("{\"\\ud800\": 3}", "1:2: unexpected end of hex escape"),
        ],
    );
}

#[test]
fn fields() {
    check(
        "",
        &[
            ("{}", "1:1: found no `camera`; accepted: a table with `camera`, which has no default"),
            (
                "{\"camera\": null}",
                "1:12: camera: found null; accepted: a table with `position`, `target`, `up`, `fov`",
            ),
            (
                "{\"camera\": {\"position\": [0, 0, 3]}}",
                "1:12: camera: found no `target`; accepted: a table with `target`, which has no default",
            ),
            (
                "{\"camera\": {\"position\": [0, 0, 3], \"target\": [0, 0, 3]}}",
                "1:46: camera.target: found [0.0, 0.0, 3.0], seen from [0.0, 0.0, 3.0]; accepted: a point apart from `position`, not straight along `up`",
            ),
            (
                "{\"camera\": {\"position\": [0, 0, 3], \"target\": [0, 0]}}",
                "1:46: camera.target: found [0, 0]; accepted: three finite numbers [x, y, z]",
            ),
            (
                "{\"camera\": {\"position\": [0, 0, 3], \"target\": [0, 0, 0],\n  \"fov\": null}}",
                "2:10: camera.fov: found null; accepted: an angle in degrees between 0 and 180 (exclusive)",
            ),
            (
                "{\"camera\": {\"position\": [0, 0, 3], \"target\": [0, 0, 0],\n  \"fov\": 1e999}}",
                "2:10: camera.fov: found 1e999; accepted: an angle in degrees between 0 and 180 (exclusive)",
            ),
            (
                "{\"camera\": {\"position\": [0, 0, 3], \"target\": [0, 0, 0],\n  \"fov\": 1, \"fov\": 2}}",
                "2:13: found `fov` twice; accepted: every field once",
            ),
            (
                "{\"camera\": {\"position\": [0, 0, 3], \"target\": [0, 0, 0],\n  \"fvo\": 180}}",
                "2:3: camera.fvo: found unknown field `fvo`; accepted: one of `position`, `target`, `up`, `fov`",
            ),
        ],
    );
    check(
        CAMERA,
        &[
            (
                ",\n \"film\": {\"size\": [0, 3]}}",
                "2:19: film.size: found [0, 3]; accepted: [width, height] in pixels, each a whole number from 1 to 8192",
            ),
            (
                ",\n \"lights\": {\"a\": {\"sun\": {}}}}",
                "2:19: lights.a: found `sun`; accepted: one of `directional`, `point`, `spot`, `constant`, `environment`",
            ),
            (
                ",\n \"lights\": {\"a\": {\"constant\": {\"radiance\": -1}}}}",
                "2:44: lights.a.constant.radiance: found -1; accepted: a number >= 0, or three of them [r, g, b]",
            ),
            (
                ",\n \"lights\": {\"a\": {\"constant\": {\"radianc\": 1}}}}",
                "2:32: lights.a.constant.radianc: found unknown field `radianc`; accepted: `radiance`",
            ),
            (
                ",\n \"techniques\": {\"march\": {\"step\": null}}}",
                "2:35: techniques.march.step: found null; accepted: true, false, a finite number or a word in quotes",
            ),
        ],
    );
}

#[test]
fn a_scene_is_the_same_in_both_languages() {
    for (name, text) in SCENES {
        let scene = Document::new(name, text).parse().unwrap();
        let json = serde_json::to_string_pretty(&scene).unwrap();
        assert_eq!(Document::new("s.json", json).parse().unwrap(), scene, "{name}");
        let toml = ::toml::to_string(&scene).unwrap();
        assert_eq!(Document::new("s.toml", toml).parse().unwrap(), scene, "{name}");
    }
}

#[test]
fn a_byte_order_mark_is_no_mistake() {
    for (name, text) in SCENES {
        let marked = [b"\xef\xbb\xbf", text.as_bytes()].concat();
        let scene = Document::from_bytes(name, marked).unwrap().parse().unwrap();
        assert_eq!(scene, Document::new(name, text).parse().unwrap());
    }
}

#[test]
fn other_bytes_are_refused() {
    let error = Document::from_bytes("s.toml", b"[camera]\n# caf\xe9".to_vec()).unwrap_err();
    assert_eq!(error.to_string(), "s.toml:2:6: found the byte 0xe9; accepted: text in UTF-8");
    let long = "#".repeat(MAX_TEXT + 1);
    let expected = "s.toml: found a longer text; accepted: at most 1048576 bytes";
    assert_eq!(refusal("s.toml", &long), expected);
    assert_eq!(Document::from_bytes("s.toml", long.into_bytes()).unwrap_err().to_string(), expected);
}
