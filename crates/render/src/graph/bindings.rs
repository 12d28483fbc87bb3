//! Resources bound by name, held against a shader's reflection.

use super::shader::{BindingKind, Reflection};
use crate::Gpu;

/// Something a pass can bind.
#[derive(Clone, Copy, Debug)]
pub enum Resource<'r> {
    /// A buffer.
    Buffer(&'r wgpu::Buffer),
    /// A texture, bound whole.
    Texture(&'r wgpu::Texture),
    /// One mip level of a texture.
    Level(&'r wgpu::Texture, u32),
    /// A sampler.
    Sampler(&'r wgpu::Sampler),
}

impl<'r> From<&'r wgpu::Buffer> for Resource<'r> {
    fn from(buffer: &'r wgpu::Buffer) -> Self {
        Resource::Buffer(buffer)
    }
}

impl<'r> From<&'r wgpu::Texture> for Resource<'r> {
    fn from(texture: &'r wgpu::Texture) -> Self {
        Resource::Texture(texture)
    }
}

impl<'r> From<(&'r wgpu::Texture, u32)> for Resource<'r> {
    fn from((texture, level): (&'r wgpu::Texture, u32)) -> Self {
        Resource::Level(texture, level)
    }
}

impl<'r> From<&'r wgpu::Sampler> for Resource<'r> {
    fn from(sampler: &'r wgpu::Sampler) -> Self {
        Resource::Sampler(sampler)
    }
}

/// A pass that does not match its shader.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum BindingError {
    /// The shader itself is not accepted.
    #[error("shader \"{shader}\": {message}")]
    Shader {
        /// The shader.
        shader: &'static str,
        /// Why.
        message: String,
    },
    /// The pass binds a name that the shader does not have.
    #[error("pass \"{pass}\" binds \"{name}\", which its shader does not have; it has: {}", available.join(", "))]
    Unknown {
        /// The pass.
        pass: &'static str,
        /// The name.
        name: &'static str,
        /// The shader's names.
        available: Vec<String>,
    },
    /// The pass leaves one of the shader's names unbound.
    #[error("pass \"{pass}\" does not bind \"{name}\", which its shader needs")]
    Missing {
        /// The pass.
        pass: &'static str,
        /// The name.
        name: String,
    },
    /// The pass binds a name twice.
    #[error("pass \"{pass}\" binds \"{name}\" twice")]
    Twice {
        /// The pass.
        pass: &'static str,
        /// The name.
        name: &'static str,
    },
    /// The shader has something else under that name.
    #[error("pass \"{pass}\" binds {found} as \"{name}\", where its shader has {expected:?}")]
    Kind {
        /// The pass.
        pass: &'static str,
        /// The name.
        name: &'static str,
        /// What is bound.
        found: String,
        /// What the shader has.
        expected: BindingKind,
    },
    /// The shader has no entry point of the pass's kind.
    #[error("pass \"{pass}\": shader \"{shader}\" has no such entry point")]
    NoEntryPoint {
        /// The pass.
        pass: &'static str,
        /// The shader.
        shader: &'static str,
    },
}

/// Resources by the names that a shader gives them.
#[derive(Debug, Default)]
pub struct Bindings(Vec<Bound>);

#[derive(Debug)]
struct Bound {
    name: &'static str,
    access: Access,
    handle: Handle,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Access {
    Read,
    Write,
}

#[derive(Debug)]
enum Handle {
    Buffer(wgpu::Buffer),
    Texture(wgpu::TextureView, wgpu::TextureViewDimension),
    Sampler(wgpu::Sampler),
}

impl Bindings {
    /// Binds a resource that is read.
    pub fn read(&mut self, name: &'static str, resource: Resource) {
        self.0.push(Bound { name, access: Access::Read, handle: Handle::new(resource) });
    }

    /// Binds a resource that is written.
    pub fn write(&mut self, name: &'static str, resource: Resource) {
        self.0.push(Bound { name, access: Access::Write, handle: Handle::new(resource) });
    }

    /// Holds the names and kinds against a shader's.
    ///
    /// # Errors
    /// A name that is unknown, missing, bound twice, or bound to something of another kind.
    pub fn check(&self, pass: &'static str, reflection: &Reflection) -> Result<(), BindingError> {
        for (i, bound) in self.0.iter().enumerate() {
            let name = bound.name;
            let Some(reflected) = reflection.bindings.iter().find(|reflected| reflected.name == name) else {
                let available = reflection.bindings.iter().map(|reflected| reflected.name.clone()).collect();
                return Err(BindingError::Unknown { pass, name, available });
            };
            if self.0[..i].iter().any(|earlier| earlier.name == name) {
                return Err(BindingError::Twice { pass, name });
            }
            if !bound.fits(reflected.kind, reflected.size) {
                return Err(BindingError::Kind { pass, name, found: bound.describe(), expected: reflected.kind });
            }
        }
        let missing = reflection.bindings.iter().find(|r| !self.0.iter().any(|bound| bound.name == r.name));
        match missing {
            Some(reflected) => Err(BindingError::Missing { pass, name: reflected.name.clone() }),
            None => Ok(()),
        }
    }

    /// The bind group of checked bindings.
    pub fn group(
        &self,
        gpu: &Gpu,
        label: &str,
        layout: &wgpu::BindGroupLayout,
        reflection: &Reflection,
    ) -> wgpu::BindGroup {
        let number = |name: &str| reflection.bindings.iter().find(|r| r.name == name).map(|r| r.binding);
        let entries: Vec<_> = self
            .0
            .iter()
            .filter_map(|bound| {
                let resource = match &bound.handle {
                    Handle::Buffer(buffer) => buffer.as_entire_binding(),
                    Handle::Texture(view, _) => wgpu::BindingResource::TextureView(view),
                    Handle::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
                };
                number(bound.name).map(|binding| wgpu::BindGroupEntry { binding, resource })
            })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
    }
}

impl Handle {
    fn new(resource: Resource) -> Self {
        match resource {
            Resource::Buffer(buffer) => Handle::Buffer(buffer.clone()),
            Resource::Texture(texture) => Handle::Texture(texture.create_view(&Default::default()), dimension(texture)),
            Resource::Level(texture, level) => {
                let view = wgpu::TextureViewDescriptor {
                    base_mip_level: level,
                    mip_level_count: Some(1),
                    ..Default::default()
                };
                Handle::Texture(texture.create_view(&view), dimension(texture))
            }
            Resource::Sampler(sampler) => Handle::Sampler(sampler.clone()),
        }
    }
}

/// How a texture is bound whole.
fn dimension(texture: &wgpu::Texture) -> wgpu::TextureViewDimension {
    match (texture.dimension(), texture.depth_or_array_layers()) {
        (wgpu::TextureDimension::D3, _) => wgpu::TextureViewDimension::D3,
        (_, 1) => wgpu::TextureViewDimension::D2,
        _ => wgpu::TextureViewDimension::D2Array,
    }
}

impl Bound {
    fn fits(&self, kind: BindingKind, size: u64) -> bool {
        match (&self.handle, self.access, kind) {
            (Handle::Buffer(buffer), Access::Read, BindingKind::StorageRead)
            | (Handle::Buffer(buffer), Access::Write, BindingKind::StorageWrite) => buffer.size() >= size,
            (Handle::Texture(_, is), Access::Read, BindingKind::Texture(want))
            | (Handle::Texture(_, is), Access::Write, BindingKind::StorageTexture(want)) => *is == want,
            (Handle::Sampler(_), Access::Read, BindingKind::Sampler) => true,
            _ => false,
        }
    }

    fn describe(&self) -> String {
        let access = match self.access {
            Access::Read => "read",
            Access::Write => "written",
        };
        match &self.handle {
            Handle::Buffer(buffer) => format!("a {access} buffer of {} bytes", buffer.size()),
            Handle::Texture(_, dimension) => format!("a {access} {dimension:?} texture"),
            Handle::Sampler(_) => "a sampler".into(),
        }
    }
}
