//! The evaluator: a whole population in, its objectives out, on whichever backend.
//!
//! A [`Problem`] names its bounded decision variables and its objectives. An [`Evaluator`] scores candidates of
//! it. Optimisers see nothing else, so they run any problem on any backend.

mod backend;
pub mod gpu;
pub mod hybrid;
pub mod line;
pub mod point;
pub mod replay;
pub mod simd;

pub use backend::BackendChoice;

use crate::error::Result;
use crate::vehicle::tyre::IllFormed;
use std::fmt;

/// A bounded decision variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its unit, `-` for none.
    pub unit: String,
    /// Least value.
    pub lower: f64,
    /// Greatest value.
    pub upper: f64,
}

impl Variable {
    /// From its name, unit and bounds.
    pub fn new(name: impl Into<String>, unit: &str, lower: f64, upper: f64) -> Self {
        Self {
            name: name.into(),
            unit: unit.to_owned(),
            lower,
            upper,
        }
    }
}

/// An objective, to be minimised.
#[derive(Clone, Debug, PartialEq)]
pub struct Objective {
    /// Its name.
    pub name: String,
    /// Its unit, `-` for none.
    pub unit: String,
}

impl Objective {
    /// From its name and unit.
    pub fn new(name: impl Into<String>, unit: &str) -> Self {
        Self {
            name: name.into(),
            unit: unit.to_owned(),
        }
    }
}

/// What is to be optimised.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Decision variables, in the order of a candidate's row.
    pub variables: Vec<Variable>,
    /// Objectives, in the order of a result's row.
    pub objectives: Vec<Objective>,
}

/// The cost of a candidate that failed: the worst finite one, on every backend.
pub const FAILED_COST: f64 = 1e9;

/// Why a candidate has no cost of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// Its tyre is none.
    IllFormedTyre(IllFormed),
    /// It spun, rolled over or left the range of numbers.
    Spun,
    /// It came to a standstill.
    Standstill,
    /// A decision variable was not a finite number.
    NotFinite,
    /// An objective was not a finite number.
    Undefined,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::IllFormedTyre(reason) => write!(f, "an ill-formed tyre: {reason}"),
            Self::Spun => f.write_str("spun"),
            Self::Standstill => f.write_str("came to a standstill"),
            Self::NotFinite => f.write_str("a variable that is not a finite number"),
            Self::Undefined => f.write_str("an objective that is not a finite number"),
        }
    }
}

/// The objectives of a population.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evaluation {
    /// Row-major `n` by number of objectives; [`FAILED_COST`] where a candidate failed.
    pub objectives: Vec<f64>,
    /// Why a candidate failed, one per candidate.
    pub failures: Vec<Option<Failure>>,
}

impl Evaluation {
    /// Joins rows of objectives and failures.
    pub(crate) fn of_rows(rows: Vec<(Vec<f64>, Option<Failure>)>) -> Self {
        let mut evaluation = Self::default();
        for (row, failure) in rows {
            evaluation.objectives.extend(row);
            evaluation.failures.push(failure);
        }
        evaluation
    }
}

/// What ran an evaluation, for manifests and logs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendInfo {
    /// `cpu`, `simd` or `gpu`.
    pub backend: &'static str,
    /// The instruction set, or the adapter's name.
    pub device: String,
    /// The driver's name and version, empty for a processor.
    pub driver: String,
}

/// Scores whole populations of candidates.
pub trait Evaluator {
    /// The problem that candidates belong to.
    fn problem(&self) -> &Problem;

    /// What does the work.
    fn backend(&self) -> BackendInfo;

    /// Scores `population`: row-major, `n` by number of variables, values within their bounds.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails. A candidate that fails is no error.
    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation>;
}
