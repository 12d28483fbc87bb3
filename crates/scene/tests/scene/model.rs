//! Surfaces of files in scenes, and files that are scenes by themselves.

use tyndall_scene::assets::Embedded;
use tyndall_scene::description::{Camera, Light, Shape};
use tyndall_scene::glam::{Mat4, Vec3};
use tyndall_scene::surface::{Bsdf, Export, Exported, Material, Surface};
use tyndall_scene::volume::Budget;
use tyndall_scene::{Document, LoadError, Scene, World};

use crate::{BOX, CAMERA, check_refusals};

const OBJ: &[u8] = b"v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n";
const ENOUGH: Budget = Budget(1 << 24);

/// Two surfaces, of which one may glow, two cameras and maybe a lamp.
fn glb(lamp: bool, emission: f32) -> Vec<u8> {
    let text = format!("{CAMERA}[surfaces.a]\nshape.sphere = {{ center = [0, 0, 0], radius = 1 }}");
    let scene = Document::new("s.toml", text).parse().unwrap();
    let mesh = World::load(scene, &Embedded::default(), ENOUGH).unwrap().surfaces[0].mesh.clone();
    let surface = |name: &str, x: f32, emission: f32| Exported {
        surface: Surface {
            name: name.into(),
            mesh: mesh.clone(),
            world_from_object: Mat4::from_translation(Vec3::X * x),
            material: Material { name: name.into(), emission: Vec3::splat(emission), ..Material::default() }.into(),
        },
        light_map_texcoords: Vec::new(),
    };
    let camera = |z: f32| Camera { position: Vec3::new(0.0, 0.0, z), fov: 30.0, ..Camera::default() };
    let light = ("bulb".to_owned(), Light::Point { position: Vec3::Y, intensity: Vec3::ONE });
    Export {
        surfaces: vec![surface("ball", 0.0, 0.0), surface("lamp", 3.0, emission)],
        lights: if lamp { vec![light] } else { Vec::new() },
        cameras: vec![("near".into(), camera(5.0), 1.0), ("far".into(), camera(50.0), 1.0)],
    }
    .to_glb()
    .unwrap()
}

fn parse(text: &str) -> Scene {
    Document::new("s.toml", text).parse().unwrap_or_else(|error| panic!("{error}"))
}

fn load(scene: &Scene, files: &[(&str, &[u8])]) -> World {
    World::load(scene.clone(), &Embedded(files.to_vec()), ENOUGH).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_file_brings_surfaces_lights_and_a_camera() {
    let glb = glb(true, 2.0);
    let scene = parse("[surfaces.toy]\nshape.mesh.file = \"a.glb\"\ntransform = { scale = 2, translate = [1, 0, 0] }");
    let world = load(&scene, &[("a.glb", &glb)]);
    let names: Vec<_> = world.surfaces.iter().map(|surface| surface.name.as_str()).collect();
    assert_eq!(names, ["toy/ball", "toy/lamp"]);
    assert_eq!(
        world.surfaces[1].bounds().unwrap().map(|corner| corner.round()),
        [Vec3::new(5.0, -2.0, -2.0), Vec3::new(9.0, 2.0, 2.0)]
    );
    assert_eq!(world.surfaces[1].material.emission, Vec3::splat(2.0));
    let bulb = Light::Point { position: Vec3::new(1.0, 2.0, 0.0), intensity: Vec3::ONE };
    assert_eq!(world.lights.iter().collect::<Vec<_>>(), [(&"toy/bulb".to_owned(), &bulb)]);
    let Camera { position, fov, .. } = world.scene.camera;
    assert!(position.abs_diff_eq(Vec3::new(1.0, 0.0, 10.0), 1e-5) && (fov - 30.0).abs() < 1e-4, "{position} {fov}");

    let mut far = scene.clone();
    far.set("surfaces.toy.shape.mesh.camera", "far").unwrap();
    let far = load(&far, &[("a.glb", &glb)]);
    assert!(far.scene.camera.position.abs_diff_eq(Vec3::new(1.0, 0.0, 100.0), 1e-4));
    // The scene's own comes first; a material of the scene stands for all of the file's.
    let mut own = scene.clone();
    for (path, value) in [
        ("camera", "{ position = [0, 0, 9], target = [0, 0, 0] }"),
        ("materials.chrome", "{ mirror = {} }"),
        ("surfaces.toy.material", "chrome"),
        ("surfaces.toy.radiance", "1"),
    ] {
        own.set(path, value).unwrap();
    }
    let own = load(&own, &[("a.glb", &glb)]);
    assert_eq!(own.scene.camera.position, Vec3::new(0.0, 0.0, 9.0));
    for surface in &own.surfaces {
        assert_eq!(surface.material.bsdf, Bsdf::Mirror { reflectance: Vec3::ONE });
        assert_eq!(surface.material.emission, Vec3::ONE);
    }
}

/// Without a camera all is seen, whatever its size, place and kind.
#[test]
fn what_has_no_camera_is_framed() {
    for (text, size) in [("", [200, 100]), ("transform = { scale = 1e-4, translate = [7, 0, 0] }", [100, 300])] {
        let text = format!(
            "[film]\nsize = {size:?}\n[surfaces.a]\nshape.mesh.file = \"a.obj\"\n{text}\n{BOX}optics.coefficients = {{}}\n\
             transform.scale = 1e-4"
        );
        let world = load(&parse(&text), &[("a.obj", OBJ)]);
        let camera = &world.scene.camera;
        let [right, up, backward] = camera.frame().unwrap();
        let half = (camera.fov / 2.0).to_radians().tan();
        let aspect = size[0] as f32 / size[1] as f32;
        let surfaces = &world.surfaces[0];
        let mut points =
            surfaces.mesh.positions.iter().map(|p| surfaces.world_from_object.transform_point3(*p)).collect::<Vec<_>>();
        points.push(world.volumes[0].world_from_unit.transform_point3(Vec3::ONE));
        for point in points {
            let seen = point - camera.position;
            let depth = -seen.dot(backward);
            let place = [seen.dot(right) / depth / half / aspect, seen.dot(up) / depth / half];
            assert!(depth > 0.0 && place.iter().all(|x| x.abs() <= 1.0001), "{point} is at {place:?}");
        }
    }
    let nothing =
        World::load(parse("[surfaces.a]\nshape.mesh.file = \"a.obj\""), &Embedded(vec![("a.obj", b"")]), ENOUGH);
    let message = nothing.unwrap_err().to_string();
    assert!(message.starts_with("camera: found no `camera`, and nothing that one can be put before"), "{message}");
}

#[test]
fn a_model_is_a_scene() {
    assert!(Document::is_model("a.GLB") && Document::is_model("b/c.obj") && !Document::is_model("a.toml"));
    let sky = |file: &str, bytes: &[u8]| {
        let assets = Embedded(vec![(file, bytes)]);
        let scene = Document::model(file, &assets).parse().unwrap();
        let world = World::load(scene.clone(), &assets, ENOUGH).unwrap();
        assert!(!world.surfaces.is_empty());
        let lights: Vec<_> = world.lights.keys().filter(|name| !name.contains('/')).cloned().collect();
        lights
    };
    let even = ["sky", "sun"].map(str::to_owned);
    assert_eq!(sky("a.obj", OBJ), even);
    assert_eq!(sky("a.glb", &glb(false, 0.0)), even);
    assert_eq!(sky("a.glb", &glb(true, 0.0)), [""; 0], "it has a lamp");
    assert_eq!(sky("a.glb", &glb(false, 1.0)), [""; 0], "it glows");

    // Nobody wrote the scene, so messages name no line of it.
    let assets = Embedded(vec![("a \"b\".obj", b"f 1 2 3")]);
    let document = Document::model("a \"b\".obj", &assets);
    let error = World::load(document.parse().unwrap(), &assets, ENOUGH).unwrap_err();
    assert_eq!(
        error.locate(&document).to_string(),
        "a \"b\".obj: surfaces.model.shape.mesh.file: \"a \\\"b\\\".obj\": the file is corrupt: line 1: a corner of vertex 1, of 0"
    );
}

#[test]
fn files_count_for_hash_and_budget() {
    let scene = parse(&format!("{CAMERA}[surfaces.a]\nshape.mesh.file = \"a.obj\""));
    let first = load(&scene, &[("a.obj", OBJ)]);
    let longer = [OBJ, b"\n"].concat();
    assert_ne!(load(&scene, &[("a.obj", &longer)]).hash, first.hash);
    let bytes = first.surfaces[0].mesh.bytes();
    let with = |budget| World::load(scene.clone(), &Embedded(vec![("a.obj", OBJ)]), Budget(budget)).map(|_| ());
    with(1000).unwrap();
    let message = with(bytes - 1).unwrap_err().to_string();
    assert!(message.starts_with("surfaces.a.shape.mesh.file: \"a.obj\": its faces need"), "{message}");
}

#[test]
fn errors_know_their_place() {
    let text = format!("{CAMERA}[surfaces.a]\nshape.mesh = {{ file = \"a.obj\" }}");
    let document = Document::new("s.toml", text);
    let message = |files: &[(&str, &[u8])]| {
        let error = World::load(document.parse().unwrap(), &Embedded(files.to_vec()), ENOUGH).unwrap_err();
        error.locate(&document).to_string()
    };
    let place = "s.toml:5:23: surfaces.a.shape.mesh.file: ";
    assert_eq!(
        message(&[]),
        format!(
            "{place}cannot read \"a.obj\": no embedded file of that name; accepted: a path relative to the scene file"
        )
    );
    assert_eq!(
        message(&[("a.obj", b"v 1")]),
        format!("{place}\"a.obj\": the file is corrupt: line 1: 1 numbers; there must be 3")
    );

    let scene = parse("[surfaces.toy]\nshape.mesh = { file = \"a.glb\", camera = \"middle\" }");
    let glb = glb(false, 0.0);
    let error = World::load(scene, &Embedded(vec![("a.glb", &glb)]), ENOUGH).unwrap_err();
    assert!(matches!(error, LoadError::Surface { .. }));
    assert_eq!(
        error.to_string(),
        "surfaces.toy.shape.mesh.camera: \"a.glb\": found no camera named \"middle\"; accepted: \"near\", \"far\""
    );
    check_refusals(
        "s.toml",
        &[
            (
                "two cameras",
                format!("{CAMERA}[surfaces.a]\nshape.mesh = {{ file = \"a.glb\", camera = \"b\" }}"),
                "5:41: surfaces.a.shape.mesh.camera: found \"b\" beside that of the scene's `camera`; accepted: one camera",
            ),
            (
                "cameras of two files",
                "[surfaces.a]\nshape.mesh = { file = \"a.glb\", camera = \"b\" }\n[surfaces.c]\nshape.mesh = { file = \"a.glb\", \
                 camera = \"d\" }"
                    .into(),
                "2:41: surfaces.a.shape.mesh.camera: found \"b\" beside that of surfaces.c; accepted: one camera",
            ),
            (
                "no camera and nothing else",
                "[film]\nsize = [1, 1]".into(),
                "1:1: found no `camera`; accepted: a table with `camera`, or something that one can be put before",
            ),
        ],
    );
}

#[test]
fn a_camera_can_be_set_where_there_is_none() {
    let mut scene = parse("[surfaces.a]\nshape.mesh.file = \"a.obj\"");
    assert!(scene.camera.is_none());
    let error = scene.set("camera.position", "[0, 0, 1]").unwrap_err().to_string();
    assert_eq!(error, "camera: found no `target`; accepted: a table with `target`, which has no default");
    scene.set("surfaces.a.shape.mesh.file", "b.obj").unwrap();
    assert!(
        scene.camera.is_none() && matches!(&scene.surfaces["a"].shape, Shape::Mesh { file, .. } if file == "b.obj")
    );
    scene.check().unwrap();
}

#[path = "../../examples/hall.rs"]
#[allow(dead_code)]
mod hall;

/// The example's hall has its 40 thousand triangles, survives being written and read, and faces inside.
#[test]
fn a_hall_of_forty_thousand_triangles() {
    let glb = hall::hall().to_glb().unwrap();
    assert!(glb.len() < 300_000, "what is shared is written once: {} bytes", glb.len());
    let world = load(&parse("[surfaces.hall]\nshape.mesh.file = \"hall.glb\""), &[("hall.glb", &glb)]);
    let triangles: usize = world.surfaces.iter().map(|surface| surface.mesh.triangles.len()).sum();
    assert!((38_000..42_000).contains(&triangles), "{triangles}");
    for surface in &world.surfaces {
        for triangle in &surface.mesh.triangles {
            let [a, b, c] = triangle.map(|i| surface.mesh.positions[i as usize]);
            let shading = surface.mesh.normals[triangle[0] as usize];
            assert!((b - a).cross(c - a).dot(shading) > 0.0, "{}", surface.name);
        }
    }
    let room = world.surfaces.iter().find(|surface| surface.name == "hall/room").unwrap();
    let [a, ..] = room.mesh.triangles[0].map(|i| room.mesh.positions[i as usize]);
    assert!(room.mesh.normals[room.mesh.triangles[0][0] as usize].dot(a) < 0.0, "its fronts are inside");
}

/// Spot stands on the floor of its scene.
#[test]
fn spot_on_tiles() {
    let folder = std::env::var_os("TYNDALL_DATA").map_or_else(
        || std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        std::path::PathBuf::from,
    );
    let Ok(bytes) = std::fs::read(folder.join("spot.obj")) else {
        println!("skipped: {} is not there", folder.join("spot.obj").display());
        return;
    };
    let (name, text) = crate::SCENES.into_iter().find(|(name, _)| *name == "spot.toml").unwrap();
    let tiles: &[u8] = include_bytes!("../../../../scenes/tiles.png");
    let world = load(&Document::new(name, text).parse().unwrap(), &[("spot.obj", &bytes), ("tiles.png", tiles)]);
    let spot = world.surfaces.iter().find(|surface| surface.name == "spot").unwrap();
    let floor = world.surfaces.iter().find(|surface| surface.name == "floor").unwrap();
    let gap = spot.bounds().unwrap()[0].y - floor.bounds().unwrap()[0].y;
    assert!((0.0..0.01).contains(&gap), "{gap} m above the floor");
    // Euler's formula for 11533 vertices.
    assert_eq!(spot.mesh.triangles.len(), 2 * 11533 - 4);
}
