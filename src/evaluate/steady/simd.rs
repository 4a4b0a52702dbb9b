//! The lane backend: `f32`, as many cars at once as a register holds, threads by rayon.

use super::kernel::{Aim, STATE, SettlePlan, Settling, settle};
use super::problem::{AIM_FIGURES, SteadyProblem};
use crate::evaluate::packs::{LaneFigures, LaneKernel, Pack};
use crate::evaluate::simd::InstructionSet;
use crate::evaluate::{LaneTables, ModelTable};
use crate::scalar::lanes::Lanes;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};

/// What lanes read of a problem.
pub struct SteadyLanes {
    plan: SettlePlan<f32>,
    table: ModelTable,
}

struct Kernel<'a> {
    model: TyreModel,
    tables: &'a SteadyLanes,
    /// Varying figures of the candidates' cars.
    rows: Vec<f32>,
    /// What [`SteadyProblem::aim_figures`] says of them.
    aims: Vec<[f64; AIM_FIGURES]>,
}

impl Kernel<'_> {
    #[inline(always)]
    fn settle<L: Lanes, T: Tyre<L>>(&self, pack: Pack) -> [L; STATE] {
        let car: CarModel<L, T> = self.tables.table.cars(&self.rows, pack);
        let [speed, steer]: [L; AIM_FIGURES] =
            std::array::from_fn(|k| L::from_fn(|lane| self.aims[pack.candidate(lane)][k] as f32));
        settle(&car, &self.tables.plan, &Aim { speed, steer }).to_array()
    }
}

impl LaneKernel<STATE> for Kernel<'_> {
    type Memory<L: Lanes> = ();

    #[inline(always)]
    fn figures<L: Lanes>(&self, pack: Pack, (): &mut ()) -> [L; STATE] {
        match self.model {
            TyreModel::MagicFormula => self.settle::<L, MagicFormula<L>>(pack),
            TyreModel::Linear => self.settle::<L, LinearTyre<L>>(pack),
        }
    }
}

impl LaneTables<SteadyProblem> for SteadyLanes {
    fn new(steady: &SteadyProblem) -> Self {
        Self {
            plan: steady.plan().stored::<f32>(),
            table: ModelTable::new(&steady.free, &steady.problem.variables),
        }
    }

    fn outcomes(
        &self,
        steady: &SteadyProblem,
        set: InstructionSet,
        candidates: &[&[f64]],
    ) -> Vec<Settling<f64>> {
        let kernel = Kernel {
            model: steady.tyre_model(),
            tables: self,
            rows: self.table.rows(&steady.free, candidates),
            aims: candidates.iter().map(|c| steady.aim_figures(c)).collect(),
        };
        let found = LaneFigures::of(set, &kernel, (candidates.len(), 1), 1);
        (0..candidates.len())
            .map(|candidate| Settling::from_array(found.get(candidate, 0)).widened())
            .collect()
    }
}
