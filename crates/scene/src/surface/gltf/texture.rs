//! Pictures as materials use them.

use glam::{Affine2, Mat2, Vec2};
use gltf::image::Source as Place;
use gltf::texture::{MinFilter, WrappingMode};
use gltf::{Material as Described, Texture as Named};
use serde::Deserialize;
use serde_json::Value;

use super::super::{Map, SurfaceError, Texture, Wrap};
use super::{Reader, container};

/// A picture as a material uses it.
pub(super) struct Use<'a> {
    texture: Named<'a>,
    /// The set of texture coordinates.
    set: u32,
    transform: Affine2,
}

/// `KHR_texture_transform`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Transform {
    #[serde(default)]
    offset: Vec2,
    #[serde(default)]
    rotation: f32,
    #[serde(default = "one")]
    scale: Vec2,
    tex_coord: Option<u32>,
}

fn one() -> Vec2 {
    Vec2::ONE
}

/// A picture of any of the crate's three types, which have these methods alike.
macro_rules! described {
    ($info:expr) => {
        $info
            .map(|info| Use::new(info.texture(), info.tex_coord(), info.extension_value("KHR_texture_transform")))
            .transpose()
    };
}
pub(super) use described;

impl<'a> Use<'a> {
    pub fn new(texture: Named<'a>, set: u32, transform: Option<&Value>) -> Result<Self, SurfaceError> {
        let Some(value) = transform else { return Ok(Self { texture, set, transform: Affine2::IDENTITY }) };
        let wrong = |what: String| {
            SurfaceError::corrupt(format!("the KHR_texture_transform of the texture {}: {what}", texture.index()))
        };
        let Transform { offset, rotation, scale, tex_coord } =
            Transform::deserialize(value).map_err(|error| wrong(error.to_string()))?;
        let transform = place(offset, rotation, scale);
        if !transform.is_finite() {
            return Err(wrong(format!("{value} has numbers that are none")));
        }
        Ok(Self { texture, set: tex_coord.unwrap_or(set), transform })
    }
}

/// Texture coordinates scaled, turned counter-clockwise as v goes down, and moved: the text of the extension draws the
/// rotation's matrix transposed, and contradicts its own example, which this reproduces. [KHR_texture_transform]
pub(in super::super) fn place(offset: Vec2, rotation: f32, scale: Vec2) -> Affine2 {
    Affine2 { matrix2: Mat2::from_angle(-rotation) * Mat2::from_diagonal(scale), translation: offset }
}

/// The sets of texture coordinates that a material's pictures use, in the order of these: the first and the second become
/// those of its meshes.
pub(super) fn sets(material: &Described) -> Result<Vec<u32>, SurfaceError> {
    let pbr = material.pbr_metallic_roughness();
    let uses = [
        described!(pbr.base_color_texture())?,
        described!(pbr.metallic_roughness_texture())?,
        described!(material.normal_texture())?,
        described!(material.emissive_texture())?,
        described!(material.occlusion_texture())?,
        described!(material.transmission().and_then(|t| t.transmission_texture()))?,
        described!(material.volume().and_then(|v| v.thickness_texture()))?,
    ];
    let mut sets = Vec::new();
    for set in uses.iter().flatten().map(|of| of.set) {
        if !sets.contains(&set) {
            sets.push(set);
        }
    }
    Ok(sets)
}

impl Reader<'_, '_> {
    /// A picture of the material `name`, whose first and second set of texture coordinates are those of `sets`, or `None` and
    /// a warning where it cannot be had.
    pub(super) fn map(&mut self, of: Option<Use>, sets: &[u32], srgb: bool, name: &str) -> Option<Map> {
        let Use { texture, set, transform } = of?;
        let second = match sets.iter().position(|&known| known == set) {
            Some(0) => false,
            Some(1) => true,
            _ => {
                self.warn(
                    name,
                    "has pictures of more than two sets of texture coordinates; those of others are left out",
                );
                return None;
            }
        };
        let map = self.picture(&texture, srgb, &format!("the material {name:?}"))?;
        let sampler = texture.sampler();
        let wrap = [sampler.wrap_s(), sampler.wrap_t()].map(|mode| match mode {
            WrappingMode::Repeat => Wrap::Repeat,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::ClampToEdge => Wrap::Clamp,
        });
        let mips = !matches!(sampler.min_filter(), Some(MinFilter::Nearest | MinFilter::Linear));
        Some(Map { wrap, transform, second, mips, ..map })
    }

    fn picture(&mut self, texture: &Named, srgb: bool, of: &str) -> Option<Map> {
        let (image, buffers) = (texture.source(), &self.buffers);
        match image.source() {
            Place::Uri { uri, .. } if !uri.starts_with("data:") => {
                self.source.picture(&container::decoded(uri), srgb, of)
            }
            place => {
                let key = format!("{}#{}", self.source.file, image.index());
                self.source.texture((key, srgb), of, |source| {
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
