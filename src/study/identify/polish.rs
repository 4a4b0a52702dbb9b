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

/// A polish ends when a step gains, and promises, less than this share of what one residual costs on the mean. A parameter that is
/// off by a standard error costs half as much as one residual. Steps of an exact fit promise nearly all of the cost, so this only ends
/// fits to noise.
const LEAST_GAIN: f64 = 1e-4;
/// The same for the soft bounds of the beginning, which are slow near a bound.
const SOFT_GAIN: f64 = 0.01;
/// Drives with soft bounds at the most.
const SOFT_DRIVES: usize = 60;
/// From soft bounds a candidate begins this share of the range away, where the sine would hold it for ever.
const MARGIN: f64 = 1e-3;
/// Drives after which a polish that has not converged is left where it is.
pub(super) const MOST_DRIVES: usize = 150;
/// Error that stands for every sample of a car that was lost: far above any real one, so the step is refused.
const LOST: f64 = 1e4;

/// Which share of its range stands for a parameter of the method.
#[derive(Clone, Copy, PartialEq)]
enum Bounds {
    /// `(1 + sin u)/2`, as MINUIT has it (James, Roos, 1975). Long steps from afar come back from a bound.
    Soft,
    /// `u`, held within 0 and 1. A parameter that a step leads out of them stays at its bound, and the further steps are of the
    /// others.
    Hard,
}

impl Bounds {
    fn share(self, u: f64) -> f64 {
        match self {
            Self::Soft => 0.5 * (1.0 + u.sin()),
            Self::Hard => u.clamp(0.0, 1.0),
        }
    }

    fn slope(self, u: f64) -> f64 {
        match self {
            Self::Soft => 0.5 * u.cos(),
            Self::Hard => f64::from(u8::from((0.0..=1.0).contains(&u))),
        }
    }

    fn of_share(self, share: f64) -> f64 {
        match self {
            Self::Soft => (2.0 * share.clamp(MARGIN, 1.0 - MARGIN) - 1.0).asin(),
            Self::Hard => share,
        }
    }
}

/// The problem of a method without bounds.
struct Bounded<'a> {
    replay: &'a ReplayProblem,
    variables: &'a [Variable],
    weights: [f64; CHANNELS],
    bounds: Bounds,
    u: DVector<f64>,
    /// The parameters that stay at the bound at which they are.
    held: Vec<bool>,
    current: Option<Residuals>,
    length: usize,
    /// Asked before every drive.
    watch: &'a mut dyn FnMut() -> ControlFlow<()>,
    interrupted: bool,
    /// The best shares of the ranges so far and their cost: where the method is interrupted it stands at one that was not driven.
    best: (DVector<f64>, f64),
}

impl Bounded<'_> {
    fn candidate(&self, shares: &DVector<f64>) -> Vec<f64> {
        let scaled =
            |(v, share): (&Variable, &f64)| (v.lower + (v.upper - v.lower) * share).clamp(v.lower, v.upper);
        self.variables.iter().zip(shares.iter()).map(scaled).collect()
    }

    /// Begins anew at the best point so far. Parameters at a hard bound that the cost pushes out are held there, all others move.
    fn begin(&mut self, bounds: Bounds) {
        self.bounds = bounds;
        let start = self.best.0.map(|share| bounds.of_share(share));
        self.held.fill(false);
        self.set_params(&start);
        if bounds == Bounds::Soft {
            return;
        }
        if let (Some(jacobian), Some(residuals)) = (self.jacobian(), self.residuals()) {
            let slopes = jacobian.tr_mul(&residuals);
            for (held, (u, slope)) in self.held.iter_mut().zip(start.iter().zip(slopes.iter())) {
                *held = (*u == 0.0 && *slope > 0.0) || (*u == 1.0 && *slope < 0.0);
            }
        }
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
            let shares = u.map(|u| self.bounds.share(u));
            self.current = self.replay.residuals(&self.candidate(&shares));
            if let Some(r) = &self.current {
                let weighted = r.errors.iter().enumerate().map(|(i, e)| self.weight(i) * e);
                let cost = 0.5 * weighted.map(|e| e * e).sum::<f64>();
                if cost < self.best.1 {
                    self.best = (shares, cost);
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
            if self.held[k] {
                return 0.0;
            }
            let v = &self.variables[k];
            self.weight(i) * r.columns[k][i] * (v.upper - v.lower) * self.bounds.slope(self.u[k])
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
    let shares = DVector::from_iterator(
        variables.len(),
        candidate.iter().zip(variables).map(|(x, v)| {
            let range = v.upper - v.lower;
            let share = if range > 0.0 { (x - v.lower) / range } else { 0.5 };
            share.clamp(0.0, 1.0)
        }),
    );
    let mut problem = Bounded {
        replay,
        variables,
        weights,
        bounds: Bounds::Soft,
        u: shares.clone(),
        held: vec![false; variables.len()],
        current: None,
        length,
        watch,
        interrupted: false,
        best: (shares, f64::INFINITY),
    };
    let (mut drives, mut before) = (0, f64::INFINITY);
    let mut bounds = Bounds::Soft;
    while drives < most_drives && !problem.interrupted {
        problem.begin(bounds);
        let left = most_drives - drives;
        let (left, least_gain) = match bounds {
            Bounds::Soft => (left.min(SOFT_DRIVES), SOFT_GAIN),
            Bounds::Hard => (left, LEAST_GAIN),
        };
        let least_gain = least_gain / length.max(1) as f64;
        let (driven, report) = LevenbergMarquardt::new()
            .with_patience((left / (variables.len() + 1)).max(1))
            .with_ftol(least_gain)
            .minimize(problem);
        problem = driven;
        drives += 1 + report.number_of_evaluations;
        let (from, to) = (before, problem.best.1);
        if bounds == Bounds::Hard {
            // A parameter that met its bound on the way may leave it again.
            if from - to <= least_gain * to {
                break;
            }
            before = to;
        }
        bounds = Bounds::Hard;
    }
    Some(Polished {
        candidate: problem.candidate(&problem.best.0),
        cost: problem.best.1,
        interrupted: problem.interrupted,
    })
}
