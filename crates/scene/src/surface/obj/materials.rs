//! MTL, the materials of OBJ files.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::Vec3;

use super::super::{Bsdf, Material, NormalMap};
use super::{lines, numbers};
use crate::surface::file::Source;

/// What a material says, before it is known which model that makes.
#[derive(Default)]
struct Statements<'t> {
    diffuse: Option<Vec3>,
    emission: Vec3,
    metallic: Option<f32>,
    roughness: Option<f32>,
    diffuse_map: Option<&'t str>,
    emission_map: Option<&'t str>,
    normal_map: Option<&'t str>,
    /// The share of light that passes straight through.
    transparency: f32,
}

/// The materials of the libraries, by name; libraries that cannot be had are warned about.
pub(super) fn read(source: &mut Source, libraries: &[String]) -> BTreeMap<String, Arc<Material>> {
    let mut materials = BTreeMap::new();
    for library in libraries {
        let file = source.beside(library);
        let text = match source.assets.read(&file, source.left.0) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(reason) => {
                tracing::warn!("{}: its materials {file:?} cannot be read: {reason}", source.object);
                continue;
            }
        };
        let mut current: Option<(String, Statements)> = None;
        let lines: Vec<_> = lines(&text).map(|(number, line)| (number, line.into_owned())).collect();
        for (number, line) in &lines {
            let line = line.split('#').next().unwrap_or_default().trim();
            let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let rest = rest.trim();
            if keyword == "newmtl" {
                finish(source, &mut materials, current.replace((rest.into(), Statements::default())));
                continue;
            }
            let Some((name, statements)) = &mut current else { continue };
            if let Err(reason) = statements.read(keyword, rest) {
                tracing::warn!("{}: {file:?}, line {number}, of the material {name:?}: {reason}", source.object);
            }
        }
        finish(source, &mut materials, current);
    }
    materials
}

impl<'t> Statements<'t> {
    fn read(&mut self, keyword: &str, rest: &'t str) -> Result<(), String> {
        let color = || {
            let [r, g, b] = numbers::<3>(rest, 1)?;
            // A grey may be written as one number.
            let color = if rest.split_whitespace().count() == 1 { Vec3::splat(r) } else { Vec3::new(r, g, b) };
            if color.is_finite() && color.min_element() >= 0.0 {
                Ok(color)
            } else {
                Err(format!("{color} is no colour"))
            }
        };
        let share = || match numbers::<1>(rest, 1)? {
            [x] if (0.0..=1.0).contains(&x) => Ok(x),
            [x] => Err(format!("{x}; accepted: a number from 0 to 1")),
        };
        match keyword {
            "Kd" => self.diffuse = Some(color()?),
            "Ke" => self.emission = color()?,
            "Pm" => self.metallic = Some(share()?),
            "Pr" => self.roughness = Some(share()?),
            "d" => self.transparency = 1.0 - share()?,
            "Tr" => self.transparency = share()?,
            "map_Kd" => self.diffuse_map = Some(picture(rest)),
            "map_Ke" => self.emission_map = Some(picture(rest)),
            "norm" => self.normal_map = Some(picture(rest)),
            _ => {}
        }
        Ok(())
    }
}

/// The file of a map, after its options (`-bm 1`, `-s 1 1 1`, …).
fn picture(rest: &str) -> &str {
    if !rest.starts_with('-') {
        return rest;
    }
    rest.rsplit(char::is_whitespace).next().unwrap_or(rest)
}

/// Adds a material whose statements are complete: metallic-roughness where it says so (Pm, Pr), else Lambert.
fn finish(source: &mut Source, to: &mut BTreeMap<String, Arc<Material>>, from: Option<(String, Statements)>) {
    let Some((name, statements)) = from else { return };
    let of = format!("the material {name:?}");
    let mut map = |file: Option<&str>, srgb| file.and_then(|file| source.picture(&file.replace('\\', "/"), srgb, &of));
    // Emission that a picture alone gives is that of the picture.
    let given = statements.emission != Vec3::ZERO || statements.emission_map.is_none();
    let emission_map = map(statements.emission_map, true);
    let emission = if given || emission_map.is_none() { statements.emission } else { Vec3::ONE };
    let normal_map = map(statements.normal_map, false).map(|map| NormalMap { map, scale: 1.0 });
    let picture = map(statements.diffuse_map, true);
    // A picture without a colour is the colour.
    let plain = if picture.is_some() { Vec3::ONE } else { Vec3::splat(0.5) };
    let color = statements.diffuse.unwrap_or(plain);
    let bsdf = match (statements.metallic, statements.roughness) {
        (None, None) => Bsdf::Lambert { reflectance: color, map: picture },
        (metallic, roughness) => Bsdf::MetallicRoughness {
            base_color: color,
            base_color_map: picture,
            metallic: metallic.unwrap_or(0.0),
            roughness: roughness.unwrap_or(1.0),
            metallic_roughness_map: None,
        },
    };
    if statements.transparency > 0.0 {
        tracing::warn!("{}: the material {name:?} is transparent, which is not rendered; it is opaque", source.object);
    }
    let material = Material { name: name.clone(), bsdf, emission, emission_map, normal_map, ..Material::default() };
    to.insert(name, Arc::new(material));
}
