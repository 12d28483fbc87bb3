//! Scenes loaded with their assets.

use std::sync::Arc;

use proptest::prelude::*;
use tyndall_scene::assets::{Directory, Embedded};
use tyndall_scene::description::{Optics, Phase};
use tyndall_scene::glam::{Vec3, Vec4};
use tyndall_scene::image::{Image, exr};
use tyndall_scene::volume::Budget;
use tyndall_scene::{Document, Field, LoadError, Scene, World};

use crate::corrupt::check_finite;
use crate::{BOX, CAMERA, SCENES};

const SMOKE: &[u8] = include_bytes!("../../../../scenes/smoke.vdb");
const KNOT: &[u8] = include_bytes!("../../../../scenes/tetrahedra.vtu");
const SKY: &[u8] = include_bytes!("../../../../scenes/sky.exr");
const TILES: &[u8] = include_bytes!("../../../../scenes/tiles.png");
const ENOUGH: Budget = Budget(1 << 30);

fn scene(index: usize) -> Scene {
    let (name, text) = SCENES[index];
    Document::new(name, text).parse().unwrap()
}

fn load(scene: Scene) -> Result<World, LoadError> {
    let assets = [("smoke.vdb", SMOKE), ("sky.exr", SKY), ("tetrahedra.vtu", KNOT), ("tiles.png", TILES)];
    World::load(scene, &Embedded(assets.to_vec()), ENOUGH)
}

fn hash(scene: &Scene, assets: &[(&str, &[u8])]) -> String {
    World::load(scene.clone(), &Embedded(assets.to_vec()), ENOUGH).unwrap().hash
}

#[test]
fn the_hash_tells_worlds_apart() {
    let plume = scene(0);
    let smoke = [("smoke.vdb", SMOKE)];
    let first = hash(&plume, &smoke);
    assert_eq!(first.len(), 64);
    assert_eq!(hash(&plume, &smoke), first, "the same twice");
    let json = Document::new("s.json", serde_json::to_string(&plume).unwrap()).parse().unwrap();
    assert_eq!(hash(&json, &smoke), first, "the same in JSON");
    for (path, value) in [
        ("camera.fov", "33.00001"),
        ("film.exposure", "0.9"),
        ("media.plume.optics.coefficients.sigma_a", "1.6"),
        ("media.plume.density.grid.name", "temperature"),
    ] {
        let mut changed = plume.clone();
        changed.set(path, value).unwrap();
        assert_ne!(hash(&changed, &smoke), first, "{path}");
    }
    let mut marched = plume.clone();
    marched.set("techniques.march.step", "0.5").unwrap();
    assert_eq!(hash(&marched, &smoke), first, "how it is rendered does not count");
    // Bytes that make no difference to the voxels still are others.
    let longer = [SMOKE, b"\0"].concat();
    assert_ne!(hash(&plume, &[("smoke.vdb", &longer)]), first);
}

/// Optics that are changed in place are those of a world loaded with them; what a file could not say is refused.
#[test]
fn optics_change_in_place() {
    let optics = |sigma_s: f32, g: f32| Optics::Coefficients {
        sigma_s: Vec3::splat(sigma_s),
        sigma_a: Vec3::ONE,
        emission: Vec3::ZERO,
        phase: Phase::Hg { g },
    };
    let mut world = load(scene(0)).unwrap();
    let first = world.hash.clone();
    world.set_optics("plume", optics(3.0, 0.4)).unwrap();
    let loaded = load(world.scene.clone()).unwrap();
    let (here, there) = (&world.volumes[0], &loaded.volumes[0]);
    assert_eq!(here.optics, there.optics);
    assert_eq!(format!("{:?}", here.phase), format!("{:?}", there.phase));
    let second = world.hash.clone();
    assert_ne!(first, second);
    for (medium, wrong, message) in [
        ("smoke", optics(1.0, 0.0), "media.smoke: found no such medium; accepted: plume"),
        ("plume", optics(-1.0, 0.0), "media.plume.optics.coefficients.sigma_s"),
        ("plume", optics(f32::NAN, 0.0), "media.plume.optics.coefficients.sigma_s"),
        ("plume", optics(1.0, 2.0), "media.plume.optics.coefficients.phase.hg.g"),
    ] {
        let error = world.set_optics(medium, wrong).unwrap_err().to_string();
        assert!(error.starts_with(message), "{error}");
        assert_eq!((&world.hash, &world.volumes[0].optics), (&second, &loaded.volumes[0].optics), "nothing is changed");
    }
}

/// A header and its voxels are both part of the world.
#[test]
fn the_hash_has_the_data_file_of_a_header() {
    let text = format!("{CAMERA}[media.a]\noptics.coefficients = {{}}\ndensity.grid.file = \"a.nhdr\"");
    let scene = Document::new("s.toml", text).parse().unwrap();
    let header: &[u8] = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: raw\ndata file: a.raw\n";
    let hashes =
        [&[1u8, 2] as &[u8], &[1, 3], &[1, 2, 3]].map(|data| hash(&scene, &[("a.nhdr", header), ("a.raw", data)]));
    assert!(hashes[0] != hashes[1] && hashes[0] != hashes[2] && hashes[1] != hashes[2]);
}

/// A folder's slices are read from disk as from memory, and each is part of the world.
#[test]
fn a_folder_of_slices() {
    let slices: [(&str, &[u8]); 3] = [
        ("ct/a.dcm", include_bytes!("../../src/volume/fixtures/ct/a.dcm")),
        ("ct/b.dcm", include_bytes!("../../src/volume/fixtures/ct/b.dcm")),
        ("ct/c.dcm", include_bytes!("../../src/volume/fixtures/ct/c.dcm")),
    ];
    let scene = |file: &str, more: &str| {
        let density = format!("density.grid = {{ file = \"{file}\"{more} }}");
        let text = format!("{CAMERA}[media.a]\noptics.coefficients = {{}}\n{density}");
        Document::new("s.toml", text).parse().unwrap()
    };
    let first = hash(&scene("ct", ""), &slices);
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("ct/other")).unwrap();
    for (name, bytes) in slices {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let directory = Directory(folder.path().into());
    assert_eq!(World::load(scene("ct", ""), &directory, ENOUGH).unwrap().hash, first);
    World::load(scene("ct/", ", name = \"1.2.840.7\""), &directory, ENOUGH).unwrap();
    // An empty element after the voxels, which changes none.
    let longer = [slices[1].1, &[0xfc, 0xff, 0xfc, 0xff, b'O', b'B', 0, 0, 0, 0, 0, 0]].concat();
    let longer = [slices[0], ("ct/b.dcm", longer.as_slice()), slices[2]];
    assert_ne!(hash(&scene("ct", ""), &longer), first);
    let error = World::load(scene("ct", ", name = \"1\""), &directory, ENOUGH).unwrap_err().to_string();
    assert_eq!(
        error,
        "media.a.density.grid.name: \"ct\": found the series \"1.2.840.7\"; accepted: `name`, the SeriesInstanceUID of one"
    );
}

#[test]
fn an_asset_longer_than_the_budget_is_not_read() {
    let error = World::load(scene(0), &Embedded(vec![("smoke.vdb", SMOKE)]), Budget(1000)).unwrap_err().to_string();
    assert!(error.contains("at most 1000 are read"), "{error}");
}

#[test]
fn media_share_a_grid_and_the_budget() {
    let mut twice = scene(0);
    let mut other = twice.media["plume"].clone();
    other.transform.translate = Vec3::X;
    twice.media.insert("other".into(), other);
    let world = load(twice.clone()).unwrap();
    let [Field::Grid(a), Field::Grid(b)] = [&world.volumes[0].field, &world.volumes[1].field] else { panic!() };
    assert!(Arc::ptr_eq(a, b));
    assert_eq!(world.volumes.iter().map(|v| v.name.as_str()).collect::<Vec<_>>(), ["other", "plume"]);

    // Exactly enough for one grid is enough for two media of it, but not for a second grid.
    let bytes = a.bytes();
    let smoke = Embedded(vec![("smoke.vdb", SMOKE)]);
    World::load(twice, &smoke, Budget(bytes)).unwrap();
    let fire = scene(1);
    let world = World::load(fire.clone(), &smoke, ENOUGH).unwrap();
    let all = world.volumes.iter().map(|volume| match &volume.field {
        Field::Grid(grid) => grid.bytes(),
        _ => 0,
    });
    let all: u64 = all.sum();
    World::load(fire.clone(), &smoke, Budget(all)).unwrap();
    let message = World::load(fire, &smoke, Budget(all - 1)).unwrap_err().to_string();
    assert!(message.starts_with("media.smoke.density.grid.file") && message.contains("budget"), "{message}");
}

/// A map's bytes count in the hash, its texels against what the voxels leave of the budget; it is turned and scaled.
#[test]
fn environment_maps() {
    let mut sky = scene(6);
    sky.set("lights.sky.environment.scale", "1").unwrap();
    let smoke = ("smoke.vdb", SMOKE);
    let first = World::load(sky.clone(), &Embedded(vec![smoke, ("sky.exr", SKY)]), ENOUGH).unwrap();
    let map = first.environment.unwrap();
    assert_eq!((map.width, map.height, map.pixels.len()), (256, 128, 256 * 128));
    sky.set("lights.sky.environment.scale", "[2, 0, 1]").unwrap();
    sky.set("lights.sky.environment.rotate", "450").unwrap();
    let changed = load(sky.clone()).unwrap();
    assert_ne!(changed.hash, first.hash);
    let changed = changed.environment.unwrap();
    let pixel = map.pixels[0];
    assert_eq!(changed.pixels[0], [2.0 * pixel[0], 0.0, pixel[2]]);
    assert_eq!(changed.rotation, std::f32::consts::FRAC_PI_2);

    let hdr = |texel: &[u8; 4]| [&b"#?RGBE\n\n-Y 1 +X 1\n"[..], texel].concat();
    let with = |bytes: Vec<u8>, budget| {
        World::load(sky.clone(), &Embedded(vec![smoke, ("sky.exr", &bytes)]), Budget(budget)).map(|world| world.hash)
    };
    let hash = with(hdr(&[9, 9, 9, 129]), 1 << 30).unwrap();
    assert_eq!(hash, with(hdr(&[9, 9, 9, 129]), 1 << 30).unwrap());
    assert_ne!(hash, with(hdr(&[9, 9, 9, 130]), 1 << 30).unwrap());
    let voxels = match &load(scene(0)).unwrap().volumes[0].field {
        Field::Grid(grid) => grid.bytes(),
        other => panic!("{other:?}"),
    };
    // What decoding takes at once: a texel, a line of bytes, and the file itself.
    let least = voxels + hdr(&[0; 4]).len() as u64;
    with(hdr(&[0; 4]), least).unwrap();
    let message = with(hdr(&[0; 4]), voxels + 10).unwrap_err().to_string();
    assert!(message.starts_with("lights.sky.environment.file: cannot read \"sky.exr\""), "{message}");
    let message = with(SKY.to_vec(), voxels + (1 << 18)).unwrap_err().to_string();
    let expected = "lights.sky.environment.file: \"sky.exr\": a picture of 256 x 128 pixels needs 589824 bytes; the budget is 262144";
    assert_eq!(message, expected);
}

#[test]
fn what_is_no_environment_map() {
    let refusal = |file: &str| {
        let text = format!("{CAMERA}[lights.sky.environment]\nfile = \"{file}\"");
        let document = Document::new("s.toml", text);
        let negative = Image { width: 2, height: 1, pixels: vec![[0.0; 3], [0.0, 0.0, -1.0]], ..Image::default() };
        let negative = exr::encode(&negative).unwrap();
        let assets = Embedded(vec![("smoke.vdb", SMOKE), ("cut.exr", &SKY[..9000]), ("negative.exr", &negative)]);
        World::load(document.parse().unwrap(), &assets, ENOUGH).unwrap_err().locate(&document).to_string()
    };
    for (file, expected) in [
        (
            "no.exr",
            "s.toml:5:8: lights.sky.environment.file: cannot read \"no.exr\": no embedded file of that name; accepted: a \
             path relative to the scene file",
        ),
        (
            "smoke.vdb",
            "s.toml:5:8: lights.sky.environment.file: \"smoke.vdb\": found neither an OpenEXR nor a Radiance file; \
             accepted: these two",
        ),
        (
            "negative.exr",
            "s.toml:5:8: lights.sky.environment.file: \"negative.exr\": the pixel in column 1, row 0, scaled, is \
             [0.0, 0.0, -1.0]; accepted: three finite numbers >= 0 (from 0 at the top left)",
        ),
    ] {
        assert_eq!(refusal(file), expected);
    }
    let message = refusal("cut.exr");
    assert!(message.starts_with("s.toml:5:8: lights.sky.environment.file: \"cut.exr\": EXR: "), "{message}");
}

/// What loading says, at its place in the text; `smoke.vdb`, a truncated `cut.vdb` and others are there.
fn refusal(text: &str) -> String {
    let document = Document::new("s.toml", format!("{CAMERA}[media.a]\noptics.coefficients = {{}}\n{text}"));
    let assets = Embedded(vec![
        ("smoke.vdb", SMOKE),
        ("cut.vdb", &SMOKE[..SMOKE.len() / 2]),
        ("text.vdb", b"no volume"),
        ("text.nii", b"no volume"),
        ("raw.dat", b"no volume"),
        ("text.obj", b"no volume"),
        ("bare", b"no volume"),
    ]);
    match World::load(document.parse().unwrap(), &assets, ENOUGH) {
        Ok(_) => "loaded".into(),
        Err(error) => error.locate(&document).to_string(),
    }
}

#[test]
fn what_cannot_be_loaded() {
    let cases = [
        (
            "density.grid.file = \"no.vdb\"",
            "s.toml:6:21: media.a.density.grid.file: cannot read \"no.vdb\": no embedded file of that name; accepted: a \
             path relative to the scene file",
        ),
        (
            "density.grid = { file = \"smoke.vdb\", name = \"smoke\" }",
            "s.toml:6:45: media.a.density.grid.name: \"smoke.vdb\": found no grid named \"smoke\"; accepted: the grids \
             \"density\", \"temperature\"",
        ),
        (
            "density.grid.file = \"smoke.vdb\"",
            "s.toml:6:9: media.a.density.grid.name: \"smoke.vdb\": found the grids \"density\", \"temperature\"; \
             accepted: the name of one grid",
        ),
        (
            "density.grid = { file = \"raw.dat\", raw = { dims = [2, 1, 1], type = \"f32\", spacing = 1 } }",
            "s.toml:6:42: media.a.density.grid.raw: \"raw.dat\": found 9 bytes; accepted: 8, for 2 x 1 x 1 voxels of f32 \
             after 0 bytes",
        ),
        (
            "density.grid.file = \"text.obj\"",
            "s.toml:6:21: media.a.density.grid.file: \"text.obj\": unsupported: extension .obj; accepted: .vdb, .nvdb, .nii, \
             .nii.gz, .nrrd, .nhdr, .npy, .mhd, .mha, .vti, .raw, .bin, .dat or a folder of DICOM files",
        ),
        (
            "density.grid.file = \"bare\"",
            "s.toml:6:21: media.a.density.grid.file: \"bare\": unsupported: no file extension; accepted: .vdb, .nvdb, .nii, \
             .nii.gz, .nrrd, .nhdr, .npy, .mhd, .mha, .vti, .raw, .bin, .dat or a folder of DICOM files",
        ),
        (
            "density.grid.file = \"text.vdb\"",
            "s.toml:6:21: media.a.density.grid.file: \"text.vdb\": not an OpenVDB file: it begins with \
             6e 6f 20 76 6f 6c 75 6d; a VDB file begins with 20 42 44 56 00 00 00 00",
        ),
        (
            "density.homogeneous = { min = [0, 0, 0], max = [1, 1, 1] }\ntransform.scale = 1e-39\n\
             transform.rotate = [30, 0, 0]",
            "s.toml:7:1: media.a.transform: found a map to the world that 32-bit numbers do not hold or \
             that has no inverse; accepted: a scale and a box that are neither too large nor too small together",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(refusal(text), expected);
    }
    for name in ["density", "temperature"] {
        let message = refusal(&format!("density.grid = {{ file = \"cut.vdb\", name = \"{name}\" }}"));
        assert!(message.starts_with("s.toml:6:25: media.a.density.grid.file: \"cut.vdb\": the file "), "{message}");
    }
    let message = refusal("density.grid.file = \"text.nii\"");
    assert!(message.contains("not a NIfTI file"), "{message}");
}

#[test]
fn files_are_read_beside_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("smoke.vdb"), SMOKE).unwrap();
    let assets = Directory(folder.path().into());
    assert_eq!(World::load(scene(0), &assets, ENOUGH).unwrap().hash, load(scene(0)).unwrap().hash);
    let mut missing = scene(0);
    missing.set("media.plume.density.grid.file", "no/such.vdb").unwrap();
    assert!(matches!(World::load(missing, &assets, ENOUGH), Err(LoadError::Asset { .. })));
    let mut folder = scene(0);
    folder.set("media.plume.density.grid.file", ".").unwrap();
    let message = World::load(folder.clone(), &assets, ENOUGH).unwrap_err().to_string();
    assert!(message.ends_with("a folder of 1 files, none of which is a DICOM image; accepted: the slices of a series"));
    folder.set("media.plume.density.grid.file", "no/such/").unwrap();
    assert!(matches!(World::load(folder, &assets, ENOUGH), Err(LoadError::Asset { .. })));
}

#[test]
fn a_scene_built_in_code_is_checked() {
    let mut bad = scene(0);
    bad.camera.fov = f32::NAN;
    let message = load(bad).unwrap_err().to_string();
    assert_eq!(message, "camera.fov: found null; accepted: an angle in degrees between 0 and 180 (exclusive)");
    let mut bad = scene(0);
    bad.film.size = [0, 0];
    assert!(load(bad).unwrap_err().to_string().starts_with("film.size: found [0, 0]"));
}

fn extreme() -> impl Strategy<Value = f32> {
    prop_oneof![
        prop::sample::select(vec![1e38, -1e38, f32::MAX, 1e30, 1e-30, f32::MIN_POSITIVE, 1e-45, 0.0, -0.0, 1.0, 90.0]),
        prop::num::f32::NORMAL
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Whatever the parser accepts is refused when it is loaded, or has finite maps that are each other's inverse.
    #[test]
    fn extreme_values(
        min in prop::array::uniform3(extreme()),
        max in prop::array::uniform3(extreme()),
        scale in prop::array::uniform3(extreme()),
        rotate in prop::array::uniform3(extreme()),
        translate in prop::array::uniform3(extreme()),
        height in extreme(),
        base in extreme(),
        grid in any::<bool>(),
        exponential in any::<bool>(),
    ) {
        let density = if grid {
            "density.grid = { file = \"smoke.vdb\", name = \"density\" }".to_owned()
        } else if exponential {
            format!("density.exponential = {{ min = {min:?}, max = {max:?}, base = {base:?}, scale_height = {height:?} }}")
        } else {
            format!("density.homogeneous = {{ min = {min:?}, max = {max:?} }}")
        };
        let text = format!(
            "{CAMERA}[media.a]\noptics.coefficients = {{}}\n{density}\n\
             transform = {{ scale = {scale:?}, rotate = {rotate:?}, translate = {translate:?} }}"
        );
        // Decoding the plume takes a while, and its map does not depend on its voxels.
        let assets: &[(&str, &[u8])] = if grid && height > 1.0 { &[("smoke.vdb", SMOKE)] } else { &[] };
        if let Ok(scene) = Document::new("s.toml", text).parse()
            && let Ok(world) = World::load(scene, &Embedded(assets.to_vec()), ENOUGH)
        {
            check_finite(&world);
        }
    }
}

#[test]
fn small_and_large_media_have_maps() {
    for scale in [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9] {
        let text = format!(
            "{CAMERA}{BOX}optics.coefficients = {{}}\ntransform = {{ scale = {scale}, rotate = [10, 20, 30] }}"
        );
        let world = load(Document::new("s.toml", text).parse().unwrap()).unwrap();
        let volume = &world.volumes[0];
        let identity = volume.unit_from_world * volume.world_from_unit;
        for column in 0..4 {
            let mut axis = Vec4::ZERO;
            axis[column] = 1.0;
            assert!((identity.col(column) - axis).length() < 1e-5, "{scale}: {identity:?}");
        }
    }
}

/// A surface beyond where single precision has depths is refused, by name.
#[test]
fn a_surface_out_of_reach() {
    let text = format!("{CAMERA}[surfaces.ball]\nshape.sphere = {{ center = [0, 0, 0], radius = 1e20 }}\n");
    let far = load(Document::new("s.toml", text).parse().unwrap()).unwrap_err().to_string();
    assert!(
        far.starts_with("surfaces.ball: found a corner at") && far.ends_with("at most 1e9 m from the origin"),
        "{far}"
    );
}

#[test]
fn every_shipped_scene_loads_whose_assets_are_shipped() {
    for (index, (name, _)) in SCENES.iter().enumerate() {
        match load(scene(index)) {
            Ok(world) => check_finite(&world),
            Err(error) => {
                let expected = ["brain.toml", "spot.toml"].contains(name) && matches!(error, LoadError::Asset { .. });
                assert!(expected, "{name}: {error}");
            }
        }
    }
}

/// A mesh comes from its file, counts for the hash, is shared by media that name it, and says what it has none of.
#[test]
fn meshes() {
    let knot = scene(4);
    let assets = [("tetrahedra.vtu", KNOT)];
    let world = World::load(knot.clone(), &Embedded(assets.to_vec()), ENOUGH).unwrap();
    let Field::Mesh(mesh) = &world.volumes[0].field else { panic!() };
    assert_eq!(mesh.count(), 18917);
    let inside = world.volumes[0].unit_from_world.transform_point3(Vec3::new(0.0, -1.0 / 3.0, 0.0));
    assert!(world.volumes[0].field.within(inside).is_some_and(|value| value > 0.3));
    assert_eq!(world.volumes[0].field.within(Vec3::splat(0.01)), None);
    let longer = [KNOT, b"\n"].concat();
    assert_ne!(hash(&knot, &[("tetrahedra.vtu", &longer)]), world.hash);

    let mut other = knot.clone();
    other.set("media.knot.density.mesh.name", "\"heat\"").unwrap();
    let error = World::load(other, &Embedded(assets.to_vec()), ENOUGH).unwrap_err().to_string();
    let path = "media.knot.density.mesh.name: \"tetrahedra.vtu\": ";
    let expected = "found no array named \"heat\" on points or cells; accepted: the array \"density\"";
    assert_eq!(error, path.to_owned() + expected);
}
