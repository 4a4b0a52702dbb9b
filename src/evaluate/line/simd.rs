//! The lane backend: `f32`, as many lines at once as a register holds, threads by rayon.

use super::cpu::measure;
use super::problem::{LineProblem, MEASURES, Measures};
use crate::error::Result;
use crate::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Problem};
use crate::line::kernel::Course;
use crate::line::{LimitTable, LinePlan};
use crate::scalar::lanes::Lanes;
use rayon::prelude::*;

/// The most lanes of any pack.
const MOST_LANES: usize = 16;
/// Packs that one thread does in a row, in the same memory.
const PACKS: usize = 4;

/// Scores lines in `f32` lanes.
pub struct SimdLineEvaluator<'a> {
    line: &'a LineProblem,
    plan: LinePlan<f32>,
    limits: Option<LimitTable<f32>>,
    set: InstructionSet,
}

/// Candidates that one thread does in a row.
struct Packs<'a> {
    evaluator: &'a SimdLineEvaluator<'a>,
    candidates: &'a [&'a [f64]],
}

impl LaneWork for Packs<'_> {
    type Output = Vec<Measures>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let evaluator = self.evaluator;
        let line = evaluator.line;
        let mut course = Course::default();
        let mut variables: Vec<L> = Vec::with_capacity(line.dimensions());
        let mut results = Vec::with_capacity(self.candidates.len());
        for pack in self.candidates.chunks(L::LANES) {
            variables.clear();
            // Lanes without a candidate repeat the last one, so that they cost no special case.
            let last = pack.len() - 1;
            variables
                .extend((0..line.dimensions()).map(|v| L::from_fn(|lane| pack[lane.min(last)][v] as f32)));
            let found = measure::<L>(
                &evaluator.plan,
                evaluator.limits.as_ref(),
                line.wanted(),
                &variables,
                &mut course,
            );
            let mut columns = [[0.0; MOST_LANES]; MEASURES];
            for (column, lanes) in columns.iter_mut().zip(found.0) {
                lanes.write(column);
            }
            results.extend((0..pack.len()).map(|lane| columns.map(|column| f64::from(column[lane]))));
        }
        results
    }
}

impl<'a> SimdLineEvaluator<'a> {
    /// An evaluator of `line` in the lanes of `set`.
    pub fn new(line: &'a LineProblem, set: InstructionSet) -> Self {
        Self {
            line,
            plan: line.plan().stored::<f32>(),
            limits: line.limits().map(|limits| limits.stored::<f32>()),
            set,
        }
    }
}

impl Evaluator for SimdLineEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.line.problem
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::of_lanes(self.set)
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let evaluator = &*self;
        let line = evaluator.line;
        let candidates: Vec<&[f64]> = population.chunks_exact(line.dimensions().max(1)).collect();
        let measures: Vec<Vec<Measures>> = candidates
            .par_chunks(PACKS * evaluator.set.lanes())
            .map(|candidates| {
                dispatch(
                    evaluator.set,
                    Packs {
                        evaluator,
                        candidates,
                    },
                )
            })
            .collect();
        let rows = candidates
            .iter()
            .zip(measures.iter().flatten())
            .map(
                |(candidate, measures)| match line.preliminary_failure(candidate) {
                    Some(failure) => line.failed_row(failure),
                    None => line.objective_row(measures),
                },
            )
            .collect();
        Ok(Evaluation::of_rows(rows))
    }
}
