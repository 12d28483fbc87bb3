//! PLY, the Stanford format of polygons: text, or binary of either byte order. [Turk94]

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::error::check_budget;
use super::file::{Model, Part, Source};
use super::mesh::{Missing, TRIANGLE_BYTES, Triangles, VERTEX_BYTES};
use super::{Material, SurfaceError};

mod values;

use values::{Kind, Values};

/// The header: what elements there are, and how their values are written.
struct Header {
    elements: Vec<Element>,
    encoding: values::Encoding,
    /// Where the values begin.
    end: usize,
}

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

struct Property {
    name: String,
    /// Of a list the kind of its length.
    list: Option<Kind>,
    kind: Kind,
}

/// Reads the faces of a PLY file.
pub(super) fn read(source: &mut Source, bytes: &[u8]) -> Result<Model, SurfaceError> {
    let header = header(bytes)?;
    let mut values = Values::new(&bytes[header.end..], header.encoding);
    let mut triangles = Triangles::default();
    let mut vertices = 0;
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        // A value takes a byte at least.
        let least = element.count.saturating_mul(element.properties.len() as u64);
        if least > bytes.len() as u64 {
            let Element { name, count, .. } = element;
            return Err(SurfaceError::corrupt(format!("{count} elements {name:?} in {} bytes", bytes.len())));
        }
        match element.name.as_str() {
            "vertex" => {
                vertices = element.count;
                check_budget("its vertices", element.count, VERTEX_BYTES, *source.left)?;
                read_vertices(element, &mut values, &mut triangles)?;
            }
            "face" => read_faces(element, vertices, &mut values, &mut triangles, source)?,
            "tristrips" => {
                return Err(SurfaceError::Unsupported { found: "strips of triangles".into(), accepted: "faces" });
            }
            _ => {
                for _ in 0..element.count {
                    for property in &element.properties {
                        let count = property.list.map_or(Ok(1), |length| values.length(length))?;
                        (0..count).try_for_each(|_| values.next(property.kind).map(drop))?;
                    }
                }
            }
        }
    }
    let mesh = source.keep(triangles.finish(source.object, Missing::Smooth, None))?;
    let material = Arc::new(Material::default());
    let part = Part { name: String::new(), mesh, file_from_object: Mat4::IDENTITY, material };
    Ok(Model { parts: vec![part], ..Model::default() })
}

/// What a property of a vertex is: a list of the mesh, and a component of its entries.
#[derive(Clone, Copy)]
enum Slot {
    Position(usize),
    Normal(usize),
    Texcoord(usize),
    Color(usize),
    Other,
}

fn slot(name: &str) -> Slot {
    match name {
        "x" => Slot::Position(0),
        "y" => Slot::Position(1),
        "z" => Slot::Position(2),
        "nx" => Slot::Normal(0),
        "ny" => Slot::Normal(1),
        "nz" => Slot::Normal(2),
        "u" | "s" | "texture_u" => Slot::Texcoord(0),
        "v" | "t" | "texture_v" => Slot::Texcoord(1),
        "red" | "r" => Slot::Color(0),
        "green" | "g" => Slot::Color(1),
        "blue" | "b" => Slot::Color(2),
        "alpha" | "a" => Slot::Color(3),
        _ => Slot::Other,
    }
}

fn read_vertices(element: &Element, values: &mut Values, to: &mut Triangles) -> Result<(), SurfaceError> {
    if let Some(list) = element.properties.iter().find(|property| property.list.is_some()) {
        return Err(SurfaceError::corrupt(format!("the property {:?} of vertices is a list", list.name)));
    }
    let slots: Vec<_> = element.properties.iter().map(|property| (slot(&property.name), property.kind)).collect();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        if !slots.iter().any(|(slot, _)| matches!(slot, Slot::Position(of) if *of == axis)) {
            return Err(SurfaceError::corrupt(format!("vertices have no property {name:?}")));
        }
    }
    let has = |test: fn(&Slot) -> bool| slots.iter().any(|(slot, _)| test(slot));
    let (shaded, mapped) = (has(|slot| matches!(slot, Slot::Normal(_))), has(|slot| matches!(slot, Slot::Texcoord(_))));
    let colored = has(|slot| matches!(slot, Slot::Color(0)));
    for _ in 0..element.count {
        let (mut position, mut normal) = ([0.0; 3], [0.0; 3]);
        let (mut texcoord, mut color) = ([0.0; 2], [0.0, 0.0, 0.0, 1.0]);
        for &(slot, kind) in &slots {
            let value = values.next(kind)?;
            match slot {
                Slot::Position(i) => position[i] = value as f32,
                Slot::Normal(i) => normal[i] = value as f32,
                Slot::Texcoord(i) => texcoord[i] = value as f32,
                Slot::Color(i) => color[i] = linear(value, kind, i == 3),
                Slot::Other => {}
            }
        }
        to.positions.push(Vec3::from(position));
        if shaded {
            to.normals.push(Vec3::from(normal));
        }
        if mapped {
            to.texcoords.push(Vec2::new(texcoord[0], 1.0 - texcoord[1]));
        }
        if colored {
            to.colors.push(Vec4::from(color));
        }
    }
    Ok(())
}

/// A channel of a colour: bytes are sRGB (but for alpha), floats linear.
fn linear(value: f64, kind: Kind, alpha: bool) -> f32 {
    match kind {
        Kind::U8 if alpha => (value / 255.0) as f32,
        Kind::U8 => super::texture::linear_from_srgb((value / 255.0) as f32),
        Kind::U16 => (value / 65535.0) as f32,
        _ => value as f32,
    }
}

fn read_faces(
    element: &Element,
    vertices: u64,
    values: &mut Values,
    to: &mut Triangles,
    source: &Source,
) -> Result<(), SurfaceError> {
    let mut face = Vec::new();
    for number in 0..element.count {
        for property in &element.properties {
            let corners = ["vertex_indices", "vertex_index"].contains(&property.name.as_str());
            let count = property.list.map_or(Ok(1), |length| values.length(length))?;
            face.clear();
            for _ in 0..count {
                let value = values.next(property.kind)?;
                if corners {
                    if value < 0.0 || value >= vertices as f64 || value.fract() != 0.0 {
                        let what = format!("face {number} has the corner {value}, of {vertices} vertices before it");
                        return Err(SurfaceError::corrupt(what));
                    }
                    face.push(value as u32);
                }
            }
            if corners {
                let count = (to.triangles.len() + face.len()) as u64;
                check_budget("its faces", count, TRIANGLE_BYTES, *source.left)?;
                to.triangles.extend(face.windows(2).skip(1).map(|pair| [face[0], pair[0], pair[1]]));
            }
        }
    }
    Ok(())
}

fn header(bytes: &[u8]) -> Result<Header, SurfaceError> {
    let mut lines = Lines { bytes, at: 0 };
    if lines.next()? != "ply" {
        return Err(SurfaceError::corrupt("it does not begin with a line \"ply\""));
    }
    let (mut elements, mut encoding) = (Vec::<Element>::new(), None);
    loop {
        let line = lines.next()?;
        let words: Vec<_> = line.split_whitespace().collect();
        let wrong = || SurfaceError::corrupt(format!("its header has {:?}", line.chars().take(60).collect::<String>()));
        let kind = |word: &str| Kind::of(word).ok_or_else(wrong);
        match words[..] {
            [] | ["comment" | "obj_info", ..] => {}
            ["format", format, "1.0"] => encoding = Some(values::Encoding::of(format).ok_or_else(wrong)?),
            ["element", name, count] => {
                let count = count.parse().map_err(|_| wrong())?;
                elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            ["property", "list", length, of, name] => {
                let property = Property { name: name.into(), list: Some(kind(length)?), kind: kind(of)? };
                elements.last_mut().ok_or_else(wrong)?.properties.push(property);
            }
            ["property", of, name] => {
                let property = Property { name: name.into(), list: None, kind: kind(of)? };
                elements.last_mut().ok_or_else(wrong)?.properties.push(property);
            }
            ["end_header"] => break,
            _ => return Err(wrong()),
        }
    }
    let encoding = encoding.ok_or_else(|| SurfaceError::corrupt("its header has no format"))?;
    Ok(Header { elements, encoding, end: lines.at })
}

/// The lines of the header.
struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Result<&'a str, SurfaceError> {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|&byte| byte == b'\n');
        let end = end.ok_or_else(|| SurfaceError::corrupt("it ends within its header"))?;
        self.at += end + 1;
        let line = std::str::from_utf8(&rest[..end]).map_err(|_| SurfaceError::corrupt("its header is no text"))?;
        Ok(line.trim())
    }
}

#[cfg(test)]
mod tests;
