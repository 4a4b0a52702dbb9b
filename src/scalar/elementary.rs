//! Our own `sin`, `cos`, `tan`, `atan` and `exp` in single precision, twin of `shaders/elementary.wgsl`.
//!
//! WGSL promises only 2^-11 absolute for `sin` and `cos` and 4096 ULP for `atan`, so the kernels bring their
//! own polynomials. They are written here over [`SinglePrecision`], so that a lone `f32` and every lane type
//! round alike, and with the same operations in the same order as in WGSL.
//!
//! The coefficients minimise the largest relative error (Remez exchange) over the reduced range; that error,
//! before rounding, is stated at each function. None uses fused multiply-add: a driver may, Rust does not.

use super::Real;

/// What the elementary functions need beyond [`Real`], of a single-precision scalar.
pub trait SinglePrecision: Real {
    /// The largest whole number not above `self`.
    fn floor(self) -> Self;
    /// `2^self` for a whole number from -126 to 127.
    fn two_to_the(self) -> Self;
}

/// Pi in two parts (after Cody and Waite, *Software Manual for the Elementary Functions*, 1980). The first has
/// so few bits that its product with a multiple of one half below 2^14 is exact; the product with the second is
/// rounded by 6e-11 per half turn.
const PI_HIGH: f64 = 3.140625;
const PI_LOW: f64 = 9.676_535_897_932_385e-4;

/// `sin r` for `r` within a quarter turn either side of nought; relative error 5.3e-9.
#[inline(always)]
fn sine_polynomial<R: SinglePrecision>(r: R) -> R {
    let t = r * r;
    let low = R::lit(-0.166_666_57) + R::lit(8.333_025e-3) * t;
    let high = R::lit(-1.980_735_1e-4) + R::lit(2.601_749_7e-6) * t;
    let p = low + high * (t * t);
    r + r * t * p
}

/// `cos r` for `r` within a quarter turn either side of nought; relative error of its departure from one 8e-10.
#[inline(always)]
fn cosine_polynomial<R: SinglePrecision>(r: R) -> R {
    let t = r * r;
    let p = R::lit(-2.628_412_4e-7);
    let p = p * t + R::lit(2.477_392_3e-5);
    let p = p * t + R::lit(-1.388_864_1e-3);
    let p = p * t + R::lit(4.166_666e-2);
    let p = p * t + R::lit(-0.5);
    R::lit(1.0) + t * p
}

/// `x - half_turns * pi`, to within an ULP of a quarter turn for a thousand half turns.
#[inline(always)]
fn reduce<R: SinglePrecision>(x: R, half_turns: R) -> R {
    (x - half_turns * R::lit(PI_HIGH)) - half_turns * R::lit(PI_LOW)
}

/// Plus one for an even whole number, minus one for an odd one.
#[inline(always)]
fn parity_sign<R: SinglePrecision>(n: R) -> R {
    let half = n * R::lit(0.5);
    R::lit(1.0) - (half - half.floor()) * R::lit(4.0)
}

/// Sine of an angle in radians.
#[inline(always)]
pub fn sin<R: SinglePrecision>(x: R) -> R {
    let n = (x * R::lit(std::f64::consts::FRAC_1_PI) + R::lit(0.5)).floor();
    parity_sign(n) * sine_polynomial(reduce(x, n))
}

/// Cosine of an angle in radians.
#[inline(always)]
pub fn cos<R: SinglePrecision>(x: R) -> R {
    let n = (x * R::lit(std::f64::consts::FRAC_1_PI)).floor();
    -(parity_sign(n) * sine_polynomial(reduce(x, n + R::lit(0.5))))
}

/// Tangent of an angle in radians; towards its poles the relative error grows as one over the cosine.
#[inline(always)]
pub fn tan<R: SinglePrecision>(x: R) -> R {
    let n = (x * R::lit(std::f64::consts::FRAC_1_PI) + R::lit(0.5)).floor();
    let r = reduce(x, n);
    sine_polynomial(r) / cosine_polynomial(r)
}

/// Inverse tangent, radians. One division folds `|x| > 1` onto the polynomial's range; relative error 1.5e-8.
#[inline(always)]
pub fn atan<R: SinglePrecision>(x: R) -> R {
    let size = x.abs();
    let one = R::lit(1.0);
    let large = one.less_than(size);
    let q = R::select(large, one, size) / R::select(large, size, one);
    let t = q * q;
    // In Estrin's order: half as long a chain of dependent operations as Horner's.
    let t2 = t * t;
    let t4 = t2 * t2;
    let p01 = R::lit(-0.333_330_72) + R::lit(0.199_926_2) * t;
    let p23 = R::lit(-0.142_036_44) + R::lit(0.106_409_34) * t;
    let p45 = R::lit(-7.504_295e-2) + R::lit(4.269_152_5e-2) * t;
    let p67 = R::lit(-1.606_863_4e-2) + R::lit(2.849_890_6e-3) * t;
    let p = (p01 + p23 * t2) + (p45 + p67 * t2) * t4;
    let angle = q + q * t * p;
    let folded = R::select(large, R::lit(std::f64::consts::FRAC_PI_2) - angle, angle);
    R::select(x.less_than(R::lit(0.0)), -folded, folded)
}

/// Natural exponential, saturating at `e^-87` and `e^88`; relative error 1.9e-9.
#[inline(always)]
pub fn exp<R: SinglePrecision>(x: R) -> R {
    let x = x.max(R::lit(-87.0)).min(R::lit(88.0));
    let n = (x * R::lit(std::f64::consts::LOG2_E) + R::lit(0.5)).floor();
    // ln 2 in two parts, the first with few enough bits for an exact product.
    let r = (x - n * R::lit(0.693_359_375)) - n * R::lit(-2.121_944_4e-4);
    let p = R::lit(1.383_683_9e-3);
    let p = p * r + R::lit(8.374_822e-3);
    let p = p * r + R::lit(4.166_822_5e-2);
    let p = p * r + R::lit(0.166_664_2);
    let p = p * r + R::lit(0.499_999_9);
    // Grouped so that the product is added last: shader compilers regroup to that, ready for a fused operation.
    (r * r * p + (r + R::lit(1.0))) * n.two_to_the()
}

/// The five functions as methods of an `impl Real` block, by delegation to this module.
macro_rules! single_precision_functions {
    () => {
        #[inline(always)]
        fn sin(self) -> Self {
            $crate::scalar::elementary::sin(self)
        }
        #[inline(always)]
        fn cos(self) -> Self {
            $crate::scalar::elementary::cos(self)
        }
        #[inline(always)]
        fn tan(self) -> Self {
            $crate::scalar::elementary::tan(self)
        }
        #[inline(always)]
        fn atan(self) -> Self {
            $crate::scalar::elementary::atan(self)
        }
        #[inline(always)]
        fn exp(self) -> Self {
            $crate::scalar::elementary::exp(self)
        }
    };
}
pub(crate) use single_precision_functions;

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error of `f` against `reference`, in units of the spacing of f32 at the reference value
    /// (floored at the spacing at `floor`, for functions that cross zero between representable arguments).
    fn largest_ulp(
        range: (f64, f64),
        floor: f64,
        f: impl Fn(f32) -> f32,
        reference: impl Fn(f64) -> f64,
    ) -> f64 {
        let n = 1_000_000;
        (0..=n)
            .map(|i| (range.0 + (range.1 - range.0) * f64::from(i) / f64::from(n)) as f32)
            .map(|x| {
                let exact = reference(f64::from(x));
                let spacing = (exact.abs().max(floor)).log2().floor().exp2() * 2f64.powi(-23);
                (f64::from(f(x)) - exact).abs() / spacing
            })
            .fold(0.0, f64::max)
    }

    // Each bound is the sum of the roundings of the last operations (about 1 ULP for the final sum, half for
    // each factor, one for the reduced argument) plus the polynomial's own error, rounded up. The reduction's
    // own error, 13 half turns times 6e-11, is under one spacing of f32 at 1e-2: the floor for sin and cos.
    #[test]
    fn elementary_functions_stay_within_a_few_ulp_of_f64() {
        assert!(largest_ulp((-40.0, 40.0), 1e-2, sin, f64::sin) < 3.0);
        assert!(largest_ulp((-40.0, 40.0), 1e-2, cos, f64::cos) < 3.0);
        // Two polynomials and a division.
        assert!(largest_ulp((-1.2, 1.2), 1e-4, tan, f64::tan) < 4.0);
        assert!(largest_ulp((-50.0, 50.0), 1e-30, atan, f64::atan) < 3.0);
        assert!(largest_ulp((-1.0, 1.0), 1e-30, atan, f64::atan) < 3.0);
        assert!(largest_ulp((-20.0, 20.0), 1e-30, exp, f64::exp) < 2.5);
    }

    #[test]
    fn special_arguments() {
        assert_eq!(atan(f32::INFINITY), std::f32::consts::FRAC_PI_2);
        assert_eq!(atan(-0.0f32), 0.0);
        assert_eq!(sin(0.0f32), 0.0);
        assert_eq!(cos(0.0f32), 1.0);
        assert_eq!(exp(0.0f32), 1.0);
        assert!(exp(1e6f32).is_finite() && exp(-1e6f32) > 0.0);
    }
}
