//! The reference backend: `f64`, one lap after another, threads by rayon.

use super::problem::DriveProblem;
use crate::drive::Course;
use crate::drive::driver::Pace;
use crate::drive::kernel::{DriveState, DrivenLap, drive_on};
use crate::error::Result;
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Failure, Problem};
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

/// Drives laps in `f64`.
pub struct CpuDriveEvaluator<'a> {
    drive: &'a DriveProblem,
}

impl<'a> CpuDriveEvaluator<'a> {
    /// An evaluator of `drive`.
    pub fn new(drive: &'a DriveProblem) -> Self {
        Self { drive }
    }

    fn lap_on<T: Tyre<f64>>(&self, candidate: &[f64]) -> DrivenLap {
        let flat = self.drive.free.flat(candidate);
        let car = CarModel::<f64, T>::from_parameters(|i| flat[i]);
        let [line, plan, share] = self.drive.lap_figures(candidate);
        let world = self.drive.world();
        let course = Course::at(world.road, line);
        let pace = Pace { plan, share };
        let mut state = DriveState::begin(&world, &course, &pace);
        drive_on(&car, &world, (&course, &pace), &mut state, &mut 0, u32::MAX);
        self.drive.lap(state.to_array())
    }

    /// The laps of candidates.
    pub fn laps(&self, candidates: &[&[f64]]) -> Vec<std::result::Result<DrivenLap, Failure>> {
        candidates
            .par_iter()
            .map(|candidate| match self.drive.preliminary_failure(candidate) {
                Some(failure) => Err(failure),
                None => Ok(match self.drive.tyre_model() {
                    TyreModel::MagicFormula => self.lap_on::<MagicFormula<f64>>(candidate),
                    TyreModel::Linear => self.lap_on::<LinearTyre<f64>>(candidate),
                }),
            })
            .collect()
    }
}

impl Evaluator for CpuDriveEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.drive.problem
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::reference()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates: Vec<&[f64]> = population.chunks_exact(self.drive.dimensions().max(1)).collect();
        let laps = self.laps(&candidates);
        let rows = laps.into_iter().map(|lap| self.drive.objective_row(lap));
        Ok(Evaluation::of_rows(rows.collect()))
    }
}
