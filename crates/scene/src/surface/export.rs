//! Surfaces, lights and cameras written as binary glTF 2.0 [glTF2], in the units and conventions of its reader.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Mat4, Quat, Vec2, Vec3};
use serde_json::{Value, json};

use super::gltf::{LEAST_ANGLE, LUMENS_PER_WATT};
use super::{Surface, SurfaceError, TriangleMesh, Wrap};
use crate::description::{Camera, Light};

mod materials;

/// What a file is to hold.
#[derive(Clone, Debug, Default)]
pub struct Export {
    /// Surfaces, by their names.
    pub surfaces: Vec<Exported>,
    /// Lights by name. Directional, point and spot lights are what glTF has; others are warned about and left out.
    pub lights: Vec<(String, Light)>,
    /// Cameras by name, and their film's width over its height.
    pub cameras: Vec<(String, Camera, f32)>,
}

/// A surface with what only a file has of it.
#[derive(Clone, Debug)]
pub struct Exported {
    /// The surface. Colours of its vertices are written as `COLOR_0`; glTF defines them from 0 to 1.
    pub surface: Surface,
    /// A second texture coordinate a vertex (`TEXCOORD_1`), which the material's emission map then uses: a light map's. Or
    /// none; the mesh's own second set is written then.
    pub light_map_texcoords: Vec<Vec2>,
}

impl Export {
    /// The bytes of a `.glb` file.
    ///
    /// # Errors
    /// Numbers that are not finite, lists whose lengths differ, and more than 4 GiB.
    pub fn to_glb(&self) -> Result<Vec<u8>, SurfaceError> {
        let mut writer = Writer::default();
        for exported in &self.surfaces {
            writer.surface(exported)?;
        }
        let mut lights = Vec::new();
        for (name, light) in &self.lights {
            writer.light(name, light, &mut lights)?;
        }
        for (name, camera, aspect) in &self.cameras {
            writer.camera(name, camera, *aspect)?;
        }
        writer.finish(lights)
    }
}

/// The parts of a document, as they grow.
#[derive(Default)]
struct Writer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    images: Vec<Value>,
    /// An image, and how it goes on beyond its edges.
    textures: Vec<(usize, Sampler)>,
    nodes: Vec<Value>,
    cameras: Vec<Value>,
    /// Meshes with their material by where they lie in memory, so that what is shared is written once.
    known: BTreeMap<(usize, usize), usize>,
    known_materials: BTreeMap<(usize, bool), usize>,
    known_images: BTreeMap<(usize, bool), usize>,
    extensions: std::collections::BTreeSet<&'static str>,
}

impl Writer {
    fn surface(&mut self, exported: &Exported) -> Result<(), SurfaceError> {
        let Exported { surface: Surface { name, mesh, world_from_object, material }, light_map_texcoords } = exported;
        if !world_from_object.is_finite() {
            return Err(SurfaceError::corrupt(format!("the transform of {name:?} is not finite")));
        }
        let key = (Arc::as_ptr(mesh).addr(), Arc::as_ptr(material).addr());
        let known = self.known.get(&key).filter(|_| light_map_texcoords.is_empty()).copied();
        let index = match known {
            Some(index) => index,
            None => {
                let material = self.material(material, !light_map_texcoords.is_empty())?;
                let primitive = self.primitive(name, mesh, light_map_texcoords, material)?;
                self.meshes.push(json!({ "name": name, "primitives": [primitive] }));
                if light_map_texcoords.is_empty() {
                    self.known.insert(key, self.meshes.len() - 1);
                }
                self.meshes.len() - 1
            }
        };
        let mut node = json!({ "name": name, "mesh": index });
        if *world_from_object != Mat4::IDENTITY {
            node["matrix"] = json!(world_from_object.to_cols_array());
        }
        self.nodes.push(node);
        Ok(())
    }

    fn primitive(
        &mut self,
        name: &str,
        mesh: &TriangleMesh,
        second: &[Vec2],
        material: usize,
    ) -> Result<Value, SurfaceError> {
        let count = mesh.positions.len();
        if !second.is_empty() && !mesh.second_texcoords.is_empty() {
            let what = format!("{name:?} has two second sets of texture coordinates: the mesh's and a light map's");
            return Err(SurfaceError::corrupt(what));
        }
        let second = if second.is_empty() { &mesh.second_texcoords } else { second };
        let lengths = [mesh.normals.len(), mesh.texcoords.len()];
        let optional = [mesh.tangents.len(), mesh.colors.len(), second.len()];
        if count == 0 || lengths.iter().any(|&n| n != count) || optional.iter().any(|&n| n != 0 && n != count) {
            let what = format!(
                "{name:?} has {count} positions, {lengths:?} normals and texture coordinates, {optional:?} others"
            );
            return Err(SurfaceError::corrupt(what));
        }
        let sound = mesh.triangles.iter().flatten().all(|&corner| (corner as usize) < count);
        if mesh.triangles.is_empty() || !sound {
            return Err(SurfaceError::corrupt(format!("{name:?} has no triangles, or corners beyond its vertices")));
        }
        let position = self.column(name, &mesh.positions, Vec3::to_array)?;
        let low = mesh.positions.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let high = mesh.positions.iter().copied().reduce(Vec3::max).unwrap_or_default();
        self.accessors[position]["min"] = json!(low.to_array());
        self.accessors[position]["max"] = json!(high.to_array());
        let mut attributes = json!({
            "POSITION": position,
            "NORMAL": self.column(name, &mesh.normals, Vec3::to_array)?,
            "TEXCOORD_0": self.column(name, &mesh.texcoords, Vec2::to_array)?,
        });
        if !mesh.tangents.is_empty() {
            attributes["TANGENT"] = json!(self.column(name, &mesh.tangents, glam::Vec4::to_array)?);
        }
        if !mesh.colors.is_empty() {
            attributes["COLOR_0"] = json!(self.column(name, &mesh.colors, glam::Vec4::to_array)?);
        }
        if !second.is_empty() {
            attributes["TEXCOORD_1"] = json!(self.column(name, second, Vec2::to_array)?);
        }
        let corners: Vec<u8> = mesh.triangles.iter().flatten().flat_map(|corner| corner.to_le_bytes()).collect();
        let view = self.view(&corners, Some(34963));
        let count = 3 * mesh.triangles.len();
        self.accessors.push(json!({ "bufferView": view, "componentType": 5125, "count": count, "type": "SCALAR" }));
        Ok(json!({ "attributes": attributes, "indices": self.accessors.len() - 1, "material": material }))
    }

    /// An accessor of vectors.
    fn column<T: Copy, const N: usize>(
        &mut self,
        name: &str,
        vectors: &[T],
        array: impl Fn(&T) -> [f32; N],
    ) -> Result<usize, SurfaceError> {
        let numbers = || vectors.iter().flat_map(&array);
        if !numbers().all(f32::is_finite) {
            return Err(SurfaceError::corrupt(format!("{name:?} has numbers that are not finite")));
        }
        let bytes: Vec<u8> = numbers().flat_map(f32::to_le_bytes).collect();
        let view = self.view(&bytes, Some(34962));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        self.accessors.push(json!({ "bufferView": view, "componentType": 5126, "count": vectors.len(), "type": kind }));
        Ok(self.accessors.len() - 1)
    }

    /// A view of bytes, at a multiple of four.
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    fn light(&mut self, name: &str, light: &Light, lights: &mut Vec<Value>) -> Result<(), SurfaceError> {
        let (kind, strength, position, direction) = match *light {
            Light::Directional { direction, irradiance } => ("directional", irradiance, Vec3::ZERO, direction),
            Light::Point { position, intensity } => ("point", intensity, position, Vec3::NEG_Z),
            Light::Spot { position, direction, intensity, .. } => ("spot", intensity, position, direction),
            Light::Constant { .. } | Light::Environment { .. } => {
                tracing::warn!("{name}: glTF has no light from all around; it is left out");
                return Ok(());
            }
        };
        let brightest = strength.max_element();
        let color = if brightest > 0.0 { strength / brightest } else { Vec3::ONE };
        let intensity = brightest * LUMENS_PER_WATT;
        let direction = direction.normalize_or(Vec3::NEG_Z);
        if !(color.is_finite() && intensity.is_finite() && position.is_finite() && direction.is_finite()) {
            return Err(SurfaceError::corrupt(format!("the light {name:?} has numbers that are not finite")));
        }
        let mut punctual = json!({ "name": name, "type": kind, "color": color.to_array(), "intensity": intensity });
        if let Light::Spot { inner_angle, outer_angle, .. } = light {
            let outer = outer_angle.clamp(2.0 * LEAST_ANGLE, 90.0);
            let inner = inner_angle.clamp(LEAST_ANGLE, outer - LEAST_ANGLE);
            punctual["spot"] = json!({ "innerConeAngle": inner.to_radians(), "outerConeAngle": outer.to_radians() });
        }
        lights.push(punctual);
        self.nodes.push(json!({
            "name": name,
            "translation": position.to_array(),
            "rotation": Quat::from_rotation_arc(Vec3::NEG_Z, direction).to_array(),
            "extensions": { "KHR_lights_punctual": { "light": lights.len() - 1 } },
        }));
        Ok(())
    }

    fn camera(&mut self, name: &str, camera: &Camera, aspect: f32) -> Result<(), SurfaceError> {
        let frame = camera.frame().filter(|_| camera.position.is_finite() && aspect.is_finite() && aspect > 0.0);
        let Some([right, up, backward]) = frame else {
            return Err(SurfaceError::corrupt(format!("the camera {name:?} looks nowhere, or has no aspect ratio")));
        };
        let columns = [right.extend(0.0), up.extend(0.0), backward.extend(0.0), camera.position.extend(1.0)];
        // The near plane, which must be there, is that of no renderer here.
        let lens = json!({ "yfov": camera.fov.to_radians(), "aspectRatio": aspect, "znear": 0.01 });
        self.cameras.push(json!({ "name": name, "type": "perspective", "perspective": lens }));
        let matrix = columns.map(|column| column.to_array()).concat();
        self.nodes.push(json!({ "name": name, "matrix": matrix, "camera": self.cameras.len() - 1 }));
        Ok(())
    }

    /// The document and its bytes in one file.
    fn finish(mut self, lights: Vec<Value>) -> Result<Vec<u8>, SurfaceError> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut samplers: Vec<Sampler> = Vec::new();
        let textures = self.textures.iter().map(|&(source, used)| {
            if used == (Sampler { wrap: [Wrap::Repeat; 2], mips: true }) {
                return json!({ "source": source });
            }
            let sampler = samplers.iter().position(|known| *known == used).unwrap_or_else(|| {
                samplers.push(used);
                samplers.len() - 1
            });
            json!({ "source": source, "sampler": sampler })
        });
        let textures: Vec<_> = textures.collect();
        let samplers: Vec<_> = samplers.into_iter().map(Sampler::written).collect();
        let mut document = json!({
            "asset": { "version": "2.0", "generator": concat!("tyndall ", env!("CARGO_PKG_VERSION")) },
        });
        // Lists that are there must not be empty.
        if !self.nodes.is_empty() {
            document["scene"] = json!(0);
            document["scenes"] = json!([{ "nodes": (0..self.nodes.len()).collect::<Vec<_>>() }]);
        }
        for (key, list) in [
            ("nodes", self.nodes),
            ("meshes", self.meshes),
            ("materials", self.materials),
            ("cameras", self.cameras),
            ("images", self.images),
            ("textures", textures),
            ("samplers", samplers),
            ("accessors", self.accessors),
            ("bufferViews", self.views),
        ] {
            if !list.is_empty() {
                document[key] = json!(list);
            }
        }
        if !self.bytes.is_empty() {
            document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        }
        if !lights.is_empty() {
            self.extensions.insert("KHR_lights_punctual");
            document["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
        }
        if !self.extensions.is_empty() {
            document["extensionsUsed"] = json!(self.extensions);
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut glb = b"glTF".to_vec();
        let binary = if self.bytes.is_empty() { 0 } else { 8 + self.bytes.len() };
        let length = 12 + 8 + text.len() + binary;
        let limit = u64::from(u32::MAX);
        super::error::check_budget("a file", length as u64, 1, crate::volume::Budget(limit))?;
        for word in [2, length as u32, text.len() as u32, 0x4e4f_534a] {
            glb.extend(word.to_le_bytes());
        }
        glb.extend(text);
        if binary > 0 {
            glb.extend((self.bytes.len() as u32).to_le_bytes());
            glb.extend(0x004e_4942u32.to_le_bytes());
            glb.extend(self.bytes);
        }
        Ok(glb)
    }
}

/// How a picture is looked up.
#[derive(Clone, Copy, PartialEq)]
struct Sampler {
    wrap: [Wrap; 2],
    mips: bool,
}

impl Sampler {
    /// As glTF has it: LINEAR says that there are no mip levels, no filter that it is left to viewers.
    fn written(self) -> Value {
        let [s, t] = self.wrap.map(|wrap| match wrap {
            Wrap::Repeat => 10497,
            Wrap::Mirror => 33648,
            Wrap::Clamp => 33071,
        });
        let mut written = json!({ "wrapS": s, "wrapT": t });
        if !self.mips {
            written["minFilter"] = json!(9729);
        }
        written
    }
}

#[cfg(test)]
mod tests;
