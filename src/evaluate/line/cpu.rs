//! The reference backend: `f64`, one line after another, threads by rayon.

use super::problem::{LineProblem, Measures, MeasuresOf};
use crate::line::EnvelopeTable;
use crate::line::LinePlan;
use crate::line::kernel::{Course, Wanted, lap_time, shape};
use crate::scalar::Lookup;
use rayon::prelude::*;

/// All figures of the line that `variables` give; the time is zero where none is wanted.
#[inline(always)]
pub(super) fn measure<R: Lookup>(
    plan: &LinePlan<R::Storage>,
    envelope: Option<&EnvelopeTable<R::Storage>>,
    wanted: Wanted,
    variables: &[R],
    course: &mut Course<R>,
) -> MeasuresOf<R> {
    let sums = shape(plan, wanted, variables, course);
    let time = match envelope {
        Some(envelope) if wanted.lap => {
            lap_time(envelope, plan.closed, plan.start, R::load(plan.entry), course)
        }
        _ => R::lit(0.0),
    };
    (sums, time).into()
}

/// The figures of candidates in `f64`.
pub(super) fn measures(line: &LineProblem, candidates: &[&[f64]]) -> Vec<Measures> {
    candidates
        .par_iter()
        .map_init(Course::default, |course, candidate| {
            measure::<f64>(line.plan(), line.envelope(), line.wanted(), candidate, course).0
        })
        .collect()
}
