//! How the drive torque is shared between the wheels.

use crate::config::Table;
use crate::error::Result;

/// How torque is split between axles and, at the rear, from side to side.
///
/// The right rear wheel's share of its axle is `1/2 + a steer + b yaw_rate`, held within zero and one, so that with positive
/// factors the outer wheel gets more. Both factors are zero for equal shares.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Differential {
    /// The front axle's share.
    pub front_share: f64,
    /// Change of the outer rear wheel's share by the road-wheel angle (1/rad).
    pub share_per_steer: f64,
    /// Change of the outer rear wheel's share by the yaw rate (s/rad).
    pub share_per_yaw_rate: f64,
}

impl Differential {
    /// Reads `[powertrain.differential]`; without it both rear wheels get half.
    pub(super) fn from_table(table: &Table<'_>) -> Result<Self> {
        let Some(table) = table.table("differential")? else {
            return Ok(Self::default());
        };
        let number = |key: &str, least: f64, most: f64| -> Result<f64> {
            Ok(table.number(key, least, most, "")?.unwrap_or(0.0))
        };
        let differential = Self {
            front_share: number("front_share", 0.0, 1.0)?,
            share_per_steer: number("outer_share_per_rad", -20.0, 20.0)?,
            share_per_yaw_rate: number("outer_share_per_radps", -20.0, 20.0)?,
        };
        table.finish()?;
        Ok(differential)
    }

    pub(super) fn to_toml(self) -> String {
        if self == Self::default() {
            return String::new();
        }
        format!(
            "[powertrain.differential]\nfront_share = {:?}\nouter_share_per_rad = {:?}\nouter_share_per_radps = {:?}\n",
            self.front_share, self.share_per_steer, self.share_per_yaw_rate
        )
    }

    /// Torques of FL, FR, RL and RR (N m) for a torque on all of them, the road-wheel angle (rad) and the yaw rate (rad/s).
    pub fn torques_nm(&self, torque_nm: f64, steer_rad: f64, yaw_rate_radps: f64) -> [f64; 4] {
        let front = 0.5 * self.front_share * torque_nm;
        let rear = (1.0 - self.front_share) * torque_nm;
        let lean = self.share_per_steer * steer_rad + self.share_per_yaw_rate * yaw_rate_radps;
        let right = (0.5 + lean).clamp(0.0, 1.0);
        [front, front, rear * (1.0 - right), rear * right]
    }
}
