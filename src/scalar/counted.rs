//! A single-precision scalar that counts what it does, to say how much arithmetic a kernel asks of a processor.

use super::elementary::{self, SinglePrecision};
use super::{Lookup, Real};
use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

thread_local! {
    static OPERATIONS: Cell<u64> = const { Cell::new(0) };
}

/// Arithmetic operations of `work` in [`Counted`] numbers on this thread: sums, differences, products, quotients, roots,
/// the smaller and the larger of two, roundings to whole numbers and powers of two, one each. Changes of sign,
/// comparisons, choices and loads are free, as they mostly run beside the arithmetic.
pub fn operations_of(work: impl FnOnce()) -> u64 {
    let before = OPERATIONS.get();
    work();
    OPERATIONS.get() - before
}

/// An `f32` that counts its operations. See [`operations_of`].
#[derive(Clone, Copy, Debug)]
pub struct Counted(pub f32);

fn counted(x: f32) -> Counted {
    OPERATIONS.set(OPERATIONS.get() + 1);
    Counted(x)
}

impl Add for Counted {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        counted(self.0 + other.0)
    }
}
impl Sub for Counted {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        counted(self.0 - other.0)
    }
}
impl Mul for Counted {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        counted(self.0 * other.0)
    }
}
impl Div for Counted {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        counted(self.0 / other.0)
    }
}
impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Real for Counted {
    type Mask = bool;
    type Storage = f32;

    fn lit(x: f64) -> Self {
        Self(x as f32)
    }
    fn load(x: f32) -> Self {
        Self(x)
    }
    fn store(x: f64) -> f32 {
        x as f32
    }
    fn sqrt(self) -> Self {
        counted(self.0.sqrt())
    }
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    fn min(self, other: Self) -> Self {
        counted(Real::min(self.0, other.0))
    }
    fn max(self, other: Self) -> Self {
        counted(Real::max(self.0, other.0))
    }
    fn less_than(self, other: Self) -> bool {
        self.0 < other.0
    }
    fn splat_mask(truth: bool) -> bool {
        truth
    }
    fn select(mask: bool, if_true: Self, if_false: Self) -> Self {
        if mask { if_true } else { if_false }
    }
    elementary::single_precision_functions!();
}

impl SinglePrecision for Counted {
    fn round(self) -> Self {
        counted(SinglePrecision::round(self.0))
    }
    fn negate_where_odd(self, n: Self) -> Self {
        Self(self.0.negate_where_odd(n.0))
    }
    fn with_sign_of(self, other: Self) -> Self {
        Self(self.0.with_sign_of(other.0))
    }
    fn two_to_the(self) -> Self {
        counted(self.0.two_to_the())
    }
}

impl Lookup for Counted {
    type Place = usize;

    fn place(self, rows: usize, width: usize) -> (usize, Self) {
        let (place, beyond) = Lookup::place(self.0, rows, width);
        // Held at either end, the row's number taken off.
        OPERATIONS.set(OPERATIONS.get() + 3);
        (place, Self(beyond))
    }
    #[inline(always)]
    fn whole(self, most: usize) -> Self {
        Self(self.0.whole(most))
    }
    fn pick(table: &[f32], place: usize, column: usize) -> Self {
        Self(f32::pick(table, place, column))
    }
    fn all(mask: bool) -> bool {
        mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_are_counted_one_by_one() {
        let x = Counted(0.3);
        let count = |work: fn(Counted) -> Counted| {
            operations_of(|| {
                work(x);
            })
        };
        assert_eq!(count(|x| x * x + x / x), 3);
        assert_eq!(count(|x| -x), 0);
        // The reduction by half turns takes six, the polynomial nine and its argument's square one.
        let sine = count(Real::sin);
        assert!((14..20).contains(&sine), "{sine}");
        let bits = Real::sin(x).0.to_bits();
        assert_eq!(bits, Real::sin(0.3f32).to_bits());
    }
}
