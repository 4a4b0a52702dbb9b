//! The evaluator: a whole population in, its objectives out, on whichever backend.
//!
//! A [`Problem`] names its bounded decision variables and its objectives. An [`Evaluator`] scores candidates of
//! it. Optimisers see nothing else, so they run any problem on any backend.

mod backend;
mod by_size;
mod dispatches;
#[cfg(feature = "vehicle")]
pub mod drive;
#[cfg(feature = "vehicle")]
pub mod energy;
mod faults;
#[cfg(feature = "vehicle")]
mod free_car;
#[cfg(feature = "gpu")]
pub mod gpu;
#[cfg(not(feature = "gpu"))]
#[path = "no_gpu.rs"]
pub mod gpu;
mod ill_formed;
#[cfg(feature = "vehicle")]
pub mod line;
mod logarithmic;
#[cfg(feature = "vehicle")]
mod model_table;
#[cfg(feature = "vehicle")]
mod objectives;
mod open;
mod packed;
#[cfg(feature = "vehicle")]
mod packs;
pub mod point;
pub mod portions;
mod problem_kind;
#[cfg(feature = "vehicle")]
pub mod replay;
pub mod resident;
pub mod simd;
#[cfg(feature = "vehicle")]
pub mod steady;

pub use backend::BackendChoice;
pub use faults::{DeviceFaults, Losses};
#[cfg(feature = "vehicle")]
pub use free_car::FreeCar;
pub use gpu::OnDevice;
#[cfg(feature = "gpu")]
pub use gpu::{DeviceKernel, FallbackEvaluator, GpuBackend};
pub use ill_formed::IllFormed;
pub use logarithmic::{Logarithmic, is_logarithmic};
#[cfg(feature = "vehicle")]
pub use model_table::ModelTable;
pub use open::open_evaluator;
pub use packed::{PackedClient, run_packed};
pub use problem_kind::{CpuBackend, LaneTables, OutcomeOf, ProblemKind, SimdBackend};

use crate::error::{Error, Result};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fmt;

/// A bounded decision variable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its unit, `-` for none.
    pub unit: String,
    /// Least value.
    pub lower: f64,
    /// Greatest value.
    pub upper: f64,
    /// Whether only whole numbers will do; bounds are whole numbers then.
    pub whole: bool,
}

impl Variable {
    /// From its name, unit and bounds.
    pub fn new(name: impl Into<String>, unit: &str, lower: f64, upper: f64) -> Self {
        Self {
            name: name.into(),
            unit: unit.to_owned(),
            lower,
            upper,
            whole: false,
        }
    }

    /// One of whole numbers, bounds included.
    pub fn whole(name: impl Into<String>, unit: &str, lower: i32, upper: i32) -> Self {
        Self {
            whole: true,
            ..Self::new(name, unit, f64::from(lower), f64::from(upper))
        }
    }

    /// Whether it can be moved at all: whether its bounds differ.
    pub fn is_free(&self) -> bool {
        self.upper > self.lower
    }

    /// What a coordinate of the unit cube stands for: each whole number for as much of it as the others, if only those will do.
    #[inline(always)]
    pub fn at(&self, position: f64) -> f64 {
        let range = self.upper - self.lower;
        let value = if self.whole {
            self.lower + (position * (range + 1.0)).floor()
        } else {
            self.lower + position * range
        };
        value.min(self.upper)
    }
}

/// An objective, to be minimised.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Problem {
    /// Decision variables, in the order of a candidate's row.
    pub variables: Vec<Variable>,
    /// Objectives, in the order of a result's row.
    pub objectives: Vec<Objective>,
}

/// What stands in the row of objectives of a candidate that failed. It is no cost: [`Evaluation::failures`] says what failed.
pub const FAILED_COST: f64 = f64::INFINITY;

/// Whether all figures of a candidate are finite numbers in single precision. Most backends compute in it, and every backend
/// refuses the same candidates.
pub(crate) fn are_numbers(figures: &[f64]) -> bool {
    figures.iter().all(|x| (*x as f32).is_finite())
}

/// Why a candidate has no cost of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Failure {
    /// The coefficients of its tyre make no tyre.
    IllFormedTyre(IllFormed),
    /// It spun, rolled over or left the range of numbers.
    Spun,
    /// The steps of the integration were too long for it, so that it may be no worse than others.
    StepTooLong,
    /// It left the road.
    LeftRoad,
    /// It did not reach the end in time.
    Unfinished,
    /// It came to a standstill.
    Standstill,
    /// It was still moving when it should have settled.
    Unsettled,
    /// No slip of its driven wheels held the speed that was asked for.
    OffTheEnvelope,
    /// A decision variable was not a finite number in single precision.
    NotFinite,
    /// An objective was not a finite number.
    Undefined,
    /// An objective was not a finite number in single precision.
    BeyondSinglePrecision,
}

impl Failure {
    /// The words for counts and scripts, by [`Failure::code`].
    pub(crate) const WORDS: [&'static str; 11] = [
        "objective_beyond_single_precision",
        "ill_formed_tyre",
        "spun",
        "step_too_long",
        "left_the_road",
        "did_not_finish",
        "standstill",
        "did_not_settle",
        "off_the_envelope",
        "variable_not_finite",
        "objective_not_finite",
    ];

    /// Its place among [`Failure::WORDS`], and the number that it has on devices.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::BeyondSinglePrecision => 0,
            Self::IllFormedTyre(_) => 1,
            Self::Spun => 2,
            Self::StepTooLong => 3,
            Self::LeftRoad => 4,
            Self::Unfinished => 5,
            Self::Standstill => 6,
            Self::Unsettled => 7,
            Self::OffTheEnvelope => 8,
            Self::NotFinite => 9,
            Self::Undefined => 10,
        }
    }

    /// A word for counts and scripts.
    pub fn word(self) -> &'static str {
        Self::WORDS[self.code() as usize]
    }
}

/// Candidates that failed, by [`Failure::word`].
pub type FailureCounts = BTreeMap<String, u64>;

/// Adds `counts` to `total`.
pub fn add_failures(total: &mut FailureCounts, counts: &FailureCounts) {
    for (reason, count) in counts {
        *total.entry(reason.clone()).or_default() += count;
    }
}

/// How many candidates failed and why, in words.
pub(crate) fn failures_in_words(counts: &FailureCounts) -> String {
    let told: Vec<String> = counts
        .iter()
        .map(|(reason, count)| format!("{count} {}", reason.replace('_', " ")))
        .collect();
    if told.is_empty() {
        "none".to_owned()
    } else {
        told.join(", ")
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::IllFormedTyre(reason) => write!(f, "an ill-formed tyre: {reason}"),
            Self::Spun => f.write_str("spun"),
            Self::StepTooLong => f.write_str("needs shorter steps"),
            Self::LeftRoad => f.write_str("left the road"),
            Self::Unfinished => f.write_str("did not finish in time"),
            Self::Standstill => f.write_str("came to a standstill"),
            Self::Unsettled => f.write_str("did not settle"),
            Self::OffTheEnvelope => f.write_str("has no grip to hold the speed"),
            Self::NotFinite => f.write_str("a variable that is not a finite number"),
            Self::Undefined => f.write_str("an objective that is not a finite number"),
            Self::BeyondSinglePrecision => {
                f.write_str("an objective that is not a finite number in single precision")
            }
        }
    }
}

/// The objectives of a population.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Row-major `n` by number of objectives; any finite number is a cost. [`FAILED_COST`] where a candidate failed.
    pub objectives: Vec<f64>,
    /// Why a candidate failed, one per candidate.
    pub failures: Vec<Option<Failure>>,
    /// By how much each candidate violates its constraints: the sum of those `G` that are above zero, where `G <= 0` is
    /// wanted. Empty for a problem without constraints. Optimisers go by Deb's rules (*An efficient constraint handling
    /// method for genetic algorithms*, 2000): a candidate that violates less is better, whatever its objectives.
    pub violations: Vec<f64>,
}

/// What a candidate of one objective is worth. The violation counts first, then the cost (Deb's rules).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Worth {
    /// By how much it violates its constraints; infinite if it failed.
    pub violation: f64,
    /// Its cost; infinite if it failed.
    pub cost: f64,
}

impl Worth {
    /// Of a candidate that failed, and of none at all.
    pub const FAILED: Self = Self {
        violation: f64::INFINITY,
        cost: f64::INFINITY,
    };

    /// Whether there is such a candidate and it did not fail.
    pub fn succeeded(&self) -> bool {
        self.violation < f64::INFINITY
    }

    /// The same, where violations up to `level` count as none.
    pub fn within(self, level: f64) -> Self {
        let violation = if self.violation <= level {
            0.0
        } else {
            self.violation
        };
        Self { violation, ..self }
    }

    /// The order from the best to the worst.
    pub fn order(&self, other: &Self) -> Ordering {
        let by_violation = self.violation.total_cmp(&other.violation);
        by_violation.then(self.cost.total_cmp(&other.cost))
    }
}

impl Evaluation {
    /// The candidates of `other` behind its own.
    pub(crate) fn append(&mut self, other: Self) {
        self.objectives.extend(other.objectives);
        self.failures.extend(other.failures);
        self.violations.extend(other.violations);
    }

    /// Checks that this is of so many candidates and objectives.
    ///
    /// # Errors
    /// [`Error::Input`] naming the column that is too short or too long.
    pub fn check(&self, candidates: usize, objectives: usize) -> Result<()> {
        let columns = [
            (
                "objectives",
                self.objectives.len(),
                candidates.saturating_mul(objectives),
            ),
            ("failures", self.failures.len(), candidates),
            ("violations", self.violations.len(), candidates),
        ];
        for (name, found, expected) in columns {
            if found != expected && !(name == "violations" && found == 0) {
                let expected = format!("{expected}, for {candidates} candidates of {objectives} objectives");
                return Err(Error::input("the evaluation", name, found.to_string(), expected));
            }
        }
        Ok(())
    }

    /// By how much a candidate violates its constraints: zero if it violates none, infinite if the sum is not a number.
    pub fn violation(&self, candidate: usize) -> f64 {
        match self.violations.get(candidate) {
            None => 0.0,
            Some(v) if v.is_nan() => f64::INFINITY,
            // Zero has two signs and one place.
            Some(v) => v.max(0.0) + 0.0,
        }
    }

    /// The objectives of a candidate of `width` objectives, unless it failed. One whose figures are not finite numbers has failed,
    /// whatever its flag says.
    pub fn success(&self, candidate: usize, width: usize) -> Option<&[f64]> {
        let row = &self.objectives[candidate * width..(candidate + 1) * width];
        let finite = row.iter().all(|x| x.is_finite()) && self.violation(candidate).is_finite();
        (self.failures[candidate].is_none() && finite).then_some(row)
    }

    /// What every candidate is worth by the first of `width` objectives.
    pub fn worths(&self, width: usize) -> Vec<Worth> {
        let worth = |i: usize| match self.success(i, width) {
            Some(row) => Worth {
                violation: self.violation(i),
                cost: row[0],
            },
            None => Worth::FAILED,
        };
        (0..self.failures.len()).map(worth).collect()
    }

    /// The part of some of the candidates, of `width` objectives.
    pub fn part(&self, candidates: std::ops::Range<usize>, width: usize) -> Self {
        Self {
            objectives: self.objectives[candidates.start * width..candidates.end * width].to_vec(),
            violations: if self.violations.is_empty() {
                Vec::new()
            } else {
                self.violations[candidates.clone()].to_vec()
            },
            failures: self.failures[candidates].to_vec(),
        }
    }

    /// How many candidates failed, by reason.
    pub fn failure_counts(&self) -> FailureCounts {
        let mut counts = FailureCounts::new();
        for failure in self.failures.iter().flatten() {
            *counts.entry(failure.word().to_owned()).or_default() += 1;
        }
        counts
    }

    /// Joins rows of objectives and failures.
    #[cfg(test)]
    pub(crate) fn of_rows(rows: Vec<(Vec<f64>, Option<Failure>)>) -> Self {
        let mut evaluation = Self::default();
        for (row, failure) in rows {
            evaluation.objectives.extend(row);
            evaluation.failures.push(failure);
        }
        evaluation
    }
}

/// The backend that ran an evaluation, for manifests and logs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendInfo {
    /// `cpu`, `simd` or `gpu`.
    pub backend: &'static str,
    /// The instruction set, or the adapter's name.
    pub device: String,
    /// The driver's name and version, empty for a processor.
    pub driver: String,
}

/// The names that [`BackendInfo::backend`] may have.
const BACKENDS: [&str; 3] = ["cpu", "simd", "gpu"];

impl Serialize for BackendInfo {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        (self.backend, &self.device, &self.driver).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for BackendInfo {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        let (name, device, driver) = <(String, String, String)>::deserialize(deserializer)?;
        let backend = BACKENDS.into_iter().find(|known| *known == name);
        let backend = backend.ok_or_else(|| serde::de::Error::custom("an unknown backend"))?;
        Ok(Self {
            backend,
            device,
            driver,
        })
    }
}

impl BackendInfo {
    /// The reference: `f64` on the processor.
    pub(crate) fn reference() -> Self {
        Self {
            backend: "cpu",
            device: "f64 reference".to_owned(),
            driver: String::new(),
        }
    }

    /// Lanes of an instruction set.
    pub(crate) fn of_lanes(set: simd::InstructionSet) -> Self {
        Self {
            backend: "simd",
            device: set.name().to_owned(),
            driver: String::new(),
        }
    }
}

/// Scores whole populations of candidates.
pub trait Evaluator {
    /// The problem that candidates belong to.
    fn problem(&self) -> &Problem;

    /// What does the work.
    fn backend(&self) -> BackendInfo;

    /// Faults of devices so far that evaluation recovered from, in words.
    fn device_faults(&self) -> &[String] {
        &[]
    }

    /// Time that the kernels spent on the last evaluation (ms): of a device with a clock its own, of others that of the dispatches, of
    /// lanes that of the pass through them. `None` where nothing measures it.
    fn last_kernel_ms(&self) -> Option<f64> {
        None
    }

    /// Scores `population`: row-major, `n` by number of variables, values within their bounds. Every candidate has a row of
    /// objectives and a place among the failures.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails. A candidate that fails is not an error.
    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation>;
}
