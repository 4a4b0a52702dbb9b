//! Forward-mode dual numbers: a value with its derivatives to `N` parameters, exact to rounding.
//!
//! The derivatives are a plain array, so that a loop over them becomes vector instructions of whatever instruction set the surrounding
//! function was compiled for ([`Real::apart`]). A library type behind `Option`, without forced inlining, does not.

use super::{Part, Real};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Derivatives of a dual number where nothing else is said: as many doubles as the widest register holds. It is one number for all
/// uses, so that the car's equations are compiled for duals once.
pub const GRADIENT: usize = 8;

/// A value and its gradient to `N` parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize = GRADIENT> {
    /// The value.
    pub value: f64,
    /// The derivative to each parameter.
    pub gradient: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A constant: no derivative to anything.
    #[inline(always)]
    pub fn constant(value: f64) -> Self {
        Self {
            value,
            gradient: [0.0; N],
        }
    }

    /// The `index`-th parameter itself.
    #[inline(always)]
    pub fn variable(value: f64, index: usize) -> Self {
        let mut gradient = [0.0; N];
        gradient[index] = 1.0;
        Self { value, gradient }
    }

    /// The chain rule for a function of one argument with this value and derivative.
    #[inline(always)]
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self {
            value,
            gradient: std::array::from_fn(|i| derivative * self.gradient[i]),
        }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            gradient: std::array::from_fn(|i| self.gradient[i] + other.gradient[i]),
        }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            gradient: std::array::from_fn(|i| self.gradient[i] - other.gradient[i]),
        }
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[allow(clippy::suspicious_arithmetic_impl, reason = "the product rule is a sum")]
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            gradient: std::array::from_fn(|i| {
                self.gradient[i] * other.value + self.value * other.gradient[i]
            }),
        }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = 1.0 / other.value;
        let value = self.value * inverse;
        Self {
            value,
            gradient: std::array::from_fn(|i| (self.gradient[i] - value * other.gradient[i]) * inverse),
        }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> Real for Dual<N> {
    type Mask = bool;
    type Storage = f64;

    #[inline(always)]
    fn lit(x: f64) -> Self {
        Self::constant(x)
    }
    #[inline(always)]
    fn load(x: f64) -> Self {
        Self::constant(x)
    }
    #[inline(always)]
    fn store(x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        // At zero the slope is infinite; a zero there keeps 0 * inf out of the gradient.
        let slope = if root > 0.0 { 0.5 / root } else { 0.0 };
        self.chain(root, slope)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        if self.value < 0.0 { -self } else { self }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self.value < other.value { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self.value > other.value { self } else { other }
    }
    #[inline(always)]
    fn sin(self) -> Self {
        let (sin, cos) = self.value.sin_cos();
        self.chain(sin, cos)
    }
    #[inline(always)]
    fn cos(self) -> Self {
        let (sin, cos) = self.value.sin_cos();
        self.chain(cos, -sin)
    }
    #[inline(always)]
    fn tan(self) -> Self {
        let tan = self.value.tan();
        self.chain(tan, 1.0 + tan * tan)
    }
    #[inline(always)]
    fn atan(self) -> Self {
        self.chain(self.value.atan(), 1.0 / (1.0 + self.value * self.value))
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }
    #[inline(always)]
    fn sin_pi(self) -> Self {
        (Self::constant(std::f64::consts::PI) * self).sin()
    }
    #[inline(always)]
    fn cos_pi(self) -> Self {
        (Self::constant(std::f64::consts::PI) * self).cos()
    }
    #[inline(always)]
    fn less_than(self, other: Self) -> bool {
        self.value < other.value
    }
    #[inline(always)]
    fn splat_mask(truth: bool) -> bool {
        truth
    }
    #[inline(always)]
    fn select(mask: bool, if_true: Self, if_false: Self) -> Self {
        if mask { if_true } else { if_false }
    }
    /// With wider registers for gradients, where the processor has them.
    #[inline(always)]
    fn apart<P: Part>(part: P) -> P::Output {
        #[inline(never)]
        fn plain<P: Part>(part: P) -> P::Output {
            part.run()
        }
        #[cfg(target_arch = "x86_64")]
        {
            #[inline(never)]
            #[target_feature(enable = "avx2")]
            fn wide<P: Part>(part: P) -> P::Output {
                part.run()
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has the set, as just detected.
                return unsafe { wide(part) };
            }
        }
        plain(part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn composite<R: Real>(x: R, y: R) -> R {
        let ratio = (x * y + x.exp()) / (R::lit(2.0) + y.abs().sqrt());
        ratio.atan().sin() + (x - y).cos() / x.min(y).sec_atan() - y.max(x)
    }

    #[test]
    fn gradient_agrees_with_central_differences() {
        let step = 1e-6;
        for (x, y) in [(0.3, -1.2), (1.7, 0.4), (-0.8, 2.2)] {
            let dual = composite(Dual::<2>::variable(x, 0), Dual::variable(y, 1));
            let dx = (composite(x + step, y) - composite(x - step, y)) / (2.0 * step);
            let dy = (composite(x, y + step) - composite(x, y - step)) / (2.0 * step);
            // A dual divides by multiplying with the inverse: one rounding more.
            assert!((dual.value - composite(x, y)).abs() < 1e-15);
            // Central differences: truncation step^2, cancellation eps/step; both under 1e-9 here.
            assert!((dual.gradient[0] - dx).abs() < 2e-9 && (dual.gradient[1] - dy).abs() < 2e-9);
        }
    }
}
