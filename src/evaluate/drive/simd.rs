//! The lane backend: `f32`, as many laps at once as a register holds, threads by rayon.

use super::problem::{DriveProblem, LAP_FIGURES};
use crate::drive::CorneringMap;
use crate::drive::driver::{DriverTable, Pace, WheelTorque};
use crate::drive::kernel::{DriveState, DrivenLap, STATE, World, drive_on};
use crate::drive::{Course, Road};
use crate::evaluate::packs::{LaneFigures, LaneKernel, Pack};
use crate::evaluate::simd::InstructionSet;
use crate::evaluate::{LaneTables, ModelTable, SimdBackend};
use crate::scalar::lanes::Lanes;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};

/// What lanes read of a problem.
pub struct DriveLanes {
    table: ModelTable,
    road: Road<f32>,
    driver: DriverTable<f32>,
    torque: WheelTorque<f32>,
    cornering: CorneringMap<f32>,
}

struct Kernel<'a> {
    model: TyreModel,
    tables: &'a DriveLanes,
    /// Varying figures of the candidates' cars.
    rows: Vec<f32>,
    /// What [`DriveProblem::lap_figures`] says of them.
    laps: Vec<[f64; LAP_FIGURES]>,
    /// The states from which to take one step, and its number; a whole lap where there are none.
    from: Option<(&'a [[f32; STATE]], usize)>,
}

impl Kernel<'_> {
    #[inline(always)]
    fn drive<L: Lanes, T: Tyre<L>>(&self, pack: Pack) -> [L; STATE] {
        let tables = self.tables;
        let car: CarModel<L, T> = tables.table.cars(&self.rows, pack);
        let [line, plan, share]: [L; LAP_FIGURES] =
            std::array::from_fn(|k| L::from_fn(|lane| self.laps[pack.candidate(lane)][k] as f32));
        let world = World {
            road: &tables.road,
            driver: &tables.driver,
            torque: &tables.torque,
            cornering: &tables.cornering,
        };
        let course = Course::at(world.road, line);
        let pace = Pace { plan, share };
        // One copy of the step serves both: its code is large.
        let (mut state, mut number, most) = match self.from {
            None => (DriveState::begin(&world, &course, &pace), 0, u32::MAX),
            Some((states, number)) => {
                let figure = |k: usize| L::from_fn(|lane| states[pack.candidate(lane)][k]);
                let state = DriveState::from_array(std::array::from_fn(figure));
                (state, number as u32, number as u32 + 1)
            }
        };
        drive_on(&car, &world, (&course, &pace), &mut state, &mut number, most);
        state.to_array()
    }
}

impl LaneKernel<STATE> for Kernel<'_> {
    type Memory<L: Lanes> = ();

    #[inline(always)]
    fn figures<L: Lanes>(&self, pack: Pack, (): &mut ()) -> [L; STATE] {
        match self.model {
            TyreModel::MagicFormula => self.drive::<L, MagicFormula<L>>(pack),
            TyreModel::Linear => self.drive::<L, LinearTyre<L>>(pack),
        }
    }
}

impl DriveLanes {
    /// The last states of candidates, or those after one step from the given ones, see [`Kernel::from`].
    fn states(
        &self,
        drive: &DriveProblem,
        set: InstructionSet,
        candidates: &[&[f64]],
        from: Option<(&[[f32; STATE]], usize)>,
    ) -> Vec<[f32; STATE]> {
        let kernel = Kernel {
            model: drive.tyre_model(),
            tables: self,
            rows: self.table.rows(&drive.free, candidates),
            laps: candidates.iter().map(|c| drive.lap_figures(c)).collect(),
            from,
        };
        let found = LaneFigures::of(set, &kernel, (candidates.len(), 1), 1);
        (0..candidates.len())
            .map(|candidate| found.get(candidate, 0))
            .collect()
    }
}

impl LaneTables<DriveProblem> for DriveLanes {
    fn new(drive: &DriveProblem) -> Self {
        Self {
            table: ModelTable::new(&drive.free, &drive.problem.variables),
            road: drive.road().stored::<f32>(),
            driver: drive.driver().stored::<f32>(),
            torque: drive.torque().stored::<f32>(),
            cornering: drive.cornering().stored::<f32>(),
        }
    }

    fn outcomes(&self, drive: &DriveProblem, set: InstructionSet, candidates: &[&[f64]]) -> Vec<DrivenLap> {
        let states = self.states(drive, set, candidates, None).into_iter();
        states.map(|s| drive.lap(s.map(f64::from))).collect()
    }
}

impl SimdBackend<'_, DriveProblem> {
    /// The states of candidates that can be driven a step after the given ones, which is the `number`-th since the run-up
    /// began.
    pub fn advance(
        &self,
        candidates: &[&[f64]],
        states: &[[f32; STATE]],
        number: usize,
    ) -> Vec<[f32; STATE]> {
        let from = Some((states, number));
        self.tables.states(self.kind, self.set, candidates, from)
    }
}
