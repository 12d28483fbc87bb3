//! Materials and their pictures.

use std::io::Cursor;
use std::sync::Arc;

use glam::{Affine2, Vec2, Vec3};
use image::{ImageFormat, RgbaImage};
use serde_json::{Value, json};

use super::super::gltf::place;
use super::super::texture::{linear_from_srgb, srgb_from_linear};
use super::super::{Bsdf, Map, Material, SurfaceError};
use super::{Sampler, Writer};

impl Writer {
    /// A material. Lambert is a dielectric without gloss (`KHR_materials_specular`), a mirror a smooth metal, glass a smooth
    /// dielectric that transmits all.
    pub(super) fn material(&mut self, material: &Arc<Material>, light_map: bool) -> Result<usize, SurfaceError> {
        let key = (Arc::as_ptr(material).addr(), light_map);
        if let Some(&known) = self.known_materials.get(&key) {
            return Ok(known);
        }
        let mut pbr = json!({});
        let mut extensions = json!({});
        let base = |color: Vec3| json!([color.x, color.y, color.z, 1.0]);
        match &material.bsdf {
            Bsdf::Lambert { reflectance, map } => {
                pbr = json!({ "baseColorFactor": base(*reflectance), "metallicFactor": 0.0, "roughnessFactor": 1.0 });
                self.picture(&mut pbr, "baseColorTexture", map.as_ref(), true)?;
                extensions["KHR_materials_specular"] = json!({ "specularFactor": 0.0 });
            }
            Bsdf::MetallicRoughness { base_color, base_color_map, metallic, roughness, metallic_roughness_map } => {
                pbr = json!({ "baseColorFactor": base(*base_color), "metallicFactor": metallic, "roughnessFactor": roughness });
                self.picture(&mut pbr, "baseColorTexture", base_color_map.as_ref(), true)?;
                self.picture(&mut pbr, "metallicRoughnessTexture", metallic_roughness_map.as_ref(), false)?;
            }
            Bsdf::Mirror { reflectance } => {
                pbr = json!({ "baseColorFactor": base(*reflectance), "metallicFactor": 1.0, "roughnessFactor": 0.0 });
            }
            Bsdf::Dielectric { ior } => {
                pbr["metallicFactor"] = json!(0.0);
                pbr["roughnessFactor"] = json!(0.0);
                extensions["KHR_materials_transmission"] = json!({ "transmissionFactor": 1.0 });
                extensions["KHR_materials_ior"] = json!({ "ior": ior });
            }
        }
        let mut written = json!({ "name": material.name, "pbrMetallicRoughness": pbr });
        let strength = material.emission.max_element();
        if strength > 0.0 {
            written["emissiveFactor"] = json!((material.emission / strength.max(1.0)).to_array());
            if strength > 1.0 {
                extensions["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": strength });
            }
        }
        self.picture(&mut written, "emissiveTexture", material.emission_map.as_ref(), true)?;
        if light_map && material.emission_map.is_some() {
            written["emissiveTexture"]["texCoord"] = json!(1);
        }
        if let Some(normals) = &material.normal_map {
            self.picture(&mut written, "normalTexture", Some(&normals.map), false)?;
            written["normalTexture"]["scale"] = json!(normals.scale);
        }
        self.picture(&mut written, "occlusionTexture", material.occlusion_map.as_ref(), false)?;
        if material.double_sided {
            written["doubleSided"] = json!(true);
        }
        if let Some(cutoff) = material.alpha_cutoff {
            written["alphaMode"] = json!("MASK");
            written["alphaCutoff"] = json!(cutoff);
        }
        const KNOWN: [&str; 4] = [
            "KHR_materials_specular",
            "KHR_materials_transmission",
            "KHR_materials_ior",
            "KHR_materials_emissive_strength",
        ];
        self.extensions.extend(KNOWN.into_iter().filter(|name| extensions.get(name).is_some()));
        if extensions.as_object().is_some_and(|extensions| !extensions.is_empty()) {
            written["extensions"] = extensions;
        }
        self.materials.push(written);
        self.known_materials.insert(key, self.materials.len() - 1);
        Ok(self.materials.len() - 1)
    }

    /// A picture as PNG, in the coding that its use has in glTF.
    fn picture(&mut self, into: &mut Value, field: &str, map: Option<&Map>, srgb: bool) -> Result<(), SurfaceError> {
        let Some(Map { texture, wrap, transform, second, mips }) = map else { return Ok(()) };
        let key = (Arc::as_ptr(texture).addr(), srgb);
        let image = match self.known_images.get(&key) {
            Some(&known) => known,
            None => {
                let recode = |byte: u8| match (texture.srgb, srgb) {
                    (true, false) => (linear_from_srgb(f32::from(byte) / 255.0) * 255.0).round() as u8,
                    (false, true) => (srgb_from_linear(f32::from(byte) / 255.0) * 255.0).round() as u8,
                    _ => byte,
                };
                let texels =
                    texture.texels.iter().flat_map(|&[r, g, b, a]| [recode(r), recode(g), recode(b), a]).collect();
                let picture = RgbaImage::from_raw(texture.width, texture.height, texels);
                let mut png = Cursor::new(Vec::new());
                picture
                    .ok_or_else(|| SurfaceError::corrupt("a picture has less texels than its size says"))?
                    .write_to(&mut png, ImageFormat::Png)
                    .map_err(|error| SurfaceError::corrupt(error.to_string()))?;
                let view = self.view(png.get_ref(), None);
                self.images.push(json!({ "bufferView": view, "mimeType": "image/png" }));
                self.known_images.insert(key, self.images.len() - 1);
                self.images.len() - 1
            }
        };
        let used = (image, Sampler { wrap: *wrap, mips: *mips });
        let known = self.textures.iter().position(|known| *known == used);
        let index = known.unwrap_or_else(|| {
            self.textures.push(used);
            self.textures.len() - 1
        });
        into[field] = json!({ "index": index });
        if *second {
            into[field]["texCoord"] = json!(1);
        }
        if *transform != Affine2::IDENTITY {
            self.extensions.insert("KHR_texture_transform");
            into[field]["extensions"] = json!({ "KHR_texture_transform": parts(transform)? });
        }
        Ok(())
    }
}

/// The offset, rotation and scale of a picture's transform; glTF has no others.
fn parts(transform: &Affine2) -> Result<Value, SurfaceError> {
    let (along, offset) = (transform.matrix2.x_axis, transform.translation);
    let rotation = (-along.y).atan2(along.x);
    let scale = Vec2::new(along.length(), transform.matrix2.determinant() / along.length());
    if !place(offset, rotation, scale)
        .abs_diff_eq(*transform, 1e-5 * transform.matrix2.abs().to_cols_array().into_iter().fold(1.0, f32::max))
    {
        return Err(SurfaceError::corrupt("a picture is sheared, or has no size"));
    }
    Ok(json!({ "offset": offset.to_array(), "rotation": rotation, "scale": scale.to_array() }))
}
