//! Own bests that lead and mate where constraints leave the archive of a large swarm few members.

use crate::random::Random;
use crate::swarm::Counters;
use crate::swarm::archive::Archive;
use crate::swarm::motion::Purpose;
use crate::swarm::settings::MopsoSettings;

/// The particles whose own bests do.
#[derive(Default)]
pub struct StandIns {
    /// Those that violate least first; one may stand there more than once.
    pub particles: Vec<usize>,
    /// Whether the members do not lead beside them.
    pub instead_of_members: bool,
}

impl StandIns {
    /// Whether there may be any, whatever particles violate.
    pub fn are_possible(archive: &Archive, settings: &MopsoSettings) -> bool {
        !archive.is_empty() && (archive.violation() > 0.0 || 2 * archive.len() < settings.archive)
    }

    /// For the next move of a swarm whose own bests violate the constraints by `violations`; of a swarm without constraints, nothing.
    ///
    /// As in a small swarm, own bests stand in for all members while nothing feasible is known, of two each the one that violates less.
    /// While constraints leave the archive less than half full, they stand in for the members that it lacks.
    pub fn draw(archive: &Archive, settings: &MopsoSettings, counters: Counters, violations: &[f64]) -> Self {
        let infeasible = archive.violation() > 0.0;
        let violates = |violation: &f64| *violation > 0.0 && violation.is_finite();
        let wanted = infeasible || violations.iter().any(violates);
        if violations.is_empty() || !wanted || !Self::are_possible(archive, settings) {
            return Self::default();
        }
        let random = Random::new(settings.motion.seed);
        let (when, n) = (counters.iteration as u32, settings.motion.population);
        let draw = |place: usize| {
            let drawn = |index| random.below(n, Purpose::Leader as u32, when, place as u32, index);
            let [first, second] = [0, 1].map(drawn);
            let second_leads = infeasible && violations[second] < violations[first];
            if second_leads { second } else { first }
        };
        let first = if infeasible { 0 } else { archive.len() };
        let mut particles: Vec<usize> = (first..settings.archive).map(draw).collect();
        particles.sort_by(|&a, &b| violations[a].total_cmp(&violations[b]));
        Self {
            particles,
            instead_of_members: infeasible,
        }
    }
}
