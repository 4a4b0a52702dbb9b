//! Constraints that a swarm ignores at first and takes back step by step.
//!
//! A swarm that keeps to its constraints from the start stays in the feasible region where it lands: it crosses no infeasible land, and
//! hardly moves along a thin shell. So half of the particles are first pushed to the front of the problem without constraints, and
//! then pulled to that of the problem with them, as in Fan et al., *Push and pull search for solving constrained multi-objective
//! optimization problems* (2019). The others keep to the constraints all the time: where infeasible land hides nothing, little is lost.

use crate::swarm::archive::Archive;
use crate::swarm::settings::MopsoSettings;
use serde::{Deserialize, Serialize};

/// The push lasts for this share of the planned iterations at most,
const LONGEST_PUSH: f64 = 0.3;
/// and ends earlier once the bounds of the front stood still for this share of them:
const WATCHED: f64 = 0.05;
/// they moved by no more than this share of the front's range.
const STILL: f64 = 0.01;
/// The pull lasts for this share of the planned iterations.
const PULL: f64 = 0.5;
/// What is left of the allowance is this power of what is left of the pull. With 3, the median hypervolumes of LIR-CMOP1 to 3, thin shells,
/// are 7 to 17 % lower.
const POWER: i32 = 5;
/// One particle of so many keeps to the constraints, in `shaders/swarm.wgsl` too. With 3, OSY ends at a hypervolume of 0.950 instead of
/// 0.962.
const KEEPING: usize = 2;

/// Whether constraints are relaxed: from the first violation on, until they are taken back.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Pushing {
    /// Whether a candidate has violated them.
    violated: bool,
    relaxation: Option<Box<Relaxation>>,
}

impl Pushing {
    /// What is relaxed now, if anything is.
    pub fn relaxation(&self) -> Option<&Relaxation> {
        self.relaxation.as_deref()
    }

    pub fn relaxation_mut(&mut self) -> Option<&mut Relaxation> {
        self.relaxation.as_deref_mut()
    }

    /// The violation that counts as none for particles that are pushed.
    pub fn allowance(&self) -> f64 {
        self.relaxation().map_or(0.0, |relaxation| relaxation.allowance)
    }

    /// Takes constraints back as far as this iteration of a swarm of this archive asks for.
    pub fn advance(&mut self, archive: &Archive, settings: &MopsoSettings, iteration: usize) {
        self.relaxation
            .take_if(|relaxation| !relaxation.advance(archive, settings, iteration));
    }

    /// Relaxes them if this is the first violation.
    pub fn begin(&mut self, violated: bool, archive: &Archive, settings: &MopsoSettings, iteration: usize) {
        if violated && !self.violated {
            self.violated = true;
            self.relaxation = Relaxation::of(archive, settings, iteration).map(Box::new);
        }
    }
}

/// The violation that counts where one of this allowance counts as none.
#[inline(always)]
pub fn counted(violation: f64, allowance: f64) -> f64 {
    if violation <= allowance { 0.0 } else { violation }
}

/// Whether a particle is pushed while constraints are relaxed.
#[inline(always)]
pub fn is_pushed(particle: usize) -> bool {
    !particle.is_multiple_of(KEEPING)
}

/// The relaxed constraints: a candidate that violates them by no more than the allowance counts as feasible.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Relaxation {
    allowance: f64,
    /// The allowance at the beginning of the pull, and its iteration.
    pull: Option<(f64, usize)>,
    /// The least and the most of each objective over the archive, iteration after iteration of the push.
    bounds: Vec<Vec<[f64; 2]>>,
    /// What the particles that ignore the constraints follow. Behind the coordinates of a member stands its violation.
    pub archive: Archive,
}

impl Relaxation {
    /// For a swarm whose archive this is; nothing where the push is over.
    fn of(archive: &Archive, settings: &MopsoSettings, iteration: usize) -> Option<Self> {
        let wanted = settings.push_and_pull && share(iteration, settings) < LONGEST_PUSH;
        wanted.then(|| {
            let mut relaxed = Self {
                allowance: 0.0,
                pull: None,
                bounds: Vec::new(),
                archive: archive.emptied(),
            };
            // Of what is not finite, nothing is allowed.
            relaxed.allow(f64::MAX, archive);
            relaxed
        })
    }

    /// The violation that counts.
    pub fn violation(&self, violation: f64) -> f64 {
        counted(violation, self.allowance)
    }

    /// Offers a candidate to the archive; returns whether it was inserted.
    pub fn insert(&mut self, position: &[f64], objectives: &[f64], violation: f64) -> bool {
        let member = [position, &[violation]].concat();
        let counts = self.violation(violation);
        self.archive.insert_violating(&member, objectives, counts)
    }

    /// Goes on to this iteration of a swarm of this archive; returns whether constraints are still relaxed.
    fn advance(&mut self, archive: &Archive, settings: &MopsoSettings, iteration: usize) -> bool {
        let Some((allowance, begun)) = self.pull else {
            if self.pushes(settings, iteration) {
                return true;
            }
            let violations = self.archive.positions.iter().filter_map(|row| row.last());
            let most = violations.copied().fold(0.0, f64::max);
            self.pull = Some((most, iteration));
            self.allowance = most;
            return most > 0.0;
        };
        let left = 1.0 - (share(iteration, settings) - share(begun, settings)) / PULL;
        if left > 0.0 {
            self.allow(allowance * left.powi(POWER), archive);
        }
        left > 0.0
    }

    /// Whether the push goes on.
    fn pushes(&mut self, settings: &MopsoSettings, iteration: usize) -> bool {
        let rows = &self.archive.objectives;
        let bounds = |k: usize| {
            let values = rows.iter().map(|row| row[k]);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], x| {
                [least.min(x), most.max(x)]
            })
        };
        let now: Vec<[f64; 2]> = (0..rows.first().map_or(0, Vec::len)).map(bounds).collect();
        let watched = (WATCHED * settings.motion.iterations as f64).ceil() as usize;
        let before = self.bounds.len().checked_sub(watched).map(|i| &self.bounds[i]);
        let still = before.is_some_and(|before| {
            let mut both = before.iter().zip(&now);
            !before.is_empty()
                && both.all(|(before, now)| {
                    let moved = (now[0] - before[0]).abs().max((now[1] - before[1]).abs());
                    moved <= STILL * (now[1] - now[0])
                })
        });
        self.bounds.push(now);
        !still && share(iteration, settings) < LONGEST_PUSH
    }

    /// Changes the allowance. Members leave that violate more, unless all do: then those stay that violate least. What the swarm's
    /// archive has takes their place.
    fn allow(&mut self, allowance: f64, archive: &Archive) {
        self.allowance = allowance;
        let counts = |member: &[f64]| self.violation(member.last().copied().unwrap_or(f64::INFINITY));
        let known = self.archive.positions.iter().zip(&self.archive.objectives);
        if known.clone().all(|(member, _)| counts(member) == 0.0) && !self.archive.is_empty() {
            return;
        }
        let ours = known.map(|(member, row)| (member.clone(), row.clone()));
        let theirs = archive.positions.iter().zip(&archive.objectives);
        let theirs =
            theirs.map(|(position, row)| ([position, &[archive.violation()][..]].concat(), row.clone()));
        let mut members: Vec<(Vec<f64>, Vec<f64>)> = ours.chain(theirs).collect();
        let least = members
            .iter()
            .map(|(member, _)| counts(member))
            .fold(f64::INFINITY, f64::min);
        members.retain(|(member, _)| counts(member) == least);
        let mut archive = archive.emptied();
        archive.insert_all(members, least);
        self.archive = archive;
    }
}

/// The share of the planned iterations that this many are.
fn share(iteration: usize, settings: &MopsoSettings) -> f64 {
    iteration as f64 / settings.motion.iterations.max(1) as f64
}
