use glam::Vec3;
use tyndall_scene::description::Camera;

/// The camera and the film as shaders see them (`view.wesl`).
#[derive(Clone, Copy, Debug, PartialEq, encase::ShaderType)]
pub struct View {
    /// The eye [m].
    pub position: Vec3,
    /// The film's width [pixel].
    pub width: u32,
    /// From the film's centre to its right edge, at unit distance along `forward`.
    pub right: Vec3,
    /// The film's height [pixel].
    pub height: u32,
    /// From the film's centre to its top edge, at unit distance along `forward`.
    pub up: Vec3,
    /// Unit vector in the middle of the view.
    pub forward: Vec3,
    /// Radiance behind everything [W·sr⁻¹·m⁻²].
    pub environment: Vec3,
    /// How far an environment map is turned about y [rad].
    pub sky_rotation: f32,
}

impl View {
    /// A camera's view; one without a frame (it looks at itself) looks along −z.
    pub fn new(camera: &Camera, film: [u32; 2], environment: Vec3, sky_rotation: f32) -> Self {
        let [right, up, backward] = camera.frame().unwrap_or([Vec3::X, Vec3::Y, Vec3::Z]);
        let half_height = (camera.fov.to_radians() / 2.0).tan();
        let aspect = film[0] as f32 / film[1] as f32;
        Self {
            position: camera.position,
            width: film[0],
            right: right * (half_height * aspect),
            height: film[1],
            up: up * half_height,
            forward: -backward,
            environment,
            sky_rotation,
        }
    }
}
