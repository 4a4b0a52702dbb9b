//! Engine and gears, as far as driving round a circuit needs them (`physics.md` section 6).

use crate::config::Table;
use crate::error::Result;

/// Full-throttle torque over engine speed, gears and final drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Powertrain {
    /// Engine speeds of the torque curve, ascending, rpm.
    pub engine_speed_rpm: Vec<f64>,
    /// Full-throttle torque at those speeds, N m.
    pub torque_nm: Vec<f64>,
    /// Gear ratios from first to top, engine turns per gearbox-output turn.
    pub gear_ratios: Vec<f64>,
    /// Final drive ratio.
    pub final_drive: f64,
    /// Share of engine torque that reaches the wheels.
    pub efficiency: f64,
}

impl Powertrain {
    /// Reads `[powertrain]`.
    pub fn from_table(table: &Table<'_>) -> Result<Self> {
        let list = |key: &str, least: usize, minimum: f64, meaning: &str| -> Result<Vec<f64>> {
            let values = table.numbers(key)?.unwrap_or_default();
            if values.len() < least || values.iter().any(|x| *x < minimum) {
                return Err(table.refuse(
                    key,
                    format!("at least {least} numbers of {minimum} or more ({meaning})"),
                ));
            }
            Ok(values)
        };
        let engine_speed_rpm = list("engine_speed_rpm", 2, 1.0, "engine speeds in rpm")?;
        if engine_speed_rpm.windows(2).any(|w| w[1] <= w[0]) {
            return Err(table.refuse("engine_speed_rpm", "speeds that rise from one to the next"));
        }
        let torque_nm = list("torque_nm", 2, 0.0, "torques in N m")?;
        if torque_nm.len() != engine_speed_rpm.len() {
            return Err(table.refuse(
                "torque_nm",
                format!("{} torques, one per engine speed", engine_speed_rpm.len()),
            ));
        }
        Ok(Self {
            gear_ratios: list("gear_ratios", 1, 0.1, "ratios from first to top gear")?,
            final_drive: table.required_number("final_drive", 0.1, 50.0, "")?,
            efficiency: table.number("gearbox_efficiency", 0.1, 1.0, "")?.unwrap_or(1.0),
            engine_speed_rpm,
            torque_nm,
        })
    }

    /// Writes `[powertrain]`.
    pub fn to_toml(&self) -> String {
        format!(
            "[powertrain]\nengine_speed_rpm = {:?}\ntorque_nm = {:?}\ngear_ratios = {:?}\nfinal_drive = {:?}\ngearbox_efficiency = {:?}\n",
            self.engine_speed_rpm, self.torque_nm, self.gear_ratios, self.final_drive, self.efficiency
        )
    }

    /// Full-throttle engine torque (N m), linear between points; nought beyond the last one.
    pub fn torque_at(&self, engine_speed_rpm: f64) -> f64 {
        let speeds = &self.engine_speed_rpm;
        match speeds.iter().position(|s| *s >= engine_speed_rpm) {
            Some(0) => self.torque_nm[0],
            Some(i) => {
                let share = (engine_speed_rpm - speeds[i - 1]) / (speeds[i] - speeds[i - 1]);
                self.torque_nm[i - 1] + share * (self.torque_nm[i] - self.torque_nm[i - 1])
            }
            None => 0.0,
        }
    }

    /// The greatest force at the wheels (N) at road speed `speed` (m/s), in the gear that gives most.
    pub fn wheel_force(&self, speed: f64, wheel_radius: f64) -> f64 {
        let wheel_rpm = speed / wheel_radius * 60.0 / (2.0 * std::f64::consts::PI);
        self.gear_ratios
            .iter()
            .map(|gear| {
                let ratio = gear * self.final_drive;
                self.torque_at(wheel_rpm * ratio) * ratio * self.efficiency / wheel_radius
            })
            .fold(0.0, f64::max)
    }
}
