//! Bounds of a line's variables.

use super::conic::{Affine, ConicProgram, Status};
use crate::{Error, Result};

/// Least and greatest value of each variable of a line, and of sums of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// Least values; minus infinity for none.
    pub lower: Vec<f64>,
    /// Greatest values; infinity for none.
    pub upper: Vec<f64>,
    /// Bounds of sums, as at points that several variables move.
    pub rows: Vec<RowBound>,
}

/// Bounds of a weighted sum of variables.
#[derive(Clone, Debug, PartialEq)]
pub struct RowBound {
    /// Variables and weights.
    pub terms: Vec<(usize, f64)>,
    /// Least value.
    pub lower: f64,
    /// Greatest value.
    pub upper: f64,
}

impl RowBound {
    /// The sum at `x`.
    pub fn at(&self, x: &[f64]) -> f64 {
        self.terms.iter().map(|&(k, weight)| weight * x[k]).sum()
    }
}

impl Bounds {
    /// From 0, the right edge, to 1, the left one, everywhere.
    pub fn road(variables: usize) -> Self {
        Self {
            lower: vec![0.0; variables],
            upper: vec![1.0; variables],
            rows: Vec::new(),
        }
    }

    /// The same with variable `i` held at `value`, as at the ends of an open line.
    pub fn holding(mut self, i: usize, value: f64) -> Self {
        (self.lower[i], self.upper[i]) = (value, value);
        self
    }

    /// The point within the bounds that is nearest to `x`, but for the solver's rounding.
    pub(super) fn inside(&self, x: &[f64]) -> Result<Vec<f64>> {
        let boxed = x.iter().zip(self.lower.iter().zip(&self.upper));
        let boxed: Vec<f64> = boxed.map(|(x, (l, u))| x.clamp(*l, *u)).collect();
        let within = |row: &RowBound| (row.lower..=row.upper).contains(&row.at(&boxed));
        if self.rows.iter().all(within) {
            return Ok(boxed);
        }
        let mut program = ConicProgram::new(self.lower.clone(), self.upper.clone());
        for (k, x) in x.iter().enumerate() {
            let terms = vec![(k, 1.0)];
            program.add_square(Affine { constant: -x, terms });
        }
        for row in &self.rows {
            for (bound, sign) in [(row.lower, 1.0), (row.upper, -1.0)] {
                let terms = row.terms.iter().map(|&(k, weight)| (k, sign * weight));
                program.add_nonnegative(Affine {
                    constant: -sign * bound,
                    terms: terms.collect(),
                });
            }
        }
        let solution = program.solve()?;
        match solution.status {
            Status::Failed(words) => Err(Error::Study(format!("no line lies within its bounds: {words}"))),
            _ => Ok(solution.x),
        }
    }

    /// Holds the sums within their bounds in a program for a step from `x`. Where rounding has put `x` outside, it may stay there.
    pub(super) fn add_rows(&self, program: &mut ConicProgram, x: &[f64]) {
        for row in &self.rows {
            let sum = row.at(x);
            for (spare, sign) in [(sum - row.lower, 1.0), (row.upper - sum, -1.0)] {
                let terms = row.terms.iter().map(|&(k, weight)| (k, sign * weight));
                program.add_nonnegative(Affine {
                    constant: spare.max(0.0),
                    terms: terms.collect(),
                });
            }
        }
    }
}

/// Checks bounds of a line of so many variables and points.
pub(super) fn check((n, points): (usize, usize), bounds: &Bounds) -> Result<()> {
    let place = bounds
        .lower
        .iter()
        .zip(&bounds.upper)
        .position(|(l, u)| l.is_nan() || u.is_nan() || l > u);
    if bounds.lower.len() != n || bounds.upper.len() != n || points < 3 {
        return Err(Error::input(
            "the line",
            "bounds",
            format!("{} bounds and {points} points", bounds.lower.len()),
            format!("{n} bounds and three points at least"),
        ));
    }
    match place {
        Some(i) => Err(Error::input(
            "the line",
            format!("bounds of variable {i}"),
            format!("{} to {}", bounds.lower[i], bounds.upper[i]),
            "a range",
        )),
        None => Ok(()),
    }
}
