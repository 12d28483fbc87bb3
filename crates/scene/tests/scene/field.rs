//! Fields, optics and transforms against closed forms.

use std::sync::Arc;

use proptest::prelude::*;
use tyndall_scene::Field;
use tyndall_scene::description::{Optics, Stop, Transfer, Transform};
use tyndall_scene::glam::{Mat4, Vec3};
use tyndall_scene::parameter::{Kind, Parameter, Settings, Value};
use tyndall_scene::volume::{Grid, Voxels};

const DIMS: [u32; 3] = [5, 3, 4];

fn grid(voxels: Voxels) -> Grid {
    Grid::dense(DIMS, voxels, Mat4::IDENTITY)
}

/// Voxels of a linear function of the index.
fn linear(slope: Vec3, offset: f32) -> Vec<f32> {
    let mut voxels = Vec::new();
    for k in 0..DIMS[2] {
        for j in 0..DIMS[1] {
            for i in 0..DIMS[0] {
                voxels.push(slope.dot(Vec3::new(i as f32, j as f32, k as f32)) + offset);
            }
        }
    }
    voxels
}

fn vector(range: std::ops::Range<f32>) -> impl Strategy<Value = Vec3> {
    [range.clone(), range.clone(), range].prop_map(Vec3::from)
}

proptest! {
    /// A trilinear interpolant reproduces a linear function between voxel centres and is constant beyond the outermost.
    #[test]
    fn a_linear_grid(slope in vector(-2.0..2.0), offset in -2.0f32..2.0, unit in vector(0.0..1.0)) {
        let voxels = linear(slope, offset);
        let dims = Vec3::new(5.0, 3.0, 4.0);
        let index = (unit * dims - 0.5).clamp(Vec3::ZERO, dims - 1.0);
        let expected = slope.dot(index) + offset;
        let value = Field::Grid(Arc::new(grid(Voxels::F32(voxels.clone())))).value(unit);
        prop_assert!((value - expected).abs() < 2e-5, "{value} and {expected}");
        // The same voxels in half precision, where they are exactly representable.
        let halves: Vec<_> = voxels.iter().map(|v| half::f16::from_f32(*v)).collect();
        let singles = halves.iter().map(|v| v.to_f32()).collect();
        prop_assert_eq!(grid(Voxels::F16(halves)).trilinear(unit), grid(Voxels::F32(singles)).trilinear(unit));
    }

    #[test]
    fn nothing_outside(unit in vector(-1.0..2.0)) {
        let outside = unit.min_element() < 0.0 || unit.max_element() > 1.0;
        for field in [Field::Homogeneous, Field::Exponential { base: 0.2, scale: 0.5 }, Field::Grid(Arc::new(grid(Voxels::F32(linear(Vec3::ONE, 1.0)))))] {
            prop_assert_eq!(field.value(unit) == 0.0, outside);
        }
    }

    #[test]
    fn an_exponential_falls_by_e(y in 0.0f32..0.5) {
        let field = Field::Exponential { base: 0.25, scale: 0.5 };
        let ratio = field.value(Vec3::new(0.5, y, 0.5)) / field.value(Vec3::new(0.1, y + 0.5, 0.9));
        prop_assert!((ratio - std::f32::consts::E).abs() < 1e-5);
        prop_assert_eq!(field.value(Vec3::new(0.0, 0.25, 1.0)), 1.0);
    }

    #[test]
    fn coefficients_are_proportional_to_density(density in -1.0f32..3.0) {
        let optics = Optics::Coefficients {
            sigma_s: Vec3::new(1.0, 2.0, 3.0),
            sigma_a: Vec3::splat(0.5),
            emission: Vec3::X,
            phase: Default::default(),
        };
        let at = optics.at(density);
        prop_assert!(at.sigma_t().abs_diff_eq(Vec3::new(1.5, 2.5, 3.5) * density.max(0.0), 1e-5));
        prop_assert_eq!(at.emission, Vec3::X * density.max(0.0));
    }

    #[test]
    fn a_transfer_is_linear_between_its_stops(t in 0.0f32..=1.0) {
        let transfer = transfer();
        let value = 1.0 + 2.0 * t;
        prop_assert!((transfer.opacity_at(value) - (0.2 + 0.8 * t).min(Transfer::MAX_OPACITY)).abs() < 1e-6);
        prop_assert!((transfer.color(value) - Vec3::new(1.0 - t, 0.0, t)).length() < 1e-6);
    }
}

fn transfer() -> Transfer {
    let stops = vec![
        Stop { value: 1.0, opacity: 0.2, color: Some(Vec3::X) },
        Stop { value: 3.0, opacity: 1.0, color: Some(Vec3::Z) },
        Stop { value: 4.0, opacity: 0.0, color: Some(Vec3::ONE) },
    ];
    Transfer { unit_length: 0.5, radiance: 2.0, stops, ..Transfer::default() }
}

#[test]
fn a_transfer_keeps_its_ends() {
    let transfer = transfer();
    for (value, stop) in [(-1e38, 0), (0.99, 0), (1.0, 0), (3.0, 1), (4.0, 2), (f32::MAX, 2)] {
        let Stop { opacity, color, .. } = transfer.stops[stop];
        let expected = (opacity.min(Transfer::MAX_OPACITY), color.unwrap());
        assert_eq!((transfer.opacity_at(value), transfer.color(value)), expected, "at {value}");
    }
    // The distance between these is beyond 32 bits.
    let far = |value, opacity| Stop { value, opacity, color: Some(Vec3::ONE) };
    let wide = Transfer { stops: vec![far(f32::MIN, 0.0), far(f32::MAX, 1.0)], ..transfer };
    assert!((wide.opacity_at(0.0) - 0.5).abs() < 1e-6);
}

#[test]
fn opacity_is_that_of_the_unit_length() {
    let transfer = transfer();
    let optics = Optics::Transfer(transfer.clone());
    let at = optics.at(1.0);
    assert!(((-at.sigma_a * 0.5).exp() - 0.8).abs().max_element() < 1e-6);
    assert_eq!(at.sigma_s, Vec3::ZERO);
    // Through an opaque body: emission/σ_a is the radiance.
    assert!((at.emission / at.sigma_a - Vec3::new(2.0, 0.0, 0.0)).length() < 1e-5);
    // Opacity 1 is finite.
    let capped = optics.at(3.0).sigma_a.x;
    assert!((1.0 - (-capped * 0.5).exp() - Transfer::MAX_OPACITY).abs() < 1e-6, "{capped}");
}

#[test]
fn transforms_scale_then_rotate_then_translate() {
    let right = std::f32::consts::FRAC_PI_2;
    let transform =
        Transform { scale: Vec3::new(2.0, 3.0, 4.0), rotate: Vec3::new(90.0, 90.0, 90.0), translate: Vec3::X };
    let steps = Mat4::from_translation(Vec3::X)
        * Mat4::from_rotation_z(right)
        * Mat4::from_rotation_y(right)
        * Mat4::from_rotation_x(right)
        * Mat4::from_scale(Vec3::new(2.0, 3.0, 4.0));
    assert!(transform.matrix().abs_diff_eq(steps, 1e-5), "{:?}\n{steps:?}", transform.matrix());
    // About x first: y goes to z, which about y goes to x, which about z goes to y.
    let moved = transform.matrix().transform_point3(Vec3::Y);
    assert!((moved - Vec3::new(1.0, 3.0, 0.0)).length() < 1e-5, "{moved}");
    assert_eq!(Transform::default().matrix(), Mat4::IDENTITY);
}

#[test]
fn settings() {
    let parameter = |name, unit, kind| Parameter { name, help: "", unit, kind };
    let declared = [
        parameter("step", "voxels", Kind::Number { min: 0.1, max: 4.0, default: 0.5 }),
        parameter("bounces", "", Kind::Count { min: 1, max: 8, default: 2 }),
        parameter("model", "", Kind::Choice(&["scattering", "emission"])),
    ];
    let given = |name: &str, value| [(name.to_owned(), value)].into();
    let chosen = Settings::new("t", &declared, Some(&given("model", Value::Choice("emission".into())))).unwrap();
    assert_eq!((chosen.number("step"), chosen.number("bounces"), chosen.choice("model")), (0.5, 2.0, "emission"));
    for (name, value, expected) in [
        ("step", Value::Number(5.0), "techniques.t.step: found 5; accepted: a number from 0.1 to 4 voxels"),
        ("step", Value::Number(f64::NAN), "techniques.t.step: found NaN; accepted: a number from 0.1 to 4 voxels"),
        ("step", Value::Switch(true), "techniques.t.step: found true; accepted: a number from 0.1 to 4 voxels"),
        ("bounces", Value::Number(1.5), "techniques.t.bounces: found 1.5; accepted: a whole number from 1 to 8"),
        ("bounces", Value::Number(9.0), "techniques.t.bounces: found 9; accepted: a whole number from 1 to 8"),
        (
            "model",
            Value::Choice("x".into()),
            "techniques.t.model: found \"x\"; accepted: one of \"scattering\", \"emission\"",
        ),
        (
            "steps",
            Value::Number(1.0),
            "techniques.t.steps: found unknown parameter `steps`; accepted: one of step, bounces, model",
        ),
    ] {
        let error = Settings::new("t", &declared, Some(&given(name, value))).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
}
