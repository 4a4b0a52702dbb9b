//! Parameters of wide range by their logarithms, for optimisers that learn the shape of a valley.
//!
//! Factors of the Magic Formula stand in for one another as products: `B C` is a slope, so that its valley is a
//! hyperbola over `B` and `C` and a straight line over their logarithms, which an adapted normal distribution can follow.

use super::{BackendInfo, Evaluation, Evaluator, Problem, Variable};
use crate::error::Result;

/// Parameters whose bounds are both positive and this far apart, as a ratio, are seen by their logarithm.
const WIDE: f64 = 1.5;

/// Whether optimisers see a parameter by its logarithm: both bounds are positive, and the upper is more than 1.5 times the lower.
pub fn is_logarithmic(variable: &Variable) -> bool {
    variable.lower > 0.0 && variable.upper > WIDE * variable.lower
}

/// An evaluator whose positive parameters of wide range are given as logarithms.
pub struct Logarithmic<'a> {
    inner: &'a mut dyn Evaluator,
    problem: Problem,
    logarithmic: Vec<bool>,
}

impl<'a> Logarithmic<'a> {
    /// The evaluator in these coordinates.
    pub fn new(inner: &'a mut dyn Evaluator) -> Self {
        let mut problem = inner.problem().clone();
        let logarithmic: Vec<bool> = problem.variables.iter().map(is_logarithmic).collect();
        for (variable, _) in problem
            .variables
            .iter_mut()
            .zip(&logarithmic)
            .filter(|(_, l)| **l)
        {
            variable.lower = variable.lower.ln();
            variable.upper = variable.upper.ln();
        }
        Self {
            inner,
            problem,
            logarithmic,
        }
    }

    /// A candidate in these coordinates.
    pub fn of_parameters(&self, candidate: &[f64]) -> Vec<f64> {
        let columns = candidate.iter().zip(&self.logarithmic);
        columns.map(|(x, l)| if *l { x.ln() } else { *x }).collect()
    }

    /// Candidates in the parameters' units, within the parameters' own bounds.
    pub fn to_parameters(&self, candidates: &[f64]) -> Vec<f64> {
        let own = &self.inner.problem().variables;
        let columns = self.logarithmic.iter().zip(own).cycle();
        candidates
            .iter()
            .zip(columns)
            .map(|(x, (l, v))| if *l { x.exp() } else { *x }.clamp(v.lower, v.upper))
            .collect()
    }
}

impl Evaluator for Logarithmic<'_> {
    fn problem(&self) -> &Problem {
        &self.problem
    }

    fn backend(&self) -> BackendInfo {
        self.inner.backend()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let parameters = self.to_parameters(population);
        self.inner.evaluate(&parameters)
    }
}
