//! Swarms over zones whose shares spend what there is.
//!
//! A lap spends its energy in the order of its zones until none is left. A swarm over the shares of zones by themselves has a ridge where
//! the energy just suffices: below it some is left, beyond it the last zones go without. Here what the swarm says of zones are weights
//! instead, and one factor turns them into shares that spend the energy. How far to aim above it or below is said by the greatest of the
//! weights, whose size would mean nothing else.

use super::scenario::drive;
use super::setup::HybridSetup;
use crate::error::Result;
use crate::evaluate::Evaluation;
use crate::evaluate::energy::HybridProblem;
use crate::line::energy::{EnergyPlan, Gates};
use crate::scalar::bisected;
use crate::swarm::{Counters, Front, Optimiser};

/// What the shares of zones are made to spend on a lap with the motor on wherever it is of use, for each joule that there is, at a greatest
/// weight of zero and of one. A lap that uses the motor less is slower, and spends more on every metre.
const AIM: [f64; 2] = [0.92, 1.08];

/// What zones spend, by the share of each.
#[derive(Clone, Debug)]
pub(super) struct Spending {
    /// Rising shares of each zone, and the energy (J) up to each.
    zones: Vec<Vec<(f64, f64)>>,
    budget_j: f64,
    /// Variables before those of the zones. The first of them, if any, is the motor's power (kW).
    before: usize,
    /// The motor's power on the lap that the energies are of (kW).
    motor_kw: f64,
}

impl Spending {
    /// What the zones of a problem spend, of an energy (MJ) in all. Its last variables are the shares of all zones; before them may be
    /// the motor's power (kW), which is then near the one given.
    ///
    /// # Errors
    /// Those of a lap.
    pub(super) fn of(
        setup: &HybridSetup,
        problem: &HybridProblem,
        energy_mj: f64,
        motor_kw: Option<f64>,
    ) -> Result<Self> {
        let plan: &EnergyPlan<f64> = problem.energy();
        let own_kw = 1e-3 * setup.car.hybrid.mgu_k.power_w;
        let motor_kw = motor_kw.unwrap_or(own_kw);
        let gates = Gates {
            motor_share: motor_kw / own_kw.max(1e-3),
            ..Gates::of_zones(1e6)
        };
        let open = drive(setup, "open", plan.mode, gates)?;
        let mut zones = vec![vec![(0.0, 0.0)]; plan.count()];
        let mut pieces: Vec<_> = plan.zones.iter().zip(&open.segments).collect();
        pieces.sort_by(|a, b| a.0.position.total_cmp(&b.0.position));
        for (row, segment) in pieces {
            let zone = &mut zones[row.zone as usize];
            let spent_j = zone[zone.len() - 1].1;
            zone.push((row.position + row.per_share.recip(), spent_j + segment.deployed));
        }
        Ok(Self {
            before: problem.dimensions() - zones.len(),
            zones,
            budget_j: 1e6 * energy_mj,
            motor_kw,
        })
    }

    /// What a share of a zone spends (J).
    fn spent_j(&self, zone: usize, share: f64) -> f64 {
        let known = &self.zones[zone];
        let after = known
            .partition_point(|(end, _)| *end < share)
            .clamp(1, known.len() - 1);
        let [(from, before_j), (to, after_j)] = [known[after - 1], known[after]];
        before_j + (after_j - before_j) * ((share - from) / (to - from)).clamp(0.0, 1.0)
    }

    /// A candidate whose shares of zones are the weights times one factor, at most one.
    fn shared(&self, weights: &[f64]) -> Vec<f64> {
        let (own, weights) = weights.split_at(self.before);
        let power = own.first().map_or(1.0, |kw| kw / self.motor_kw);
        let greatest = weights.iter().copied().fold(0.0, f64::max);
        let aim = AIM[0] + greatest * (AIM[1] - AIM[0]);
        let wanted_j = aim * self.budget_j / power.max(1e-9);
        let share = |weight: &f64, factor: f64| (weight * factor).min(1.0);
        let spent_j = |factor: f64| -> f64 {
            let each = weights.iter().enumerate();
            each.map(|(zone, weight)| self.spent_j(zone, share(weight, factor)))
                .sum()
        };
        let least = weights.iter().copied().filter(|w| *w > 0.0).fold(1.0, f64::min);
        let mut factor = least.recip();
        if spent_j(factor) > wanted_j {
            [_, factor] = bisected([0.0, factor], 1e-12 * factor, |f| spent_j(f) < wanted_j);
        }
        let shares = weights.iter().map(|weight| share(weight, factor));
        own.iter().copied().chain(shares).collect()
    }
}

/// A swarm whose weights of zones become shares.
pub(super) struct Sharing<O> {
    pub(super) swarm: O,
    pub(super) spending: Spending,
}

impl<O: Optimiser> Optimiser for Sharing<O> {
    fn ask(&mut self) -> Vec<f64> {
        let width = self.spending.before + self.spending.zones.len();
        let asked = self.swarm.ask();
        asked
            .chunks(width)
            .flat_map(|row| self.spending.shared(row))
            .collect()
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        self.swarm.tell(evaluation)
    }

    fn counters(&self) -> Counters {
        self.swarm.counters()
    }

    fn planned_iterations(&self) -> usize {
        self.swarm.planned_iterations()
    }

    fn done(&self) -> bool {
        self.swarm.done()
    }

    fn best(&self) -> Vec<f64> {
        self.swarm.best()
    }

    fn front(&self) -> Front {
        let mut front = self.swarm.front();
        for row in &mut front.candidates {
            *row = self.spending.shared(row);
        }
        front
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_become_shares_that_spend_the_energy() {
        let spending = Spending {
            // The second zone has nothing to spend beyond half of it.
            zones: vec![
                vec![(0.0, 0.0), (1.0, 100.0)],
                vec![(0.0, 0.0), (0.5, 60.0), (1.0, 60.0)],
            ],
            budget_j: 50.0,
            before: 0,
            motor_kw: 100.0,
        };
        // Even shares f of the zones spend 100 f + 120 f (up to a half), which is 50 J, and 4 J more or less at weights of 1 and of 0.
        for (weight, spent_j) in [(0.5, 50.0), (1.0, 54.0), (0.01, 46.08)] {
            let shares = spending.shared(&[weight, weight]);
            assert!(
                shares.iter().all(|s| (s - spent_j / 220.0).abs() < 1e-9),
                "{shares:?}"
            );
        }
        // A zone of no weight has none, and what cannot be spent is all that there is.
        let shares = spending.shared(&[0.0, 0.5]);
        assert!(shares[0] == 0.0 && (spending.spent_j(1, shares[1]) - 50.0).abs() < 1e-9);
        assert_eq!(spending.shared(&[0.0, 0.0]), [0.0, 0.0]);
        let more = Spending {
            budget_j: 1e3,
            ..spending.clone()
        };
        assert_eq!(more.shared(&[0.2, 0.1]), [1.0, 1.0]);
        // Twice the motor spends twice as much.
        let motor = Spending {
            before: 1,
            ..spending
        };
        let shares = motor.shared(&[200.0, 0.5, 0.5]);
        assert!(shares[0] == 200.0 && (shares[1] - 25.0 / 220.0).abs() < 1e-9);
    }
}
