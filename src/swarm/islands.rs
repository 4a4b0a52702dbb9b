//! Several swarms on one problem, evaluated together: seeds side by side, with or without migration.
//!
//! All islands are asked at once, so that a device is given one large population and not many small ones. Every few
//! iterations some solutions of each island may move to the next, in a ring (Cohoon, Hegde, Martin, Richards, *Punctuated
//! equilibria: a parallel genetic algorithm*, ICGA 1987). The run does not depend on the threads. Without migration each
//! island gives the run that it would give alone.

use super::settings::setting;
use super::{Counters, Front, Optimiser, no_checkpoint};
use crate::error::Result;
use crate::evaluate::Evaluation;
use crate::swarm::metrics::non_dominated;
use serde::{Deserialize, Serialize};

/// An optimiser that accepts solutions of others.
pub trait AcceptsMigrants: Optimiser {
    /// Takes in solutions of the same problem, with objectives that were evaluated and are finite. Values beyond their bounds are
    /// brought within them.
    fn accept_migrants(&mut self, migrants: &Front);

    /// The checkpoint of islands of such optimisers, see [`Optimiser::to_checkpoint`].
    ///
    /// # Errors
    /// [`crate::Error::Study`] if they have none.
    fn islands_to_checkpoint(_: &Islands<Self>) -> Result<Vec<u8>>
    where
        Self: Sized,
    {
        no_checkpoint()
    }
}

/// How many solutions move between islands, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Migration {
    /// Iterations between two moves.
    pub every: usize,
    /// The most solutions that leave an island for the next.
    pub count: usize,
}

/// Swarms on one problem.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Islands<O> {
    islands: Vec<O>,
    migration: Option<Migration>,
    variables: usize,
    objectives: usize,
    /// Candidates of each island in the population that was asked for last.
    asked: Vec<usize>,
    iteration: usize,
}

impl<O: AcceptsMigrants> Islands<O> {
    /// Islands of these swarms, all on `problem`, in this order in each population.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if there are no swarms, or if migration has a period or a count of zero.
    pub fn new(
        problem: &crate::evaluate::Problem,
        islands: Vec<O>,
        migration: Option<Migration>,
    ) -> Result<Self> {
        if islands.is_empty() {
            return Err(setting("islands", "0".to_owned(), "1 or more"));
        }
        if let Some(m) = migration.filter(|m| m.every == 0 || m.count == 0) {
            let found = format!("{} every {} iterations", m.count, m.every);
            return Err(setting(
                "migration",
                found,
                "1 or more every 1 or more iterations",
            ));
        }
        Ok(Self {
            asked: vec![0; islands.len()],
            islands,
            migration,
            variables: problem.variables.len(),
            objectives: problem.objectives.len(),
            iteration: 0,
        })
    }

    /// The swarms.
    pub fn islands(&self) -> &[O] {
        &self.islands
    }

    /// The swarms, to be given where they start.
    #[cfg(feature = "studies")]
    pub(super) fn islands_mut(&mut self) -> &mut [O] {
        &mut self.islands
    }

    /// Those whose result violates the constraints least.
    fn least_violating(&self) -> impl Iterator<Item = &O> {
        let least = self.violation();
        self.islands
            .iter()
            .filter(move |island| island.violation() <= least)
    }

    /// Each sends a part of its front, evenly over it, to the next.
    fn migrate(&mut self, count: usize) {
        let parties: Vec<Front> = self
            .islands
            .iter()
            .map(|island| {
                let front = island.front();
                let all = front.objectives.len();
                let sent = count.min(all);
                let chosen = |rows: &[Vec<f64>]| (0..sent).map(|i| rows[i * all / sent].clone()).collect();
                Front {
                    candidates: chosen(&front.candidates),
                    objectives: chosen(&front.objectives),
                    violation: front.violation,
                }
            })
            .collect();
        let n = self.islands.len();
        for (i, party) in parties.iter().enumerate() {
            self.islands[(i + 1) % n].accept_migrants(party);
        }
    }
}

impl<O: AcceptsMigrants> AcceptsMigrants for Islands<O> {
    /// Every island takes them in.
    fn accept_migrants(&mut self, migrants: &Front) {
        for island in &mut self.islands {
            island.accept_migrants(migrants);
        }
    }
}

impl<O: AcceptsMigrants> Optimiser for Islands<O> {
    fn ask(&mut self) -> Vec<f64> {
        let mut population = Vec::new();
        for (island, asked) in self.islands.iter_mut().zip(&mut self.asked) {
            *asked = 0;
            // One that is done waits for the others.
            if !island.done() {
                let rows = island.ask();
                *asked = rows.len() / self.variables;
                population.extend(rows);
            }
        }
        population
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        evaluation.check(self.asked.iter().sum(), self.objectives)?;
        let mut from = 0;
        for (island, &count) in self.islands.iter_mut().zip(&self.asked) {
            if count > 0 {
                island.tell(&evaluation.part(from..from + count, self.objectives))?;
                from += count;
            }
        }
        self.iteration += 1;
        if let Some(m) = self.migration
            && self.islands.len() > 1
            && self.iteration.is_multiple_of(m.every)
        {
            self.migrate(m.count);
        }
        Ok(())
    }

    fn counters(&self) -> Counters {
        Counters {
            iteration: self.iteration,
            evaluations: self.islands.iter().map(Optimiser::evaluations).sum(),
        }
    }

    fn to_checkpoint(&self) -> Result<Vec<u8>> {
        O::islands_to_checkpoint(self)
    }

    fn accepting(&mut self) -> Option<&mut dyn AcceptsMigrants> {
        Some(self)
    }

    fn planned_iterations(&self) -> usize {
        let planned = self.islands.iter().map(Optimiser::planned_iterations);
        planned.max().unwrap_or(0)
    }

    fn done(&self) -> bool {
        self.islands.iter().all(Optimiser::done)
    }

    fn best(&self) -> Vec<f64> {
        let all: Vec<Vec<f64>> = self.least_violating().map(Optimiser::best).collect();
        let least = |k: usize| all.iter().map(|best| best[k]).fold(f64::INFINITY, f64::min);
        (0..self.objectives).map(least).collect()
    }

    fn violation(&self) -> f64 {
        let all = self.islands.iter().map(Optimiser::violation);
        all.fold(f64::INFINITY, f64::min)
    }

    /// The solutions of all islands that no other island dominates.
    fn front(&self) -> Front {
        let mut all = Front::default();
        for island in self.least_violating() {
            let front = island.front();
            all.candidates.extend(front.candidates);
            all.objectives.extend(front.objectives);
        }
        let kept = non_dominated(&all.objectives);
        Front {
            candidates: kept.iter().map(|&i| all.candidates[i].clone()).collect(),
            objectives: kept.iter().map(|&i| all.objectives[i].clone()).collect(),
            violation: self.violation(),
        }
    }
}
