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

/// Linear light of an 8-bit sRGB channel, and of others.
fn decoded(texel: [u8; 4], srgb: bool) -> [f64; 4] {
    let linear = |x: f64| if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
    let [r, g, b, a] = texel.map(|byte| f64::from(byte) / 255.0);
    if srgb { [linear(r), linear(g), linear(b), a] } else { [r, g, b, a] }
}

/// The mean over part of a picture, as 8 bits before rounding; if alpha cuts, colours count by it.
fn mean(texels: &[[u8; 4]], [width, height]: [u32; 2], [x, y]: [[f64; 2]; 2], srgb: bool, cut: bool) -> [f64; 4] {
    let overlap = |[from, to]: [f64; 2], i: u32| (to.min(f64::from(i) + 1.0) - from.max(f64::from(i))).max(0.0);
    let (mut sum, mut weight, mut visible) = ([0.0; 4], 0.0, [0.0; 3]);
    for (i, texel) in texels.iter().enumerate().take((width * height) as usize) {
        let here = overlap(x, i as u32 % width) * overlap(y, i as u32 / width);
        let value = decoded(*texel, srgb);
        weight += here;
        (0..4).for_each(|c| sum[c] += here * value[c]);
        (0..3).for_each(|c| visible[c] += here * value[3] * value[c]);
    }
    let encoded = |x: f64| if x <= 0.0031308 { x * 12.92 } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    [0, 1, 2, 3].map(|c| {
        let by_alpha = cut && sum[3] > 0.0 && c < 3;
        let value = if by_alpha { visible[c] / sum[3] } else { sum[c] / weight };
        255.0 * if srgb && c < 3 { encoded(value) } else { value }
    })
}

/// Each texel of a mip level is the mean over its part of the level before, sides even or not, and the last of the whole picture.
#[test]
fn mips_are_means() {
    let Some(gpu) = gpu() else { return };
    let maps =
        [(37, 300, true), (5, 3, false), (64, 1, true), (1, 1, true), (16, 16, true)].map(|(w, h, s)| texture(w, h, s));
    for cut in [false, true] {
        let surface = |map: &Map| Surface {
            name: "a".into(),
            mesh: surfaces()[0].mesh.clone(),
            world_from_object: Mat4::IDENTITY,
            material: Arc::new(Material {
                bsdf: Bsdf::Lambert { reflectance: Vec3::ONE, map: Some(map.clone()) },
                alpha_cutoff: cut.then_some(0.5),
                ..Material::default()
            }),
        };
        let list: Vec<_> = maps.iter().map(surface).collect();
        let resident = pollster::block_on(Surfaces::new(&gpu, &list)).unwrap();
        let all: Vec<[u8; 4]> = pollster::block_on(crate::renderer::read_texels(&gpu, &resident.texels)).unwrap();
        // Where each picture's second level begins: in the first row that no picture is in.
        let mut begin = maps.iter().map(|map| map.texture.texels.len()).sum::<usize>().next_multiple_of(8192);
        for Texture { width, height, texels, srgb } in maps.iter().map(|map| &*map.texture) {
            let (mut finer, mut size) = (texels.clone(), [*width, *height]);
            let mut levels = 0f64;
            while size != [1, 1] {
                let next = size.map(|side| (side / 2).max(1));
                let made = &all[begin..][..(next[0] * next[1]) as usize];
                for (i, texel) in made.iter().enumerate() {
                    let at = [i as u32 % next[0], i as u32 / next[0]];
                    let part = [0, 1].map(|k| [0, 1].map(|e| f64::from((at[k] + e) * size[k]) / f64::from(next[k])));
                    let expected = mean(&finer, size, part, *srgb, cut);
                    for c in 0..4 {
                        let off = (f64::from(texel[c]) - expected[c]).abs();
                        assert!(off < tolerance::ROUNDED_TEXEL, "{size:?} {at:?} {texel:?} {expected:?}");
                    }
                }
                begin += made.len();
                (finer, size, levels) = (made.to_vec(), next, levels + 1.0);
            }
            if !cut {
                let whole = [*width, *height].map(|side| [0.0, f64::from(side)]);
                let expected = mean(texels, [*width, *height], whole, *srgb, false);
                for c in 0..4 {
                    let off = (f64::from(finer[0][c]) - expected[c]).abs();
                    assert!(off < tolerance::ROUNDED_TEXEL * levels.max(1.0), "{:?} {expected:?}", finer[0]);
                }
            }
        }
        assert!(begin > 8192 + 37 * 300 / 3, "levels were there");
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
