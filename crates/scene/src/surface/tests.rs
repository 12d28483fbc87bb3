//! What the tests of all surfaces share.

use glam::Vec3;

use super::TriangleMesh;

/// What holds of every mesh that a scene gives.
pub fn assert_valid(mesh: &TriangleMesh) {
    let count = mesh.positions.len();
    assert!(mesh.normals.len() == count && mesh.texcoords.len() == count);
    assert!(mesh.tangents.is_empty() || mesh.tangents.len() == count);
    assert!(mesh.colors.is_empty() || mesh.colors.len() == count);
    assert!(mesh.positions.iter().all(|v| v.is_finite()) && mesh.texcoords.iter().all(|v| v.is_finite()));
    assert!(mesh.normals.iter().all(|v| v.is_normalized()), "{:?}", mesh.normals.iter().find(|v| !v.is_normalized()));
    assert!(mesh.tangents.iter().all(|v| v.truncate().is_normalized() && v.w.abs() == 1.0));
    assert!(mesh.colors.iter().all(|v| v.is_finite() && v.min_element() >= 0.0));
    for triangle in &mesh.triangles {
        assert!(triangle.iter().all(|&index| (index as usize) < count));
        let [a, b, c] = corners(mesh, triangle);
        assert!((b - a).as_dvec3().cross((c - a).as_dvec3()).length() > 0.0, "no area: {a} {b} {c}");
    }
}

/// Area of all triangles.
pub fn area(mesh: &TriangleMesh) -> f32 {
    mesh.triangles.iter().map(|triangle| twice_area(corners(mesh, triangle)).length() / 2.0).sum()
}

/// Holds the fronts of all triangles, and their normals for shading, against the direction out of a point of theirs.
pub fn fronts_face(mesh: &TriangleMesh, out: impl Fn(Vec3) -> Vec3) {
    for triangle in &mesh.triangles {
        let [a, b, c] = corners(mesh, triangle);
        let (normal, out) = (twice_area([a, b, c]), out((a + b + c) / 3.0));
        assert!(normal.dot(out) > 0.0, "the triangle {a} {b} {c} faces {normal}, out is {out}");
        for &index in triangle {
            let shading = mesh.normals[index as usize];
            assert!(shading.dot(normal) > 0.0, "{shading} is behind the triangle {a} {b} {c}");
        }
    }
}

fn corners(mesh: &TriangleMesh, triangle: &[u32; 3]) -> [Vec3; 3] {
    triangle.map(|index| mesh.positions[index as usize])
}

fn twice_area([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}
