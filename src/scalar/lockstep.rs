//! The same function of several arguments at once, their instructions alternating: polynomials are long chains of
//! dependent operations, and a processor looks only so far ahead for something to do while it waits for a result.
//!
//! Operations are loops and not the library's functions of arrays, which are not always inlined: lanes would leave their instruction
//! set for them.

#![deny(clippy::disallowed_methods)]

use super::Real;
use super::elementary::{self, SinglePrecision};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Several scalars (or packs of lanes) as one scalar: every operation is done for each in turn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lockstep<R, const N: usize>(pub(super) [R; N]);

macro_rules! operators {
    ($type:ident, $($trait:ident $method:ident),*) => {$(
        impl<R: $trait<Output = R> + Copy, const N: usize> $trait for $type<R, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for i in 0..N {
                    self.0[i] = self.0[i].$method(other.0[i]);
                }
                self
            }
        }
    )*};
}
operators!(Lockstep, Add add, Sub sub, Mul mul, Div div, BitAnd bitand, BitOr bitor);

impl<R: Neg<Output = R> + Copy, const N: usize> Neg for Lockstep<R, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        for i in 0..N {
            self.0[i] = -self.0[i];
        }
        self
    }
}

impl<R: Not<Output = R> + Copy, const N: usize> Not for Lockstep<R, N> {
    type Output = Self;
    #[inline(always)]
    fn not(mut self) -> Self {
        for i in 0..N {
            self.0[i] = !self.0[i];
        }
        self
    }
}

impl<R: SinglePrecision, const N: usize> Real for Lockstep<R, N> {
    type Mask = Lockstep<R::Mask, N>;
    type Storage = R::Storage;

    #[inline(always)]
    fn lit(x: f64) -> Self {
        Self([R::lit(x); N])
    }
    #[inline(always)]
    fn load(x: R::Storage) -> Self {
        Self([R::load(x); N])
    }
    #[inline(always)]
    fn store(x: f64) -> R::Storage {
        R::store(x)
    }
    #[inline(always)]
    fn sqrt(mut self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].sqrt();
        }
        self
    }
    #[inline(always)]
    fn abs(mut self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].abs();
        }
        self
    }
    #[inline(always)]
    fn min(mut self, other: Self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].min(other.0[i]);
        }
        self
    }
    #[inline(always)]
    fn max(mut self, other: Self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].max(other.0[i]);
        }
        self
    }
    elementary::single_precision_functions!();
    #[inline(always)]
    fn less_than(self, other: Self) -> Self::Mask {
        let mut mask = Self::splat_mask(false);
        for i in 0..N {
            mask.0[i] = self.0[i].less_than(other.0[i]);
        }
        mask
    }
    #[inline(always)]
    fn splat_mask(truth: bool) -> Self::Mask {
        Lockstep([R::splat_mask(truth); N])
    }
    #[inline(always)]
    fn select(mask: Self::Mask, mut if_true: Self, if_false: Self) -> Self {
        for i in 0..N {
            if_true.0[i] = R::select(mask.0[i], if_true.0[i], if_false.0[i]);
        }
        if_true
    }
}

impl<R: SinglePrecision, const N: usize> SinglePrecision for Lockstep<R, N> {
    #[inline(always)]
    fn round(mut self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].round();
        }
        self
    }
    #[inline(always)]
    fn negate_where_odd(mut self, n: Self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].negate_where_odd(n.0[i]);
        }
        self
    }
    #[inline(always)]
    fn with_sign_of(mut self, other: Self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].with_sign_of(other.0[i]);
        }
        self
    }
    #[inline(always)]
    fn two_to_the(mut self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].two_to_the();
        }
        self
    }
    #[inline(always)]
    fn tie(self, other: Self) -> (Self, Self) {
        (self, other)
    }
    #[inline(always)]
    fn abreast(mut self) -> Self {
        for i in 1..N {
            (self.0[i - 1], self.0[i]) = self.0[i - 1].tie(self.0[i]);
        }
        self
    }
}
