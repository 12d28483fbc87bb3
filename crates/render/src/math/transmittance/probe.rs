//! The shaders' bases against their twins.

use glam::Vec4;

use super::{Basis, Cosine, Fourier, Haar, Legendre, Linear, Moments, Slices, Trigonometric, Window};
use crate::graph::{Shader, shader};
use crate::test::probe::{assert_close, probe_with, spread};
use crate::test::{gpu, tolerance};

static TRANSMITTANCE: Shader = shader!("test/probes/transmittance");
static MOMENTS: Shader = shader!("test/probes/moments");

/// A shader with these values for its overrides.
fn specialised(shader: &Shader, constants: &[(&str, &str)]) -> Shader {
    let mut source = shader.source.to_string();
    for (declared, value) in constants {
        let (name, kind) = declared.split_once(": ").unwrap();
        source = source.replace(&format!("override {declared};"), &format!("const {name}: {kind} = {value};"));
    }
    Shader { source: source.into(), ..*shader }
}

/// Whether a basis' numbers begin at the second of its first set.
fn skipped(basis: u32) -> usize {
    usize::from([0, 6].contains(&basis))
}

fn basis_shader(basis: u32, count: usize, window: u32) -> (Shader, usize) {
    let sets = (count + skipped(basis)).div_ceil(4);
    let [basis, count, sets_, window] = [basis, count as u32, sets as u32, window].map(|v| format!("{v}u"));
    let constants =
        [("BASIS: u32", &*basis), ("COUNT: u32", &*count), ("SETS: u32", &*sets_), ("WINDOW: u32", &*window)];
    (specialised(&TRANSMITTANCE, &constants), sets)
}

/// What the device says of a number: what a primitive at a depth and a segment between two deposit, and what the optical depth to
/// the depth takes of it.
#[derive(Debug)]
struct Said {
    k: usize,
    depth: f64,
    span: [f64; 2],
    of_primitive: f64,
    of_segment: f64,
    taken: f64,
}

/// What it says of every number of a basis, at many depths.
fn said(number: u32, count: usize, window: u32) -> Vec<Said> {
    let Some(gpu) = gpu() else { return Vec::new() };
    let (shader, sets) = basis_shader(number, count, window);
    let input: Vec<_> = (0..640)
        .flat_map(|i| {
            let depth = [0.0, 1.0, spread(i, 0)][(i / sets).min(2)];
            let begin = spread(i, 1) * 0.9;
            let end = begin + (1.0 - begin) * spread(i, 2);
            [Vec4::new((i % sets) as f32, depth, begin, end); 4]
        })
        .collect();
    let mut all = Vec::new();
    for (case, found) in input.chunks(4).zip(probe_with(&gpu, &shader, &input, &[]).chunks(4)) {
        let [set, depth, begin, end] = case[0].as_dvec4().to_array();
        let rows = [0, 1, 2].map(|row: usize| found[row].as_dvec4().to_array());
        for (lane, channel) in (4 * set as usize..).take(4).enumerate() {
            let [of_primitive, of_segment, taken] = rows.map(|row| row[lane]);
            match channel.checked_sub(skipped(number)).filter(|&k| k < count) {
                Some(k) => all.push(Said { k, depth, span: [begin, end], of_primitive, of_segment, taken }),
                None => assert!(
                    of_primitive == 0.0 && of_segment == 0.0,
                    "nothing is kept where there is no number: {channel} of basis {number}"
                ),
            }
        }
    }
    all
}

/// Holds deposits against the twin's; the window's factors stand with the sums on the device.
fn check_deposits(number: u32, basis: &dyn Basis, said: &[Said], factor: impl Fn(usize) -> f64) {
    for case in said {
        let at = (number, basis.count(), case);
        let [mut of_primitive, mut of_segment] = [(); 2].map(|()| vec![0.0; basis.count()]);
        basis.deposit(&mut of_primitive, case.depth, 1.0);
        basis.deposit_segment(&mut of_segment, case.span, 1.0);
        let factor = factor(case.k);
        let [of_primitive, of_segment] = [of_primitive, of_segment].map(|sums| factor * sums[case.k]);
        assert_close(case.of_primitive, of_primitive, tolerance::PROBE_SERIES, ("primitive", at));
        assert_close(case.of_segment, of_segment, tolerance::PROBE_SERIES, ("segment", at));
    }
}

/// Holds deposits and optical depths against the twin's, where the window's factors stand with the integrals.
fn check<B: Linear>(number: u32, basis: &B, window: Window) {
    let count = Linear::count(basis);
    let factor = |k: usize| match number {
        0 => window.factor(k.div_ceil(2), count / 2),
        _ => window.factor(k, count - 1),
    };
    let said = said(number, count, window as u32);
    check_deposits(number, basis, &said, factor);
    for case in &said {
        let (found, expected) = (case.taken * factor(case.k), basis.integral(case.k, case.depth));
        assert_close(found, expected, tolerance::PROBE_SERIES, ("depth", number, count, case));
    }
}

#[test]
fn bases_equal_their_twins() {
    for (harmonics, window) in [(2, Window::Off), (3, Window::Fejer), (7, Window::Lanczos)] {
        check(0, &Fourier { harmonics, window }, window);
    }
    check(1, &Slices { count: 7 }, Window::Off);
    check(2, &Haar { count: 8 }, Window::Off);
    check(3, &Cosine { count: 7, window: Window::Lanczos }, Window::Lanczos);
    check(4, &Legendre { count: 15 }, Window::Off);
}

#[test]
fn moments_are_deposited_as_their_twins() {
    for moments in [4, 6, 8] {
        check_deposits(5, &Moments::single(moments), &said(5, moments + 1, 0), |_| 1.0);
    }
    for moments in [2, 3, 4] {
        check_deposits(6, &Trigonometric::single(moments), &said(6, 2 * moments + 1, 0), |_| 1.0);
    }
}

/// How far the twin's optical depth moves when the sums move by some roundings of single precision.
fn sensitivity(basis: &dyn Basis, sums: &[f64], depth: f64) -> f64 {
    let exact = basis.optical_depth(sums, depth);
    let moved = |i: usize| {
        let rounding = |k: usize| tolerance::PROBE * (2.0 * f64::from(spread(i, k % 6)) - 1.0);
        let sums: Vec<_> = sums.iter().enumerate().map(|(k, sum)| sum + sums[0] * rounding(k)).collect();
        (basis.optical_depth(&sums, depth) - exact).abs()
    };
    (1..20).map(moved).fold(0.0, f64::max)
}

/// Holds optical depths by moments against the twin's. Where a ray has few layers, moments amplify rounding: the device may be as
/// wrong as it makes the twin.
fn check_moments(number: u32, basis: &dyn Basis, bias: f64) {
    let Some(gpu) = gpu() else { return };
    let [number, count] = [number, basis.count() as u32].map(|value| format!("{value}u"));
    let bias = format!("{bias:?}");
    let shader = specialised(&MOMENTS, &[("BASIS: u32", &number), ("COUNT: u32", &count), ("BIAS: f32", &bias)]);
    let input: Vec<_> = (0..640)
        .flat_map(|i| {
            let mut sums = vec![0.0; basis.count()];
            for layer in 0..3 {
                let begin = f64::from(spread(i, layer)) * 0.8;
                basis.deposit_segment(&mut sums, [begin, begin + 0.2], f64::from(spread(i, layer + 3)) + 0.1);
            }
            let sum = |k: usize| sums.get(k).map_or(0.0, |&sum| sum as f32);
            let row = |row: usize| Vec4::from([0, 1, 2, 3].map(|k| sum(4 * row + k)));
            [row(0), row(1), row(2), Vec4::splat(spread(3 * i, 0))]
        })
        .collect();
    let mut agreed = 0;
    for (case, found) in input.chunks(4).zip(probe_with(&gpu, &shader, &input, &[]).chunks(4)) {
        let sums: Vec<f64> = (0..basis.count()).map(|k| f64::from(case[k / 4][k % 4])).collect();
        let depth = f64::from(case[3].x);
        let allowed = tolerance::PROBE_SERIES + 2.0 * sensitivity(basis, &sums, depth);
        assert_close(found[0].x.into(), basis.optical_depth(&sums, depth), allowed, case);
        agreed += u32::from(allowed < 0.01);
    }
    assert!(agreed > 400, "only {agreed} of 640 cases of {count} numbers say something");
}

#[test]
fn moments_equal_their_twin() {
    for (moments, bias) in [(4, 1e-3), (6, 3e-3), (8, 1e-2)] {
        check_moments(5, &Moments { moments, bias }, bias);
    }
}

#[test]
fn trigonometric_moments_equal_their_twin() {
    for (moments, bias) in [(2, 1e-3), (3, 1e-3), (4, 1e-3)] {
        check_moments(6, &Trigonometric { moments, bias }, bias);
    }
}

#[test]
#[should_panic(expected = "primitive")]
fn another_basis_is_caught() {
    let Some(_) = gpu() else { panic!("primitive: no device") };
    check(4, &Cosine { count: 7, window: Window::Off }, Window::Off);
}
