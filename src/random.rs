//! Counter-based random numbers: Philox 4x32-10.
//!
//! A draw is a function of a key (the seed) and a counter (who draws, when and what for), so results do not
//! depend on the order of draws, on threads, or on whether a processor or a GPU draws.
//!
//! Source: Salmon, Moraes, Dror and Shaw, *Parallel random numbers: as easy as 1, 2, 3*, SC11 (2011).

use serde::{Deserialize, Serialize};

const MULTIPLIERS: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
const WEYL: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];

/// Ten rounds of Philox: four random words from a counter and a key.
#[inline(always)]
pub fn philox(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    for _ in 0..10 {
        let product = |i: usize, word: u32| u64::from(MULTIPLIERS[i]) * u64::from(word);
        let (p0, p1) = (product(0, counter[0]), product(1, counter[2]));
        counter = [
            (p1 >> 32) as u32 ^ counter[1] ^ key[0],
            p1 as u32,
            (p0 >> 32) as u32 ^ counter[3] ^ key[1],
            p0 as u32,
        ];
        key = [key[0].wrapping_add(WEYL[0]), key[1].wrapping_add(WEYL[1])];
    }
    counter
}

/// A seeded family of draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Random {
    key: [u32; 2],
}

impl Random {
    /// From a seed.
    pub fn new(seed: u64) -> Self {
        Self {
            key: [seed as u32, (seed >> 32) as u32],
        }
    }

    /// The four words of draw `index` by `who` at time `when` for purpose `purpose`.
    pub fn words(self, purpose: u32, when: u32, who: u32, index: u32) -> [u32; 4] {
        philox([index, who, when, purpose], self.key)
    }

    /// The words of draw `index` by each of `N` who follow one another from `first` on. The same as one by one, in a
    /// loop that compilers turn into lanes.
    #[inline(always)]
    pub fn words_of<const N: usize>(self, purpose: u32, when: u32, first: u32, index: u32) -> [[u32; N]; 4] {
        let mut words = [[0; N]; 4];
        for lane in 0..N {
            let four = philox([index, first.wrapping_add(lane as u32), when, purpose], self.key);
            for (plane, word) in words.iter_mut().zip(four) {
                plane[lane] = word;
            }
        }
        words
    }

    /// The two words of the key.
    pub fn key(self) -> [u32; 2] {
        self.key
    }

    /// A number in `[0, 1)` with 24 random bits, exact in `f32`.
    pub fn uniform(self, purpose: u32, when: u32, who: u32, index: u32) -> f64 {
        let words = self.words(purpose, when, who, index / 4);
        unit(words[index as usize % 4])
    }

    /// A whole number below `bound`, which is at least one.
    pub fn below(self, bound: usize, purpose: u32, when: u32, who: u32, index: u32) -> usize {
        let words = self.words(purpose, when, who, index / 4);
        ((u64::from(words[index as usize % 4]) * bound as u64) >> 32) as usize
    }

    /// A normal deviate of mean zero and variance one (Box and Muller, 1958).
    pub fn normal(self, purpose: u32, when: u32, who: u32, index: u32) -> f64 {
        let words = self.words(purpose, when, who, index / 2);
        let (a, b) = if index.is_multiple_of(2) {
            (words[0], words[1])
        } else {
            (words[2], words[3])
        };
        // One minus a number below one is never zero.
        let radius = (-2.0 * (1.0 - f64::from(a) * 2f64.powi(-32)).ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * unit(b)).cos()
    }
}

/// The upper 24 bits of a word as a number in `[0, 1)`, exact.
#[inline(always)]
pub fn unit_f32(word: u32) -> f32 {
    // As a signed number, which every lane converts.
    (word >> 8) as i32 as f32 * 5.960_464_5e-8
}

/// A whole number below `bound` from a word.
#[inline(always)]
pub fn below_u32(word: u32, bound: u32) -> u32 {
    ((u64::from(word) * u64::from(bound)) >> 32) as u32
}

/// The upper 24 bits of a word as a number in `[0, 1)`.
fn unit(word: u32) -> f64 {
    f64::from(word >> 8) * 2f64.powi(-24)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The known-answer vectors that come with the paper's reference implementation.
    #[test]
    fn known_answers() {
        assert_eq!(
            philox([0; 4], [0; 2]),
            [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]
        );
        assert_eq!(
            philox([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
    }

    #[test]
    fn lanes_draw_what_each_draws() {
        let random = Random::new(0x1234_5678_9abc_def0);
        let lanes = random.words_of::<64>(3, 7, u32::MAX - 10, 5);
        for lane in 0..64u32 {
            let one = random.words(3, 7, (u32::MAX - 10).wrapping_add(lane), 5);
            assert_eq!(lanes.map(|plane| plane[lane as usize]), one);
            assert_eq!(f64::from(unit_f32(one[0])), unit(one[0]));
            let (who, bound) = ((u32::MAX - 10).wrapping_add(lane), 1000);
            assert_eq!(
                below_u32(one[1], 1000) as usize,
                random.below(bound, 3, 7, who, 21)
            );
        }
    }

    /// Mean and variance within five standard errors (1/sqrt(12 n), and about 1/sqrt(180 n) for the variance;
    /// 1/sqrt(n) and sqrt(2/n) for the normal).
    #[test]
    fn moments() {
        let n = 200_000u32;
        let random = Random::new(7);
        let moments = |draw: &dyn Fn(u32) -> f64| {
            let mean = (0..n).map(draw).sum::<f64>() / f64::from(n);
            let variance = (0..n).map(|i| (draw(i) - mean).powi(2)).sum::<f64>() / f64::from(n);
            (mean, variance)
        };
        let root = f64::from(n).sqrt();
        let (mean, variance) = moments(&|i| random.uniform(1, 2, i / 8, i % 8));
        assert!(
            (mean - 0.5).abs() < 5.0 / (12f64.sqrt() * root)
                && (variance - 1.0 / 12.0).abs() < 5.0 / (180f64.sqrt() * root)
        );
        let (mean, variance) = moments(&|i| random.normal(1, 2, i / 8, i % 8));
        assert!(mean.abs() < 5.0 / root && (variance - 1.0).abs() < 5.0 * 2f64.sqrt() / root);
    }
}
