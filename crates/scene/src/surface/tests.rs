//! What the tests of all surfaces share.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::{Arc, Mutex};

use glam::Vec3;

use super::file::{Model, Source};
use super::{SurfaceError, TriangleMesh};
use crate::assets::Embedded;
use crate::volume::Budget;

/// What a file among others holds.
pub fn read_within(files: &[(&str, &[u8])], file: &str, budget: u64) -> Result<Model, SurfaceError> {
    let assets = Embedded(files.to_vec());
    let (mut left, mut textures) = (Budget(budget), BTreeMap::new());
    Source { file, object: "thing", assets: &assets, left: &mut left, textures: &mut textures }.read()
}

pub fn read(files: &[(&str, &[u8])], file: &str) -> Result<Model, SurfaceError> {
    read_within(files, file, 32 << 20)
}

/// Whatever a damaged file is read as, or not: no panic, and nothing that a renderer could not take.
pub fn survive(files: &[(&str, &[u8])], file: &str) {
    let started = std::time::Instant::now();
    match read(files, file) {
        Ok(model) => {
            for part in &model.parts {
                assert_valid(&part.mesh);
                assert!(part.file_from_object.is_finite());
                assert!(part.material.emission.is_finite() && part.material.emission.min_element() >= 0.0);
            }
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.len() < 1000, "{message}");
        }
    }
    assert!(started.elapsed().as_secs_f32() < 1.0, "took {:?}", started.elapsed());
}

/// What is done, and the warnings that it gives.
pub fn warnings<T>(run: impl FnOnce() -> T) -> (T, String) {
    #[derive(Clone, Default)]
    struct Lines(Arc<Mutex<Vec<u8>>>);

    impl Write for Lines {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    let lines = Lines::default();
    let writer = lines.clone();
    let subscriber = tracing_subscriber::fmt()
        .with_writer(move || writer.clone())
        .without_time()
        .with_target(false)
        .with_ansi(false)
        .finish();
    let result = tracing::subscriber::with_default(subscriber, run);
    let text = String::from_utf8(lines.0.lock().unwrap().clone()).unwrap();
    (result, text)
}

/// What holds of every mesh that a scene gives.
pub fn assert_valid(mesh: &TriangleMesh) {
    let count = mesh.positions.len();
    assert!(mesh.normals.len() == count && mesh.texcoords.len() == count);
    assert!(mesh.tangents.is_empty() || mesh.tangents.len() == count);
    assert!(mesh.colors.is_empty() || mesh.colors.len() == count);
    assert!(mesh.second_texcoords.is_empty() || mesh.second_texcoords.len() == count);
    assert!(mesh.second_texcoords.iter().all(|v| v.is_finite()));
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
