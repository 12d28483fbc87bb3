//! Light maps: what is refused, what is written, and what is left of work that was broken off.

use crate::Place;

/// A corner of a room, lit by a lamp that faces down.
const ROOM: &str = r#"[camera]
position = [0.9, 0.8, 3]
target = [0.5, 0.4, 0]

[film]
size = [16, 12]

[materials.white.lambert]
reflectance = 0.7

[surfaces.floor]
shape.quad = { corner = [0, 0, 0], edges = [[0, 0, 1], [1, 0, 0]] }
material = "white"

[surfaces.wall]
shape.quad = { corner = [0, 0, 0], edges = [[1, 0, 0], [0, 1, 0]] }
material = "white"

[surfaces.lamp]
shape.quad = { corner = [0.4, 1, 0.4], edges = [[0.2, 0, 0], [0, 0, 0.2]] }
radiance = 9
"#;

#[test]
fn what_is_refused() {
    if !crate::adapter() {
        return;
    }
    let place = Place::new();
    place.write("room.toml", ROOM);
    for (line, expected) in [
        ("bake scene.toml -o a.glb", "scene.toml: there are no surfaces to bake"),
        ("bake room.toml -o a.png", "a name that ends in .glb"),
        ("bake room.toml -o a.glb --texels 8", "8 is not in 16..=4096"),
        ("bake room.toml -o a.glb --texels 1000000", "1000000 is not in 16..=4096"),
        (
            "bake room.toml -o a.glb --paths 0",
            "techniques.instant_radiosity.paths: found 0; accepted: a whole number from 1 to 65536",
        ),
        ("bake room.toml -o a.glb --paths 4000000000", "techniques.instant_radiosity.paths: found 4000000000"),
    ] {
        place.tyndall(line).exits(2).says(&[expected]);
    }
    assert_eq!(place.names(), ["room.toml", "scene.toml"]);
}

#[test]
fn a_light_map_is_rendered_without_lights() {
    if !crate::adapter() {
        return;
    }
    let place = Place::new();
    place.write("room.toml", ROOM);
    let said = place.tyndall("bake room.toml -o a.glb --texels 32 --paths 16").exits(0).out;
    assert!(said.contains("map      32 x ") && said.contains("lights "), "{said}");
    place.tyndall("render a.glb -o a.png --size 16x12").exits(0);
    assert_eq!(place.names(), ["a.glb", "a.png", "room.toml", "scene.toml"]);
}

#[cfg(unix)]
#[test]
fn ctrl_c_writes_nothing() {
    if !crate::adapter() {
        return;
    }
    let place = Place::new();
    place.write("room.toml", ROOM);
    crate::reference::interrupted(&place, "bake room.toml -o a.glb --texels 1024 --paths 512");
    assert_eq!(place.names(), ["room.toml", "scene.toml"]);
}
