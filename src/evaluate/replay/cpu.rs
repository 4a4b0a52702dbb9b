//! The reference backend: `f64`, one candidate after another, threads by rayon.

use super::kernel::{CHANNELS, Visit, drive_window, score_window};
use super::plan::{Plan, Window};
use super::problem::ReplayProblem;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, CarState, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

fn errors_on<T: Tyre<f64>>(replay: &ReplayProblem, candidate: &[f64]) -> Option<[f64; CHANNELS]> {
    let flat = replay.flat(candidate);
    let car = CarModel::<f64, T>::from_parameters(&flat);
    let mut total = [0.0; CHANNELS];
    for window in &replay.plan.windows {
        let score = score_window(&car, &replay.plan, window);
        if !score.drives {
            return None;
        }
        replay.accumulate(&mut total, score.errors);
    }
    Some(total)
}

/// The errors of candidates in `f64`; nothing of those that do not drive to the end.
pub(super) fn errors(replay: &ReplayProblem, candidates: &[&[f64]]) -> Vec<Option<[f64; CHANNELS]>> {
    let errors = match replay.tyre_model() {
        TyreModel::MagicFormula => errors_on::<MagicFormula<f64>>,
        TyreModel::Linear => errors_on::<LinearTyre<f64>>,
    };
    candidates
        .par_iter()
        .map(|candidate| errors(replay, candidate))
        .collect()
}

/// A window as a car drives it.
pub struct Traced {
    /// The four compared outputs at every sample.
    pub outputs: Vec<[f64; CHANNELS]>,
    /// The car there.
    pub states: Vec<CarState<f64>>,
    /// Whether it drove to the end.
    pub drives: bool,
}

impl Visit<f64> for &mut Traced {
    fn visit(&mut self, _: usize, state: &CarState<f64>, outputs: [f64; CHANNELS]) {
        self.outputs.push(outputs);
        self.states.push(*state);
    }
}

/// `window` as a car in flat form drives it: from sample to sample as [`drive_window`] has it, in `f64`.
pub fn trace(flat: &[f64], model: TyreModel, plan: &Plan<f64>, window: &Window<f64>) -> Traced {
    fn go<T: Tyre<f64>>(flat: &[f64], plan: &Plan<f64>, window: &Window<f64>) -> Traced {
        let car = CarModel::<f64, T>::from_parameters(flat);
        let samples = window.end - window.start;
        let mut traced = Traced {
            outputs: Vec::with_capacity(samples),
            states: Vec::with_capacity(samples),
            drives: false,
        };
        let (drives, _) = drive_window(&car, plan, window, &mut traced);
        Traced { drives, ..traced }
    }
    match model {
        TyreModel::MagicFormula => go::<MagicFormula<f64>>(flat, plan, window),
        TyreModel::Linear => go::<LinearTyre<f64>>(flat, plan, window),
    }
}

impl ReplayProblem {
    /// Lets every window start from the state in which the base car comes there, lateral speed and roll with it, which no
    /// log has: the base car's cost is then that of whole laps, and what others add is their own. A window that the base car
    /// does not reach starts as before.
    pub fn start_as_base_drives(&mut self) {
        let base = self.free.base().to_vec();
        match self.tyre_model() {
            TyreModel::MagicFormula => chained::<MagicFormula<f64>>(&mut self.plan, &base),
            TyreModel::Linear => chained::<LinearTyre<f64>>(&mut self.plan, &base),
        }
    }
}

fn chained<T: Tyre<f64>>(plan: &mut Plan<f64>, flat: &[f64]) {
    let car = CarModel::<f64, T>::from_parameters(flat);
    let mut before: Option<Window<f64>> = None;
    for k in 0..plan.windows.len() {
        let window = plan.windows[k];
        if let Some(before) = before.filter(|b| b.start < window.start) {
            let between = Window {
                end: window.start + 1,
                ..before
            };
            let (drives, state) = drive_window(&car, plan, &between, |_: usize, _: [f64; CHANNELS]| {});
            if drives {
                plan.windows[k].initial = state.to_array();
            }
        }
        before = Some(plan.windows[k]);
    }
}
