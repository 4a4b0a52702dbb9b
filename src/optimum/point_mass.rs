//! The g-g-v envelope of a [`PointMass`], as the solvers use it.

use super::lap::{Grip, GripEnvelope, Slope};
use crate::line::PointMass;
use crate::vehicle::EnvelopeRow;
use crate::{Error, Result};

/// The envelope of a point mass, linear in speed between its rows.
///
/// The steering lock is left out. It would slow the car in corners that are too tight for it, and no fast line has such corners.
#[derive(Clone, Debug, PartialEq)]
pub struct PointMassEnvelope {
    rows: Vec<EnvelopeRow>,
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

    fn top_speed_mps(&self) -> f64 {
        self.rows.last().map_or(0.0, |row| row.v_mps)
    }
}
