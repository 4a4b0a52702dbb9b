//! Evaluators of any function of points, in `f64`.

use super::{BackendInfo, Evaluation, Evaluator, FAILED_COST, Failure, Problem};
use crate::error::{Error, Result};
use rayon::prelude::*;

/// What one call of the function costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallCost {
    /// Less than handing it to another thread costs: candidates are evaluated one after the other.
    Cheap,
    /// More: candidates are spread over the threads.
    Expensive,
}

/// What a constraint's figure must be, and how much it counts beside others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constraint {
    /// Nothing for an inequality.
    tolerance: Option<f64>,
    scale: f64,
}

impl Constraint {
    /// The figure is at most zero.
    pub fn at_most_zero() -> Self {
        Self {
            tolerance: None,
            scale: 1.0,
        }
    }

    /// The figure is zero within `tolerance`.
    pub fn zero_within(tolerance: f64) -> Self {
        Self {
            tolerance: Some(tolerance),
            scale: 1.0,
        }
    }

    /// The same with a figure of `scale` counted as one. Violations of several constraints add up, so figures of unlike sizes need
    /// a scale each.
    pub fn in_units_of(self, scale: f64) -> Self {
        Self { scale, ..self }
    }

    /// By how much a figure violates it, in units of the scale.
    pub fn violation(&self, figure: f64) -> f64 {
        let beyond = match self.tolerance {
            Some(tolerance) => figure.abs() - tolerance,
            None => figure,
        };
        beyond.max(0.0) / self.scale
    }

    /// # Errors
    /// [`Error::Input`] naming what is out of its range.
    pub(crate) fn check(&self) -> Result<()> {
        let wrong = |place, found: f64, expected| {
            let found = found.to_string();
            Err(Error::input("the constraint", place, found, expected))
        };
        if !(self.scale > 0.0 && self.scale.is_finite()) {
            return wrong("scale", self.scale, "a number above 0");
        }
        match self.tolerance {
            Some(t) if !(t >= 0.0 && t.is_finite()) => wrong("tolerance", t, "a number from 0 on"),
            _ => Ok(()),
        }
    }
}

/// What all evaluators of points are made of: a problem and the constraints whose figures stand behind the objectives.
struct Points {
    problem: Problem,
    constraints: Vec<Constraint>,
}

impl Points {
    /// Numbers that the function writes for each candidate.
    fn width(&self) -> usize {
        self.problem.objectives.len().max(1) + self.constraints.len()
    }

    /// The evaluation of a population whose rows `write` writes.
    fn evaluate(&self, population: &[f64], write: impl FnOnce(&[f64], &mut [f64])) -> Result<Evaluation> {
        self.constraints.iter().try_for_each(Constraint::check)?;
        let (width, wanted) = (self.width(), self.problem.objectives.len().max(1));
        let candidates = population.chunks_exact(self.problem.variables.len().max(1));
        let mut rows = vec![0.0; candidates.len() * width];
        write(population, &mut rows);
        let mut evaluation = Evaluation::default();
        for (candidate, row) in candidates.zip(rows.chunks_exact(width)) {
            let failure = if candidate.iter().any(|x| !x.is_finite()) {
                Some(Failure::NotFinite)
            } else if row.iter().any(|x| !x.is_finite()) {
                Some(Failure::Undefined)
            } else {
                None
            };
            let (objectives, figures) = row.split_at(wanted);
            if failure.is_some() {
                evaluation
                    .objectives
                    .resize(evaluation.objectives.len() + wanted, FAILED_COST);
            } else {
                evaluation.objectives.extend(objectives);
            }
            if !self.constraints.is_empty() {
                let violations = self.constraints.iter().zip(figures);
                let sum: f64 = violations.map(|(c, figure)| c.violation(*figure)).sum();
                // The sum of finite figures may be beyond all numbers, and is a violation still.
                evaluation.violations.push(sum.min(f64::MAX));
            }
            evaluation.failures.push(failure);
        }
        Ok(evaluation)
    }

    fn backend() -> BackendInfo {
        BackendInfo {
            backend: "cpu",
            device: "f64".to_owned(),
            driver: String::new(),
        }
    }

    /// Calls `function` for each candidate of finite numbers and its row.
    fn each(&self, population: &[f64], rows: &mut [f64], mut function: impl FnMut(&[f64], &mut [f64])) {
        let candidates = population.chunks_exact(self.problem.variables.len().max(1));
        for (candidate, row) in candidates.zip(rows.chunks_exact_mut(self.width())) {
            if candidate.iter().all(|x| x.is_finite()) {
                function(candidate, row);
            }
        }
    }
}

/// Scores candidates by a function that reads a candidate, in the variables' units, and writes its objectives.
pub struct PointEvaluator<F> {
    points: Points,
    cost: CallCost,
    function: F,
}

impl<F: Fn(&[f64], &mut [f64]) + Sync> PointEvaluator<F> {
    /// An evaluator of `problem`. `function` is given a row of the variables and one of the objectives.
    pub fn new(problem: Problem, cost: CallCost, function: F) -> Self {
        Self::constrained(problem, Vec::new(), cost, function)
    }

    /// An evaluator of `problem` under `constraints`, whose figures the function writes behind the objectives.
    pub fn constrained(problem: Problem, constraints: Vec<Constraint>, cost: CallCost, function: F) -> Self {
        Self {
            points: Points { problem, constraints },
            cost,
            function,
        }
    }
}

impl<F: Fn(&[f64], &mut [f64]) + Sync> Evaluator for PointEvaluator<F> {
    fn problem(&self) -> &Problem {
        &self.points.problem
    }

    fn backend(&self) -> BackendInfo {
        Points::backend()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let points = &self.points;
        points.evaluate(population, |population, rows| match self.cost {
            CallCost::Cheap => points.each(population, rows, &self.function),
            CallCost::Expensive => {
                let candidates = population.par_chunks_exact(points.problem.variables.len().max(1));
                let pairs = candidates.zip(rows.par_chunks_exact_mut(points.width()));
                pairs
                    .with_max_len(1)
                    .for_each(|(candidate, row)| points.each(candidate, row, &self.function));
            }
        })
    }
}

/// Scores candidates one after the other by a function that may change what it holds.
pub struct SequentialEvaluator<F> {
    points: Points,
    function: F,
}

impl<F: FnMut(&[f64], &mut [f64])> SequentialEvaluator<F> {
    /// An evaluator of `problem`, with the function of [`PointEvaluator::constrained`].
    pub fn new(problem: Problem, constraints: Vec<Constraint>, function: F) -> Self {
        Self {
            points: Points { problem, constraints },
            function,
        }
    }
}

impl<F: FnMut(&[f64], &mut [f64])> Evaluator for SequentialEvaluator<F> {
    fn problem(&self) -> &Problem {
        &self.points.problem
    }

    fn backend(&self) -> BackendInfo {
        Points::backend()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let (points, function) = (&self.points, &mut self.function);
        points.evaluate(population, |population, rows| {
            points.each(population, rows, function)
        })
    }
}

/// Scores whole populations by a function that reads all candidates, row-major in the variables' units, and writes the rows of
/// objectives and then constraints of all of them.
pub struct BatchEvaluator<F> {
    points: Points,
    function: F,
}

impl<F: FnMut(&[f64], &mut [f64])> BatchEvaluator<F> {
    /// An evaluator of `problem` under `constraints`.
    pub fn new(problem: Problem, constraints: Vec<Constraint>, function: F) -> Self {
        Self {
            points: Points { problem, constraints },
            function,
        }
    }
}

impl<F: FnMut(&[f64], &mut [f64])> Evaluator for BatchEvaluator<F> {
    fn problem(&self) -> &Problem {
        &self.points.problem
    }

    fn backend(&self) -> BackendInfo {
        Points::backend()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        self.points.evaluate(population, &mut self.function)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{Objective, Variable};

    fn problem() -> Problem {
        Problem {
            variables: ["a", "b"]
                .map(|name| Variable::new(name, "-", -1.0, 1.0))
                .to_vec(),
            objectives: ["sum", "root"].map(|name| Objective::new(name, "-")).to_vec(),
        }
    }

    fn root(x: &[f64], f: &mut [f64]) {
        f[0] = x[0] + x[1];
        f[1] = x[0].sqrt();
    }

    #[test]
    fn scores_rows_on_one_thread_or_many_or_all_at_once() {
        let population = [0.25, 0.5, -1.0, 0.5, f64::NAN, 0.0, 1.0, 1.0];
        let mut calls = 0;
        let counted = |x: &[f64], f: &mut [f64]| {
            calls += 1;
            root(x, f);
        };
        let batch = |xs: &[f64], fs: &mut [f64]| {
            let rows = xs.chunks_exact(2).zip(fs.chunks_exact_mut(2));
            rows.for_each(|(x, f)| root(x, f));
        };
        let cheap = PointEvaluator::new(problem(), CallCost::Cheap, root);
        let expensive = PointEvaluator::new(problem(), CallCost::Expensive, root);
        let evaluators: [Box<dyn Evaluator + '_>; 4] = [
            Box::new(cheap),
            Box::new(expensive),
            Box::new(SequentialEvaluator::new(problem(), Vec::new(), counted)),
            Box::new(BatchEvaluator::new(problem(), Vec::new(), batch)),
        ];
        for mut evaluator in evaluators {
            let scored = evaluator.evaluate(&population).unwrap();
            let (worst, undefined) = (FAILED_COST, Some(Failure::Undefined));
            assert_eq!(
                scored.objectives,
                [0.75, 0.5, worst, worst, worst, worst, 2.0, 1.0]
            );
            assert_eq!(scored.failures, [None, undefined, Some(Failure::NotFinite), None]);
        }
        assert_eq!(calls, 3);
    }

    #[test]
    fn constraints_count_by_tolerance_and_scale() {
        let constraints = vec![
            Constraint::at_most_zero().in_units_of(100.0),
            Constraint::zero_within(0.5),
        ];
        // Figures: 100 a, and b.
        let function = |x: &[f64], f: &mut [f64]| {
            f[..2].fill(0.0);
            (f[2], f[3]) = (100.0 * x[0], x[1]);
        };
        let mut evaluator = PointEvaluator::constrained(problem(), constraints, CallCost::Cheap, function);
        let scored = evaluator.evaluate(&[-1.0, -0.5, 0.25, 0.5, 0.5, -0.75]).unwrap();
        assert_eq!(scored.violations, [0.0, 0.25, 0.75]);
        for (wrong, name) in [
            (Constraint::at_most_zero().in_units_of(0.0), "scale"),
            (Constraint::zero_within(f64::NAN), "tolerance"),
        ] {
            let mut refused = PointEvaluator::constrained(problem(), vec![wrong], CallCost::Cheap, function);
            let error = refused.evaluate(&[0.0, 0.0]).unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
        }
    }
}
