/// How a ray is walked (`walk.wesl`).
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Stride {
    /// The longest segment [voxels].
    pub step: f32,
    /// The shortest length that counts [m].
    pub least: f32,
    /// Where in its segment a sample lies: 0.5 is the middle.
    pub offset: f32,
    /// Optical depth within which segments count as one; 0: never.
    pub tolerance: f32,
    /// 1 where empty bricks are passed over.
    pub skip: u32,
    /// 1 where light varies along the ray.
    pub lit: u32,
}
