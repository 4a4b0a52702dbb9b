//! The test problems in `f32` lanes.

use super::TestProblem;
use crate::error::Result;
use crate::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, FAILED_COST, Failure, Problem};
use crate::scalar::lanes::Lanes;
use rayon::prelude::*;

/// The most lanes of any pack.
const MOST_LANES: usize = 16;
/// Candidates that one thread does in a row.
const PART: usize = 1024;

/// Scores candidates of a test problem in `f32` lanes.
pub struct SimdTestEvaluator<'a> {
    test: &'a TestProblem,
    set: InstructionSet,
}

/// Candidates that one thread does in a row, and room for their objectives.
struct Part<'a> {
    test: &'a TestProblem,
    candidates: &'a [f64],
    objectives: &'a mut [f64],
}

impl LaneWork for Part<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (d, width) = (
            self.test.problem.variables.len(),
            self.test.problem.objectives.len(),
        );
        let mut x = vec![L::lit(0.0); d];
        let mut f = vec![L::lit(0.0); width];
        let packs = self.candidates.chunks(d * L::LANES);
        for (candidates, objectives) in packs.zip(self.objectives.chunks_mut(width * L::LANES)) {
            // Lanes without a candidate repeat the last one, so that they cost no special case.
            let last = candidates.len() / d - 1;
            for (k, x) in x.iter_mut().enumerate() {
                let value = L::from_fn(|lane| candidates[lane.min(last) * d + k] as f32);
                let shift = self.test.shift.get(k).copied().unwrap_or(0.0);
                *x = value - L::lit(shift);
            }
            self.test.function.evaluate(&x, &mut f);
            f.iter_mut()
                .for_each(|f| *f = *f * L::lit(f64::from(self.test.factor)));
            let mut column = [0.0; MOST_LANES];
            for (k, lanes) in f.iter().enumerate() {
                lanes.write(&mut column);
                for (row, value) in objectives.chunks_exact_mut(width).zip(column) {
                    row[k] = f64::from(value);
                }
            }
        }
    }
}

impl<'a> SimdTestEvaluator<'a> {
    /// An evaluator of `test` in the lanes of `set`.
    pub fn new(test: &'a TestProblem, set: InstructionSet) -> Self {
        Self { test, set }
    }
}

impl Evaluator for SimdTestEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.test.problem
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::of_lanes(self.set)
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let problem = &self.test.problem;
        let (d, width) = (problem.variables.len(), problem.objectives.len());
        let mut objectives = vec![0.0; population.len() / d * width];
        let (test, set) = (self.test, self.set);
        let parts = population
            .par_chunks(PART * d)
            .zip(objectives.par_chunks_mut(PART * width));
        parts.for_each(|(candidates, objectives)| {
            let part = Part {
                test,
                candidates,
                objectives,
            };
            dispatch(set, part);
        });
        let failures = failures(population, d, &mut objectives, width);
        Ok(Evaluation {
            objectives,
            failures,
            violations: Vec::new(),
        })
    }
}

/// Why candidates failed, of objectives in single precision.
pub(super) fn failures(
    population: &[f64],
    d: usize,
    objectives: &mut [f64],
    width: usize,
) -> Vec<Option<Failure>> {
    population
        .par_chunks_exact(d)
        .zip(objectives.par_chunks_exact_mut(width))
        .with_min_len(PART)
        .map(|(candidate, row)| {
            let failure = if candidate.iter().any(|x| !x.is_finite()) {
                Some(Failure::NotFinite)
            } else if row.iter().any(|x| !x.is_finite()) {
                Some(Failure::BeyondSinglePrecision)
            } else {
                None
            };
            if failure.is_some() {
                row.fill(FAILED_COST);
            }
            failure
        })
        .collect()
}
