use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::{Quat, Vec2};
use serde_json::{Value, json};

use super::*;
use crate::description::Light;
use crate::surface::tests::{area, assert_valid, fronts_face, read, read_within, survive, warnings};
use crate::surface::{Bsdf, Wrap};

/// A triangle strip of a unit square facing +z, its corners as bytes: positions, then indices 0 to 3.
fn bytes() -> Vec<u8> {
    let corners = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let mut bytes: Vec<u8> = corners.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

/// A document with that square as mesh 0, hung on whatever nodes.
fn document(nodes: Value) -> Value {
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": nodes,
        "meshes": [{ "name": "square", "primitives": [
            { "attributes": { "POSITION": 0 }, "indices": 1, "mode": 5, "material": 0 },
        ] }],
        "materials": [{ "name": "paint" }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5123, "count": 4, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 8 },
        ],
        "buffers": [{ "byteLength": 56, "uri": format!("data:application/octet-stream;base64,{}", STANDARD.encode(bytes())) }],
    })
}

fn model(document: &Value) -> Result<Model, SurfaceError> {
    read(&[("a/s.gltf", document.to_string().as_bytes())], "a/s.gltf")
}

/// With the value at a JSON pointer exchanged, or added to its table.
fn with(mut document: Value, pointer: &str, value: Value) -> Value {
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    match document.pointer_mut(parent).unwrap() {
        Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
        table => table[key] = value,
    }
    document
}

fn message(pointer: &str, value: Value) -> String {
    match model(&with(document(json!([{ "mesh": 0 }])), pointer, value)) {
        Ok(_) => "accepted".into(),
        Err(error) => error.to_string().trim_start_matches("the file is corrupt: ").to_owned(),
    }
}

#[test]
fn strips_keep_their_fronts_and_get_flat_normals() {
    let model = model(&document(json!([{ "mesh": 0, "name": "pane" }]))).unwrap();
    let [part] = &model.parts[..] else { panic!() };
    assert_valid(&part.mesh);
    assert_eq!((part.name.as_str(), part.material.name.as_str()), ("pane", "paint"));
    assert_eq!((part.mesh.positions.len(), area(&part.mesh)), (6, 1.0));
    fronts_face(&part.mesh, |_| Vec3::Z);
    // glTF's own defaults.
    let Bsdf::MetallicRoughness { base_color, metallic, roughness, .. } = part.material.bsdf else { panic!() };
    assert_eq!((base_color, metallic, roughness), (Vec3::ONE, 1.0, 1.0));
}

#[test]
fn nodes_are_trees_of_transforms() {
    let model = model(&document(json!([
        { "translation": [0, 0, 5], "scale": [2, 2, 2], "children": [1, 2] },
        { "mesh": 0, "translation": [1, 0, 0] },
        { "mesh": 0, "rotation": [0, 1, 0, 0], "name": "turned" },
    ])));
    let model = model.unwrap();
    let names: Vec<_> = model.parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["square", "turned"]);
    assert_eq!(model.parts[0].file_from_object.transform_point3(Vec3::X), Vec3::new(4.0, 0.0, 5.0));
    assert_eq!(model.parts[1].file_from_object.transform_point3(Vec3::X), Vec3::new(-2.0, 0.0, 5.0));
    assert!(Arc::ptr_eq(&model.parts[0].mesh, &model.parts[1].mesh), "one mesh, twice");
}

/// 683 lm/W, and the direction is the node's −z.
#[test]
fn lights_are_radiometric() {
    let nodes = json!([{ "children": [1, 2, 3] },
        { "name": "sun", "rotation": Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2).to_array(),
          "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "name": "bulb", "translation": [1, 2, 3], "extensions": { "KHR_lights_punctual": { "light": 1 } } },
        { "extensions": { "KHR_lights_punctual": { "light": 2 } } }]);
    let mut document = document(nodes);
    document["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "directional", "intensity": 68300.0 },
        { "type": "point", "intensity": 683.0, "color": [1, 0.5, 0] },
        { "type": "spot", "spot": {}, "name": "lamp" },
    ] } });
    let model = model(&document).unwrap();
    assert!(gives_light(document.to_string().as_bytes()));
    let Light::Directional { direction, irradiance } = model.lights["sun"] else { panic!() };
    assert!(direction.abs_diff_eq(Vec3::NEG_Y, 1e-6) && irradiance == Vec3::splat(100.0), "{direction} {irradiance}");
    let point = Light::Point { position: Vec3::new(1.0, 2.0, 3.0), intensity: Vec3::new(1.0, 0.5, 0.0) };
    assert_eq!(model.lights["bulb"], point);
    let Light::Spot { inner_angle, outer_angle, .. } = model.lights["lamp"] else { panic!() };
    assert!(inner_angle > 0.0 && inner_angle < outer_angle && (outer_angle - 45.0).abs() < 1e-4);
    let dark = with(document, "/extensions/KHR_lights_punctual/lights/1/intensity", json!(-1));
    let (model, warned) = warnings(|| super::super::tests::read(&[("s.gltf", dark.to_string().as_bytes())], "s.gltf"));
    assert!(
        warned.contains("thing/bulb: its intensity is no number >= 0") && model.unwrap().lights.len() == 2,
        "{warned}"
    );
}

#[test]
fn materials_keep_what_is_not_rendered() {
    let mut document = document(json!([{ "mesh": 0 }]));
    document["extensionsUsed"] = json!([
        "KHR_materials_transmission",
        "KHR_materials_ior",
        "KHR_materials_volume",
        "KHR_materials_emissive_strength",
        "KHR_materials_sheen"
    ]);
    document["materials"][0] = json!({
        "name": "jade", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.3,
        "emissiveFactor": [1, 0.5, 0],
        "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.5], "metallicFactor": 0 },
        "extensions": {
            "KHR_materials_emissive_strength": { "emissiveStrength": 4 },
            "KHR_materials_transmission": { "transmissionFactor": 0.5 },
            "KHR_materials_ior": { "ior": 1.6 },
            "KHR_materials_volume": { "thicknessFactor": 0.1, "attenuationDistance": 0.2, "attenuationColor": [0, 1, 0] },
        },
    });
    let (read, warned) = warnings(|| model(&document).unwrap());
    let material = &read.parts[0].material;
    assert_eq!((material.emission, material.alpha_cutoff), (Vec3::new(4.0, 2.0, 0.0), Some(0.6)));
    let kept = material.transmission.as_ref().unwrap();
    assert_eq!((kept.factor, kept.ior, kept.thickness), (0.5, 1.6, 0.1));
    assert_eq!((kept.attenuation_distance, kept.attenuation_color), (0.2, Vec3::Y));
    assert!(gives_light(document.to_string().as_bytes()));
    for expected in [
        "thing: the material \"jade\" transmits light or has a refractive index, which is read and not rendered",
        "thing: the extension \"KHR_materials_sheen\", and maybe others, is not read",
    ] {
        assert!(warned.contains(expected), "{expected} is not in {warned}");
    }
    document["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    let error = model(&document).unwrap_err().to_string();
    assert!(
        error.starts_with("unsupported: the extension \"KHR_draco_mesh_compression\"; accepted: no other"),
        "{error}"
    );
}

#[test]
fn pictures_that_are_missing_leave_the_plain_colour() {
    let mut document = document(json!([{ "mesh": 0 }]));
    document["materials"][0]["pbrMetallicRoughness"] =
        json!({ "baseColorFactor": [1, 0, 0, 1], "baseColorTexture": { "index": 0 } });
    document["materials"][0]["normalTexture"] = json!({ "index": 0 });
    document["textures"] = json!([{ "source": 0 }]);
    document["images"] = json!([{ "uri": "my%20tiles.png" }]);
    let (read, warned) = warnings(|| model(&document).unwrap());
    let Bsdf::MetallicRoughness { base_color, base_color_map: None, .. } = read.parts[0].material.bsdf else {
        panic!()
    };
    assert_eq!((base_color, &read.parts[0].material.normal_map), (Vec3::X, &None));
    let expected = "thing: the picture \"a/my tiles.png\" of the material \"paint\" is left out, its plain colour stays: no \
                    embedded file";
    assert!(warned.contains(expected), "{warned}");
    for image in [json!({ "uri": "data:image/png;base64,AAAA" }), json!({ "bufferView": 0, "mimeType": "image/png" })] {
        let (_, warned) = warnings(|| model(&with(document.clone(), "/images/0", image)).unwrap());
        assert!(warned.contains("found neither a PNG nor a JPEG file"), "{warned}");
    }
}

#[test]
fn buffers_beside_the_file() {
    let document = with(document(json!([{ "mesh": 0 }])), "/buffers/0/uri", json!("square%20one.bin"));
    let text = document.to_string();
    let bytes = bytes();
    let files = [("a/s.gltf", text.as_bytes()), ("a/square one.bin", bytes.as_slice())];
    assert_eq!(read(&files, "a/s.gltf").unwrap().parts.len(), 1);
    let error = read(&files[..1], "a/s.gltf").unwrap_err().to_string();
    assert_eq!(error, "cannot read \"a/square one.bin\", which it names: no embedded file of that name");
    for end in 0..bytes.len() {
        assert!(read(&[files[0], (files[1].0, &bytes[..end])], "a/s.gltf").is_err(), "cut at {end}");
    }
}

#[test]
fn messages() {
    for (pointer, value, expected) in [
        ("/accessors/1/count", json!(5), "accessor 1: 5 entries every 2 bytes, from byte 0 on of a view of 8"),
        ("/accessors/0/count", json!(u32::MAX), "its vertices need 51539607540 bytes; the budget is 33554432"),
        ("/accessors/0/type", json!("VEC2"), "accessor 0: entries of 2 numbers; accepted: 3"),
        ("/accessors/1/componentType", json!(5126), "accessor 1: indices are F32; accepted: U8, U16 or U32"),
        ("/bufferViews/0/byteLength", json!(57), "view 0 has 57 bytes from 0 on of 56"),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), ""),
        ("/bufferViews/0/byteStride", json!(4), "accessor 0: entries of 12 bytes every 4"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(9), "the mesh 0 has the accessor 9, of 2"),
        ("/meshes/0/primitives/0/attributes/NORMAL", json!(1), "accessor 1: entries of 1 numbers; accepted: 3"),
        ("/meshes/0/primitives/0/material", json!(3), "meshes[0].primitives[0].material: Index out of bounds"),
        ("/buffers/0/uri", json!("data:,abc"), "data that is not base64"),
        ("/nodes/0", json!({ "mesh": 0, "children": [0] }), "the node 0 has two parents; nodes must form trees"),
        ("/nodes/0", json!({ "mesh": 7 }), "nodes[0].mesh: Index out of bounds"),
        ("/nodes/0", json!({ "mesh": 0, "scale": [1e30, 1e30, 1e30], "translation": [0, 0, 0] }), "accepted"),
        ("/images", json!([{ "bufferView": 0 }]), "the image 0 lacks what its type needs"),
        ("/images", json!([{}]), "the image 0 lacks what its type needs"),
        ("/cameras", json!([{ "type": "perspective" }]), "the camera 0 lacks what its type needs"),
        (
            "/extensions",
            json!({ "KHR_lights_punctual": { "lights": [{ "type": "spot" }] } }),
            "the light 0 lacks what its type needs",
        ),
        (
            "/nodes/0",
            json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } } }),
            "nodes[0].extensions.khrLightsPunctual.light: Index out of bounds",
        ),
        ("/scenes/0/nodes", json!([0, 0]), "the node 0 has two parents"),
    ] {
        let found = message(pointer, value.clone());
        assert!(
            found.starts_with(expected) && (expected == "accepted") == (found == "accepted"),
            "{pointer} = {value}: {found}"
        );
    }
    let mut corners = bytes();
    corners[54] = 4;
    let uri = json!(format!("data:;base64,{}", STANDARD.encode(corners)));
    assert_eq!(message("/buffers/0/uri", uri), "thing/square: the index 4, of 4 vertices");
    assert!(read_within(&[("s.gltf", document(json!([{}])).to_string().as_bytes())], "s.gltf", 2000).is_err());
}

/// Claims are not believed: a sparse accessor of 4 billion zeros, and a deep chain of nodes.
#[test]
fn claims() {
    let sparse = json!({ "componentType": 5126, "count": u32::MAX, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0],
        "sparse": { "count": 1, "indices": { "bufferView": 1, "componentType": 5123 }, "values": { "bufferView": 0 } } });
    let found = message("/accessors/0", sparse.clone());
    assert!(found.starts_with("its vertices need"), "{found}");
    let small = with(sparse, "/count", json!(4));
    assert_eq!(message("/accessors/0", small), "accepted", "three corners stay 0: no triangle, a warning");
    let chain: Vec<_> =
        (0..100_000).map(|i| if i < 99_999 { json!({ "children": [i + 1] }) } else { json!({ "mesh": 0 }) }).collect();
    assert_eq!(model(&document(json!(chain))).unwrap().parts.len(), 1);
    let deep = format!("{{\"asset\":{}1{}}}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(read(&[("s.gltf", deep.as_bytes())], "s.gltf").is_err());
}

/// A material with a picture in each of three sets of texture coordinates, and how they lie.
fn pictured() -> Value {
    let mut document = document(json!([{ "mesh": 0 }]));
    let png = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNkYPhfDwAChwGA60e6kgAAAABJRU5ErkJggg==";
    document["images"] = json!([{ "uri": format!("data:image/png;base64,{png}") }]);
    document["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648, "minFilter": 9729 }]);
    document["textures"] = json!([{ "source": 0 }, { "source": 0, "sampler": 0 }]);
    let turned =
        json!({ "offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5], "texCoord": 1 });
    document["materials"][0] = json!({
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } },
        "emissiveTexture": { "index": 1, "extensions": { "KHR_texture_transform": turned } },
        "occlusionTexture": { "index": 0, "texCoord": 2 },
    });
    document["meshes"][0]["primitives"][0]["attributes"] = json!({ "POSITION": 0, "TEXCOORD_0": 2, "TEXCOORD_1": 3 });
    let (first, second) = ([[0.0f32, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], [[0.0f32, 0.5]; 4]);
    let mut data = bytes();
    data.extend(first.iter().chain(&second).flatten().flat_map(|x| x.to_le_bytes()));
    document["buffers"][0] = json!({ "byteLength": 120, "uri": format!("data:;base64,{}", STANDARD.encode(data)) });
    for at in [56, 88] {
        document["bufferViews"]
            .as_array_mut()
            .unwrap()
            .push(json!({ "buffer": 0, "byteOffset": at, "byteLength": 32 }));
    }
    for view in [2, 3] {
        let accessor = json!({ "bufferView": view, "componentType": 5126, "count": 4, "type": "VEC2" });
        document["accessors"].as_array_mut().unwrap().push(accessor);
    }
    document
}

#[test]
fn pictures_wrap_lie_and_take_a_second_set() {
    let (model, warned) = warnings(|| model(&pictured()).unwrap());
    let (material, mesh) = (&model.parts[0].material, &model.parts[0].mesh);
    for (position, uv) in mesh.positions.iter().zip(&mesh.texcoords) {
        assert_eq!(position.truncate(), *uv);
    }
    assert_eq!(mesh.second_texcoords, vec![Vec2::new(0.0, 0.5); mesh.positions.len()]);
    let Bsdf::MetallicRoughness { base_color_map: Some(base), .. } = &material.bsdf else { panic!() };
    assert_eq!((base.wrap, base.second, base.mips), ([Wrap::Repeat; 2], false, true));
    assert_eq!(base.place([Vec2::new(0.25, 0.75), Vec2::NAN]), Vec2::new(0.25, 0.75));
    let glow = material.emission_map.as_ref().unwrap();
    assert_eq!((glow.wrap, glow.second, glow.mips), ([Wrap::Clamp, Wrap::Mirror], true, false));
    // The extension's own example: the picture's lower left quarter, turned clockwise.
    for (uv, expected) in [([0.0, 0.0], [0.0, 1.0]), ([1.0, 0.0], [0.0, 0.5]), ([0.0, 1.0], [0.5, 1.0])] {
        let found = glow.place([Vec2::NAN, Vec2::from(uv)]);
        assert!(found.abs_diff_eq(Vec2::from(expected), 1e-6), "{uv:?}: {found}");
    }
    assert!(material.occlusion_map.is_none());
    assert!(warned.contains("\"material 0\" has pictures of more than two sets of texture coordinates"), "{warned}");
}

#[test]
fn transforms_of_pictures_that_are_none() {
    for (value, expected) in [
        (json!({ "offset": 1 }), "the KHR_texture_transform of the texture 1: invalid type"),
        (json!({ "scale": [1, 2, 3] }), "the KHR_texture_transform of the texture 1: "),
        (json!({ "rotation": "left" }), "the KHR_texture_transform of the texture 1: invalid type"),
        (json!({ "texCoord": -1 }), "the KHR_texture_transform of the texture 1: invalid value"),
        (json!({ "scale": [1e39, 1] }), "the KHR_texture_transform of the texture 1: "),
        (json!({ "scale": [0, 0] }), ""),
        (json!({ "offset": [1e38, 0], "scale": [3e38, 3e38] }), ""),
    ] {
        let pointer = "/materials/0/emissiveTexture/extensions/KHR_texture_transform";
        match model(&with(pictured(), pointer, value.clone())) {
            Ok(_) => assert_eq!(expected, "", "{value}"),
            Err(error) => {
                let found = error.to_string();
                let found = found.trim_start_matches("the file is corrupt: ");
                assert!(!expected.is_empty() && found.starts_with(expected), "{value}: {found}");
            }
        }
    }
    let short = with(pictured(), "/accessors/3/count", json!(3));
    let found = model(&short).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(found.ends_with("3 texture coordinates for 4 positions"), "{found}");
    assert!(model(&with(pictured(), "/samplers/0/wrapS", json!(1))).is_err());
    assert!(model(&with(pictured(), "/textures/1/sampler", json!(7))).is_err());
    let text = pictured().to_string();
    for end in 0..text.len() {
        survive(&[("s.gltf", &text.as_bytes()[..end])], "s.gltf");
    }
}

#[test]
fn cameras_look_along_their_nodes() {
    let mut document = document(json!([
        { "children": [1, 2] },
        { "camera": 0, "name": "Camera", "translation": [0, 1, 4] },
        { "camera": 1 },
    ]));
    document["cameras"] = json!([
        { "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } },
        { "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 1 } },
    ]);
    let (read, warned) = warnings(|| model(&document).unwrap());
    let [(name, camera)] = &read.cameras[..] else { panic!() };
    assert_eq!(
        (name.as_str(), camera.position, camera.target),
        ("Camera", Vec3::new(0.0, 1.0, 4.0), Vec3::new(0.0, 1.0, 3.0))
    );
    assert!((camera.fov - 57.29578).abs() < 1e-4);
    assert!(warned.contains("orthographic cameras are not rendered"), "{warned}");
    assert!(!gives_light(document.to_string().as_bytes()));
}

#[test]
fn flat_nodes_are_left_out_with_a_warning() {
    let flat = document(json!([{ "mesh": 0, "scale": [1, 0, 1], "name": "shadow" }]));
    let (read, warned) = warnings(|| model(&flat).unwrap());
    assert!(read.parts.is_empty() && warned.contains("thing/shadow: its transform has no inverse"), "{warned}");
}

#[test]
fn every_truncation() {
    let text = document(json!([{ "mesh": 0 }])).to_string();
    for end in 0..text.len() {
        survive(&[("s.gltf", &text.as_bytes()[..end])], "s.gltf");
    }
}
