//! Every kind of mistake in a TOML scene, with its message: place, path, what was found, what is accepted.

mod media;

use crate::{CAMERA, check_refusals};

fn check(before: &str, cases: &[(&'static str, &'static str)]) {
    let cases: Vec<_> = cases.iter().map(|&(text, expected)| (text, format!("{before}{text}"), expected)).collect();
    check_refusals("s.toml", &cases);
}

#[test]
fn syntax() {
    check(
        "",
        &[
            ("", "1:1: found no `camera`; accepted: a table with `camera`, or something that one can be put before"),
            ("[camera]\nposition = [0, 0", "2:17: unclosed array, expected `]`"),
            ("[camera", "1:8: unclosed table, expected `]`"),
            ("camera", "1:7: key with no value, expected `=`"),
            ("a = \"x\ny\"", "1:7: invalid basic string, expected `\"`"),
            ("é = 1\n[camera]\nfov = é", "1:1: invalid unquoted key, expected letters, numbers, `-`, `_`"),
            ("[camera]\nfov = 1\nfov = 2", "3:1: duplicate key"),
            ("[camera]\n[camera]", "2:2: duplicate key"),
        ],
    );
}

#[test]
fn camera() {
    check(
        "[camera]\ntarget = [0, 0, 0]\n",
        &[
            ("", "1:1: camera: found no `position`; accepted: a table with `position`, which has no default"),
            ("position = [0, 0]", "3:12: camera.position: found [0, 0]; accepted: three finite numbers [x, y, z]"),
            (
                "position = [0, 0, 1, 2]",
                "3:12: camera.position: found [0, 0, 1, 2]; accepted: three finite numbers [x, y, z]",
            ),
            ("position = [0, 0, \"a\"]", "3:19: camera.position.2: found \"a\"; accepted: a finite number"),
            ("position = 3", "3:12: camera.position: found 3; accepted: three finite numbers [x, y, z]"),
            (
                "position = [0, 0, nan]",
                "3:12: camera.position: found [0, 0, nan]; accepted: three finite numbers [x, y, z]",
            ),
            (
                "position = [0, 0, 1e39]",
                "3:12: camera.position: found [0, 0, 1e39]; accepted: three finite numbers [x, y, z]",
            ),
            (
                "position = [0, 0, 0]",
                "2:10: camera.target: found [0.0, 0.0, 0.0], seen from [0.0, 0.0, 0.0]; accepted: a point apart from `position`, not straight along `up`",
            ),
            (
                "position = [0, 3, 0]",
                "2:10: camera.target: found [0.0, 0.0, 0.0], seen from [0.0, 3.0, 0.0]; accepted: a point apart from `position`, not straight along `up`",
            ),
        ],
    );
    check(
        CAMERA,
        &[
            ("up = [0, 0, 0]", "4:6: camera.up: found [0, 0, 0]; accepted: three finite numbers [x, y, z], not all 0"),
            ("fov = 0", "4:7: camera.fov: found 0; accepted: an angle in degrees between 0 and 180 (exclusive)"),
            ("fov = 180", "4:7: camera.fov: found 180; accepted: an angle in degrees between 0 and 180 (exclusive)"),
            ("fov = -inf", "4:7: camera.fov: found -inf; accepted: an angle in degrees between 0 and 180 (exclusive)"),
            ("fov = true", "4:7: camera.fov: found true; accepted: an angle in degrees between 0 and 180 (exclusive)"),
            (
                "fov = \"wide\"",
                "4:7: camera.fov: found \"wide\"; accepted: an angle in degrees between 0 and 180 (exclusive)",
            ),
            ("fov = [1]", "4:7: camera.fov: found [1]; accepted: an angle in degrees between 0 and 180 (exclusive)"),
            (
                "fov = { vertical = 40 }",
                "4:7: camera.fov: found { vertical = 40 }; accepted: an angle in degrees between 0 and 180 (exclusive)",
            ),
            (
                "fov = 1979-05-27",
                "4:7: camera.fov: found 1979-05-27; accepted: an angle in degrees between 0 and 180 (exclusive)",
            ),
            (
                "fov = 99999999999999999999999999999999999999999",
                "4:7: camera.fov: found 99999999999999999999999999999999999999999; accepted: an angle in degrees between 0 and 180 (exclusive)",
            ),
            (
                "fov = 0xffff_ffff_ffff_ffff_ffff_ffff_ffff_ffff_ff",
                "4:7: camera.fov: found 0xffffffffffffffffffffffffffffffffff; accepted: an angle in degrees between 0 and 180 (exclusive)",
            ),
            (
                "fovy = 40",
                "4:1: camera.fovy: found unknown field `fovy`; accepted: one of `position`, `target`, `up`, `fov`",
            ),
            (
                "\"\\u001b[31mred\" = 40",
                "4:1: camera.\\u{1b}[31mred: found unknown field `\\u{1b}[31mred`; accepted: one of `position`, `target`, `up`, `fov`",
            ),
        ],
    );
    check("camera = 1", &[("", "1:10: camera: found 1; accepted: a table with `position`, `target`, `up`, `fov`")]);
}

#[test]
fn film() {
    check(
        &format!("{CAMERA}[film]\n"),
        &[
            (
                "size = [0, 10]",
                "5:8: film.size: found [0, 10]; accepted: [width, height] in pixels, each a whole number from 1 to 8192",
            ),
            (
                "size = [100000, 10]",
                "5:8: film.size: found [100000, 10]; accepted: [width, height] in pixels, each a whole number from 1 to 8192",
            ),
            (
                "size = [-1, 10]",
                "5:8: film.size: found [-1, 10]; accepted: [width, height] in pixels, each a whole number from 1 to 8192",
            ),
            (
                "size = [1.5, 10]",
                "5:8: film.size: found [1.5, 10]; accepted: [width, height] in pixels, each a whole number from 1 to 8192",
            ),
            (
                "size = [10]",
                "5:8: film.size: found [10]; accepted: [width, height] in pixels, each a whole number from 1 to 8192",
            ),
            (
                "size = [10, 20, 30]",
                "5:8: film.size: found [10, 20, 30]; accepted: [width, height] in pixels, each a whole number from 1 to 8192",
            ),
            (
                "size = 10",
                "5:8: film.size: found 10; accepted: [width, height] in pixels, each a whole number from 1 to 8192",
            ),
            ("size = [10, \"20\"]", "5:13: film.size.1: found \"20\"; accepted: a whole number of pixels"),
            ("exposure = 1e400", "5:12: film.exposure: found 1e400; accepted: a finite number"),
            ("exposre = 1", "5:1: film.exposre: found unknown field `exposre`; accepted: one of `size`, `exposure`"),
        ],
    );
}

#[test]
fn lights() {
    check(
        CAMERA,
        &[
            (
                "[light.sun]",
                "4:2: light: found unknown field `light`; accepted: one of `camera`, `film`, `lights`, `media`, `materials`, `surfaces`, `techniques`",
            ),
            (
                "[lights.sun]",
                "4:1: lights.sun: found an empty table; accepted: one of `directional`, `point`, `spot`, `constant`, `environment`",
            ),
            (
                "[lights]\nsun = 3",
                "5:7: lights.sun: found 3; accepted: one of `directional`, `point`, `spot`, `constant`, `environment`",
            ),
            (
                "[lights]\nsun = \"directional\"",
                "5:7: lights.sun: found \"directional\"; accepted: a table `directional` with `direction`, `irradiance`",
            ),
            (
                "[[lights]]\nconstant.radiance = 1",
                "4:1: lights: found [{ constant = { radiance = 1 } }]; accepted: a table",
            ),
            (
                "[lights.sun.directionl]\ndirection = [0, 1, 0]",
                "4:13: lights.sun: found `directionl`; accepted: one of `directional`, `point`, `spot`, `constant`, `environment`",
            ),
            (
                "[lights.sun.directional]\ndirection = [0, 1, 0]\nirradiance = 3\ncolor = 3",
                "7:1: lights.sun.directional.color: found unknown field `color`; accepted: one of `direction`, `irradiance`",
            ),
            (
                "[lights.sun.directional]\ndirection = [0, 1, 0]",
                "4:1: lights.sun.directional: found no `irradiance`; accepted: a table with `irradiance`, which has no default",
            ),
            (
                "[lights.sun.directional]\ndirection = [0, 0, 0]\nirradiance = 3",
                "5:13: lights.sun.directional.direction: found [0, 0, 0]; accepted: three finite numbers [x, y, z], not all 0",
            ),
            (
                "[lights.sun.constant]\nradiance = -3",
                "5:12: lights.sun.constant.radiance: found -3; accepted: a number >= 0, or three of them [r, g, b]",
            ),
            (
                "[lights.sun.constant]\nradiance = [1, 2, -3]",
                "5:12: lights.sun.constant.radiance: found [1, 2, -3]; accepted: a number >= 0, or three of them [r, g, b]",
            ),
            (
                "[lights.sun.constant]\nradiance = 1\n[lights.sun.point]\nintensity = 3",
                "6:13: lights.sun: found both `constant` and `point`; accepted: one of `directional`, `point`, `spot`, `constant`, `environment`",
            ),
            ("[lights.sun]\nconstant = 3", "5:12: lights.sun.constant: found 3; accepted: a table with `radiance`"),
            (
                "[lights.sky.environment]\nrotate = 3",
                "4:1: lights.sky.environment: found no `file`; accepted: a table with `file`, which has no default",
            ),
            (
                "[lights.sky.environment]\nfile = \"a.exr\"\nrotate = inf",
                "6:10: lights.sky.environment.rotate: found inf; accepted: a finite number",
            ),
            (
                "[lights.sky.environment]\nfile = \"a.exr\"\nscale = [1, 1]",
                "6:9: lights.sky.environment.scale: found [1, 1]; accepted: a number >= 0, or three of them [r, g, b]",
            ),
            (
                "[lights.sky.environment]\nfile = \"a.exr\"\n[lights.dome.environment]\nfile = \"a.exr\"",
                "4:1: lights.sky.environment: found a second environment map, beside lights.dome; accepted: one in a scene",
            ),
        ],
    );
    check(
        &format!("{CAMERA}[lights.s.spot]\nposition = [0, 0, 0]\ndirection = [0, 1, 0]\nintensity = 1\n"),
        &[
            (
                "inner_angle = 20\nouter_angle = 20",
                "8:15: lights.s.spot.inner_angle: found 20 with outer_angle = 20; accepted: an angle less than outer_angle",
            ),
            (
                "inner_angle = 20\nouter_angle = 180",
                "9:15: lights.s.spot.outer_angle: found 180; accepted: an angle in degrees between 0 and 180 (exclusive)",
            ),
            (
                "inner_angle = 0\nouter_angle = 10",
                "8:15: lights.s.spot.inner_angle: found 0; accepted: an angle in degrees between 0 and 180 (exclusive)",
            ),
        ],
    );
}

#[test]
fn technique_values() {
    check(
        CAMERA,
        &[
            ("[techniques]\nmarch = 3", "5:9: techniques.march: found 3; accepted: a table"),
            (
                "[techniques.march]\nstep = [3]",
                "5:8: techniques.march.step: found [3]; accepted: true, false, a finite number or a word in quotes",
            ),
            (
                "[techniques.march]\nstep = inf",
                "5:8: techniques.march.step: found inf; accepted: true, false, a finite number or a word in quotes",
            ),
        ],
    );
}
