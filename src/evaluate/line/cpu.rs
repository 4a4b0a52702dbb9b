//! The reference backend: `f64`, one line after another, threads by rayon.

use super::problem::{LineProblem, MeasuresOf};
use crate::error::Result;
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Problem};
use crate::line::LimitTable;
use crate::line::LinePlan;
use crate::line::kernel::{Course, Wanted, lap_time, shape};
use crate::scalar::Lookup;
use rayon::prelude::*;

/// Scores lines in `f64`.
pub struct CpuLineEvaluator<'a> {
    line: &'a LineProblem,
}

impl<'a> CpuLineEvaluator<'a> {
    /// An evaluator of `line`.
    pub fn new(line: &'a LineProblem) -> Self {
        Self { line }
    }
}

/// All figures of the line that `variables` give; the time is nought where none is wanted.
#[inline(always)]
pub(super) fn measure<R: Lookup>(
    plan: &LinePlan<R::Storage>,
    limits: Option<&LimitTable<R::Storage>>,
    wanted: Wanted,
    variables: &[R],
    course: &mut Course<R>,
) -> MeasuresOf<R> {
    let sums = shape(plan, wanted, variables, course);
    let time = match limits {
        Some(limits) if wanted.lap => lap_time(limits, plan.closed, plan.start, R::load(plan.entry), course),
        _ => R::lit(0.0),
    };
    (sums, time).into()
}

impl Evaluator for CpuLineEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.line.problem
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::reference()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let line = self.line;
        let rows: Vec<_> = population
            .par_chunks_exact(line.dimensions().max(1))
            .map_init(Course::default, |course, candidate| {
                if let Some(failure) = line.preliminary_failure(candidate) {
                    return line.failed_row(failure);
                }
                let found = measure::<f64>(line.plan(), line.limits(), line.wanted(), candidate, course);
                line.objective_row(&found.0)
            })
            .collect();
        Ok(Evaluation::of_rows(rows))
    }
}
