//! Materials with their pictures.

use std::sync::Arc;

use glam::Vec3;
use gltf::image::Source as Place;
use gltf::material::AlphaMode;
use gltf::{Material as Described, Texture as Named};

use super::super::{Bsdf, Map, Material, NormalMap, SurfaceError, Texture, Transmission};
use super::{Reader, container};

/// The set of texture coordinates that a material's pictures use: that of the first of them.
pub(super) fn texcoords(material: &Described) -> u32 {
    let pbr = material.pbr_metallic_roughness();
    let sets = [
        pbr.base_color_texture().map(|texture| texture.tex_coord()),
        pbr.metallic_roughness_texture().map(|texture| texture.tex_coord()),
        material.normal_texture().map(|texture| texture.tex_coord()),
        material.emissive_texture().map(|texture| texture.tex_coord()),
    ];
    sets.into_iter().flatten().next().unwrap_or(0)
}

impl Reader<'_, '_> {
    /// A material, read once.
    pub(super) fn material(&mut self, described: &Described) -> Result<Arc<Material>, SurfaceError> {
        if let Some(known) = self.materials.get(&described.index()) {
            return Ok(known.clone());
        }
        let material = Arc::new(self.read_material(described));
        self.materials.insert(described.index(), material.clone());
        Ok(material)
    }

    fn read_material(&mut self, described: &Described) -> Material {
        let name = match (described.name(), described.index()) {
            (Some(name), _) => name.to_owned(),
            (None, Some(index)) => format!("material {index}"),
            (None, None) => "default".into(),
        };
        let set = texcoords(described);
        let pbr = described.pbr_metallic_roughness();
        let [r, g, b, alpha] = pbr.base_color_factor();
        let base_color_map =
            pbr.base_color_texture().and_then(|t| self.map(&t.texture(), t.tex_coord() == set, true, &name));
        let metallic_roughness_map =
            pbr.metallic_roughness_texture().and_then(|t| self.map(&t.texture(), t.tex_coord() == set, false, &name));
        let normal_map = described.normal_texture().and_then(|t| {
            let map = self.map(&t.texture(), t.tex_coord() == set, false, &name)?;
            Some(NormalMap { map, scale: t.scale() })
        });
        let emission_map =
            described.emissive_texture().and_then(|t| self.map(&t.texture(), t.tex_coord() == set, true, &name));
        let occlusion_map =
            described.occlusion_texture().and_then(|t| self.map(&t.texture(), t.tex_coord() == set, false, &name));
        let emission = Vec3::from(described.emissive_factor()) * described.emissive_strength().unwrap_or(1.0);
        let alpha_cutoff = match described.alpha_mode() {
            AlphaMode::Opaque => None,
            // The picture's alpha times the factor is held against the cutoff.
            AlphaMode::Mask if alpha > 0.0 => Some((described.alpha_cutoff().unwrap_or(0.5) / alpha).min(f32::MAX)),
            AlphaMode::Mask => Some(f32::MAX),
            AlphaMode::Blend => {
                self.warn(&name, "is blended, which is not rendered; it is opaque");
                None
            }
        };
        let transmission = self.transmission(described, set, &name);
        let sound = |x: f32, fallback: f32| if x.is_finite() { x.clamp(0.0, 1.0) } else { fallback };
        let (metallic, roughness) = (sound(pbr.metallic_factor(), 1.0), sound(pbr.roughness_factor(), 1.0));
        let base_color = self.color(&name, Vec3::new(r, g, b));
        let dull = described.specular().is_some_and(|specular| specular.specular_factor() == 0.0);
        if described.specular().is_some() && !(dull && metallic == 0.0) {
            self.warn(
                &name,
                "has KHR_materials_specular, which is not rendered but where it says that there is no gloss",
            );
        }
        Material {
            bsdf: if dull && metallic == 0.0 {
                Bsdf::Lambert { reflectance: base_color, map: base_color_map }
            } else {
                Bsdf::MetallicRoughness { base_color, base_color_map, metallic, roughness, metallic_roughness_map }
            },
            emission: self.color(&name, emission),
            emission_map,
            normal_map,
            double_sided: described.double_sided(),
            alpha_cutoff,
            occlusion_map,
            transmission,
            name,
        }
    }

    /// What passes through a material, kept and warned about.
    fn transmission(&mut self, described: &Described, set: u32, name: &str) -> Option<Transmission> {
        let (transmission, volume) = (described.transmission(), described.volume());
        if transmission.is_none() && volume.is_none() && described.ior().is_none_or(|ior| ior == 1.5) {
            return None;
        }
        self.warn(name, "transmits light or has a refractive index, which is read and not rendered");
        let map = transmission.as_ref().and_then(|t| t.transmission_texture());
        let map = map.and_then(|t| self.map(&t.texture(), t.tex_coord() == set, false, name));
        let thickness_map = volume.as_ref().and_then(|v| v.thickness_texture());
        let thickness_map = thickness_map.and_then(|t| self.map(&t.texture(), t.tex_coord() == set, false, name));
        Some(Transmission {
            factor: transmission.map_or(0.0, |t| t.transmission_factor()),
            map,
            ior: described.ior().unwrap_or(1.5),
            thickness: volume.as_ref().map_or(0.0, |v| v.thickness_factor()),
            thickness_map,
            attenuation_distance: volume.as_ref().map_or(f32::INFINITY, |v| v.attenuation_distance()),
            attenuation_color: volume.as_ref().map_or(Vec3::ONE, |v| v.attenuation_color().into()),
        })
    }

    /// A colour that is one.
    fn color(&self, name: &str, color: Vec3) -> Vec3 {
        if color.is_finite() && color.min_element() >= 0.0 {
            return color;
        }
        self.warn(name, "has a colour or emission that is no number >= 0; black in its place");
        Vec3::ZERO
    }

    fn warn(&self, name: &str, what: &str) {
        tracing::warn!("{}: the material {name:?} {what}", self.source.object);
    }

    /// A picture, or `None` and a warning where it cannot be had.
    fn map(&mut self, texture: &Named, same_set: bool, srgb: bool, name: &str) -> Option<Map> {
        if !same_set {
            self.warn(
                name,
                "has pictures of several sets of texture coordinates; those of others than the first are left out",
            );
            return None;
        }
        let of = format!("the material {name:?}");
        let (image, buffers) = (texture.source(), &self.buffers);
        match image.source() {
            Place::Uri { uri, .. } if !uri.starts_with("data:") => {
                self.source.picture(&container::decoded(uri), srgb, &of)
            }
            place => {
                let key = format!("{}#{}", self.source.file, image.index());
                self.source.texture((key, srgb), &of, |source| {
                    let decode =
                        |bytes: &[u8]| Texture::decode(bytes, srgb, *source.left).map_err(|error| error.to_string());
                    match place {
                        Place::View { view, .. } => decode(buffers.view(&view).map_err(|error| error.to_string())?),
                        Place::Uri { uri, .. } => {
                            let bytes = container::bytes(source, uri, source.left.0);
                            decode(&bytes.map_err(|error| error.to_string())?)
                        }
                    }
                })
            }
        }
    }
}
