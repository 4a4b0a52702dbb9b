//! Tables that a scalar looks figures up in.

use super::lanes::Portable;
use super::{Dual, Real};

/// A scalar, or a pack of them, that can be the argument of a table of rows.
pub trait Lookup: Real {
    /// Where a row starts in its table, one place per lane.
    type Place: Copy;

    /// The row that `self` counted in rows falls into, of `rows` rows of `width` figures, and how far it is beyond
    /// the row's start, from zero to one. Arguments off either end (and what is not a number) go to that end.
    fn place(self, rows: usize, width: usize) -> (Self::Place, Self);

    /// The greatest whole number that is not above `self`, held between zero and `most`, which is below 2^24; zero for
    /// what is not a number.
    fn whole(self, most: usize) -> Self;

    /// The figure `column` places behind `place`, from a table that is not empty; never beyond its end.
    fn pick(table: &[Self::Storage], place: Self::Place, column: usize) -> Self;

    /// The eight figures from `place` on, from a table of whole rows of eight that is not empty; never beyond its end.
    #[inline(always)]
    fn pick_row(table: &[Self::Storage], place: Self::Place) -> [Self; 8] {
        std::array::from_fn(|column| Self::pick(table, place, column))
    }

    /// Four figures at `self` counted in rows, linear between rows; from a table of whole rows of eight that is not empty: four figures
    /// at the row's start, and their changes to the next row.
    #[inline(always)]
    fn between_rows(self, table: &[Self::Storage]) -> [Self; 4] {
        let (place, beyond) = self.place(table.len() / 8, 8);
        // Written out: lanes would leave their instruction set for a library function's closure.
        let [a, b, c, d, rise_a, rise_b, rise_c, rise_d] = Self::pick_row(table, place);
        [
            a + beyond * rise_a,
            b + beyond * rise_b,
            c + beyond * rise_c,
            d + beyond * rise_d,
        ]
    }

    /// Whether the mask holds in every lane.
    fn all(mask: Self::Mask) -> bool;
}

macro_rules! lone_lookup {
    ($float:ty) => {
        impl Lookup for $float {
            type Place = usize;

            #[inline(always)]
            fn place(self, rows: usize, width: usize) -> (usize, Self) {
                let held = Real::min(Real::max(self, 0.0), rows as $float);
                let row = (held as usize).min(rows - 1);
                (row * width, held - row as $float)
            }
            #[inline(always)]
            fn whole(self, most: usize) -> Self {
                let held = Real::min(Real::max(self, 0.0), most as $float);
                held as usize as $float
            }
            #[inline(always)]
            fn pick(table: &[$float], place: usize, column: usize) -> Self {
                table[(place + column).min(table.len() - 1)]
            }
            #[inline(always)]
            fn all(mask: bool) -> bool {
                mask
            }
        }
    };
}
lone_lookup!(f64);
lone_lookup!(f32);

impl<const N: usize> Lookup for Dual<N> {
    type Place = usize;

    #[inline(always)]
    fn place(self, rows: usize, width: usize) -> (usize, Self) {
        let held = Real::min(Real::max(self, Self::lit(0.0)), Self::lit(rows as f64));
        let row = (held.value as usize).min(rows - 1);
        (row * width, held - Self::lit(row as f64))
    }
    #[inline(always)]
    fn whole(self, most: usize) -> Self {
        Self::constant(self.value.whole(most))
    }
    #[inline(always)]
    fn pick(table: &[f64], place: usize, column: usize) -> Self {
        Self::constant(f64::pick(table, place, column))
    }
    #[inline(always)]
    fn all(mask: bool) -> bool {
        mask
    }
}

impl Lookup for Portable {
    type Place = [usize; 8];

    #[inline(always)]
    fn place(self, rows: usize, width: usize) -> ([usize; 8], Self) {
        let mut lanes = [0.0; 8];
        super::lanes::Lanes::write(self, &mut lanes);
        let found = lanes.map(|x| Lookup::place(x, rows, width));
        (found.map(|f| f.0), super::lanes::Lanes::from_fn(|i| found[i].1))
    }
    #[inline(always)]
    fn whole(self, most: usize) -> Self {
        let mut lanes = [0.0; 8];
        super::lanes::Lanes::write(self, &mut lanes);
        super::lanes::Lanes::from_fn(|i| lanes[i].whole(most))
    }
    #[inline(always)]
    fn pick(table: &[f32], place: [usize; 8], column: usize) -> Self {
        super::lanes::Lanes::from_fn(|i| f32::pick(table, place[i], column))
    }
    #[inline(always)]
    fn all(mask: Self::Mask) -> bool {
        <Self as super::lanes::Lanes>::mask_bits(mask) == 0xff
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    //! Safety of every block here: as in [`crate::scalar::lanes`] the types only come to life where their
    //! instruction set is, and no index reaches beyond the table, because the smaller of it and the last one is
    //! taken unsigned.

    #![allow(unused_unsafe)]

    use super::*;
    use crate::scalar::lanes::{Avx2, Avx512, Lanes, Sse2};
    use std::arch::x86_64::*;

    /// The last index of a table, as lanes count.
    #[inline(always)]
    fn last_index(table: &[f32]) -> i32 {
        assert!(!table.is_empty() && table.len() <= i32::MAX as usize);
        (table.len() - 1) as i32
    }

    /// Eight rows of eight as eight columns. Loading whole rows and turning them round costs less than gathering.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn transposed(rows: [__m256; 8]) -> [__m256; 8] {
        let [a, b, c, d, e, f, g, h] = rows;
        let pairs = |x, y| (_mm256_unpacklo_ps(x, y), _mm256_unpackhi_ps(x, y));
        let (ab_low, ab_high) = pairs(a, b);
        let (cd_low, cd_high) = pairs(c, d);
        let (ef_low, ef_high) = pairs(e, f);
        let (gh_low, gh_high) = pairs(g, h);
        let fours = |x, y| (_mm256_shuffle_ps::<0x44>(x, y), _mm256_shuffle_ps::<0xee>(x, y));
        let (abcd_0, abcd_1) = fours(ab_low, cd_low);
        let (abcd_2, abcd_3) = fours(ab_high, cd_high);
        let (efgh_0, efgh_1) = fours(ef_low, gh_low);
        let (efgh_2, efgh_3) = fours(ef_high, gh_high);
        let low = |x, y| _mm256_permute2f128_ps::<0x20>(x, y);
        let high = |x, y| _mm256_permute2f128_ps::<0x31>(x, y);
        [
            low(abcd_0, efgh_0),
            low(abcd_1, efgh_1),
            low(abcd_2, efgh_2),
            low(abcd_3, efgh_3),
            high(abcd_0, efgh_0),
            high(abcd_1, efgh_1),
            high(abcd_2, efgh_2),
            high(abcd_3, efgh_3),
        ]
    }

    /// The columns of eight rows that start at `index`, which all lie behind `at`.
    ///
    /// # Safety
    /// Every index has eight figures behind it in the table that starts at `at`.
    #[inline]
    #[target_feature(enable = "avx2")]
    unsafe fn rows_256(at: *const f32, index: __m256i) -> [__m256; 8] {
        // SAFETY: the sets are there, and rows of eight at these indices lie behind `at`, as the caller has seen to.
        unsafe {
            let [a, b, c, d, e, f, g, h] = std::mem::transmute::<__m256i, [u32; 8]>(index);
            transposed([
                _mm256_loadu_ps(at.add(a as usize)),
                _mm256_loadu_ps(at.add(b as usize)),
                _mm256_loadu_ps(at.add(c as usize)),
                _mm256_loadu_ps(at.add(d as usize)),
                _mm256_loadu_ps(at.add(e as usize)),
                _mm256_loadu_ps(at.add(f as usize)),
                _mm256_loadu_ps(at.add(g as usize)),
                _mm256_loadu_ps(at.add(h as usize)),
            ])
        }
    }

    /// The columns of sixteen rows, likewise.
    ///
    /// # Safety
    /// As for [`rows_256`].
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn rows_512(at: *const f32, index: __m512i) -> [__m512; 8] {
        // SAFETY: as for half of them.
        unsafe {
            let [low, high] = std::mem::transmute::<__m512i, [__m256i; 2]>(index);
            let (low, high) = (rows_256(at, low), rows_256(at, high));
            [
                _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low[0]), high[0]),
                _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low[1]), high[1]),
                _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low[2]), high[2]),
                _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low[3]), high[3]),
                _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low[4]), high[4]),
                _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low[5]), high[5]),
                _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low[6]), high[6]),
                _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low[7]), high[7]),
            ]
        }
    }

    macro_rules! wide_lookup {
        (
            $name:ident, $index:ty, all $all:literal, truncate $truncate:ident, float $float:ident, set1 $set1:ident,
            min $min:ident, mul $mul:ident, add $add:ident, gather $gather:expr, rows $rows:ident
        ) => {
            impl Lookup for $name {
                type Place = $index;

                #[inline(always)]
                fn place(self, rows: usize, width: usize) -> ($index, Self) {
                    let held = self.max(Self::lit(0.0)).min(Self::lit(rows as f64));
                    // SAFETY: the set is there; no memory is touched.
                    unsafe {
                        let row = $min($truncate(held.register()), $set1(rows as i32 - 1));
                        let fraction = held - Self::of_register($float(row));
                        ($mul(row, $set1(width as i32)), fraction)
                    }
                }
                #[inline(always)]
                fn whole(self, most: usize) -> Self {
                    let held = self.max(Self::lit(0.0)).min(Self::lit(most as f64));
                    // SAFETY: the set is there; no memory is touched.
                    unsafe { Self::of_register($float($truncate(held.register()))) }
                }
                #[inline(always)]
                fn pick(table: &[f32], place: $index, column: usize) -> Self {
                    let last = last_index(table);
                    // SAFETY: the set is there, and no index is beyond the last: the lesser is taken, unsigned.
                    unsafe {
                        let index = $min($add(place, $set1(column as i32)), $set1(last));
                        Self::of_register($gather(table.as_ptr(), index))
                    }
                }
                #[inline(always)]
                fn pick_row(table: &[f32], place: $index) -> [Self; 8] {
                    let last = last_index(table);
                    assert!(last >= 7);
                    // SAFETY: the set is there, and eight figures follow every index: the lesser is taken, unsigned.
                    unsafe {
                        let index = $min(place, $set1(last - 7));
                        // Written out: through a library function's closure the registers would go by memory.
                        let [a, b, c, d, e, f, g, h] = $rows(table.as_ptr(), index);
                        [
                            Self::of_register(a),
                            Self::of_register(b),
                            Self::of_register(c),
                            Self::of_register(d),
                            Self::of_register(e),
                            Self::of_register(f),
                            Self::of_register(g),
                            Self::of_register(h),
                        ]
                    }
                }
                #[inline(always)]
                fn all(mask: Self::Mask) -> bool {
                    Self::mask_bits(mask) == $all
                }
            }
        };
    }
    wide_lookup!(
        Avx512, __m512i, all 0xffff, truncate _mm512_cvttps_epi32, float _mm512_cvtepi32_ps, set1 _mm512_set1_epi32,
        min _mm512_min_epu32, mul _mm512_mullo_epi32, add _mm512_add_epi32,
        gather |at, index| _mm512_i32gather_ps::<4>(index, at),
        rows rows_512
    );
    wide_lookup!(
        Avx2, __m256i, all 0xff, truncate _mm256_cvttps_epi32, float _mm256_cvtepi32_ps, set1 _mm256_set1_epi32,
        min _mm256_min_epu32, mul _mm256_mullo_epi32, add _mm256_add_epi32,
        gather |at, index| _mm256_i32gather_ps::<4>(at, index),
        rows rows_256
    );

    /// Without instructions for it, lane by lane. Never inlined: it is long, and for processors without AVX2 alone.
    impl Lookup for Sse2 {
        type Place = [usize; 4];

        #[inline(never)]
        fn place(self, rows: usize, width: usize) -> ([usize; 4], Self) {
            let mut lanes = [0.0; 4];
            self.write(&mut lanes);
            let found = lanes.map(|x| Lookup::place(x, rows, width));
            (found.map(|f| f.0), Self::from_fn(|i| found[i].1))
        }
        #[inline(never)]
        fn whole(self, most: usize) -> Self {
            let mut lanes = [0.0; 4];
            self.write(&mut lanes);
            Self::from_fn(|i| lanes[i].whole(most))
        }
        #[inline(never)]
        fn pick(table: &[f32], place: [usize; 4], column: usize) -> Self {
            Self::from_fn(|i| f32::pick(table, place[i], column))
        }
        #[inline(always)]
        fn all(mask: Self::Mask) -> bool {
            Self::mask_bits(mask) == 0xf
        }
    }
}
