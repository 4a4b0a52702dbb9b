//! The g-g-v envelope of a [`PointMass`], as the solvers use it.

use super::lap::{Grip, GripEnvelope, Slope};
use crate::line::PointMass;
use crate::vehicle::EnvelopeRow;
use crate::{Error, Result};

/// The envelope of a point mass, linear in speed between its rows, and its steering lock.
#[derive(Clone, Debug, PartialEq)]
pub struct PointMassEnvelope {
    rows: Vec<EnvelopeRow>,
    lock_1pm: f64,
}

impl PointMassEnvelope {
    /// The envelope of `car`.
    ///
    /// # Errors
    /// [`Error::Input`] for settings out of range, and for a friction ellipse whose exponent is not 2, the only one that the
    /// solvers handle.
    pub fn new(car: &PointMass) -> Result<Self> {
        car.check()?;
        if car.ellipse_exponent != 2.0 {
            return Err(Error::input(
                car.envelope.name(),
                "ellipse_exponent",
                car.ellipse_exponent.to_string(),
                "2 for a reference optimum",
            ));
        }
        Ok(Self {
            rows: car.envelope.rows().to_vec(),
            lock_1pm: car
                .max_steer_rad
                .map_or(f64::INFINITY, |lock| lock / car.wheelbase_m),
        })
    }
}

impl GripEnvelope for PointMassEnvelope {
    fn at(&self, v_mps: f64) -> Grip {
        let after = self.rows.partition_point(|row| row.v_mps <= v_mps);
        let (low, high) = (
            self.rows[after.saturating_sub(1)],
            self.rows[after.min(self.rows.len() - 1)],
        );
        let span = high.v_mps - low.v_mps;
        let between = |figure: fn(&EnvelopeRow) -> f64| {
            let by_speed = if span > 0.0 {
                (figure(&high) - figure(&low)) / span
            } else {
                0.0
            };
            Slope {
                value: figure(&low) + by_speed * (v_mps - low.v_mps).max(0.0),
                by_speed,
            }
        };
        Grip {
            lateral: between(|row| row.ay_mps2),
            longitudinal: between(|row| row.ax_grip_mps2),
            drive: between(|row| row.ax_drive_mps2),
            drag: between(|row| row.drag_mps2),
        }
    }

    fn lock_1pm(&self) -> f64 {
        self.lock_1pm
    }

    fn top_speed_mps(&self) -> f64 {
        self.rows.last().map_or(0.0, |row| row.v_mps)
    }
}

#[cfg(test)]
mod tests {
    use super::super::lap::corner_square;
    use super::*;
    use crate::line::kernel::corner;
    use crate::vehicle::Envelope;

    /// A lock of 0.012 rad at a wheelbase of 2.6 m turns a circle of 217 m. In one of 144.4 m, which takes 0.018 rad, the squared
    /// speed is (0.012 / 0.018)^4 of what the tyres hold.
    #[test]
    fn the_solvers_know_the_steering_lock_as_the_kernels_do() {
        let text = "v_mps,ay_mps2,ax_grip_mps2,ax_drive_mps2,drag_mps2\n10,14,14,9,0.1\n70,18,18,4,4\n";
        let free = PointMass::new(Envelope::from_csv("own.csv", text).unwrap(), 2.6);
        let locked = PointMass {
            max_steer_rad: Some(0.012),
            ..free.clone()
        };
        let table = locked.table().unwrap();
        let [free, locked] = [free, locked].map(|car| PointMassEnvelope::new(&car).unwrap());
        let tight = 0.018 / 2.6;
        let share = corner_square(&locked, tight).0 / corner_square(&free, tight).0;
        assert!((share - (2.0f64 / 3.0).powi(4)).abs() < 1e-12, "{share}");
        for curvature in [0.5 / 217.0, 0.99 / 217.0, 1.1 / 217.0, -1.5 / 217.0, 3.0 / 217.0] {
            let (square, slope) = corner_square(&locked, curvature);
            // The kernels' table has steps of 0.3 m of radius.
            let kernel = corner::<f64>(&table, curvature.abs());
            assert!(
                (kernel / square - 1.0).abs() < 1e-3,
                "{curvature}: {kernel} {square}"
            );
            let step = 1e-6 * curvature.abs();
            let ends = [curvature - step, curvature + step].map(|k| corner_square(&locked, k).0);
            let found = (ends[1] - ends[0]) / (2.0 * step);
            assert!(
                (found - slope).abs() < 1e-5 * square / curvature.abs(),
                "{curvature}: {found} {slope}"
            );
        }
    }
}
