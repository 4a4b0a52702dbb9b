//! The reference backend: `f64`, one lap after another, threads by rayon.

use super::problem::HybridProblem;
use crate::line::energy::{EnergyLap, EnergyPlan, EnergyTable, SegmentEnergy, energy_lap};
use crate::line::kernel::{Course, Wanted, shape};
use crate::line::{EnvelopeTable, LinePlan};
use crate::scalar::Lookup;
use rayon::prelude::*;

/// Tables of a problem in the precision of a scalar.
pub(super) struct Tables<'a, S> {
    pub plan: &'a LinePlan<S>,
    pub envelope: &'a EnvelopeTable<S>,
    pub table: &'a EnergyTable<S>,
    pub energy: &'a EnergyPlan<S>,
}

/// The lap of `figures`, of which the first `line_variables` are the line's.
#[inline(always)]
pub(super) fn measure<R: Lookup>(
    tables: &Tables<'_, R::Storage>,
    line_variables: usize,
    figures: &[R],
    course: &mut Course<R>,
    record: impl FnMut(usize, &SegmentEnergy<R>),
) -> EnergyLap<R> {
    let plan = tables.plan;
    let wanted = Wanted {
        integral: false,
        lap: true,
    };
    let (line, strategy) = figures.split_at(line_variables);
    shape(plan, wanted, line, course);
    let begin = (plan.closed, plan.start, R::load(plan.entry));
    energy_lap(
        tables.envelope,
        tables.table,
        tables.energy,
        begin,
        strategy,
        course,
        record,
    )
}

/// The laps of candidates in `f64`.
pub(super) fn laps(hybrid: &HybridProblem, candidates: &[&[f64]]) -> Vec<EnergyLap<f64>> {
    candidates
        .par_iter()
        .map_init(Course::default, |course, candidate| {
            let figures = hybrid.figures(candidate);
            measure(
                &hybrid.tables(),
                hybrid.line_variables(),
                &figures,
                course,
                |_, _| {},
            )
        })
        .collect()
}

impl HybridProblem {
    fn tables(&self) -> Tables<'_, f64> {
        Tables {
            plan: self.plan(),
            envelope: &self.car().envelope_table,
            table: &self.car().table,
            energy: self.energy(),
        }
    }

    /// The lap of a candidate in the scalar `R`.
    pub fn lap_in<R: Lookup>(&self, candidate: &[f64]) -> EnergyLap<R> {
        let tables = Tables {
            plan: &self.plan().stored::<R>(),
            envelope: &self.car().envelope_table.stored::<R>(),
            table: &self.car().table.stored::<R>(),
            energy: &self.energy().stored::<R>(),
        };
        let figures: Vec<R> = self.figures(candidate).into_iter().map(R::lit).collect();
        measure(
            &tables,
            self.line_variables(),
            &figures,
            &mut Course::default(),
            |_, _| {},
        )
    }

    /// The lap of a candidate in `f64`, with every segment.
    pub fn lap(&self, candidate: &[f64]) -> (EnergyLap<f64>, Vec<SegmentEnergy<f64>>, Course<f64>) {
        let mut course = Course::default();
        let mut segments = Vec::with_capacity(self.plan().rows.len());
        let figures = self.figures(candidate);
        let lap = measure(
            &self.tables(),
            self.line_variables(),
            &figures,
            &mut course,
            |_, s| {
                segments.push(*s);
            },
        );
        (lap, segments, course)
    }
}
