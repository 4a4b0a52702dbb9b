//! Exact derivatives of the replayed outputs to the free parameters, by dual numbers.

use super::cpu::trace;
use super::kernel::{CHANNELS, drive_window};
use super::plan::Window;
use super::problem::ReplayProblem;
use crate::scalar::{Dual, GRADIENT};
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

/// Errors of the outputs, and their derivatives.
#[derive(Clone, Debug)]
pub struct Residuals {
    /// Output minus measurement, in the channels' units: by window, by scored sample, by channel.
    pub errors: Vec<f64>,
    /// For each free parameter, the derivative of every error to it.
    pub columns: Vec<Vec<f64>>,
}

/// Errors by scored sample and channel, each with its derivatives.
type Duals = Vec<Dual>;

/// A drive through a window with the derivatives to `GRADIENT` parameters from `first`; `None` if the car is lost.
fn drive_chunk<T: Tyre<Dual>>(
    replay: &ReplayProblem,
    candidate: &[f64],
    first: usize,
    window: &Window<f64>,
) -> Option<Duals> {
    let variable = |i: usize| match i.checked_sub(first) {
        Some(k) if k < GRADIENT => Dual::variable(candidate[i], k),
        _ => Dual::constant(candidate[i]),
    };
    let slots = replay.free.base().iter().zip(replay.free.sources());
    let flat: Vec<Dual> = slots
        .map(|(base, source)| source.map_or(Dual::constant(*base), variable))
        .collect();
    let car = CarModel::<Dual, T>::from_parameters(&flat);
    let mut errors = Vec::with_capacity((window.end - window.start - window.scored_from) * CHANNELS);
    let (drives, _) = drive_window(
        &car,
        &replay.plan,
        window,
        |i: usize, outputs: [Dual; CHANNELS]| {
            if i >= window.scored_from {
                let measured = &replay.plan.samples[window.start + i].measured;
                errors.extend((0..CHANNELS).map(|k| outputs[k] - Dual::constant(measured[k])));
            }
        },
    );
    drives.then_some(errors)
}

impl ReplayProblem {
    /// The errors of a candidate in the channels' units, by window, by scored sample, by channel, as in [`Residuals::errors`]; `None`
    /// if the candidate fails. Windows are driven side by side.
    pub fn errors(&self, candidate: &[f64]) -> Option<Vec<f64>> {
        if self.free.preliminary_failure(candidate).is_some() {
            return None;
        }
        let flat = self.flat(candidate);
        let errors = |window: &Window<f64>| -> Option<Vec<f64>> {
            let traced = trace(&flat, self.tyre_model(), &self.plan, window);
            let scored = window.start + window.scored_from..window.end;
            let outputs = &traced.outputs[window.scored_from..];
            let pairs = outputs.iter().zip(&self.plan.samples[scored]);
            let errors =
                pairs.flat_map(|(outputs, s)| (0..CHANNELS).map(move |k| outputs[k] - s.measured[k]));
            traced.drives.then(|| errors.collect())
        };
        let driven: Vec<Vec<f64>> = self.plan.windows.par_iter().map(errors).collect::<Option<_>>()?;
        let errors = driven.concat();
        errors.iter().all(|x| x.is_finite()).then_some(errors)
    }

    /// The errors of a candidate with their exact derivatives; `None` if the candidate fails. Windows, and eight parameters each, are
    /// driven side by side.
    pub fn residuals(&self, candidate: &[f64]) -> Option<Residuals> {
        if self.free.preliminary_failure(candidate).is_some() {
            return None;
        }
        let windows = &self.plan.windows;
        let starts = (0..self.dimensions().max(1)).step_by(GRADIENT);
        let drives: Vec<(usize, &Window<f64>)> = starts
            .flat_map(|first| windows.iter().map(move |window| (first, window)))
            .collect();
        let chunk = match self.tyre_model() {
            TyreModel::MagicFormula => drive_chunk::<MagicFormula<Dual>>,
            TyreModel::Linear => drive_chunk::<LinearTyre<Dual>>,
        };
        let driven: Vec<Duals> = drives
            .par_iter()
            .map(|&(first, window)| chunk(self, candidate, first, window))
            .collect::<Option<_>>()?;
        let chunks: Vec<&[Duals]> = driven.chunks(windows.len().max(1)).collect();
        let errors: Vec<f64> = chunks.first()?.iter().flatten().map(|e| e.value).collect();
        let column = |i: usize| -> Vec<f64> {
            let chunk = chunks[i / GRADIENT].iter().flatten();
            chunk.map(|e| e.gradient[i % GRADIENT]).collect()
        };
        let columns: Vec<Vec<f64>> = (0..self.dimensions()).map(column).collect();
        let finite = |column: &Vec<f64>| column.iter().all(|x| x.is_finite());
        (finite(&errors) && columns.iter().all(finite)).then_some(Residuals { errors, columns })
    }
}
