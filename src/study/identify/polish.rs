//! Least-squares polish of a candidate: Levenberg-Marquardt on the exact Jacobian, in `f64`, within the bounds.

use super::setup::CHANNELS;
use crate::evaluate::Variable;
use crate::evaluate::replay::{ReplayProblem, Residuals};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, VecStorage};
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

/// A candidate is moved this share of the range away from a bound before it is polished, where the
/// transformation below would otherwise hold it for ever.
const MARGIN: f64 = 1e-3;
/// A polish ends when a step gains less than this share of the cost. An exact fit gains orders of magnitude with each
/// step until it is down to rounding, so this only ends fits to noise.
const LEAST_GAIN: f64 = 1e-9;
/// Drives after which a polish that has not converged is left where it is.
pub(super) const MOST_DRIVES: usize = 150;
/// Error that stands for every sample of a car that was lost: far above any real one, so the step is refused.
const LOST: f64 = 1e4;

/// Bounds by `x = lower + range (1 + sin u)/2` with `u` unbounded, as MINUIT has it (James, Roos, 1975).
struct Bounded<'a> {
    replay: &'a ReplayProblem,
    variables: &'a [Variable],
    weights: [f64; CHANNELS],
    u: DVector<f64>,
    current: Option<Residuals>,
    length: usize,
    /// Asked before every drive.
    watch: &'a mut dyn FnMut() -> ControlFlow<()>,
    interrupted: bool,
    /// The best point so far and its cost: where the method is interrupted it stands at one that was not driven.
    best: (DVector<f64>, f64),
}

impl Bounded<'_> {
    fn candidate(&self, u: &DVector<f64>) -> Vec<f64> {
        let scaled = |(v, u): (&Variable, &f64)| {
            (v.lower + 0.5 * (v.upper - v.lower) * (1.0 + u.sin())).clamp(v.lower, v.upper)
        };
        self.variables.iter().zip(u.iter()).map(scaled).collect()
    }

    fn weight(&self, row: usize) -> f64 {
        self.weights[row % CHANNELS]
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Bounded<'_> {
    type ResidualStorage = VecStorage<f64, Dyn, nalgebra::U1>;
    type JacobianStorage = VecStorage<f64, Dyn, Dyn>;
    type ParameterStorage = VecStorage<f64, Dyn, nalgebra::U1>;

    fn set_params(&mut self, u: &DVector<f64>) {
        self.u.copy_from(u);
        self.interrupted |= (self.watch)().is_break();
        if !self.interrupted {
            self.current = self.replay.residuals(&self.candidate(u));
            if let Some(r) = &self.current {
                let weighted = r.errors.iter().enumerate().map(|(i, e)| self.weight(i) * e);
                let cost = 0.5 * weighted.map(|e| e * e).sum::<f64>();
                if cost < self.best.1 {
                    self.best = (u.clone(), cost);
                }
            }
        }
    }

    fn params(&self) -> DVector<f64> {
        self.u.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        // Nothing ends the method.
        if self.interrupted {
            return None;
        }
        Some(match &self.current {
            Some(r) => DVector::from_fn(self.length, |i, _| self.weight(i) * r.errors[i]),
            None => DVector::from_element(self.length, LOST),
        })
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let r = self.current.as_ref()?;
        Some(DMatrix::from_fn(self.length, self.variables.len(), |i, k| {
            let v = &self.variables[k];
            self.weight(i) * r.columns[k][i] * 0.5 * (v.upper - v.lower) * self.u[k].cos()
        }))
    }
}

/// Polishes `candidate` with the errors of each channel weighted by `weights` (one over their noise, or scale).
/// `None` if the candidate is lost from the start.
pub fn polish(replay: &ReplayProblem, candidate: &[f64], weights: [f64; CHANNELS]) -> Option<Polished> {
    polish_observed(replay, candidate, weights, MOST_DRIVES, &mut || {
        ControlFlow::Continue(())
    })
}

/// As [`polish`], with no more than `most_drives`; `watch` is asked before each drive and may break the polish off.
pub(super) fn polish_observed(
    replay: &ReplayProblem,
    candidate: &[f64],
    weights: [f64; CHANNELS],
    most_drives: usize,
    watch: &mut dyn FnMut() -> ControlFlow<()>,
) -> Option<Polished> {
    let length = replay.residuals(candidate)?.errors.len();
    let variables = &replay.problem.variables;
    let u = DVector::from_iterator(
        variables.len(),
        candidate.iter().zip(variables).map(|(x, v)| {
            let range = v.upper - v.lower;
            let share = if range > 0.0 { (x - v.lower) / range } else { 0.5 };
            (2.0 * share.clamp(MARGIN, 1.0 - MARGIN) - 1.0).asin()
        }),
    );
    let mut problem = Bounded {
        replay,
        variables,
        weights,
        u: u.clone(),
        current: None,
        length,
        watch,
        interrupted: false,
        best: (u.clone(), f64::INFINITY),
    };
    problem.set_params(&u);
    let patience = (most_drives / (variables.len() + 1)).max(1);
    let (problem, _) = LevenbergMarquardt::new()
        .with_patience(patience)
        .with_ftol(LEAST_GAIN)
        .minimize(problem);
    Some(Polished {
        candidate: problem.candidate(&problem.best.0),
        cost: problem.best.1,
        interrupted: problem.interrupted,
    })
}
