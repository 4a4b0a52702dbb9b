//! The lane backend: `f32`, as many candidates at once as a register holds, threads by rayon.

use super::kernel::{CHANNELS, score_window};
use super::problem::{Plan, ReplayProblem, Window};
use crate::error::Result;
use crate::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use crate::evaluate::sound::{joined, sound};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, ModelTable, Problem};
use crate::scalar::lanes::Lanes;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

/// The most lanes of any pack.
const MOST_LANES: usize = 16;

/// Scores replays in `f32` lanes.
pub struct SimdEvaluator<'a> {
    replay: &'a ReplayProblem,
    plan: Plan<f32>,
    table: ModelTable,
    set: InstructionSet,
}

/// One pack of candidates through one window.
struct PackThroughWindow<'a> {
    evaluator: &'a SimdEvaluator<'a>,
    /// Varying figures of the candidates, at most as many rows as lanes.
    rows: &'a [f32],
    window: &'a Window<f32>,
}

/// Errors per channel and lane, and a bit per lane that drove to the end.
type PackScore = ([[f32; MOST_LANES]; CHANNELS], u32);

impl PackThroughWindow<'_> {
    #[inline(always)]
    fn score<L: Lanes, T: Tyre<L>>(&self) -> PackScore {
        let table = &self.evaluator.table;
        let width = table.varying.len();
        let last = (self.rows.len() / width.max(1)).saturating_sub(1);
        let car = CarModel::<L, T>::from_table(|place| match table.sources[place] {
            // Lanes without a candidate repeat the last one, so that they cost no special case.
            Some(figure) => L::from_fn(|lane| self.rows[lane.min(last) * width + figure]),
            None => L::load(table.base[place]),
        });
        let score = score_window(&car, &self.evaluator.plan, self.window);
        let mut errors = [[0.0; MOST_LANES]; CHANNELS];
        for (out, lanes) in errors.iter_mut().zip(score.errors) {
            lanes.write(out);
        }
        (errors, L::mask_bits(score.drives))
    }
}

impl LaneWork for PackThroughWindow<'_> {
    type Output = PackScore;

    #[inline(always)]
    fn run<L: Lanes>(self) -> PackScore {
        match self.evaluator.replay.tyre_model() {
            TyreModel::MagicFormula => self.score::<L, MagicFormula<L>>(),
            TyreModel::Linear => self.score::<L, LinearTyre<L>>(),
        }
    }
}

impl<'a> SimdEvaluator<'a> {
    /// An evaluator of `replay` in the lanes of `set`.
    pub fn new(replay: &'a ReplayProblem, set: InstructionSet) -> Self {
        Self {
            replay,
            plan: replay.plan.to_f32(),
            table: ModelTable::new(&replay.free, &replay.problem.variables),
            set,
        }
    }
}

impl Evaluator for SimdEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.replay.problem
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::of_lanes(self.set)
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates: Vec<&[f64]> = population.chunks_exact(self.replay.dimensions().max(1)).collect();
        let replay = self.replay;
        let (preliminary, rows) = sound(&candidates, |c| replay.free.preliminary_failure(c));
        let figures = self.table.rows(&self.replay.free, &rows);

        let windows = &self.plan.windows;
        let (lanes, width) = (self.set.lanes(), self.table.varying.len());
        let packs = rows.len().div_ceil(lanes);
        let evaluator = &*self;
        let scores: Vec<PackScore> = (0..packs * windows.len())
            .into_par_iter()
            .map(|job| {
                let pack = job / windows.len();
                let work = PackThroughWindow {
                    evaluator,
                    rows: &figures[pack * lanes * width..((pack + 1) * lanes).min(rows.len()) * width],
                    window: &windows[job % windows.len()],
                };
                dispatch(evaluator.set, work)
            })
            .collect();

        let totals = (0..rows.len()).map(|place| {
            let (pack, lane) = (place / lanes, place % lanes);
            let mut total = Some([0.0; CHANNELS]);
            for (errors, drives) in &scores[pack * windows.len()..(pack + 1) * windows.len()] {
                total = total.filter(|_| drives >> lane & 1 == 1);
                if let Some(total) = &mut total {
                    let errors: [f64; CHANNELS] = std::array::from_fn(|k| f64::from(errors[k][lane]));
                    replay.accumulate(total, errors);
                }
            }
            total
        });
        Ok(replay.evaluation_of(joined(preliminary, totals)))
    }
}
