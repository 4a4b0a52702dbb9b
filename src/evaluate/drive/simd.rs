//! The lane backend: `f32`, as many laps at once as a register holds, threads by rayon.

use super::problem::{DriveProblem, LAP_FIGURES};
use crate::drive::driver::{DriverTable, Pace, WheelTorque};
use crate::drive::kernel::{DriveState, DrivenLap, STATE, World, drive_on};
use crate::drive::{Course, Road};
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

/// Drives laps in `f32` lanes.
pub struct SimdDriveEvaluator<'a> {
    drive: &'a DriveProblem,
    table: ModelTable,
    road: Road<f32>,
    driver: DriverTable<f32>,
    torque: WheelTorque<f32>,
    set: InstructionSet,
}

/// One pack of candidates.
struct Pack<'a> {
    evaluator: &'a SimdDriveEvaluator<'a>,
    /// Varying figures of the candidates, at most as many rows as lanes.
    rows: &'a [f32],
    /// What [`DriveProblem::lap_figures`] says of them.
    laps: &'a [[f64; LAP_FIGURES]],
    /// The states from which to take one step, and its number; a whole lap where there are none.
    from: Option<(&'a [[f32; STATE]], usize)>,
}

/// Figures of the last states, lane by lane.
type PackStates = [[f32; MOST_LANES]; STATE];

impl Pack<'_> {
    #[inline(always)]
    fn drive<L: Lanes, T: Tyre<L>>(&self) -> PackStates {
        let evaluator = self.evaluator;
        let table = &evaluator.table;
        let width = table.varying.len();
        // Lanes without a candidate repeat the last one, so that they cost no special case.
        let last = self.laps.len() - 1;
        let car = CarModel::<L, T>::from_table(|place| match table.sources[place] {
            Some(figure) => L::from_fn(|lane| self.rows[lane.min(last) * width + figure]),
            None => L::load(table.base[place]),
        });
        let [line, plan, share]: [L; LAP_FIGURES] =
            std::array::from_fn(|k| L::from_fn(|lane| self.laps[lane.min(last)][k] as f32));
        let world = World {
            road: &evaluator.road,
            driver: &evaluator.driver,
            torque: &evaluator.torque,
        };
        let course = Course::at(world.road, line);
        let pace = Pace { plan, share };
        // One copy of the step serves both: its code is large.
        let (mut state, mut number, most) = match self.from {
            None => (DriveState::begin(&world, &course, &pace), 0, u32::MAX),
            Some((states, number)) => {
                let figure = |k: usize| L::from_fn(|lane| states[lane.min(last)][k]);
                let state = DriveState::from_array(std::array::from_fn(figure));
                (state, number as u32, number as u32 + 1)
            }
        };
        drive_on(&car, &world, (&course, &pace), &mut state, &mut number, most);
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
        match self.evaluator.drive.tyre_model() {
            TyreModel::MagicFormula => self.drive::<L, MagicFormula<L>>(),
            TyreModel::Linear => self.drive::<L, LinearTyre<L>>(),
        }
    }
}

impl<'a> SimdDriveEvaluator<'a> {
    /// An evaluator of `drive` in the lanes of `set`.
    pub fn new(drive: &'a DriveProblem, set: InstructionSet) -> Self {
        Self {
            drive,
            table: ModelTable::new(&drive.free, &drive.problem.variables),
            road: drive.road().stored::<f32>(),
            driver: drive.driver().stored::<f32>(),
            torque: drive.torque().stored::<f32>(),
            set,
        }
    }

    /// The last states of candidates that can be driven, or those after one step from the given ones, see [`Pack::from`].
    fn states(&self, rows: &[&[f64]], from: Option<(&[[f32; STATE]], usize)>) -> Vec<[f32; STATE]> {
        let figures = self.table.rows(&self.drive.free, rows);
        let lap_figures: Vec<_> = rows.iter().map(|c| self.drive.lap_figures(c)).collect();
        let (lanes, width) = (self.set.lanes(), self.table.varying.len());
        let evaluator = self;
        let packs: Vec<PackStates> = lap_figures
            .par_chunks(lanes)
            .enumerate()
            .map(|(pack, laps)| {
                let first = pack * lanes;
                let work = Pack {
                    evaluator,
                    rows: &figures[first * width..(first + laps.len()) * width],
                    laps,
                    from: from.map(|(states, number)| (&states[first..first + laps.len()], number)),
                };
                dispatch(evaluator.set, work)
            })
            .collect();
        (0..rows.len())
            .map(|place| packs[place / lanes].map(|figure| figure[place % lanes]))
            .collect()
    }

    /// The states of candidates that can be driven a step after the given ones, which is the `number`-th since the run-up
    /// began.
    pub fn advance(
        &self,
        candidates: &[&[f64]],
        states: &[[f32; STATE]],
        number: usize,
    ) -> Vec<[f32; STATE]> {
        self.states(candidates, Some((states, number)))
    }

    /// The laps of candidates.
    pub fn laps(&self, candidates: &[&[f64]]) -> Vec<std::result::Result<DrivenLap, Failure>> {
        let drive = self.drive;
        let (preliminary, rows) = sound(candidates, |c| drive.preliminary_failure(c));
        let states = self.states(&rows, None).into_iter();
        joined(preliminary, states.map(|s| drive.lap(s.map(f64::from))))
    }
}

impl Evaluator for SimdDriveEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.drive.problem
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::of_lanes(self.set)
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates: Vec<&[f64]> = population.chunks_exact(self.drive.dimensions().max(1)).collect();
        let laps = self.laps(&candidates);
        let rows = laps.into_iter().map(|lap| self.drive.objective_row(lap));
        Ok(Evaluation::of_rows(rows.collect()))
    }
}
