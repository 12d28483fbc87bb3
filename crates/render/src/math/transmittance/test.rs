//! The bases against closed forms, each other, and the facts that are published of them.

use half::f16;

use super::{Basis, Cosine, Fourier, Haar, Legendre, Moments, Slices, Trigonometric, Window, absorbance};
use crate::test::tolerance;

/// Numbers in [0, 1), evenly spread.
fn spread(i: usize) -> f64 {
    (i as f64 * 0.618_033_988_749_895 + 0.37).fract()
}

/// Every basis that promises T(0) = 1 and T(1) = Π(1 − α), at two sizes.
fn promising() -> Vec<(&'static str, Box<dyn Basis>)> {
    let mut all: Vec<(&'static str, Box<dyn Basis>)> = Vec::new();
    for window in [Window::Off, Window::Fejer, Window::Lanczos] {
        all.push(("fourier", Box::new(Fourier { harmonics: 3, window })));
        all.push(("cosine", Box::new(Cosine { count: 7, window })));
    }
    all.push(("fourier", Box::new(Fourier { harmonics: 15, window: Window::Off })));
    for count in [7, 8, 32] {
        all.push(("slices", Box::new(Slices { count })));
        all.push(("haar", Box::new(Haar { count })));
        all.push(("legendre", Box::new(Legendre { count })));
    }
    all
}

fn all() -> Vec<(&'static str, Box<dyn Basis>)> {
    let mut all = promising();
    all.extend([4, 6, 8].map(|moments| ("moments", Box::new(Moments::single(moments)) as Box<dyn Basis>)));
    all.extend([2, 3, 4].map(|m| ("trigonometric", Box::new(Trigonometric::single(m)) as Box<dyn Basis>)));
    all
}

/// Depth and absorbance of some primitives.
fn primitives(count: usize) -> Vec<(f64, f64)> {
    (0..count).map(|i| (spread(i), absorbance(0.3 * spread(7 * i + 1)))).collect()
}

fn sums(basis: &dyn Basis, primitives: &[(f64, f64)]) -> Vec<f64> {
    let mut sums = vec![0.0; basis.count()];
    primitives.iter().for_each(|&(depth, absorbance)| basis.deposit(&mut sums, depth, absorbance));
    sums
}

/// [Jansen10] T(0) = 1 and T(1) = Π(1 − α), exactly, for every number of coefficients.
#[test]
fn the_ends_are_exact() {
    let primitives = primitives(40);
    let expected: f64 = primitives.iter().map(|(_, absorbance)| (-absorbance).exp()).product();
    for (name, basis) in promising() {
        let sums = sums(&*basis, &primitives);
        let (begin, end) = (basis.transmittance(&sums, 0.0), basis.transmittance(&sums, 1.0));
        let count = basis.count();
        assert!((begin - 1.0).abs() < tolerance::TWIN, "{name} of {count}: T(0) = {begin}");
        assert!((end / expected - 1.0).abs() < tolerance::TWIN, "{name} of {count}: T(1) = {end} for {expected}");
    }
}

/// A homogeneous segment deposits what many primitives within it do.
#[test]
fn a_segment_is_the_limit_of_many_primitives() {
    let ([begin, end], extinction, many) = ([0.23, 0.71], 3.0, 20_000);
    let length = (end - begin) / many as f64;
    for (name, basis) in all() {
        let mut segment = vec![0.0; basis.count()];
        basis.deposit_segment(&mut segment, [begin, end], extinction);
        let primitives: Vec<_> = (0..many).map(|i| (begin + (i as f64 + 0.5) * length, extinction * length)).collect();
        for (k, (found, expected)) in segment.iter().zip(sums(&*basis, &primitives)).enumerate() {
            let error = (found - expected).abs();
            assert!(error < tolerance::MANY_PRIMITIVES, "{name} {k} of {}: {found} for {expected}", basis.count());
        }
    }
}

/// Sums are the same in any order, but for rounding.
#[test]
fn order_does_not_matter() {
    let mut primitives = primitives(1000);
    let absorbance: f64 = primitives.iter().map(|(_, absorbance)| absorbance).sum();
    for (name, basis) in all() {
        let forwards = sums(&*basis, &primitives);
        primitives.reverse();
        for (a, b) in forwards.iter().zip(sums(&*basis, &primitives)) {
            // Of any number, at most √(2k + 1) of the whole absorbance.
            assert!((a - b).abs() < tolerance::TWIN * 8.0 * absorbance, "{name}: {a} and {b}");
        }
    }
}

/// As many wavelets as a power of two say what as many slices say.
#[test]
fn wavelets_are_slices() {
    let primitives = primitives(30);
    for count in [1, 2, 8, 32] {
        let (slices, haar) = (Slices { count }, Haar { count });
        let (a, b) = (sums(&slices, &primitives), sums(&haar, &primitives));
        for i in 0..=100 {
            let d = f64::from(i) / 100.0;
            let difference = slices.optical_depth(&a, d) - haar.optical_depth(&b, d);
            assert!(difference.abs() < tolerance::TWIN * 100.0, "{count} at {d}: {difference}");
        }
    }
}

/// Whatever is sharp is met in the mean: the error of τ falls as functions are added, for a smooth ray fast.
#[test]
fn more_coefficients_say_more() {
    // σ(z) = 6 z (1 − z): τ(d) = 3d² − 2d³.
    let many = 2000;
    let smooth: Vec<_> = (0..many).map(|i| (f64::from(i) + 0.5) / f64::from(many)).collect();
    let smooth: Vec<_> = smooth.into_iter().map(|z| (z, 6.0 * z * (1.0 - z) / f64::from(many))).collect();
    let error = |basis: &dyn Basis| {
        let sums = sums(basis, &smooth);
        let at = |i: i32| f64::from(i) / 200.0;
        (0..=200).map(at).map(|d| (basis.optical_depth(&sums, d) - d * d * (3.0 - 2.0 * d)).abs()).fold(0.0, f64::max)
    };
    let window = Window::Off;
    for (few, more) in [
        (error(&Fourier { harmonics: 2, window }), error(&Fourier { harmonics: 8, window })),
        (error(&Cosine { count: 5, window }), error(&Cosine { count: 17, window })),
        (error(&Slices { count: 5 }), error(&Slices { count: 17 })),
        (error(&Haar { count: 4 }), error(&Haar { count: 16 })),
    ] {
        assert!(more < 0.2 * few, "{more} for {few}");
    }
    // A polynomial of degree 2 is met exactly by three of Legendre's.
    assert!(error(&Legendre { count: 3 }) < tolerance::MANY_PRIMITIVES);
}

/// The greatest transmittance, without the bound at 1, behind or before one layer in the middle.
fn overshoot(opacity: f64, harmonics: usize, window: Window) -> f64 {
    let basis = Fourier { harmonics, window };
    let sums = sums(&basis, &[(0.5, absorbance(opacity))]);
    (0..=2000).map(|i| (-basis.optical_depth(&sums, f64::from(i) / 2000.0)).exp()).fold(0.0, f64::max)
}

/// [Jansen10, fig. 8] Ringing: with one layer at z = ½ the unbounded T reaches 1.24 (α = 0.9) and 1.53 (α = 0.99) with 7
/// coefficients, 1.23 and 1.52 with 15: more of them hardly help. A window does.
#[test]
fn ringing_is_as_published() {
    for (opacity, harmonics, published) in [(0.9, 3, 1.24), (0.99, 3, 1.53), (0.9, 7, 1.23), (0.99, 7, 1.52)] {
        let found = overshoot(opacity, harmonics, Window::Off);
        assert!((found - published).abs() < 0.006, "{found} for {published}, {opacity}, {harmonics}");
    }
    assert!(overshoot(0.99, 500, Window::Off) > 1.4, "Gibbs' phenomenon stays");
    assert!(overshoot(0.99, 3, Window::Fejer) <= 1.0 + tolerance::TWIN);
    assert!(overshoot(0.99, 3, Window::Lanczos) < 1.1);
}

/// Half floats, added to one by one, stand still when what is added is less than half a step: at τ ≈ 4 for α = 0.001, 8 for
/// 0.002, 16 for 1/255. The bias begins earlier: 1000 layers of 0.004 give a₀ = 7.83 for 8.02.
#[test]
fn half_floats_stall() {
    let sum = |opacity: f64, layers: usize| {
        let add = |sum: f16, _| f16::from_f64(sum.to_f64() + f16::from_f64(2.0 * absorbance(opacity)).to_f64());
        (0..layers).fold(f16::ZERO, add).to_f64()
    };
    for (opacity, depth) in [(0.001, 4.0), (0.002, 8.0), (1.0 / 255.0, 16.0)] {
        let stalled = sum(opacity, 100_000);
        assert_eq!(stalled, sum(opacity, 200_000), "no layer is seen any more");
        assert!((stalled / 2.0 / depth - 1.0).abs() < 0.01, "τ = {} for {depth}", stalled / 2.0);
    }
    let (found, exact) = (sum(0.004, 1000), 2000.0 * absorbance(0.004));
    assert!((found - 7.83).abs() < 0.005 && (exact - 8.02).abs() < 0.005, "{found} for {exact}");
}

/// Layers that so many moments tell apart, half as many as there are real numbers, are exact, but for the bias and the share that is
/// taken of a layer at the depth itself. Depths as near to a layer as `beside` are left out: there the bound changes over the
/// width of the bias.
fn check_layers(count: usize, beside: f64, basis: impl Fn(f64) -> Box<dyn Basis>, single: f64) {
    let layers: Vec<_> = (0..count).map(|i| ((i as f64 + 0.7) / (count as f64 + 0.4), 0.5)).collect();
    for (bias, most) in [(single, tolerance::BIASED_MOMENTS), (1e-12, tolerance::MOMENTS)] {
        let basis = basis(bias);
        let sums = sums(&*basis, &layers);
        for i in 0..=200 {
            let d = f64::from(i) / 200.0;
            if layers.iter().any(|(z, _)| (z - d).abs() < beside) {
                continue;
            }
            let expected = 0.5 * layers.iter().filter(|(z, _)| *z < d).count() as f64;
            let found = basis.optical_depth(&sums, d);
            assert!((found - expected).abs() < most, "{found} for {expected} of {count} layers at {d}, bias {bias}");
        }
    }
}

/// m power moments are exact for m/2 layers, m trigonometric ones for m.
#[test]
fn moments_know_few_layers() {
    for moments in [4, 6, 8] {
        let single = Moments::single(moments).bias;
        check_layers(moments / 2, 0.06, |bias| Box::new(Moments { moments, bias }), single);
    }
    for moments in [2, 3, 4] {
        let single = Trigonometric::single(moments).bias;
        check_layers(moments, 0.06, |bias| Box::new(Trigonometric { moments, bias }), single);
    }
}

/// What lies at one end of the ray is not taken for what lies at the other: the circle's empty angle is between them.
#[test]
fn a_circle_of_depths_is_open() {
    for moments in [2, 3, 4] {
        let basis = Trigonometric::single(moments);
        for (layer, depth, expected) in [(0.02, 0.5, 1.0), (0.98, 0.5, 0.0)] {
            let found = basis.optical_depth(&sums(&basis, &[(layer, 1.0)]), depth);
            assert!((found - expected).abs() < tolerance::BIASED_MOMENTS, "{found} for {expected}, {moments} moments");
        }
    }
}

/// All roots, also where some are far from the others.
#[test]
fn real_roots_are_found() {
    for expected in
        [vec![0.5], vec![2.0, -1.0], vec![1000.0, 1.0, 0.5], vec![40.0, 0.3, 0.1, -7.0], vec![900.0, 899.0, -0.01]]
    {
        let mut polynomial = vec![3.0];
        for root in &expected {
            polynomial.insert(0, 0.0);
            for k in 1..polynomial.len() {
                polynomial[k - 1] -= root * polynomial[k];
            }
        }
        let mut found = super::roots::roots(&polynomial);
        let mut expected = expected;
        found.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found / expected - 1.0).abs() < tolerance::MOMENTS, "{found} for {expected}");
        }
    }
}

/// A ray through puffs of smoke.
fn puffs(place: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let puff = |center: f64, width: f64, absorbance: f64| {
        (0..200).map(move |i| {
            let x = (f64::from(i) + 0.5) / 100.0 - 1.0;
            (center + width * x, absorbance * 0.0075 * (1.0 - x * x))
        })
    };
    let all = puff(0.3, 0.12, 1.2).chain(puff(0.55, 0.08, 0.8)).chain(puff(0.72, 0.1, 1.0));
    all.map(|(z, absorbance)| (place(z), absorbance)).collect()
}

/// The transmittance of a basis along a ray, at 500 places of what `place` maps.
fn profile(basis: &dyn Basis, place: impl Fn(f64) -> f64) -> Vec<f64> {
    let sums = sums(basis, &puffs(&place));
    (0..500).map(|i| basis.transmittance(&sums, place(0.15 + 0.7 * f64::from(i) / 500.0))).collect()
}

fn exact_profile() -> Vec<f64> {
    let puffs = puffs(|z| z);
    let before = |d: f64| puffs.iter().filter(|(z, _)| *z < d).map(|(_, absorbance)| absorbance).sum::<f64>();
    (0..500).map(|i| (-before(0.15 + 0.7 * f64::from(i) / 500.0)).exp()).collect()
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

const SEVEN: Fourier = Fourier { harmonics: 3, window: Window::Off };
const FIFTEEN: Fourier = Fourier { harmonics: 7, window: Window::Off };

/// [Jansen10, fig. 4] Against the ray itself, Fourier's coefficients are closer than as many slices, of smooth media.
#[test]
fn fourier_beats_slices() {
    let exact = exact_profile();
    for (fourier, count) in [(SEVEN, 7), (FIFTEEN, 15)] {
        let (fourier, slices) =
            (rms(&profile(&fourier, |z| z), &exact), rms(&profile(&Slices { count }, |z| z), &exact));
        assert!(fourier < 0.8 * slices, "{fourier} against {slices} with {count}");
    }
    assert!(rms(&profile(&FIFTEEN, |z| z), &exact) < 0.005);
}

/// How much a profile changes, at most over `steps` of a change of bounds, in root mean square.
fn change(basis: &dyn Basis, steps: &[(f64, f64)]) -> f64 {
    let still = profile(basis, |z| z);
    steps.iter().map(|&(scale, offset)| rms(&profile(basis, |z| z * scale + offset), &still)).fold(0.0, f64::max)
}

/// [Jansen10, figs. 5–7] Bounds 10 % wider, media that move by less than a slice, and an outlier that lets the bounds reach half as far
/// again: the picture that Fourier's coefficients give hardly changes; that of slices flickers.
#[test]
fn bounds_hardly_matter() {
    let wider: Vec<_> = (0..=10).map(|i| 1.0 / (1.0 + 0.01 * f64::from(i))).map(|s| (s, 0.5 - 0.5 * s)).collect();
    let moved: Vec<_> = (-7..=7).map(|i| (1.0, 0.01 * f64::from(i))).collect();
    let outlier = [(1.0 / 1.5, 0.0)];
    for (what, steps, most) in
        [("wider", &wider[..], 0.003), ("moved", &moved[..], 0.003), ("outlier", &outlier[..], 0.01)]
    {
        let (fourier, slices) = (change(&FIFTEEN, steps), change(&Slices { count: 15 }, steps));
        assert!(fourier < most && fourier < 0.8 * slices, "{what}: {fourier} against {slices}");
    }
}
