//! The archive of solutions that nothing found so far dominates.

use super::Front;
use super::metrics::{Asked, Columns, Within, dominates, non_dominated};
use super::nearness::{crowding, range, remoteness};
use super::settings::{MopsoSettings, Truncation, setting};
use super::space::Space;
use crate::error::Result;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A bounded set of non-dominated solutions; all objectives are minimised.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Archive {
    capacity: usize,
    truncation: Truncation,
    /// What each of the members violates.
    violation: f64,
    /// Positions in the swarm's unit cube, one row per member.
    pub positions: Vec<Vec<f64>>,
    /// Objectives, one row per member.
    pub objectives: Vec<Vec<f64>>,
    /// What each member alone dominates, as far as it was needed; kept only for truncation by it.
    shares: Vec<Within>,
    /// The objectives once more, for the shares.
    columns: Columns,
    /// The reference point of the shares.
    reference: Vec<f64>,
    /// Whether that stays where it is.
    fixed: bool,
}

impl MopsoSettings {
    /// The empty archive of a swarm of so many objectives.
    ///
    /// # Errors
    /// As [`MopsoSettings::validate`], and for a reference of another length.
    pub(super) fn empty_archive(&self, objectives: usize) -> Result<Archive> {
        self.validate()?;
        let archive = Archive::new(self.archive, self.truncation);
        match &self.reference {
            None => Ok(archive),
            Some(reference) if reference.len() == objectives => Ok(archive.measured_from(reference.clone())),
            Some(reference) => {
                let expected = format!("a number for each of {objectives} objectives");
                Err(setting("reference", format!("{reference:?}"), &expected))
            }
        }
    }
}

/// Most objectives of which an archive knows contributions,
pub(super) const MOST_MEASURED: usize = 5;
/// and of which it does without a reference in archives of more members than [`FEW`], for the time that they take.
const MOST_OF_MANY: usize = 4;
const FEW: usize = 1000;

/// Members that leave one by one with what they touched kept up to date; more leave faster.
const FEW_LEAVE: usize = 8;
/// Members from which on threads work out their shares: to wake them takes longer for fewer.
const MEASURED_IN_THREADS: usize = 256;

/// The reference point lies this share of the archive's range beyond its worst values, so that extremes count.
const BEYOND: f64 = 0.1;

impl Archive {
    /// An empty archive of at most `capacity` members.
    pub fn new(capacity: usize, truncation: Truncation) -> Self {
        Self {
            capacity,
            truncation,
            violation: f64::INFINITY,
            positions: Vec::new(),
            objectives: Vec::new(),
            shares: Vec::new(),
            columns: Columns::default(),
            reference: Vec::new(),
            fixed: false,
        }
    }

    /// The same with contributions measured up to `reference`, for one to five objectives. The hypervolume up to the reference
    /// then never falls while solutions are feasible: a member that leaves contributes no more than the newcomer. The ends of the
    /// front have no privilege, and solutions that are no better than the reference leave first. Without a fixed reference, the
    /// reference moves with the members and the ends stay.
    pub fn measured_from(self, reference: Vec<f64>) -> Self {
        Self {
            truncation: Truncation::Contribution,
            reference,
            fixed: true,
            ..self
        }
    }

    /// One like it without members.
    pub(super) fn emptied(&self) -> Self {
        let empty = Self::new(self.capacity, self.truncation);
        match self.fixed {
            true => empty.measured_from(self.reference.clone()),
            false => empty,
        }
    }

    /// The reference point that contributions are measured up to, if it was given.
    pub(super) fn fixed_reference(&self) -> Option<&[f64]> {
        self.fixed.then_some(self.reference.as_slice())
    }

    /// Number of members.
    pub fn len(&self) -> usize {
        self.objectives.len()
    }

    /// Whether there are no members.
    pub fn is_empty(&self) -> bool {
        self.objectives.is_empty()
    }

    /// By how much all members violate the constraints; zero once something feasible is known, infinite for an empty
    /// archive.
    pub fn violation(&self) -> f64 {
        self.violation
    }

    /// Whether a member dominates or equals these objectives.
    pub fn beats(&self, objectives: &[f64]) -> bool {
        let beats = |member: &Vec<f64>| member.iter().zip(objectives).all(|(x, y)| x <= y);
        self.objectives.iter().any(beats)
    }

    /// [`Archive::insert_violating`] of a solution that violates nothing.
    pub fn insert(&mut self, position: &[f64], objectives: &[f64]) -> bool {
        self.insert_violating(position, objectives, 0.0)
    }

    /// Inserts a solution unless a member dominates or equals it; members that it dominates leave. If the archive is then too
    /// full, the member leaves that contributes least and is not the best in any objective; this may be the new one. A smaller
    /// violation of the constraints beats a larger one, whatever the objectives (Deb's rules), so all members violate them
    /// equally. Solutions with objectives that are not finite are refused. Returns whether the solution was inserted.
    pub fn insert_violating(&mut self, position: &[f64], objectives: &[f64], violation: f64) -> bool {
        if objectives.iter().any(|x| !x.is_finite()) || !self.reached(violation) {
            return false;
        }
        if self.beats(objectives) {
            return false;
        }
        let mut i = 0;
        while i < self.len() {
            if dominates(objectives, &self.objectives[i]) {
                self.drop_member(i);
            } else {
                i += 1;
            }
        }
        let full = self.len() >= self.capacity;
        if full && self.by_contribution() {
            // What this works out lasts if nothing comes of the new one.
            self.least(None);
        }
        let before = full.then(|| (self.shares.clone(), self.reference.clone()));
        self.objectives.push(objectives.to_vec());
        self.positions.push(position.to_vec());
        let mut without = None;
        if self.by_contribution() {
            // The shares do not know of the new one yet.
            self.move_reference();
            without = full.then(|| self.shares.clone());
            self.shares.push(Within::UNKNOWN);
            self.columns.push(objectives);
            self.refresh(objectives, true);
        }
        if let Some((shares, reference)) = before {
            let least = self.least(without.as_deref());
            if least + 1 == self.len() {
                // Nothing came of it.
                self.drop_member(least);
                (self.shares, self.reference) = (shares, reference);
                return false;
            }
            // What was found by a subtraction is a bound from now on, or its rounding would add up.
            let subtracts = self.subtracts();
            for (share, before) in self.shares.iter_mut().zip(without.unwrap_or_default()) {
                if subtracts && before.is_exact() && share.least < before.least {
                    share.most = before.most;
                }
            }
            self.drop_least(least);
        }
        true
    }

    /// Inserts solutions with their objectives all at once: first those that no other solution and no member dominates or equals,
    /// then the members that contribute least leave, one at a time.
    pub(super) fn insert_all(&mut self, solutions: Vec<(Vec<f64>, Vec<f64>)>, violation: f64) {
        if solutions.is_empty() || !self.reached(violation) {
            return;
        }
        if self.fixed {
            // Many at once could take more away than each brings.
            for (position, row) in &solutions {
                self.insert_violating(position, row, violation);
            }
            return;
        }
        let positions = std::mem::take(&mut self.positions).into_iter();
        let members = positions.zip(std::mem::take(&mut self.objectives));
        let all: Vec<(Vec<f64>, Vec<f64>)> = members.chain(solutions).collect();
        let rows: Vec<Vec<f64>> = all.iter().map(|(_, row)| row.clone()).collect();
        let mut stays = vec![false; all.len()];
        for i in non_dominated(&rows) {
            stays[i] = true;
        }
        let kept = all.into_iter().zip(stays).filter(|(_, stays)| *stays);
        (self.positions, self.objectives) = kept.map(|(solution, _)| solution).unzip();
        self.shares.clear();
        self.columns.clear();
        if self.by_contribution() {
            self.shares = vec![Within::UNKNOWN; self.len()];
            self.objectives.iter().for_each(|row| self.columns.push(row));
            self.move_reference();
        }
        let beyond = self.len().saturating_sub(self.capacity);
        if beyond > 0 && self.by_contribution() {
            self.measure();
        }
        // To know what a member that leaves has touched takes longer than to ask anew for the shares of the few that may be the least.
        let many = beyond > FEW_LEAVE;
        for _ in 0..beyond {
            let least = self.least(None);
            if many && self.by_contribution() {
                self.drop_member(least);
                self.move_reference();
                // Where others leave, a share only grows.
                self.shares
                    .iter_mut()
                    .for_each(|share| share.most = f64::INFINITY);
            } else {
                self.drop_least(least);
            }
        }
    }

    /// Whether a violation is as small as the archive's. If it is smaller, the members leave.
    fn reached(&mut self, violation: f64) -> bool {
        if !(violation <= self.violation && violation.is_finite()) {
            return false;
        }
        if violation < self.violation {
            self.violation = violation;
            self.positions.clear();
            self.objectives.clear();
            self.shares.clear();
            self.columns.clear();
        }
        true
    }

    /// The best in each objective: the ends of the front, which its users look for first. A fixed reference takes their privilege.
    fn ends(&self) -> impl Iterator<Item = usize> {
        let privileged = match self.fixed {
            true => 0,
            false => self.objectives.first().map_or(0, Vec::len),
        };
        (0..privileged).filter_map(|k| {
            let value = |i: usize| self.objectives[i][k];
            (0..self.len()).min_by(|&a, &b| value(a).total_cmp(&value(b)))
        })
    }

    /// The member that contributes least and is not the best in any objective. `without` is what the members contribute without the
    /// last one, while it is open whether that stays.
    fn least(&mut self, without: Option<&[Within]>) -> usize {
        if self.is_empty() {
            return 0;
        }
        let by_contribution = self.by_contribution();
        let mut worth = match by_contribution {
            true => self.shares.iter().map(|share| share.least).collect(),
            false => self.worth(),
        };
        self.ends().for_each(|end| worth[end] = f64::INFINITY);
        if without.is_some() && worth.last() == Some(&0.0) {
            // Few newcomers stay. What the newest brings is asked for first, and of the others only whether theirs is more.
            worth[self.len() - 1] = -1.0;
        }
        loop {
            // Whose worth is least, the next one, and the least that is exact.
            let (mut least, mut next, mut exact) = (0, f64::INFINITY, f64::INFINITY);
            for (i, &x) in worth.iter().enumerate() {
                if i > 0 && x < worth[least] {
                    (least, next) = (i, worth[least]);
                } else if i > 0 && x < next {
                    next = x;
                }
                if by_contribution && self.shares[i].is_exact() && x < exact {
                    exact = x;
                }
            }
            if !by_contribution || self.shares[least].is_exact() || worth[least].is_infinite() {
                return least;
            }
            // Those of the others are no less, and need not be known.
            let asked = Asked {
                // What is worked out while no newcomer waits lasts: that is worth to be exact.
                enough: without.map_or(f64::INFINITY, |_| exact),
                little: next,
            };
            let share = self.known(least, without, asked);
            if share.most < next {
                return least;
            }
            worth[least] = share.least;
        }
    }

    /// Removes member `least`; the shares of the others grow by what was its.
    fn drop_least(&mut self, least: usize) {
        let left = self.objectives[least].clone();
        self.drop_member(least);
        if self.by_contribution() {
            self.move_reference();
            self.refresh(&left, false);
        }
    }

    /// The least value of each of so many objectives; infinite without members.
    pub fn best(&self, objectives: usize) -> Vec<f64> {
        let least = |k: usize| self.objectives.iter().map(|m| m[k]).fold(f64::INFINITY, f64::min);
        (0..objectives).map(least).collect()
    }

    /// The members, their positions scaled to the variables' units.
    pub(super) fn front(&self, space: &Space) -> Front {
        Front {
            candidates: self.positions.iter().map(|p| space.scaled(p, 1)).collect(),
            objectives: self.objectives.clone(),
            violation: self.violation,
        }
    }

    /// [`Archive::worth`] for [`Archive::leads_before`]. What that works out as it needs it, contributions, is zero; the ends of the
    /// front are worth more than any.
    pub(super) fn worth_at_once(&self) -> Vec<f64> {
        if !self.by_contribution() {
            return self.worth();
        }
        let mut worth = vec![0.0; self.len()];
        self.ends().for_each(|end| worth[end] = f64::INFINITY);
        worth
    }

    /// How much each member contributes, by the measure that truncation uses.
    pub fn worth(&self) -> Vec<f64> {
        if self.by_contribution() {
            let exact = |(i, share): (usize, &Within)| match share.is_exact() {
                true => share.least,
                false => self.columns.exclusive(i, &self.reference),
            };
            return self.shares.iter().enumerate().map(exact).collect();
        }
        match self.truncation {
            Truncation::Crowding => self.crowding(),
            Truncation::Contribution | Truncation::MutualNearest => remoteness(&self.objectives),
        }
    }

    /// Whether a member contributes more than another, or is an end of the front as the other is not, by [`Archive::worth_at_once`].
    pub(super) fn leads_before(&mut self, worth: &[f64], one: usize, other: usize) -> bool {
        if !self.by_contribution() || worth[one] != worth[other] {
            return worth[one] > worth[other];
        }
        let (mut more, less) = (self.shares[one], self.shares[other]);
        if more.most > less.least && more.least <= less.most {
            more = self.known(
                one,
                None,
                Asked {
                    enough: less.most,
                    little: less.least,
                },
            );
        }
        if more.most <= less.least || more.least > less.most {
            return more.least > less.most;
        }
        let less = self.known(
            other,
            None,
            Asked {
                enough: more.most,
                little: more.least,
            },
        );
        more.least > less.most
    }

    /// What member `i` alone dominates, as far as it is asked for.
    fn known(&mut self, i: usize, without: Option<&[Within]>, asked: Asked) -> Within {
        let share = self.shares[i];
        if share.is_exact() {
            return share;
        }
        let newest = self.len() - 1;
        let found = match without {
            Some(without) if self.subtracts() && i != newest && without[i].is_exact() => {
                let lost = self.columns.shared(i, newest, &self.reference);
                Within::exactly((without[i].least - lost).max(0.0))
            }
            _ => self.columns.exclusive_within(i, &self.reference, asked),
        };
        self.shares[i] = match found.is_exact() {
            true => found,
            false => Within {
                least: found.least.max(share.least),
                most: found.most.min(share.most),
            },
        };
        found
    }

    /// Works out what the members contribute, once for all that ask.
    pub(super) fn measure(&mut self) {
        if self.len() < MEASURED_IN_THREADS {
            (0..self.shares.len()).for_each(|i| _ = self.known(i, None, Asked::ALL));
            return;
        }
        let (columns, reference) = (&self.columns, &self.reference);
        let shares = self.shares.par_iter_mut().enumerate();
        shares
            .filter(|(_, share)| !share.is_exact())
            .for_each(|(i, share)| *share = Within::exactly(columns.exclusive(i, reference)));
    }

    /// Whether it takes less time to find what a member loses to the newest one than what is left to it.
    fn subtracts(&self) -> bool {
        self.reference.len() > 3
    }

    fn by_contribution(&self) -> bool {
        let width = self.objectives.first().map_or(0, Vec::len);
        let most = match self.fixed {
            false if self.capacity > FEW => MOST_OF_MANY,
            _ => MOST_MEASURED,
        };
        self.truncation == Truncation::Contribution && width <= most
    }

    fn drop_member(&mut self, i: usize) {
        self.objectives.swap_remove(i);
        self.positions.swap_remove(i);
        if !self.shares.is_empty() {
            self.shares.swap_remove(i);
            self.columns.swap_remove(i);
        }
    }

    /// Updates the shares after `change` came, as the last member, or left.
    fn refresh(&mut self, change: &[f64], came: bool) {
        let new = came.then(|| self.len() - 1);
        for (i, most) in self.columns.touched(change, new, &self.reference) {
            let share = &mut self.shares[i];
            if came {
                // What a newcomer takes, they dominate both.
                share.least = (share.least - most).max(0.0);
            } else {
                share.most += most;
            }
        }
    }

    /// Brings the reference point behind the members there are, and the shares to it.
    fn move_reference(&mut self) {
        if self.fixed {
            return;
        }
        let width = self.objectives.first().map_or(0, Vec::len);
        self.reference.resize(width, f64::INFINITY);
        for k in 0..width {
            let (low, high) = range(&self.objectives, k);
            let end = high + if high > low { BEYOND * (high - low) } else { 1.0 };
            let before = std::mem::replace(&mut self.reference[k], end);
            if before == end {
                continue;
            }
            // Members gain or lose what they alone dominate between the two ends, where all of them reach.
            let others = [&self.reference[..k], &self.reference[k + 1..]].concat();
            let columns = self.columns.without(k);
            for (i, share) in self.shares.iter_mut().enumerate() {
                let reach = columns.exclusive_at_most(i, &others);
                if before < end {
                    share.most += (end - before) * reach;
                } else if share.least > 0.0 {
                    share.least = (share.least - (before - end) * reach).max(0.0);
                }
            }
        }
    }

    /// Crowding distance of each member (Deb et al. 2002): the sum over objectives of the gap between its
    /// neighbours, as a share of the range; infinite for the extremes.
    pub fn crowding(&self) -> Vec<f64> {
        let rows: Vec<&[f64]> = self.objectives.iter().map(Vec::as_slice).collect();
        crowding(&rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::swarm::metrics::{contributions, hypervolume, non_dominated};
    use proptest::prelude::*;

    const ALL: [Truncation; 3] = [
        Truncation::Crowding,
        Truncation::Contribution,
        Truncation::MutualNearest,
    ];

    fn points(width: u32, count: u32) -> Vec<Vec<f64>> {
        let random = Random::new(3);
        (0..count)
            .map(|i| (0..width).map(|k| random.below(64, 1, 0, i, k) as f64).collect())
            .collect()
    }

    #[test]
    fn keeps_exactly_the_non_dominated_without_truncation() {
        for (truncation, width) in ALL.into_iter().flat_map(|t| [(t, 2), (t, 3), (t, 4)]) {
            let points = points(width, 300);
            let mut archive = Archive::new(1000, truncation);
            for p in &points {
                archive.insert(p, p);
            }
            let mut front: Vec<_> = non_dominated(&points)
                .into_iter()
                .map(|i| points[i].clone())
                .collect();
            let mut kept = archive.objectives.clone();
            let key = |a: &Vec<f64>, b: &Vec<f64>| a.partial_cmp(b).unwrap();
            front.sort_by(key);
            kept.sort_by(key);
            assert_eq!(front, kept);
        }
    }

    /// Every insertion leaves the non-dominated part of what was there, or that less one member.
    #[test]
    fn loses_nothing_but_by_truncation() {
        for (truncation, width) in ALL.into_iter().flat_map(|t| [(t, 2), (t, 3), (t, 4)]) {
            let mut archive = Archive::new(12, truncation);
            for p in points(width, 400) {
                let mut before = archive.objectives.clone();
                before.push(p.clone());
                let front = non_dominated(&before);
                archive.insert(&p, &p);
                assert_eq!(archive.len(), front.len().min(12));
                assert!(
                    archive
                        .objectives
                        .iter()
                        .all(|m| front.iter().any(|&i| before[i] == *m))
                );
                assert_eq!(non_dominated(&archive.objectives).len(), archive.len());
                assert_eq!(archive.positions, archive.objectives);
            }
        }
    }

    /// The shares that are kept up to date are those of a fresh calculation, and what is known of them holds. From four objectives on,
    /// a share is a sum of volumes no greater than the whole box, in an order that depends on who came when: some 100 terms of 64
    /// volumes, each rounded to 1e-16 of the box.
    #[test]
    fn shares_stay_exact() {
        for width in [2, 3, 4, 5] {
            let mut archive = Archive::new(15, Truncation::Contribution);
            for p in points(width as u32, 600) {
                archive.insert(&p, &p);
                let fresh = contributions(&archive.objectives, &archive.reference).unwrap();
                if width < 4 {
                    assert_eq!(archive.worth(), fresh);
                }
                let within = 1e-12 * archive.reference.iter().product::<f64>();
                for ((share, worth), fresh) in archive.shares.iter().zip(archive.worth()).zip(fresh) {
                    assert!((worth - fresh).abs() <= within, "{worth}, not {fresh}");
                    assert!(
                        share.least <= fresh + within && share.most >= fresh - within,
                        "{share:?}, {fresh}"
                    );
                }
            }
            assert!(hypervolume(&archive.objectives, &archive.reference).unwrap() > 0.0);
        }
    }

    /// Volumes that are too large for a number end no insertion.
    #[test]
    fn holds_any_finite_objectives() {
        for (truncation, width) in ALL.into_iter().flat_map(|t| [(t, 2), (t, 3), (t, 4), (t, 5)]) {
            for scale in [1e60, 1e150, 1e300] {
                let mut archive = Archive::new(12, truncation);
                let mut fixed = Archive::new(12, truncation).measured_from(vec![65.0 * scale; width]);
                for p in points(width as u32, 400) {
                    let p: Vec<f64> = p.iter().map(|x| x * scale).collect();
                    archive.insert(&p, &p);
                    fixed.insert(&p, &p);
                    let (one, other) = (archive.len() - 1, archive.len() / 2);
                    let worth = archive.worth_at_once();
                    archive.leads_before(&worth, one, other);
                }
                for archive in [archive, fixed] {
                    assert!((1..=12).contains(&archive.len()));
                    assert_eq!(non_dominated(&archive.objectives).len(), archive.len());
                }
            }
        }
    }

    /// Which of two contributes more is found without knowing either exactly, and ends of the front lead before all others.
    #[test]
    fn leads_by_bounds_and_at_the_ends() {
        for width in [2, 3, 4, 5] {
            let mut archive = Archive::new(15, Truncation::Contribution);
            for (n, p) in points(width as u32, 300).into_iter().enumerate() {
                archive.insert(&p, &p);
                let (one, other) = (n % archive.len(), n * 7 % archive.len());
                let mut worth = contributions(&archive.objectives, &archive.reference).unwrap();
                let within = 1e-12 * archive.reference.iter().product::<f64>();
                for k in 0..width {
                    let least = archive
                        .objectives
                        .iter()
                        .map(|row| row[k])
                        .fold(f64::INFINITY, f64::min);
                    let end = archive.objectives.iter().position(|row| row[k] == least).unwrap();
                    worth[end] = f64::INFINITY;
                }
                if (worth[one] - worth[other]).abs() > within {
                    let leads = archive.leads_before(&archive.worth_at_once(), one, other);
                    assert_eq!(leads, worth[one] > worth[other], "{worth:?}: {one}, {other}");
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        /// Whatever comes, one at a time or many at once, and wherever the reference lies.
        #[test]
        fn hypervolume_never_falls(
            seed in any::<u64>(), width in 1usize..6, capacity in 1usize..20, at in 0.2..1.5f64, batch in 1usize..30,
        ) {
            let random = Random::new(seed);
            let reference = vec![at; width];
            let mut archive = Archive::new(capacity, Truncation::Crowding).measured_from(reference.clone());
            let mut last = 0.0;
            for round in 0..40 {
                // Ever closer to a sphere about the origin, so that there is something to truncate.
                let nearness = 1.0 - f64::from(round) / 60.0;
                let point = |i: usize| -> Vec<f64> {
                    let draw = |k: usize| random.uniform(1, round, i as u32, k as u32);
                    let row: Vec<f64> = (0..width).map(draw).collect();
                    let length = row.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9);
                    row.iter().map(|x| (1.0 - nearness) * x / length + nearness * x).collect()
                };
                let points: Vec<Vec<f64>> = (0..batch).map(point).collect();
                if round % 2 == 0 {
                    archive.insert_all(points.iter().map(|p| (p.clone(), p.clone())).collect(), 0.0);
                } else {
                    points.iter().for_each(|p| { archive.insert(p, p); });
                }
                let volume = hypervolume(&archive.objectives, &reference).unwrap();
                prop_assert!(volume >= last * (1.0 - 1e-12), "{volume} after {last}");
                prop_assert!(archive.len() <= capacity);
                prop_assert_eq!(non_dominated(&archive.objectives).len(), archive.len());
                last = volume;
            }
        }
    }

    #[test]
    fn truncation_keeps_extremes_and_bound() {
        for truncation in ALL {
            let mut archive = Archive::new(10, truncation);
            for i in 0..100 {
                let x = f64::from(i * 37 % 100) / 99.0;
                archive.insert(&[x], &[x, 1.0 - x]);
            }
            assert_eq!(archive.len(), 10);
            let holds = |end: [f64; 2]| archive.objectives.contains(&end.to_vec());
            assert!(holds([0.0, 1.0]) && holds([1.0, 0.0]));
            assert!(!archive.insert(&[0.0], &[0.0, 1.0]), "no duplicates");
        }
    }
}
