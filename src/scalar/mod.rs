//! The scalars that the physics is written over.
//!
//! Every equation of [`crate::vehicle`] is generic over [`Real`], so the same lines run in `f64` (the
//! reference), in `f32` and `f32` lanes (the SIMD backend, twin of the WGSL kernels) and in dual numbers
//! (exact derivatives).

mod bisection;
mod counted;
mod dual;
pub mod elementary;
mod float;
pub mod lanes;
mod lockstep;
mod lookup;
mod pair;

pub use bisection::{bisected, try_bisected};
pub use counted::{Counted, operations_of};
pub use dual::{Dual, GRADIENT};
pub use lookup::Lookup;
pub use pair::Pair;

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// A part of a kernel. Implementations are `#[inline(always)]`, so that they are compiled for the instruction set of the function that
/// they stand in.
pub trait Part {
    /// What it yields.
    type Output;

    /// Does it.
    fn run(self) -> Self::Output;
}

/// A real number, or a pack of them, that the physics can be evaluated in.
///
/// Comparisons yield a [`Real::Mask`] and choices are made by [`Real::select`], never by a branch, because a
/// pack of lanes takes both sides. Angles are in radians except where a name ends in `pi`.
pub trait Real:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The truth values of a comparison, one per lane.
    type Mask: Copy + BitAnd<Output = Self::Mask> + BitOr<Output = Self::Mask> + Not<Output = Self::Mask>;
    /// The plain float that tables shared by all lanes are stored in.
    type Storage: Copy + Debug + Send + Sync + 'static;

    /// The constant `x`, rounded to this scalar's precision, in every lane.
    fn lit(x: f64) -> Self;
    /// A table value, in every lane.
    fn load(x: Self::Storage) -> Self;
    /// `x` rounded to the precision of [`Real::Storage`].
    fn store(x: f64) -> Self::Storage;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// The smaller of the two.
    fn min(self, other: Self) -> Self;
    /// The larger of the two.
    fn max(self, other: Self) -> Self;
    /// Sine of an angle in radians.
    fn sin(self) -> Self;
    /// Cosine of an angle in radians.
    fn cos(self) -> Self;
    /// Tangent of an angle in radians.
    fn tan(self) -> Self;
    /// Inverse tangent, radians.
    fn atan(self) -> Self;
    /// Natural exponential.
    fn exp(self) -> Self;
    /// Sine of an angle in half turns: `sin(pi self)`.
    fn sin_pi(self) -> Self;
    /// Cosine of an angle in half turns: `cos(pi self)`.
    fn cos_pi(self) -> Self;
    /// Where `self < other`; false for NaN.
    fn less_than(self, other: Self) -> Self::Mask;
    /// The same truth in every lane.
    fn splat_mask(truth: bool) -> Self::Mask;
    /// `if_true` where the mask holds, else `if_false`.
    fn select(mask: Self::Mask, if_true: Self, if_false: Self) -> Self;

    /// Does a part of a kernel in a function of its own, which has the instruction set of the scalar. All else of a kernel becomes one
    /// function, and the time that a compiler takes grows faster than a function's length.
    #[inline(never)]
    fn apart<P: Part>(part: P) -> P::Output {
        part.run()
    }

    /// Minus one below zero, else plus one: `sgn(0) = +1`, as the Magic Formula wants.
    #[inline(always)]
    fn sign(self) -> Self {
        Self::select(self.less_than(Self::lit(0.0)), Self::lit(-1.0), Self::lit(1.0))
    }

    /// The secant `1 / cos(atan self)`, by the identity `sqrt(1 + x^2)` instead of two transcendentals.
    #[inline(always)]
    fn sec_atan(self) -> Self {
        (Self::lit(1.0) + self * self).sqrt()
    }

    /// Tangents of several, which lanes work out side by side.
    #[inline(always)]
    fn tan_each<const N: usize>(x: [Self; N]) -> [Self; N] {
        x.map(Self::tan)
    }

    /// Inverse tangents of several, which lanes work out side by side.
    #[inline(always)]
    fn atan_each<const N: usize>(x: [Self; N]) -> [Self; N] {
        x.map(Self::atan)
    }

    /// Sines, in half turns of several, which lanes work out side by side.
    #[inline(always)]
    fn sin_pi_each<const N: usize>(x: [Self; N]) -> [Self; N] {
        x.map(Self::sin_pi)
    }

    /// Cosines, in half turns of several, which lanes work out side by side.
    #[inline(always)]
    fn cos_pi_each<const N: usize>(x: [Self; N]) -> [Self; N] {
        x.map(Self::cos_pi)
    }
}
