//! The small swarm: double precision, one particle after the other.

use super::earnings::{Earnings, Move};
use super::relaxation::{Pushing, is_pushed};
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem};
use crate::random::Random;
use crate::swarm::archive::Archive;
use crate::swarm::genetic::cross;
use crate::swarm::metrics::dominates;
use crate::swarm::motion::{Particles, Purpose, Trials, polynomial};
use crate::swarm::settings::{Leaders, MopsoSettings};
use crate::swarm::{Counters, Front, Optimiser};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Particles in rows, and their archive.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct SmallSwarm {
    settings: MopsoSettings,
    random: Random,
    particles: Particles,
    trials: Trials,
    objectives: usize,
    best_position: Vec<f64>,
    best_objectives: Vec<Vec<f64>>,
    best_violation: Vec<f64>,
    archive: Archive,
    pushing: Pushing,
    earnings: Earnings,
    counters: Counters,
}

impl SmallSwarm {
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range.
    pub fn new(problem: &Problem, settings: MopsoSettings) -> Result<Self> {
        settings.validate()?;
        let random = Random::new(settings.motion.seed);
        let particles = Particles::scattered(problem, settings.motion.population, random)?;
        Ok(Self {
            best_position: particles.position.clone(),
            best_objectives: vec![vec![f64::INFINITY; problem.objectives.len()]; settings.motion.population],
            best_violation: vec![f64::INFINITY; settings.motion.population],
            objectives: problem.objectives.len(),
            archive: settings.empty_archive(problem.objectives.len())?,
            pushing: Pushing::default(),
            random,
            particles,
            trials: Trials::default(),
            settings,
            earnings: Earnings::default(),
            counters: Counters::default(),
        })
    }

    /// # Errors
    /// Those of [`super::Mopso::start_from`].
    pub fn start_from(&mut self, candidates: &[Vec<f64>]) -> Result<()> {
        let starts = self.particles.space.starts(candidates, self.particles.count)?;
        for (particle, position) in starts.iter().enumerate() {
            let row = self.particles.row(particle);
            self.particles.position[row.clone()].copy_from_slice(position);
            self.best_position[row].copy_from_slice(position);
        }
        Ok(())
    }

    pub fn archive(&self) -> &Archive {
        &self.archive
    }

    /// They join the archive.
    pub fn accept_migrants(&mut self, migrants: &Front) {
        for (candidate, row) in migrants.candidates.iter().zip(&migrants.objectives) {
            let position = self.particles.space.position(candidate);
            self.archive.insert_violating(&position, row, migrants.violation);
        }
    }

    pub fn bytes_per_particle(&self) -> usize {
        let row = size_of::<Vec<f64>>() + self.objectives * size_of::<f64>();
        3 * self.particles.dimensions() * size_of::<f64>() + row
    }

    /// The parent that a particle follows, as [`parent`] counts them. While nothing feasible is known, the archive has little more
    /// than the one candidate that violates least. A swarm that follows it ends in the hollow where that lies. So two particles are
    /// drawn, and the own best that violates less leads.
    fn leader(&mut self, worth: &[f64], particle: usize) -> usize {
        let (random, when, who) = (self.random, self.counters.iteration as u32, particle as u32);
        let draw = |count, index| random.below(count, Purpose::Leader as u32, when, who, index);
        let members = self.archive.len();
        if self.archive.violation() > 0.0 {
            let [first, second] = [0, 1].map(|index| draw(self.particles.count, index));
            let second_leads = self.best_violation[second] < self.best_violation[first];
            return members + if second_leads { second } else { first };
        }
        let draw = |index| draw(members, index);
        let first = draw(0);
        match self.settings.leaders {
            Leaders::Random => first,
            Leaders::Tournament => {
                let second = draw(1);
                if self.archive.leads_before(worth, second, first) {
                    second
                } else {
                    first
                }
            }
        }
    }

    /// The parents that a leader's mates are drawn from, as [`parent`] counts them: the archive's members, and own bests for those that
    /// it lacks. The first few members are close together, and a swarm bred from them alone gathers in their hollow. Where constraints
    /// leave few members, only own bests.
    fn mates(&self) -> Range<usize> {
        let members = self.archive.len();
        let wanted = self.settings.archive.min(self.particles.count);
        let violates = |violation: &f64| *violation > 0.0 && violation.is_finite();
        let infeasible = self.archive.violation() > 0.0;
        if infeasible || 2 * members < wanted && self.best_violation.iter().any(violates) {
            members..members + self.particles.count
        } else {
            0..members.max(wanted)
        }
    }

    /// The mate of that number among them: a member where a particle has no own best yet.
    fn mate(&self, mates: &Range<usize>, number: usize) -> usize {
        let (mate, members) = (mates.start + number, self.archive.len());
        let unknown = mate >= members && self.best_violation[mate - members].is_infinite();
        if unknown { mate % members } else { mate }
    }

    /// From the leader along the difference of two mates, in some of the coordinates or in all \[7\].
    fn difference_move(&mut self, particle: usize, leader: usize, mates: &Range<usize>) {
        let (when, who) = (self.counters.iteration as u32, particle as u32);
        let purpose = Purpose::Difference as u32;
        let pick = |index: u32, count: usize| self.random.below(count, purpose, when, who, index);
        let [first, second] = [0, 1].map(|index| self.mate(mates, pick(index, mates.len())));
        let d = self.particles.dimensions();
        let parent = |number| parent(&self.archive, &self.best_position, d, number);
        let [from, first, second] = [leader, first, second].map(parent);
        let row = self.particles.row(particle);
        let always = pick(2, row.len().max(1));
        let whole = self.random.uniform(purpose, when, who, 3) < ALL_COORDINATES;
        for (k, i) in row.enumerate() {
            let chosen = self.random.uniform(purpose, when, who, 4 + k as u32) < CROSSOVER;
            let step = if whole || chosen || k == always {
                SCALE * (first[k] - second[k])
            } else {
                0.0
            };
            self.particles.position[i] = (from[k] + step).clamp(0.0, 1.0);
            self.particles.velocity[i] = 0.0;
        }
    }

    /// To a place between or about the leader and a mate, each coordinate by itself, disturbed by polynomial mutation, as the
    /// children of genetic algorithms \[5\]. A few of the mutations go anywhere.
    fn crossing(&mut self, particle: usize, leader: usize, mates: &Range<usize>) {
        let (when, who) = (self.counters.iteration as u32, particle as u32);
        let uniform = |purpose: Purpose, index: u32| self.random.uniform(purpose as u32, when, who, index);
        let drawn = self
            .random
            .below(mates.len(), Purpose::Recombine as u32, when, who, 4);
        let d = self.particles.dimensions();
        let parent = |number| parent(&self.archive, &self.best_position, d, number);
        let [one, other] = [leader, self.mate(mates, drawn)].map(parent);
        let share = 1.0 / self.particles.dimensions() as f64;
        for (k, i) in self.particles.row(particle).enumerate() {
            let drawn = |index: u32| uniform(Purpose::Recombine, 8 + 4 * k as u32 + index);
            let mut x = one[k];
            if drawn(0) < 0.5 {
                let (low, high) = cross(one[k], other[k], drawn(1), CROSSING_INDEX);
                x = if drawn(2) < 0.5 { low } else { high };
            }
            let [mutates, where_to] = [0, 1].map(|index| uniform(Purpose::Mutation, 2 * k as u32 + index));
            if mutates < ANYWHERE * share {
                x = where_to;
            } else if mutates < share {
                x = polynomial(x, where_to, MUTATION_INDEX);
            }
            self.particles.position[i] = x;
            self.particles.velocity[i] = 0.0;
        }
    }

    /// Moves the particles: those that keep to the constraints by the archive, the others by that of the relaxed constraints.
    fn advance(&mut self) {
        if self.pushing.relaxation().is_none() {
            return self.advance_some(|_| true);
        }
        self.advance_some(|particle| !is_pushed(particle));
        self.exchange_archives();
        self.advance_some(is_pushed);
        self.exchange_archives();
    }

    /// The archive that pushed particles follow takes the place of the swarm's, or the other way.
    fn exchange_archives(&mut self) {
        if let Some(relaxation) = self.pushing.relaxation_mut() {
            std::mem::swap(&mut self.archive, &mut relaxation.archive);
        }
    }

    /// Moves these particles by the archive.
    fn advance_some(&mut self, moves: impl Fn(usize) -> bool) {
        let share = self.counters.iteration as f64 / (self.settings.motion.iterations.max(2) - 1) as f64;
        let worth = self.archive.worth_at_once();
        let mates = self.mates();
        for particle in (0..self.settings.motion.population).filter(|particle| moves(*particle)) {
            if self.archive.is_empty() {
                // Nobody knows anything yet.
                self.particles
                    .rescatter(particle, self.counters.iteration, self.random);
            } else {
                let leader = self.leader(&worth, particle);
                match self.choice(&self.earnings, particle) {
                    Move::Crossing => {
                        self.crossing(particle, leader, &mates);
                        continue;
                    }
                    Move::Difference => self.difference_move(particle, leader, &mates),
                    Move::Pull => {
                        let d = self.particles.dimensions();
                        let own = &self.best_position[self.particles.row(particle)];
                        self.particles.one(particle).pull(
                            (own, parent(&self.archive, &self.best_position, d, leader)),
                            &self.settings.motion,
                            (share, self.counters.iteration),
                            self.random,
                        );
                    }
                }
            }
            let (motion, now) = (&self.settings.motion, (share, self.counters.iteration));
            self.particles
                .mutate(particle, motion.mutation, now, self.random, &mut self.trials);
        }
    }

    /// The move that a particle makes by these earnings.
    fn choice(&self, earnings: &Earnings, particle: usize) -> Move {
        let usual = self.settings.motion.difference_share;
        earnings.choice(usual, self.coin(Purpose::Recombine, particle))
    }

    fn coin(&self, purpose: Purpose, particle: usize) -> f64 {
        let (when, who) = (self.counters.iteration as u32, particle as u32);
        self.random.uniform(purpose as u32, when, who, 0)
    }
}

/// The position of a parent: the archive's members come first, then the particles' own bests. There has to be a member.
fn parent<'a>(archive: &'a Archive, own_bests: &'a [f64], dimensions: usize, parent: usize) -> &'a [f64] {
    match parent.checked_sub(archive.len()) {
        None => &archive.positions[parent][..dimensions],
        Some(particle) => &own_bests[particle * dimensions..(particle + 1) * dimensions],
    }
}

/// Share of the difference that a difference move takes.
const SCALE: f64 = 0.5;
/// Share of the coordinates that a difference move changes. A third solves ZDT4 where all of them sometimes do
/// not, and spreads DTLZ2's front better.
const CROSSOVER: f64 = 0.3;
/// Share of the difference moves that change all coordinates. Where variables are linked, the difference of two members tells how they
/// change together; without these moves, UF3 ends at 0.56 instead of 0.59.
const ALL_COORDINATES: f64 = 0.3;
/// Distribution index of the crossover of a crossing.
const CROSSING_INDEX: f64 = 20.0;
/// Distribution index of its mutation. With the usual 20, UF5 ends at a hypervolume of 0.09 instead of 0.31.
const MUTATION_INDEX: f64 = 8.0;
/// Share of its mutations that put a coordinate anywhere within its bounds. Polynomial mutation hardly ever leaves a hollow for the
/// next: without them, the median hypervolume of MW10 is 0.38 instead of 0.50.
const ANYWHERE: f64 = 0.15;

impl Optimiser for SmallSwarm {
    fn ask(&mut self) -> Vec<f64> {
        self.trials.candidates(&self.particles)
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        let asked = self.particles.count + self.trials.len();
        evaluation.check(asked, self.objectives)?;
        let rows = self
            .trials
            .settle(&mut self.particles, evaluation, self.objectives);
        // Nobody moved towards anything yet.
        let scattered = self.archive.is_empty() || self.counters.iteration == 0;
        let before = self.earnings.clone();
        self.earnings.fade();
        let (iteration, violated) = (
            self.counters.iteration,
            evaluation.violations.iter().any(|v| *v > 0.0),
        );
        self.pushing.advance(&self.archive, &self.settings, iteration);
        self.pushing
            .begin(violated, &self.archive, &self.settings, iteration);
        for (particle, of) in rows.into_iter().enumerate() {
            let Some(row) = evaluation.success(of, self.objectives) else {
                continue;
            };
            let range = self.particles.row(particle);
            let position = &self.particles.position[range.clone()];
            let told = evaluation.violation(of);
            let pushed = is_pushed(particle);
            let relaxation = self.pushing.relaxation().filter(|_| pushed);
            let counts = |violation| relaxation.map_or(violation, |r| r.violation(violation));
            let (violation, least) = (counts(told), counts(self.best_violation[particle]));
            let followed = relaxation.map_or(&self.archive, |r| &r.archive);
            let mut members = followed.objectives.iter();
            let takes = violation < followed.violation() || members.any(|member| dominates(row, member));
            let mut entered = self.archive.insert_violating(position, row, told);
            if let Some(relaxation) = self.pushing.relaxation_mut() {
                let entered_relaxed = relaxation.insert(position, row, told);
                if pushed {
                    entered = entered_relaxed;
                }
            }
            if !scattered {
                let earned = takes && entered;
                let made = self.choice(&before, particle);
                self.earnings.count(made, earned);
            }
            let heads = self.coin(Purpose::Coin, particle) < 0.5;
            let best = &mut self.best_objectives[particle];
            let open = violation == least && !dominates(best, row) && heads;
            if violation < least || (violation == least && dominates(row, best)) || open {
                self.best_violation[particle] = told;
                best.copy_from_slice(row);
                self.best_position[range].copy_from_slice(position);
            }
        }
        self.counters.told(asked);
        self.advance();
        Ok(())
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn planned_iterations(&self) -> usize {
        self.settings.motion.iterations
    }

    fn front(&self) -> Front {
        self.archive.front(&self.particles.space)
    }

    fn best(&self) -> Vec<f64> {
        self.archive.best(self.objectives)
    }

    fn violation(&self) -> f64 {
        self.archive.violation()
    }
}
