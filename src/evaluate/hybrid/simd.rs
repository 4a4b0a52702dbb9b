//! The lane backend: `f32`, as many laps at once as a register holds, threads by rayon.

use super::cpu::{Tables, measure};
use super::problem::HybridProblem;
use crate::error::Result;
use crate::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Problem};
use crate::line::energy::kernel::FIGURES;
use crate::line::energy::{EnergyLap, EnergyPlan, EnergyTable};
use crate::line::kernel::Course;
use crate::line::{LimitTable, LinePlan};
use crate::scalar::lanes::Lanes;
use rayon::prelude::*;

/// The most lanes of any pack.
const MOST_LANES: usize = 16;
/// Packs that one thread does in a row, in the same memory.
const PACKS: usize = 4;

/// Scores laps with energy in `f32` lanes.
pub struct SimdHybridEvaluator<'a> {
    hybrid: &'a HybridProblem,
    plan: LinePlan<f32>,
    limits: LimitTable<f32>,
    table: EnergyTable<f32>,
    energy: EnergyPlan<f32>,
    set: InstructionSet,
}

/// Candidates that one thread does in a row, by the kernels' figures.
struct Packs<'a> {
    evaluator: &'a SimdHybridEvaluator<'a>,
    figures: &'a [Vec<f64>],
}

impl LaneWork for Packs<'_> {
    type Output = Vec<EnergyLap<f64>>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let evaluator = self.evaluator;
        let tables = Tables {
            plan: &evaluator.plan,
            limits: &evaluator.limits,
            table: &evaluator.table,
            energy: &evaluator.energy,
        };
        let mut course = Course::default();
        let mut figures: Vec<L> = Vec::new();
        let mut results = Vec::with_capacity(self.figures.len());
        for pack in self.figures.chunks(L::LANES) {
            figures.clear();
            // Lanes without a candidate repeat the last one, so that they cost no special case.
            let last = pack.len() - 1;
            figures.extend((0..pack[0].len()).map(|v| L::from_fn(|lane| pack[lane.min(last)][v] as f32)));
            let line_variables = evaluator.hybrid.line_variables();
            let lap = measure::<L>(&tables, line_variables, &figures, &mut course, |_, _| {});
            let mut columns = [[0.0; MOST_LANES]; FIGURES];
            for (column, lanes) in columns.iter_mut().zip(lap.to_array()) {
                lanes.write(column);
            }
            results.extend(
                (0..pack.len())
                    .map(|lane| EnergyLap::from_array(columns.map(|column| f64::from(column[lane])))),
            );
        }
        results
    }
}

impl<'a> SimdHybridEvaluator<'a> {
    /// An evaluator of `hybrid` in the lanes of `set`.
    pub fn new(hybrid: &'a HybridProblem, set: InstructionSet) -> Self {
        Self {
            hybrid,
            plan: hybrid.plan().stored::<f32>(),
            limits: hybrid.car().limits.stored::<f32>(),
            table: hybrid.car().table.stored::<f32>(),
            energy: hybrid.energy().stored::<f32>(),
            set,
        }
    }

    /// The laps of candidates.
    pub fn laps(&self, candidates: &[&[f64]]) -> Vec<EnergyLap<f64>> {
        let figures: Vec<Vec<f64>> = candidates.iter().map(|c| self.hybrid.figures(c)).collect();
        let evaluator = self;
        figures
            .par_chunks(PACKS * self.set.lanes())
            .flat_map_iter(|figures| dispatch(evaluator.set, Packs { evaluator, figures }))
            .collect()
    }
}

impl Evaluator for SimdHybridEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.hybrid.problem
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::of_lanes(self.set)
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let hybrid = self.hybrid;
        let candidates = hybrid.candidates(population);
        let laps = self.laps(&candidates);
        Ok(hybrid.evaluation(&candidates, &laps))
    }
}
