//! The lane backend: `f32`, as many candidates at once as a register holds, threads by rayon.

use super::kernel::{CHANNELS, score_window};
use super::plan::Plan;
use super::problem::ReplayProblem;
use crate::evaluate::packs::{LaneFigures, LaneKernel, Pack};
use crate::evaluate::simd::InstructionSet;
use crate::evaluate::{LaneTables, ModelTable};
use crate::scalar::lanes::Lanes;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};

/// Figures of a candidate in a window: an error per channel, and one where the car drove to the end.
const FIGURES: usize = CHANNELS + 1;

/// What lanes read of a problem.
pub struct ReplayLanes {
    plan: Plan<f32>,
    table: ModelTable,
}

/// Candidates through one window in each round.
struct Kernel<'a> {
    model: TyreModel,
    tables: &'a ReplayLanes,
    /// Varying figures of the candidates' cars.
    rows: Vec<f32>,
}

impl Kernel<'_> {
    #[inline(always)]
    fn score<L: Lanes, T: Tyre<L>>(&self, pack: Pack) -> [L; FIGURES] {
        let plan = &self.tables.plan;
        let car: CarModel<L, T> = self.tables.table.cars(&self.rows, pack);
        let score = score_window(&car, plan, &plan.windows[pack.round]);
        let [vx, ax, ay, yaw_rate] = score.errors;
        let drives = L::select(score.drives, L::lit(1.0), L::lit(0.0));
        [vx, ax, ay, yaw_rate, drives]
    }
}

impl LaneKernel<FIGURES> for Kernel<'_> {
    type Memory<L: Lanes> = ();

    #[inline(always)]
    fn figures<L: Lanes>(&self, pack: Pack, (): &mut ()) -> [L; FIGURES] {
        match self.model {
            TyreModel::MagicFormula => self.score::<L, MagicFormula<L>>(pack),
            TyreModel::Linear => self.score::<L, LinearTyre<L>>(pack),
        }
    }
}

impl LaneTables<ReplayProblem> for ReplayLanes {
    fn new(replay: &ReplayProblem) -> Self {
        Self {
            plan: replay.plan.to_f32(),
            table: ModelTable::new(&replay.free, &replay.problem.variables),
        }
    }

    fn outcomes(
        &self,
        replay: &ReplayProblem,
        set: InstructionSet,
        candidates: &[&[f64]],
    ) -> Vec<Option<[f64; CHANNELS]>> {
        let windows = self.plan.windows.len();
        let kernel = Kernel {
            model: replay.tyre_model(),
            tables: self,
            rows: self.table.rows(&replay.free, candidates),
        };
        let found = LaneFigures::of(set, &kernel, (candidates.len(), windows), 1);
        let total = |candidate: usize| {
            let mut total = [0.0; CHANNELS];
            for window in 0..windows {
                let [vx, ax, ay, yaw_rate, drives] = found.get(candidate, window).map(f64::from);
                if drives == 0.0 {
                    return None;
                }
                replay.accumulate(&mut total, [vx, ax, ay, yaw_rate]);
            }
            Some(total)
        };
        (0..candidates.len()).map(total).collect()
    }
}
