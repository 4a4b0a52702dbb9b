//! Every algorithm on every problem of the suites at the same budget.
//!
//! Conventions: 25,000 evaluations, swarm and archive of 100, hypervolume with reference 1.1 per objective and IGD+
//! on the scale of the true front; for one objective 100,000 evaluations, 40 particles, and the distance of the
//! best cost from the optimum's.

use super::metrics::{hypervolume, igd_plus};
use super::problems::SuiteProblem;
use super::{Optimiser, Sizes, by_name, run};
use crate::error::Result;
use crate::evaluate::Problem;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Particles and evaluations of a comparison.
fn budget(problem: &Problem) -> (usize, usize) {
    if problem.objectives.len() > 1 {
        (100, 25_000)
    } else {
        (40, 100_000)
    }
}

/// Reference point of the hypervolume on the true front's scale, in every objective.
pub const REFERENCE: f64 = 1.1;
/// Points of the true front that IGD+ is taken over, about.
const FRONT_POINTS: usize = 2000;

/// The optimiser of that name for `problem` at the budget of the comparison.
///
/// # Errors
/// Those of [`by_name()`].
pub fn optimiser(name: &str, problem: &Problem, seed: u64) -> Result<Box<dyn Optimiser + Send>> {
    by_name(name, problem, sizes(problem, None, seed))
}

/// The budget of the comparison, or another number of evaluations.
fn sizes(problem: &Problem, evaluations: Option<usize>, seed: u64) -> Sizes {
    let (population, usual) = budget(problem);
    Sizes {
        population,
        iterations: evaluations.unwrap_or(usual) / population,
        archive: population,
        seed,
    }
}

/// What one run reached.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// Hypervolume of what was found; for one objective how far the best cost is from the optimum's.
    pub quality: f64,
    /// IGD+; `None` for one objective, and where the true front is not known or nothing was found.
    pub igd_plus: Option<f64>,
    /// Rows of objectives that were found. What violates constraints is left out.
    pub front: Vec<Vec<f64>>,
}

/// Runs an algorithm on a problem once for each seed from one to `seeds`, each run in a thread, at the budget of the
/// comparison or at another number of evaluations.
///
/// # Errors
/// Those of [`optimiser`].
pub fn compare(
    name: &str,
    problem: &SuiteProblem,
    seeds: u64,
    evaluations: Option<usize>,
) -> Result<Vec<Score>> {
    let truth = problem.scale().apply(&problem.front(FRONT_POINTS));
    let width = problem.problem().objectives.len();
    (1..=seeds)
        .into_par_iter()
        .map(|seed| {
            let sizes = sizes(problem.problem(), evaluations, seed);
            let mut optimiser = by_name(name, problem.problem(), sizes)?;
            let most = (sizes.population * sizes.iterations) as u64;
            run(optimiser.as_mut(), &mut problem.evaluator(), |p| {
                // Trials of mutation are evaluations too, and the budget is one for all.
                match p.evaluations >= most {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                }
            })?;
            let found = optimiser.front();
            let front = match found.is_feasible() {
                true => found.objectives,
                false => Vec::new(),
            };
            let scaled = problem.scale().apply(&front);
            if width == 1 {
                return Ok(Score {
                    quality: scaled.first().map_or(f64::INFINITY, |row| row[0]),
                    igd_plus: None,
                    front,
                });
            }
            let judged = !truth.is_empty() && !scaled.is_empty();
            Ok(Score {
                quality: hypervolume(&scaled, &vec![REFERENCE; width])?,
                igd_plus: judged.then(|| igd_plus(&scaled, &truth)).transpose()?,
                front,
            })
        })
        .collect()
}

/// First quartile, median and third quartile, by linear interpolation; not a number where there is no value.
pub fn quartiles(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    let at = |share: f64| {
        let place = share * last as f64;
        let (below, above) = (
            sorted.get(place.floor() as usize),
            sorted.get(place.ceil() as usize),
        );
        match (below, above) {
            (Some(a), Some(b)) => a + (b - a) * place.fract(),
            _ => f64::NAN,
        }
    };
    [0.25, 0.5, 0.75].map(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_by_hand() {
        assert_eq!(quartiles(&[4.0, 1.0, 3.0, 2.0, 5.0]), [2.0, 3.0, 4.0]);
        assert_eq!(quartiles(&[1.0, 2.0]), [1.25, 1.5, 1.75]);
        assert!(quartiles(&[])[1].is_nan());
    }
}
