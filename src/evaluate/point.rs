//! An evaluator of any function of a point, in `f64`.

use super::{BackendInfo, Evaluation, Evaluator, FAILED_COST, Failure, Problem};
use crate::error::Result;
use rayon::prelude::*;

/// What one call of the function costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallCost {
    /// Less than handing it to another thread costs: candidates are evaluated one after the other.
    Cheap,
    /// More: candidates are spread over the threads.
    Dear,
}

/// Scores candidates by a function that reads a candidate, in the variables' units, and writes its objectives.
pub struct PointEvaluator<F> {
    problem: Problem,
    constraints: usize,
    cost: CallCost,
    function: F,
}

impl<F: Fn(&[f64], &mut [f64]) + Sync> PointEvaluator<F> {
    /// An evaluator of `problem`. `function` is given a row of the variables and one of the objectives.
    pub fn new(problem: Problem, cost: CallCost, function: F) -> Self {
        Self {
            problem,
            constraints: 0,
            cost,
            function,
        }
    }

    /// An evaluator of `problem` under `constraints` constraints, whose figures `G <= 0` the function writes behind the
    /// objectives.
    pub fn constrained(problem: Problem, constraints: usize, cost: CallCost, function: F) -> Self {
        Self {
            constraints,
            ..Self::new(problem, cost, function)
        }
    }

    fn score(&self, candidate: &[f64], objectives: &mut [f64]) -> Option<Failure> {
        let failure = if candidate.iter().any(|x| !x.is_finite()) {
            Some(Failure::NotFinite)
        } else {
            (self.function)(candidate, objectives);
            objectives
                .iter()
                .any(|x| !x.is_finite())
                .then_some(Failure::Undefined)
        };
        if failure.is_some() {
            objectives.fill(FAILED_COST);
        }
        failure
    }
}

impl<F: Fn(&[f64], &mut [f64]) + Sync> Evaluator for PointEvaluator<F> {
    fn problem(&self) -> &Problem {
        &self.problem
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo {
            backend: "cpu",
            device: "f64".to_owned(),
            driver: String::new(),
        }
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let wanted = self.problem.objectives.len().max(1);
        let width = wanted + self.constraints;
        let candidates = population.chunks_exact(self.problem.variables.len().max(1));
        let mut objectives = vec![0.0; candidates.len() * width];
        let rows = objectives.chunks_exact_mut(width);
        let failures = match self.cost {
            CallCost::Cheap => candidates.zip(rows).map(|(c, row)| self.score(c, row)).collect(),
            CallCost::Dear => {
                let pairs: Vec<_> = candidates.zip(rows).collect();
                pairs.into_par_iter().map(|(c, row)| self.score(c, row)).collect()
            }
        };
        if self.constraints == 0 {
            return Ok(Evaluation {
                objectives,
                failures,
                violations: Vec::new(),
            });
        }
        let rows = || objectives.chunks_exact(width);
        let above = |row: &[f64]| row[wanted..].iter().map(|g| g.max(0.0)).sum();
        Ok(Evaluation {
            violations: rows().map(above).collect(),
            objectives: rows().flat_map(|row| &row[..wanted]).copied().collect(),
            failures,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{Objective, Variable};

    #[test]
    fn scores_rows_on_one_thread_or_many() {
        let problem = Problem {
            variables: ["a", "b"]
                .map(|name| Variable::new(name, "-", -1.0, 1.0))
                .to_vec(),
            objectives: ["sum", "root"].map(|name| Objective::new(name, "-")).to_vec(),
        };
        let root = |x: &[f64], f: &mut [f64]| {
            f[0] = x[0] + x[1];
            f[1] = x[0].sqrt();
        };
        let population = [0.25, 0.5, -1.0, 0.5, f64::NAN, 0.0, 1.0, 1.0];
        for cost in [CallCost::Cheap, CallCost::Dear] {
            let scored = PointEvaluator::new(problem.clone(), cost, root)
                .evaluate(&population)
                .unwrap();
            let (worst, undefined) = (FAILED_COST, Some(Failure::Undefined));
            assert_eq!(
                scored.objectives,
                [0.75, 0.5, worst, worst, worst, worst, 2.0, 1.0]
            );
            assert_eq!(scored.failures, [None, undefined, Some(Failure::NotFinite), None]);
        }
    }
}
