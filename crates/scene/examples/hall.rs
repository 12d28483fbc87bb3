//! Writes a hall of some 40,000 triangles as glTF: turned columns along the walls, tables and chairs between them, a few
//! lamps beneath the ceiling. `cargo run -p tyndall-scene --example hall -- hall.glb`

use std::f32::consts::TAU;
use std::sync::Arc;

use tyndall_scene::description::Camera;
use tyndall_scene::glam::{Mat4, Vec2, Vec3};
use tyndall_scene::surface::{Bsdf, Export, Exported, Material, Surface, TriangleMesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("accepted: hall FILE.glb")?;
    let hall = hall();
    let triangles: usize = hall.surfaces.iter().map(|exported| exported.surface.mesh.triangles.len()).sum();
    std::fs::write(&path, hall.to_glb()?)?;
    println!("{path}: {triangles} triangles in {} surfaces", hall.surfaces.len());
    Ok(())
}

/// The hall: 16 m × 5 m × 10 m, y up, its fronts inside.
pub fn hall() -> Export {
    let material = |name: &str, reflectance: [f32; 3]| {
        let bsdf = Bsdf::Lambert { reflectance: Vec3::from(reflectance), map: None };
        Arc::new(Material { name: name.into(), bsdf, ..Material::default() })
    };
    let (plaster, stone) = (material("plaster", [0.75, 0.72, 0.66]), material("stone", [0.55, 0.53, 0.5]));
    let (wood, cloth) = (material("wood", [0.42, 0.26, 0.14]), material("cloth", [0.5, 0.08, 0.07]));
    let lamp = Arc::new(Material {
        name: "lamp".into(),
        emission: Vec3::new(25.0, 22.0, 17.0),
        bsdf: Bsdf::Lambert { reflectance: Vec3::splat(0.5), map: None },
        ..Material::default()
    });
    let mut surfaces = Vec::new();
    let mut put = |name: String, mesh: &Arc<TriangleMesh>, at: [f32; 3], material: &Arc<Material>| {
        let world_from_object = Mat4::from_translation(Vec3::from(at));
        let surface = Surface { name, mesh: mesh.clone(), world_from_object, material: material.clone() };
        surfaces.push(Exported { surface, light_map_texcoords: Vec::new() });
    };
    put("room".into(), &Arc::new(cuboid([16.0, 5.0, 10.0], true)), [8.0, 2.5, 5.0], &plaster);
    let column = Arc::new(turned(48, 33));
    let [leg, seat, back, top] = [[0.04, 0.45, 0.04], [0.42, 0.04, 0.42], [0.42, 0.5, 0.03], [1.6, 0.05, 0.8]]
        .map(|size| Arc::new(cuboid(size, false)));
    let light = Arc::new(panel());
    for i in 0..6 {
        let x = 2.0 + 2.4 * i as f32;
        for (side, z) in [0.9, 9.1].into_iter().enumerate() {
            put(format!("column {i} {side}"), &column, [x, 0.0, z], &stone);
        }
        put(format!("lamp {i}"), &light, [x, 4.9, 5.0], &lamp);
        for (row, z) in [3.4, 6.6].into_iter().enumerate() {
            put(format!("table {i} {row}"), &top, [x, 0.74, z], &wood);
            for side in [-1.0f32, 1.0] {
                let chair = format!("chair {i} {row} {side}");
                put(format!("{chair} seat"), &seat, [x, 0.47, z + 0.7 * side], &cloth);
                put(format!("{chair} back"), &back, [x, 0.75, z + 0.9 * side], &cloth);
                for (n, [dx, dz]) in
                    [[-0.18, -0.18], [0.18, -0.18], [-0.18, 0.18], [0.18, 0.18]].into_iter().enumerate()
                {
                    put(format!("{chair} leg {n}"), &leg, [x + dx, 0.225, z + 0.7 * side + dz], &wood);
                }
            }
        }
    }
    let camera =
        Camera { position: Vec3::new(15.2, 2.1, 8.4), target: Vec3::new(6.0, 1.3, 4.2), up: Vec3::Y, fov: 50.0 };
    Export { surfaces, lights: Vec::new(), cameras: vec![("eye".into(), camera, 1.0)] }
}

/// A box about the origin.
fn cuboid(size: [f32; 3], inside: bool) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let half = Vec3::from(size) / 2.0;
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for sign in [-1.0, 1.0] {
            let normal = axis * sign;
            let u = Vec3::new(axis.z, axis.x, axis.y);
            let v = normal.cross(u);
            let corners = [-u - v, u - v, u + v, -u + v].map(|corner| (normal + corner) * half);
            face(&mut mesh, corners, if inside { -normal } else { normal }, inside);
        }
    }
    mesh
}

/// A panel of a metre by half a metre, facing down.
fn panel() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let corners = [[-0.5, 0.0, -0.25], [0.5, 0.0, -0.25], [0.5, 0.0, 0.25], [-0.5, 0.0, 0.25]];
    face(&mut mesh, corners.map(Vec3::from), Vec3::NEG_Y, false);
    mesh
}

fn face(mesh: &mut TriangleMesh, corners: [Vec3; 4], normal: Vec3, turned: bool) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners);
    mesh.normals.extend([normal; 4]);
    mesh.texcoords.extend([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(Vec2::from));
    let triangles = if turned { [[0, 2, 1], [0, 3, 2]] } else { [[0, 1, 2], [0, 2, 3]] };
    mesh.triangles.extend(triangles.map(|triangle| triangle.map(|corner: u32| first + corner)));
}

/// A column of 5 m: a profile with a swelling and two rings, turned about y.
fn turned(around: u32, rows: u32) -> TriangleMesh {
    let radius = |y: f32| {
        let ring = |at: f32| 0.06 * (-((y - at) / 0.12).powi(2)).exp();
        0.24 - 0.02 * (y / 5.0 - 0.4).powi(2) * 4.0 + ring(0.25) + ring(4.7)
    };
    let mut mesh = TriangleMesh::default();
    for row in 0..=rows {
        let y = 5.0 * row as f32 / rows as f32;
        let slope = (radius(y + 1e-3) - radius(y - 1e-3)) / 2e-3;
        for column in 0..=around {
            let (sin, cos) = (TAU * column as f32 / around as f32).sin_cos();
            mesh.positions.push(Vec3::new(radius(y) * cos, y, -radius(y) * sin));
            mesh.normals.push(Vec3::new(cos, -slope, -sin).normalize());
            mesh.texcoords.push(Vec2::new(column as f32 / around as f32, 1.0 - row as f32 / rows as f32));
            if row < rows && column < around {
                let [here, above] = [row, row + 1].map(|row| row * (around + 1) + column);
                mesh.triangles.extend([[here, here + 1, above], [here + 1, above + 1, above]]);
            }
        }
    }
    mesh
}
