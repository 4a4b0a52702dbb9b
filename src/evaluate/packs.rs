//! Populations in lanes: packs of candidates, spread over threads.

use super::simd::{InstructionSet, LaneWork, dispatch};
use crate::scalar::lanes::Lanes;
use rayon::prelude::*;

/// The most lanes of any pack.
const MOST_LANES: usize = 16;

/// Candidates that the lanes of a pack work on, in one of their rounds.
#[derive(Clone, Copy)]
pub(crate) struct Pack {
    first: usize,
    /// The last candidate of all.
    last: usize,
    /// Which of the rounds.
    pub round: usize,
}

impl Pack {
    /// Whose figures a lane takes. Lanes without a candidate repeat the last one, so that they cost no special case.
    #[inline(always)]
    pub fn candidate(self, lane: usize) -> usize {
        (self.first + lane).min(self.last)
    }
}

/// A kernel in lanes, which makes `FIGURES` figures of every candidate in each of its rounds.
pub(crate) trait LaneKernel<const FIGURES: usize>: Sync {
    /// Memory that the packs of one thread use one after the other.
    type Memory<L: Lanes>: Default;

    /// The figures of a pack; implementations are `#[inline(always)]`, as for [`LaneWork`].
    fn figures<L: Lanes>(&self, pack: Pack, memory: &mut Self::Memory<L>) -> [L; FIGURES];
}

/// Figures of a pack, lane by lane.
type Columns<const FIGURES: usize> = [[f32; MOST_LANES]; FIGURES];

/// Packs that one thread works on in a row.
struct Packs<'a, K, const FIGURES: usize> {
    kernel: &'a K,
    candidates: usize,
    rounds: usize,
    /// The number of the first, counting the rounds of a pack one after the other.
    first: usize,
    found: &'a mut [Columns<FIGURES>],
}

impl<K: LaneKernel<FIGURES>, const FIGURES: usize> LaneWork for Packs<'_, K, FIGURES> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut memory = K::Memory::<L>::default();
        for (number, columns) in self.found.iter_mut().enumerate() {
            let number = self.first + number;
            let pack = Pack {
                first: number / self.rounds * L::LANES,
                last: self.candidates - 1,
                round: number % self.rounds,
            };
            let figures = self.kernel.figures::<L>(pack, &mut memory);
            for (column, lanes) in columns.iter_mut().zip(figures) {
                lanes.write(column);
            }
        }
    }
}

/// What a kernel finds of candidates.
pub(crate) struct LaneFigures<const FIGURES: usize> {
    packs: Vec<Columns<FIGURES>>,
    lanes: usize,
    rounds: usize,
}

impl<const FIGURES: usize> LaneFigures<FIGURES> {
    /// Runs `kernel` on `candidates` candidates in the lanes of `set`, `at_once` packs in a row in each thread.
    pub fn of(
        set: InstructionSet,
        kernel: &impl LaneKernel<FIGURES>,
        (candidates, rounds): (usize, usize),
        at_once: usize,
    ) -> Self {
        let lanes = set.lanes();
        let mut packs = vec![[[0.0; MOST_LANES]; FIGURES]; candidates.div_ceil(lanes) * rounds];
        packs
            .par_chunks_mut(at_once)
            .enumerate()
            .for_each(|(thread, found)| {
                let work = Packs {
                    kernel,
                    candidates,
                    rounds,
                    first: thread * at_once,
                    found,
                };
                dispatch(set, work);
            });
        Self { packs, lanes, rounds }
    }

    /// The figures of a candidate in one of the rounds.
    pub fn get(&self, candidate: usize, round: usize) -> [f32; FIGURES] {
        let pack = &self.packs[candidate / self.lanes * self.rounds + round];
        pack.map(|column| column[candidate % self.lanes])
    }
}
