//! The published JSON Schema says what the parser does.

use serde_json::{Value, json};
use tyndall_scene::{Document, Scene};

use crate::SCENES;

fn validator() -> jsonschema::Validator {
    jsonschema::validator_for(&serde_json::to_value(Scene::schema()).unwrap()).unwrap()
}

/// A scene file as data, before the parser has filled in defaults.
fn raw(text: &str) -> Value {
    serde_json::to_value(text.parse::<::toml::Table>().unwrap()).unwrap()
}

#[test]
fn shipped_scenes_are_valid() {
    let validator = validator();
    for (name, text) in SCENES {
        let errors: Vec<_> = validator.iter_errors(&raw(text)).map(|error| error.to_string()).collect();
        assert!(errors.is_empty(), "{name}: {errors:?}");
        let scene = Document::new(name, text).parse().unwrap();
        assert!(validator.is_valid(&serde_json::to_value(scene).unwrap()), "{name} as it is written");
    }
    assert!(validator.is_valid(&serde_json::to_value(Scene::default()).unwrap()));
}

/// Sets a value by its JSON pointer, adding objects on the way.
fn with(mut scene: Value, pointer: &str, value: Value) -> Value {
    let mut node = &mut scene;
    for key in pointer.split('/').skip(1) {
        node = match key.parse::<usize>() {
            Ok(index) => &mut node[index],
            Err(_) => &mut node[key],
        };
    }
    *node = value;
    scene
}

/// A noise density with one more field.
fn noise(field: &str, value: Value) -> Value {
    let mut noise = json!({ "min": [0, 0, 0], "max": [1, 1, 1], "scale": 1 });
    noise[field] = value;
    json!({ "noise": noise })
}

#[test]
fn what_the_parser_refuses_is_invalid() {
    let validator = validator();
    let fog = raw(SCENES[2].1);
    let brain = raw(SCENES[3].1);
    let cornell = raw(SCENES[7].1);
    let cases = [
        (&fog, "/camera/fov", json!(0)),
        (&fog, "/camera/fov", json!(180)),
        (&fog, "/camera/fov", json!("wide")),
        (&fog, "/camera/fvo", json!(40)),
        (&fog, "/camera/position", json!([0, 0])),
        (&fog, "/camera", json!({})),
        (&fog, "/film/size", json!([0, 10])),
        (&fog, "/film/size", json!([10, 100_000])),
        (&fog, "/film/size", json!([10, 1.5])),
        (&fog, "/film/size", json!([10, 20, 30])),
        (&fog, "/lights/sky/constant/radiance", json!(-1)),
        (&fog, "/lights/sky/constant/radiance", json!([1, -1, 1])),
        (&fog, "/lights/sky/constant/radiance", json!([1, 1])),
        (&fog, "/lights/sky", json!({ "sun": {} })),
        (&fog, "/lights/sky", json!({})),
        (&fog, "/lights/sky", json!({ "environment": {} })),
        (&fog, "/lights/sky", json!({ "environment": { "file": "a.exr", "rotate": "left" } })),
        (&fog, "/lights/sky", json!({ "environment": { "file": "a.exr", "scale": -1 } })),
        (&fog, "/lights/lamp/spot/outer_angle", json!(180)),
        (&fog, "/lights/lamp/spot/colour", json!(1)),
        (&fog, "/media/fog/density/exponential/scale_height", json!(0)),
        (&fog, "/media/fog/density", json!({ "sphere": { "center": [0, 0, 0], "radius": -1 } })),
        (&fog, "/media/fog/density", noise("octaves", json!(13))),
        (&fog, "/media/fog/density", noise("octaves", json!(1.5))),
        (&fog, "/media/fog/density", noise("seed", json!(-1))),
        (&fog, "/media/fog/density", noise("lacunarity", json!(0.5))),
        (&fog, "/media/fog/density", noise("amplitude", json!(1))),
        (&fog, "/media/fog/density", json!({ "expression": { "min": [0, 0, 0], "max": [1, 1, 1], "wgsl": 1 } })),
        (&fog, "/media/fog/optics/coefficients/sigma_s", json!(-0.1)),
        (&fog, "/media/fog/optics/coefficients/phase", json!("mie")),
        (&fog, "/media/fog/optics/coefficients/phase", json!({ "draine": { "g": 0.5 } })),
        (&fog, "/media/fog/optics/coefficients/phase", json!({ "droplets": { "diameter": 51 } })),
        (&fog, "/media/fog/optics/coefficients/phase", json!({ "tabulated": { "angles": [0], "values": [1] } })),
        (
            &fog,
            "/media/fog/optics/coefficients/phase",
            json!({ "tabulated": { "angles": [0, 181], "values": [1, 1] } }),
        ),
        (&fog, "/media/fog/optics/coefficients/phase", json!({ "mie": { "refractive_index": [1.33], "radius": 1 } })),
        (
            &fog,
            "/media/fog/optics/coefficients/phase",
            json!({ "mie": { "refractive_index": [1.33, -1], "radius": 1 } }),
        ),
        (&fog, "/media/fog/optics/coefficients/phase/hg/g", json!(1)),
        (&fog, "/media/smoke/transform/scale", json!([1, 0, 1])),
        (&fog, "/media/smoke/density/grid/raw", json!({ "dims": [1, 0, 1], "type": "u8", "spacing": 1 })),
        (&fog, "/media/smoke/density/grid/raw", json!({ "dims": [1, 1, 1], "type": "u7", "spacing": 1 })),
        (
            &fog,
            "/media/smoke/density/grid/raw",
            json!({ "dims": [1, 1, 1], "type": "u8", "spacing": 1, "offset": 0.5 }),
        ),
        (&fog, "/techniques", json!({ "march": { "step": [1] } })),
        (&fog, "/techniques", json!({ "march": 3 })),
        (&fog, "/light", json!({})),
        (&brain, "/media/brain/optics/transfer/stops", json!([])),
        (&brain, "/media/brain/optics/transfer/stops/0/opacity", json!(1.5)),
        (&brain, "/media/brain/optics/transfer/unit_length", json!(0)),
        (&brain, "/media/brain/optics/transfer/map", json!("jet")),
        (&brain, "/media/brain/optics/transfer/opacity", json!(2)),
        (&brain, "/media/brain/optics/transfer/window", json!({ "level": 1 })),
        (&brain, "/media/brain/optics/transfer/shading", json!({ "shininess": 0 })),
        (&brain, "/media/brain/optics/transfer/gradient_opacity", json!([{ "gradient": -1, "factor": 1 }])),
        (&brain, "/media/brain/optics/transfer/isosurfaces", json!([{ "value": 1, "color": -1 }])),
        (&brain, "/media/brain/optics/transfer/stops/0/color", json!(-1)),
        (&brain, "/media/brain/clip", json!({ "planes": [{ "point": [0, 0, 0], "normal": [0, 0] }] })),
        (&fog, "/media/fog/temperature", json!({ "name": "heat" })),
        (&fog, "/media/fog/temperature", json!({ "file": "a.vdb", "kelvin": 0 })),
        (&fog, "/media/fog/color", json!({ "file": "a.vdb", "names": ["r", "g"] })),
        (&brain, "/media/brain/clip", json!({ "box": { "min": [0, 0, 0] } })),
        (&cornell, "/surfaces/floor", json!({})),
        (&cornell, "/surfaces/floor/radiance", json!(-1)),
        (&cornell, "/surfaces/floor/colour", json!(1)),
        (&cornell, "/surfaces/floor/double_sided", json!(1)),
        (&cornell, "/surfaces/floor/shape", json!({ "sphere": { "center": [0, 0, 0], "radius": 0 } })),
        (&cornell, "/surfaces/floor/shape", json!({ "cone": {} })),
        (&cornell, "/surfaces/floor/shape", json!({ "quad": { "corner": [0, 0, 0], "edges": [[1, 0, 0]] } })),
        (&cornell, "/surfaces/floor/shape", json!({ "polygons": { "vertices": [[0, 0, 0]], "faces": [[-1, 0, 0]] } })),
        (&cornell, "/materials/white", json!({ "lambert": {} })),
        (&cornell, "/materials/white", json!({ "metallic_roughness": { "roughness": 2 } })),
        (&cornell, "/materials/white", json!({ "lambert": { "reflectance": 1, "reflectance_map": 1 } })),
    ];
    for (scene, pointer, value) in cases {
        let bad = with(scene.clone(), pointer, value.clone());
        let refused = Document::new("s.json", bad.to_string()).parse().is_err();
        assert!(refused, "the parser takes {pointer} = {value}");
        assert!(!validator.is_valid(&bad), "the schema takes {pointer} = {value}");
    }
}

#[test]
fn every_field_is_described() {
    fn walk(schema: &Value, path: &str, missing: &mut Vec<String>) {
        for (name, field) in schema.get("properties").and_then(Value::as_object).into_iter().flatten() {
            let path = format!("{path}.{name}");
            // A variant's name is described beside it, its fields within it.
            let described = field.get("description").is_some() || field.get("type") == Some(&json!("object"));
            if !described && schema.get("description").is_none() {
                missing.push(path.clone());
            }
            walk(field, &path, missing);
        }
        for group in ["oneOf", "anyOf"] {
            for variant in schema.get(group).and_then(Value::as_array).into_iter().flatten() {
                walk(variant, path, missing);
            }
        }
    }
    let schema = serde_json::to_value(Scene::schema()).unwrap();
    let mut missing = Vec::new();
    walk(&schema, "scene", &mut missing);
    for (name, definition) in schema["$defs"].as_object().unwrap() {
        walk(definition, name, &mut missing);
    }
    assert!(missing.is_empty(), "{missing:?}");
}
