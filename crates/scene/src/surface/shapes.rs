//! Built-in shapes as triangles.

use glam::{DVec3, Vec2, Vec3};

use super::TriangleMesh;
use crate::description::{Corner, Edge, Shape};

/// Corners of a disc, and of a sphere's equator: the area of the polygon is 0.16 % short of a circle's.
const AROUND: u32 = 64;

impl TriangleMesh {
    pub(super) fn of(shape: &Shape) -> Self {
        let mut mesh = Self::default();
        match shape {
            &Shape::Quad { corner, edges: [Edge(u), Edge(v)] } => mesh.quad(corner, u, v),
            &Shape::Box { min, max } => {
                let size = max - min;
                let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
                mesh.quad(min, z, y);
                mesh.quad(min, x, z);
                mesh.quad(min, y, x);
                mesh.quad(max, -y, -z);
                mesh.quad(max, -z, -x);
                mesh.quad(max, -x, -y);
            }
            &Shape::Sphere { center, radius } => mesh.sphere(center, radius),
            &Shape::Disc { center, normal, radius } => mesh.disc(center, normal.normalize(), radius),
            Shape::Polygons { vertices, faces } => faces.iter().for_each(|face| mesh.polygon(vertices, face)),
        }
        mesh
    }

    fn quad(&mut self, corner: Vec3, u: Vec3, v: Vec3) {
        let first = self.positions.len() as u32;
        self.positions.extend([corner, corner + u, corner + u + v, corner + v]);
        // In double precision a quad of a micrometre has a normal, too.
        self.normals.extend([u.as_dvec3().cross(v.as_dvec3()).normalize_or_zero().as_vec3(); 4]);
        self.texcoords.extend([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(Vec2::from_array));
        self.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|corners: [u32; 3]| corners.map(|corner| first + corner)));
    }

    fn polygon(&mut self, vertices: &[Edge], face: &[Corner]) {
        let first = self.positions.len() as u32;
        let corners = face.iter().map(|&Corner(index)| vertices[index as usize].0);
        // Twice the polygon's area along its normal.
        let origin = corners.clone().next().unwrap_or_default();
        let normal: Vec3 = corners
            .clone()
            .zip(corners.clone().skip(1))
            .map(|(a, b)| (a - origin).as_dvec3().cross((b - origin).as_dvec3()))
            .sum::<DVec3>()
            .normalize_or_zero()
            .as_vec3();
        self.positions.extend(corners);
        self.normals.extend(face.iter().map(|_| normal));
        self.texcoords.extend(face.iter().map(|_| Vec2::ZERO));
        self.triangles.extend((2..face.len() as u32).map(|k| [first, first + k - 1, first + k]));
    }

    fn disc(&mut self, center: Vec3, normal: Vec3, radius: f32) {
        let (x, y) = normal.any_orthonormal_pair();
        self.positions.push(center);
        self.texcoords.push(Vec2::splat(0.5));
        for i in 0..AROUND {
            let (sin, cos) = (i as f32 * std::f32::consts::TAU / AROUND as f32).sin_cos();
            self.positions.push(center + radius * (cos * x + sin * y));
            self.texcoords.push(0.5 + 0.5 * Vec2::new(cos, -sin));
            self.triangles.push([0, 1 + i, 1 + (i + 1) % AROUND]);
        }
        self.normals = vec![normal; self.positions.len()];
    }

    fn sphere(&mut self, center: Vec3, radius: f32) {
        let rows = AROUND / 2;
        for row in 0..=rows {
            for column in 0..=AROUND {
                let uv = Vec2::new(column as f32 / AROUND as f32, row as f32 / rows as f32);
                let ((sin_phi, cos_phi), (sin_theta, cos_theta)) =
                    ((uv.x * std::f32::consts::TAU).sin_cos(), (uv.y * std::f32::consts::PI).sin_cos());
                let normal = Vec3::new(sin_theta * cos_phi, cos_theta, -sin_theta * sin_phi);
                self.positions.push(center + radius * normal);
                self.normals.push(normal);
                self.texcoords.push(uv);
                if row < rows && column < AROUND {
                    let [here, below] = [row, row + 1].map(|row| row * (AROUND + 1) + column);
                    if row > 0 {
                        self.triangles.push([here, below, here + 1]);
                    }
                    if row + 1 < rows {
                        self.triangles.push([here + 1, below, below + 1]);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod test;
