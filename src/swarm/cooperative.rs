//! Cooperating swarms, each of which looks after some of the variables: CPSO-S_K.
//!
//! Van den Bergh, Engelbrecht, *A cooperative approach to particle swarm optimization*, IEEE TEC 8 (2004). The
//! variables are split into groups, each with a swarm of its own. A particle is evaluated in the context of the
//! other groups' best, so a good value of one group is not lost because another group was bad at the same time.
//! The groups take turns, one in each iteration, each from the context that the one before has left. Before that,
//! all groups together draw whole candidates until one of these can be evaluated: it is the first context.

use super::checkpoint::to_bytes;
use super::motion::{Particles, Purpose};
use super::settings::{BoundHandling, Constriction, Mutation, PsoSettings, Randomness, Schedule, setting};
use super::space::Space;
use super::{Counters, Front, Optimiser};
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem, Worth};
use crate::random::Random;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Settings of [`CooperativeSwarm`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CooperativeSettings {
    /// Motion within each group; the population is that of one group, the iterations those of all groups together.
    /// There are no difference moves.
    pub motion: PsoSettings,
    /// Number of groups; at most one for each variable that is not fixed.
    pub groups: usize,
}

impl Default for CooperativeSettings {
    /// Six groups of ten particles, the pulls and the inertia of the paper.
    fn default() -> Self {
        Self {
            motion: PsoSettings {
                population: 10,
                iterations: 10_000,
                seed: 1,
                inertia: Schedule::Linear { from: 1.0, to: 0.0 },
                cognitive: Schedule::Fixed(1.49),
                social: Schedule::Fixed(1.49),
                constriction: Constriction::None,
                randomness: Randomness::PerDimension,
                speed_limit: 0.5,
                bounds: BoundHandling::Bounce,
                difference_share: 0.0,
                mutation: Mutation::None,
            },
            groups: 6,
        }
    }
}

impl CooperativeSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        if self.groups == 0 {
            return Err(setting("groups", self.groups.to_string(), "1 or more"));
        }
        if self.motion.mutation != Mutation::None {
            let found = format!("{:?}", self.motion.mutation);
            return Err(setting(
                "mutation",
                found,
                "none: the cooperative swarm has no mutation",
            ));
        }
        self.motion.validate()
    }
}

/// The swarm of one group.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Group {
    /// The coordinates that it looks after.
    columns: Range<usize>,
    particles: Particles,
    best_position: Vec<f64>,
    best: Vec<Worth>,
    turns: usize,
    random: Random,
}

impl Group {
    /// Takes what its particles are worth.
    fn note(&mut self, worths: &[Worth]) {
        for (particle, &worth) in worths.iter().enumerate() {
            if worth < self.best[particle] {
                self.best[particle] = worth;
                let range = self.particles.row(particle);
                self.best_position[range.clone()].copy_from_slice(&self.particles.position[range]);
            }
        }
    }

    /// Moves its particles; it has as many turns as are `planned`.
    fn advance(&mut self, leader: &[f64], settings: &PsoSettings, planned: usize) {
        let share = (self.turns as f64 / planned as f64).min(1.0);
        for particle in 0..self.particles.count {
            let own = &self.best_position[self.particles.row(particle)];
            let when = (share, self.turns);
            self.particles
                .one(particle)
                .pull((own, leader), settings, when, self.random);
        }
        self.turns += 1;
    }
}

/// Groups of particles about a common context, for a single objective.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CooperativeSwarm {
    settings: CooperativeSettings,
    space: Space,
    groups: Vec<Group>,
    /// The best position of each group, put together, and what it is worth.
    context: Vec<f64>,
    best: Worth,
    /// Turns that the groups have had; none before there is a context that can be evaluated.
    turns: usize,
    counters: Counters,
}

impl CooperativeSwarm {
    /// Swarms over the variables of `problem`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range, and for a problem of several objectives.
    pub fn new(problem: &Problem, settings: CooperativeSettings) -> Result<Self> {
        settings.validate()?;
        let space = Space::of_one_objective(problem)?;
        let d = space.dimensions();
        let count = settings.groups.min(d).max(1);
        let groups: Vec<Group> = (0..count)
            .map(|g| {
                let columns = g * d / count..(g + 1) * d / count;
                // Each group draws from a seed of its own.
                let words = Random::new(settings.motion.seed).words(Purpose::Start as u32, 0, g as u32, 0);
                let random = Random::new(u64::from(words[0]) << 32 | u64::from(words[1]));
                let particles =
                    Particles::scattered_in(space.part(columns.clone()), settings.motion.population, random);
                Group {
                    best_position: particles.position.clone(),
                    best: vec![Worth::FAILED; settings.motion.population],
                    columns,
                    particles,
                    turns: 0,
                    random,
                }
            })
            .collect();
        let context = groups
            .iter()
            .flat_map(|g| g.particles.position[g.particles.row(0)].to_vec())
            .collect();
        Ok(Self {
            settings,
            space,
            groups,
            context,
            best: Worth::FAILED,
            turns: 0,
            counters: Counters::default(),
        })
    }

    /// The groups that the next candidates differ in.
    fn moving(&self) -> Range<usize> {
        if self.turns == 0 {
            return 0..self.groups.len();
        }
        let turn = self.turns % self.groups.len();
        turn..turn + 1
    }

    /// The best candidate so far, in the variables' units, and what it is worth.
    pub fn best_candidate(&self) -> (Vec<f64>, Worth) {
        (self.space.scaled(&self.context, 1), self.best)
    }
}

impl Optimiser for CooperativeSwarm {
    fn ask(&mut self) -> Vec<f64> {
        let count = self.settings.motion.population;
        let moving = self.moving();
        let row = |particle: usize| {
            let mut position = self.context.clone();
            for group in &self.groups[moving.clone()] {
                position[group.columns.clone()]
                    .copy_from_slice(&group.particles.position[group.particles.row(particle)]);
            }
            position
        };
        let rows: Vec<f64> = (0..count).flat_map(row).collect();
        self.space.scaled(&rows, count)
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        evaluation.check(self.settings.motion.population, 1)?;
        let worths = evaluation.worths(1);
        let moving = self.moving();
        for group in &mut self.groups[moving.clone()] {
            group.note(&worths);
        }
        for (particle, &worth) in worths.iter().enumerate() {
            if worth < self.best {
                self.best = worth;
                for group in &self.groups[moving.clone()] {
                    self.context[group.columns.clone()]
                        .copy_from_slice(&group.particles.position[group.particles.row(particle)]);
                }
            }
        }
        self.counters.told(worths.len());
        if !self.best.succeeded() {
            for group in &mut self.groups {
                for particle in 0..group.particles.count {
                    group
                        .particles
                        .rescatter(particle, self.counters.iteration, group.random);
                }
            }
            return Ok(());
        }
        let planned = (self.settings.motion.iterations / self.groups.len()).max(2) - 1;
        for group in &mut self.groups[moving] {
            let leader = self.context[group.columns.clone()].to_vec();
            group.advance(&leader, &self.settings.motion, planned);
            self.turns += 1;
        }
        Ok(())
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn to_checkpoint(&self) -> Result<Vec<u8>> {
        to_bytes(self)
    }

    fn planned_iterations(&self) -> usize {
        self.settings.motion.iterations
    }

    fn front(&self) -> Front {
        Front::single(self.best_candidate())
    }

    fn best(&self) -> Vec<f64> {
        vec![self.best.cost]
    }
}
