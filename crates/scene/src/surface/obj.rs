//! Wavefront OBJ: polygons with texture coordinates and normals, in groups of one material.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3};

use super::error::check_budget;
use super::file::{Model, Part, Source};
use super::mesh::{Missing, TRIANGLE_BYTES, Triangles, VERTEX_BYTES};
use super::{Material, SurfaceError};

mod materials;

/// The corner of a face: places in the lists of positions, texture coordinates and normals.
type Corner = (u32, Option<u32>, Option<u32>);

/// Faces of one object and material.
#[derive(Default)]
struct Group {
    name: String,
    material: String,
    /// Corners, each once, and their triangles.
    corners: Vec<Corner>,
    places: HashMap<Corner, u32>,
    triangles: Vec<[u32; 3]>,
}

/// Reads an OBJ file and the materials that it names.
pub(super) fn read(source: &mut Source, bytes: &[u8]) -> Result<Model, SurfaceError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|error| SurfaceError::corrupt(format!("the byte at {} is no UTF-8 text", error.valid_up_to())))?;
    let (mut positions, mut texcoords, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    let (mut groups, mut libraries) = (Vec::<Group>::new(), Vec::new());
    let (mut name, mut material) = (String::new(), String::new());
    let (mut current, mut room) = (None, source.left.0);
    for (number, line) in lines(text) {
        let line = line.split('#').next().unwrap_or_default().trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let place = |what: String| SurfaceError::corrupt(format!("line {number}: {what}"));
        match keyword {
            "v" => positions.push(Vec3::from(numbers::<3>(rest, 3).map_err(place)?)),
            "vt" => {
                let [u, v, _] = numbers::<3>(rest, 1).map_err(place)?;
                texcoords.push(Vec2::new(u, 1.0 - v));
            }
            "vn" => normals.push(Vec3::from(numbers::<3>(rest, 3).map_err(place)?)),
            "o" | "g" => (name, current) = (rest.trim().into(), None),
            "usemtl" => (material, current) = (rest.trim().into(), None),
            "mtllib" => libraries.push(rest.trim().to_owned()),
            "f" => {
                let counts = [positions.len(), texcoords.len(), normals.len()];
                let face: Vec<Corner> = rest
                    .split_whitespace()
                    .map(|word| corner(word, counts))
                    .collect::<Result<_, _>>()
                    .map_err(place)?;
                if face.len() < 3 {
                    return Err(place(format!("a face of {} corners; it must have three or more", face.len())));
                }
                let needed = (face.len() * (VERTEX_BYTES + TRIANGLE_BYTES)) as u64;
                check_budget("its faces", source.left.0 - room + needed, 1, *source.left)?;
                room -= needed;
                let index = *current.get_or_insert_with(|| {
                    let known = groups.iter().position(|group| group.name == name && group.material == material);
                    known.unwrap_or_else(|| {
                        groups.push(Group { name: name.clone(), material: material.clone(), ..Group::default() });
                        groups.len() - 1
                    })
                });
                groups[index].add(&face);
            }
            // Lines, points, smoothing groups, curves.
            _ => {}
        }
    }
    let materials = materials::read(source, &libraries);
    let mut parts = Vec::new();
    for group in groups {
        let material = materials.get(&group.material).cloned();
        if material.is_none() && !group.material.is_empty() {
            tracing::warn!(
                "{}: the material {:?} is in no file that it names; grey in its place",
                source.object,
                group.material
            );
        }
        let material = material.unwrap_or_else(|| Arc::new(Material::default()));
        let name = if group.name.is_empty() { material.name.clone() } else { group.name.clone() };
        let object = format!("{}/{name}", source.object);
        let triangles = group.triangles(&positions, &texcoords, &normals);
        let mesh = triangles.finish(&object, Missing::Smooth, material.normal_map.as_ref().map(|normals| &normals.map));
        parts.push(Part { name, mesh: source.keep(mesh)?, file_from_object: Mat4::IDENTITY, material });
    }
    Ok(Model { parts, ..Model::default() })
}

/// The lines of a text with their numbers; one that ends in a backslash goes on in the next.
fn lines(text: &str) -> impl Iterator<Item = (usize, std::borrow::Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut line = std::borrow::Cow::Borrowed(first);
        while let Some(begun) = line.strip_suffix('\\') {
            let next = lines.next().map_or("", |(_, next)| next);
            line = format!("{begun} {next}").into();
        }
        Some((number + 1, line))
    })
}

/// Numbers separated by spaces, `least` or more, those that are missing 0. What comes after them (a weight, a colour) is
/// passed over. NaN is a number here; triangles with it are dropped.
fn numbers<const N: usize>(text: &str, least: usize) -> Result<[f32; N], String> {
    let mut values = [0.0; N];
    let mut found = 0;
    for (value, word) in values.iter_mut().zip(text.split_whitespace()) {
        *value = word.parse().map_err(|_| format!("{:?} is no number", cut(word)))?;
        found += 1;
    }
    if found < least { Err(format!("{found} numbers; there must be {least}")) } else { Ok(values) }
}

/// A corner as `7`, `7/3`, `7//2` or `7/3/2`, counted from 1, or backwards from −1.
fn corner(word: &str, counts: [usize; 3]) -> Result<Corner, String> {
    let mut parts = word.split('/');
    let mut place = |count: usize, what: &str| match parts.next() {
        None | Some("") => Ok(None),
        Some(text) => {
            let index: i64 = text.parse().map_err(|_| format!("the corner {:?} is no index", cut(word)))?;
            let from_zero = if index < 0 { index.saturating_add(count as i64) } else { index - 1 };
            match u32::try_from(from_zero) {
                Ok(place) if (place as usize) < count => Ok(Some(place)),
                _ => Err(format!("a corner of {what} {index}, of {count}")),
            }
        }
    };
    let (v, vt, vn) =
        (place(counts[0], "vertex")?, place(counts[1], "texture coordinate")?, place(counts[2], "normal")?);
    Ok((v.ok_or_else(|| format!("the corner {:?} has no vertex", cut(word)))?, vt, vn))
}

/// The beginning of a word, as a message may quote it.
fn cut(word: &str) -> String {
    word.chars().take(40).collect()
}

impl Group {
    fn add(&mut self, face: &[Corner]) {
        let places: Vec<u32> = face
            .iter()
            .map(|corner| {
                *self.places.entry(*corner).or_insert_with(|| {
                    self.corners.push(*corner);
                    self.corners.len() as u32 - 1
                })
            })
            .collect();
        self.triangles.extend(places.windows(2).skip(1).map(|pair| [places[0], pair[0], pair[1]]));
    }

    /// The group with its vertices; a corner without texture coordinate or normal among others has 0.
    fn triangles(self, positions: &[Vec3], texcoords: &[Vec2], normals: &[Vec3]) -> Triangles {
        let of = |corner: &Corner| (positions[corner.0 as usize], corner.1, corner.2);
        let vertices = || self.corners.iter().map(of);
        let mapped = vertices().any(|(_, vt, _)| vt.is_some());
        let shaded = vertices().any(|(.., vn)| vn.is_some());
        let texcoord = |vt: Option<u32>| vt.map_or(Vec2::ZERO, |i| texcoords[i as usize]);
        let normal = |vn: Option<u32>| vn.map_or(Vec3::ZERO, |i| normals[i as usize]);
        Triangles {
            positions: vertices().map(|(position, ..)| position).collect(),
            texcoords: if mapped { vertices().map(|(_, vt, _)| texcoord(vt)).collect() } else { Vec::new() },
            normals: if shaded { vertices().map(|(.., vn)| normal(vn)).collect() } else { Vec::new() },
            triangles: self.triangles,
            ..Triangles::default()
        }
    }
}

#[cfg(test)]
mod tests;
