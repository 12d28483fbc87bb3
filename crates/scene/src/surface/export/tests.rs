use glam::{Vec2Swizzles, Vec3, Vec4};

use super::*;
use crate::description::{Edge, Shape};
use crate::surface::gltf::place;
use crate::surface::tests::{assert_valid, read, survive, warnings};
use crate::surface::{Bsdf, Map, Material, NormalMap, Texture, Wrap};
use crate::volume::tests::{apply, damage, damaged_cases};
use proptest::prelude::*;

fn quad() -> TriangleMesh {
    TriangleMesh::of(&Shape::Quad { corner: Vec3::new(1.0, 2.0, 3.0), edges: [Edge(Vec3::X), Edge(Vec3::Y)] })
}

fn picture(texel: [u8; 4], srgb: bool) -> Map {
    Map::new(Texture { width: 2, height: 1, texels: vec![texel, [1, 2, 3, 4]], srgb })
}

fn surface(name: &str, mesh: TriangleMesh, material: Material) -> Surface {
    let world_from_object = Mat4::from_translation(Vec3::new(0.0, 0.0, -7.0));
    Surface { name: name.into(), mesh: Arc::new(mesh), world_from_object, material: Arc::new(material) }
}

fn exported(surface: Surface) -> Exported {
    Exported { surface, light_map_texcoords: Vec::new() }
}

/// One of everything.
pub(crate) fn everything() -> Export {
    let mut baked = quad();
    baked.colors = vec![Vec4::new(0.25, 0.5, 1.0, 1.0); 4];
    let mut tiles = quad();
    let normals = Map { wrap: [Wrap::Repeat, Wrap::Mirror], mips: false, ..picture([128, 128, 255, 255], false) };
    crate::surface::tangents::add_tangents(&mut tiles, &normals);
    tiles.second_texcoords = tiles.texcoords.iter().map(|uv| uv.yx() * 0.5).collect();
    let tile = Material {
        name: "tile".into(),
        bsdf: Bsdf::MetallicRoughness {
            base_color: Vec3::new(0.5, 0.25, 1.0),
            base_color_map: Some(picture([255, 128, 0, 255], true)),
            metallic: 0.25,
            roughness: 0.75,
            metallic_roughness_map: Some(picture([0, 128, 255, 255], false)),
        },
        emission: Vec3::new(20.0, 5.0, 0.0),
        emission_map: Some(picture([255, 255, 255, 255], true)),
        normal_map: Some(NormalMap { map: normals, scale: 0.5 }),
        double_sided: true,
        alpha_cutoff: Some(0.25),
        occlusion_map: Some(Map {
            wrap: [Wrap::Clamp; 2],
            transform: place(Vec2::new(0.25, -1.0), 0.5, Vec2::new(2.0, -3.0)),
            second: true,
            ..picture([9, 9, 9, 255], false)
        }),
        ..Material::default()
    };
    let wall = Material { bsdf: Bsdf::Lambert { reflectance: Vec3::splat(0.75), map: None }, ..Material::default() };
    let mut lit = exported(surface(
        "lit",
        quad(),
        Material { emission_map: tile.emission_map.clone(), emission: Vec3::ONE, ..wall.clone() },
    ));
    lit.light_map_texcoords = vec![Vec2::new(0.5, 0.25); 4];
    let spot = Light::Spot {
        position: Vec3::new(1.0, 2.0, 3.0),
        direction: Vec3::new(0.6, 0.0, 0.8),
        intensity: Vec3::new(10.0, 20.0, 40.0),
        inner_angle: 20.0,
        outer_angle: 30.0,
    };
    Export {
        surfaces: vec![
            exported(surface("floor", tiles, tile)),
            exported(surface("wall", baked, wall)),
            exported(surface(
                "mirror",
                quad(),
                Material { bsdf: Bsdf::Mirror { reflectance: Vec3::splat(0.9) }, ..Material::default() },
            )),
            lit,
        ],
        lights: vec![
            ("sun".into(), Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::splat(3.0) }),
            ("bulb".into(), Light::Point { position: Vec3::X, intensity: Vec3::new(1.0, 0.5, 0.0) }),
            ("spot".into(), spot),
        ],
        cameras: vec![(
            "eye".into(),
            Camera { position: Vec3::new(3.0, 2.0, 5.0), target: Vec3::ZERO, up: Vec3::Y, fov: 35.0 },
            1.5,
        )],
    }
}

#[test]
fn what_is_written_is_read_again() {
    let export = everything();
    let glb = export.to_glb().unwrap();
    let (model, warned) = warnings(|| read(&[("a.glb", &glb)], "a.glb").unwrap());
    assert_eq!(warned, "");
    let names: Vec<_> = model.parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["floor", "wall", "mirror", "lit"]);
    for (part, Exported { surface, .. }) in model.parts.iter().zip(&export.surfaces) {
        assert_valid(&part.mesh);
        assert_eq!(part.file_from_object, surface.world_from_object);
        if part.name != "lit" {
            assert_eq!(part.mesh, surface.mesh, "{}", part.name);
        }
    }
    let [floor, wall, mirror, lit] = [0, 1, 2, 3].map(|i| &model.parts[i].material);
    let original = &export.surfaces[0].surface.material;
    let same = |a: &Option<Map>, b: &Option<Map>| {
        assert_eq!(a.is_some(), b.is_some());
        let (Some(a), Some(b)) = (a, b) else { return };
        assert_eq!((&*a.texture, a.wrap, a.second), (&*b.texture, b.wrap, b.second));
        assert!(a.transform.abs_diff_eq(b.transform, 1e-6), "{:?}", a.transform);
    };
    same(&floor.emission_map, &original.emission_map);
    same(&floor.occlusion_map, &original.occlusion_map);
    let (Some(normals), Some(expected)) = (&floor.normal_map, &original.normal_map) else { panic!() };
    assert_eq!(normals.scale, 0.5);
    same(&Some(normals.map.clone()), &Some(expected.map.clone()));
    assert!((floor.emission - original.emission).abs().max_element() < 1e-5, "{}", floor.emission);
    assert_eq!((floor.double_sided, floor.alpha_cutoff), (true, Some(0.25)));
    let Bsdf::MetallicRoughness { base_color, base_color_map, metallic, roughness, metallic_roughness_map } =
        &floor.bsdf
    else {
        panic!()
    };
    assert_eq!((*base_color, *metallic, *roughness), (Vec3::new(0.5, 0.25, 1.0), 0.25, 0.75));
    let Bsdf::MetallicRoughness { base_color_map: b, metallic_roughness_map: m, .. } = &original.bsdf else { panic!() };
    same(base_color_map, b);
    same(metallic_roughness_map, m);
    assert_eq!(wall.bsdf, Bsdf::Lambert { reflectance: Vec3::splat(0.75), map: None });
    let Bsdf::MetallicRoughness { base_color, metallic: 1.0, roughness: 0.0, .. } = mirror.bsdf else { panic!() };
    assert_eq!(base_color, Vec3::splat(0.9));
    // A light map's coordinates are those of its material.
    assert_eq!(model.parts[3].mesh.texcoords, vec![Vec2::new(0.5, 0.25); 4]);
    same(&lit.emission_map, &original.emission_map);

    assert_eq!(model.lights.len(), 3);
    for (name, light) in &export.lights {
        let numbers = |light: &Light| match *light {
            Light::Directional { direction, irradiance } => vec![direction, irradiance],
            Light::Point { position, intensity } => vec![position, intensity],
            Light::Spot { position, direction, intensity, inner_angle, outer_angle } => {
                vec![position, direction, intensity, Vec3::new(inner_angle, outer_angle, 0.0)]
            }
            _ => panic!(),
        };
        for (found, expected) in numbers(&model.lights[name]).into_iter().zip(numbers(light)) {
            assert!(found.abs_diff_eq(expected, 1e-5 * (1.0 + expected.length())), "{name}: {found} is not {expected}");
        }
    }
    let (name, camera) = &model.cameras[0];
    let [before, after] = [&export.cameras[0].1, camera].map(|camera| camera.frame().unwrap());
    assert!(name == "eye" && (camera.fov - 35.0).abs() < 1e-4);
    assert!(before.iter().zip(&after).all(|(a, b)| a.abs_diff_eq(*b, 1e-6)));
}

#[test]
fn shared_meshes_materials_and_pictures_are_written_once() {
    let one = surface("one", quad(), Material { emission_map: Some(picture([0; 4], true)), ..Material::default() });
    let two = Surface { name: "two".into(), ..one.clone() };
    let both = Export { surfaces: vec![exported(one.clone()), exported(two)], ..Export::default() };
    let once = Export { surfaces: vec![exported(one)], ..Export::default() };
    let (both, once) = (both.to_glb().unwrap(), once.to_glb().unwrap());
    assert!(both.len() < once.len() + 250, "{} and {}", both.len(), once.len());
    let model = read(&[("a.glb", &both)], "a.glb").unwrap();
    assert!(Arc::ptr_eq(&model.parts[0].mesh, &model.parts[1].mesh));
}

#[test]
fn linear_pictures_are_encoded_where_gltf_wants_srgb() {
    let material = Material { emission_map: Some(picture([128, 0, 255, 128], false)), ..Material::default() };
    let glb =
        Export { surfaces: vec![exported(surface("a", quad(), material))], ..Export::default() }.to_glb().unwrap();
    let model = read(&[("a.glb", &glb)], "a.glb").unwrap();
    let texel = model.parts[0].material.emission_map.as_ref().unwrap().texture.texels[0];
    assert_eq!(texel, [188, 0, 255, 128]);
}

#[test]
fn what_cannot_be_written() {
    let of = |change: fn(&mut TriangleMesh)| {
        let mut mesh = quad();
        change(&mut mesh);
        let surfaces = vec![exported(surface("a", mesh, Material::default()))];
        Export { surfaces, ..Export::default() }.to_glb().unwrap_err().to_string()
    };
    assert_eq!(of(|mesh| mesh.positions[0].x = f32::NAN), "the file is corrupt: \"a\" has numbers that are not finite");
    assert!(of(|mesh| mesh.triangles[0][0] = 4).contains("corners beyond its vertices"));
    assert!(of(|mesh| mesh.triangles.clear()).contains("no triangles"));
    assert!(of(|mesh| mesh.normals.truncate(3)).contains("4 positions, [3, 4] normals"));
    let sky = ("sky".to_owned(), Light::Constant { radiance: Vec3::ONE });
    let (glb, warned) = warnings(|| Export { lights: vec![sky], ..Export::default() }.to_glb().unwrap());
    assert!(warned.contains("sky: glTF has no light from all around"), "{warned}");
    let model = read(&[("a.glb", &glb)], "a.glb").unwrap();
    assert!(model.parts.is_empty() && model.lights.is_empty());
}

/// As it holds one of everything, this file also shows what the reader does with damaged ones.
#[test]
fn every_truncation() {
    let glb = everything().to_glb().unwrap();
    for end in 0..glb.len() {
        assert!(read(&[("a.glb", &glb[..end])], "a.glb").is_err(), "cut at {end}");
    }
}

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged(damage in damage()) {
        let mut glb = everything().to_glb().unwrap();
        apply(&mut glb, &damage);
        survive(&[("a.glb", &glb)], "a.glb");
    }
}
