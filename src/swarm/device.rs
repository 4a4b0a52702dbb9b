//! A swarm that lives on a device: only archive candidates and leaders cross the bus.
//!
//! The kernels of `shaders/swarm.wgsl` hold positions, velocities and personal bests, move the particles and note those
//! that no member of the archive dominates or equals; the host keeps the archive. On a device that rounds as the
//! processor does, the swarm is the one that [`super::Mopso`] keeps in lanes, bit for bit.

mod buffers;
mod state;

use super::archive::Archive;
use super::mopso::blocks::{Generation, UNKNOWN};
use super::mopso::earnings::Earnings;
use super::mopso::filter::{Point, front};
use super::mopso::large_swarm::{Newcomers, empty_archive, leaders, measure, take_in};
use super::mopso::relaxation::{Pushing, counted};
use super::mopso::stand_ins::StandIns;
use super::mopso::thinning::{PER_PLACE, thinned};
use super::settings::MopsoSettings;
use super::space::Space;
use super::{Counters, Front, Progress};
use crate::error::{Error, Result};
use crate::evaluate::gpu::{GpuContext, Kernel};
use crate::evaluate::resident::{groups, sliced_groups};
use crate::evaluate::{BackendInfo, Failure, FailureCounts, Problem};
use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::Arc;

pub use crate::evaluate::resident::{BLOCK, DeviceObjectives};
pub use state::DeviceState;

use buffers::{Buffers, Kernels, on_device};
use state::last_row;

/// Failures that are told apart.
const REASONS: usize = 13;
/// Particles that may enter an archive which are read back unasked, with their positions.
const AT_ONCE: usize = 512;
/// Of more particles that may enter an archive than this, a card leaves out those that the first of them dominate before they are read.
const TOO_MANY: usize = 8192;
/// Bytes before the points of the list of those found: their number, the least and the greatest violation, and the failures by reason.
const HEADER: u64 = 4 * (3 + REASONS as u64);
const _: () = assert!(Failure::WORDS.len() <= REASONS && HEADER.is_multiple_of(16));

/// The greatest number of single precision that is not above, and that a particle which has not failed can violate constraints by.
fn below(allowance: f64) -> f32 {
    let rounded = allowance as f32;
    let below = if f64::from(rounded) > allowance {
        rounded.next_down()
    } else {
        rounded
    };
    below.min(UNKNOWN.next_down())
}

/// The points of a list of those found, as far as it goes.
fn points_of(list: &[u32], count: usize) -> Vec<Point> {
    let of = |word: u32| f64::from(f32::from_bits(word));
    let points = list[HEADER as usize / 4..].chunks_exact(4).take(count);
    points
        .map(|p| Point {
            at: [of(p[1]), of(p[2]), of(p[3])],
            who: p[0],
        })
        .collect()
}

/// `n` rows of `width` out of blocks.
fn row_major(blocks: &[f32], n: usize, width: usize) -> Vec<f64> {
    let at = |i: usize, k: usize| f64::from(blocks[(i / BLOCK * width + k) * BLOCK + i % BLOCK]);
    (0..n * width).map(|j| at(j / width, j % width)).collect()
}

/// What the kernels say of the swarm.
struct Noted {
    /// The particles that may enter the archive.
    count: usize,
    /// The first of them, [`AT_ONCE`] at the most.
    points: Vec<Point>,
    /// Their positions.
    rows: Vec<f32>,
    /// What bests have learnt along with it; nothing if they have not.
    learnt: Learnt,
}

/// What is known of a population once bests have learnt.
#[derive(Default)]
struct Learnt {
    /// The least and the greatest violation of a particle that has not failed.
    violations: [f64; 2],
    /// Particles that have failed, by reason.
    failures: FailureCounts,
}

/// A swarm of one to three objectives on a device, with the settings of [`super::Mopso`]. With one objective it is the plain particle
/// swarm: the archive is the best that was found, and every move is a pull towards it and the own best.
pub struct DeviceMopso {
    settings: MopsoSettings,
    space: Space,
    objectives: usize,
    /// Whether particles have a row for what they violate.
    constrained: bool,
    context: Arc<GpuContext>,
    kernels: Kernels,
    buffers: Buffers,
    archive: Archive,
    pushing: Pushing,
    earnings: Earnings,
    counters: Counters,
}

/// The most particles of so many variables that a swarm on this device has room for: no buffer is larger than a kernel may see.
pub fn most_particles(context: &GpuContext, variables: usize) -> usize {
    let bytes = context.limits().max_storage_buffer_binding_size - HEADER;
    // A particle takes a float for each variable, and four in the list of those that an archive may take in.
    let lanes = bytes / (4 * variables.max(4) as u64);
    (lanes / BLOCK as u64 * BLOCK as u64) as usize
}

impl DeviceMopso {
    /// A swarm over the variables of `problem` on `context`'s device.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting that is out of its range, also where the device has no room for so many particles;
    /// [`Error::Device`] if the device fails.
    pub fn new(problem: &Problem, settings: MopsoSettings, context: Arc<GpuContext>) -> Result<Self> {
        Self::scattered(problem, false, settings, context)
    }

    /// The same for objectives with constraints ([`DeviceObjectives::is_constrained`]). It goes by Deb's rules, as [`super::Mopso`]
    /// does, with violations in single precision.
    ///
    /// # Errors
    /// Those of [`DeviceMopso::new`].
    pub fn with_constraints(
        problem: &Problem,
        settings: MopsoSettings,
        context: Arc<GpuContext>,
    ) -> Result<Self> {
        Self::scattered(problem, true, settings, context)
    }

    fn scattered(
        problem: &Problem,
        constrained: bool,
        settings: MopsoSettings,
        context: Arc<GpuContext>,
    ) -> Result<Self> {
        let space = Space::new(problem)?;
        let (d, width) = (space.dimensions(), problem.objectives.len());
        if d == 0 || !(1..=3).contains(&width) {
            let found = format!("{d} free variables, {width} objectives");
            let expected = "a free variable and one to three objectives";
            return Err(Error::input(
                "the problem",
                "variables, objectives",
                found,
                expected,
            ));
        }
        let archive = empty_archive(problem, &settings)?;
        let (swarm, scatter) = Self::unborn(settings, space, archive, (width, constrained), context)?;
        swarm.announce(swarm.generation(0));
        swarm.context.run(|encoder| swarm.record(encoder, &scatter))?;
        Ok(swarm)
    }

    /// A swarm with buffers that hold nothing yet, and the kernel that scatters its particles.
    fn unborn(
        settings: MopsoSettings,
        space: Space,
        archive: Archive,
        (objectives, constrained): (usize, bool),
        context: Arc<GpuContext>,
    ) -> Result<(Self, Arc<Kernel>)> {
        let (kernels, buffers, scatter) = on_device(&settings, &space, (objectives, constrained), &context)?;
        let swarm = Self {
            archive,
            pushing: Pushing::default(),
            earnings: Earnings::default(),
            objectives,
            constrained,
            settings,
            space,
            context,
            kernels,
            buffers,
            counters: Counters::default(),
        };
        Ok((swarm, scatter))
    }

    /// Puts the first particles at these candidates (in the variables' units), before the first generation.
    ///
    /// # Errors
    /// [`Error::Input`] naming a candidate that is no finite value for each variable, [`Error::Device`] if the device fails.
    pub fn start_from(&mut self, candidates: &[Vec<f64>]) -> Result<()> {
        let d = self.space.dimensions();
        let starts = self.space.starts(candidates, self.settings.motion.population)?;
        let count = starts.len();
        if count == 0 {
            return Ok(());
        }
        let bytes = (count.next_multiple_of(BLOCK) * d * 4) as u64;
        let mut rows: Vec<f32> = self.read(&self.buffers.position, bytes)?;
        for (i, position) in starts.into_iter().enumerate() {
            for (k, x) in position.into_iter().enumerate() {
                rows[(i / BLOCK * d + k) * BLOCK + i % BLOCK] = x as f32;
            }
        }
        for buffer in [&self.buffers.position, &self.buffers.best_position] {
            self.context.write(buffer, bytemuck::cast_slice(&rows));
        }
        Ok(())
    }

    /// The whole swarm, read back from the device, for [`DeviceMopso::from_state`].
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn state(&self) -> Result<DeviceState> {
        let lanes = self.settings.motion.population.next_multiple_of(BLOCK);
        let rows = |buffer, width: usize| self.read(buffer, (lanes * width * 4) as u64);
        let d = self.space.dimensions();
        Ok(DeviceState {
            position: rows(&self.buffers.position, d)?,
            velocity: rows(&self.buffers.velocity, d)?,
            best_position: rows(&self.buffers.best_position, d)?,
            best_objectives: rows(&self.buffers.best_objectives, self.rows())?,
            settings: self.settings.clone(),
            space: self.space.clone(),
            objectives: self.objectives,
            constrained: self.constrained,
            archive: self.archive.clone(),
            pushing: self.pushing.clone(),
            earnings: self.earnings.clone(),
            counters: self.counters,
        })
    }

    /// A swarm resumed from `state` on `context`'s device.
    ///
    /// # Errors
    /// [`Error::Device`] if the device cannot hold it.
    pub fn from_state(state: DeviceState, context: Arc<GpuContext>) -> Result<Self> {
        let (swarm, _) = Self::unborn(
            state.settings,
            state.space,
            state.archive,
            (state.objectives, state.constrained),
            context,
        )?;
        let buffers = &swarm.buffers;
        for (buffer, rows) in [
            (&buffers.position, &state.position),
            (&buffers.velocity, &state.velocity),
            (&buffers.best_position, &state.best_position),
            (&buffers.best_objectives, &state.best_objectives),
        ] {
            swarm.context.write(buffer, bytemuck::cast_slice(rows));
        }
        Ok(Self {
            pushing: state.pushing,
            earnings: state.earnings,
            counters: state.counters,
            ..swarm
        })
    }

    /// The device that does the work.
    pub fn backend(&self) -> BackendInfo {
        self.context.backend_info()
    }

    /// Memory of the swarm on the device, bytes for each particle.
    pub fn bytes_per_particle(&self) -> usize {
        // Objectives stand there twice, and each particle has a place in the list of candidates and in its copy.
        (3 * self.space.dimensions() + 2 * self.rows()) * size_of::<f32>() + 16
    }

    /// Rows of objectives of a particle.
    fn rows(&self) -> usize {
        self.objectives + usize::from(self.constrained)
    }

    /// What is the same for all particles in the present iteration, with so many members.
    fn generation(&self, members: usize) -> Generation {
        let sizes = (self.space.dimensions(), self.objectives, members);
        Generation::new(&self.settings, &self.earnings, sizes, self.counters.iteration)
    }

    /// Tells the kernels of it.
    fn announce(&self, generation: Generation) {
        let generation = Generation {
            constrained: u32::from(self.constrained),
            ..generation
        };
        self.context
            .write(&self.buffers.generation, bytemuck::bytes_of(&generation));
    }

    /// Records a kernel of the swarm, a lane to a particle.
    fn record(&self, encoder: &mut wgpu::CommandEncoder, kernel: &Kernel) {
        let (x, y) = groups(self.settings.motion.population);
        self.record_groups(encoder, kernel, [x, y, 1]);
    }

    /// Records a kernel of the swarm with so many workgroups.
    fn record_groups(&self, encoder: &mut wgpu::CommandEncoder, kernel: &Kernel, [x, y, z]: [u32; 3]) {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, &self.buffers.swarm, &[]);
        pass.dispatch_workgroups(x, y, z);
    }

    /// The first `bytes` of a buffer.
    fn read<T: bytemuck::Pod>(&self, from: &wgpu::Buffer, bytes: u64) -> Result<Vec<T>> {
        let readback = &self.buffers.readback;
        self.context
            .read_back((from, 0), readback, bytes, bytemuck::pod_collect_to_vec)
    }

    /// Notes the particles that may enter an archive of these members, which violate the constraints by so much where a violation of
    /// `allowance` counts as none. If the swarm `learns`, its personal bests learn first.
    fn note(&self, members: &[[f64; 3]], (violation, allowance): (f64, f64), learns: bool) -> Result<Noted> {
        let Buffers {
            archive,
            found,
            rows,
            readback,
            ..
        } = &self.buffers;
        let table: Vec<f32> = members.iter().flatten().map(|x| *x as f32).collect();
        self.context.write(archive, bytemuck::cast_slice(&table));
        let mut header = [0; HEADER as usize / 4];
        header[1] = UNKNOWN.to_bits();
        self.context.write(found, bytemuck::cast_slice(&header));
        self.announce(Generation {
            violation: (violation as f32).min(UNKNOWN),
            allowance: below(allowance),
            ..self.generation(members.len())
        });
        let n = self.settings.motion.population;
        let most = n.min(AT_ONCE);
        let d = self.space.dimensions();
        self.announce_gathering(most, d);
        let head = HEADER + 16 * most as u64;
        let row_bytes = (most * d * 4) as u64;
        let words: Vec<u32> = self.context.run_and_read_back(
            |encoder| {
                if learns {
                    self.record(encoder, &self.kernels.learn);
                }
                self.record(encoder, &self.kernels.note);
                self.record_gather(encoder, &self.buffers.gather, most * d);
            },
            &[(found, 0..head), (rows, 0..row_bytes)],
            readback,
            bytemuck::pod_collect_to_vec,
        )?;
        let (list, rows) = words.split_at(head as usize / 4);
        let count = (list[0] as usize).min(n);
        let failures = Failure::WORDS
            .iter()
            .zip(&list[3..])
            .filter(|(_, count)| **count > 0)
            .map(|(word, count)| ((*word).to_owned(), u64::from(*count)));
        Ok(Noted {
            count,
            points: points_of(list, count),
            rows: rows.iter().map(|word| f32::from_bits(*word)).collect(),
            learnt: Learnt {
                violations: match self.constrained {
                    true => [list[1], list[2]].map(|word| f64::from(f32::from_bits(word))),
                    false => [0.0; 2],
                },
                failures: failures.collect(),
            },
        })
    }

    /// Lets personal bests learn, and finds what enters the archive and that of pushed particles.
    fn learn(&mut self) -> Result<(Vec<Newcomers>, FailureCounts)> {
        let iteration = self.counters.iteration;
        self.pushing.advance(&self.archive, &self.settings, iteration);
        // Bests learn with the allowance of what is noted first.
        let mut learnt = None;
        let mut pushed = self.newcomers_of_pushed(&mut learnt)?;
        let newcomers = self.newcomers(&self.archive, 0.0, &mut learnt)?;
        let violated = learnt.as_ref().is_some_and(|learnt| learnt.violations[1] > 0.0);
        self.pushing
            .begin(violated, &self.archive, &self.settings, iteration);
        if pushed.is_none() {
            pushed = self.newcomers_of_pushed(&mut learnt)?;
        }
        let failures = learnt.map_or_else(FailureCounts::new, |learnt| learnt.failures);
        Ok((std::iter::once(newcomers).chain(pushed).collect(), failures))
    }

    /// What enters the archive that pushed particles follow, if there is one.
    fn newcomers_of_pushed(&self, learnt: &mut Option<Learnt>) -> Result<Option<Newcomers>> {
        let Some(relaxation) = self.pushing.relaxation() else {
            return Ok(None);
        };
        let mut newcomers = self.newcomers(&relaxation.archive, self.pushing.allowance(), learnt)?;
        let particles = newcomers.found.iter().map(|(point, _)| point.who);
        let width = self.rows();
        let rows = self.gather((&self.buffers.gather_objectives, width), particles)?;
        for ((_, position), row) in newcomers.found.iter_mut().zip(rows.chunks_exact(width)) {
            position.extend(row.last().map(|violation| f64::from(violation.max(0.0))));
        }
        Ok(Some(newcomers))
    }

    /// What enters `archive`, where a violation of `allowance` counts as none. Personal bests learn first if they have not.
    fn newcomers(&self, archive: &Archive, allowance: f64, learnt: &mut Option<Learnt>) -> Result<Newcomers> {
        let (d, width) = (self.space.dimensions(), self.objectives);
        let at = |row: &Vec<f64>| std::array::from_fn(|k| row.get(k).copied().unwrap_or(0.0));
        let mut members: Vec<[f64; 3]> = archive.objectives.iter().map(at).collect();
        let known = archive.violation();
        let level = |learnt: &Learnt| known.min(counted(learnt.violations[0], allowance));
        let before = learnt.as_ref().map_or(known, level);
        if before < known {
            members.clear();
        }
        let mut noted = self.note(&members, (before, allowance), learnt.is_none())?;
        let learnt = learnt.get_or_insert(std::mem::take(&mut noted.learnt));
        let violation = level(learnt);
        if violation < known {
            // They leave the archive.
            members.clear();
        }
        let mut sample = Vec::new();
        if noted.count > TOO_MANY && self.context.is_shaped_for_a_card() {
            sample = front(noted.points, width);
            members.extend(sample.iter().map(|p| p.at));
            noted = self.note(&members, (violation, allowance), false)?;
        }
        let mut place = None;
        if noted.count > noted.points.len() {
            let words: Vec<u32> = self.read(&self.buffers.found, HEADER + 16 * noted.count as u64)?;
            noted.points = points_of(&words, noted.count);
        } else if sample.is_empty() {
            let places: HashMap<u32, usize> = noted.points.iter().map(|p| p.who).zip(0..).collect();
            place = Some(places);
        }
        // They were among the members, so that the list leaves them out.
        noted.points.extend(sample);
        let points = thinned(
            front(noted.points, width),
            width,
            PER_PLACE * self.settings.archive,
            archive.fixed_reference(),
        );
        let rows: Vec<f32> = match place {
            Some(place) => {
                let row = |p: &Point| &noted.rows[place[&p.who] * d..][..d];
                points.iter().flat_map(row).copied().collect()
            }
            None => self.gather((&self.buffers.gather, d), points.iter().map(|p| p.who))?,
        };
        let position = |row: &[f32]| row.iter().map(|x| f64::from(*x)).collect();
        Ok(Newcomers {
            found: points
                .into_iter()
                .zip(rows.chunks_exact(d).map(position))
                .collect(),
            violation,
        })
    }

    /// Tells the kernel that gathers rows how many particles it takes at the most, and how many figures each has.
    fn announce_gathering(&self, most: usize, width: usize) {
        let figures = [most as u32, width as u32, 0, 0];
        self.context
            .write(&self.buffers.gathering, bytemuck::cast_slice(&figures));
    }

    /// Records it for so many figures.
    fn record_gather(&self, encoder: &mut wgpu::CommandEncoder, group: &wgpu::BindGroup, figures: usize) {
        let (x, y) = groups(figures);
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.kernels.gather.pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.dispatch_workgroups(x, y, 1);
    }

    /// Rows of these particles, of so many figures: positions, own bests or objectives.
    fn gather(
        &self,
        (group, width): (&wgpu::BindGroup, usize),
        particles: impl ExactSizeIterator<Item = u32>,
    ) -> Result<Vec<f32>> {
        let count = particles.len();
        if count == 0 {
            return Ok(Vec::new());
        }
        let mut list = vec![0u32; HEADER as usize / 4];
        list[0] = count as u32;
        list.extend(particles.flat_map(|who| [who, 0, 0, 0]));
        self.context
            .write(&self.buffers.found, bytemuck::cast_slice(&list));
        self.announce_gathering(count, width);
        let bytes = (count * width * 4) as u64;
        self.context.run_and_read_back(
            |encoder| self.record_gather(encoder, group, count * width),
            &[(&self.buffers.rows, 0..bytes)],
            &self.buffers.readback,
            bytemuck::pod_collect_to_vec,
        )
    }

    /// One generation: evaluates the particles by `objectives`, lets archive and personal bests learn, moves. A particle has failed
    /// whose objectives say so, or are not finite numbers in single precision.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn step(&mut self, objectives: &mut dyn DeviceObjectives) -> Result<Progress> {
        self.evaluate(objectives)?;
        self.learn_and_move()
    }

    /// The first half of [`DeviceMopso::step`].
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails, [`Error::Input`] if `objectives` have constraints and the swarm does not, or the other
    /// way.
    pub fn evaluate(&mut self, objectives: &mut dyn DeviceObjectives) -> Result<()> {
        if objectives.is_constrained() != self.constrained {
            let found = format!("is_constrained() = {}", objectives.is_constrained());
            let expected = format!("{}, as when the swarm was made", self.constrained);
            return Err(Error::input("the objectives", "constraints", found, expected));
        }
        let n = self.settings.motion.population;
        objectives.evaluate(n, &self.buffers.position, &self.buffers.objectives)
    }

    /// The second half of [`DeviceMopso::step`].
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn learn_and_move(&mut self) -> Result<Progress> {
        let d = self.space.dimensions();
        let generation = self.generation(self.archive.len());
        let (newcomers, failures) = self.learn()?;
        let state = (&mut self.archive, &mut self.pushing, &mut self.earnings);
        take_in(state, &generation, newcomers);
        self.counters.told(self.settings.motion.population);
        measure(&mut self.archive, &mut self.pushing);
        let mut leaders = self.leaders(&self.archive)?;
        let members = leaders.len() / d;
        if let Some(relaxation) = self.pushing.relaxation() {
            leaders.extend(self.leaders(&relaxation.archive)?);
        }
        self.context
            .write(&self.buffers.archive, bytemuck::cast_slice(&leaders));
        // The host goes on meanwhile: the evaluation that follows waits for it.
        self.announce(Generation {
            pushed_members: (leaders.len() / d - members) as u32,
            ..self.generation(members)
        });
        let groups = sliced_groups(&self.context, self.settings.motion.population, d);
        self.context
            .run_ahead(|encoder| self.record_groups(encoder, &self.kernels.advance, groups))?;
        Ok(Progress {
            iteration: self.counters.iteration,
            evaluations: self.counters.evaluations,
            best: self.best(),
            violation: self.archive.violation(),
            median: None,
            failed: failures.values().sum::<u64>() as usize,
            failures,
        })
    }

    /// The positions that lead and mate, as on the host.
    fn leaders(&self, archive: &Archive) -> Result<Vec<f32>> {
        let d = self.space.dimensions();
        if !self.constrained || !StandIns::are_possible(archive, &self.settings) {
            return Ok(leaders(archive, d));
        }
        let n = self.settings.motion.population;
        let bytes = n.next_multiple_of(BLOCK) * self.rows() * 4;
        let bests: Vec<f32> = self.read(&self.buffers.best_objectives, bytes as u64)?;
        let violations = last_row(&bests, n, self.rows());
        let stand_ins = StandIns::draw(archive, &self.settings, self.counters, &violations);
        let mut leading = match stand_ins.instead_of_members {
            true => Vec::new(),
            false => leaders(archive, d),
        };
        let particles = stand_ins.particles.iter().map(|particle| *particle as u32);
        leading.extend(self.gather((&self.buffers.gather_bests, d), particles)?);
        Ok(leading)
    }

    /// Steps until the planned iterations are done or `observe` returns `Break`.
    ///
    /// # Errors
    /// Those of [`DeviceMopso::step`].
    pub fn run(
        &mut self,
        objectives: &mut dyn DeviceObjectives,
        mut observe: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<()> {
        while self.counters.iteration < self.settings.motion.iterations {
            let progress = self.step(objectives)?;
            if observe(&progress).is_break() {
                break;
            }
        }
        Ok(())
    }

    /// The particles' present candidates, row-major in the variables' units, read back from the device.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn candidates(&self) -> Result<Vec<f64>> {
        let (n, d) = (self.settings.motion.population, self.space.dimensions());
        let bytes = n.next_multiple_of(BLOCK) * d * 4;
        let position: Vec<f32> = self.read(&self.buffers.position, bytes as u64)?;
        let width = self.space.variables();
        let mut candidates = vec![0.0; n * width];
        let blocks = position.chunks_exact(BLOCK * d);
        for (block, rows) in blocks.zip(candidates.chunks_mut(BLOCK * width)) {
            self.space.scale_block(block, BLOCK, rows);
        }
        Ok(candidates)
    }

    /// Their objectives as last evaluated, row-major, read back from the device.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn objectives(&self) -> Result<Vec<f64>> {
        let n = self.settings.motion.population;
        let bytes = n.next_multiple_of(BLOCK) * self.rows() * 4;
        let blocks: Vec<f32> = self.read(&self.buffers.objectives, bytes as u64)?;
        let rows = row_major(&blocks, n, self.rows());
        let width = self.objectives;
        Ok(rows
            .chunks_exact(self.rows())
            .flat_map(|row| &row[..width])
            .copied()
            .collect())
    }

    /// Iterations done.
    pub fn iteration(&self) -> usize {
        self.counters.iteration
    }

    /// Candidates evaluated.
    pub fn evaluations(&self) -> u64 {
        self.counters.evaluations
    }

    /// The least value seen of each objective; infinite before any particle has succeeded.
    pub fn best(&self) -> Vec<f64> {
        self.archive.best(self.objectives)
    }

    /// The archive.
    pub fn front(&self) -> Front {
        self.archive.front(&self.space)
    }
}
