//! Takes a scene to Mitsuba 3, and its pictures back. `cargo xtask bench mitsuba` calls it.
//!
//! ```text
//! mitsuba export SCENE FOLDER PATH=VALUE... writes FOLDER/scene.json, its voxels, surfaces and sky, which render.py reads
//! mitsuba import FOLDER OUT.exr ROUND...    puts render.py's ROUND.json, .mean.f32 and .variance.f32 together
//! ```

use std::error::Error;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use serde_json::{Value, json};
use tyndall_scene::assets::Directory;
use tyndall_scene::description::{Light, Optics};
use tyndall_scene::image::{Image, Statistics};
use tyndall_scene::surface::{Bsdf, Surface};
use tyndall_scene::volume::{Budget, Grid};
use tyndall_scene::{Document, EnvironmentMap, Field, World};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["export", scene, folder, ref settings @ ..] => export(scene.as_ref(), folder.as_ref(), settings),
        ["import", folder, output, ref rounds @ ..] if !rounds.is_empty() => {
            import(folder.as_ref(), output.as_ref(), rounds)
        }
        _ => Err("accepted: export SCENE FOLDER PATH=VALUE..., import FOLDER OUT.exr ROUND...".into()),
    }
}

/// Loads a scene, some of its fields set anew, and writes it with its voxels to a folder.
///
/// Mitsuba has no emissive media. By Kirchhoff's law one with emission B·σ_a is in equilibrium with an environment of
/// radiance B, and looks B everywhere; so its emission alone gives B less what the same medium, not glowing, shows in
/// that environment. The latter is what is written, with B as `equilibrium`.
fn export(scene: &Path, folder: &Path, settings: &[&str]) -> Result<()> {
    let document = Document::new(scene.display().to_string(), fs::read_to_string(scene)?);
    let mut description = document.parse()?;
    for setting in settings {
        let (path, value) = setting.split_once('=').ok_or("accepted: PATH=VALUE")?;
        description.set(path, value)?;
    }
    let assets = Directory(scene.parent().unwrap_or(Path::new("")).into());
    let world = World::load(description, &assets, Budget(1 << 30)).map_err(|error| error.locate(&document))?;

    let plain = world.lights.values().filter(|light| !matches!(light, Light::Environment { .. }));
    let mut lights: Vec<Value> = plain.map(|light| json!(light)).collect();
    if let Some(map) = &world.environment {
        let path = folder.join("sky.exr");
        resampled(map).write(&path, 0.0)?;
        lights.push(json!({ "environment": { "file": path, "rotate": map.rotation.to_degrees() } }));
    }
    let (mut media, mut equilibrium) = (Vec::new(), Value::Null);
    for volume in &world.volumes {
        let name = &volume.name;
        let Optics::Coefficients { sigma_s, sigma_a, emission, phase } = &volume.optics else {
            return Err(format!("media.{name}: Mitsuba has no transfer functions").into());
        };
        if emission.max_element() > 0.0 {
            if world.volumes.len() > 1 || !lights.is_empty() || sigma_a.min_element() <= 0.0 {
                return Err(format!("media.{name}: what glows must absorb, be alone, and have no lights").into());
            }
            equilibrium = json!(*emission / *sigma_a);
            lights.push(json!({ "constant": { "radiance": equilibrium } }));
        }
        let voxels = match &volume.field {
            Field::Homogeneous => Value::Null,
            Field::Grid(grid) => {
                let path = folder.join(format!("{name}.vol"));
                write_grid(grid, &path)?;
                json!(path)
            }
            Field::Mesh(_) => return Err(format!("media.{name}: Mitsuba has no unstructured meshes").into()),
            Field::Particles(_) | Field::Strands(_) => {
                return Err(format!("media.{name}: Mitsuba has no particles and strands").into());
            }
            _ => return Err(format!("media.{name}: Mitsuba has no densities that are functions").into()),
        };
        media.push(json!({
            "world_from_unit": volume.world_from_unit.transpose().to_cols_array_2d(),
            "voxels": voxels,
            "sigma_s": sigma_s,
            "sigma_a": sigma_a,
            "phase": phase,
        }));
    }
    let surfaces = world.surfaces.iter().enumerate();
    let surfaces =
        surfaces.map(|(index, surface)| export_surface(surface, &folder.join(format!("surface{index}.ply"))));
    let scene = json!({
        "size": world.scene.film.size,
        "camera": world.scene.camera,
        "lights": lights,
        "media": media,
        "surfaces": surfaces.collect::<Result<Vec<_>>>()?,
        "equilibrium": equilibrium,
    });
    Ok(fs::write(folder.join("scene.json"), scene.to_string())?)
}

/// A surface with its triangles as a file, in the world. Mitsuba's rough surfaces have other masking, and are not taken there.
fn export_surface(surface: &Surface, path: &Path) -> Result<Value> {
    let Surface { name, mesh, world_from_object, material } = surface;
    let (bsdf, textured) = match &material.bsdf {
        Bsdf::Lambert { reflectance, map } => (json!({ "lambert": reflectance }), map.is_some()),
        Bsdf::Mirror { reflectance } => (json!({ "mirror": reflectance }), false),
        Bsdf::Dielectric { ior } => (json!({ "dielectric": ior }), false),
        Bsdf::MetallicRoughness { .. } => {
            return Err(format!("surfaces.{name}: Mitsuba has no such rough surfaces").into());
        }
    };
    if textured || material.emission_map.is_some() || material.normal_map.is_some() || material.double_sided {
        return Err(format!("surfaces.{name}: textures and lights on both sides are not taken to Mitsuba").into());
    }
    let mirrors = world_from_object.determinant() < 0.0;
    let corners = |&[a, b, c]: &[u32; 3]| if mirrors { [a, c, b] } else { [a, b, c] };
    let mut file = BufWriter::new(fs::File::create(path)?);
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    write!(file, "ply\nformat ascii 1.0\nelement vertex {vertices}\n")?;
    write!(file, "property float x\nproperty float y\nproperty float z\n")?;
    write!(file, "property float nx\nproperty float ny\nproperty float nz\n")?;
    write!(file, "element face {triangles}\nproperty list uchar int vertex_index\nend_header\n")?;
    let normals_from_object = world_from_object.inverse().transpose();
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        let (p, n) = (world_from_object.transform_point3(*position), normals_from_object.transform_vector3(*normal));
        let n = n.normalize_or_zero();
        writeln!(file, "{} {} {} {} {} {}", p.x, p.y, p.z, n.x, n.y, n.z)?;
    }
    for [a, b, c] in mesh.triangles.iter().map(corners) {
        writeln!(file, "3 {a} {b} {c}")?;
    }
    file.flush()?;
    Ok(json!({ "file": path, "bsdf": bsdf, "radiance": material.emission }))
}

/// A map of twice as many rows and one, of which Mitsuba makes the same function of direction.
///
/// Both are bilinear, and agree on columns. But row k of Mitsuba's n stands at the angle kπ/(n − 1), the first and last at
/// the poles; ours stand half a row within. So with a row at each of our centres and at each middle between them, where our
/// map is their mean, and at the poles, where it is as in the outermost row, nothing is lost.
fn resampled(map: &EnvironmentMap) -> Image {
    let row = |row: u32| map.pixels.chunks_exact(map.width as usize).nth(row as usize).unwrap_or_default();
    let rows = (0..=2 * map.height).map(|k| {
        let (upper, lower) =
            if k % 2 == 1 { (k / 2, k / 2) } else { ((k / 2).saturating_sub(1), (k / 2).min(map.height - 1)) };
        row(upper).iter().zip(row(lower)).map(|(a, b)| [0, 1, 2].map(|c| 0.5 * a[c] + 0.5 * b[c]))
    });
    Image { width: map.width, height: 2 * map.height + 1, pixels: rows.flatten().collect(), ..Image::default() }
}

/// Voxels in Mitsuba's format: `VOL`, version 3, float32, x y z sizes, channels, bounding box, values with x fastest.
fn write_grid(grid: &Grid, path: &Path) -> io::Result<()> {
    let mut file = BufWriter::new(fs::File::create(path)?);
    file.write_all(b"VOL\x03")?;
    let [nx, ny, nz] = grid.dims;
    for value in [1, nx, ny, nz, 1] {
        file.write_all(&value.to_le_bytes())?;
    }
    for value in [0f32, 0.0, 0.0, 1.0, 1.0, 1.0] {
        file.write_all(&value.to_le_bytes())?;
    }
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                // A density below 0 counts as 0.
                file.write_all(&grid.value(i, j, k).max(0.0).to_le_bytes())?;
            }
        }
    }
    file.flush()
}

/// Puts rounds of equally many samples together to one picture with its variance.
fn import(folder: &Path, output: &Path, rounds: &[&str]) -> Result<()> {
    let scene: Value = serde_json::from_str(&fs::read_to_string(folder.join("scene.json"))?)?;
    let [width, height]: [u32; 2] = serde_json::from_value(scene["size"].clone())?;
    let equilibrium: Option<[f32; 3]> = serde_json::from_value(scene["equilibrium"].clone())?;
    let mut samples = 0;
    for round in rounds {
        let report: Value = serde_json::from_str(&fs::read_to_string(folder.join(format!("{round}.json")))?)?;
        samples += report["samples"].as_u64().ok_or("a round does not say its samples")?;
    }
    let average = |extension: &str| -> Result<Vec<[f32; 3]>> {
        let mut sum = vec![0.0; width as usize * height as usize * 3];
        for round in rounds {
            let bytes = fs::read(folder.join(format!("{round}.{extension}")))?;
            if bytes.len() != sum.len() * 4 {
                return Err(format!("{round}.{extension}: the picture is not of {width} x {height} pixels").into());
            }
            for (sum, bytes) in sum.iter_mut().zip(bytes.chunks_exact(4)) {
                *sum += f64::from(f32::from_le_bytes(bytes.try_into()?));
            }
        }
        let values = sum.chunks_exact(3);
        Ok(values.map(|v| [0, 1, 2].map(|c| (v[c] / rounds.len() as f64) as f32)).collect())
    };
    let mut pixels = average("mean.f32")?;
    if let Some(equilibrium) = equilibrium {
        for pixel in &mut pixels {
            *pixel = [0, 1, 2].map(|c| equilibrium[c] - pixel[c]);
        }
    }
    let samples = vec![u32::try_from(samples)?; pixels.len()];
    let statistics = Some(Statistics { variance: average("variance.f32")?, samples });
    Ok(Image { width, height, pixels, statistics, ..Image::default() }.write(output, 0.0)?)
}
