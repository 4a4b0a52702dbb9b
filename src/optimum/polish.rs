//! Many lines at once, each led downhill by exact gradients.

use super::bounded::{Budget, Ending, minimise};
use super::bounds::{Bounds, check};
use super::objective::{LineProblem, Measures, Weights};
use crate::Result;
use rayon::prelude::*;

/// A line and what it shall be judged by.
#[derive(Clone, Debug)]
pub struct Start {
    /// The line's variables.
    pub x: Vec<f64>,
    /// What counts, and how much.
    pub weights: Weights,
}

/// A polished line.
#[derive(Clone, Debug)]
pub struct Polished {
    /// The line's variables.
    pub x: Vec<f64>,
    /// Its weighted cost.
    pub cost: f64,
    /// Its measures.
    pub measures: Measures,
    /// How the minimisation ended.
    pub ending: Ending,
    /// Evaluations of cost and gradient that it took.
    pub evaluations: usize,
}

/// Largest change of a variable in the first step, as a share of its range where that is 1.
const FIRST_STEP: f64 = 0.01;

/// Polishes every line of `starts` by its own weights, within `bounds`. The results keep the order of the starts and do
/// not depend on the threads; none is worse than its start.
///
/// # Errors
/// [`crate::Error::Input`] for bounds that do not fit the problem's lines.
pub fn polish_lines(
    problem: &LineProblem,
    bounds: &Bounds,
    starts: &[Start],
    budget: &Budget,
) -> Result<Vec<Polished>> {
    check(problem.map, bounds)?;
    let polish = |start: &Start| {
        let cost = |x: &[f64]| problem.cost(&start.weights, x);
        let minimum = minimise(cost, &start.x, &bounds.lower, &bounds.upper, FIRST_STEP, budget);
        Polished {
            measures: problem.measures(&minimum.x),
            x: minimum.x,
            cost: minimum.cost,
            ending: minimum.ending,
            evaluations: minimum.evaluations,
        }
    };
    Ok(starts.par_iter().map(polish).collect())
}
