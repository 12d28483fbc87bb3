//! A shader and what it says of itself: names, kinds and numbers of its bindings, read from the linked WGSL by naga.

use std::borrow::Cow;

use naga::{AddressSpace, ImageClass, ImageDimension, ShaderStage, StorageAccess, TypeInner};

use super::BindingError;

/// A linked shader: its path under `src`, and its WGSL.
#[derive(Clone, Debug)]
pub struct Shader {
    /// Path under `src`, without ending.
    pub name: &'static str,
    /// Plain WGSL.
    pub source: Cow<'static, str>,
}

/// The shader linked from `src/<path>.wesl`.
macro_rules! shader {
    ($path:literal) => {
        $crate::graph::Shader {
            name: $path,
            source: std::borrow::Cow::Borrowed(include_str!(concat!(env!("OUT_DIR"), "/", $path, ".wgsl"))),
        }
    };
}
pub(crate) use shader;

/// What a shader expects at a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// A buffer that is read.
    StorageRead,
    /// A buffer that is written.
    StorageWrite,
    /// A texture that is sampled or loaded from.
    Texture(wgpu::TextureViewDimension),
    /// A texture that is written texel by texel.
    StorageTexture(wgpu::TextureViewDimension),
    /// A sampler.
    Sampler,
}

/// One binding of a shader.
#[derive(Clone, Debug)]
pub struct Reflected {
    /// Its name in the shader.
    pub name: String,
    /// Its number in group 0.
    pub binding: u32,
    /// What it is.
    pub kind: BindingKind,
    /// A buffer's least size [bytes]; 0 for what is no buffer.
    pub size: u64,
}

/// What a shader says of itself.
#[derive(Clone, Debug)]
pub struct Reflection {
    /// The bindings that entry points use, all in group 0.
    pub bindings: Vec<Reflected>,
    /// The names of its `override`s.
    pub overrides: Vec<String>,
    /// The compute entry point's workgroup size; `None` for vertex and fragment shaders.
    pub workgroup: Option<[u32; 3]>,
}

impl Shader {
    /// The source of a shader that is not as it was linked; what else tells shaders apart is the name.
    pub(super) fn own(&self) -> &str {
        match &self.source {
            Cow::Borrowed(_) => "",
            Cow::Owned(source) => source,
        }
    }

    /// Parses and validates the shader and reads its bindings.
    ///
    /// # Errors
    /// A shader that naga does not accept, or a binding outside group 0.
    pub fn reflect(&self) -> Result<Reflection, BindingError> {
        let invalid = |message: String| BindingError::Shader { shader: self.name, message };
        let module = naga::front::wgsl::parse_str(&self.source)
            .map_err(|error| invalid(error.emit_to_string_with_path(&self.source, self.name)))?;
        // Every WebGPU device packs half floats.
        let capabilities = naga::valid::Capabilities::default() | naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32;
        let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities);
        let info = validator.validate(&module).map_err(|error| invalid(error.emit_to_string(&self.source)))?;
        let mut bindings = Vec::new();
        for (handle, variable) in module.global_variables.iter() {
            let Some(place) = variable.binding else { continue };
            let used = (0..module.entry_points.len()).any(|entry| !info.get_entry_point(entry)[handle].is_empty());
            if !used {
                continue;
            }
            let name = variable.name.clone().unwrap_or_default();
            if place.group != 0 {
                return Err(invalid(format!("binding `{name}` is in group {}; accepted: group 0", place.group)));
            }
            let inner = &module.types[variable.ty].inner;
            let Some(kind) = binding_kind(inner, variable.space) else {
                return Err(invalid(format!("binding `{name}` is of a kind that passes cannot bind: {inner:?}")));
            };
            let buffer = matches!(kind, BindingKind::StorageRead | BindingKind::StorageWrite);
            let size = if buffer { u64::from(inner.size(module.to_ctx())) } else { 0 };
            bindings.push(Reflected { name, binding: place.binding, kind, size });
        }
        let compute = module.entry_points.iter().find(|entry| entry.stage == ShaderStage::Compute);
        let overrides = module.overrides.iter().filter_map(|(_, constant)| constant.name.clone()).collect();
        Ok(Reflection { bindings, overrides, workgroup: compute.map(|entry| entry.workgroup_size) })
    }
}

fn binding_kind(inner: &TypeInner, space: AddressSpace) -> Option<BindingKind> {
    Some(match (space, inner) {
        (AddressSpace::Storage { access }, _) if access.contains(StorageAccess::STORE) => BindingKind::StorageWrite,
        (AddressSpace::Storage { .. }, _) => BindingKind::StorageRead,
        (_, TypeInner::Sampler { .. }) => BindingKind::Sampler,
        (_, TypeInner::Image { dim, arrayed, class }) => {
            let dimension = match (dim, arrayed) {
                (ImageDimension::D2, false) => wgpu::TextureViewDimension::D2,
                (ImageDimension::D2, true) => wgpu::TextureViewDimension::D2Array,
                (ImageDimension::D3, false) => wgpu::TextureViewDimension::D3,
                _ => return None,
            };
            match class {
                ImageClass::Storage { .. } => BindingKind::StorageTexture(dimension),
                _ => BindingKind::Texture(dimension),
            }
        }
        _ => return None,
    })
}
