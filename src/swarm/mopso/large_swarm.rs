//! A swarm of thousands to millions: particles in lanes and threads, and an archive that is given only what may enter it.
//!
//! The moves are those of the small swarm, in single precision and drawn from the same generator; [`super::blocks`] is
//! the twin of the kernel that moves swarms on a device. [`super::filter`] and [`super::thinning`] stand between the swarm
//! and its archive. All of it is linear in the particles but for sorting the few that nothing dominates.

use super::blocks::{Generation, UNKNOWN, advance, judge, scatter};
use super::earnings::Earnings;
use super::filter::{Point, front, part, point};
use super::relaxation::{Pushing, counted, is_pushed};
use super::stand_ins::StandIns;
use super::thinning::{PER_PLACE, thinned};
use crate::error::Result;
use crate::evaluate::resident::BLOCK;
use crate::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use crate::evaluate::{Evaluation, Failure, Problem};
use crate::random::Random;
use crate::scalar::lanes::Lanes;
use crate::swarm::archive::Archive;
#[cfg(feature = "gpu")]
use crate::swarm::device::DeviceState;
use crate::swarm::metrics::dominates;
use crate::swarm::settings::{MopsoSettings, setting};
use crate::swarm::space::Space;
use crate::swarm::{Counters, Front, Optimiser};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The greatest objective that a personal best can have. Beyond it, the archive alone knows which of two is better.
const GREATEST: f32 = UNKNOWN.next_down();

/// Particles that are filtered together and that one thread handles in a row.
const PART: usize = 64 * BLOCK;

/// The empty archive of a swarm in single precision over the variables of `problem`.
///
/// # Errors
/// [`crate::Error::Input`] naming the setting that is out of its range or that only small swarms obey.
pub fn empty_archive(problem: &Problem, settings: &MopsoSettings) -> Result<Archive> {
    let objectives = problem.objectives.len();
    let archive = settings.empty_archive(objectives)?;
    let motion = &settings.motion;
    if motion.mutation.tries() {
        let found = format!("{:?}", motion.mutation);
        let expected = "none or polynomial, for a swarm in single precision or on a device";
        return Err(setting("mutation", found, expected));
    }
    // A best of one member has no differences.
    if objectives == 1 && motion.difference_share > 0.0 {
        let found = format!("{}, with one objective", motion.difference_share);
        let expected = "0, for a swarm in single precision or on a device";
        return Err(setting("difference_share", found, expected));
    }
    Ok(archive)
}

/// State of a large swarm. Rows of a block follow one another; its last block may have lanes without a particle.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct LargeSwarm {
    settings: MopsoSettings,
    random: Random,
    space: Space,
    objectives: usize,
    position: Vec<f32>,
    velocity: Vec<f32>,
    best_position: Vec<f32>,
    best_objectives: Vec<f32>,
    /// `None` before any violation was told.
    best_violation: Vec<f64>,
    archive: Archive,
    pushing: Pushing,
    earnings: Earnings,
    counters: Counters,
}

/// Scatters a part of the swarm, whose first particle is `first`.
struct Scatter<'a> {
    generation: &'a Generation,
    random: Random,
    first: usize,
    position: &'a mut [f32],
}

impl LaneWork for Scatter<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let size = BLOCK * self.generation.dimensions as usize;
        for (block, rows) in self.position.chunks_exact_mut(size).enumerate() {
            let first = (self.first + block * BLOCK) as u32;
            scatter(self.generation, self.random, first, rows);
        }
    }
}

/// What a point has to be to enter an archive.
struct Entrance {
    /// The violation that counts as none.
    allowance: f64,
    /// The violation that the archive takes.
    level: f64,
    /// The objectives of its members, if they stay.
    members: Vec<[f64; 3]>,
}

impl Entrance {
    /// To `archive`, where the least violation of the swarm is `least`.
    fn to(archive: &Archive, allowance: f64, least: f64) -> Self {
        let known = archive.violation();
        let level = known.min(counted(least, allowance));
        let rows = archive.objectives.iter().filter(|_| level == known);
        Self {
            allowance,
            level,
            members: rows.map(|row| point(row, 0).at).collect(),
        }
    }
}

/// Updates the personal bests of a part of the swarm, and finds its points that may enter each of the archives.
struct Learn<'a> {
    generation: &'a Generation,
    random: Random,
    first: usize,
    rows: &'a [f64],
    failures: &'a [Option<Failure>],
    /// Nothing where there are no constraints, as is the best of each particle.
    violations: &'a [f64],
    best_violation: &'a mut [f64],
    /// The violation that counts as none for the bests of pushed particles.
    allowance: f64,
    position: &'a [f32],
    best_position: &'a mut [f32],
    best_objectives: &'a mut [f32],
    entrances: &'a [Entrance],
}

impl LaneWork for Learn<'_> {
    type Output = Vec<Vec<Point>>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<Vec<Point>> {
        let width = self.generation.objectives as usize;
        let size = BLOCK * self.generation.dimensions as usize;
        let mut objectives = vec![UNKNOWN; BLOCK * width];
        let blocks = self
            .position
            .chunks_exact(size)
            .zip(self.best_position.chunks_exact_mut(size))
            .zip(self.best_objectives.chunks_exact_mut(BLOCK * width));
        for (block, ((position, best_position), best_objectives)) in blocks.enumerate() {
            let rows = self.rows.chunks_exact(width).skip(block * BLOCK).take(BLOCK);
            objectives.fill(UNKNOWN);
            for (lane, row) in rows.enumerate() {
                let i = block * BLOCK + lane;
                let mut sound = self.failures[i].is_none() && row.iter().all(|x| x.is_finite());
                if let (Some(best), Some(violation)) = (self.best_violation.get(i), self.violations.get(i)) {
                    let allowance = if is_pushed(self.first + i) {
                        self.allowance
                    } else {
                        0.0
                    };
                    let (known, counts) = (counted(*best, allowance), counted(*violation, allowance));
                    // Less is better whatever was known before, and more is never.
                    if sound && counts < known {
                        (0..width).for_each(|k| best_objectives[k * BLOCK + lane] = UNKNOWN);
                    }
                    sound &= counts <= known;
                }
                if sound {
                    for (k, value) in row.iter().enumerate() {
                        objectives[k * BLOCK + lane] = (*value as f32).clamp(-GREATEST, GREATEST);
                    }
                }
            }
            let taken = judge(
                self.generation,
                self.random,
                (self.first + block * BLOCK) as u32,
                (position, &objectives),
                (best_position, best_objectives),
            );
            let violations = self.violations.iter().skip(block * BLOCK);
            let bests = self.best_violation.iter_mut().skip(block * BLOCK);
            for ((best, violation), taken) in bests.zip(violations).zip(taken) {
                *best = if taken { *violation } else { *best };
            }
        }
        let mut fronts = Vec::with_capacity(self.entrances.len());
        for entrance in self.entrances {
            let within = |violation: &f64| counted(*violation, entrance.allowance) == entrance.level;
            let sound = |i: usize| self.failures[i].is_none() && self.violations.get(i).is_none_or(within);
            fronts.push(part(
                self.rows,
                width,
                self.first as u32,
                sound,
                &entrance.members,
            ));
        }
        fronts
    }
}

/// Moves a part of the swarm.
struct Move<'a> {
    generation: &'a Generation,
    random: Random,
    first: usize,
    best_position: &'a [f32],
    leaders: &'a [f32],
    position: &'a mut [f32],
    velocity: &'a mut [f32],
}

impl LaneWork for Move<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let size = BLOCK * self.generation.dimensions as usize;
        let blocks = self
            .position
            .chunks_exact_mut(size)
            .zip(self.velocity.chunks_exact_mut(size))
            .zip(self.best_position.chunks_exact(size));
        for (block, ((position, velocity), best)) in blocks.enumerate() {
            let first = (self.first + block * BLOCK) as u32;
            advance(
                self.generation,
                self.random,
                first,
                best,
                self.leaders,
                (position, velocity),
            );
        }
    }
}

impl LargeSwarm {
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range.
    pub fn new(problem: &Problem, settings: MopsoSettings) -> Result<Self> {
        let archive = empty_archive(problem, &settings)?;
        let space = Space::new(problem)?;
        let (d, width) = (space.dimensions(), problem.objectives.len());
        let lanes = settings.motion.population.next_multiple_of(BLOCK);
        let random = Random::new(settings.motion.seed);
        let earnings = Earnings::default();
        let generation = Generation::new(&settings, &earnings, (d, width, 0), 0);
        let mut position = vec![0.0; lanes * d];
        position
            .par_chunks_mut((PART * d).max(1))
            .enumerate()
            .for_each(|(number, position)| {
                let scatter = Scatter {
                    generation: &generation,
                    random,
                    first: number * PART,
                    position,
                };
                dispatch(InstructionSet::best(), scatter);
            });
        Ok(Self {
            velocity: vec![0.0; lanes * d],
            best_position: position.clone(),
            best_objectives: vec![UNKNOWN; lanes * width],
            best_violation: Vec::new(),
            archive,
            pushing: Pushing::default(),
            objectives: width,
            position,
            random,
            space,
            settings,
            earnings,
            counters: Counters::default(),
        })
    }

    /// # Errors
    /// Those of [`super::Mopso::start_from`].
    pub fn start_from(&mut self, candidates: &[Vec<f64>]) -> Result<()> {
        let starts = self.space.starts(candidates, self.settings.motion.population)?;
        for (particle, position) in starts.into_iter().enumerate() {
            for (k, x) in position.into_iter().enumerate() {
                let place = self.place(particle, k);
                self.position[place] = x as f32;
                self.best_position[place] = x as f32;
            }
        }
        Ok(())
    }

    /// What a device holds of the swarm; nothing if it knows of violations, which are single precision there.
    #[cfg(feature = "gpu")]
    pub fn to_device(&self) -> Option<DeviceState> {
        self.best_violation.is_empty().then(|| DeviceState {
            settings: self.settings.clone(),
            space: self.space.clone(),
            objectives: self.objectives,
            constrained: false,
            position: self.position.clone(),
            velocity: self.velocity.clone(),
            best_position: self.best_position.clone(),
            best_objectives: self.best_objectives.clone(),
            archive: self.archive.clone(),
            pushing: self.pushing.clone(),
            earnings: self.earnings.clone(),
            counters: self.counters,
        })
    }

    /// The swarm that a device has held.
    #[cfg(feature = "gpu")]
    pub fn from_device(state: DeviceState) -> Self {
        let best_violation = state.best_violation();
        let best_objectives = state.best_costs();
        Self {
            random: Random::new(state.settings.motion.seed),
            settings: state.settings,
            space: state.space,
            objectives: state.objectives,
            position: state.position,
            velocity: state.velocity,
            best_position: state.best_position,
            best_objectives,
            best_violation,
            archive: state.archive,
            pushing: state.pushing,
            earnings: state.earnings,
            counters: state.counters,
        }
    }

    /// Lets go of the particles.
    #[cfg(feature = "studies")]
    pub fn let_particles_go(&mut self) {
        self.position = Vec::new();
        self.velocity = Vec::new();
        self.best_position = Vec::new();
        self.best_objectives = Vec::new();
    }

    pub fn archive(&self) -> &Archive {
        &self.archive
    }

    /// They join the archive.
    pub fn accept_migrants(&mut self, migrants: &Front) {
        let rows = migrants.candidates.iter().zip(&migrants.objectives);
        let solution =
            |(candidate, row): (&Vec<f64>, &Vec<f64>)| (self.space.position(candidate), row.clone());
        self.archive
            .insert_all(rows.map(solution).collect(), migrants.violation);
    }

    pub fn bytes_per_particle(&self) -> usize {
        (3 * self.space.dimensions() + self.objectives) * size_of::<f32>()
    }

    /// Where a coordinate of a particle stands.
    fn place(&self, particle: usize, k: usize) -> usize {
        (particle / BLOCK * self.space.dimensions() + k) * BLOCK + particle % BLOCK
    }

    fn generation(&self) -> Generation {
        let sizes = (self.space.dimensions(), self.objectives, self.archive.len());
        Generation::new(&self.settings, &self.earnings, sizes, self.counters.iteration)
    }

    /// The points of the swarm that may enter the archive and their violation; the same of the archive that pushed particles follow, if
    /// there is one.
    fn learn(&mut self, evaluation: &Evaluation) -> Vec<(Vec<Point>, f64)> {
        let (d, width) = (self.space.dimensions(), self.objectives);
        let generation = self.generation();
        let random = self.random;
        let n = self.settings.motion.population;
        let violations: Vec<f64> = if evaluation.violations.is_empty() {
            Vec::new()
        } else {
            (0..n).map(|i| evaluation.violation(i)).collect()
        };
        if !violations.is_empty() && self.best_violation.is_empty() {
            // What was told of before violated nothing.
            let known = if self.counters.iteration > 0 {
                0.0
            } else {
                f64::INFINITY
            };
            self.best_violation = vec![known; n];
        }
        let [least, most] = self.bounds(evaluation, &violations);
        let iteration = self.counters.iteration;
        self.pushing.advance(&self.archive, &self.settings, iteration);
        let allowance = self.pushing.allowance();
        self.pushing
            .begin(most > 0.0, &self.archive, &self.settings, iteration);
        let relaxed = self.pushing.relaxation();
        let pushed_to =
            relaxed.map(|relaxed| Entrance::to(&relaxed.archive, self.pushing.allowance(), least));
        let entrances: Vec<Entrance> = std::iter::once(Entrance::to(&self.archive, 0.0, least))
            .chain(pushed_to)
            .collect();
        let part_of = |i: usize, all: usize| (i * PART).min(all)..((i + 1) * PART).min(all);
        let parts = evaluation
            .objectives
            .par_chunks(PART * width)
            .zip(evaluation.failures.par_chunks(PART))
            .zip(self.position.par_chunks(PART * d))
            .zip(self.best_position.par_chunks_mut(PART * d))
            .zip(self.best_objectives.par_chunks_mut(PART * width))
            .zip(pieces(&mut self.best_violation, n))
            .enumerate();
        let fronts: Vec<Vec<Vec<Point>>> = parts
            .map(
                |(
                    number,
                    (((((rows, failures), position), best_position), best_objectives), best_violation),
                )| {
                    let learn = Learn {
                        generation: &generation,
                        random,
                        first: number * PART,
                        rows,
                        failures,
                        violations: &violations[part_of(number, violations.len())],
                        best_violation,
                        allowance,
                        position,
                        best_position,
                        best_objectives,
                        entrances: &entrances,
                    };
                    dispatch(InstructionSet::best(), learn)
                },
            )
            .collect();
        let of = |(number, entrance): (usize, &Entrance)| {
            let points = fronts.iter().flat_map(|fronts| fronts[number].iter().copied());
            (front(points.collect(), width), entrance.level)
        };
        entrances.iter().enumerate().map(of).collect()
    }

    /// The least and the greatest violation that is told of a candidate that has not failed.
    fn bounds(&self, evaluation: &Evaluation, violations: &[f64]) -> [f64; 2] {
        if violations.is_empty() {
            return [0.0; 2];
        }
        let rows = evaluation.objectives.chunks_exact(self.objectives);
        let sound = rows
            .zip(&evaluation.failures)
            .map(|(row, failure)| failure.is_none() && row.iter().all(|x| x.is_finite()));
        let told = sound.zip(violations).filter(|(sound, _)| *sound).map(|(_, v)| *v);
        told.fold([f64::INFINITY, 0.0], |[least, most], v| {
            [least.min(v), most.max(v)]
        })
    }

    /// The positions that lead and mate, the best first: the members of an archive that has been measured, and own bests that stand in for
    /// them.
    fn leaders(&self, archive: &Archive) -> Vec<f32> {
        let d = self.space.dimensions();
        let stand_ins = StandIns::draw(archive, &self.settings, self.counters, &self.best_violation);
        let mut leading = match stand_ins.instead_of_members {
            true => Vec::new(),
            false => leaders(archive, d),
        };
        for particle in stand_ins.particles {
            leading.extend((0..d).map(|k| self.best_position[self.place(particle, k)]));
        }
        leading
    }

    /// Moves the swarm.
    fn advance(&mut self) {
        let d = self.space.dimensions();
        measure(&mut self.archive, &mut self.pushing);
        let mut leaders = self.leaders(&self.archive);
        let members = (leaders.len() / d.max(1)) as u32;
        if let Some(relaxation) = self.pushing.relaxation() {
            leaders.extend(self.leaders(&relaxation.archive));
        }
        let generation = Generation {
            members,
            pushed_members: (leaders.len() / d.max(1)) as u32 - members,
            ..self.generation()
        };
        let random = self.random;
        self.position
            .par_chunks_mut(PART * d)
            .zip(self.velocity.par_chunks_mut(PART * d))
            .zip(self.best_position.par_chunks(PART * d))
            .enumerate()
            .for_each(|(number, ((position, velocity), best_position))| {
                let step = Move {
                    generation: &generation,
                    random,
                    first: number * PART,
                    best_position,
                    leaders: &leaders,
                    position,
                    velocity,
                };
                dispatch(InstructionSet::best(), step);
            });
    }
}

/// The pieces of `state` that go with the parts of a swarm of `n`, empty ones if it is.
fn pieces(state: &mut [f64], n: usize) -> Vec<&mut [f64]> {
    if state.is_empty() {
        return (0..n.div_ceil(PART)).map(|_| Default::default()).collect();
    }
    state.chunks_mut(PART).collect()
}

/// Works out what the members of the archives contribute.
pub fn measure(archive: &mut Archive, pushing: &mut Pushing) {
    archive.measure();
    if let Some(relaxation) = pushing.relaxation_mut() {
        relaxation.archive.measure();
    }
}

/// The positions of an archive that has been measured, the greatest contribution first.
pub fn leaders(archive: &Archive, dimensions: usize) -> Vec<f32> {
    let worth = archive.worth();
    let mut order: Vec<usize> = (0..worth.len()).collect();
    order.sort_by(|&a, &b| worth[b].total_cmp(&worth[a]));
    let coordinates = |i: usize| archive.positions[i][..dimensions].iter().map(|x| *x as f32);
    order.into_iter().flat_map(coordinates).collect()
}

/// Points of the swarm that an archive may take in, and their positions. Behind the coordinates for the archive that pushed particles
/// follow stands the violation.
pub struct Newcomers {
    pub found: Vec<(Point, Vec<f64>)>,
    /// The violation that counts for all of them.
    pub violation: f64,
}

/// Puts newcomers into the archive and into that of pushed particles, and lets moves know what they have earned. A move earns where its
/// candidate takes the place of a member that it dominates, in the archive that its particle follows.
pub fn take_in(
    (archive, pushing, earnings): (&mut Archive, &mut Pushing, &mut Earnings),
    generation: &Generation,
    newcomers: Vec<Newcomers>,
) {
    let width = generation.objectives as usize;
    // Before, nobody moved towards anything.
    let moved = !archive.is_empty() && generation.when > 0;
    let pushes = newcomers.len() > 1;
    let pushed_to = pushing.relaxation_mut().map(|relaxation| &mut relaxation.archive);
    let archives = std::iter::once(archive).chain(pushed_to);
    let mut earned = [0.0; 3];
    for (number, (archive, Newcomers { found, violation })) in archives.zip(newcomers).enumerate() {
        let (members, level) = (archive.objectives.clone(), archive.violation());
        let points: Vec<Point> = found.iter().map(|(point, _)| *point).collect();
        let row = |point: &Point| point.at[..width].to_vec();
        let solutions = found.into_iter().map(|(point, position)| (position, row(&point)));
        archive.insert_all(solutions.collect(), violation);
        let follows = |point: &&Point| !pushes || is_pushed(point.who as usize) == (number > 0);
        for point in points.iter().filter(follows) {
            let row = row(point);
            let takes = violation < level || members.iter().any(|member| dominates(&row, member));
            if moved && takes && archive.objectives.contains(&row) {
                earned[generation.made_by(point.who) as usize] += 1.0;
            }
        }
    }
    if !moved {
        return;
    }
    let [crossings, no_pulls] = [generation.crossings, generation.no_pulls].map(f64::from);
    let shares = [1.0 - no_pulls, no_pulls - crossings, crossings];
    earnings.count_all(
        shares.map(|share| share * f64::from(generation.particles)),
        earned,
    );
}

impl Optimiser for LargeSwarm {
    fn ask(&mut self) -> Vec<f64> {
        let (n, width) = (self.settings.motion.population, self.space.variables());
        let d = self.space.dimensions();
        let mut candidates = vec![0.0; n * width];
        candidates
            .par_chunks_mut(PART * width)
            .enumerate()
            .for_each(|(number, part)| {
                for (block, rows) in part.chunks_mut(BLOCK * width).enumerate() {
                    let from = (number * PART / BLOCK + block) * BLOCK * d;
                    self.space
                        .scale_block(&self.position[from..from + BLOCK * d], BLOCK, rows);
                }
            });
        candidates
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        evaluation.check(self.settings.motion.population, self.objectives)?;
        let (width, wanted) = (self.objectives, PER_PLACE * self.settings.archive);
        let found = self.learn(evaluation);
        let newcomers = |(number, (points, violation)): (usize, (Vec<Point>, f64))| {
            let points = thinned(points, width, wanted, self.archive.fixed_reference());
            let solution = |point: Point| {
                let who = point.who as usize;
                let at = |k: usize| f64::from(self.position[self.place(who, k)]);
                let violation = (number > 0).then(|| evaluation.violation(who));
                let position = (0..self.space.dimensions()).map(at).chain(violation);
                (point, position.collect())
            };
            Newcomers {
                found: points.into_iter().map(solution).collect(),
                violation,
            }
        };
        let newcomers = found.into_iter().enumerate().map(newcomers).collect();
        let generation = self.generation();
        let state = (&mut self.archive, &mut self.pushing, &mut self.earnings);
        take_in(state, &generation, newcomers);
        self.counters.told(self.settings.motion.population);
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
        self.archive.front(&self.space)
    }

    fn best(&self) -> Vec<f64> {
        self.archive.best(self.objectives)
    }

    fn violation(&self) -> f64 {
        self.archive.violation()
    }
}
