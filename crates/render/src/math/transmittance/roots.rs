//! The roots of a polynomial, all of which are real.

/// The roots of a polynomial, lowest power first, of which all are real: Newton's iteration from where the largest cannot lie
/// beyond, so that it falls onto it, then the next of what is left.
pub fn roots(polynomial: &[f64]) -> Vec<f64> {
    let mut left: Vec<f64> = polynomial.to_vec();
    let mut found = Vec::new();
    while left.len() > 1 {
        let degree = left.len() - 1;
        let mut root = bound(&left);
        for _ in 0..200 {
            let (mut value, mut slope) = (0.0, 0.0);
            for &c in left.iter().rev() {
                slope = slope * root + value;
                value = value * root + c;
            }
            let step = value / slope;
            if !step.is_finite() || step.abs() <= 1e-15 * root.abs().max(1.0) {
                break;
            }
            root -= step;
        }
        found.push(root);
        deflate(&mut left, root);
        left.truncate(degree);
    }
    found
}

/// No root is larger: of n numbers none is farther above their mean than √(n − 1) standard deviations [Samuelson68]. A little
/// more, as a start below the root would be thrown past it.
fn bound(polynomial: &[f64]) -> f64 {
    let n = polynomial.len() - 1;
    let share = |back: usize| n.checked_sub(back).map_or(0.0, |k| polynomial[k] / polynomial[n]);
    let mean = -share(1) / n as f64;
    let variance = (share(1).powi(2) - 2.0 * share(2)) / n as f64 - mean * mean;
    let deviation = variance.max(0.0).sqrt();
    mean + ((n - 1) as f64).sqrt() * deviation + 1e-3 * (mean.abs() + deviation)
}

/// Horner's division by a root, from the end at which it loses no digits; the last number is no longer one of the polynomial.
fn deflate(polynomial: &mut [f64], root: f64) {
    let degree = polynomial.len() - 1;
    let mut carried = 0.0;
    if root.abs() > 1.0 {
        for c in &mut polynomial[..degree] {
            carried = (carried - *c) / root;
            *c = carried;
        }
    } else {
        for c in polynomial.iter_mut().rev() {
            carried = carried * root + *c;
            *c = carried;
        }
        polynomial.rotate_left(1);
    }
}
