//! Populations in portions: the memory of an evaluator stays within bounds for populations of any size.

use super::{BackendInfo, Evaluation, Evaluator, Problem};
use crate::error::Result;
use std::sync::{Mutex, PoisonError};

/// Memory that an evaluator may take by default (bytes).
const USUAL: u64 = 1 << 30;
/// Candidates of the smallest portion: enough to keep threads and devices at work.
pub const LEAST: usize = 1024;

/// The allowances in force, each with its number.
struct Allowed {
    next: u64,
    in_force: Vec<(u64, u64)>,
}

static ALLOWED: Mutex<Allowed> = Mutex::new(Allowed {
    next: 0,
    in_force: Vec::new(),
});

fn allowed<T>(of: impl FnOnce(&mut Allowed) -> T) -> T {
    of(&mut ALLOWED.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Memory that evaluators may take, as long as this lives.
#[derive(Debug)]
#[must_use = "what is allowed ends with it"]
pub struct Allowance(u64);

impl Drop for Allowance {
    fn drop(&mut self) {
        allowed(|a| a.in_force.retain(|(number, _)| *number != self.0));
    }
}

/// Lets each evaluator that is opened while the allowance lives take so much memory beside its population (bytes). Of several
/// allowances the latest holds. The allowance is the process's. Results do not depend on it.
pub fn allow(bytes: u64) -> Allowance {
    allowed(|a| {
        a.next += 1;
        a.in_force.push((a.next, bytes));
        Allowance(a.next)
    })
}

/// Memory that an evaluator opened now may take (bytes).
pub fn present() -> u64 {
    allowed(|a| a.in_force.last().map_or(USUAL, |(_, bytes)| *bytes))
}

/// Candidates that an evaluator opened now may have at a time, each taking `bytes_each` bytes.
pub(crate) fn portion(bytes_each: u64) -> usize {
    let fitting = present() / bytes_each.max(1);
    usize::try_from(fitting).unwrap_or(usize::MAX).max(LEAST)
}

/// Scores populations in portions, one after the other. Scores of a candidate do not depend on its neighbours: they are the same
/// bit for bit.
pub struct Portions<E> {
    evaluator: E,
    candidates: usize,
}

impl<E: Evaluator> Portions<E> {
    /// As many candidates at a time as fit the allowance, each taking `bytes_each` bytes while it is evaluated.
    pub fn new(evaluator: E, bytes_each: u64) -> Self {
        Self {
            evaluator,
            candidates: portion(bytes_each),
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
            whole.append(self.evaluator.evaluate(candidates)?);
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
