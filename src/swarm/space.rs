//! The cube that swarms move in.

use crate::error::{Error, Result};
use crate::evaluate::resident::BLOCK;
use crate::evaluate::{Problem, Variable};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The unit cube, with one dimension for each variable that is not fixed by equal bounds, and the way from it to
/// the variables' units.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Space {
    variables: Vec<Variable>,
    free: Vec<usize>,
}

impl Space {
    /// # Errors
    /// [`Error::Input`] naming a variable whose bounds are not finite or crossed, or if there is no objective.
    pub fn new(problem: &Problem) -> Result<Self> {
        for v in &problem.variables {
            let range = v.upper - v.lower;
            if !(range.is_finite() && range >= 0.0) {
                let found = format!("bounds from {} to {}", v.lower, v.upper);
                return Err(Error::input(
                    "the problem",
                    &v.name,
                    found,
                    "finite bounds in order",
                ));
            }
        }
        for v in problem.variables.iter().filter(|v| v.whole) {
            if v.lower.fract() != 0.0 || v.upper.fract() != 0.0 {
                let found = format!("bounds from {} to {}", v.lower, v.upper);
                return Err(Error::input("the problem", &v.name, found, "whole numbers"));
            }
        }
        if problem.objectives.is_empty() || problem.variables.is_empty() {
            let found = format!(
                "{} variables, {} objectives",
                problem.variables.len(),
                problem.objectives.len()
            );
            return Err(Error::input(
                "the problem",
                "variables, objectives",
                found,
                "one or more of each",
            ));
        }
        let variables = problem.variables.clone();
        let free = (0..variables.len()).filter(|&k| variables[k].is_free()).collect();
        Ok(Self { variables, free })
    }

    /// The cube of some of the dimensions.
    pub fn part(&self, columns: Range<usize>) -> Self {
        Self {
            variables: self.variables.clone(),
            free: self.free[columns].to_vec(),
        }
    }

    /// Dimensions of the cube.
    pub fn dimensions(&self) -> usize {
        self.free.len()
    }

    /// Variables, fixed ones and all.
    pub fn variables(&self) -> usize {
        self.variables.len()
    }

    /// Writes the candidates of a block of `lanes` positions, whose coordinates lie in rows; as many as `candidates`
    /// has room for.
    pub fn scale_block(&self, positions: &[f32], lanes: usize, candidates: &mut [f64]) {
        let width = self.variables.len();
        for (k, v) in self.variables.iter().enumerate() {
            if v.lower == v.upper {
                for candidate in candidates.chunks_exact_mut(width) {
                    candidate[k] = v.lower;
                }
            }
        }
        for (row, &k) in positions.chunks_exact(lanes).zip(&self.free) {
            let v = &self.variables[k];
            for (candidate, x) in candidates.chunks_exact_mut(width).zip(row) {
                candidate[k] = v.at(f64::from(*x));
            }
        }
    }

    /// `count` positions, row-major, as candidates in the variables' units.
    pub fn scaled(&self, positions: &[f64], count: usize) -> Vec<f64> {
        let d = self.dimensions();
        let fixed: Vec<f64> = self.variables.iter().map(|v| v.lower).collect();
        let mut candidates = fixed.repeat(count);
        candidates
            .par_chunks_exact_mut(self.variables.len())
            .with_min_len(BLOCK)
            .enumerate()
            .for_each(|(row, candidate)| {
                for (j, &k) in self.free.iter().enumerate() {
                    candidate[k] = self.variables[k].at(positions[row * d + j]);
                }
            });
        candidates
    }

    /// # Errors
    /// [`Error::Input`] if the problem has several objectives, as [`Space::new`] else.
    pub fn of_one_objective(problem: &Problem) -> Result<Self> {
        if problem.objectives.len() > 1 {
            let found = format!("{} objectives", problem.objectives.len());
            let expected = "one: this optimiser minimises a single objective";
            return Err(Error::input("the problem", "objectives", found, expected));
        }
        Self::new(problem)
    }

    /// The positions of the first candidates that an optimiser is given, at most `count` of them.
    ///
    /// # Errors
    /// [`Error::Input`] naming a candidate that is no finite value for each variable.
    pub fn starts(&self, candidates: &[Vec<f64>], count: usize) -> Result<Vec<Vec<f64>>> {
        let start = |(i, candidate): (usize, &Vec<f64>)| {
            if candidate.len() != self.variables() || candidate.iter().any(|x| !x.is_finite()) {
                let place = format!("candidate {}", i + 1);
                let finite = candidate.iter().filter(|x| x.is_finite()).count();
                let found = format!("{} values, {finite} of them finite", candidate.len());
                let expected = format!("{} finite ones, one for each variable", self.variables());
                return Err(Error::input(
                    "the candidates to start from",
                    place,
                    found,
                    expected,
                ));
            }
            Ok(self.position(candidate))
        };
        candidates.iter().take(count).enumerate().map(start).collect()
    }

    /// The position of a candidate, brought within the bounds.
    pub fn position(&self, candidate: &[f64]) -> Vec<f64> {
        let share = |&k: &usize| {
            let v = &self.variables[k];
            let share = if v.whole {
                // The middle of what stands for it.
                (candidate[k].round() - v.lower + 0.5) / (v.upper - v.lower + 1.0)
            } else {
                (candidate[k] - v.lower) / (v.upper - v.lower)
            };
            share.clamp(0.0, 1.0)
        };
        self.free.iter().map(share).collect()
    }
}
