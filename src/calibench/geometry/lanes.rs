//! How are four points worked on at once with the same bits on every machine? Four lanes, no fused operation,
//! one order.
//!
//! A kernel is written once over [`Lanes`] and runs on whatever registers the machine has. Lane `i` of every
//! operation is the IEEE operation of scalar code, and lanes are summed as `(l0 + l1) + (l2 + l3)`, so the
//! width of a register never shows in a result. Multiplication and addition are never fused: a fused product
//! is rounded once less, and not every machine has it.

use super::Vec2;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Points in one block.
pub(crate) const LANES: usize = 4;

/// Arithmetic that scalars and lanes share, so that a formula is written once for both.
pub(crate) trait Arithmetic:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// The same number in every lane.
    fn splat(value: f64) -> Self;
}

/// Arithmetic with the functions that lenses are made of; those that no register has come from libm, the same
/// on every machine.
pub(crate) trait Real: Arithmetic {
    fn sqrt(self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    /// The angle of the point `(x, self)`.
    fn atan2(self, x: Self) -> Self;
    /// The smaller; the second where one is not a number.
    fn min(self, other: Self) -> Self;
}

/// Four numbers that are computed with at once.
pub(crate) trait Lanes: Real {
    fn load(values: &[f64; LANES]) -> Self;
    fn store(self) -> [f64; LANES];
    /// Lane by lane the larger; the second where one is not a number.
    fn max(self, other: Self) -> Self;
    /// Whether every lane is greater than 0; NaN is not.
    fn all_positive(self) -> bool;
    /// The sums of the lanes of four vectors, each as `(l0 + l1) + (l2 + l3)`.
    fn sums(vectors: [Self; 4]) -> [f64; 4];

    fn zero() -> Self {
        Self::splat(0.0)
    }
}

/// A computation over [`Lanes`], run by [`dispatch`]. Implementations mark `run` and all that it calls
/// `#[inline(always)]`, so that it is compiled for the registers chosen.
pub(crate) trait Kernel {
    type Output;
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Runs a kernel with the widest registers that the machine has, or in plain code if built with `--cfg
/// calibench_portable`: that is for measuring what other machines run.
#[inline]
pub(crate) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(all(target_arch = "x86_64", not(calibench_portable)))]
    if std::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { wide::run(kernel) };
    }
    kernel.run::<Portable>()
}

/// Runs a kernel in plain code, as a machine without wide registers does.
#[cfg(test)]
pub(crate) fn run_portable<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Portable>()
}

impl Arithmetic for f64 {
    #[inline(always)]
    fn splat(value: f64) -> f64 {
        value
    }
}

impl Real for f64 {
    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn sin(self) -> f64 {
        libm::sin(self)
    }

    #[inline(always)]
    fn cos(self) -> f64 {
        libm::cos(self)
    }

    #[inline(always)]
    fn atan2(self, x: f64) -> f64 {
        libm::atan2(self, x)
    }

    #[inline(always)]
    fn min(self, other: f64) -> f64 {
        if self < other { self } else { other }
    }
}

/// The functions that lanes take from libm, number by number.
macro_rules! functions_lane_by_lane {
    () => {
        #[inline(always)]
        fn sin(self) -> Self {
            Self::load(&self.store().map(libm::sin))
        }

        #[inline(always)]
        fn cos(self) -> Self {
            Self::load(&self.store().map(libm::cos))
        }

        #[inline(always)]
        fn atan2(self, x: Self) -> Self {
            let (y, x) = (self.store(), x.store());
            Self::load(&std::array::from_fn(|i| libm::atan2(y[i], x[i])))
        }

        #[inline(always)]
        fn min(self, other: Self) -> Self {
            -(-self).max(-other)
        }
    };
}

/// Lanes for any machine; the compiler pairs them up where it can.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Portable([f64; LANES]);

macro_rules! portable_operation {
    ($($operation:ident $method:ident $symbol:tt),*) => {$(
        impl $operation for Portable {
            type Output = Portable;
            #[inline(always)]
            fn $method(self, other: Portable) -> Portable {
                let (Portable([a0, a1, a2, a3]), Portable([b0, b1, b2, b3])) = (self, other);
                Portable([a0 $symbol b0, a1 $symbol b1, a2 $symbol b2, a3 $symbol b3])
            }
        }
    )*};
}
portable_operation!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Neg for Portable {
    type Output = Portable;
    #[inline(always)]
    fn neg(self) -> Portable {
        let Portable([a0, a1, a2, a3]) = self;
        Portable([-a0, -a1, -a2, -a3])
    }
}

impl Arithmetic for Portable {
    #[inline(always)]
    fn splat(value: f64) -> Portable {
        Portable([value; LANES])
    }
}

impl Real for Portable {
    #[inline(always)]
    fn sqrt(self) -> Portable {
        Portable(self.0.map(f64::sqrt))
    }

    functions_lane_by_lane!();
}

impl Lanes for Portable {
    #[inline(always)]
    fn load(values: &[f64; LANES]) -> Portable {
        Portable(*values)
    }

    #[inline(always)]
    fn store(self) -> [f64; LANES] {
        self.0
    }

    #[inline(always)]
    fn max(self, other: Portable) -> Portable {
        let larger = |i: usize| if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] };
        Portable([larger(0), larger(1), larger(2), larger(3)])
    }

    #[inline(always)]
    fn all_positive(self) -> bool {
        self.0.iter().all(|&a| a > 0.0)
    }

    #[inline(always)]
    fn sums(vectors: [Portable; 4]) -> [f64; 4] {
        vectors.map(|Portable([a, b, c, d])| (a + b) + (c + d))
    }
}

/// AVX2. The type is named in this module only, and made only inside [`wide::run`], which runs only where
/// AVX2 is: that is what makes every `unsafe` block below sound.
#[cfg(all(target_arch = "x86_64", not(calibench_portable)))]
mod wide {
    use super::{Add, Arithmetic, Div, Kernel, LANES, Lanes, Mul, Neg, Real, Sub};
    use std::arch::x86_64::*;

    #[derive(Clone, Copy)]
    struct Wide(__m256d);

    /// Compiles the kernel, all of it inlined, for AVX2 (not FMA).
    #[target_feature(enable = "avx2")]
    pub(super) fn run<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Wide>()
    }

    macro_rules! wide_operation {
        ($($operation:ident $method:ident $intrinsic:ident),*) => {$(
            impl $operation for Wide {
                type Output = Wide;
                #[inline(always)]
                fn $method(self, other: Wide) -> Wide {
                    // SAFETY: see the module.
                    Wide(unsafe { $intrinsic(self.0, other.0) })
                }
            }
        )*};
    }
    wide_operation!(Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd);

    impl Neg for Wide {
        type Output = Wide;
        #[inline(always)]
        fn neg(self) -> Wide {
            // SAFETY: see the module.
            Wide(unsafe { _mm256_xor_pd(self.0, _mm256_set1_pd(-0.0)) })
        }
    }

    impl Arithmetic for Wide {
        #[inline(always)]
        fn splat(value: f64) -> Wide {
            // SAFETY: see the module.
            Wide(unsafe { _mm256_set1_pd(value) })
        }
    }

    impl Real for Wide {
        #[inline(always)]
        fn sqrt(self) -> Wide {
            // SAFETY: see the module.
            Wide(unsafe { _mm256_sqrt_pd(self.0) })
        }

        functions_lane_by_lane!();
    }

    impl Lanes for Wide {
        #[inline(always)]
        fn load(values: &[f64; LANES]) -> Wide {
            // SAFETY: see the module; the pointer is to four numbers.
            Wide(unsafe { _mm256_loadu_pd(values.as_ptr()) })
        }

        #[inline(always)]
        fn store(self) -> [f64; LANES] {
            let mut values = [0.0; LANES];
            // SAFETY: see the module; the pointer is to four numbers.
            unsafe { _mm256_storeu_pd(values.as_mut_ptr(), self.0) };
            values
        }

        #[inline(always)]
        fn max(self, other: Wide) -> Wide {
            // SAFETY: see the module.
            Wide(unsafe { _mm256_max_pd(self.0, other.0) })
        }

        #[inline(always)]
        fn all_positive(self) -> bool {
            // SAFETY: see the module.
            unsafe {
                let positive = _mm256_cmp_pd::<_CMP_GT_OQ>(self.0, _mm256_setzero_pd());
                _mm256_movemask_pd(positive) == 0b1111
            }
        }

        #[inline(always)]
        fn sums([a, b, c, d]: [Wide; 4]) -> [f64; 4] {
            // SAFETY: see the module.
            Wide(unsafe {
                // (a0 + a1, b0 + b1, a2 + a3, b2 + b3), the same of c and d, then lower and upper halves.
                let (ab, cd) = (_mm256_hadd_pd(a.0, b.0), _mm256_hadd_pd(c.0, d.0));
                let low = _mm256_permute2f128_pd::<0x20>(ab, cd);
                let high = _mm256_permute2f128_pd::<0x31>(ab, cd);
                _mm256_add_pd(low, high)
            })
            .store()
        }
    }
}

/// Four pairs of points, coordinate by coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PairBlock {
    pub x: [f64; LANES],
    pub y: [f64; LANES],
    pub u: [f64; LANES],
    pub v: [f64; LANES],
}

/// Pairs `(x, y)`, `(u, v)` of points in blocks of four. The last block is filled up with copies of the last
/// pair, which [`PairBlocks::mask`] takes out of sums.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PairBlocks {
    pub blocks: Vec<PairBlock>,
    len: usize,
}

impl PairBlocks {
    /// Collects pairs.
    pub fn new(pairs: impl ExactSizeIterator<Item = (Vec2, Vec2)>) -> PairBlocks {
        let len = pairs.len();
        let mut blocks = Vec::with_capacity(len.div_ceil(LANES));
        let mut block = PairBlock { x: [0.0; LANES], y: [0.0; LANES], u: [0.0; LANES], v: [0.0; LANES] };
        let mut lane = 0;
        for (from, to) in pairs {
            (block.x[lane], block.y[lane], block.u[lane], block.v[lane]) = (from.x, from.y, to.x, to.y);
            lane += 1;
            if lane == LANES {
                blocks.push(block);
                lane = 0;
            }
        }
        if lane > 0 {
            for values in [&mut block.x, &mut block.y, &mut block.u, &mut block.v] {
                let last = values[lane - 1];
                values[lane..].fill(last);
            }
            blocks.push(block);
        }
        PairBlocks { blocks, len }
    }

    /// Number of pairs.
    pub fn len(&self) -> usize {
        self.len
    }

    /// The pairs in order.
    pub fn iter(&self) -> impl Iterator<Item = (Vec2, Vec2)> {
        let pair = |b: &PairBlock, i: usize| (Vec2::new(b.x[i], b.y[i]), Vec2::new(b.u[i], b.v[i]));
        (0..self.len).map(move |k| pair(&self.blocks[k / LANES], k % LANES))
    }

    /// Least and greatest u and v: the corners of the box around the second points. Empty is infinite and
    /// inside out.
    pub fn to_box(&self) -> (Vec2, Vec2) {
        dispatch(Bounds { pairs: self })
    }

    /// For a block that is not full: 1 in the lanes of pairs, 0 in the others.
    #[inline(always)]
    pub fn mask(&self, block: usize) -> Option<[f64; LANES]> {
        let used = self.len - block * LANES;
        (used < LANES).then(|| [1.0, f64::from(used > 1), f64::from(used > 2), 0.0])
    }
}

struct Bounds<'a> {
    pairs: &'a PairBlocks,
}

impl Kernel for Bounds<'_> {
    type Output = (Vec2, Vec2);

    #[inline(always)]
    fn run<L: Lanes>(self) -> (Vec2, Vec2) {
        let mut most = [L::splat(f64::NEG_INFINITY); 4];
        for block in &self.pairs.blocks {
            let (u, v) = (L::load(&block.u), L::load(&block.v));
            most = [u.max(most[0]), v.max(most[1]), (-u).max(most[2]), (-v).max(most[3])];
        }
        let most = most.map(|lanes| lanes.store().into_iter().fold(f64::NEG_INFINITY, f64::max));
        (Vec2::new(-most[2], -most[3]), Vec2::new(most[0], most[1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation of the trait, chained so that an error anywhere shows.
    struct Everything([[f64; LANES]; 4]);

    impl Kernel for Everything {
        type Output = (Vec<u64>, bool);

        #[inline(always)]
        fn run<L: Lanes>(self) -> (Vec<u64>, bool) {
            let [a, b, c, d] = self.0.map(|v| L::load(&v));
            let e = (a * b + c) / d - a.max(c);
            let f = -(e * e + L::splat(0.1)).sqrt();
            let sums = L::sums([a, e, f, b]);
            let values = sums.into_iter().chain(f.store()).chain(e.store());
            (values.map(f64::to_bits).collect(), (e * e).all_positive())
        }
    }

    #[test]
    fn wide_registers_give_the_bits_of_plain_code() {
        let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        for _ in 0..1000 {
            let values = [[(); LANES]; 4].map(|row| row.map(|()| next()));
            assert_eq!(dispatch(Everything(values)), run_portable(Everything(values)));
        }
        let mut odd = [[1.0; LANES]; 4];
        odd[0][2] = f64::NAN;
        assert!(!dispatch(Everything(odd)).1 && !run_portable(Everything(odd)).1);
    }

    #[test]
    fn blocks_keep_the_pairs_in_order_and_mask_the_rest() {
        for len in 1..10 {
            let pair = |i: usize| (Vec2::new(i as f64, 0.5), Vec2::new(-(i as f64), 2.0));
            let blocks = PairBlocks::new((0..len).map(pair));
            assert!(blocks.iter().eq((0..len).map(pair)));
            assert_eq!(blocks.to_box(), (Vec2::new(1.0 - len as f64, 2.0), Vec2::new(0.0, 2.0)));
            let used: f64 = (0..blocks.blocks.len())
                .map(|b| blocks.mask(b).map_or(LANES as f64, |m| m.iter().sum()))
                .sum();
            assert_eq!(used, len as f64);
        }
    }
}
