//! What a joule buys, by where on the lap it is deployed.

use super::scenario::ReportedLap;
use super::setup::HybridSetup;
use crate::error::Result;
use crate::evaluate::energy::{Free, Strategy};
use crate::line::energy::Gates;

/// Length of the stretches that the motor is tried on by itself (m).
const STRETCH_M: f64 = 25.0;
/// Stretches where the tyres leave it less to do are none (J).
const LEAST_J: f64 = 2e3;

/// A stretch of the lap of the engine alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worth {
    /// Where it begins (m).
    pub station_m: f64,
    /// Mean speed on it (m/s).
    pub speed_mps: f64,
    /// Time that the lap gains with the motor on there and nowhere else, over the energy (s/MJ).
    pub s_per_mj: f64,
    /// What the motor takes there (J).
    pub energy_j: f64,
    /// What the deployment of the study takes there, as a share of it.
    pub taken: f64,
}

/// What the motor is worth on each stretch of the lap on which it is of use, and how much of it `deployed` uses.
///
/// # Errors
/// Those of [`HybridSetup::problem`].
pub fn worth(setup: &HybridSetup, engine: &ReportedLap, deployed: &ReportedLap) -> Result<Vec<Worth>> {
    let n = setup.points_m.len();
    let problem = setup.by_segment(Strategy {
        free: (0..n).map(Free::Zone).collect(),
        ..Strategy::fixed(Gates::of_zones(1e6), n)
    })?;
    let segments = engine.segments.len();
    let mut shares = vec![0.0; n];
    let none = problem.lap(&shares).0.time;
    let mut rows = Vec::new();
    let mut first = 0;
    while first < segments {
        let end = first + reaching(&engine.length_m[first..], STRETCH_M);
        shares[first..end].fill(1.0);
        let lap = problem.lap(&shares).0;
        shares[first..end].fill(0.0);
        if lap.deployed > LEAST_J {
            let length: f64 = engine.length_m[first..end].iter().sum();
            let time: f64 = engine.segments[first..end].iter().map(|s| s.time).sum();
            let taken: f64 = deployed.segments[first..end].iter().map(|s| s.deployed).sum();
            rows.push(Worth {
                station_m: engine.station_m[first],
                speed_mps: length / time,
                s_per_mj: 1e6 * (none - lap.time) / lap.deployed,
                energy_j: lap.deployed,
                taken: (taken / lap.deployed).min(1.0),
            });
        }
        first = end;
    }
    Ok(rows)
}

/// How many of the first segments of these lengths (m) reach that far (m); all of them if they do not.
fn reaching(length_m: &[f64], far_m: f64) -> usize {
    let mut along = 0.0;
    let last = length_m.iter().position(|h| {
        along += h;
        along >= far_m
    });
    last.map_or(length_m.len(), |i| i + 1)
}

/// The correlation (Pearson's) of worth and speed, each stretch counting by its energy; nothing for fewer than three, or if
/// either is the same everywhere.
pub fn correlation(rows: &[Worth]) -> Option<f64> {
    let total: f64 = rows.iter().map(|r| r.energy_j).sum();
    let mean = |of: fn(&Worth) -> f64| rows.iter().map(|r| r.energy_j * of(r)).sum::<f64>() / total;
    let (speed, worth) = (mean(|r| r.speed_mps), mean(|r| r.s_per_mj));
    let product = |a: fn(&Worth) -> f64, at: f64, b: fn(&Worth) -> f64, bt: f64| {
        rows.iter()
            .map(|r| r.energy_j * (a(r) - at) * (b(r) - bt))
            .sum::<f64>()
    };
    let across = product(|r| r.speed_mps, speed, |r| r.s_per_mj, worth);
    let speeds = product(|r| r.speed_mps, speed, |r| r.speed_mps, speed);
    let worths = product(|r| r.s_per_mj, worth, |r| r.s_per_mj, worth);
    (rows.len() > 2 && speeds > 0.0 && worths > 0.0).then(|| across / (speeds * worths).sqrt())
}

/// The mean worth (s/MJ) of what is taken and of what is left, joule by joule.
pub fn mean_worths(rows: &[Worth]) -> [Option<f64>; 2] {
    let mean = |weight: fn(&Worth) -> f64| {
        let total: f64 = rows.iter().map(weight).sum();
        let sum: f64 = rows.iter().map(|r| weight(r) * r.s_per_mj).sum();
        (total > 0.0).then(|| sum / total)
    };
    [
        mean(|r| r.energy_j * r.taken),
        mean(|r| r.energy_j * (1.0 - r.taken)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(speed_mps: f64, s_per_mj: f64, energy_j: f64, taken: f64) -> Worth {
        Worth {
            station_m: 0.0,
            speed_mps,
            s_per_mj,
            energy_j,
            taken,
        }
    }

    #[test]
    fn by_hand() {
        let falling = [
            row(20.0, 3.0, 1e4, 1.0),
            row(40.0, 2.0, 1e4, 0.5),
            row(60.0, 1.0, 1e4, 0.0),
        ];
        assert!((correlation(&falling).unwrap() + 1.0).abs() < 1e-12);
        assert_eq!(mean_worths(&falling), [Some(4.0 / 1.5), Some(2.0 / 1.5)]);
        assert_eq!(correlation(&falling[..2]), None);
        assert_eq!(mean_worths(&falling[..1]), [Some(3.0), None]);
        assert_eq!(reaching(&[10.0, 10.0, 10.0, 1.0], 25.0), 3);
        assert_eq!(reaching(&[30.0, 10.0], 25.0), 1);
        assert_eq!(reaching(&[3.0, 10.0], 25.0), 2);
    }
}
