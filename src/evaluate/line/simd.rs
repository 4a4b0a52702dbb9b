//! The lane backend: `f32`, as many lines at once as a register holds, threads by rayon.

use super::cpu::measure;
use super::problem::{LineProblem, MEASURES, Measures};
use crate::evaluate::LaneTables;
use crate::evaluate::packs::{LaneFigures, LaneKernel, Pack};
use crate::evaluate::simd::InstructionSet;
use crate::line::kernel::Course;
use crate::line::{EnvelopeTable, LinePlan};
use crate::scalar::lanes::Lanes;

/// Packs that one thread does in a row, in the same memory.
const PACKS: usize = 4;

/// What lanes read of a problem.
pub struct LineLanes {
    plan: LinePlan<f32>,
    envelope: Option<EnvelopeTable<f32>>,
}

struct Kernel<'a> {
    line: &'a LineProblem,
    tables: &'a LineLanes,
    candidates: &'a [&'a [f64]],
}

impl LaneKernel<MEASURES> for Kernel<'_> {
    type Memory<L: Lanes> = (Vec<L>, Course<L>);

    #[inline(always)]
    fn figures<L: Lanes>(&self, pack: Pack, (variables, course): &mut Self::Memory<L>) -> [L; MEASURES] {
        let (line, tables) = (self.line, self.tables);
        variables.clear();
        variables.extend(
            (0..line.dimensions())
                .map(|v| L::from_fn(|lane| self.candidates[pack.candidate(lane)][v] as f32)),
        );
        measure::<L>(
            &tables.plan,
            tables.envelope.as_ref(),
            line.wanted(),
            variables,
            course,
        )
        .0
    }
}

impl LaneTables<LineProblem> for LineLanes {
    fn new(line: &LineProblem) -> Self {
        Self {
            plan: line.plan().stored::<f32>(),
            envelope: line.envelope().map(|envelope| envelope.stored::<f32>()),
        }
    }

    fn outcomes(&self, line: &LineProblem, set: InstructionSet, candidates: &[&[f64]]) -> Vec<Measures> {
        let kernel = Kernel {
            line,
            tables: self,
            candidates,
        };
        let found = LaneFigures::of(set, &kernel, (candidates.len(), 1), PACKS);
        (0..candidates.len())
            .map(|candidate| found.get(candidate, 0).map(f64::from))
            .collect()
    }
}
