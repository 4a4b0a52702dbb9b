//! How large a study may be: what it would need is reckoned before any of it is taken, so that none is ended by the system.
//!
//! What a study keeps (its swarm, archive, history, journal, cross-sections) cannot be split and has to fit; what evaluators take
//! beside that is cut to what is left, by [`portions`].

use crate::error::{Error, Result};
use crate::evaluate::portions::{self, Allowance};
use crate::swarm::PER_PLACE;

/// Memory that a study may take where nothing else is said (MiB).
pub const USUAL_MIB: u64 = crate::config::USUAL_MEMORY_MIB;
/// Numbers that a swarm and its checkpoint keep for each variable of a particle, at the most: positions, velocities and best
/// positions, the candidates asked for in the optimiser's and the parameters' coordinates, those of a portion, and the state
/// as it is copied and written down, twice.
const COPIES: u64 = 11;
/// Bytes of a particle besides its variables: objectives, failures, order, rows of an evaluation.
const PARTICLE: u64 = 320;
/// Bytes of a member of the archive, or of a particle that may become one, besides its variables: position and objectives as
/// rows of their own, what it contributes, and its box while a front is thinned.
const MEMBER: u64 = 320;
/// Bytes of an iteration in the history and in the tables and pictures that it comes to.
const ITERATION: u64 = 512;
/// Bytes of a cross-section: in every level of the search, in the cone programs of the exact solvers, whose
/// factors are what is largest, in the edges that lines are checked against and the lines that are reported.
const CROSS_SECTION: u64 = 16 << 10;
/// Bytes of a candidate's answer in a journal: five objectives and a failure, as they are and twice while they are written.
pub const ANSWER: u64 = 3 * (5 * 8 + 8);
/// Bytes of a sample of a log: the log itself (11 numbers), what is driven and scored of it for laps fitted and held out (9 each,
/// and in single precision for each backend), and what a driven lap is judged and told by, as numbers and as text.
const LOG_SAMPLE: u64 = 1 << 10;
/// What evaluators are left at the least (bytes): as much as the smallest of [`portions`] takes.
const LEAST: u64 = 4 << 20;

/// Something of which a study keeps many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryItem {
    /// The setting that says how many.
    pub name: &'static str,
    /// How many.
    pub count: u64,
    /// Bytes of each.
    pub each: u64,
}

impl MemoryItem {
    /// So many of what the setting `name` counts, each of so many bytes.
    pub fn new(name: &'static str, count: usize, each: u64) -> Self {
        let count = count as u64;
        Self { name, count, each }
    }

    fn bytes(&self) -> u64 {
        self.count.saturating_mul(self.each)
    }
}

/// Memory that so much takes, that of the evaluators at the least with it (MiB, rounded up).
pub fn needed_mib(kept: &[MemoryItem]) -> u64 {
    needed(kept).div_ceil(1 << 20)
}

/// What is needed to keep all of this and to evaluate (bytes).
fn needed(kept: &[MemoryItem]) -> u64 {
    kept.iter()
        .map(MemoryItem::bytes)
        .fold(LEAST, u64::saturating_add)
}

/// The limit that is in force (MiB).
pub fn limit_mib() -> u64 {
    crate::config::memory_limit() >> 20
}

/// Whether all of this fits into so much memory (MiB).
pub fn fits(kept: &[MemoryItem], limit_mib: u64) -> bool {
    needed(kept) <= bytes_of(limit_mib)
}

fn bytes_of(limit_mib: u64) -> u64 {
    limit_mib.saturating_mul(1 << 20)
}

/// What a study keeps must fit into so much memory; the rest is left to its evaluators as long as the allowance lives.
///
/// # Errors
/// [`Error::Memory`] naming what takes most of it, and how much of that would fit beside the rest.
pub fn check(kept: &[MemoryItem], limit_mib: u64) -> Result<Allowance> {
    let limit = bytes_of(limit_mib);
    let needed = needed(kept);
    let Some(largest) = kept
        .iter()
        .max_by_key(|kept| kept.bytes())
        .filter(|_| needed > limit)
    else {
        return Ok(portions::allow(
            limit.saturating_sub(needed).saturating_add(LEAST),
        ));
    };
    let rest = needed.saturating_sub(largest.bytes());
    let expected = match limit.saturating_sub(rest) / largest.each.max(1) {
        0 => format!("a study that fits into {limit_mib} MiB"),
        fitting => format!("at most {fitting}, which fits into {limit_mib} MiB"),
    };
    Err(Error::Memory {
        file: "the study".to_owned(),
        what: largest.name,
        found: largest.count.to_string(),
        needed_mib: needed >> 20,
        expected,
    })
}

/// A log of so many samples.
pub fn log_item(samples: usize) -> MemoryItem {
    MemoryItem::new("samples of the log", samples, LOG_SAMPLE)
}

/// What a study of swarms keeps goes with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Size {
    /// Particles of the largest swarm.
    pub population: usize,
    /// Variables of a particle.
    pub variables: usize,
    /// Iterations.
    pub iterations: usize,
    /// Cross-sections across the track.
    pub sections: usize,
    /// Members of the archive.
    pub archive: usize,
    /// Whether every answer is kept, in a journal.
    pub journal: bool,
    /// Samples of the log, once it is read.
    pub samples: usize,
}

impl Size {
    /// What the study keeps many of.
    pub fn memory_items(&self) -> Vec<MemoryItem> {
        let particle = (self.variables as u64)
            .saturating_mul(8 * COPIES)
            .saturating_add(PARTICLE);
        let answers = if self.journal {
            ANSWER.saturating_mul(self.population as u64)
        } else {
            0
        };
        // While a large swarm learns, its archive stands there with all that may enter it.
        let candidate = (self.variables as u64).saturating_mul(8).saturating_add(MEMBER);
        let member = candidate
            .saturating_mul(1 + PER_PLACE as u64)
            .saturating_add(particle);
        vec![
            MemoryItem::new("population", self.population, particle),
            MemoryItem::new("archive", self.archive, member),
            MemoryItem::new("iterations", self.iterations, ITERATION.saturating_add(answers)),
            MemoryItem::new("sections", self.sections, CROSS_SECTION),
            log_item(self.samples),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The figure that a refusal says would fit.
    fn said_to_fit(refused: Result<Allowance>) -> usize {
        let said = refused.expect_err("it does not fit").to_string();
        said.split("at most ")
            .nth(1)
            .and_then(|rest| rest.split(',').next())
            .and_then(|figure| figure.parse().ok())
            .expect("a figure")
    }

    fn checked(size: Size, limit_mib: u64) -> Result<Allowance> {
        check(&size.memory_items(), limit_mib)
    }

    #[test]
    fn what_is_said_to_fit_does() {
        let size = |population| Size {
            population,
            variables: 22,
            iterations: 1500,
            archive: 100,
            ..Size::default()
        };
        drop(checked(size(100_000), USUAL_MIB).expect("it fits"));
        let fitting = said_to_fit(checked(size(1_000_000_000), USUAL_MIB));
        drop(checked(size(fitting), USUAL_MIB).expect("as was said"));
        assert!(checked(size(fitting + 1), USUAL_MIB).is_err());
        assert_eq!(needed_mib(&size(fitting).memory_items()), USUAL_MIB);
        assert!(needed_mib(&size(fitting + 1).memory_items()) > USUAL_MIB);
        let absurd = Size {
            population: usize::MAX,
            sections: usize::MAX,
            journal: true,
            ..size(usize::MAX)
        };
        assert_eq!(checked(absurd, 1).expect_err("no overflow").exit_code(), 2);
    }

    #[test]
    fn what_runs_together_shares_the_limit() {
        let size = Size {
            population: 1000,
            variables: 22,
            iterations: 1500,
            ..Size::default()
        };
        let together =
            |count: u64| -> Vec<MemoryItem> { (0..count).flat_map(|_| size.memory_items()).collect() };
        let alone: u64 = size.memory_items().iter().map(MemoryItem::bytes).sum();
        for count in 1..=8u64 {
            let limit_mib = (count * alone + LEAST).div_ceil(1 << 20);
            // Rounded up to whole MiB there is not room for another.
            assert!(alone > 1 << 20);
            assert!(fits(&together(count), limit_mib) && !fits(&together(count + 1), limit_mib));
            drop(check(&together(count), limit_mib).expect("they fit"));
            assert!(check(&together(count + 1), limit_mib).is_err());
        }
    }

    #[test]
    fn a_log_counts() {
        let size = |samples| Size {
            population: 1000,
            variables: 10,
            samples,
            ..Size::default()
        };
        drop(checked(size(0), 64).expect("without a log it fits"));
        let fitting = said_to_fit(checked(size(10_000_000), 64));
        drop(checked(size(fitting), 64).expect("as was said"));
        assert!(checked(size(fitting + 1), 64).is_err());
    }

    #[test]
    fn a_journal_counts() {
        let size = |iterations, journal| Size {
            population: 1000,
            variables: 10,
            iterations,
            journal,
            ..Size::default()
        };
        drop(checked(size(10_000, false), 1024).expect("without a journal it fits"));
        let fitting = said_to_fit(checked(size(10_000, true), 1024));
        // 144 bytes to each of a thousand answers.
        assert!((7000..7500).contains(&fitting), "{fitting}");
        drop(checked(size(fitting, true), 1024).expect("as was said"));
        assert!(checked(size(fitting + 1, true), 1024).is_err());
    }
}
