//! Every shader links and validates, and every struct shared with Rust has the same layout on both sides. No device.

use encase::private::StructMetadata;
use encase::{ShaderSize, ShaderType};

use crate::graph::{Shader, Tile};
use crate::resident::bodies::{Info, PackedBall, PackedSegment};
use crate::resident::{Light, Stride, View, Volume, surfaces};
use crate::{display, shadows, techniques};

/// Every shader that the build linked.
const SHADERS: &[Shader] = &include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

#[test]
fn every_shader_validates_and_can_be_bound() {
    assert!(SHADERS.len() >= 2, "the build found shaders");
    for shader in SHADERS {
        let reflection = shader.reflect().unwrap_or_else(|error| panic!("{error}"));
        assert!(!reflection.bindings.is_empty(), "{} binds nothing", shader.name);
        let storage = reflection.bindings.iter().filter(|b| b.size > 0).count();
        // WebGPU's default limits: 8 storage buffers and 16 sampled textures in a stage.
        assert!(storage <= 8, "{} has {storage} storage buffers", shader.name);
    }
}

/// A struct's member offsets and size in the linked WGSL.
fn shader_layout(shader: &str, name: &str) -> (Vec<u64>, u64) {
    let shader = SHADERS.iter().find(|s| s.name == shader).unwrap_or_else(|| panic!("no shader {shader}"));
    let module = naga::front::wgsl::parse_str(&shader.source).unwrap();
    let matches = |ty: &&naga::Type| ty.name.as_deref() == Some(name);
    let found = module.types.iter().map(|(_, ty)| ty).find(matches);
    let found = found.unwrap_or_else(|| panic!("{} has no struct {name}", shader.name));
    let naga::TypeInner::Struct { members, span } = &found.inner else { panic!("{name} is no struct") };
    (members.iter().map(|member| member.offset.into()).collect(), u64::from(*span))
}

fn rust_layout<T, const N: usize>() -> (Vec<u64>, u64)
where
    T: ShaderSize + ShaderType<ExtraMetadata = StructMetadata<N>>,
{
    (T::METADATA.extra.offsets.to_vec(), T::SHADER_SIZE.get())
}

/// The offsets of a struct that is uploaded as it lies in memory.
macro_rules! offsets {
    ($name:ident: $($field:ident),+) => { vec![$(std::mem::offset_of!($name, $field) as u64),+] };
}

#[test]
fn shared_structs_have_one_layout() {
    let march = "techniques/march/march";
    assert_eq!(rust_layout::<View, _>(), shader_layout(march, "View"));
    assert_eq!(rust_layout::<Tile, _>(), shader_layout(march, "Tile"));
    assert_eq!(rust_layout::<Volume, _>(), shader_layout(march, "Volume"));
    assert_eq!(rust_layout::<Light, _>(), shader_layout(march, "Light"));
    assert_eq!(rust_layout::<techniques::march::March, _>(), shader_layout(march, "March"));
    assert_eq!(rust_layout::<Stride, _>(), shader_layout(march, "Stride"));
    assert_eq!(rust_layout::<techniques::march::Scattering, _>(), shader_layout(march, "Scattering"));
    assert_eq!(rust_layout::<techniques::march::Refine, _>(), shader_layout("techniques/march/refine", "Refine"));
    assert_eq!(techniques::march::PATH_BYTES, shader_layout(march, "Path").1);
    assert_eq!(
        rust_layout::<techniques::slicing::Slicing, _>(),
        shader_layout("techniques/slicing/slicing", "Slicing")
    );
    let surface = "test/probes/surface";
    assert_eq!(rust_layout::<surfaces::Vertex, _>(), shader_layout(surface, "Vertex"));
    assert_eq!(rust_layout::<surfaces::Material, _>(), shader_layout(surface, "Material"));
    assert_eq!(rust_layout::<surfaces::Picture, _>(), shader_layout("resident/surfaces/mips", "Picture"));
    assert_eq!(rust_layout::<shadows::Cast, _>(), shader_layout("shadows/fit", "Cast"));
    assert_eq!(rust_layout::<shadows::Fit, _>(), shader_layout("shadows/fit", "Fit"));
    assert_eq!(rust_layout::<techniques::direct::Direct, _>(), shader_layout("techniques/direct/direct", "Direct"));
    let splats = "techniques/splatting/splats";
    assert_eq!(rust_layout::<techniques::splatting::Splat, _>(), shader_layout(splats, "Splat"));
    assert_eq!(rust_layout::<techniques::splatting::Kernel, _>(), shader_layout(splats, "Kernel"));
    assert_eq!(
        rust_layout::<techniques::project::Project, _>(),
        shader_layout("techniques/project/project", "Project")
    );
    let deposit = "techniques/transmittance/single";
    assert_eq!(rust_layout::<techniques::transmittance::Deposit, _>(), shader_layout(deposit, "Deposit"));
    let balls = "techniques/transmittance/balls";
    assert_eq!(rust_layout::<techniques::transmittance::Drawing, _>(), shader_layout(balls, "Drawing"));
    assert_eq!(techniques::transmittance::LIST, shader_layout("techniques/transmittance/deep_sort", "List").1);
    let cells = "techniques/cells/cells";
    assert_eq!(rust_layout::<techniques::cells::Cells, _>(), shader_layout(cells, "Cells"));
    assert_eq!(rust_layout::<techniques::cells::Tetrahedron, _>(), shader_layout(cells, "Tetrahedron"));
    assert_eq!(rust_layout::<techniques::cells::Node, _>(), shader_layout(cells, "Node"));
    assert_eq!(techniques::cells::PATH_BYTES, shader_layout(cells, "Path").1);
    let gather = "techniques/instant_radiosity/gather";
    assert_eq!(rust_layout::<techniques::instant_radiosity::vpl::Vpl, _>(), shader_layout(gather, "Vpl"));
    assert_eq!(techniques::instant_radiosity::VPL_BYTES, shader_layout(gather, "Vpl").1);
    assert_eq!(techniques::instant_radiosity::points::CELL_BYTES, shader_layout(gather, "Cell").1);
    let casters = rust_layout::<techniques::instant_radiosity::visibility::Casters, _>();
    assert_eq!(casters, shader_layout(gather, "Casters"));
    let ring = "techniques/instant_radiosity/ring";
    assert_eq!(rust_layout::<techniques::instant_radiosity::walkthrough::Ring, _>(), shader_layout(ring, "Ring"));
    let bodies = "test/probes/bodies";
    assert_eq!(rust_layout::<Info, _>(), shader_layout(bodies, "Bodies"));
    let offsets = offsets!(PackedBall: position, radius, depth, medium, color);
    assert_eq!((offsets, size_of::<PackedBall>() as u64), shader_layout(bodies, "Ball"));
    let offsets = offsets!(PackedSegment: begin, radius, end, depth, color, medium);
    assert_eq!((offsets, size_of::<PackedSegment>() as u64), shader_layout(bodies, "Segment"));
    assert_eq!(rust_layout::<display::Parameters, _>(), shader_layout("display/display", "Display"));
}

#[test]
#[should_panic(expected = "assertion")]
fn another_layout_is_caught() {
    #[derive(encase::ShaderType)]
    struct Wider {
        origin: glam::UVec3,
        size: glam::UVec2,
        round: u32,
        frame: u32,
    }
    assert_eq!(rust_layout::<Wider, _>(), shader_layout("techniques/march/march", "Tile"));
}
