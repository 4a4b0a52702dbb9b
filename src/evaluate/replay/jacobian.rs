//! Exact derivatives of the replayed outputs to the free parameters, by dual numbers.

use super::kernel::{CHANNELS, drive_window};
use super::plan::Window;
use super::problem::ReplayProblem;
use crate::scalar::Dual;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

/// Parameters that are differentiated to in one drive: as many doubles as the widest register holds.
const CHUNK: usize = 8;

/// Errors of the outputs, and their derivatives.
#[derive(Clone, Debug)]
pub struct Residuals {
    /// Output minus measurement, in the channels' units: by window, by scored sample, by channel.
    pub errors: Vec<f64>,
    /// For each free parameter, the derivative of every error to it.
    pub columns: Vec<Vec<f64>>,
}

/// Errors by scored sample and channel, each with its derivatives.
type Duals = Vec<Dual<CHUNK>>;

/// A drive through a window with the derivatives to `CHUNK` parameters from `first`; `None` if the car is lost.
#[inline(always)]
fn drive_chunk<T: Tyre<Dual<CHUNK>>>(
    replay: &ReplayProblem,
    candidate: &[f64],
    first: usize,
    window: &Window<f64>,
) -> Option<Duals> {
    let variable = |i: usize| match i.checked_sub(first) {
        Some(k) if k < CHUNK => Dual::variable(candidate[i], k),
        _ => Dual::constant(candidate[i]),
    };
    let car = CarModel::<Dual<CHUNK>, T>::from_parameters(|slot| {
        replay.free.sources()[slot].map_or(Dual::constant(replay.free.base()[slot]), variable)
    });
    let mut errors = Vec::with_capacity((window.end - window.start - window.scored_from) * CHANNELS);
    let (drives, _) = drive_window(
        &car,
        &replay.plan,
        window,
        |i: usize, outputs: [Dual<CHUNK>; CHANNELS]| {
            if i >= window.scored_from {
                let measured = &replay.plan.samples[window.start + i].measured;
                errors.extend((0..CHANNELS).map(|k| outputs[k] - Dual::constant(measured[k])));
            }
        },
    );
    drives.then_some(errors)
}

/// [`drive_chunk`] compiled for what the processor has: the gradients are arrays that fill its registers.
fn drive_dispatched(
    replay: &ReplayProblem,
    candidate: &[f64],
    first: usize,
    window: &Window<f64>,
) -> Option<Duals> {
    #[inline(always)]
    fn by_model(
        replay: &ReplayProblem,
        candidate: &[f64],
        first: usize,
        window: &Window<f64>,
    ) -> Option<Duals> {
        match replay.tyre_model() {
            TyreModel::MagicFormula => {
                drive_chunk::<MagicFormula<Dual<CHUNK>>>(replay, candidate, first, window)
            }
            TyreModel::Linear => drive_chunk::<LinearTyre<Dual<CHUNK>>>(replay, candidate, first, window),
        }
    }
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn with_avx2(
            replay: &ReplayProblem,
            candidate: &[f64],
            first: usize,
            window: &Window<f64>,
        ) -> Option<Duals> {
            by_model(replay, candidate, first, window)
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has the set, as just detected.
            return unsafe { with_avx2(replay, candidate, first, window) };
        }
    }
    by_model(replay, candidate, first, window)
}

impl ReplayProblem {
    /// The errors of a candidate with their exact derivatives; `None` if the candidate fails. Windows, and eight parameters each, are
    /// driven side by side.
    pub fn residuals(&self, candidate: &[f64]) -> Option<Residuals> {
        if self.free.preliminary_failure(candidate).is_some() {
            return None;
        }
        let windows = &self.plan.windows;
        let starts = (0..self.dimensions().max(1)).step_by(CHUNK);
        let drives: Vec<(usize, &Window<f64>)> = starts
            .flat_map(|first| windows.iter().map(move |window| (first, window)))
            .collect();
        let driven: Vec<Duals> = drives
            .par_iter()
            .map(|&(first, window)| drive_dispatched(self, candidate, first, window))
            .collect::<Option<_>>()?;
        let chunks: Vec<&[Duals]> = driven.chunks(windows.len().max(1)).collect();
        let errors: Vec<f64> = chunks.first()?.iter().flatten().map(|e| e.value).collect();
        let column = |i: usize| -> Vec<f64> {
            let chunk = chunks[i / CHUNK].iter().flatten();
            chunk.map(|e| e.gradient[i % CHUNK]).collect()
        };
        let columns: Vec<Vec<f64>> = (0..self.dimensions()).map(column).collect();
        let finite = |column: &Vec<f64>| column.iter().all(|x| x.is_finite());
        (finite(&errors) && columns.iter().all(finite)).then_some(Residuals { errors, columns })
    }
}
