//! Packs of `f32` lanes: one candidate car per lane.
//!
//! `Avx512`, `Avx2` and [`Sse2`] wrap the vector registers; [`Portable`] is a plain array for processors that
//! have none of them. All round alike: the operations are IEEE and the elementary functions are the shared ones, so
//! a candidate's cost does not depend on the instruction set.
//!
//! The wider register types are only sound to use inside a function that enables their instruction set, after that
//! set was detected: [`crate::evaluate::simd`] is the one place that does so.

use super::elementary::{self, SinglePrecision};
use super::{Lookup, Part, Real};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// A pack of lanes that can be filled from and read out to memory.
pub trait Lanes: SinglePrecision<Storage = f32> + Lookup {
    /// Lanes in the pack.
    const LANES: usize;

    /// Fills lane `i` with `f(i)`.
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self;
    /// Writes lane `i` to `out[i]`; `out` has at least [`Lanes::LANES`] elements.
    fn write(self, out: &mut [f32]);
    /// Bit `i` is the truth in lane `i`.
    fn mask_bits(mask: Self::Mask) -> u32;
}

/// Eight lanes in a plain array, for any processor.
#[derive(Clone, Copy, Debug)]
pub struct Portable([f32; 8]);

/// A truth for each of the lanes of [`Portable`].
#[derive(Clone, Copy, Debug)]
pub struct PortableMask([bool; 8]);

macro_rules! portable_operator {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for Portable {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] $op other.0[i]))
            }
        }
    };
}
portable_operator!(Add, add, +);
portable_operator!(Sub, sub, -);
portable_operator!(Mul, mul, *);
portable_operator!(Div, div, /);

impl Neg for Portable {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}

impl BitAnd for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] & other.0[i]))
    }
}

impl BitOr for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] | other.0[i]))
    }
}

impl Not for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0.map(|x| !x))
    }
}

impl Real for Portable {
    type Mask = PortableMask;
    type Storage = f32;

    #[inline(always)]
    fn lit(x: f64) -> Self {
        Self([x as f32; 8])
    }
    #[inline(always)]
    fn load(x: f32) -> Self {
        Self([x; 8])
    }
    #[inline(always)]
    fn store(x: f64) -> f32 {
        x as f32
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| Real::min(self.0[i], other.0[i])))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| Real::max(self.0[i], other.0[i])))
    }
    elementary::single_precision_functions!();
    elementary::lockstep_functions!();
    #[inline(always)]
    fn less_than(self, other: Self) -> PortableMask {
        PortableMask(std::array::from_fn(|i| self.0[i] < other.0[i]))
    }
    #[inline(always)]
    fn splat_mask(truth: bool) -> PortableMask {
        PortableMask([truth; 8])
    }
    #[inline(always)]
    fn select(mask: PortableMask, if_true: Self, if_false: Self) -> Self {
        Self(std::array::from_fn(|i| {
            if mask.0[i] { if_true.0[i] } else { if_false.0[i] }
        }))
    }
}

impl SinglePrecision for Portable {
    #[inline(always)]
    fn round(self) -> Self {
        Self(self.0.map(SinglePrecision::round))
    }
    #[inline(always)]
    fn negate_where_odd(self, n: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].negate_where_odd(n.0[i])))
    }
    #[inline(always)]
    fn with_sign_of(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].with_sign_of(other.0[i])))
    }
    #[inline(always)]
    fn two_to_the(self) -> Self {
        Self(self.0.map(SinglePrecision::two_to_the))
    }
}

impl Lanes for Portable {
    const LANES: usize = 8;

    #[inline(always)]
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
        Self(std::array::from_fn(f))
    }
    #[inline(always)]
    fn write(self, out: &mut [f32]) {
        out[..8].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn mask_bits(mask: PortableMask) -> u32 {
        (0..8).fold(0, |bits, i| bits | (u32::from(mask.0[i]) << i))
    }
}

#[cfg(target_arch = "x86_64")]
pub use x86::Sse2;
// Not for others: outside functions for their sets their operations would be undefined.
#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{Avx2, Avx512};

/// What every processor of the target has.
#[cfg(target_arch = "x86_64")]
pub type Baseline = Sse2;
/// What every processor of the target has.
#[cfg(not(target_arch = "x86_64"))]
pub type Baseline = Portable;

#[cfg(target_arch = "x86_64")]
mod x86 {
    //! Safety of every block here: the intrinsics only need their instruction set to be present. These types
    //! come to life only inside `#[target_feature]` functions that `evaluate::simd` calls after detecting the
    //! set, but for `Sse2`, which every x86-64 processor has. Memory is only touched through arrays of exactly the register's size.

    // Some mask operations of some sets are plain integer arithmetic, in which `unsafe` says nothing.
    #![allow(unused_unsafe)]

    use super::*;
    use std::arch::asm;
    use std::arch::x86_64::*;

    /// An empty instruction that reads and writes both.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn tie_512(mut a: __m512, mut b: __m512) -> (__m512, __m512) {
        // SAFETY: the instruction is none: it names two registers and touches nothing.
        unsafe {
            asm!("/* {0} {1} */", inout(zmm_reg) a, inout(zmm_reg) b, options(pure, nomem, nostack, preserves_flags))
        };
        (a, b)
    }

    /// The like for narrower registers.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn tie_256(mut a: __m256, mut b: __m256) -> (__m256, __m256) {
        // SAFETY: the instruction is none: it names two registers and touches nothing.
        unsafe {
            asm!("/* {0} {1} */", inout(ymm_reg) a, inout(ymm_reg) b, options(pure, nomem, nostack, preserves_flags))
        };
        (a, b)
    }

    /// The like for the narrowest.
    #[inline]
    #[target_feature(enable = "sse2")]
    fn tie_128(mut a: __m128, mut b: __m128) -> (__m128, __m128) {
        // SAFETY: the instruction is none: it names two registers and touches nothing.
        unsafe {
            asm!("/* {0} {1} */", inout(xmm_reg) a, inout(xmm_reg) b, options(pure, nomem, nostack, preserves_flags))
        };
        (a, b)
    }

    macro_rules! register_lanes {
        (
            $(#[$doc:meta])* $name:ident($register:ty) x $lanes:literal of $set:literal, $mask_name:ident($mask:ty),
            set1 $set1:ident, add $add:ident, sub $sub:ident, mul $mul:ident, div $div:ident,
            sqrt $sqrt:ident, min $min:ident, max $max:ident,
            less $less:expr, select $select:expr, abs $abs:expr, neg $neg:expr, round $round:expr, odd $odd:expr, sign $sign:expr, pow $pow:expr, tie $tie:ident,
            and $and:expr, or $or:expr, not $not:expr, all $all:expr, bits $bits:expr
        ) => {
            $(#[$doc])*
            #[derive(Clone, Copy, Debug)]
            #[repr(transparent)]
            pub struct $name($register);

            /// A truth for each lane.
            #[derive(Clone, Copy, Debug)]
            #[repr(transparent)]
            pub struct $mask_name($mask);

            impl Add for $name {
                type Output = Self;
                #[inline(always)]
                fn add(self, other: Self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($add(self.0, other.0)) }
                }
            }
            impl Sub for $name {
                type Output = Self;
                #[inline(always)]
                fn sub(self, other: Self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($sub(self.0, other.0)) }
                }
            }
            impl Mul for $name {
                type Output = Self;
                #[inline(always)]
                fn mul(self, other: Self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($mul(self.0, other.0)) }
                }
            }
            impl Div for $name {
                type Output = Self;
                #[inline(always)]
                fn div(self, other: Self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($div(self.0, other.0)) }
                }
            }
            impl Neg for $name {
                type Output = Self;
                #[inline(always)]
                fn neg(self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($neg(self.0)) }
                }
            }
            impl BitAnd for $mask_name {
                type Output = Self;
                #[inline(always)]
                fn bitand(self, other: Self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($and(self.0, other.0)) }
                }
            }
            impl BitOr for $mask_name {
                type Output = Self;
                #[inline(always)]
                fn bitor(self, other: Self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($or(self.0, other.0)) }
                }
            }
            impl Not for $mask_name {
                type Output = Self;
                #[inline(always)]
                fn not(self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($not(self.0)) }
                }
            }

            impl Real for $name {
                type Mask = $mask_name;
                type Storage = f32;

                #[inline(always)]
                fn lit(x: f64) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($set1(x as f32)) }
                }
                #[inline(always)]
                fn load(x: f32) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($set1(x)) }
                }
                #[inline(always)]
                fn store(x: f64) -> f32 {
                    x as f32
                }
                #[inline(always)]
                fn sqrt(self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($sqrt(self.0)) }
                }
                #[inline(always)]
                fn abs(self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($abs(self.0)) }
                }
                #[inline(always)]
                fn min(self, other: Self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($min(self.0, other.0)) }
                }
                #[inline(always)]
                fn max(self, other: Self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($max(self.0, other.0)) }
                }
                elementary::single_precision_functions!();
                elementary::lockstep_functions!();
                #[inline(always)]
                fn less_than(self, other: Self) -> $mask_name {
                    // SAFETY: the set is there, as the module says.
                    unsafe { $mask_name($less(self.0, other.0)) }
                }
                #[inline(always)]
                fn splat_mask(truth: bool) -> $mask_name {
                    // SAFETY: the set is there, as the module says.
                    unsafe { $mask_name($all(truth)) }
                }
                #[inline(always)]
                fn select(mask: $mask_name, if_true: Self, if_false: Self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($select(mask.0, if_true.0, if_false.0)) }
                }
                #[inline(always)]
                fn apart<P: Part>(part: P) -> P::Output {
                    #[inline(never)]
                    #[target_feature(enable = $set)]
                    fn alone<P: Part>(part: P) -> P::Output {
                        part.run()
                    }
                    // SAFETY: the set is there, as the module says.
                    unsafe { alone(part) }
                }
            }

            #[allow(dead_code, reason = "the narrowest lanes look tables up one by one")]
            impl $name {
                /// The register itself.
                #[inline(always)]
                pub(in crate::scalar) fn register(self) -> $register {
                    self.0
                }
                /// The lanes of a register.
                #[inline(always)]
                pub(in crate::scalar) fn of_register(register: $register) -> Self {
                    Self(register)
                }
            }

            impl SinglePrecision for $name {
                #[inline(always)]
                fn round(self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($round(self.0)) }
                }
                #[inline(always)]
                fn negate_where_odd(self, n: Self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($odd(self.0, n.0)) }
                }
                #[inline(always)]
                fn with_sign_of(self, other: Self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($sign(self.0, other.0)) }
                }
                #[inline(always)]
                fn tie(self, other: Self) -> (Self, Self) {
                    // SAFETY: the set is there, as the module says.
                    let (a, b) = unsafe { $tie(self.0, other.0) };
                    (Self(a), Self(b))
                }
                #[inline(always)]
                fn two_to_the(self) -> Self {
                    // SAFETY: the set is there, as the module says.
                    unsafe { Self($pow(self.0)) }
                }
            }

            impl Lanes for $name {
                const LANES: usize = $lanes;

                #[inline(always)]
                fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
                    let lanes: [f32; $lanes] = std::array::from_fn(f);
                    // SAFETY: an array of exactly the register's size, of which every bit pattern is a number.
                    unsafe { Self(std::mem::transmute::<[f32; $lanes], $register>(lanes)) }
                }
                #[inline(always)]
                fn write(self, out: &mut [f32]) {
                    // SAFETY: an array of exactly the register's size, of which every bit pattern is a number.
                    let lanes = unsafe { std::mem::transmute::<$register, [f32; $lanes]>(self.0) };
                    out[..$lanes].copy_from_slice(&lanes);
                }
                #[inline(always)]
                fn mask_bits(mask: $mask_name) -> u32 {
                    // SAFETY: the set is there, as the module says.
                    unsafe { $bits(mask.0) }
                }
            }
        };
    }

    register_lanes! {
        /// Sixteen lanes in an AVX-512 register.
        Avx512(__m512) x 16 of "avx512f,avx512dq", Avx512Mask(__mmask16),
        set1 _mm512_set1_ps, add _mm512_add_ps, sub _mm512_sub_ps, mul _mm512_mul_ps, div _mm512_div_ps,
        sqrt _mm512_sqrt_ps, min _mm512_min_ps, max _mm512_max_ps,
        less |a, b| _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b),
        select |m, a, b| _mm512_mask_blend_ps(m, b, a),
        abs |a| _mm512_abs_ps(a),
        neg |a| _mm512_xor_ps(a, _mm512_set1_ps(-0.0)),
        round |a| _mm512_roundscale_ps::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(a),
        odd |a, n| _mm512_xor_ps(a, _mm512_castsi512_ps(_mm512_slli_epi32::<31>(_mm512_cvttps_epi32(n)))),
        sign |a, b| _mm512_or_ps(_mm512_abs_ps(a), _mm512_and_ps(b, _mm512_set1_ps(-0.0))),
        pow |a| _mm512_castsi512_ps(_mm512_slli_epi32::<23>(_mm512_add_epi32(
            _mm512_cvttps_epi32(a),
            _mm512_set1_epi32(127)
        ))),
        tie tie_512,
        and |a, b| a & b, or |a, b| a | b, not |a: __mmask16| !a,
        all |t: bool| if t { !0 } else { 0 },
        bits |m: __mmask16| u32::from(m)
    }

    register_lanes! {
        /// Eight lanes in an AVX2 register.
        Avx2(__m256) x 8 of "avx2", Avx2Mask(__m256),
        set1 _mm256_set1_ps, add _mm256_add_ps, sub _mm256_sub_ps, mul _mm256_mul_ps, div _mm256_div_ps,
        sqrt _mm256_sqrt_ps, min _mm256_min_ps, max _mm256_max_ps,
        less |a, b| _mm256_cmp_ps::<_CMP_LT_OQ>(a, b),
        select |m, a, b| _mm256_blendv_ps(b, a, m),
        abs |a| _mm256_andnot_ps(_mm256_set1_ps(-0.0), a),
        neg |a| _mm256_xor_ps(a, _mm256_set1_ps(-0.0)),
        round |a| _mm256_round_ps::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(a),
        odd |a, n| _mm256_xor_ps(a, _mm256_castsi256_ps(_mm256_slli_epi32::<31>(_mm256_cvttps_epi32(n)))),
        sign |a, b| {
            let sign_bit = _mm256_set1_ps(-0.0);
            _mm256_or_ps(_mm256_andnot_ps(sign_bit, a), _mm256_and_ps(sign_bit, b))
        },
        pow |a| _mm256_castsi256_ps(_mm256_slli_epi32::<23>(_mm256_add_epi32(
            _mm256_cvttps_epi32(a),
            _mm256_set1_epi32(127)
        ))),
        tie tie_256,
        and |a, b| _mm256_and_ps(a, b), or |a, b| _mm256_or_ps(a, b),
        not |a| _mm256_xor_ps(a, _mm256_castsi256_ps(_mm256_set1_epi32(-1))),
        all |t: bool| _mm256_castsi256_ps(_mm256_set1_epi32(if t { -1 } else { 0 })),
        bits |m| _mm256_movemask_ps(m) as u32
    }

    register_lanes! {
        /// Four lanes in an SSE2 register.
        Sse2(__m128) x 4 of "sse2", Sse2Mask(__m128),
        set1 _mm_set1_ps, add _mm_add_ps, sub _mm_sub_ps, mul _mm_mul_ps, div _mm_div_ps,
        sqrt _mm_sqrt_ps, min _mm_min_ps, max _mm_max_ps,
        less |a, b| _mm_cmplt_ps(a, b),
        select |m, a, b| _mm_or_ps(_mm_and_ps(m, a), _mm_andnot_ps(m, b)),
        abs |a| _mm_andnot_ps(_mm_set1_ps(-0.0), a),
        neg |a| _mm_xor_ps(a, _mm_set1_ps(-0.0)),
        // There is no rounding to a whole number that stays a float.
        round |a| _mm_cvtepi32_ps(_mm_cvtps_epi32(a)),
        odd |a, n| _mm_xor_ps(a, _mm_castsi128_ps(_mm_slli_epi32::<31>(_mm_cvttps_epi32(n)))),
        sign |a, b| {
            let sign_bit = _mm_set1_ps(-0.0);
            _mm_or_ps(_mm_andnot_ps(sign_bit, a), _mm_and_ps(sign_bit, b))
        },
        pow |a| _mm_castsi128_ps(_mm_slli_epi32::<23>(_mm_add_epi32(_mm_cvttps_epi32(a), _mm_set1_epi32(127)))),
        tie tie_128,
        and |a, b| _mm_and_ps(a, b), or |a, b| _mm_or_ps(a, b),
        not |a| _mm_xor_ps(a, _mm_castsi128_ps(_mm_set1_epi32(-1))),
        all |t: bool| _mm_castsi128_ps(_mm_set1_epi32(if t { -1 } else { 0 })),
        bits |m| _mm_movemask_ps(m) as u32
    }
}
