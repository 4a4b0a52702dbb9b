//! Least-squares polish of a candidate on the exact Jacobian, in `f64`, within the bounds.

use super::descent::{LeastSquares, Place, descend};
use super::setup::CHANNELS;
use crate::evaluate::replay::ReplayProblem;
use crate::evaluate::{Variable, is_logarithmic};
use nalgebra::{DMatrix, DVector};
use std::ops::ControlFlow;

/// The outcome of a polish.
#[derive(Clone, Debug)]
pub struct Polished {
    /// The polished candidate.
    pub candidate: Vec<f64>,
    /// Half the sum of the squares of the weighted errors.
    pub cost: f64,
    /// Whether it was interrupted.
    pub interrupted: bool,
}

/// A polish ends where least squares promises to gain less than this share of what one residual costs on the mean. A parameter that
/// is off by a standard error costs as much as one residual, so this is what one costs that is off by a hundredth.
const LEAST_GAIN: f64 = 1e-4;
/// While a polish costs more than a minimum that is known, it ends where least squares promises less than this share of its cost.
const LEAST_GAIN_ABOVE: f64 = 1e-5;
/// Steps after which a polish that has not converged is left where it is. From what small swarms find, 30 to 50 lead to the minimum.
pub(super) const MOST_STEPS: usize = 100;
/// Drives that a step takes: two without derivatives, and one with them where it gains.
pub(super) const DRIVES_A_STEP: usize = 3;

/// A parameter over its range, or over that of its logarithm.
struct Scale {
    lower: f64,
    range: f64,
    logarithmic: bool,
}

impl Scale {
    fn of(variable: &Variable) -> Self {
        let logarithmic = is_logarithmic(variable);
        let seen = |x: f64| if logarithmic { x.ln() } else { x };
        Self {
            lower: seen(variable.lower),
            range: seen(variable.upper) - seen(variable.lower),
            logarithmic,
        }
    }

    fn share(&self, x: f64) -> f64 {
        let seen = if self.logarithmic { x.ln() } else { x };
        if self.range > 0.0 {
            ((seen - self.lower) / self.range).clamp(0.0, 1.0)
        } else {
            0.5
        }
    }

    fn parameter(&self, share: f64) -> f64 {
        let seen = self.lower + self.range * share;
        if self.logarithmic { seen.exp() } else { seen }
    }

    /// The derivative of the parameter, which is `x`, to its share.
    fn slope(&self, x: f64) -> f64 {
        self.range * if self.logarithmic { x } else { 1.0 }
    }
}

/// Errors of replays over the parameters' shares of their ranges.
struct Replays<'a> {
    replay: &'a ReplayProblem,
    scales: Vec<Scale>,
    weights: [f64; CHANNELS],
    /// Asked before every drive.
    watch: &'a mut dyn FnMut() -> ControlFlow<()>,
}

impl Replays<'_> {
    fn candidate(&self, shares: &DVector<f64>) -> Vec<f64> {
        let scaled = self.scales.iter().zip(shares.iter());
        let variables = &self.replay.problem.variables;
        let within = |((scale, share), v): ((&Scale, &f64), &Variable)| {
            scale.parameter(*share).clamp(v.lower, v.upper)
        };
        scaled.zip(variables).map(within).collect()
    }

    fn weighted(&self, row: usize, error: f64) -> f64 {
        self.weights[row % CHANNELS] * error
    }
}

impl LeastSquares for Replays<'_> {
    fn errors(&mut self, x: &DVector<f64>) -> ControlFlow<(), Option<DVector<f64>>> {
        (self.watch)()?;
        let errors = self.replay.errors(&self.candidate(x));
        let weighted = |errors: Vec<f64>| DVector::from_fn(errors.len(), |i, _| self.weighted(i, errors[i]));
        ControlFlow::Continue(errors.map(weighted))
    }

    fn place(&mut self, x: DVector<f64>) -> ControlFlow<(), Option<Place>> {
        (self.watch)()?;
        let candidate = self.candidate(&x);
        let Some(residuals) = self.replay.residuals(&candidate) else {
            return ControlFlow::Continue(None);
        };
        let rows = residuals.errors.len();
        let slopes: Vec<f64> = self
            .scales
            .iter()
            .zip(&candidate)
            .map(|(s, x)| s.slope(*x))
            .collect();
        ControlFlow::Continue(Some(Place {
            errors: DVector::from_fn(rows, |i, _| self.weighted(i, residuals.errors[i])),
            jacobian: DMatrix::from_fn(rows, x.len(), |i, k| {
                self.weighted(i, residuals.columns[k][i] * slopes[k])
            }),
            x,
        }))
    }
}

/// Polishes `candidate` with the errors of each channel weighted by `weights` (one over their noise, or scale).
/// `None` if the candidate is lost from the start.
pub fn polish(replay: &ReplayProblem, candidate: &[f64], weights: [f64; CHANNELS]) -> Option<Polished> {
    polish_observed(replay, candidate, weights, MOST_STEPS, &mut || {
        ControlFlow::Continue(())
    })
}

/// As [`polish`], with no more than `most_steps`; `watch` is asked before each drive but the first and may break the polish off.
pub(super) fn polish_observed(
    replay: &ReplayProblem,
    candidate: &[f64],
    weights: [f64; CHANNELS],
    most_steps: usize,
    watch: &mut dyn FnMut() -> ControlFlow<()>,
) -> Option<Polished> {
    polish_below(f64::INFINITY, replay, candidate, weights, most_steps, watch)
}

/// As [`polish_observed`], to the end only where that comes to less than the cost `known` of a minimum that is known.
pub(super) fn polish_below(
    known: f64,
    replay: &ReplayProblem,
    candidate: &[f64],
    weights: [f64; CHANNELS],
    most_steps: usize,
    watch: &mut dyn FnMut() -> ControlFlow<()>,
) -> Option<Polished> {
    let scales: Vec<Scale> = replay.problem.variables.iter().map(Scale::of).collect();
    let shares = scales.iter().zip(candidate).map(|(scale, x)| scale.share(*x));
    let shares = DVector::from_iterator(scales.len(), shares);
    let mut first = || ControlFlow::Continue(());
    let mut replays = Replays {
        replay,
        scales,
        weights,
        watch: &mut first,
    };
    let mut place = replays.place(shares).continue_value()??;
    replays.watch = watch;
    let to_the_end = LEAST_GAIN / place.errors.len().max(1) as f64;
    let least_gain = |cost: f64| {
        if cost < known {
            to_the_end
        } else {
            LEAST_GAIN_ABOVE
        }
    };
    let flow = descend(&mut replays, &mut place, most_steps, least_gain);
    Some(Polished {
        candidate: replays.candidate(&place.x),
        cost: place.cost(),
        interrupted: flow.is_break(),
    })
}
