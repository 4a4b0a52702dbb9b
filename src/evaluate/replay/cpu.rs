//! The reference backend: `f64`, one candidate after another, threads by rayon.

use super::kernel::{CHANNELS, drive_window, score_window};
use super::plan::{Plan, Window, initial_state};
use super::problem::ReplayProblem;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

fn errors_on<T: Tyre<f64>>(replay: &ReplayProblem, candidate: &[f64]) -> Option<[f64; CHANNELS]> {
    let flat = replay.flat(candidate);
    let car = CarModel::<f64, T>::from_parameters(|i| flat[i]);
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

/// How far ahead of a window a car is driven to find the state in which it comes there, s.
const RUN_AHEAD_S: f64 = 6.0;

/// See [`ReplayProblem::start_errors`].
pub(super) fn start_errors(replay: &ReplayProblem, flat: &[f64]) -> Vec<f64> {
    match replay.tyre_model() {
        TyreModel::MagicFormula => start_errors_on::<MagicFormula<f64>>(replay, flat),
        TyreModel::Linear => start_errors_on::<LinearTyre<f64>>(replay, flat),
    }
}

fn start_errors_on<T: Tyre<f64>>(replay: &ReplayProblem, flat: &[f64]) -> Vec<f64> {
    let plan = &replay.plan;
    let car = CarModel::<f64, T>::from_parameters(|i| flat[i]);
    let driven = |window: &Window<f64>| {
        let mut outputs = Vec::with_capacity(window.end - window.start);
        let (drives, state) = drive_window(&car, plan, window, |_: usize, output: [f64; CHANNELS]| {
            outputs.push(output)
        });
        drives.then_some((outputs, state))
    };
    let reach = (RUN_AHEAD_S / replay.interval_s).round() as usize;
    let differences = |window: &Window<f64>| {
        let mut ahead = plan.samples[..window.start].iter().rev().take(reach);
        let slow = ahead.position(|s| s.measured[0] < replay.slowest_mps);
        let reach = slow.unwrap_or(window.start.min(reach));
        let begin = window.start - reach;
        let before = Window {
            start: begin,
            end: window.start + 1,
            scored_from: 0,
            initial: initial_state(&plan.samples[begin]),
        };
        let (_, state) = (reach > 0).then(|| driven(&before)).flatten()?;
        let own = Window {
            initial: state.to_array(),
            ..*window
        };
        let ((from_own, _), (from_log, _)) = (driven(&own)?, driven(window)?);
        let both = from_own.into_iter().zip(from_log).skip(window.scored_from);
        Some(
            both.flat_map(|(own, log)| std::array::from_fn::<f64, CHANNELS, _>(|k| own[k] - log[k]))
                .collect::<Vec<f64>>(),
        )
    };
    let by_window = plan.windows.par_iter().map(|window| {
        let scored = window.end - window.start - window.scored_from;
        differences(window).unwrap_or_else(|| vec![0.0; scored * CHANNELS])
    });
    by_window.collect::<Vec<Vec<f64>>>().concat()
}

/// The four compared outputs at every sample of `window`, and whether the car drove to its end.
///
/// `flat` is a car in flat form. From sample to sample as [`drive_window`] drives it, in `f64`.
pub fn trace(
    flat: &[f64],
    model: TyreModel,
    plan: &Plan<f64>,
    window: &Window<f64>,
) -> (Vec<[f64; CHANNELS]>, bool) {
    fn go<T: Tyre<f64>>(
        flat: &[f64],
        plan: &Plan<f64>,
        window: &Window<f64>,
    ) -> (Vec<[f64; CHANNELS]>, bool) {
        let car = CarModel::<f64, T>::from_parameters(|i| flat[i]);
        let mut outputs = Vec::with_capacity(window.end - window.start);
        let (drives, _) = drive_window(&car, plan, window, |_: usize, output: [f64; CHANNELS]| {
            outputs.push(output)
        });
        (outputs, drives)
    }
    match model {
        TyreModel::MagicFormula => go::<MagicFormula<f64>>(flat, plan, window),
        TyreModel::Linear => go::<LinearTyre<f64>>(flat, plan, window),
    }
}
