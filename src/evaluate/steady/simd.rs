//! The lane backend: `f32`, as many cars at once as a register holds, threads by rayon.

use super::kernel::{Aim, STATE, Settling, settle};
use super::modes::SettlePlan;
use super::problem::{AIM_FIGURES, Settled, SteadyProblem};
use crate::error::Result;
use crate::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use crate::evaluate::sound::{joined, sound};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Failure, ModelTable, Problem};
use crate::scalar::lanes::Lanes;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

/// The most lanes of any pack.
const MOST_LANES: usize = 16;

/// Settles cars in `f32` lanes.
pub struct SimdSteadyEvaluator<'a> {
    steady: &'a SteadyProblem,
    plan: SettlePlan<f32>,
    table: ModelTable,
    set: InstructionSet,
}

/// One pack of candidates.
struct Pack<'a> {
    evaluator: &'a SimdSteadyEvaluator<'a>,
    /// Varying figures of the candidates, at most as many rows as lanes.
    rows: &'a [f32],
    /// What [`SteadyProblem::aim_figures`] says of them.
    aims: &'a [[f64; AIM_FIGURES]],
}

/// Figures of the last states, lane by lane.
type PackStates = [[f32; MOST_LANES]; STATE];

impl Pack<'_> {
    #[inline(always)]
    fn settle<L: Lanes, T: Tyre<L>>(&self) -> PackStates {
        let table = &self.evaluator.table;
        let width = table.varying.len();
        // Lanes without a candidate repeat the last one, so that they cost no special case.
        let last = self.aims.len() - 1;
        let car = CarModel::<L, T>::from_table(|place| match table.sources[place] {
            Some(figure) => L::from_fn(|lane| self.rows[lane.min(last) * width + figure]),
            None => L::load(table.base[place]),
        });
        let [speed, steer]: [L; AIM_FIGURES] =
            std::array::from_fn(|k| L::from_fn(|lane| self.aims[lane.min(last)][k] as f32));
        let state = settle(&car, &self.evaluator.plan, &Aim { speed, steer });
        let mut states = [[0.0; MOST_LANES]; STATE];
        for (out, lanes) in states.iter_mut().zip(state.to_array()) {
            lanes.write(out);
        }
        states
    }
}

impl LaneWork for Pack<'_> {
    type Output = PackStates;

    #[inline(always)]
    fn run<L: Lanes>(self) -> PackStates {
        match self.evaluator.steady.tyre_model() {
            TyreModel::MagicFormula => self.settle::<L, MagicFormula<L>>(),
            TyreModel::Linear => self.settle::<L, LinearTyre<L>>(),
        }
    }
}

impl<'a> SimdSteadyEvaluator<'a> {
    /// An evaluator of `steady` in the lanes of `set`.
    pub fn new(steady: &'a SteadyProblem, set: InstructionSet) -> Self {
        Self {
            steady,
            plan: steady.plan().stored::<f32>(),
            table: ModelTable::new(&steady.free, &steady.problem.variables),
            set,
        }
    }

    /// The last states of candidates, or why there are none.
    pub fn states(&self, candidates: &[&[f64]]) -> Vec<std::result::Result<Settling<f32>, Failure>> {
        let steady = self.steady;
        let (preliminary, rows) = sound(candidates, |c| steady.preliminary_failure(c));
        let figures = self.table.rows(&steady.free, &rows);
        let aims: Vec<_> = rows.iter().map(|c| steady.aim_figures(c)).collect();
        let (lanes, width) = (self.set.lanes(), self.table.varying.len());
        let packs: Vec<PackStates> = aims
            .par_chunks(lanes)
            .enumerate()
            .map(|(pack, aims)| {
                let first = pack * lanes;
                let work = Pack {
                    evaluator: self,
                    rows: &figures[first * width..(first + aims.len()) * width],
                    aims,
                };
                dispatch(self.set, work)
            })
            .collect();
        let state = |place: usize| packs[place / lanes].map(|figure| figure[place % lanes]);
        joined(
            preliminary,
            (0..rows.len()).map(|place| Settling::from_array(state(place))),
        )
    }

    /// The trims of candidates, or why there are none.
    pub fn trims(&self, candidates: &[&[f64]]) -> Vec<std::result::Result<Settled, Failure>> {
        self.steady.trims_of(candidates, self.states(candidates))
    }
}

impl Evaluator for SimdSteadyEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.steady.problem
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::of_lanes(self.set)
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates: Vec<&[f64]> = population.chunks_exact(self.steady.dimensions()).collect();
        Ok(self.steady.evaluation_of(self.trims(&candidates)))
    }
}
