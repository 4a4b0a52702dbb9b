//! The engine as maps over engine speed and throttle.

use crate::config::Table;
use crate::error::Result;
use std::f64::consts::TAU;

/// A limit of the fuel flow by engine speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowLimit {
    /// Greatest flow (kg/h).
    pub most_kgph: f64,
    /// Engine speed below which the flow is held to the line (rpm).
    pub below_rpm: f64,
    /// Slope of the line (kg/h per rpm).
    pub slope_kgph_per_rpm: f64,
    /// Value of the line at standstill (kg/h).
    pub offset_kgph: f64,
}

impl FlowLimit {
    /// Formula One's: 100 kg/h, and `0.009 rpm + 5.5` below 10500 rpm (FIA technical regulations 2014, art. 5.1.4 and
    /// 5.1.5).
    pub const FORMULA_ONE: Self = Self {
        most_kgph: 100.0,
        below_rpm: 10_500.0,
        slope_kgph_per_rpm: 0.009,
        offset_kgph: 5.5,
    };

    /// The greatest flow (kg/h) at an engine speed.
    pub fn at(&self, engine_speed_rpm: f64) -> f64 {
        if engine_speed_rpm < self.below_rpm {
            (self.slope_kgph_per_rpm * engine_speed_rpm + self.offset_kgph).min(self.most_kgph)
        } else {
            self.most_kgph
        }
    }
}

/// Torque and fuel flow over engine speed and throttle, bilinear between points and held beyond the edges.
#[derive(Clone, Debug, PartialEq)]
pub struct EngineMap {
    /// Engine speeds, ascending (rpm).
    pub engine_speed_rpm: Vec<f64>,
    /// Throttle, ascending (degrees).
    pub throttle_deg: Vec<f64>,
    /// Torque (N m), one row of engine speeds for each throttle.
    pub torque_nm: Vec<Vec<f64>>,
    /// Fuel flow (kg/h), likewise.
    pub fuel_flow_kgph: Vec<Vec<f64>>,
    /// Density of the fuel (kg/l).
    pub fuel_density_kgpl: f64,
    /// The limit of the fuel flow by the rules.
    pub flow_limit: Option<FlowLimit>,
}

/// Heat of combustion of petrol (J/kg), an upper bound of what an engine gets from it.
const HEAT_JPKG: f64 = 43.0e6;
/// Steps of the full-throttle curve between two speeds of the map. A limit of the fuel flow bends the curve between them.
const STEPS: usize = 10;

/// Where `x` lies on an ascending axis: the knot before it and the share of the way to the next.
fn place(axis: &[f64], x: f64) -> (usize, f64) {
    let after = axis.partition_point(|knot| *knot <= x).clamp(1, axis.len() - 1);
    let (low, high) = (axis[after - 1], axis[after]);
    (after - 1, ((x - low) / (high - low)).clamp(0.0, 1.0))
}

impl EngineMap {
    /// Reads the maps of `[powertrain]`, if it has a throttle axis.
    pub(super) fn from_table(table: &Table<'_>, engine_speed_rpm: &[f64]) -> Result<Option<Self>> {
        let Some(throttle_deg) = table.numbers("throttle_deg")? else {
            return Ok(None);
        };
        let rising = throttle_deg.windows(2).all(|w| w[1] > w[0]);
        if throttle_deg.len() < 2 || throttle_deg[0] < 0.0 || !rising {
            return Err(table.refuse("throttle_deg", "at least two openings that rise from 0 or more"));
        }
        let map = |key: &str, unit: &str| -> Result<Vec<Vec<f64>>> {
            let shape = format!(
                "{} rows (throttle) of {} numbers (engine speed) of 0 {unit} or more, without holes",
                throttle_deg.len(),
                engine_speed_rpm.len()
            );
            let rows = table
                .number_rows(key)?
                .ok_or_else(|| table.refuse(key, shape.clone()))?;
            let whole = rows.len() == throttle_deg.len()
                && rows
                    .iter()
                    .all(|row| row.len() == engine_speed_rpm.len() && row.iter().all(|x| *x >= 0.0));
            if whole {
                Ok(rows)
            } else {
                Err(table.refuse(key, shape))
            }
        };
        let torque_nm = map("torque_map_nm", "N m")?;
        let fuel_flow_kgph = map("fuel_flow_kgph", "kg/h")?;
        for (torques, flows) in torque_nm.iter().zip(&fuel_flow_kgph) {
            for ((torque, flow), rpm) in torques.iter().zip(flows).zip(engine_speed_rpm) {
                let efficiency =
                    torque * rpm * TAU / 60.0 / (flow / 3600.0 * HEAT_JPKG).max(f64::MIN_POSITIVE);
                if efficiency > 1.0 {
                    let found = format!(
                        "an engine of efficiency 1 or less: {torque} N m at {rpm} rpm from {flow} kg/h is {efficiency:.2}"
                    );
                    return Err(table.refuse("torque_map_nm", found));
                }
            }
        }
        if torque_nm[torque_nm.len() - 1].iter().all(|t| *t == 0.0) {
            return Err(table.refuse("torque_map_nm", "some torque at full throttle"));
        }
        let flow_limit = match table.string("fuel_flow_limit")? {
            None | Some("none") => None,
            Some("formula_one") => Some(FlowLimit::FORMULA_ONE),
            Some(_) => return Err(table.refuse("fuel_flow_limit", "\"none\" or \"formula_one\"")),
        };
        let least = |key: &str, most: f64, unit: &str| -> Result<f64> {
            Ok(table.number(key, 0.0, most, unit)?.unwrap_or(0.0))
        };
        let flow_limit = match table.number("fuel_flow_most_kgph", 1.0, 1000.0, "kg/h")? {
            Some(most_kgph) => Some(FlowLimit {
                most_kgph,
                below_rpm: least("fuel_flow_below_rpm", 1e5, "rpm")?,
                slope_kgph_per_rpm: least("fuel_flow_slope_kgph_per_rpm", 10.0, "kg/h per rpm")?,
                offset_kgph: least("fuel_flow_offset_kgph", 1000.0, "kg/h")?,
            }),
            None => flow_limit,
        };
        let engine = Self {
            engine_speed_rpm: engine_speed_rpm.to_vec(),
            fuel_density_kgpl: table
                .number("fuel_density_kgpl", 0.4, 1.2, "kg/l")?
                .unwrap_or(0.748),
            throttle_deg,
            torque_nm,
            fuel_flow_kgph,
            flow_limit,
        };
        if engine.flow_limit.is_some() && engine.full_throttle_curve().1.iter().any(|t| *t <= 0.0) {
            let key = if engine.flow_limit == Some(FlowLimit::FORMULA_ONE) {
                "fuel_flow_limit"
            } else {
                "fuel_flow_most_kgph"
            };
            return Err(table.refuse(
                key,
                "a limit that leaves the engine some power at every speed of its map",
            ));
        }
        Ok(Some(engine))
    }

    pub(super) fn to_toml(&self) -> String {
        let mut text = format!(
            "engine_speed_rpm = {:?}\nthrottle_deg = {:?}\ntorque_map_nm = {:?}\nfuel_flow_kgph = {:?}\nfuel_density_kgpl = {:?}\n",
            self.engine_speed_rpm,
            self.throttle_deg,
            self.torque_nm,
            self.fuel_flow_kgph,
            self.fuel_density_kgpl
        );
        match self.flow_limit {
            Some(FlowLimit::FORMULA_ONE) => text += "fuel_flow_limit = \"formula_one\"\n",
            Some(limit) => {
                text += &format!("fuel_flow_most_kgph = {:?}\n", limit.most_kgph);
                if limit.below_rpm > 0.0 {
                    text += &format!(
                        "fuel_flow_below_rpm = {:?}\nfuel_flow_slope_kgph_per_rpm = {:?}\nfuel_flow_offset_kgph = {:?}\n",
                        limit.below_rpm, limit.slope_kgph_per_rpm, limit.offset_kgph
                    );
                }
            }
            None => {}
        }
        text
    }

    fn at(&self, map: &[Vec<f64>], engine_speed_rpm: f64, throttle_deg: f64) -> f64 {
        let (i, across) = place(&self.engine_speed_rpm, engine_speed_rpm);
        let (j, up) = place(&self.throttle_deg, throttle_deg);
        let along = |row: &[f64]| row[i] + across * (row[i + 1] - row[i]);
        let low = along(&map[j]);
        low + up * (along(&map[j + 1]) - low)
    }

    /// Torque (N m), without regard to the limit of the fuel flow.
    pub fn torque_at(&self, engine_speed_rpm: f64, throttle_deg: f64) -> f64 {
        self.at(&self.torque_nm, engine_speed_rpm, throttle_deg)
    }

    /// Fuel flow (kg/h).
    pub fn fuel_flow_at(&self, engine_speed_rpm: f64, throttle_deg: f64) -> f64 {
        self.at(&self.fuel_flow_kgph, engine_speed_rpm, throttle_deg)
    }

    /// Brake specific fuel consumption (g/kWh); `None` where there is no power.
    pub fn bsfc_gpkwh(&self, engine_speed_rpm: f64, throttle_deg: f64) -> Option<f64> {
        let kilowatts = self.torque_at(engine_speed_rpm, throttle_deg) * engine_speed_rpm * TAU / 60.0 / 1e3;
        (kilowatts > 0.0).then(|| 1e3 * self.fuel_flow_at(engine_speed_rpm, throttle_deg) / kilowatts)
    }

    /// The greatest torque (N m) within the limit of the fuel flow, and its throttle (degrees).
    pub fn greatest_torque(&self, engine_speed_rpm: f64) -> (f64, f64) {
        let most = self
            .flow_limit
            .map_or(f64::INFINITY, |limit| limit.at(engine_speed_rpm));
        let mut best = (0.0, self.throttle_deg[0]);
        let mut offer = |throttle: f64| {
            let torque = self.torque_at(engine_speed_rpm, throttle);
            if torque > best.0 {
                best = (torque, throttle);
            }
        };
        // Torque and flow are linear between two throttle openings, so the greatest torque is at an end or on the limit.
        for pair in self.throttle_deg.windows(2) {
            let flows = [pair[0], pair[1]].map(|throttle| self.fuel_flow_at(engine_speed_rpm, throttle));
            for (throttle, flow) in pair.iter().zip(flows) {
                if flow <= most {
                    offer(*throttle);
                }
            }
            if (flows[0] <= most) != (flows[1] <= most) {
                // Slightly inside the limit, so that rounding does not exceed it.
                let share = (most - flows[0]) / (flows[1] - flows[0]);
                let inside = if flows[0] <= most { -1e-12 } else { 1e-12 };
                offer(pair[0] + (share + inside) * (pair[1] - pair[0]));
            }
        }
        best
    }

    /// Engine speeds (rpm) and the greatest torque at them (N m).
    pub fn full_throttle_curve(&self) -> (Vec<f64>, Vec<f64>) {
        let mut speeds = Vec::new();
        for pair in self.engine_speed_rpm.windows(2) {
            speeds.extend((0..STEPS).map(|i| pair[0] + (pair[1] - pair[0]) * i as f64 / STEPS as f64));
        }
        speeds.extend(self.engine_speed_rpm.last());
        let torques = speeds.iter().map(|rpm| self.greatest_torque(*rpm).0).collect();
        (speeds, torques)
    }

    /// The least throttle (degrees) that gives a torque (N m); if none does, that of the greatest torque.
    pub fn throttle_for(&self, engine_speed_rpm: f64, torque_nm: f64) -> f64 {
        for pair in self.throttle_deg.windows(2) {
            let [low, high] = [pair[0], pair[1]].map(|throttle| self.torque_at(engine_speed_rpm, throttle));
            if low >= torque_nm {
                return pair[0];
            }
            if high >= torque_nm {
                return pair[0] + (torque_nm - low) / (high - low) * (pair[1] - pair[0]);
            }
        }
        self.greatest_torque(engine_speed_rpm).1
    }
}
