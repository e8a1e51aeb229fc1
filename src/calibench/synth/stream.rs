//! Where do random numbers come from? Streams keyed by what they are for, so that one more draw shifts
//! nothing else.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Open01, StandardNormal};

/// Names a stream: the same key gives the same numbers on every machine, whatever else was drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamKey<'a> {
    /// Seed of the experiment or study.
    pub seed: u64,
    /// Scenario within it, such as a node of a sweep.
    pub scenario: &'a str,
    /// Trial within the scenario.
    pub trial: u64,
    /// What is drawn: `noise`, `pose`, ...
    pub purpose: &'a str,
}

/// A stream of random numbers: ChaCha8 (Bernstein 2008), 256-bit key `seed | scenario | trial | purpose`, 64
/// bits each, the two names by their FNV-1a hash.
///
/// ```
/// use calibench::synth::{Stream, StreamKey};
///
/// let key = StreamKey { seed: 1, scenario: "example", trial: 0, purpose: "noise" };
/// let (mut first, mut other) = (Stream::open(key), Stream::open(StreamKey { trial: 1, ..key }));
/// assert_eq!(first.normal(), Stream::open(key).normal());
/// assert_ne!(first.normal(), other.normal());
/// ```
#[derive(Debug, Clone)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// Opens the stream of a key.
    pub fn open(key: StreamKey<'_>) -> Stream {
        let words = [key.seed, fnv1a(key.scenario.bytes()), key.trial, fnv1a(key.purpose.bytes())];
        let mut bytes = [0u8; 32];
        for (chunk, word) in bytes.chunks_exact_mut(8).zip(words) {
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        Stream(ChaCha8Rng::from_seed(bytes))
    }

    /// How far it was drawn, in words of 32 bits.
    pub fn position(&self) -> u128 {
        self.0.get_word_pos()
    }

    /// The same stream, drawn as far as `position`: with its key what is needed to go on elsewhere.
    pub fn drawn_to(mut self, position: u128) -> Stream {
        self.0.set_word_pos(position);
        self
    }

    /// A uniform number in (0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0.sample(Open01)
    }

    /// A uniform number in (low, high).
    pub fn uniform_in(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// A uniform integer below `bound` (> 0).
    pub fn below(&mut self, bound: usize) -> usize {
        self.0.random_range(0..bound)
    }

    /// A standard normal number.
    ///
    /// rand_distr's ziggurat is exact arithmetic inside `|x| < R`; beyond, it calls the platform's logarithm,
    /// whose last bit differs between machines. A draw that falls there (1 in 3700) is replaced by one from
    /// the same tail, by Marsaglia's method (1964) with `libm`.
    pub fn normal(&mut self) -> f64 {
        let x: f64 = self.0.sample(StandardNormal);
        if x.abs() < ZIGGURAT_TAIL { x } else { self.normal_tail().copysign(x) }
    }

    /// A normal number conditioned on exceeding the tail's start.
    fn normal_tail(&mut self) -> f64 {
        loop {
            let excess = -libm::log(self.uniform()) / ZIGGURAT_TAIL;
            if -2.0 * libm::log(self.uniform()) >= excess * excess {
                return ZIGGURAT_TAIL + excess;
            }
        }
    }

    /// The generator itself, for distributions of rand_distr.
    pub fn rng(&mut self) -> &mut impl Rng {
        &mut self.0
    }
}

/// Where the tail of the ziggurat with 256 layers starts (Marsaglia & Tsang 2000), rounded down: every draw
/// from the tail lies beyond it.
const ZIGGURAT_TAIL: f64 = 3.654152885361;

/// FNV-1a, 64 bits (Fowler, Noll & Vo 1991): a fixed hash that needs no crate, for names and fingerprints.
pub fn fnv1a(bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes
        .into_iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: StreamKey<'_> = StreamKey { seed: 1, scenario: "four-pose", trial: 0, purpose: "noise" };

    #[test]
    fn a_stream_goes_on_elsewhere_where_it_was_left() {
        let mut stream = Stream::open(KEY);
        let _ = (0..1001).map(|_| stream.normal()).sum::<f64>();
        let mut other = Stream::open(KEY).drawn_to(stream.position());
        assert_eq!([stream.normal(), stream.uniform()], [other.normal(), other.uniform()]);
    }

    #[test]
    fn every_part_of_the_key_matters() {
        let first = |key| Stream::open(key).uniform();
        let keys = [
            KEY,
            StreamKey { seed: 2, ..KEY },
            StreamKey { scenario: "other", ..KEY },
            StreamKey { trial: 1, ..KEY },
            StreamKey { purpose: "pose", ..KEY },
        ];
        for (i, a) in keys.iter().enumerate() {
            for b in &keys[i + 1..] {
                assert_ne!(first(*a), first(*b));
            }
        }
        assert_eq!(first(KEY), first(KEY));
    }

    /// Locked when the streams were defined; a change here changes every sampled number of every record.
    #[test]
    fn the_first_draws_are_locked() {
        let mut stream = Stream::open(KEY);
        let normals: [f64; 4] = std::array::from_fn(|_| stream.normal());
        assert_eq!(
            normals,
            [0.793832562817856, -0.11575368852727676, 0.6334481290368814, 0.22066497525774634]
        );
        assert_eq!((stream.uniform(), stream.below(1000)), (0.11723250039955901, 249));
        // Draw 1305 of the next trial is the first from the tail, where the platform's logarithm is kept out.
        let mut stream = Stream::open(StreamKey { trial: 1, ..KEY });
        let tail = (0..1305).map(|_| stream.normal()).last();
        assert_eq!(tail, Some(3.724401583333627));
    }

    #[test]
    fn normal_draws_have_the_normal_moments_and_tail() {
        let mut stream = Stream::open(KEY);
        let n = 2_000_000;
        let (mut sum, mut square, mut fourth, mut tail) = (0.0, 0.0, 0.0, 0);
        for _ in 0..n {
            let x = stream.normal();
            sum += x;
            square += x * x;
            fourth += x * x * x * x;
            tail += usize::from(x.abs() > 3.8);
        }
        let n = f64::from(n);
        // Bands of 5 standard errors: mean 1/sqrt(n), variance sqrt(2/n), fourth moment sqrt(96/n); the
        // chance that a right generator misses one of the four is below 3e-6, and the seed is fixed.
        assert!((sum / n).abs() < 5.0 / n.sqrt());
        assert!((square / n - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
        assert!((fourth / n - 3.0).abs() < 5.0 * (96.0 / n).sqrt());
        // P(|x| > 3.8) = 1.446962e-4.
        let expected: f64 = n * 1.446_962e-4;
        assert!((tail as f64 - expected).abs() < 5.0 * expected.sqrt());
    }
}
