//! Populations in portions: what an evaluator takes beside them stays within bounds, however large they are.

use super::{BackendInfo, Evaluation, Evaluator, Problem};
use crate::error::Result;
use std::sync::atomic::{AtomicU64, Ordering};

/// What evaluators take where nothing else is said (bytes).
const USUAL: u64 = 1 << 30;
/// Candidates of the smallest portion: enough to keep threads and devices at work.
pub const LEAST: usize = 1024;

static ALLOWED: AtomicU64 = AtomicU64::new(USUAL);

/// Lets each evaluator that is opened from now on take so much memory beside its population (bytes). Like the device, the
/// memory is the process's. What comes of a study does not depend on it.
pub fn allow(bytes: u64) {
    ALLOWED.store(bytes, Ordering::Relaxed);
}

/// Scores populations in portions, one after the other. A candidate's figures do not depend on its neighbours, so that they
/// are the same to the bit.
pub struct Portions<E> {
    evaluator: E,
    candidates: usize,
}

impl<E: Evaluator> Portions<E> {
    /// As many candidates at a time as may be, of which each takes `bytes_each` while it is evaluated.
    pub fn new(evaluator: E, bytes_each: u64) -> Self {
        let fitting = ALLOWED.load(Ordering::Relaxed) / bytes_each.max(1);
        let candidates = usize::try_from(fitting).unwrap_or(usize::MAX).max(LEAST);
        Self {
            evaluator,
            candidates,
        }
    }

    /// So many candidates at a time, one at least.
    pub fn of(evaluator: E, candidates: usize) -> Self {
        Self {
            evaluator,
            candidates: candidates.max(1),
        }
    }
}

impl<E: Evaluator> Evaluator for Portions<E> {
    fn problem(&self) -> &Problem {
        self.evaluator.problem()
    }

    fn backend(&self) -> BackendInfo {
        self.evaluator.backend()
    }

    fn device_faults(&self) -> &[String] {
        self.evaluator.device_faults()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let portion = self
            .candidates
            .saturating_mul(self.evaluator.problem().variables.len().max(1));
        if population.len() <= portion {
            return self.evaluator.evaluate(population);
        }
        let mut whole = Evaluation::default();
        for candidates in population.chunks(portion) {
            let part = self.evaluator.evaluate(candidates)?;
            whole.objectives.extend(part.objectives);
            whole.failures.extend(part.failures);
            whole.violations.extend(part.violations);
        }
        Ok(whole)
    }
}

impl<E: Evaluator + ?Sized> Evaluator for Box<E> {
    fn problem(&self) -> &Problem {
        (**self).problem()
    }

    fn backend(&self) -> BackendInfo {
        (**self).backend()
    }

    fn device_faults(&self) -> &[String] {
        (**self).device_faults()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        (**self).evaluate(population)
    }
}
