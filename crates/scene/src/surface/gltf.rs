//! glTF 2.0 [glTF2]: the crate `gltf` parses and validates the JSON; containers, buffers and accessors are read here, as that
//! crate trusts what they claim.
//!
//! Units. Lengths are metres. `KHR_lights_punctual` is photometric: candela and lux become W·sr⁻¹ and W·m⁻² by 683 lm/W
//! ([`LUMENS_PER_WATT`], the convention of [`crate::black_body`]: white light of radiance 1 has a luminance of 683 cd/m²).
//! Emission is the radiance that the numbers say [W·sr⁻¹·m⁻²], without that factor, as exporters write it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ::gltf::{Document, Node, json};
use glam::{Mat4, Vec3};

use super::SurfaceError;
use super::file::{Model, Part, Source};
use crate::description::Camera;

mod accessor;
mod container;
mod light;
mod material;
mod primitive;
mod texture;

pub(super) use light::{LEAST_ANGLE, LUMENS_PER_WATT};
pub(super) use texture::place;

use container::Buffers;

/// Extensions that are read; others that a file must have are refused, others that it has warned about.
const EXTENSIONS: [&str; 7] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_texture_transform",
];

/// Reads the scene of a glTF file: that which it says is shown, else its first.
pub(super) fn read(source: &mut Source, bytes: &[u8]) -> Result<Model, SurfaceError> {
    let (text, blob) = container::split(bytes)?;
    // Parsed, a document takes some times the bytes of its text.
    super::error::check_budget("its nodes", text.len() as u64, 4, *source.left)?;
    let root: json::Root =
        json::deserialize::from_slice(text).map_err(|error| SurfaceError::corrupt(error.to_string()))?;
    let unknown = |used: &[String]| used.iter().find(|name| !EXTENSIONS.contains(&name.as_str())).cloned();
    if let Some(found) = unknown(&root.extensions_required) {
        let accepted = "no other extension required than KHR_lights_punctual, KHR_texture_transform and \
                        KHR_materials_emissive_strength, _ior, _specular, _transmission and _volume";
        return Err(SurfaceError::Unsupported { found: format!("the extension {found:?}"), accepted });
    }
    if let Some(found) = unknown(&root.extensions_used) {
        tracing::warn!("{}: the extension {found:?}, and maybe others, is not read", source.object);
    }
    let document = validated(root)?;
    let buffers = Buffers::read(source, &document, blob)?;
    let mut reader = Reader {
        buffers,
        source,
        materials: BTreeMap::new(),
        meshes: BTreeMap::new(),
        names: BTreeSet::new(),
        model: Model::default(),
    };
    let roots: Vec<Node> = match document.default_scene().or_else(|| document.scenes().next()) {
        Some(scene) => scene.nodes().collect(),
        None => {
            let children: BTreeSet<_> = document.nodes().flat_map(|n| n.children()).map(|n| n.index()).collect();
            document.nodes().filter(|node| !children.contains(&node.index())).collect()
        }
    };
    let mut seen = vec![false; document.nodes().len()];
    let mut stack: Vec<_> = roots.into_iter().rev().map(|node| (node, Mat4::IDENTITY)).collect();
    while let Some((node, parent)) = stack.pop() {
        if std::mem::replace(&mut seen[node.index()], true) {
            let what = format!("the node {} has two parents; nodes must form trees", node.index());
            return Err(SurfaceError::corrupt(what));
        }
        let file_from_node = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        reader.node(&node, file_from_node)?;
        stack.extend(node.children().map(|child| (child, file_from_node)).collect::<Vec<_>>().into_iter().rev());
    }
    Ok(reader.model)
}

/// Whether a file has lights, or materials that emit.
pub(super) fn gives_light(bytes: &[u8]) -> bool {
    let text = container::split(bytes).map_or(&[][..], |(text, _)| text);
    let document = json::deserialize::from_slice(text).ok().and_then(|root| validated(root).ok());
    document.is_some_and(|document| {
        document.lights().is_some_and(|mut lights| lights.next().is_some())
            || document.materials().any(|material| material.emissive_factor() != [0.0; 3])
    })
}

/// A document whose parts may be taken: what the crate validates, and what it leaves to those who take them.
fn validated(root: json::Root) -> Result<Document, SurfaceError> {
    use json::extensions::scene::khr_lights_punctual::Type;
    use json::validation::Checked::Valid;
    let partial =
        |kind: &str, index: usize| SurfaceError::corrupt(format!("the {kind} {index} lacks what its type needs"));
    for (index, image) in root.images.iter().enumerate() {
        if if image.buffer_view.is_some() { image.mime_type.is_none() } else { image.uri.is_none() } {
            return Err(partial("image", index));
        }
    }
    for (index, camera) in root.cameras.iter().enumerate() {
        let there = match camera.type_ {
            Valid(json::camera::Type::Perspective) => camera.perspective.is_some(),
            Valid(json::camera::Type::Orthographic) => camera.orthographic.is_some(),
            _ => false,
        };
        if !there {
            return Err(partial("camera", index));
        }
    }
    // The crate looks accessors of positions up before it knows that they are there.
    for (index, mesh) in root.meshes.iter().enumerate() {
        let mut accessors = mesh.primitives.iter().flat_map(|primitive| primitive.attributes.values());
        if let Some(accessor) = accessors.find(|accessor| accessor.value() >= root.accessors.len()) {
            let what = format!("the mesh {index} has the accessor {}, of {}", accessor.value(), root.accessors.len());
            return Err(SurfaceError::corrupt(what));
        }
    }
    let lights = root.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
    for (index, light) in lights.map_or(&[][..], |lights| &lights.lights).iter().enumerate() {
        if matches!(light.type_, Valid(Type::Spot)) && light.spot.is_none() {
            return Err(partial("light", index));
        }
    }
    Document::from_json(root).map_err(|error| SurfaceError::corrupt(first(&error)))
}

/// The first of what the crate finds, as it lists all.
fn first(error: &::gltf::Error) -> String {
    match error {
        ::gltf::Error::Validation(errors) if !errors.is_empty() => format!("{}: {}", errors[0].0, errors[0].1),
        other => other.to_string(),
    }
}

/// A document as it is turned into a model.
struct Reader<'s, 'a> {
    source: &'s mut Source<'a>,
    buffers: Buffers,
    materials: BTreeMap<Option<usize>, Arc<super::Material>>,
    /// By mesh and primitive.
    meshes: BTreeMap<(usize, usize), Arc<super::TriangleMesh>>,
    names: BTreeSet<String>,
    model: Model,
}

impl Reader<'_, '_> {
    /// What hangs on a node.
    fn node(&mut self, node: &Node, file_from_node: Mat4) -> Result<(), SurfaceError> {
        let label = |own: Option<&str>, kind: &str| {
            node.name().or(own).map_or_else(|| format!("{kind} {}", node.index()), str::to_owned)
        };
        if !file_from_node.is_finite() {
            return Err(SurfaceError::corrupt(format!("the transforms above the node {} overflow", node.index())));
        }
        if let Some(mesh) = node.mesh() {
            if file_from_node.determinant() == 0.0 || !file_from_node.inverse().is_finite() {
                let name = label(mesh.name(), "mesh");
                tracing::warn!(
                    "{}/{name}: its transform has no inverse (a scale of 0?); it is left out",
                    self.source.object
                );
                return Ok(());
            }
            if node.skin().is_some() || node.weights().is_some() {
                let name = label(mesh.name(), "mesh");
                tracing::warn!("{}/{name}: skins and morph targets are not applied", self.source.object);
            }
            for primitive in mesh.primitives() {
                let base = label(mesh.name(), "mesh");
                let material = self.material(&primitive.material())?;
                let key = (mesh.index(), primitive.index());
                let object = format!("{}/{base}", self.source.object);
                let triangles = match self.meshes.get(&key) {
                    Some(known) => known.clone(),
                    None => {
                        let read = self.primitive(&object, &primitive, &material)?;
                        let read = self.source.keep(read)?;
                        self.meshes.insert(key, read.clone());
                        read
                    }
                };
                let name = self.unique(base);
                self.model.parts.push(Part { name, mesh: triangles, file_from_object: file_from_node, material });
            }
        }
        if let Some(light) = node.light() {
            let name = self.unique(label(light.name(), "light"));
            if let Some(light) = light::read(&light, &file_from_node) {
                self.model.lights.insert(name, light);
            } else {
                tracing::warn!("{}/{name}: its intensity is no number >= 0; it is left out", self.source.object);
            }
        }
        if let Some(camera) = node.camera() {
            let name = label(camera.name(), "camera");
            match camera.projection() {
                ::gltf::camera::Projection::Perspective(lens) => {
                    let fov = lens.yfov().to_degrees();
                    if let Some(camera) = camera_of(&file_from_node, fov) {
                        self.model.cameras.push((name, camera));
                    } else {
                        tracing::warn!("{}/{name}: looks nowhere; it is left out", self.source.object);
                    }
                }
                ::gltf::camera::Projection::Orthographic(_) => {
                    tracing::warn!(
                        "{}/{name}: orthographic cameras are not rendered; it is left out",
                        self.source.object
                    );
                }
            }
        }
        Ok(())
    }

    /// A name that no other part or light has.
    fn unique(&mut self, base: String) -> String {
        let mut name = base.clone();
        let mut number = 1;
        while !self.names.insert(name.clone()) {
            number += 1;
            name = format!("{base}.{number}");
        }
        name
    }
}

/// The camera at a node, which looks along its −z, or `None` where that is no direction.
fn camera_of(file_from_node: &Mat4, fov: f32) -> Option<Camera> {
    let position = file_from_node.transform_point3(Vec3::ZERO);
    let forward = file_from_node.transform_vector3(Vec3::NEG_Z).try_normalize()?;
    let up = file_from_node.transform_vector3(Vec3::Y).try_normalize()?;
    let camera = Camera { position, target: position + forward, up, fov };
    (fov > 0.0 && fov < 180.0 && camera.frame().is_some()).then_some(camera)
}

#[cfg(test)]
mod tests;
