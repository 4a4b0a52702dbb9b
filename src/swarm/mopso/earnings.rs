//! Which moves a swarm makes: those that earn the archive something.
//!
//! Some problems are solved by the pulls of a swarm, others by difference moves or by crossings; no fixed share of them serves
//! all. A move earns where its candidate takes the place of members instead of standing beside them. The odds of a move are
//! given ones, times what such a move has earned lately for each try over what the others have (for crossings the square of
//! it): probability matching, as in Thierens, *Adaptive strategies for operator allocation* (2007).

use serde::{Deserialize, Serialize};

/// What is left of what was earned after an iteration.
const FADE: f64 = 0.95;
/// Bounds of the share of difference moves among pulls and differences, unless the settings lie beyond. With more of them some
/// runs on ZDT4 stay in a hollow.
const BOUNDS: [f64; 2] = [0.1, 0.4];
/// What a difference move's earnings are worth beside a pull's: it often earns by what pulls have found.
const WORTH: f64 = 0.6;
/// The odds of a crossing that earns as much as pulls and differences are worth. As many crossings as others lose on problems with linked
/// variables.
const CROSSINGS: f64 = 1.0 / 3.0;
/// What every kind is held to have earned and tried before it has.
const BEFORE: [f64; 2] = [0.1, 1.0];

/// A kind of move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::swarm) enum Move {
    /// Towards a particle's own best and a leader.
    Pull,
    /// From a leader along the difference of two members.
    Difference,
    /// To a place made of two members' coordinates.
    Crossing,
}

/// Tries and earnings of each kind of move.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(in crate::swarm) struct Earnings {
    tried: [f64; 3],
    earned: [f64; 3],
}

impl Earnings {
    /// Counts a try of a move, and whether it earned something.
    pub fn count(&mut self, made: Move, earned: bool) {
        self.tried[made as usize] += 1.0;
        self.earned[made as usize] += f64::from(u8::from(earned));
    }

    /// Counts an iteration's tries of each kind of move, and how many earned something. What there was fades.
    pub fn count_all(&mut self, tried: [f64; 3], earned: [f64; 3]) {
        self.fade();
        for k in 0..3 {
            self.tried[k] += tried[k];
            self.earned[k] += earned[k];
        }
    }

    /// The share of crossings, and of these and difference moves together, as of [`Earnings::choice`].
    pub fn shares(&self, usual: f64) -> [f64; 2] {
        let crossings = self.crossings(usual);
        [crossings, crossings + (1.0 - crossings) * self.differences(usual)]
    }

    /// Lets what there is fade, after an iteration.
    pub fn fade(&mut self) {
        self.tried
            .iter_mut()
            .chain(&mut self.earned)
            .for_each(|x| *x *= FADE);
    }

    /// The move that falls to a uniform random number where the settings say that the share of difference moves among pulls and
    /// differences is `usual`. A swarm of one kind of move keeps to it.
    pub fn choice(&self, usual: f64, uniform: f64) -> Move {
        let [crossings, no_pulls] = self.shares(usual);
        if uniform < crossings {
            Move::Crossing
        } else if uniform < no_pulls {
            Move::Difference
        } else {
            Move::Pull
        }
    }

    fn rate(&self, made: Move) -> f64 {
        (self.earned[made as usize] + BEFORE[0]) / (self.tried[made as usize] + BEFORE[1])
    }

    /// The share of crossings among all moves.
    fn crossings(&self, usual: f64) -> f64 {
        if usual <= 0.0 || usual >= 1.0 {
            return 0.0;
        }
        let others = (1.0 - usual) * self.rate(Move::Pull) + usual * WORTH * self.rate(Move::Difference);
        let odds = CROSSINGS * (self.rate(Move::Crossing) / others).powi(2);
        odds / (1.0 + odds)
    }

    /// The share of difference moves among pulls and differences.
    fn differences(&self, usual: f64) -> f64 {
        if usual <= 0.0 || usual >= 1.0 {
            return usual;
        }
        let odds = usual / (1.0 - usual) * WORTH * self.rate(Move::Difference) / self.rate(Move::Pull);
        (odds / (1.0 + odds)).clamp(BOUNDS[0].min(usual), BOUNDS[1].max(usual))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_that_earn_are_made_more_often() {
        let mut earnings = Earnings::default();
        let before = earnings.differences(0.25);
        assert!((before - 1.0 / 6.0).abs() < 1e-12, "{before}");
        // A third, over the square of what pulls and differences are worth.
        let crossings = earnings.crossings(0.25);
        assert!(
            (crossings - 1.0 / (1.0 + 3.0 * 0.81)).abs() < 1e-12,
            "{crossings}"
        );
        for _ in 0..100 {
            earnings.count(Move::Difference, true);
            earnings.count(Move::Pull, false);
            earnings.count(Move::Crossing, false);
        }
        assert_eq!(earnings.differences(0.25), 0.4);
        assert!(earnings.crossings(0.25) < 0.01);
        assert_eq!(
            [0.0, 0.75, 1.0].map(|usual| earnings.differences(usual)),
            [0.0, 0.75, 1.0]
        );
        // Long ago, it counts for nothing.
        (0..1000).for_each(|_| earnings.fade());
        assert!((earnings.differences(0.25) - before).abs() < 1e-9);
        assert!((earnings.crossings(0.25) - crossings).abs() < 1e-9);
        for _ in 0..100 {
            earnings.count(Move::Difference, false);
            earnings.count(Move::Pull, true);
            earnings.count(Move::Crossing, true);
        }
        assert_eq!(earnings.differences(0.25), 0.1);
        assert_eq!(earnings.differences(0.05), 0.05);
        assert!(earnings.crossings(0.25) > 0.25);
    }

    #[test]
    fn a_swarm_of_one_kind_of_move_keeps_to_it() {
        let earnings = Earnings::default();
        for uniform in [0.0, 0.3, 0.9] {
            assert_eq!(earnings.choice(0.0, uniform), Move::Pull);
            assert_eq!(earnings.choice(1.0, uniform), Move::Difference);
        }
        let mixed = [0.0, 0.35, 0.9].map(|uniform| earnings.choice(0.25, uniform));
        assert_eq!(mixed, [Move::Crossing, Move::Difference, Move::Pull]);
    }
}
