//! The reference backend: `f64`, one candidate after another, threads by rayon.

use super::kernel::{CHANNELS, drive_window, score_window};
use super::problem::{Norm, Plan, ReplayProblem, Window};
use crate::error::Result;
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Problem};
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

/// Scores replays in `f64`.
pub struct CpuEvaluator<'a> {
    replay: &'a ReplayProblem,
}

impl<'a> CpuEvaluator<'a> {
    /// An evaluator of `replay`.
    pub fn new(replay: &'a ReplayProblem) -> Self {
        Self { replay }
    }

    fn errors<T: Tyre<f64>>(&self, flat: &[f64]) -> Option<[f64; CHANNELS]> {
        let car = CarModel::<f64, T>::from_parameters(|i| flat[i]);
        let mut total = [0.0; CHANNELS];
        for window in &self.replay.plan.windows {
            let score = score_window(&car, &self.replay.plan, window);
            if !score.drives {
                return None;
            }
            self.replay.accumulate(&mut total, score.errors);
        }
        Some(total)
    }
}

impl Evaluator for CpuEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.replay.problem
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::reference()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let rows: Vec<_> = population
            .par_chunks_exact(self.replay.dimensions().max(1))
            .map(|candidate| {
                if let Some(failure) = self.replay.free.preliminary_failure(candidate) {
                    return (self.replay.objective_row(None).0, Some(failure));
                }
                let flat = self.replay.flat(candidate);
                self.replay.objective_row(match self.replay.tyre_model() {
                    TyreModel::MagicFormula => self.errors::<MagicFormula<f64>>(&flat),
                    TyreModel::Linear => self.errors::<LinearTyre<f64>>(&flat),
                })
            })
            .collect();
        Ok(Evaluation::of_rows(rows))
    }
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

/// The norm's name in studies and manifests.
pub fn norm_name(norm: Norm) -> &'static str {
    match norm {
        Norm::One => "1",
        Norm::Two => "2",
        Norm::Infinity => "infinity",
        Norm::MeanSquare => "mse",
    }
}
