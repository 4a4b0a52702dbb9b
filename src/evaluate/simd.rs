//! Choice of instruction set at run time: the one place where lane types meet the processor.

use crate::scalar::lanes::{Lanes, Portable};

/// Instruction sets that lanes can run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// 512-bit registers, 16 lanes.
    Avx512,
    /// 256-bit registers, 8 lanes.
    Avx2,
    /// Whatever the target always has, 8 lanes.
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
        Self::available()[0]
    }

    /// Lanes of one pack.
    pub fn lanes(self) -> usize {
        match self {
            Self::Avx512 => 16,
            Self::Avx2 => 8,
            Self::Portable => 8,
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
    work.run::<Portable>()
}
