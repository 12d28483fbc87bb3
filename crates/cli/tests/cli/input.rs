//! Scenes that cannot be read: exit code 2, a message that names the place, and nothing written.

use crate::{Place, SCENE, shipped};

/// A reference needs no device, so that these run everywhere.
const COMMAND: &str = "reference scene.toml -o a.exr --samples 1";

#[test]
fn mistakes_are_located() {
    let place = Place::new();
    let cases = [
        (
            "sigma_s = 1",
            "sigma_s = -1",
            "scene.toml:17:35: media.fog.optics.coefficients.sigma_s: found -1; accepted: ",
        ),
        ("[film]", "[film", "scene.toml:5:6: unclosed table, expected `]`"),
        (
            "size",
            "sizes",
            "scene.toml:6:1: film.sizes: found unknown field `sizes`; accepted: one of `size`, `exposure`",
        ),
        (
            "[film]",
            "techniques.march.step = -1\n[film]",
            "scene.toml:5:1: camera.techniques: found unknown field `techniques`; accepted: one of `position`, ",
        ),
        (
            "[film]",
            "[techniques.march]\nstep = -1\n[film]",
            "scene.toml:6:8: techniques.march.step: found -1; accepted: a number from ",
        ),
        (
            "[film]",
            "[techniques.march]\nstride = 1\n[film]",
            "scene.toml:6:10: techniques.march.stride: found unknown parameter `stride`; accepted: one of ",
        ),
        (
            "[film]",
            "[techniques.paint]\n[film]",
            "scene.toml:5:1: techniques.paint: found technique \"paint\"; accepted: cells, direct, instant_radiosity, march",
        ),
        (
            "density.homogeneous = { min = [-1, -1, -1], max = [1, 1, 1] }",
            "density.grid.file = \"no.vdb\"",
            "scene.toml:16:21: media.fog.density.grid.file: cannot read \"no.vdb\": ",
        ),
    ];
    for (from, to, expected) in cases {
        place.write("scene.toml", SCENE.replacen(from, to, 1));
        let run = place.tyndall(COMMAND).exits(2);
        assert!(run.err.starts_with(&format!("error: {expected}")), "{expected}\n{}", run.err);
        assert_eq!(run.err.lines().count(), 1, "{}", run.err);
    }
    assert_eq!(place.names(), ["scene.toml"]);
}

#[test]
fn overrides_are_blamed_for_their_mistakes() {
    let place = Place::new();
    for (argument, expected) in [
        ("--set camera.fov=0", "--set camera.fov=0: camera.fov: found 0; accepted: an angle in degrees"),
        (
            "--set techniques.march.step=-1",
            "--set techniques.march.step=-1: techniques.march.step: found -1; accepted: ",
        ),
        (
            "--set techniques.march={step=-1}",
            "--set techniques.march={step=-1}: techniques.march.step: found -1; accepted",
        ),
        (
            "--set techniques.paint.x=1",
            "--set techniques.paint.x=1: techniques.paint: found technique \"paint\"; accepted",
        ),
        (
            "--set media.fog.density={grid={file=\"no.vdb\"}}",
            "--set media.fog.density={grid={file=\"no.vdb\"}}: media.fog.density.grid.file: cannot read \"no.vdb\"",
        ),
        ("--set film.sizes=1", "--set film.sizes=1: film.sizes: found unknown field `sizes`"),
        ("--size 0x10", "--size 0x10: film.size: found [0, 10]; accepted: [width, height] in pixels"),
        ("--size 4000000000x1", "--size 4000000000x1: film.size: found [4000000000, 1]; accepted: "),
    ] {
        place.tyndall(&format!("{COMMAND} {argument}")).exits(2).says(&[expected]);
    }
    assert_eq!(place.names(), ["scene.toml"]);
}

#[test]
fn what_is_no_scene_file() {
    let place = Place::new();
    std::fs::create_dir(place.path("folder.toml")).unwrap();
    place.write("latin.toml", b"# caf\xe9");
    place.write("empty.toml", "");
    let line = |scene: &str| format!("reference {scene} -o a.exr --samples 1");
    place.tyndall(&line("no.toml")).exits(2).says(&["cannot read the scene no.toml: No such file"]);
    place.tyndall(&line("folder.toml")).exits(2).says(&["cannot read the scene folder.toml"]);
    place.tyndall(&line("latin.toml")).exits(2).says(&["latin.toml:1:6: found the byte 0xe9; accepted: text in UTF-8"]);
    place.tyndall(&line("empty.toml")).exits(2).says(&["empty.toml:1:1: found no `camera`"]);
    #[cfg(target_os = "linux")]
    place.tyndall(&line("/dev/zero")).exits(2).says(&["/dev/zero: found a longer text; accepted: at most"]);
    place.run(["reference", "--samples", "1", "-o", "a.exr", &"x".repeat(10_000)]).exits(2);
}

#[cfg(target_os = "linux")]
#[test]
fn names_need_not_be_utf_8() {
    use std::os::unix::ffi::OsStrExt as _;
    let place = Place::new();
    let name = std::ffi::OsStr::from_bytes(b"sc\xffne.toml");
    let output = std::ffi::OsStr::from_bytes(b"pict\xffre.exr");
    let arguments =
        |scene| ["reference", "--samples", "1", "-o"].map(std::ffi::OsStr::new).into_iter().chain([output, scene]);
    place.run(arguments(name)).exits(2);
    std::fs::write(place.0.path().join(name), SCENE).unwrap();
    place.run(arguments(name)).exits(0);
    assert!(place.0.path().join(output).exists());
    place.run([output, name]).exits(2);
}

#[test]
fn a_corrupt_volume() {
    let place = Place::new();
    let smoke = std::fs::read(shipped("smoke.vdb")).unwrap();
    place.write("smoke.vdb", &smoke[..100_000]);
    place.write("scene.toml", std::fs::read(shipped("plume.toml")).unwrap());
    let message = "media.plume.density.grid.file: \"smoke.vdb\": the file ends at byte 100000";
    place.tyndall(COMMAND).exits(2).says(&["scene.toml:18:25: ", message]);
}

/// A model in place of a scene file is rendered as it is; what is wrong with it has no line of a text that nobody wrote.
#[test]
fn models_are_scenes() {
    let place = Place::new();
    place.write("toy.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    place.tyndall("reference toy.obj -o toy.exr --size 8x8 --samples 1 --set lights.sky.constant.radiance=2").exits(0);
    place.write("toy.obj", "f 1 2 3\n");
    place.tyndall("reference toy.obj -o bad.exr --samples 1").exits(2).says(&[
        "toy.obj: surfaces.model.shape.mesh.file: \"toy.obj\": the file is corrupt: line 1: a corner of vertex 1, of 0",
    ]);
    place.tyndall("reference none.ply -o bad.exr --samples 1").exits(2).says(&["cannot read \"none.ply\""]);
    assert_eq!(place.names(), ["scene.toml", "toy.exr", "toy.obj"]);
}
