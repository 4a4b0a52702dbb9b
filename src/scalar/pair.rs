//! Two packs side by side: their instructions alternate, so that one pack's work fills the time in which the
//! other waits for a result. Polynomials are long chains of dependent operations, and a processor looks only so
//! far ahead for something else to do.

use super::Real;
use super::elementary::{self, SinglePrecision};
use super::lanes::Lanes;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Two packs of lanes as one.
#[derive(Clone, Copy, Debug)]
pub struct Pair<L>(L, L);

/// The truths of both packs.
#[derive(Clone, Copy, Debug)]
pub struct PairMask<M>(M, M);

macro_rules! pair_operator {
    ($trait:ident, $method:ident) => {
        impl<L: Lanes> $trait for Pair<L> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0), self.1.$method(other.1))
            }
        }
    };
}
pair_operator!(Add, add);
pair_operator!(Sub, sub);
pair_operator!(Mul, mul);
pair_operator!(Div, div);

impl<L: Lanes> Neg for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<M: BitAnd<Output = M>> BitAnd for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0, self.1 & other.1)
    }
}

impl<M: BitOr<Output = M>> BitOr for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0, self.1 | other.1)
    }
}

impl<M: Not<Output = M>> Not for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0, !self.1)
    }
}

impl<L: Lanes> Real for Pair<L> {
    type Mask = PairMask<L::Mask>;
    type Storage = f32;

    #[inline(always)]
    fn lit(x: f64) -> Self {
        Self(L::lit(x), L::lit(x))
    }
    #[inline(always)]
    fn load(x: f32) -> Self {
        Self(L::load(x), L::load(x))
    }
    #[inline(always)]
    fn store(x: f64) -> f32 {
        x as f32
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }
    elementary::single_precision_functions!();
    #[inline(always)]
    fn less_than(self, other: Self) -> Self::Mask {
        PairMask(self.0.less_than(other.0), self.1.less_than(other.1))
    }
    #[inline(always)]
    fn splat_mask(truth: bool) -> Self::Mask {
        PairMask(L::splat_mask(truth), L::splat_mask(truth))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self {
        Self(
            L::select(mask.0, if_true.0, if_false.0),
            L::select(mask.1, if_true.1, if_false.1),
        )
    }
}

impl<L: Lanes> SinglePrecision for Pair<L> {
    #[inline(always)]
    fn floor(self) -> Self {
        Self(self.0.floor(), self.1.floor())
    }
    #[inline(always)]
    fn two_to_the(self) -> Self {
        Self(self.0.two_to_the(), self.1.two_to_the())
    }
}

impl<L: Lanes> Lanes for Pair<L> {
    const LANES: usize = 2 * L::LANES;

    #[inline(always)]
    fn from_fn(mut f: impl FnMut(usize) -> f32) -> Self {
        Self(L::from_fn(&mut f), L::from_fn(|i| f(L::LANES + i)))
    }
    #[inline(always)]
    fn write(self, out: &mut [f32]) {
        self.0.write(out);
        self.1.write(&mut out[L::LANES..]);
    }
    #[inline(always)]
    fn mask_bits(mask: Self::Mask) -> u32 {
        L::mask_bits(mask.0) | (L::mask_bits(mask.1) << L::LANES)
    }
}
