//! The lane backend: `f32`, as many laps at once as a register holds, threads by rayon.

use super::cpu::{Tables, measure};
use super::problem::HybridProblem;
use crate::evaluate::LaneTables;
use crate::evaluate::packs::{LaneFigures, LaneKernel, Pack};
use crate::evaluate::simd::InstructionSet;
use crate::line::energy::FIGURES;
use crate::line::energy::{EnergyLap, EnergyPlan, EnergyTable};
use crate::line::kernel::Course;
use crate::line::{EnvelopeTable, LinePlan};
use crate::scalar::lanes::Lanes;

/// Packs that one thread does in a row, in the same memory.
const PACKS: usize = 4;

/// What lanes read of a problem.
pub struct EnergyLanes {
    plan: LinePlan<f32>,
    envelope: EnvelopeTable<f32>,
    table: EnergyTable<f32>,
    energy: EnergyPlan<f32>,
}

struct Kernel<'a> {
    tables: Tables<'a, f32>,
    line_variables: usize,
    /// The kernels' figures of each candidate, of one length.
    figures: Vec<Vec<f64>>,
}

impl LaneKernel<FIGURES> for Kernel<'_> {
    type Memory<L: Lanes> = (Vec<L>, Course<L>);

    #[inline(always)]
    fn figures<L: Lanes>(&self, pack: Pack, (figures, course): &mut Self::Memory<L>) -> [L; FIGURES] {
        figures.clear();
        figures.extend(
            (0..self.figures[0].len())
                .map(|v| L::from_fn(|lane| self.figures[pack.candidate(lane)][v] as f32)),
        );
        measure::<L>(&self.tables, self.line_variables, figures, course, |_, _| {}).to_array()
    }
}

impl LaneTables<HybridProblem> for EnergyLanes {
    fn new(hybrid: &HybridProblem) -> Self {
        Self {
            plan: hybrid.plan().stored::<f32>(),
            envelope: hybrid.car().envelope_table.stored::<f32>(),
            table: hybrid.car().table.stored::<f32>(),
            energy: hybrid.energy().stored::<f32>(),
        }
    }

    fn outcomes(
        &self,
        hybrid: &HybridProblem,
        set: InstructionSet,
        candidates: &[&[f64]],
    ) -> Vec<EnergyLap<f64>> {
        let kernel = Kernel {
            tables: Tables {
                plan: &self.plan,
                envelope: &self.envelope,
                table: &self.table,
                energy: &self.energy,
            },
            line_variables: hybrid.line_variables(),
            figures: candidates.iter().map(|c| hybrid.figures(c)).collect(),
        };
        let found = LaneFigures::of(set, &kernel, (candidates.len(), 1), PACKS);
        (0..candidates.len())
            .map(|candidate| EnergyLap::from_array(found.get(candidate, 0).map(f64::from)))
            .collect()
    }
}
