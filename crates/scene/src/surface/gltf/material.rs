//! Materials with their pictures.

use std::sync::Arc;

use glam::Vec3;
use gltf::Material as Described;
use gltf::material::AlphaMode;

use super::super::{Bsdf, Material, NormalMap, SurfaceError, Transmission};
use super::Reader;
use super::texture::{Use, described, sets};

impl Reader<'_, '_> {
    /// A material, read once.
    pub(super) fn material(&mut self, described: &Described) -> Result<Arc<Material>, SurfaceError> {
        if let Some(known) = self.materials.get(&described.index()) {
            return Ok(known.clone());
        }
        let material = Arc::new(self.read_material(described)?);
        self.materials.insert(described.index(), material.clone());
        Ok(material)
    }

    fn read_material(&mut self, described: &Described) -> Result<Material, SurfaceError> {
        let name = match (described.name(), described.index()) {
            (Some(name), _) => name.to_owned(),
            (None, Some(index)) => format!("material {index}"),
            (None, None) => "default".into(),
        };
        let sets = sets(described)?;
        let pbr = described.pbr_metallic_roughness();
        let [r, g, b, alpha] = pbr.base_color_factor();
        let mut map = |of: Option<Use>, srgb: bool| self.map(of, &sets, srgb, &name);
        let base_color_map = map(described!(pbr.base_color_texture())?, true);
        let metallic_roughness_map = map(described!(pbr.metallic_roughness_texture())?, false);
        let normal_map = map(described!(described.normal_texture())?, false);
        let scale = described.normal_texture().map_or(1.0, |texture| texture.scale());
        let normal_map = normal_map.map(|map| NormalMap { map, scale });
        let emission_map = map(described!(described.emissive_texture())?, true);
        let occlusion_map = map(described!(described.occlusion_texture())?, false);
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
        let transmission = self.transmission(described, &sets, &name)?;
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
        Ok(Material {
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
        })
    }

    /// What passes through a material, kept and warned about.
    fn transmission(
        &mut self,
        described: &Described,
        sets: &[u32],
        name: &str,
    ) -> Result<Option<Transmission>, SurfaceError> {
        let (transmission, volume) = (described.transmission(), described.volume());
        if transmission.is_none() && volume.is_none() && described.ior().is_none_or(|ior| ior == 1.5) {
            return Ok(None);
        }
        self.warn(name, "transmits light or has a refractive index, which is read and not rendered");
        let map = described!(transmission.as_ref().and_then(|t| t.transmission_texture()))?;
        let map = self.map(map, sets, false, name);
        let thickness_map = described!(volume.as_ref().and_then(|v| v.thickness_texture()))?;
        let thickness_map = self.map(thickness_map, sets, false, name);
        Ok(Some(Transmission {
            factor: transmission.map_or(0.0, |t| t.transmission_factor()),
            map,
            ior: described.ior().unwrap_or(1.5),
            thickness: volume.as_ref().map_or(0.0, |v| v.thickness_factor()),
            thickness_map,
            attenuation_distance: volume.as_ref().map_or(f32::INFINITY, |v| v.attenuation_distance()),
            attenuation_color: volume.as_ref().map_or(Vec3::ONE, |v| v.attenuation_color().into()),
        }))
    }

    /// A colour that is one.
    fn color(&self, name: &str, color: Vec3) -> Vec3 {
        if color.is_finite() && color.min_element() >= 0.0 {
            return color;
        }
        self.warn(name, "has a colour or emission that is no number >= 0; black in its place");
        Vec3::ZERO
    }

    pub(super) fn warn(&self, name: &str, what: &str) {
        tracing::warn!("{}: the material {name:?} {what}", self.source.object);
    }
}
