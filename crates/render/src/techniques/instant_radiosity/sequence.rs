//! Points that fill the unit cube evenly: Halton's sequence, jittered or not, and what it is compared with.

/// The bases of the dimensions: distinct primes. A walk uses two for the place on the light and two a reflection; beyond these
/// the dimensions are random.
const PRIMES: [u32; 40] = [
    2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89, 97, 101, 103, 107, 109,
    113, 127, 131, 137, 139, 149, 151, 157, 163, 167, 173,
];

/// Φ_b(i): the digits of i in base b, mirrored at the point. [Halton60], [Niederreiter92]
pub fn radical_inverse(base: u32, mut i: u32) -> f64 {
    let (mut value, mut place) = (0.0, 1.0 / f64::from(base));
    while i > 0 {
        value += f64::from(i % base) * place;
        i /= base;
        place /= f64::from(base);
    }
    value
}

/// A permutation of the digits in base b that keeps 0, for which the first points of two large bases do not lie on lines.
/// [Faure92]
pub fn faure(base: u32) -> Vec<u32> {
    if base <= 2 {
        return (0..base).collect();
    }
    if base.is_multiple_of(2) {
        let half = faure(base / 2);
        return [0, 1].into_iter().flat_map(|odd| half.iter().map(move |digit| 2 * digit + odd)).collect();
    }
    let middle = (base - 1) / 2;
    let mut digits: Vec<u32> = faure(base - 1).iter().map(|&digit| digit + u32::from(digit >= middle)).collect();
    digits.insert(middle as usize, middle);
    digits
}

/// Φ_b(i) with permuted digits; the permutation keeps 0.
fn scrambled(permutation: &[u32], mut i: u32) -> f64 {
    let base = permutation.len() as u32;
    let (mut value, mut place) = (0.0, 1.0 / f64::from(base));
    while i > 0 {
        value += f64::from(permutation[(i % base) as usize]) * place;
        i /= base;
        place /= f64::from(base);
    }
    value
}

/// Where points lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Halton's points, with Faure's digits from base 11 on, each moved at random within 1/n, n being how many points use the dimension.
    Jittered,
    /// Halton's points, all moved by 1/2n: the first of them would be a corner.
    Halton,
    /// (i/n, Φ₂(i), Φ₃(i), …), each moved at random within 1/n: of use where all points go the same number of dimensions.
    JitteredHammersley,
    /// A random permutation of n strata in each dimension, and at random within them.
    Rooks,
    /// Independent.
    Random,
}

/// A sequence of points in as many dimensions as one likes.
#[derive(Clone, Debug)]
pub struct Sequence {
    kind: Kind,
    seed: u32,
    count: u32,
    /// N-rooks: a permutation a dimension, made when it is first asked for.
    permutations: std::cell::RefCell<Vec<Vec<u32>>>,
    /// Digits' permutations, a base each.
    digits: Vec<Vec<u32>>,
}

impl Sequence {
    /// A sequence of `count` points. Seeds shift all points, modulo 1; but 0, where it is not jittered: Halton's own points.
    pub fn new(kind: Kind, count: u32, seed: u32) -> Self {
        // Small bases fill the square without it.
        let digits = PRIMES.map(|base| if base < 11 { (0..base).collect() } else { faure(base) }).into();
        Self { kind, seed, count: count.max(1), permutations: Default::default(), digits }
    }

    /// The same sequence, of another number of points.
    pub fn of(self, count: u32) -> Self {
        Self::new(self.kind, count, self.seed)
    }

    /// Coordinate `dimension` of point i, in [0, 1), where `users` points use this dimension.
    pub fn at(&self, i: u32, dimension: usize, users: u32) -> f64 {
        let random = uniform(self.seed, i, dimension as u32);
        let jitter = random / f64::from(users.max(1));
        let halton = |dimension: usize| PRIMES.get(dimension).map(|&base| radical_inverse(base, i));
        // Unshifted, point 0 is a corner in all dimensions: a particle that goes up and down between floor and ceiling as long as any does.
        let published = self.seed == 0 && self.kind != Kind::Jittered;
        let shift = if published { 0.0 } else { uniform(self.seed, u32::MAX, dimension as u32) };
        let x = match self.kind {
            Kind::Random => return random,
            Kind::Rooks => return (f64::from(self.permuted(i, dimension)) + random) / f64::from(self.count),
            Kind::Halton => halton(dimension).map(|x| x + shift + 0.5 / f64::from(users.max(1))),
            Kind::Jittered => self.digits.get(dimension).map(|digits| scrambled(digits, i) + shift + jitter),
            Kind::JitteredHammersley if dimension == 0 => Some(f64::from(i) / f64::from(self.count) + shift + jitter),
            Kind::JitteredHammersley => halton(dimension - 1).map(|x| x + shift + jitter),
        };
        x.map_or(random, |x| x.fract())
    }

    fn permuted(&self, i: u32, dimension: usize) -> u32 {
        let mut made = self.permutations.borrow_mut();
        while made.len() <= dimension {
            let mut order: Vec<u32> = (0..self.count).collect();
            for last in (1..self.count).rev() {
                let other = uniform(self.seed ^ 0x9e37_79b9, last, made.len() as u32) * f64::from(last + 1);
                order.swap(last as usize, other as usize);
            }
            made.push(order);
        }
        made[dimension][(i % self.count) as usize]
    }
}

/// A number in [0, 1) of three: SplitMix's finaliser [Steele14].
pub fn uniform(seed: u32, i: u32, dimension: u32) -> f64 {
    let mut x = u64::from(seed) << 32 | u64::from(i);
    for word in [0, u64::from(dimension)] {
        x = x.wrapping_add(word.wrapping_mul(0xd134_2543_de82_ef95)).wrapping_add(0x9e37_79b9_7f4a_7c15);
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^= x >> 31;
    }
    (x >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod test {
    use super::*;

    /// [Niederreiter92]: van der Corput's sequence, and Halton's in bases 3 and 5.
    #[test]
    fn published_values() {
        let base = |b| (1..=8).map(|i| radical_inverse(b, i)).collect::<Vec<_>>();
        let close = |found: Vec<f64>, expected: &[f64]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{found:?}");
        };
        close(base(2), &[0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875, 0.0625]);
        close(base(3), &[1., 2., 1. / 3., 4. / 3., 7. / 3., 2. / 3., 5. / 3., 8. / 3.].map(|x| x / 3.0));
        close(base(5), &[0.2, 0.4, 0.6, 0.8, 0.04, 0.24, 0.44, 0.64]);
        assert_eq!(radical_inverse(2, 0), 0.0);
    }

    /// [Faure92]: the permutations of small bases; all of them are some, and keep 0.
    #[test]
    fn digits() {
        let published: [&[u32]; 6] =
            [&[0, 1], &[0, 1, 2], &[0, 2, 1, 3], &[0, 3, 2, 1, 4], &[0, 2, 4, 1, 3, 5], &[0, 2, 5, 3, 1, 4, 6]];
        for (base, expected) in (2..).zip(published) {
            assert_eq!(faure(base), expected);
        }
        for base in PRIMES {
            let mut sorted = faure(base);
            assert_eq!(sorted[0], 0);
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..base));
        }
        assert!((scrambled(&faure(5), 1) - 0.6).abs() < 1e-15);
        // Halton's first points in bases 17 and 19 lie on a line.
        let apart = |x: &dyn Fn(u32) -> (f64, f64)| {
            (1..17)
                .filter(|&i| {
                    let (a, b) = x(i);
                    (a - b).abs() > 0.15
                })
                .count()
        };
        assert_eq!(apart(&|i| (radical_inverse(17, i), radical_inverse(19, i))), 0);
        assert!(apart(&|i| (scrambled(&faure(17), i), scrambled(&faure(19), i))) > 2);
    }

    /// The star discrepancy of 2D points, from all boxes with corners at the points' coordinates.
    fn discrepancy(points: &[(f64, f64)]) -> f64 {
        let n = points.len() as f64;
        let mut worst = 0f64;
        for &(x, _) in points.iter().chain(&[(1.0, 1.0)]) {
            for &(_, y) in points.iter().chain(&[(1.0, 1.0)]) {
                let open = points.iter().filter(|p| p.0 < x && p.1 < y).count() as f64;
                let closed = points.iter().filter(|p| p.0 <= x && p.1 <= y).count() as f64;
                worst = worst.max((x * y - open / n).abs()).max((closed / n - x * y).abs());
            }
        }
        worst
    }

    /// D*_N < 2/N + (1/N)·Π((b−1)/(2 ln b)·ln N + (b+1)/2) [Niederreiter92, theorem 3.6], and far below random points'.
    #[test]
    fn low_discrepancy() {
        let points = |kind, n| {
            let sequence = Sequence::new(kind, n, 0);
            (0..n).map(|i| (sequence.at(i, 0, n), sequence.at(i, 1, n))).collect::<Vec<_>>()
        };
        for n in [16u32, 64, 150] {
            let log = f64::from(n).ln();
            let factor = |b: f64| (b - 1.0) / (2.0 * b.ln()) * log + (b + 1.0) / 2.0;
            let bound = (2.0 + factor(2.0) * factor(3.0)) / f64::from(n);
            let halton = discrepancy(&points(Kind::Halton, n));
            assert!(halton < bound, "{halton} of {n}");
            // A jitter of 1/n moves each edge of a box by no more than that.
            let jittered = discrepancy(&points(Kind::Jittered, n));
            assert!(jittered < bound + 2.0 / f64::from(n), "{jittered} of {n}");
        }
        let [halton, hammersley, random] =
            [Kind::Halton, Kind::JitteredHammersley, Kind::Random].map(|kind| discrepancy(&points(kind, 150)));
        assert!(halton < 0.5 * random && hammersley < 0.5 * random, "{halton}, {hammersley}, {random}");
    }

    /// Every stratum of every dimension has one rook, and every number is in [0, 1).
    #[test]
    fn rooks() {
        let sequence = Sequence::new(Kind::Rooks, 50, 7);
        for dimension in [0, 1, 9] {
            let mut strata: Vec<_> = (0..50).map(|i| (sequence.at(i, dimension, 50) * 50.0) as u32).collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..50).collect::<Vec<_>>());
        }
        let mean = (0..1000).map(|i| uniform(1, i, 2)).sum::<f64>() / 1000.0;
        assert!((mean - 0.5).abs() < 0.05, "{mean}");
    }

    /// Beyond the primes points are still in range.
    #[test]
    fn many_dimensions() {
        for kind in [Kind::Jittered, Kind::Halton, Kind::JitteredHammersley, Kind::Rooks, Kind::Random] {
            let sequence = Sequence::new(kind, 8, 3);
            assert!((0..60).all(|dimension| (0.0..1.0).contains(&sequence.at(5, dimension, 8))));
        }
    }
}
