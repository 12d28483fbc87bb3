//! The shaders' bases against their twins.

use glam::Vec4;

use super::{Basis, Cosine, Fourier, Haar, Legendre, Linear, Moments, Slices, Window};
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

fn basis_shader(basis: u32, count: usize, window: u32) -> (Shader, usize) {
    let first = usize::from(basis == 0);
    let sets = (count + first).div_ceil(4);
    let [basis, count, sets_, window] = [basis, count as u32, sets as u32, window].map(|v| format!("{v}u"));
    let constants =
        [("BASIS: u32", &*basis), ("COUNT: u32", &*count), ("SETS: u32", &*sets_), ("WINDOW: u32", &*window)];
    (specialised(&TRANSMITTANCE, &constants), sets)
}

/// What primitives, segments and optical depths make of every number, at many depths. The window stands with the sums on the
/// device and with the integrals here, so that their products are held against each other.
fn check<B: Linear>(number: u32, basis: &B, window: Window) {
    let Some(gpu) = gpu() else { return };
    let count = Linear::count(basis);
    let (shader, sets) = basis_shader(number, count, window as u32);
    let first = usize::from(number == 0);
    let input: Vec<_> = (0..640)
        .flat_map(|i| {
            let depth = [0.0, 1.0, spread(i, 0)][(i / sets).min(2)];
            let begin = spread(i, 1) * 0.9;
            let end = begin + (1.0 - begin) * spread(i, 2);
            [Vec4::new((i % sets) as f32, depth, begin, end); 4]
        })
        .collect();
    for (case, found) in input.chunks(4).zip(probe_with(&gpu, &shader, &input, &[]).chunks(4)) {
        let [set, depth, begin, end] = case[0].as_dvec4().to_array();
        let rows = [0, 1, 2].map(|row: usize| found[row].as_dvec4().to_array());
        for (lane, channel) in (4 * set as usize..).take(4).enumerate() {
            let at = (number, count, channel, case[0]);
            let [of_primitive, of_segment, taken] = rows.map(|row| row[lane]);
            let Some(k) = channel.checked_sub(first).filter(|&k| k < count) else {
                assert!(of_primitive == 0.0 && of_segment == 0.0, "nothing is kept where there is no number: {at:?}");
                continue;
            };
            let plain = match number {
                0 => k.div_ceil(2),
                _ => k,
            };
            let factor = window.factor(plain, if number == 0 { count / 2 } else { count - 1 });
            let expected = factor * (basis.dual_integral(k, end) - basis.dual_integral(k, begin));
            assert_close(of_primitive, factor * basis.dual(k, depth), tolerance::PROBE_SERIES, ("primitive", at));
            assert_close(of_segment, expected, tolerance::PROBE_SERIES, ("segment", at));
            assert_close(taken * factor, basis.integral(k, depth), tolerance::PROBE_SERIES, ("depth", at));
        }
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

/// How far the twin's optical depth moves when the sums move by some roundings of single precision.
fn sensitivity(basis: &Moments, sums: &[f64], depth: f64) -> f64 {
    let exact = basis.optical_depth(sums, depth);
    let moved = |i: usize| {
        let rounding = |k: usize| tolerance::PROBE * (2.0 * f64::from(spread(i, k % 6)) - 1.0);
        let sums: Vec<_> = sums.iter().enumerate().map(|(k, sum)| sum + sums[0] * rounding(k)).collect();
        (basis.optical_depth(&sums, depth) - exact).abs()
    };
    (1..20).map(moved).fold(0.0, f64::max)
}

/// Where a ray has few layers, moments amplify rounding: the device may be as wrong as it makes the twin.
#[test]
fn moments_equal_their_twin() {
    let Some(gpu) = gpu() else { return };
    for (moments, bias) in [(4, 1e-3), (6, 3e-3), (8, 1e-2)] {
        let basis = Moments { moments, bias };
        let (count, bias) = (format!("{}u", moments + 1), format!("{bias:?}"));
        let shader = specialised(&MOMENTS, &[("COUNT: u32", &count), ("BIAS: f32", &bias)]);
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
            let allowed = tolerance::PROBE_SERIES + 2.0 * sensitivity(&basis, &sums, depth);
            assert_close(found[0].x.into(), basis.optical_depth(&sums, depth), allowed, case);
            agreed += u32::from(allowed < 0.01);
        }
        assert!(agreed > 400, "only {agreed} of 640 cases with {moments} moments say something");
    }
}

#[test]
#[should_panic(expected = "primitive")]
fn another_basis_is_caught() {
    let Some(_) = gpu() else { panic!("primitive: no device") };
    check(4, &Cosine { count: 7, window: Window::Off }, Window::Off);
}
