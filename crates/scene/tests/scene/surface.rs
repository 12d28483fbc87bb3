//! Surfaces and materials in scene files.

use std::io::Cursor;

use tyndall_scene::assets::Embedded;
use tyndall_scene::glam::{Vec2, Vec3};
use tyndall_scene::surface::{Bsdf, Material};
use tyndall_scene::volume::Budget;
use tyndall_scene::{Document, Scene, World};

use crate::{CAMERA, SCENES, check_refusals};

const QUAD: &str = "shape.quad = { corner = [0, 0, 0], edges = [[1, 0, 0], [0, 1, 0]] }\n";
const ENOUGH: Budget = Budget(1 << 24);

fn scene(text: &str) -> Scene {
    Document::new("s.toml", format!("{CAMERA}{text}")).parse().unwrap_or_else(|error| panic!("{error}"))
}

fn shipped(name: &str) -> World {
    let (_, text) = SCENES.into_iter().find(|(of, _)| *of == name).unwrap();
    World::load(Document::new(name, text).parse().unwrap(), &Embedded::default(), ENOUGH).unwrap()
}

fn png(texels: &[[u8; 4]], width: u32) -> Vec<u8> {
    let height = texels.len() as u32 / width;
    let mut bytes = Cursor::new(Vec::new());
    let picture = image::RgbaImage::from_raw(width, height, texels.concat()).unwrap();
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

#[test]
fn what_is_refused() {
    let surface = |rest: &str| format!("{CAMERA}[surfaces.a]\n{rest}");
    let edges = |u: &str, v: &str| surface(&format!("shape.quad = {{ corner = [0, 0, 0], edges = [{u}, {v}] }}"));
    let polygon = |faces: &str| {
        surface(&format!(
            "shape.polygons = {{ vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0]], faces = [{faces}] }}"
        ))
    };
    check_refusals(
        "s.toml",
        &[
            (
                "a material that is not there",
                surface(&format!("{QUAD}material = \"gold\"\n[materials.silver.mirror]\n[materials.tin.mirror]")),
                "6:12: surfaces.a.material: found \"gold\"; accepted: one of the scene's materials: \"silver\", \"tin\"",
            ),
            (
                "no material at all",
                surface(&format!("{QUAD}material = \"gold\"")),
                "6:12: surfaces.a.material: found \"gold\"; accepted: one of the scene's materials: none",
            ),
            (
                "parallel edges",
                edges("[1, 2, 3]", "[2, 4, 6]"),
                "5:44: surfaces.a.shape.quad.edges: found [1.0, 2.0, 3.0] and [2.0, 4.0, 6.0]; accepted: two edges that \
                 span an area",
            ),
            (
                "no edge",
                edges("[0, 0, 0]", "[0, 1, 0]"),
                "5:44: surfaces.a.shape.quad.edges: found [0.0, 0.0, 0.0] and [0.0, 1.0, 0.0]; accepted: two edges that \
                 span an area",
            ),
            (
                "edges whose area overflows",
                edges("[1e30, 0, 0]", "[0, 1e30, 0]"),
                "5:44: surfaces.a.shape.quad.edges: found [1e30, 0.0, 0.0] and [0.0, 1e30, 0.0]; accepted: two edges \
                 that span an area",
            ),
            (
                "an inverted box",
                surface("shape.box = { min = [0, 0, 0], max = [1, 0, 1] }"),
                "5:38: surfaces.a.shape.box.max: found [1.0, 0.0, 1.0] with min = [0.0, 0.0, 0.0]; accepted: a corner \
                 above `min` on every axis",
            ),
            (
                "a disc without a normal",
                surface("shape.disc = { center = [0, 0, 0], normal = [0, 0, 0], radius = 1 }"),
                "5:45: surfaces.a.shape.disc.normal: found [0, 0, 0]; accepted: three finite numbers [x, y, z], not all 0",
            ),
            ("no faces", polygon(""), "5:85: surfaces.a.shape.polygons.faces: found none; accepted: one face or more"),
            (
                "two corners",
                polygon("[0, 1, 2], [0, 1]"),
                "5:97: surfaces.a.shape.polygons.faces.1: found 2 corners; accepted: three or more",
            ),
            (
                "a corner that is not there",
                polygon("[0, 1, 4]"),
                "5:86: surfaces.a.shape.polygons.faces.0: found 4, of 4 vertices; accepted: indices of vertices, from 0",
            ),
            (
                "corners on a line",
                polygon("[0, 1, 3, 2]"),
                "5:86: surfaces.a.shape.polygons.faces.0: found no area between the corners 0, 1 and 2; accepted: a \
                 convex polygon whose first corner is on no line through two others",
            ),
            (
                "a reflectance below 0",
                format!("{CAMERA}[materials.a.lambert]\nreflectance = [0, -1, 0]"),
                "5:15: materials.a.lambert.reflectance: found [0, -1, 0]; accepted: a number >= 0, or three of them \
                 [r, g, b]",
            ),
            (
                "another model",
                format!("{CAMERA}[materials.a.phong]\n"),
                "4:14: materials.a: found `phong`; accepted: one of `lambert`, `metallic_roughness`, `mirror`, \
                 `dielectric`",
            ),
        ],
    );
}

#[test]
fn a_surface_has_its_material_and_what_it_emits() {
    let world = scene(&format!(
        "[materials.gold.metallic_roughness]\nbase_color = [1, 0.8, 0.3]\nroughness = 0.25\n\
         [surfaces.plain]\n{QUAD}[surfaces.coin]\n{QUAD}material = \"gold\"\nradiance = [1, 2, 3]\ndouble_sided = true"
    ));
    let world = World::load(world, &Embedded::default(), ENOUGH).unwrap();
    let [coin, plain] = &world.surfaces[..] else { panic!() };
    assert_eq!((coin.name.as_str(), plain.name.as_str()), ("coin", "plain"));
    assert_eq!(*plain.material, Material::default());
    assert_eq!((coin.material.emission, coin.material.double_sided), (Vec3::new(1.0, 2.0, 3.0), true));
    let Bsdf::MetallicRoughness { base_color, metallic, roughness, .. } = coin.material.bsdf else { panic!() };
    assert_eq!((base_color, metallic, roughness), (Vec3::new(1.0, 0.8, 0.3), 1.0, 0.25));
}

#[test]
fn maps_are_read_once_and_count_for_hash_and_budget() {
    let scene = scene(&format!(
        "[materials.a.lambert]\nreflectance = 0.5\nreflectance_map = \"a.png\"\nnormal_map = \"n.png\"\n\
         [materials.b.metallic_roughness]\nbase_color_map = \"a.png\"\nmetallic_roughness_map = \"a.png\"\n\
         [surfaces.a]\n{QUAD}material = \"a\"\nradiance = 1\nradiance_map = \"a.png\"\n[surfaces.b]\n{QUAD}material = \"b\""
    ));
    let (checks, normals) = (png(&[[255, 0, 0, 255], [0, 0, 0, 255]], 2), png(&[[128, 128, 255, 255]], 1));
    let files = [("a.png", checks.as_slice()), ("n.png", normals.as_slice())];
    let load = |files: &[(&'static str, &[u8])], budget| {
        World::load(scene.clone(), &Embedded(files.to_vec()), Budget(budget)).map_err(|error| error.to_string())
    };
    let world = load(&files, 1 << 20).unwrap();
    let [a, b] = [&world.surfaces[0].material, &world.surfaces[1].material];
    let Bsdf::Lambert { map: Some(reflectance), .. } = &a.bsdf else { panic!() };
    let Bsdf::MetallicRoughness { base_color_map, metallic_roughness_map: Some(rough), .. } = &b.bsdf else { panic!() };
    assert_eq!(
        (base_color_map.as_ref(), a.emission_map.as_ref()),
        (Some(reflectance), Some(reflectance)),
        "one picture"
    );
    assert!(reflectance.texture.srgb && !rough.texture.srgb && !a.normal_map.as_ref().unwrap().map.texture.srgb);
    assert_eq!(reflectance.at([Vec2::new(0.25, 0.5); 2]).x, 1.0);

    let other = png(&[[254, 0, 0, 255], [0, 0, 0, 255]], 2);
    assert_ne!(load(&[("a.png", &other), files[1]], 1 << 20).unwrap().hash, world.hash);
    let message = load(&files, 50).unwrap_err();
    assert!(
        message.starts_with("materials.a.lambert.reflectance_map: ") && message.contains("at most 50"),
        "{message}"
    );
    let missing = World::load(scene.clone(), &Embedded(files[..1].to_vec()), ENOUGH).unwrap_err();
    assert_eq!(
        missing.to_string(),
        "materials.a.lambert.normal_map: cannot read \"n.png\": no embedded file of that name"
    );
    let message = load(&[("a.png", b"GIF89a"), files[1]], 1 << 20).unwrap_err();
    assert_eq!(
        message,
        "materials.a.lambert.reflectance_map: \"a.png\": found neither a PNG nor a JPEG file; accepted: these two"
    );
}

#[test]
fn fields_are_set_by_their_paths() {
    let mut scene = scene(&format!("[materials.wall.lambert]\nreflectance = 0.5\n[surfaces.a]\n{QUAD}"));
    for (path, value) in [
        ("surfaces.a.material", "wall"),
        ("surfaces.a.radiance", "[1, 2, 3]"),
        ("surfaces.a.shape.quad.corner.1", "7"),
        ("surfaces.a.shape.quad.edges.0.0", "2"),
        ("materials.wall.lambert.reflectance", "0.25"),
        ("materials.glass", "{ dielectric = {} }"),
        ("surfaces.b", "{ shape = { sphere = { center = [0, 0, 0], radius = 1 } }, material = \"glass\" }"),
    ] {
        scene.set(path, value).unwrap_or_else(|error| panic!("{path} = {value}: {error}"));
    }
    let world = World::load(scene.clone(), &Embedded::default(), ENOUGH).unwrap();
    assert_eq!(world.surfaces[0].mesh.positions[1], Vec3::new(2.0, 7.0, 0.0));
    assert_eq!(world.surfaces[0].material.bsdf, Bsdf::Lambert { reflectance: Vec3::splat(0.25), map: None });
    assert_eq!(world.surfaces[1].material.bsdf, Bsdf::Dielectric { ior: 1.5 });
    let error = scene.set("surfaces.a.material", "gold").unwrap_err().to_string();
    assert_eq!(
        error,
        "surfaces.a.material: found \"gold\"; accepted: one of the scene's materials: \"glass\", \"wall\""
    );
}

#[test]
fn a_transform_without_inverse_is_an_error() {
    let scene = scene(&format!("[surfaces.a]\n{QUAD}transform.scale = 1e-39"));
    let error = World::load(scene, &Embedded::default(), ENOUGH).unwrap_err().to_string();
    assert!(error.starts_with("surfaces.a.transform: found a map to the world"), "{error}");
}

/// The Cornell box is closed but for the side of the camera, and its fronts are inside.
#[test]
fn the_cornell_box_is_that_of_cornell() {
    let world = shipped("cornell.toml");
    assert_eq!(world.surfaces.len(), 8);
    let middle = Vec3::new(0.278, 0.274, 0.28);
    let mut area = 0.0;
    for surface in &world.surfaces {
        let block = surface.name.ends_with("block");
        let at = |&index: &u32| surface.world_from_object.transform_point3(surface.mesh.positions[index as usize]);
        let center = surface.mesh.positions.iter().sum::<Vec3>() / surface.mesh.positions.len() as f32;
        let center = surface.world_from_object.transform_point3(center);
        for triangle in &surface.mesh.triangles {
            let [a, b, c] = [at(&triangle[0]), at(&triangle[1]), at(&triangle[2])];
            let front = (b - a).cross(c - a);
            let outward = (a + b + c) / 3.0 - if block { center } else { middle };
            assert_eq!(front.dot(outward) > 0.0, block, "{}: {a} {b} {c}", surface.name);
            if ["light", "ceiling"].contains(&surface.name.as_str()) {
                area += front.length() / 2.0;
            }
        }
    }
    // The light fills its hole.
    assert!((area - 0.556 * 0.5592).abs() < 1e-6, "{area}");
    let mirror = shipped("cornell-mirror.toml");
    let block = mirror.surfaces.iter().find(|surface| surface.name == "tall_block").unwrap();
    assert_eq!(block.material.bsdf, Bsdf::Mirror { reflectance: Vec3::ONE });
    assert_ne!(mirror.hash, world.hash);
}

/// Its radiance is 1 by (1 − ρ)L = L_e, and nothing leaves it.
#[test]
fn the_furnace_is_closed() {
    let world = shipped("furnace.toml");
    let [room] = &world.surfaces[..] else { panic!() };
    let mesh = &room.mesh;
    let volume: f32 = mesh
        .triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    assert!((volume + 1.0).abs() < 1e-6, "fronts inside: {volume}");
    let Bsdf::Lambert { reflectance, .. } = room.material.bsdf else { panic!() };
    assert_eq!(room.material.emission / (1.0 - reflectance), Vec3::ONE);
}
