//! Our own `sin`, `cos`, `tan`, `atan` and `exp` in single precision, twin of `shaders/elementary.wgsl`.
//!
//! WGSL promises only 2^-11 absolute for `sin` and `cos` and 4096 ULP for `atan`, so the kernels bring their
//! own polynomials. They are written here over [`SinglePrecision`], so that a lone `f32` and every lane type
//! round alike, and with the same operations in the same order as in WGSL.
//!
//! The coefficients minimise the largest relative error (Remez exchange) over the reduced range; that error,
//! before rounding, is stated at each function. None uses fused multiply-add: a driver may, Rust does not.
//! The longest polynomials are split by powers of the square (after Estrin, *Organization of computer systems*, 1960), which
//! shortens the chain of operations that wait for each other; their last step, which rounds most, is Horner's.

use super::Real;

/// What the elementary functions need beyond [`Real`], of a single-precision scalar.
pub trait SinglePrecision: Real {
    /// The nearest whole number, halves to the even one; of magnitudes below 2^22.
    fn round(self) -> Self;
    /// `-self` where the whole number `n` is odd, else `self`; of magnitudes of `n` below 2^22.
    fn negate_where_odd(self, n: Self) -> Self;
    /// The magnitude of `self` with the sign bit of `other`.
    fn with_sign_of(self, other: Self) -> Self;
    /// The same two, of which the compiler may use neither before it has both.
    #[inline(always)]
    fn tie(self, other: Self) -> (Self, Self) {
        (self, other)
    }
    /// The same, but tied together where it is several: left alone, the compiler puts the instructions of one chain
    /// behind those of another again, to save registers.
    #[inline(always)]
    fn abreast(self) -> Self {
        self
    }
    /// `2^self` for a whole number from -126 to 127.
    fn two_to_the(self) -> Self;
}

/// Pi in two parts (after Cody and Waite, *Software Manual for the Elementary Functions*, 1980). The first has
/// so few bits that its product with a multiple of one half below 2^14 is exact; the product with the second is
/// rounded by 6e-11 per half turn.
const PI_HIGH: f64 = 3.140625;
const PI_LOW: f64 = 9.676_535_897_932_385e-4;

/// `sin r` for `r` within a quarter turn either side of zero; relative error 6.2e-9.
#[inline(always)]
fn sine_polynomial<R: SinglePrecision>(r: R) -> R {
    let t = r * r;
    let p = R::lit(2.606_095_7e-6);
    let p = (p * t + R::lit(-1.980_977_7e-4)).abreast();
    let p = (p * t + R::lit(8.333_069e-3)).abreast();
    let p = (p * t + R::lit(-0.166_666_6)).abreast();
    r + r * (p * t)
}

/// `cos r` for `r` within a quarter turn either side of zero; relative error of its departure from one 8e-10.
#[inline(always)]
fn cosine_polynomial<R: SinglePrecision>(r: R) -> R {
    let t = r * r;
    let p = R::lit(-2.628_412_4e-7);
    let p = (p * t + R::lit(2.477_392_3e-5)).abreast();
    let p = (p * t + R::lit(-1.388_864_1e-3)).abreast();
    let p = (p * t + R::lit(4.166_666e-2)).abreast();
    let p = (p * t + R::lit(-0.5)).abreast();
    R::lit(1.0) + t * p
}

/// `sin(pi r)` for `r` within one half either side of zero; relative error 2.9e-8, nearly all of it from the
/// rounding of pi.
#[inline(always)]
fn sine_pi_polynomial<R: SinglePrecision>(r: R) -> R {
    let t = r * r;
    let tt = (t * t).abreast();
    let high = (t * R::lit(7.983_576_5e-2) + R::lit(-0.599_437_36)).abreast();
    let p = (t * R::lit(2.550_269_8) + R::lit(-5.167_721)).abreast() + tt * high;
    r * (p.abreast() * t + R::lit(std::f64::consts::PI)).abreast()
}

/// `x - half_turns * pi`, to within an ULP of a quarter turn for a thousand half turns.
#[inline(always)]
fn reduce<R: SinglePrecision>(x: R, half_turns: R) -> R {
    (x - half_turns * R::lit(PI_HIGH)) - half_turns * R::lit(PI_LOW)
}

/// Sine of an angle in radians.
#[inline(always)]
pub fn sin<R: SinglePrecision>(x: R) -> R {
    let n = (x * R::lit(std::f64::consts::FRAC_1_PI)).round();
    sine_polynomial(reduce(x, n)).negate_where_odd(n)
}

/// Cosine of an angle in radians.
#[inline(always)]
pub fn cos<R: SinglePrecision>(x: R) -> R {
    let half = R::lit(0.5);
    let n = (x * R::lit(std::f64::consts::FRAC_1_PI) - half).round();
    sine_polynomial(-reduce(x, n + half)).negate_where_odd(n)
}

/// Tangent of an angle in radians; towards its poles the relative error grows as one over the cosine.
#[inline(always)]
pub fn tan<R: SinglePrecision>(x: R) -> R {
    let n = (x * R::lit(std::f64::consts::FRAC_1_PI)).round();
    let r = reduce(x, n);
    sine_polynomial(r) / cosine_polynomial(r)
}

/// Sine of `x` half turns. Their reduction is exact and costs less than that of radians.
#[inline(always)]
pub fn sin_pi<R: SinglePrecision>(x: R) -> R {
    let n = x.round();
    sine_pi_polynomial(x - n).negate_where_odd(n)
}

/// Cosine of `x` half turns.
#[inline(always)]
pub fn cos_pi<R: SinglePrecision>(x: R) -> R {
    let half = R::lit(0.5);
    let n = (x - half).round();
    sine_pi_polynomial((n + half) - x).negate_where_odd(n)
}

/// Inverse tangent, radians. One division folds `|x| > 1` onto the polynomial's range; relative error 2.5e-8.
#[inline(always)]
pub fn atan<R: SinglePrecision>(x: R) -> R {
    let one = R::lit(1.0);
    let large = one.less_than(x.abs());
    let q = R::select(large, one / x, x).abreast();
    let t = q * q;
    let tt = (t * t).abreast();
    let sixth = (t * R::lit(2.916_889_3e-3) + R::lit(-1.635_871_6e-2)).abreast();
    let high = (t * R::lit(4.320_277e-2) + R::lit(-7.551_660_4e-2)).abreast() + tt * sixth;
    let second = (t * R::lit(0.106_657_69) + R::lit(-0.142_110_02)).abreast();
    let low = (t * R::lit(0.199_937_67) + R::lit(-0.333_331_53)).abreast() + tt * second;
    let p = (low.abreast() + (tt * tt) * high.abreast()).abreast();
    let angle = (q * (p * t + one)).abreast();
    let quarter = R::lit(std::f64::consts::FRAC_PI_2).with_sign_of(x);
    R::select(large, quarter - angle, angle)
}

/// Natural exponential, saturating at `e^-87` and `e^88`; relative error 1.9e-9.
#[inline(always)]
pub fn exp<R: SinglePrecision>(x: R) -> R {
    let x = x.max(R::lit(-87.0)).min(R::lit(88.0));
    let n = (x * R::lit(std::f64::consts::LOG2_E)).round();
    // ln 2 in two parts, the first with few enough bits for an exact product.
    let r = (x - n * R::lit(0.693_359_375)) - n * R::lit(-2.121_944_4e-4);
    let p = R::lit(1.383_683_9e-3);
    let p = (p * r + R::lit(8.374_822e-3)).abreast();
    let p = (p * r + R::lit(4.166_822_5e-2)).abreast();
    let p = (p * r + R::lit(0.166_664_2)).abreast();
    let p = (p * r + R::lit(0.499_999_9)).abreast();
    // Grouped so that the product is added last: shader compilers regroup to that, ready for a fused operation.
    (r * r * p + (r + R::lit(1.0))) * n.two_to_the()
}

/// Natural logarithm of a positive number that is not subnormal, by the series of the inverse hyperbolic tangent
/// (Abramowitz and Stegun, 4.1.27) over a mantissa within a factor of the root of two of one; its remainder is 2e-9 of
/// the result. For one float: nothing takes it in lanes.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    // 0x3f3504f3 is the root of one half; the difference carries the exponent above it.
    let offset = x.to_bits().wrapping_sub(0x3f35_04f3);
    let exponent = (offset as i32 >> 23) as f32;
    let mantissa = f32::from_bits((offset & 0x007f_ffff) + 0x3f35_04f3);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let t = s * s;
    let p = 0.111_111_11;
    let p = p * t + 0.142_857_15;
    let p = p * t + 0.2;
    let p = p * t + 0.333_333_34;
    let twice = s + s;
    let fraction = twice + twice * (p * t);
    // ln 2 in two parts, the first with few enough bits for an exact product.
    (fraction + exponent * -2.121_944_4e-4) + exponent * 0.693_359_4
}

/// `base` to the power of `exponent`; zero for a base that is not positive. The relative error grows with the
/// magnitude of the result's logarithm.
#[inline(always)]
pub fn power(base: f32, exponent: f32) -> f32 {
    if base < 1e-37 {
        0.0
    } else {
        exp(exponent * ln(base))
    }
}

/// The functions as methods of an `impl Real` block, by delegation to this module.
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
        #[inline(always)]
        fn sin_pi(self) -> Self {
            $crate::scalar::elementary::sin_pi(self)
        }
        #[inline(always)]
        fn cos_pi(self) -> Self {
            $crate::scalar::elementary::cos_pi(self)
        }
    };
}
pub(crate) use single_precision_functions;

/// The functions of several arguments, likewise, but for [`super::lockstep`], which must not hold itself.
macro_rules! lockstep_functions {
    () => {
        #[inline(always)]
        fn tan_each<const N: usize>(x: [Self; N]) -> [Self; N] {
            $crate::scalar::elementary::tan($crate::scalar::lockstep::Lockstep(x)).0
        }
        #[inline(always)]
        fn atan_each<const N: usize>(x: [Self; N]) -> [Self; N] {
            $crate::scalar::elementary::atan($crate::scalar::lockstep::Lockstep(x)).0
        }
        #[inline(always)]
        fn sin_pi_each<const N: usize>(x: [Self; N]) -> [Self; N] {
            $crate::scalar::elementary::sin_pi($crate::scalar::lockstep::Lockstep(x)).0
        }
        #[inline(always)]
        fn cos_pi_each<const N: usize>(x: [Self; N]) -> [Self; N] {
            $crate::scalar::elementary::cos_pi($crate::scalar::lockstep::Lockstep(x)).0
        }
    };
}
pub(crate) use lockstep_functions;

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
        let pi = std::f64::consts::PI;
        // Worst just below one, where a spacing is 6e-8. Roundings there, in spacings: pi and the polynomial 0.49, the last
        // sum (of 2, over 2) 1, its product 0.5, the sum in that product 0.5, the square 0.56, the result 0.5.
        let half_turns = 3.6;
        assert!(
            largest_ulp((-12.0, 12.0), 1e-30, sin_pi, |x| (pi * (x - x.round())).sin()
                * (1.0 - 2.0 * (x.round().rem_euclid(2.0))))
                < half_turns
        );
        assert!(
            largest_ulp((-12.0, 12.0), 1e-30, cos_pi, |x| {
                let n = x.floor();
                (pi * (n + 0.5 - x)).sin() * (1.0 - 2.0 * n.rem_euclid(2.0))
            }) < half_turns
        );
        // Two polynomials and a division.
        assert!(largest_ulp((-1.2, 1.2), 1e-4, tan, f64::tan) < 4.0);
        assert!(largest_ulp((-50.0, 50.0), 1e-30, atan, f64::atan) < 3.0);
        assert!(largest_ulp((-1.0, 1.0), 1e-30, atan, f64::atan) < 3.0);
        assert!(largest_ulp((-20.0, 20.0), 1e-30, exp, f64::exp) < 2.5);
        // The sum's rounding and that of the fraction, which is at most half the result where they do not agree.
        assert!(largest_ulp((1e-6, 3.0), 1e-30, ln, f64::ln) < 3.0);
        assert!(largest_ulp((3.0, 1e9), 1e-30, ln, f64::ln) < 3.0);
        // The logarithm's rounding of half a spacing of 4 (its greatest value here), times e^x's own relative slope.
        assert!(largest_ulp((0.9, 1.0), 1e-30, |x| power(x, 21.0), |x| x.powf(21.0)) < 40.0);
        assert!(
            largest_ulp(
                (1e-6, 1.0),
                1e-30,
                |x| power(x, 1.0 / 21.0),
                |x| x.powf(1.0 / 21.0)
            ) < 8.0
        );
        assert!(power(0.0, 0.5) == 0.0 && power(1.0, 21.0) == 1.0);
    }

    #[test]
    fn special_arguments() {
        assert_eq!(atan(f32::INFINITY), std::f32::consts::FRAC_PI_2);
        assert_eq!(atan(-0.0f32), 0.0);
        assert_eq!(sin(0.0f32), 0.0);
        assert_eq!(cos(0.0f32), 1.0);
        assert_eq!(sin_pi(0.0f32), 0.0);
        assert_eq!(cos_pi(0.0f32), 1.0);
        assert_eq!(exp(0.0f32), 1.0);
        assert!(exp(1e6f32).is_finite() && exp(-1e6f32) > 0.0);
    }
}
