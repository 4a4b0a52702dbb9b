//! What the driven tyres can give at each speed, which an envelope does not say where the engine gives less.

use super::envelope::BendTraction;
use super::{Car, Envelope, EnvelopeRow, steady_car};
use crate::error::Result;
use rayon::prelude::*;

/// Greatest acceleration by the driven tyres (m/s^2) over speed (m/s), by rising speed.
#[derive(Clone, Debug, PartialEq)]
pub struct Traction {
    /// Speeds and accelerations.
    pub rows: Vec<(f64, f64)>,
}

impl Traction {
    /// The traction of `car` within `envelope`, a table of its own or of other grip. Where that says nothing of it, the driven tyres
    /// have the share of the envelope's grip that they have of the car's own, and never less than the envelope's drive.
    pub fn of(car: &Car, envelope: &Envelope) -> Self {
        if let Some(known) = envelope.straight_traction() {
            return known;
        }
        let steady = steady_car(car);
        let at = |row: &EnvelopeRow| {
            let braking = steady.greatest_braking(row.v_mps);
            let driven = steady.greatest_traction(row.v_mps) / braking;
            // A car that cannot brake at this speed has no share to go by.
            let share = if driven.is_finite() { driven } else { 1.0 };
            (row.v_mps, (share * row.ax_grip_mps2).max(row.ax_drive_mps2))
        };
        Self {
            rows: envelope.rows().par_iter().map(at).collect(),
        }
    }

    /// The acceleration (m/s^2) at a speed (m/s): linear between rows, and held beyond them.
    pub fn at(&self, v_mps: f64) -> f64 {
        let after = self.rows.partition_point(|row| row.0 < v_mps);
        match (after.checked_sub(1).map(|i| self.rows[i]), self.rows.get(after)) {
            (Some(low), Some(high)) => low.1 + (v_mps - low.0) / (high.0 - low.0) * (high.1 - low.1),
            (Some(row), None) => row.1,
            (None, Some(row)) => row.1,
            (None, None) => f64::INFINITY,
        }
    }
}

impl Envelope {
    /// What the driven tyres can give running straight, where the envelope has a table of its traction.
    pub fn straight_traction(&self) -> Option<Traction> {
        let in_bends = self.bend_traction()?;
        let rows = self.rows().iter().zip(&in_bends.rows);
        Some(Traction {
            rows: rows.map(|(row, straight)| (row.v_mps, straight[0])).collect(),
        })
    }

    /// The envelope with a share of the grip, that of the driven tyres included; the engine and drag are the car's own.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if no grip is left.
    pub fn with_grip_share(&self, share: f64, traction: &Traction) -> Result<Self> {
        let rows = self.rows().iter().map(|row| EnvelopeRow {
            ay_mps2: share * row.ay_mps2,
            ax_grip_mps2: share * row.ax_grip_mps2,
            ax_drive_mps2: row.ax_drive_mps2.min(share * traction.at(row.v_mps)),
            ..*row
        });
        let mut part = Self::new(format!("{}, {share:.3} of its grip", self.name()), rows.collect())?;
        if let Some(BendTraction { shares, rows, .. }) = self.bend_traction() {
            let less = rows.iter().map(|row| row.iter().map(|x| share * x).collect());
            // The tyres take what they do at the same acceleration. What the driven ones cannot bring they do not lose.
            let lost = self.rows().iter().zip(part.rows()).map(|(whole, part)| {
                let unused = whole.ax_drive_mps2 - part.ax_drive_mps2;
                let at = |lateral: &f64| (self.lost_at(whole.v_mps, share * lateral) - unused).max(0.0);
                shares.iter().map(at).collect()
            });
            let in_bends = BendTraction {
                shares: shares.clone(),
                rows: less.collect(),
                lost: lost.collect(),
            };
            part = part.with_bend_traction(in_bends)?;
        }
        if let Some(open) = self.open() {
            let own = open.straight_traction();
            part = part.with_open(open.with_grip_share(share, own.as_ref().unwrap_or(traction))?)?;
        }
        part.with_loads_of(self, &|limits| {
            let own = limits.straight_traction();
            limits.with_grip_share(share, own.as_ref().unwrap_or(traction))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::limits::{SpeedRange, car_envelope};

    fn coarse() -> SpeedRange {
        SpeedRange {
            step_mps: 10.0,
            ..SpeedRange::USUAL
        }
    }

    /// Driven tyres give 10 m/s^2. The engine gives 9 at 20 m/s, 8 at 30 and 3 at 60: at 0.85 of the grip the tyres hold it at 20
    /// alone, to 8.5.
    #[test]
    fn a_share_of_the_grip_is_a_share_of_the_traction() {
        let text = "v_mps,ay_mps2,ax_grip_mps2,ax_drive_mps2,drag_mps2\n20,15,14,9,0.5\n30,15,14,8,1\n60,18,16,3,4\n";
        let whole = Envelope::from_csv("own.csv", text).unwrap();
        let traction = Traction {
            rows: vec![(20.0, 10.0), (60.0, 10.0)],
        };
        let part = whole.with_grip_share(0.85, &traction).unwrap();
        let drive: Vec<f64> = part.rows().iter().map(|row| row.ax_drive_mps2).collect();
        assert_eq!(drive, [8.5, 8.0, 3.0]);
        assert_eq!(part.rows()[2].ay_mps2, 0.85 * 18.0);
        assert_eq!(part.rows()[2].drag_mps2, 4.0);
        assert_eq!(traction.at(5.0), 10.0);
    }

    /// The sweep knows the traction. Out of the table alone, and out of one of less grip, the same comes back.
    #[test]
    fn the_traction_of_a_table_is_that_of_the_car_in_its_share_of_the_grip() {
        let car = Car::bundled().unwrap();
        let limits = car_envelope(&car, &coarse()).unwrap();
        let swept = limits.traction();
        for share in [1.0, 0.9] {
            let table = limits.envelope.with_grip_share(share, &swept).unwrap();
            for (found, wanted) in Traction::of(&car, &table).rows.iter().zip(&swept.rows) {
                let off = found.1 / (share * wanted.1).max(table.at(wanted.0).ax_drive_mps2) - 1.0;
                assert!(off.abs() < 1e-9, "{share}: {found:?} {wanted:?}");
            }
        }
    }
}
