//! How large a study may be: what it would need is reckoned before any of it is taken, so that none is ended by the system.

use crate::error::{Error, Result};

/// Memory that a study may take where nothing else is said (MiB).
pub const USUAL_MIB: u64 = 4096;
/// Numbers that swarm, evaluator and checkpoint keep for each variable of a particle, at the most: positions, velocities and
/// best positions, the candidates asked for in the optimiser's and the parameters' coordinates, the same in single precision,
/// and a state written down.
const COPIES: u64 = 12;
/// Bytes of a particle besides its variables: objectives, failures, order, figures on the device.
const PARTICLE: u64 = 512;
/// Bytes of an iteration in the history and in the tables and pictures that it comes to.
const ITERATION: u64 = 512;
/// Bytes of a cut across the track: in every level of the search, in the cone programs of the exact solvers, whose
/// factors are what is largest, in the edges that lines are checked against and the lines that are reported.
const CUT: u64 = 16 << 10;

/// What a study's memory goes with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Particles of the largest swarm.
    pub population: usize,
    /// Variables of a particle.
    pub variables: usize,
    /// Iterations.
    pub iterations: usize,
    /// Cuts across the track.
    pub sections: usize,
    /// Members of the archive.
    pub archive: usize,
}

impl Size {
    /// Bytes that a study of this size takes at the most, as a rule.
    pub fn bytes(&self) -> u64 {
        let particle = self.particle();
        let parts = [
            particle.saturating_mul(self.population as u64),
            particle.saturating_mul(self.archive as u64),
            ITERATION.saturating_mul(self.iterations as u64),
            CUT.saturating_mul(self.sections as u64),
        ];
        parts.into_iter().fold(0, u64::saturating_add)
    }

    fn particle(&self) -> u64 {
        (self.variables as u64)
            .saturating_mul(8 * COPIES)
            .saturating_add(PARTICLE)
    }

    /// Whether the study fits into so much memory.
    ///
    /// # Errors
    /// [`Error::Input`] naming what takes most of it, and how much of that would fit beside the rest.
    pub fn check(&self, limit_mib: u64) -> Result<()> {
        let limit = limit_mib.saturating_mul(1 << 20);
        let needed = self.bytes();
        if needed <= limit {
            return Ok(());
        }
        let terms = [
            ("population", self.population, self.particle()),
            ("archive", self.archive, self.particle()),
            ("iterations", self.iterations, ITERATION),
            ("sections", self.sections, CUT),
        ];
        let share = |(_, count, each): &(&str, usize, u64)| each.saturating_mul(*count as u64);
        let Some(largest) = terms.iter().max_by_key(|term| share(term)) else {
            return Ok(());
        };
        let rest: u64 = terms
            .iter()
            .filter(|term| term.0 != largest.0)
            .map(share)
            .fold(0, u64::saturating_add);
        let expected = match limit.saturating_sub(rest) / largest.2 {
            0 => "a smaller study, or a higher --memory-limit-mib".to_owned(),
            fitting => format!("at most {fitting}, which fits into {limit_mib} MiB (--memory-limit-mib)"),
        };
        let found = format!("{}, for which some {} MiB are needed", largest.1, needed >> 20);
        Err(Error::input("the study", largest.0, found, expected))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_to_fit_does() {
        let size = |population| Size {
            population,
            variables: 22,
            iterations: 1500,
            sections: 0,
            archive: 100,
        };
        size(100_000).check(USUAL_MIB).expect("it fits");
        let said = size(1_000_000_000)
            .check(USUAL_MIB)
            .expect_err("it does not")
            .to_string();
        let fitting: usize = said
            .split("at most ")
            .nth(1)
            .and_then(|rest| rest.split(',').next())
            .and_then(|figure| figure.parse().ok())
            .expect("a figure");
        size(fitting).check(USUAL_MIB).expect("as was said");
        assert!(size(fitting + 1).check(USUAL_MIB).is_err());
        let absurd = Size {
            population: usize::MAX,
            sections: usize::MAX,
            ..size(usize::MAX)
        };
        assert_eq!(absurd.check(1).expect_err("no overflow").exit_code(), 2);
    }
}
