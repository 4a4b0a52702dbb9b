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
}

impl Real for f32 {
    plain_arithmetic!(f32);
    elementary::single_precision_functions!();
}

impl SinglePrecision for f32 {
    #[inline(always)]
    fn floor(self) -> Self {
        self.floor()
    }
    #[inline(always)]
    fn two_to_the(self) -> Self {
        f32::from_bits((((self as i32) + 127) << 23) as u32)
    }
}
