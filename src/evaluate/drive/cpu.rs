//! The reference backend: `f64`, one lap after another, threads by rayon.

use super::problem::DriveProblem;
use crate::drive::Course;
use crate::drive::driver::Pace;
use crate::drive::kernel::{DriveState, DrivenLap, drive_on};
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

fn lap_on<T: Tyre<f64>>(drive: &DriveProblem, candidate: &[f64]) -> DrivenLap {
    let flat = drive.free.flat(candidate);
    let car = CarModel::<f64, T>::from_parameters(&flat);
    let [line, plan, share] = drive.lap_figures(candidate);
    let world = drive.world();
    let course = Course::at(world.road, line);
    let pace = Pace { plan, share };
    let mut state = DriveState::begin(&world, &course, &pace);
    drive_on(&car, &world, (&course, &pace), &mut state, &mut 0, u32::MAX);
    drive.lap(state.to_array())
}

/// The laps of candidates in `f64`.
pub(super) fn laps(drive: &DriveProblem, candidates: &[&[f64]]) -> Vec<DrivenLap> {
    let lap = match drive.tyre_model() {
        TyreModel::MagicFormula => lap_on::<MagicFormula<f64>>,
        TyreModel::Linear => lap_on::<LinearTyre<f64>>,
    };
    candidates
        .par_iter()
        .map(|candidate| lap(drive, candidate))
        .collect()
}
