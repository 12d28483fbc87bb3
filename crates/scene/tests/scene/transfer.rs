//! Transfer functions and clipping planes: mistakes with their messages, and what the functions say.

use proptest::prelude::*;
use tyndall_scene::Document;
use tyndall_scene::description::{Bounds, Clip, ColorMap, Cut, Optics, Plane, Shading, Stop, Transfer, Window};
use tyndall_scene::glam::Vec3;
use tyndall_scene::image::tonemap::srgb_decode;

use crate::{BOX, CAMERA, check_refusals, refusal};

fn check(before: &str, cases: &[(&str, &str)]) {
    let cases: Vec<_> = cases.iter().map(|&(text, expected)| (text, format!("{before}{text}"), expected)).collect();
    check_refusals("s.toml", &cases);
}

#[test]
fn mistakes() {
    check(
        &format!("{CAMERA}{BOX}[media.a.optics.transfer]\nunit_length = 1\n"),
        &[
            (
                "window = { level = 1, width = 1 }\nstops = [{ value = 1, opacity = 1, color = 1 }]",
                "8:10: media.a.optics.transfer.window: found both `stops` and `window`; accepted: one of them",
            ),
            (
                "window = { level = 1, width = 0 }",
                "8:31: media.a.optics.transfer.window.width: found 0; accepted: a finite number > 0",
            ),
            (
                "window = { level = 1, width = 1 }\nopacity = 1.5",
                "9:11: media.a.optics.transfer.opacity: found 1.5; accepted: a number from 0 to 1",
            ),
            (
                "window = { level = 1, width = 1 }\nmap = \"jet\"",
                "9:7: media.a.optics.transfer.map: found `jet`; accepted: one of `grey`, `viridis`, `magma`, `inferno`, \
                 `plasma`, `cividis`, `turbo`, `blue_red`",
            ),
            (
                "map = \"magma\"\nstops = [{ value = 1, opacity = 0 }]",
                "8:7: media.a.optics.transfer.map: found a map for 1 stops; accepted: at least two stops to spread it \
                 over, or a `window`",
            ),
            (
                "map = \"magma\"\nstops = [{ value = 1, opacity = 0 }, { value = 2, opacity = 0, color = 1 }]",
                "9:72: media.a.optics.transfer.stops.1.color: found a color beside `map`; accepted: one of them",
            ),
            (
                "isosurfaces = [{ value = 2, color = 1 }, { value = 1, color = 1 }]",
                "8:52: media.a.optics.transfer.isosurfaces.1.value: found 1 after 2; accepted: values in ascending order",
            ),
            (
                "isosurfaces = [{ value = 2, color = 1, opacity = 2 }]",
                "8:50: media.a.optics.transfer.isosurfaces.0.opacity: found 2; accepted: a number from 0 to 1",
            ),
            (
                "isosurfaces = [{ value = 2, color = 1 }]\nshading = { ambient = -1 }",
                "9:23: media.a.optics.transfer.shading.ambient: found -1; accepted: a finite number >= 0",
            ),
            (
                "isosurfaces = [{ value = 2, color = 1 }]\ngradient_opacity = [{ gradient = 1, factor = 0 }, { gradient = 1, factor = 0 }]",
                "9:64: media.a.optics.transfer.gradient_opacity.1.gradient: found 1 after 1; accepted: values in \
                 ascending order",
            ),
            (
                "isosurfaces = [{ value = 2, color = 1 }]\ngradient_opacity = [{ gradient = 1, factor = 2 }]",
                "9:46: media.a.optics.transfer.gradient_opacity.0.factor: found 2; accepted: a number from 0 to 1",
            ),
        ],
    );
}

#[test]
fn too_many_isosurfaces() {
    let surfaces: Vec<_> = (0..9).map(|value| format!("{{ value = {value}, color = 1 }}")).collect();
    let text = format!("{CAMERA}{BOX}optics.transfer = {{ unit_length = 1, isosurfaces = [{}] }}", surfaces.join(", "));
    let message = "s.toml:6:52: media.a.optics.transfer.isosurfaces: found 9 isosurfaces; accepted: at most 8";
    assert_eq!(refusal("s.toml", &text), message);
}

#[test]
fn clips() {
    let plane = "{ point = [0, 0, 0], normal = [1, 0, 0] }";
    let planes = |n: usize| vec![plane; n].join(", ");
    let kept = "box = { min = [0, 0, 0], max = [1, 1, 1] }";
    check(
        &format!("{CAMERA}{BOX}optics.coefficients = {{}}\n"),
        &[
            (
                "clip.planes = [{ point = [0, 0, 0], normal = [0, 0, 0] }]",
                "7:46: media.a.clip.planes.0.normal: found [0, 0, 0]; accepted: three finite numbers [x, y, z], not all 0",
            ),
            (
                "clip.box = { min = [0, 0, 0], max = [1, 0, 1] }",
                "7:37: media.a.clip.box.max: found [1.0, 0.0, 1.0] with min = [0.0, 0.0, 0.0]; accepted: a corner above \
                 `min` on every axis",
            ),
            (
                "clip.plane = []",
                "7:6: media.a.clip.plane: found unknown field `plane`; accepted: one of `planes`, `box`",
            ),
            (
                &format!("clip.planes = [{}]", planes(9)),
                "7:15: media.a.clip.planes: found 9 planes; accepted: at most 8 planes",
            ),
            (
                &format!("clip = {{ planes = [{}], {kept} }}", planes(3)),
                "7:19: media.a.clip.planes: found 3 planes; accepted: at most 2 planes beside a box",
            ),
        ],
    );
}

/// The transfer function of a scene file, also after it was written and read again.
fn parse(fields: &str) -> Transfer {
    let text = format!("{CAMERA}{BOX}[media.a.optics.transfer]\nunit_length = 2\n{fields}");
    let scene = Document::new("s.toml", text).parse().unwrap();
    let written = serde_json::to_string(&scene).unwrap();
    assert_eq!(Document::new("s.json", written).parse().unwrap(), scene);
    match scene.media["a"].optics.clone() {
        Optics::Transfer(transfer) => transfer,
        Optics::Coefficients { .. } => unreachable!("the text says `transfer`"),
    }
}

#[test]
fn a_window_is_a_ramp() {
    let transfer = parse("window = { level = 300, width = 400 }\nopacity = 0.3\nmap = \"viridis\"");
    assert_eq!(transfer.knots(), [100.0, 500.0]);
    for (value, t) in [(f32::MIN, 0.0), (100.0, 0.0), (200.0, 0.25), (300.0, 0.5), (500.0, 1.0), (f32::MAX, 1.0)] {
        assert!((transfer.opacity_at(value) - 0.3 * t).abs() < 1e-6, "{value}");
        assert_eq!(transfer.color(value), ColorMap::Viridis.color(t), "{value}");
        let opacity = 1.0 - (-transfer.unit_length * transfer.sigma_a(value)).exp();
        assert!((opacity - 0.3 * t).abs() < 1e-6, "{value}: {opacity}");
    }
    // Without a map, greys, as on a light box.
    let grey = parse("window = { level = 0, width = 2 }");
    assert_eq!((grey.color(-1.0), grey.color(1.0)), (Vec3::ZERO, Vec3::ONE));
    assert_eq!(grey.opacity_at(1.0), Transfer::MAX_OPACITY);
    // Narrower than 32, or 64, bits tell values apart: a step.
    for width in [1e-3, 1e-30] {
        let step = Transfer { window: Some(Window { level: 1e30, width }), ..Transfer::default() };
        assert_eq!((step.opacity_at(0.9e30), step.opacity_at(1.1e30)), (0.0, Transfer::MAX_OPACITY));
        assert!(step.opacity_at(1e30).is_finite());
    }
}

#[test]
fn a_map_colours_stops() {
    let stops = "stops = [{ value = 0, opacity = 0 }, { value = 1, opacity = 1 }, { value = 4, opacity = 0.5 }]";
    let transfer = parse(&format!("map = \"blue_red\"\nopacity = 0.5\n{stops}"));
    assert_eq!(transfer.knots(), [0.0, 1.0, 4.0]);
    for (value, opacity, t) in [(-1.0, 0.0, 0.0), (0.5, 0.25, 0.125), (1.0, 0.5, 0.25), (9.0, 0.25, 1.0)] {
        assert_eq!(transfer.opacity_at(value), opacity, "{value}");
        assert_eq!(transfer.color(value), ColorMap::BlueRed.color(t), "{value}");
    }
    assert!(transfer.color(0.0).z > transfer.color(0.0).x && transfer.color(4.0).x > transfer.color(4.0).z);
}

/// At each of its 256 colours a map over a window is what `colorous` has, and halfway between two their mean.
#[test]
fn maps_are_those_of_colorous() {
    let maps = [
        (ColorMap::Viridis, colorous::VIRIDIS),
        (ColorMap::Magma, colorous::MAGMA),
        (ColorMap::Inferno, colorous::INFERNO),
        (ColorMap::Plasma, colorous::PLASMA),
        (ColorMap::Cividis, colorous::CIVIDIS),
        (ColorMap::Turbo, colorous::TURBO),
    ];
    for (map, gradient) in maps {
        let window = Some(Window { level: 127.5, width: 255.0 });
        let transfer = Transfer { window, map: Some(map), ..Transfer::default() };
        let expected: Vec<_> = (0..256)
            .map(|i| {
                let color = gradient.eval_rational(i, 256);
                Vec3::from([color.r, color.g, color.b].map(|byte| srgb_decode(f32::from(byte) / 255.0)))
            })
            .collect();
        for (i, &expected) in expected.iter().enumerate() {
            assert!((transfer.color(i as f32) - expected).abs().max_element() < 1e-5, "{map:?} {i}");
        }
        for pair in 0..255 {
            let mean = 0.5 * (expected[pair] + expected[pair + 1]);
            assert!((transfer.color(pair as f32 + 0.5) - mean).abs().max_element() < 1e-5, "{map:?} {pair}");
        }
        assert_eq!((map.color(-1.0), map.color(2.0)), (map.color(0.0), map.color(1.0)), "{map:?}");
    }
}

/// Viridis and magma begin and end as matplotlib's tables do (`_cm_listed.py`), and a diverging map is white in its middle.
#[test]
fn maps_are_those_of_matplotlib() {
    let near = |map: ColorMap, t, srgb: [f32; 3]| {
        let expected = Vec3::from(srgb.map(srgb_decode));
        assert!((map.color(t) - expected).abs().max_element() < 0.005, "{map:?} at {t}: {}", map.color(t));
    };
    near(ColorMap::Viridis, 0.0, [0.267004, 0.004874, 0.329415]);
    near(ColorMap::Viridis, 1.0, [0.993248, 0.906157, 0.143936]);
    near(ColorMap::Magma, 0.0, [0.001462, 0.000466, 0.013866]);
    near(ColorMap::Magma, 1.0, [0.987053, 0.991438, 0.749504]);
    let middle = ColorMap::BlueRed.color(0.5);
    assert!(middle.min_element() > 0.85, "{middle}");
}

#[test]
fn isosurfaces_alone_are_a_function() {
    let transfer = parse("isosurfaces = [{ value = 3, color = [1, 0, 0] }]\nshading = { diffuse = 1 }");
    assert!(transfer.knots().is_empty());
    assert_eq!((transfer.sigma_a(3.0), transfer.color(3.0)), (0.0, Vec3::ZERO));
    assert_eq!(transfer.isosurfaces[0].opacity, 1.0);
    let shading = Shading { ambient: 0.3, diffuse: 1.0, specular: 0.2, shininess: 20.0 };
    assert_eq!(transfer.shading, Some(shading));
    assert_eq!(transfer.unphysical(), Some("shading"));
    assert_eq!(parse("window = { level = 0, width = 2 }").unphysical(), None);
}

#[test]
fn gradients_scale_the_extinction() {
    let transfer = parse(
        "window = { level = 0, width = 2 }\ngradient_opacity = [{ gradient = 10, factor = 0 }, { gradient = 30, factor = 1 }]",
    );
    for (gradient, factor) in [(0.0, 0.0), (10.0, 0.0), (15.0, 0.25), (30.0, 1.0), (1e9, 1.0)] {
        assert_eq!(transfer.gradient_factor(gradient), factor, "{gradient}");
    }
    assert_eq!(Transfer::default().gradient_factor(5.0), 1.0);
}

fn number() -> impl Strategy<Value = f32> {
    prop_oneof![prop::sample::select(vec![f32::MIN, f32::MAX, 0.0, 1e-45, 1e30, 1.0]), prop::num::f32::NORMAL]
}

proptest! {
    /// Whatever the stops and the window, colour and extinction are finite, and the extinction is within the knots' range.
    #[test]
    fn functions_are_finite_and_bounded_by_their_knots(
        mut values in prop::collection::vec(number(), 1..5),
        opacities in prop::array::uniform5(0.0f32..=1.0),
        at in number(),
        window in any::<bool>(),
        map in any::<bool>(),
    ) {
        values.sort_by(f32::total_cmp);
        values.dedup();
        let color = (!map).then_some(Vec3::ONE);
        let stops: Vec<_> =
            values.iter().zip(opacities).map(|(&value, opacity)| Stop { value, opacity, color }).collect();
        let map = map.then_some(ColorMap::Turbo);
        let transfer = if window {
            let window = Window { level: values[0], width: values[values.len() - 1].abs().max(f32::MIN_POSITIVE) };
            Transfer { window: Some(window), map, ..Transfer::default() }
        } else {
            Transfer { stops, map, ..Transfer::default() }
        };
        prop_assert!(transfer.color(at).is_finite());
        let ends = transfer.knots().into_iter().map(|knot| transfer.sigma_a(knot));
        let highest = ends.fold(0.0, f32::max);
        prop_assert!(transfer.sigma_a(at) >= 0.0 && transfer.sigma_a(at) <= highest * 1.00001, "{at}");
    }

    /// The planes of a clip keep what its box holds and its cuts do not take.
    #[test]
    fn planes_keep_what_is_inside(point in prop::array::uniform3(-3.0f32..3.0), normal in prop::array::uniform3(-2.0f32..2.0)) {
        let (point, normal) = (Vec3::from(point), Vec3::from(normal));
        let through = Vec3::new(0.5, -0.25, 0.0);
        let height = normal.dot(point - through);
        prop_assume!(normal.length() > 0.1 && height.abs() > 1e-4);
        let (min, max) = (Vec3::new(-1.0, -2.0, -1.5), Vec3::new(2.0, 1.0, 2.5));
        let clip = Clip { planes: vec![Cut { point: through, normal }], kept: Some(Bounds { min, max }) };
        let inside = point.cmpge(min).all() && point.cmple(max).all();
        let kept = clip.planes().iter().all(|plane| plane.keeps(point));
        prop_assert_eq!(kept, inside && height < 0.0);
    }
}

#[test]
fn a_clip_is_planes() {
    let text = format!(
        "{CAMERA}{BOX}optics.coefficients = {{}}\nclip = {{ planes = [{{ point = [1, 7, 7], normal = [2, 0, 0] }}], \
         box = {{ min = [0, 1, 2], max = [3, 4, 5] }} }}"
    );
    let scene = Document::new("s.toml", text).parse().unwrap();
    let planes = scene.media["a"].clip.as_ref().unwrap().planes();
    assert_eq!(planes.len(), 7);
    assert_eq!(planes[0], Plane { normal: Vec3::X, distance: 1.0 });
    assert_eq!(planes[1], Plane { normal: Vec3::NEG_X, distance: 0.0 });
    assert_eq!(planes[6], Plane { normal: Vec3::Z, distance: 5.0 });
    // Too far for 32 bits: all is kept, or nothing.
    let far =
        |side: f32| Clip { planes: vec![Cut { point: Vec3::splat(side * f32::MAX), normal: Vec3::ONE }], kept: None };
    assert!(far(1.0).planes()[0].keeps(Vec3::ZERO) && far(1.0).planes()[0].distance.is_finite());
    assert!(!far(-1.0).planes()[0].keeps(Vec3::ZERO));
}
