//! What a search had come to on its way, so that searches can be set beside one another by what they cost.

use super::Counters;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Times that a search for a front is looked at on its way, each after an equal share of its iterations.
const LOOKS: usize = 24;

/// What a search had come to after so many evaluations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reached {
    /// Candidates evaluated.
    pub evaluations: u64,
    /// Time that the search had taken (s).
    pub elapsed_s: f64,
    /// The least cost, of a search for one objective that has found any.
    pub best: Option<f64>,
    /// Objectives of a front, row by row; empty for one objective.
    pub front: Vec<Vec<f64>>,
}

impl Reached {
    /// The least cost of one objective; none yet if it is not finite.
    pub fn best(evaluations: u64, elapsed_s: f64, best: f64) -> Self {
        Self {
            evaluations,
            elapsed_s,
            best: Some(best).filter(|best| best.is_finite()),
            front: Vec::new(),
        }
    }
}

/// The way of a search.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Trail {
    reached: Vec<Reached>,
    elapsed_s: f64,
    /// The last time that the clock was read; a search that is resumed has its time from before.
    #[serde(skip)]
    since: Option<Instant>,
}

impl Trail {
    /// What was reached, in the order of evaluations.
    pub fn reached(&self) -> &[Reached] {
        &self.reached
    }

    /// Lets the clock run.
    pub fn begin(&mut self) {
        self.since.get_or_insert_with(Instant::now);
    }

    /// Notes the front, or the best of one objective, after an iteration of the planned number, if it is time to. Iterations that are
    /// taken again are not noted twice.
    pub fn note(&mut self, now: Counters, planned: usize, front: impl FnOnce() -> Vec<Vec<f64>>) {
        if let Some(since) = self.since.replace(Instant::now()) {
            self.elapsed_s += since.elapsed().as_secs_f64();
        }
        let looks = |iterations: usize| iterations * LOOKS / planned.max(1);
        let is_new = self
            .reached
            .last()
            .is_none_or(|last| last.evaluations < now.evaluations);
        if is_new && (now.iteration <= 1 || looks(now.iteration) > looks(now.iteration - 1)) {
            let front = front();
            self.reached.push(match &front[..] {
                [only] if only.len() == 1 => Reached::best(now.evaluations, self.elapsed_s, only[0]),
                _ => Reached {
                    evaluations: now.evaluations,
                    elapsed_s: self.elapsed_s,
                    best: None,
                    front,
                },
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A thousand iterations are looked at after the first, and after each twenty-fourth of them; ten after each of them.
    #[test]
    fn a_search_is_looked_at_by_equal_shares_of_its_iterations() {
        for (planned, looks) in [(1000, LOOKS + 1), (10, 10)] {
            let mut trail = Trail::default();
            for iteration in (1..=planned).chain(planned - 1..=planned) {
                let now = Counters {
                    iteration,
                    evaluations: 7 * iteration as u64,
                };
                trail.begin();
                trail.note(now, planned, || vec![vec![iteration as f64]]);
            }
            let seen = trail.reached();
            assert_eq!(seen.len(), looks);
            assert_eq!(seen.last().map(|last| last.evaluations), Some(7 * planned as u64));
            assert!(seen.windows(2).all(|two| two[0].elapsed_s <= two[1].elapsed_s));
        }
    }
}
