//! Surfaces on the device against surfaces on the host.

use std::sync::Arc;

use glam::{Affine2, Mat4, Vec2, Vec3, Vec4};
use tyndall_scene::surface::{Bsdf, Map, Material, NormalMap, Surface, Texture, TriangleMesh, Wrap};

use super::Surfaces;
use crate::graph::{Shader, shader};
use crate::test::probe::{assert_close, probe_with, spread};
use crate::test::{gpu, tolerance};

static SURFACE: Shader = shader!("test/probes/surface");

fn texture(width: u32, height: u32, srgb: bool) -> Map {
    let byte = |i: u32, c: u32| ((i * 7919 + c * 104_729) % 251) as u8;
    let texels = (0..width * height).map(|i| [0, 1, 2, 3].map(|c| byte(i, c))).collect();
    Map::new(Texture { width, height, texels, srgb })
}

/// The second texture coordinates.
const SECOND: [Vec2; 3] = [Vec2::new(2.0, -1.5), Vec2::new(-1.2, 0.4), Vec2::new(0.3, 3.1)];

/// A triangle with all maps, of sizes that have nothing in common, that lie and go on in different ways, and a mirrored and turned one without.
fn surfaces() -> Vec<Surface> {
    let mesh = Arc::new(TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        normals: vec![Vec3::Z; 3],
        texcoords: vec![Vec2::new(-0.3, 0.2), Vec2::new(1.7, 0.1), Vec2::new(0.1, 2.4)],
        second_texcoords: SECOND.to_vec(),
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 3],
        colors: vec![Vec4::new(1.0, 0.5, 0.25, 0.9), Vec4::ONE, Vec4::new(0.2, 1.0, 0.6, 0.8)],
        triangles: vec![[0, 1, 2]],
    });
    let full = Material {
        bsdf: Bsdf::MetallicRoughness {
            base_color: Vec3::new(0.9, 0.5, 0.2),
            base_color_map: Some(texture(37, 300, true)),
            metallic: 0.7,
            roughness: 0.8,
            metallic_roughness_map: Some(Map { wrap: [Wrap::Mirror, Wrap::Clamp], ..texture(5, 3, false) }),
        },
        emission: Vec3::new(1.0, 2.0, 3.0),
        emission_map: Some(Map { wrap: [Wrap::Clamp, Wrap::Repeat], second: true, ..texture(64, 1, true) }),
        normal_map: Some(NormalMap {
            map: Map {
                wrap: [Wrap::Repeat, Wrap::Mirror],
                transform: Affine2::from_scale_angle_translation(Vec2::new(1.5, -0.5), 0.7, Vec2::new(-0.4, 0.2)),
                second: true,
                ..texture(9, 11, false)
            },
            scale: 0.6,
        }),
        alpha_cutoff: Some(0.5),
        ..Material::default()
    };
    let mirrored = Mat4::from_rotation_x(0.7) * Mat4::from_scale(Vec3::new(-2.0, 1.0, 1.0));
    vec![
        Surface { name: "a".into(), mesh: mesh.clone(), world_from_object: Mat4::IDENTITY, material: Arc::new(full) },
        Surface { name: "b".into(), mesh, world_from_object: mirrored, material: Arc::default() },
    ]
}

#[test]
fn maps_and_normals_equal_the_hosts() {
    let Some(gpu) = gpu() else { return };
    let list = surfaces();
    let resident = pollster::block_on(Surfaces::new(&gpu, &list)).unwrap();
    let input: Vec<_> = (0..3200)
        .flat_map(|i| {
            let at = Vec2::new(spread(i, 0), spread(i, 1)) * 0.5;
            let direction = Vec3::new(spread(i, 2) - 0.5, spread(i, 3) - 0.5, -1.0);
            [(at.extend(0.0) - 2.0 * direction).extend(0.0), direction.extend((i % 5) as f32)]
        })
        .collect();
    let also = [
        ("vertices", (&resident.vertices).into()),
        ("triangles", (&resident.triangles).into()),
        ("materials", (&resident.materials).into()),
        ("texels", (&resident.texels).into()),
    ];
    let found = probe_with(&gpu, &SURFACE, &input, &also);
    let material = &list[0].material;
    let Bsdf::MetallicRoughness { base_color, base_color_map, metallic_roughness_map, .. } = &material.bsdf else {
        unreachable!()
    };
    let map = |map: &Option<Map>, uv| map.as_ref().map_or(Vec4::ONE, |map| map.at(uv));
    for (pair, found) in input.chunks(2).zip(found.chunks(2)) {
        let at = (pair[0] + 2.0 * pair[1]).truncate();
        let corners = [Vec2::new(-0.3, 0.2), Vec2::new(1.7, 0.1), Vec2::new(0.1, 2.4)];
        let blend = |of: [Vec2; 3]| of[0] * (1.0 - at.x - at.y) + of[1] * at.x + of[2] * at.y;
        let uv = [blend(corners), blend(SECOND)];
        assert_close(found[1].x.into(), 2.0, tolerance::PROBE, pair);
        assert_close(found[1].y.into(), uv[0].x.into(), tolerance::PROBE, pair);
        assert_close(found[1].z.into(), uv[0].y.into(), tolerance::PROBE, pair);
        assert_close(found[1].w.into(), (uv[1].x - 2.0 * uv[1].y).into(), tolerance::PROBE, pair);
        let colors = &list[0].mesh.colors;
        let color = colors[0] * (1.0 - at.x - at.y) + colors[1] * at.x + colors[2] * at.y;
        let expected = match pair[1].w as u32 {
            0 => color.truncate() * base_color * map(base_color_map, uv).truncate(),
            1 => material.emission * map(&material.emission_map, uv).truncate(),
            2 => {
                let normal_map = material.normal_map.as_ref().unwrap();
                let bent = (2.0 * normal_map.map.at(uv).truncate() - 1.0) * Vec3::new(0.6, 0.6, 1.0);
                bent.normalize()
            }
            3 => Vec3::Z,
            _ => {
                let factors = map(metallic_roughness_map, uv);
                Vec3::new(0.7 * factors.z, (0.8 * factors.y).powi(2).max(0.001), 0.0)
            }
        };
        for c in 0..3 {
            assert_close(found[0][c].into(), expected[c].into(), tolerance::PROBE_MAP, pair);
        }
        let alpha = color.w * map(base_color_map, uv).w;
        if (alpha - 0.5).abs() > 1e-2 {
            assert_eq!(found[0].w > 0.5, alpha < 0.5, "{pair:?}");
        }
    }
}

/// Of a mirrored surface the front stays the front, its triangles counter-clockwise from there.
#[test]
fn fronts_stay_fronts() {
    let (vertices, triangles) = super::triangles(&surfaces());
    for t in triangles {
        let [a, b, c] = [t.x, t.y, t.z].map(|i| vertices[i as usize]);
        let normal = (b.position - a.position).cross(c.position - a.position).normalize();
        assert!(normal.distance(a.normal.normalize()) < 1e-6, "{normal} {}", a.normal);
        // The bitangent goes the way of v's growth: from the first corner to the third.
        let bitangent = a.tangent.w * a.normal.cross(a.tangent.truncate());
        let third = if t.w == 0 { c } else { b };
        assert!(bitangent.dot(third.position - a.position) > 0.0);
    }
}
