//! Two scalars (or packs of lanes) as one: the wheels of an axle, whose instructions then alternate. Each wheel's are
//! long chains of operations that wait for each other, and a processor looks only so far ahead for something else to
//! do.

#![deny(clippy::disallowed_methods)]

use super::Real;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Two scalars as one: every operation is done for both. Also the truths of both.
#[derive(Clone, Copy, Debug)]
pub struct Pair<R>(pub R, pub R);

macro_rules! operators {
    ($($trait:ident $method:ident),*) => {$(
        impl<R: $trait<Output = R>> $trait for Pair<R> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0), self.1.$method(other.1))
            }
        }
    )*};
}
operators!(Add add, Sub sub, Mul mul, Div div, BitAnd bitand, BitOr bitor);

impl<R: Neg<Output = R>> Neg for Pair<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<R: Not<Output = R>> Not for Pair<R> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0, !self.1)
    }
}

// Loops and not the library's functions of arrays: for those lanes would leave their instruction set.

/// The first and the second scalars of pairs.
#[inline(always)]
fn halves<R: Real, const N: usize>(x: [Pair<R>; N]) -> [[R; N]; 2] {
    let mut halves = [[R::lit(0.0); N]; 2];
    for i in 0..N {
        (halves[0][i], halves[1][i]) = (x[i].0, x[i].1);
    }
    halves
}

/// Pairs of the first and the second scalars.
#[inline(always)]
fn join<R: Real, const N: usize>(first: [R; N], second: [R; N]) -> [Pair<R>; N] {
    let mut pairs = [Pair::lit(0.0); N];
    for i in 0..N {
        pairs[i] = Pair(first[i], second[i]);
    }
    pairs
}

impl<R: Real> Real for Pair<R> {
    type Mask = Pair<R::Mask>;
    type Storage = R::Storage;

    #[inline(always)]
    fn lit(x: f64) -> Self {
        Self(R::lit(x), R::lit(x))
    }
    #[inline(always)]
    fn load(x: R::Storage) -> Self {
        Self(R::load(x), R::load(x))
    }
    #[inline(always)]
    fn store(x: f64) -> R::Storage {
        R::store(x)
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
    fn sin(self) -> Self {
        Self(self.0.sin(), self.1.sin())
    }
    #[inline(always)]
    fn cos(self) -> Self {
        Self(self.0.cos(), self.1.cos())
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Self(self.0.exp(), self.1.exp())
    }
    #[inline(always)]
    fn tan(self) -> Self {
        let [a, b] = R::tan_each([self.0, self.1]);
        Self(a, b)
    }
    #[inline(always)]
    fn atan(self) -> Self {
        let [a, b] = R::atan_each([self.0, self.1]);
        Self(a, b)
    }
    #[inline(always)]
    fn sin_pi(self) -> Self {
        let [a, b] = R::sin_pi_each([self.0, self.1]);
        Self(a, b)
    }
    #[inline(always)]
    fn cos_pi(self) -> Self {
        let [a, b] = R::cos_pi_each([self.0, self.1]);
        Self(a, b)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }
    #[inline(always)]
    fn less_than(self, other: Self) -> Self::Mask {
        Pair(self.0.less_than(other.0), self.1.less_than(other.1))
    }
    #[inline(always)]
    fn splat_mask(truth: bool) -> Self::Mask {
        Pair(R::splat_mask(truth), R::splat_mask(truth))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self {
        Self(
            R::select(mask.0, if_true.0, if_false.0),
            R::select(mask.1, if_true.1, if_false.1),
        )
    }
    #[inline(always)]
    fn tan_each<const N: usize>(x: [Self; N]) -> [Self; N] {
        let [first, second] = halves(x);
        join(R::tan_each(first), R::tan_each(second))
    }
    #[inline(always)]
    fn atan_each<const N: usize>(x: [Self; N]) -> [Self; N] {
        let [first, second] = halves(x);
        join(R::atan_each(first), R::atan_each(second))
    }
    #[inline(always)]
    fn sin_pi_each<const N: usize>(x: [Self; N]) -> [Self; N] {
        let [first, second] = halves(x);
        join(R::sin_pi_each(first), R::sin_pi_each(second))
    }
    #[inline(always)]
    fn cos_pi_each<const N: usize>(x: [Self; N]) -> [Self; N] {
        let [first, second] = halves(x);
        join(R::cos_pi_each(first), R::cos_pi_each(second))
    }
}
