//! `f64` with the standard library's functions, `f32` with our own (the twin of the GPU).

use super::Real;
use super::elementary::{self, SinglePrecision};

macro_rules! plain_arithmetic {
    ($float:ty) => {
        type Mask = bool;
        type Storage = $float;

        #[inline(always)]
        fn lit(x: f64) -> Self {
            x as $float
        }
        #[inline(always)]
        fn load(x: $float) -> Self {
            x
        }
        #[inline(always)]
        fn store(x: f64) -> $float {
            x as $float
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            self.sqrt()
        }
        #[inline(always)]
        fn abs(self) -> Self {
            self.abs()
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            if self < other { self } else { other }
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            if self > other { self } else { other }
        }
        #[inline(always)]
        fn less_than(self, other: Self) -> bool {
            self < other
        }
        #[inline(always)]
        fn splat_mask(truth: bool) -> bool {
            truth
        }
        #[inline(always)]
        fn select(mask: bool, if_true: Self, if_false: Self) -> Self {
            if mask { if_true } else { if_false }
        }
    };
}

impl Real for f64 {
    plain_arithmetic!(f64);

    #[inline(always)]
    fn sin(self) -> Self {
        self.sin()
    }
    #[inline(always)]
    fn cos(self) -> Self {
        self.cos()
    }
    #[inline(always)]
    fn tan(self) -> Self {
        self.tan()
    }
    #[inline(always)]
    fn atan(self) -> Self {
        self.atan()
    }
    #[inline(always)]
    fn exp(self) -> Self {
        self.exp()
    }
    #[inline(always)]
    fn sin_pi(self) -> Self {
        (std::f64::consts::PI * self).sin()
    }
    #[inline(always)]
    fn cos_pi(self) -> Self {
        (std::f64::consts::PI * self).cos()
    }
}

impl Real for f32 {
    plain_arithmetic!(f32);
    elementary::single_precision_functions!();
    elementary::lockstep_functions!();
}

/// 1.5 * 2^23: added to a whole number below 2^22 it leaves that number in the low bits of the mantissa, and
/// added to any number of that size it rounds it to a whole one. Baselines without instructions for that would
/// call a library instead.
const WHOLE: f32 = 12_582_912.0;

impl SinglePrecision for f32 {
    #[inline(always)]
    fn round(self) -> Self {
        (self + WHOLE) - WHOLE
    }
    #[inline(always)]
    fn negate_where_odd(self, n: Self) -> Self {
        f32::from_bits(self.to_bits() ^ ((n + WHOLE).to_bits() << 31))
    }
    #[inline(always)]
    fn with_sign_of(self, other: Self) -> Self {
        self.copysign(other)
    }
    #[inline(always)]
    fn two_to_the(self) -> Self {
        // The exponent's bias added; the shift then leaves only exponent bits.
        f32::from_bits((self + (WHOLE + 127.0)).to_bits() << 23)
    }
}
