//! One kind of problem on every backend: what a kind says of itself, and the evaluators that follow from it.

use super::simd::InstructionSet;
use super::{BackendInfo, Evaluation, Evaluator, FAILED_COST, Failure, Problem, are_numbers};
use crate::error::Result;
use rayon::prelude::*;
use std::time::Instant;

/// What a kernel finds of a candidate, or why the candidate need not be evaluated.
pub type OutcomeOf<K> = std::result::Result<<K as ProblemKind>::Outcome, Failure>;

/// A kind of problem that every backend evaluates; those of devices want `OnDevice` too.
pub trait ProblemKind: Sync + Sized {
    /// What the kernel finds of a candidate, before objectives are made of it.
    type Outcome: Send + Sync;
    /// The kernel in lanes, with its tables in single precision.
    type Lanes: LaneTables<Self>;
    /// Why a candidate failed whose objectives are not finite numbers in single precision. Kernels compute in it, and every backend
    /// refuses the same candidates.
    const WITHOUT_COST: Failure;

    /// Variables and objectives.
    fn problem(&self) -> &Problem;

    /// Bytes that a candidate takes at the most while it is evaluated.
    fn bytes_each(&self) -> u64;

    /// Why a candidate need not be evaluated, if so.
    fn preliminary_failure(&self, candidate: &[f64]) -> Option<Failure>;

    /// The outcomes of candidates in `f64`, in threads.
    fn reference(&self, candidates: &[&[f64]]) -> Vec<Self::Outcome>;

    /// The objectives of a candidate, in the order of the problem.
    ///
    /// # Errors
    /// Why the candidate failed.
    fn objectives_of(
        &self,
        candidate: &[f64],
        outcome: &Self::Outcome,
    ) -> std::result::Result<Vec<f64>, Failure>;

    /// The row of objectives of a candidate, and why it failed if it did.
    fn objective_row(
        &self,
        candidate: &[f64],
        outcome: std::result::Result<&Self::Outcome, Failure>,
    ) -> (Vec<f64>, Option<Failure>) {
        let row = outcome.and_then(|outcome| {
            let row = self.objectives_of(candidate, outcome)?;
            if are_numbers(&row) {
                Ok(row)
            } else {
                Err(Self::WITHOUT_COST)
            }
        });
        match row {
            Ok(row) => (row, None),
            Err(failure) => (vec![FAILED_COST; self.problem().objectives.len()], Some(failure)),
        }
    }
}

/// The kernel of a kind of problem in lanes.
pub trait LaneTables<K: ProblemKind>: Sync {
    /// The tables of `kind`.
    fn new(kind: &K) -> Self;

    /// The outcomes of candidates in the lanes of `set`.
    fn outcomes(&self, kind: &K, set: InstructionSet, candidates: &[&[f64]]) -> Vec<K::Outcome>;
}

/// The candidates of a population; a problem without variables has one, which is empty.
pub(super) fn candidates<'p>(problem: &Problem, population: &'p [f64]) -> Vec<&'p [f64]> {
    match problem.variables.len() {
        0 => vec![&[]],
        width => population.chunks_exact(width).collect(),
    }
}

/// Candidates of which some fail before they are evaluated.
pub(super) struct Checked<'c> {
    failures: Vec<Option<Failure>>,
    /// Those that must be evaluated.
    pub rows: Vec<&'c [f64]>,
}

impl<'c> Checked<'c> {
    pub fn new<K: ProblemKind>(kind: &K, candidates: &[&'c [f64]]) -> Self {
        let failures: Vec<_> = candidates
            .par_iter()
            .map(|c| kind.preliminary_failure(c))
            .collect();
        let both = candidates.iter().zip(&failures);
        let rows = both.filter(|(_, failure)| failure.is_none()).map(|(c, _)| *c);
        Self {
            rows: rows.collect(),
            failures,
        }
    }

    /// Outcomes of those that were evaluated, in their places among those that were not.
    pub fn joined<T>(self, outcomes: Vec<T>) -> Vec<std::result::Result<T, Failure>> {
        let mut outcomes = outcomes.into_iter();
        self.failures
            .into_iter()
            .map(|failure| match failure {
                Some(failure) => Err(failure),
                None => outcomes.next().ok_or(Failure::Undefined),
            })
            .collect()
    }
}

pub(super) fn evaluation<K: ProblemKind>(
    kind: &K,
    candidates: &[&[f64]],
    outcomes: Vec<OutcomeOf<K>>,
) -> Evaluation {
    let width = kind.problem().objectives.len();
    let mut objectives = vec![FAILED_COST; outcomes.len() * width];
    let failures = objectives
        .par_chunks_exact_mut(width)
        .zip(candidates.par_iter().zip(&outcomes))
        .map(|(own, (candidate, outcome))| {
            let (row, failure) = kind.objective_row(candidate, outcome.as_ref().map_err(|f| *f));
            own.copy_from_slice(&row);
            failure
        })
        .collect();
    Evaluation {
        objectives,
        failures,
        violations: Vec::new(),
    }
}

/// The reference backend: `f64`, one candidate after another, in threads.
pub struct CpuBackend<'a, K> {
    kind: &'a K,
}

impl<'a, K: ProblemKind> CpuBackend<'a, K> {
    /// An evaluator of `kind`.
    pub fn new(kind: &'a K) -> Self {
        Self { kind }
    }

    /// The outcomes of candidates.
    pub fn outcomes(&self, candidates: &[&[f64]]) -> Vec<OutcomeOf<K>> {
        let checked = Checked::new(self.kind, candidates);
        let outcomes = self.kind.reference(&checked.rows);
        checked.joined(outcomes)
    }
}

impl<K: ProblemKind> Evaluator for CpuBackend<'_, K> {
    fn problem(&self) -> &Problem {
        self.kind.problem()
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::reference()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates = candidates(self.kind.problem(), population);
        let outcomes = self.outcomes(&candidates);
        Ok(evaluation(self.kind, &candidates, outcomes))
    }
}

/// The lane backend: `f32`, as many candidates at once as a register holds, in threads.
pub struct SimdBackend<'a, K: ProblemKind> {
    pub(super) kind: &'a K,
    pub(super) tables: K::Lanes,
    pub(super) set: InstructionSet,
    kernel_ms: Option<f64>,
}

impl<'a, K: ProblemKind> SimdBackend<'a, K> {
    /// An evaluator of `kind` in the lanes of `set`.
    pub fn new(kind: &'a K, set: InstructionSet) -> Self {
        Self {
            kind,
            tables: K::Lanes::new(kind),
            set,
            kernel_ms: None,
        }
    }

    /// The outcomes of candidates.
    pub fn outcomes(&self, candidates: &[&[f64]]) -> Vec<OutcomeOf<K>> {
        let checked = Checked::new(self.kind, candidates);
        let outcomes = self.run(&checked.rows);
        checked.joined(outcomes)
    }

    fn run(&self, rows: &[&[f64]]) -> Vec<K::Outcome> {
        self.tables.outcomes(self.kind, self.set, rows)
    }
}

impl<K: ProblemKind> Evaluator for SimdBackend<'_, K> {
    fn problem(&self) -> &Problem {
        self.kind.problem()
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::of_lanes(self.set)
    }

    fn last_kernel_ms(&self) -> Option<f64> {
        self.kernel_ms
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates = candidates(self.kind.problem(), population);
        let checked = Checked::new(self.kind, &candidates);
        let began = Instant::now();
        let outcomes = self.run(&checked.rows);
        self.kernel_ms = Some(began.elapsed().as_secs_f64() * 1e3);
        let outcomes = checked.joined(outcomes);
        Ok(evaluation(self.kind, &candidates, outcomes))
    }
}
