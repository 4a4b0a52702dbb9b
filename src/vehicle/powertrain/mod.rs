//! Engine, gears and driven axles: the greatest force at the wheels at a speed, and the engine state for any smaller one.

mod engine;
#[cfg(test)]
mod tests;

pub use engine::{EngineMap, FlowLimit};

use crate::config::Table;
use crate::error::Result;
use std::f64::consts::TAU;

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
    /// Torque and fuel over engine speed and throttle, if the car has such maps.
    pub engine: Option<EngineMap>,
    /// Coefficient of rolling resistance.
    pub rolling_resistance: f64,
    /// Mass that the engine accelerates over that of the car: more than one by the inertia of all that turns.
    pub rotating_mass_factor: f64,
}

/// A gear at a road speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gear {
    /// Its place in [`Powertrain::gear_ratios`].
    pub index: usize,
    /// Engine speed (rpm).
    pub engine_speed_rpm: f64,
    /// Force at the wheels at full throttle (N).
    pub force_n: f64,
}

/// The state of the engine for a power at the wheels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OperatingPoint {
    /// The gear.
    pub gear: Gear,
    /// Throttle (degrees).
    pub throttle_deg: f64,
    /// Torque at the crank (N m).
    pub torque_nm: f64,
    /// Power at the crank (W).
    pub power_w: f64,
    /// Share of the greatest power in this gear.
    pub load: f64,
    /// Fuel flow (kg/h).
    pub fuel_flow_kgph: f64,
    /// Power that was asked for at the crank in excess of the greatest power (W).
    pub missing_w: f64,
}

/// Standard gravity (m/s^2): that of a car unless its file says otherwise, and what is meant by one g.
pub const GRAVITY_MPS2: f64 = 9.80665;

impl Powertrain {
    /// The same powertrain with torque, fuel flow and the limit of the flow multiplied by `share` at every engine speed.
    pub fn scaled(&self, share: f64) -> Self {
        let all = |values: &[f64]| -> Vec<f64> { values.iter().map(|x| share * x).collect() };
        Self {
            torque_nm: all(&self.torque_nm),
            engine: self.engine.as_ref().map(|engine| EngineMap {
                torque_nm: engine.torque_nm.iter().map(|row| all(row)).collect(),
                fuel_flow_kgph: engine.fuel_flow_kgph.iter().map(|row| all(row)).collect(),
                flow_limit: engine.flow_limit.map(|limit| FlowLimit {
                    most_kgph: share * limit.most_kgph,
                    slope_kgph_per_rpm: share * limit.slope_kgph_per_rpm,
                    offset_kgph: share * limit.offset_kgph,
                    ..limit
                }),
                ..engine.clone()
            }),
            ..self.clone()
        }
    }

    /// The acceleration (m/s^2) that a force at the wheels (N) gives a car of this mass (kg) against its resistance (m/s^2, of the
    /// air and of rolling), from the power that it needs to move: `v (D + m g f_r + m I a)` with the coefficient of rolling
    /// resistance `f_r`, the drag `D` and the factor of rotating masses `I` (R. Rajamani, *Vehicle Dynamics and Control*, 2012,
    /// ch. 4).
    pub fn acceleration_mps2(&self, force_n: f64, mass_kg: f64, resistance_mps2: f64) -> f64 {
        (force_n / mass_kg - resistance_mps2) / self.rotating_mass_factor
    }

    /// Reads `[powertrain]`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the key whose value is missing or out of range.
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
        let engine = EngineMap::from_table(table, &engine_speed_rpm)?;
        let (engine_speed_rpm, torque_nm) = match &engine {
            Some(engine) => engine.full_throttle_curve(),
            None => {
                let torque_nm = list("torque_nm", 2, 0.0, "torques in N m")?;
                if torque_nm.len() != engine_speed_rpm.len() {
                    return Err(table.refuse(
                        "torque_nm",
                        format!("{} torques, one per engine speed", engine_speed_rpm.len()),
                    ));
                }
                (engine_speed_rpm, torque_nm)
            }
        };
        Ok(Self {
            engine,
            rolling_resistance: table.number("rolling_resistance", 0.0, 0.1, "")?.unwrap_or(0.0),
            rotating_mass_factor: table.number("rotating_mass_factor", 1.0, 3.0, "")?.unwrap_or(1.0),
            gear_ratios: list("gear_ratios", 1, 0.1, "ratios from first to top gear")?,
            final_drive: table.required_number("final_drive", 0.1, 50.0, "")?,
            efficiency: table.number("gearbox_efficiency", 0.1, 1.0, "")?.unwrap_or(1.0),
            engine_speed_rpm,
            torque_nm,
        })
    }

    /// Writes `[powertrain]`.
    pub fn to_toml(&self) -> String {
        let engine = match &self.engine {
            Some(engine) => engine.to_toml(),
            None => format!(
                "engine_speed_rpm = {:?}\ntorque_nm = {:?}\n",
                self.engine_speed_rpm, self.torque_nm
            ),
        };
        format!(
            "[powertrain]\n{engine}gear_ratios = {:?}\nfinal_drive = {:?}\ngearbox_efficiency = {:?}\nrolling_resistance = {:?}\n\
             rotating_mass_factor = {:?}\n",
            self.gear_ratios,
            self.final_drive,
            self.efficiency,
            self.rolling_resistance,
            self.rotating_mass_factor
        )
    }

    /// Full-throttle engine torque (N m), linear between points; zero beyond the last one.
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

    /// Engine turns per wheel turn in a gear, by its place in [`Powertrain::gear_ratios`].
    fn ratio(&self, gear: usize) -> f64 {
        self.gear_ratios[gear] * self.final_drive
    }

    /// Engine speed (rpm) in a gear at road speed `speed` (m/s) on wheels of this rolling radius (m).
    pub fn engine_speed_in(&self, gear: usize, speed: f64, wheel_radius: f64) -> f64 {
        speed / wheel_radius * 60.0 / TAU * self.ratio(gear)
    }

    /// Road speed (m/s) in a gear at an engine speed (rpm) on wheels of this rolling radius (m).
    pub fn road_speed_in(&self, gear: usize, engine_speed_rpm: f64, wheel_radius: f64) -> f64 {
        engine_speed_rpm * TAU / 60.0 * wheel_radius / self.ratio(gear)
    }

    /// Force at the wheels (N) at full throttle in a gear at road speed `speed` (m/s) on wheels of this rolling radius (m); zero
    /// beyond the last engine speed.
    pub fn force_in(&self, gear: usize, speed: f64, wheel_radius: f64) -> f64 {
        let torque = self.torque_at(self.engine_speed_in(gear, speed, wheel_radius));
        torque * self.ratio(gear) * self.efficiency / wheel_radius
    }

    /// The gear with the greatest force at road speed `speed` (m/s), the lowest one of equals. `None` above the speed that the
    /// engine reaches in top gear.
    pub fn gear(&self, speed: f64, wheel_radius: f64) -> Option<Gear> {
        let mut best: Option<Gear> = None;
        for index in 0..self.gear_ratios.len() {
            let engine_speed_rpm = self.engine_speed_in(index, speed, wheel_radius);
            let force_n = self.force_in(index, speed, wheel_radius);
            if force_n > best.map_or(0.0, |b| b.force_n) {
                best = Some(Gear {
                    index,
                    engine_speed_rpm,
                    force_n,
                });
            }
        }
        best
    }

    /// The greatest force at the wheels (N) at road speed `speed` (m/s), in the best gear.
    pub fn wheel_force(&self, speed: f64, wheel_radius: f64) -> f64 {
        self.gear(speed, wheel_radius).map_or(0.0, |gear| gear.force_n)
    }

    /// Road speeds (m/s) from which the next gear gives more force, one fewer than gears. `None` where it never does.
    pub fn shift_points_mps(&self, wheel_radius: f64) -> Vec<Option<f64>> {
        let top_rpm = self.engine_speed_rpm[self.engine_speed_rpm.len() - 1];
        let force = |gear, speed| self.force_in(gear, speed, wheel_radius);
        (1..self.gear_ratios.len())
            .map(|next| {
                let end = self.road_speed_in(next - 1, top_rpm, wheel_radius);
                // Above its last speed a gear gives no force, so the next one takes over there at the latest.
                const STEPS: usize = 2000;
                (1..=STEPS + 1)
                    .map(|i| end * i as f64 / STEPS as f64)
                    .find(|&v| force(next, v) > force(next - 1, v))
            })
            .collect()
    }

    /// The state of the engine for a power (W) at the wheels at a road speed (m/s): gear, engine speed, throttle and fuel. `None`
    /// without an engine map, or beyond the speed of the top gear.
    pub fn operating_point(
        &self,
        speed: f64,
        wheel_power_w: f64,
        wheel_radius: f64,
    ) -> Option<OperatingPoint> {
        let engine = self.engine.as_ref()?;
        let gear = self.gear(speed, wheel_radius)?;
        let rpm = gear.engine_speed_rpm;
        let omega = rpm * TAU / 60.0;
        let most_nm = self.torque_at(rpm);
        let asked_w = (wheel_power_w / self.efficiency).max(0.0);
        let torque_nm = (asked_w / omega).min(most_nm);
        let throttle_deg = engine.throttle_for(rpm, torque_nm);
        Some(OperatingPoint {
            gear,
            throttle_deg,
            torque_nm,
            power_w: torque_nm * omega,
            load: if most_nm > 0.0 { torque_nm / most_nm } else { 0.0 },
            fuel_flow_kgph: engine.fuel_flow_at(rpm, throttle_deg),
            missing_w: asked_w - torque_nm * omega,
        })
    }
}
