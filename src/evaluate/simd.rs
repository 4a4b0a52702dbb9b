//! Choice of instruction set at run time: the one place where lane types meet the processor.

use crate::scalar::lanes::{Baseline, Lanes};

/// Instruction sets that lanes can run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// 512-bit registers, 16 lanes.
    Avx512,
    /// 256-bit registers, 8 lanes.
    Avx2,
    /// Whatever every processor of the target has.
    Portable,
}

impl InstructionSet {
    /// Every set that this processor has, widest first.
    pub fn available() -> Vec<Self> {
        let mut sets = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            if has_avx512() {
                sets.push(Self::Avx512);
            }
            if is_x86_feature_detected!("avx2") {
                sets.push(Self::Avx2);
            }
        }
        sets.push(Self::Portable);
        sets
    }

    /// The widest set that this processor has.
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if has_avx512() {
                return Self::Avx512;
            }
            if is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Portable
    }

    /// Lanes of one pack.
    pub fn lanes(self) -> usize {
        match self {
            Self::Avx512 => 16,
            Self::Avx2 => 8,
            Self::Portable => Baseline::LANES,
        }
    }

    /// The name that reports give.
    pub fn name(self) -> &'static str {
        match self {
            Self::Avx512 => "AVX-512",
            Self::Avx2 => "AVX2",
            Self::Portable => "portable",
        }
    }
}

/// The parts of AVX-512 that [`crate::scalar::lanes::Avx512`] uses.
#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq")
}

/// Work that can be done in any lane type.
pub trait LaneWork {
    /// What it yields.
    type Output;

    /// Does the work; implementations are `#[inline(always)]`, so that they are compiled for the caller's
    /// instruction set.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Runs `work` in the lanes of `set`. A set that the processor lacks falls to [`InstructionSet::Portable`], whose
/// results are the same.
pub fn dispatch<W: LaneWork>(set: InstructionSet, work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        use crate::scalar::lanes::{Avx2, Avx512};

        #[target_feature(enable = "avx512f,avx512dq")]
        fn run_avx512<W: LaneWork>(work: W) -> W::Output {
            work.run::<Avx512>()
        }
        #[target_feature(enable = "avx2")]
        fn run_avx2<W: LaneWork>(work: W) -> W::Output {
            work.run::<Avx2>()
        }
        if set == InstructionSet::Avx512 && has_avx512() {
            // SAFETY: the processor has the set, as just detected.
            return unsafe { run_avx512(work) };
        }
        if set == InstructionSet::Avx2 && is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has the set, as just detected.
            return unsafe { run_avx2(work) };
        }
    }
    work.run::<Baseline>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::lanes::Portable;
    use crate::scalar::{Lookup, Real};

    /// What [`functions`] yields.
    const FUNCTIONS: usize = 14;

    /// Every elementary function, alone and in lockstep, and every operation that lane types write themselves.
    #[inline(always)]
    fn functions<R: Real>(x: R, y: R) -> [R; FUNCTIONS] {
        let [both, _] = R::atan_each([x * y, y]);
        let [tan, _, _] = R::tan_each([x, y, x - y]);
        [
            x.sin(),
            x.cos(),
            tan,
            x.atan(),
            x.exp(),
            x.sin_pi(),
            x.cos_pi(),
            both,
            x.abs().sqrt() / y,
            x.min(y) - x.max(-y),
            x.sign(),
            R::select(x.less_than(y), x, y),
            R::select(!(x.less_than(y) & y.less_than(x)), x, y),
            R::select(x.less_than(y) | R::splat_mask(false), x, y),
        ]
    }

    /// The figures of each lane, the lanes filled from `argument`.
    struct Sampled;

    fn argument(lane: usize, which: usize) -> f32 {
        (lane as f32 - 7.3) * if which == 0 { 1.9 } else { 0.37 }
    }

    impl LaneWork for Sampled {
        type Output = Vec<[f32; 16]>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let mut out = vec![[0.0; 16]; FUNCTIONS];
            for start in (0..16).step_by(L::LANES) {
                let x = L::from_fn(|lane| argument(start + lane, 0));
                let y = L::from_fn(|lane| argument(start + lane, 1));
                for (out, lanes) in out.iter_mut().zip(functions(x, y)) {
                    lanes.write(&mut out[start..]);
                }
            }
            out
        }
    }

    #[test]
    fn every_instruction_set_computes_what_one_float_does() {
        let packs = InstructionSet::available()
            .into_iter()
            .map(|set| dispatch(set, Sampled))
            .chain([Sampled.run::<Portable>()]);
        for pack in packs {
            for lane in 0..16 {
                let alone = functions(argument(lane, 0), argument(lane, 1));
                for (number, (lanes, alone)) in pack.iter().zip(alone).enumerate() {
                    assert_eq!(
                        lanes[lane].to_bits(),
                        alone.to_bits(),
                        "function {number}, lane {lane}"
                    );
                }
            }
        }
    }

    /// Arguments at and beyond both ends of a table, and what is not a number.
    const PLACES: [f32; 16] = [
        0.0,
        -0.0,
        0.25,
        0.999_999_94,
        1.0,
        1.5,
        6.75,
        7.0,
        7.999_999_5,
        8.0,
        8.5,
        -1.0,
        1e30,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
    ];

    /// What tables of so many rows of eight yield, lane by lane, in the order of the arguments.
    struct LookedUp(usize);

    impl LookedUp {
        /// Ends with its last figure, so that a sanitizer sees what reads beyond.
        fn table(&self) -> Box<[f32]> {
            (0..8 * self.0).map(|i| i as f32 + 0.5).collect()
        }
    }

    impl LaneWork for LookedUp {
        type Output = Vec<f32>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<f32> {
            let table = self.table();
            let mut found = Vec::new();
            for start in (0..PLACES.len()).step_by(L::LANES) {
                let x = L::from_fn(|lane| PLACES[start + lane]);
                let (place, beyond) = x.place(self.0, 8);
                let row = L::pick_row(&table, place);
                // The last is beyond the row, and for the last row beyond the table.
                let picked = [0, 3, 7, 9].map(|column| L::pick(&table, place, column));
                // Places of a longer table than this one.
                let (far, _) = x.place(self.0 + 3, 8);
                for figure in L::pick_row(&table, far) {
                    let mut lanes = [0.5; 16];
                    figure.write(&mut lanes);
                    assert!(lanes.iter().all(|x| table.contains(x)), "{lanes:?}");
                }
                let figures = [beyond, x.whole(5), L::pick(&table, far, 9)].into_iter();
                let figures = figures.chain(row).chain(picked);
                let mut lanes = [[0.0; 16]; 15];
                for (lanes, figure) in lanes.iter_mut().zip(figures) {
                    figure.write(lanes);
                }
                found.extend((0..L::LANES).flat_map(|lane| lanes.map(|figure| figure[lane])));
            }
            found
        }
    }

    #[test]
    fn tables_are_read_to_their_ends_and_no_further_in_every_instruction_set() {
        for rows in [1, 2, 7, 8] {
            let table = LookedUp(rows).table();
            let alone: Vec<f32> = PLACES
                .iter()
                .flat_map(|x| {
                    let (place, beyond) = x.place(rows, 8);
                    let row = f32::pick_row(&table, place);
                    let picked = [0, 3, 7, 9].map(|column| f32::pick(&table, place, column));
                    let (far, _) = x.place(rows + 3, 8);
                    let figures = [beyond, x.whole(5), f32::pick(&table, far, 9)].into_iter();
                    let figures = figures.chain(row).chain(picked);
                    figures.collect::<Vec<f32>>()
                })
                .collect();
            let packs = InstructionSet::available()
                .into_iter()
                .map(|set| dispatch(set, LookedUp(rows)))
                .chain([LookedUp(rows).run::<Portable>()]);
            for pack in packs {
                let bits = |figures: &[f32]| figures.iter().map(|x| x.to_bits()).collect::<Vec<u32>>();
                assert_eq!(bits(&pack), bits(&alone), "{rows} rows");
            }
        }
    }
}
