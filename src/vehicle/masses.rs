//! A car's limits over its mass, which falls as fuel burns. Downforce does not fall with it and tyres are sensitive to load, so that
//! limits of one mass say little of those of another.

use super::envelope::BendTraction;
use super::limits::{SpeedRange, car_envelope};
use super::{Car, Envelope, EnvelopeRow, Traction};
use crate::error::Result;
use rayon::prelude::*;

/// Limits at a few masses.
#[derive(Clone, Debug)]
pub struct MassLimits {
    rows: Vec<(f64, Envelope, Traction)>,
}

/// The limits just below the greatest speed, at which an envelope has no drive.
fn before_top(envelope: &Envelope, v_mps: f64) -> EnvelopeRow {
    envelope.at(v_mps.min(envelope.top_speed_mps() * (1.0 - 1e-12)))
}

impl MassLimits {
    /// Sweeps `car` with each of the masses (kg, rising), at the usual speeds.
    ///
    /// # Errors
    /// As [`car_envelope`].
    pub fn sweep(car: &Car, masses_kg: &[f64]) -> Result<Self> {
        let range = SpeedRange::of(car);
        let limits = |mass_kg: &f64| {
            let mut car = car.clone();
            car.chassis.mass = *mass_kg;
            let limits = car_envelope(&car, &range)?;
            Ok((*mass_kg, limits.envelope.clone(), limits.traction()))
        };
        Ok(Self {
            rows: masses_kg.par_iter().map(limits).collect::<Result<_>>()?,
        })
    }

    /// The swept rows on both sides of a mass (kg), and how far it is on its way between them.
    fn between(&self, mass_kg: f64) -> ([&(f64, Envelope, Traction); 2], f64) {
        let last = self.rows.len() - 1;
        let after = self.rows.partition_point(|row| row.0 < mass_kg).min(last);
        let (low, high) = (&self.rows[after.saturating_sub(1)], &self.rows[after]);
        let share = if high.0 > low.0 {
            ((mass_kg - low.0) / (high.0 - low.0)).clamp(0.0, 1.0)
        } else {
            0.0
        };
        ([low, high], share)
    }

    /// The limits at a speed (m/s) and a mass (kg), and the traction (m/s^2): linear between the masses, held beyond them.
    fn at(&self, mass_kg: f64, v_mps: f64) -> (EnvelopeRow, f64) {
        let ([low, high], share) = self.between(mass_kg);
        let between = |low: f64, high: f64| low + share * (high - low);
        let (a, b) = (before_top(&low.1, v_mps), before_top(&high.1, v_mps));
        let row = EnvelopeRow {
            v_mps,
            ay_mps2: between(a.ay_mps2, b.ay_mps2),
            ax_grip_mps2: between(a.ax_grip_mps2, b.ax_grip_mps2),
            ax_drive_mps2: between(a.ax_drive_mps2, b.ax_drive_mps2),
            drag_mps2: between(a.drag_mps2, b.drag_mps2),
        };
        (row, between(low.2.at(v_mps), high.2.at(v_mps)))
    }

    /// What an envelope says of a place, at a mass (kg).
    fn in_bend(&self, mass_kg: f64, figure: impl Fn(&Envelope) -> f64) -> f64 {
        let ([low, high], share) = self.between(mass_kg);
        let [low, high] = [low, high].map(|row| figure(&row.1));
        low + share * (high - low)
    }

    /// Limits that the car has with a mass (kg), carried to another: each figure changes by the share by which that of the sweep
    /// does.
    ///
    /// # Errors
    /// Those of [`Envelope::new`].
    pub fn carry(
        &self,
        (envelope, traction): (&Envelope, &Traction),
        from_kg: f64,
        to_kg: f64,
    ) -> Result<(Envelope, Traction)> {
        let share = |from: f64, to: f64| if from > 0.0 { to / from } else { 1.0 };
        let rows = envelope.rows().iter().map(|row| {
            let ((from, _), (to, _)) = (self.at(from_kg, row.v_mps), self.at(to_kg, row.v_mps));
            EnvelopeRow {
                v_mps: row.v_mps,
                ay_mps2: row.ay_mps2 * share(from.ay_mps2, to.ay_mps2),
                ax_grip_mps2: row.ax_grip_mps2 * share(from.ax_grip_mps2, to.ax_grip_mps2),
                ax_drive_mps2: row.ax_drive_mps2 * share(from.ax_drive_mps2, to.ax_drive_mps2),
                drag_mps2: row.drag_mps2 * share(from.drag_mps2, to.drag_mps2),
            }
        });
        let driven = traction.rows.iter().map(|(v_mps, most)| {
            let (from, to) = (self.at(from_kg, *v_mps).1, self.at(to_kg, *v_mps).1);
            (*v_mps, most * share(from, to))
        });
        let traction = Traction {
            rows: driven.collect(),
        };
        let mut carried = Envelope::new(envelope.name(), rows.collect())?;
        if let Some(in_bends) = self.carried_in_bends(envelope, from_kg, to_kg) {
            carried = carried.with_bend_traction(in_bends)?;
        }
        let swept = self.rows.iter().map(|(mass_kg, limits, traction)| {
            let open = limits.open()?;
            let own = open.straight_traction().unwrap_or_else(|| traction.clone());
            Some((*mass_kg, open.clone(), own))
        });
        if let (Some(open), Some(rows)) = (envelope.open(), swept.collect()) {
            let own = open.straight_traction().unwrap_or_else(|| traction.clone());
            let (open, _) = Self { rows }.carry((open, &own), from_kg, to_kg)?;
            carried = carried.with_open(open)?;
        }
        // Under other loads limits change with the mass as under the weight.
        let carried = carried.with_loads_of(envelope, &|limits| {
            let own = limits.straight_traction().unwrap_or_else(|| traction.clone());
            Ok(self.carry((limits, &own), from_kg, to_kg)?.0)
        })?;
        Ok((carried, traction))
    }

    /// The traction in bends of an envelope, carried likewise.
    fn carried_in_bends(&self, envelope: &Envelope, from_kg: f64, to_kg: f64) -> Option<BendTraction> {
        let share = |from: f64, to: f64| if from > 0.0 { to / from } else { 1.0 };
        let BendTraction { shares, rows, lost } = envelope.bend_traction()?;
        let masses_kg = [from_kg, to_kg];
        let carried = |v_mps: f64, (figures, lost): (&Vec<f64>, &Vec<f64>)| {
            let mut most = f64::INFINITY;
            let figures = figures.iter().zip(shares).map(|(figure, lateral)| {
                let at = |limits: &Envelope| limits.traction_at(v_mps, *lateral).unwrap_or(0.0);
                let [from, to] = masses_kg.map(|mass_kg| self.in_bend(mass_kg, at));
                most = (figure * share(from, to)).min(most);
                most
            });
            let lost = lost.iter().zip(shares).map(|(figure, lateral)| {
                let at = |limits: &Envelope| limits.lost_at(v_mps, *lateral);
                let [from, to] = masses_kg.map(|mass_kg| self.in_bend(mass_kg, at));
                figure * share(from, to)
            });
            (figures.collect(), lost.collect())
        };
        let of_rows = envelope.rows().iter().zip(rows.iter().zip(lost));
        let (rows, lost) = of_rows.map(|(row, both)| carried(row.v_mps, both)).unzip();
        Some(BendTraction {
            shares: shares.clone(),
            rows,
            lost,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With 60 kg of fuel the tyres carry 4.8 % more, of which they make less than in proportion. At the swept masses the sweep
    /// itself comes back; between them, limits bend by less than a ten-thousandth.
    #[test]
    fn a_heavier_car_corners_less() {
        let car = Car::bundled().unwrap();
        let limits = MassLimits::sweep(&car, &[1245.0, 1275.0, 1305.0]).unwrap();
        let swept = |mass_kg: f64| {
            let mut car = car.clone();
            car.chassis.mass = mass_kg;
            car_envelope(&car, &SpeedRange::USUAL).unwrap()
        };
        let dry = swept(1245.0);
        let own = (&dry.envelope, &dry.traction());
        for mass_kg in [1260.0, 1305.0] {
            let (envelope, traction) = limits.carry(own, 1245.0, mass_kg).unwrap();
            let wanted = swept(mass_kg);
            for (found, wanted) in envelope.rows().iter().zip(wanted.envelope.rows()) {
                let figures = [
                    (found.ay_mps2, wanted.ay_mps2),
                    (found.ax_grip_mps2, wanted.ax_grip_mps2),
                    (found.ax_drive_mps2, wanted.ax_drive_mps2),
                    (found.drag_mps2, wanted.drag_mps2),
                ];
                // The peak of cornering is that of the points along its curve, which lie elsewhere with each mass.
                for (found, wanted) in figures {
                    assert!((found / wanted - 1.0).abs() < 1e-3, "{mass_kg}: {found} {wanted}");
                }
            }
            for (found, wanted) in traction.rows.iter().zip(&wanted.traction().rows) {
                assert!(
                    (found.1 / wanted.1 - 1.0).abs() < 1e-3,
                    "{mass_kg}: {found:?} {wanted:?}"
                );
            }
        }
        let (heavy, _) = limits.carry(own, 1245.0, 1305.0).unwrap();
        let lost = 1.0 - heavy.at(60.0).ay_mps2 / dry.envelope.at(60.0).ay_mps2;
        assert!((0.005..0.048).contains(&lost), "{lost}");
    }
}
