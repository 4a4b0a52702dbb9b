//! Which moves a swarm makes: those that earn the archive something.
//!
//! Some problems are solved by the pulls of a swarm, others by difference moves; no fixed share of the two serves both. A move
//! earns where its candidate takes the place of members instead of standing beside them. The odds of a difference move are
//! some of the settings', times what such a move has earned lately for each try over what a pull has: probability matching, as
//! in Thierens, *Adaptive strategies for operator allocation* (2007).

use serde::{Deserialize, Serialize};

/// What is left of what was earned after an iteration.
const FADE: f64 = 0.95;
/// Bounds of the share of difference moves, unless the settings lie beyond. With more of them some runs on ZDT4 stay in a hollow.
const BOUNDS: [f64; 2] = [0.1, 0.4];
/// What a difference move's earnings are worth beside a pull's: it often earns by what pulls have found.
const WORTH: f64 = 0.6;
/// What both kinds are held to have earned and tried before they have.
const BEFORE: [f64; 2] = [0.1, 1.0];

/// Tries and earnings of pulls and of difference moves.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Earnings {
    tried: [f64; 2],
    earned: [f64; 2],
}

impl Earnings {
    /// Counts a try, of a difference move or a pull, and whether it earned something.
    pub fn count(&mut self, difference: bool, earned: bool) {
        self.tried[usize::from(difference)] += 1.0;
        self.earned[usize::from(difference)] += f64::from(u8::from(earned));
    }

    /// Lets what there is fade, after an iteration.
    pub fn fade(&mut self) {
        self.tried
            .iter_mut()
            .chain(&mut self.earned)
            .for_each(|x| *x *= FADE);
    }

    /// The share of difference moves where the settings say `usual`. A swarm of one kind of move keeps to it.
    pub fn share(&self, usual: f64) -> f64 {
        if usual <= 0.0 || usual >= 1.0 {
            return usual;
        }
        let rate = |kind: usize| (self.earned[kind] + BEFORE[0]) / (self.tried[kind] + BEFORE[1]);
        let odds = usual / (1.0 - usual) * WORTH * rate(1) / rate(0);
        (odds / (1.0 + odds)).clamp(BOUNDS[0].min(usual), BOUNDS[1].max(usual))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_that_earn_are_made_more_often() {
        let mut earnings = Earnings::default();
        let before = earnings.share(0.25);
        assert!((before - 1.0 / 6.0).abs() < 1e-12, "{before}");
        for _ in 0..100 {
            earnings.count(true, true);
            earnings.count(false, false);
        }
        assert_eq!(earnings.share(0.25), 0.4);
        assert_eq!(
            [0.0, 0.75, 1.0].map(|usual| earnings.share(usual)),
            [0.0, 0.75, 1.0]
        );
        // Long ago, it counts for nothing.
        (0..1000).for_each(|_| earnings.fade());
        assert!((earnings.share(0.25) - before).abs() < 1e-9);
        for _ in 0..100 {
            earnings.count(true, false);
            earnings.count(false, true);
        }
        assert_eq!(earnings.share(0.25), 0.1);
        assert_eq!(earnings.share(0.05), 0.05);
    }
}
