//! `[hybrid]` of a car's file.

use super::{EnergyRules, Hybrid, MguH, MguK, Store};
use crate::config::Table;
use crate::error::Result;

impl Hybrid {
    /// Reads `[hybrid]`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming line and field.
    pub fn from_table(table: &Table<'_>) -> Result<Self> {
        let k = table.required_table("mgu_k")?;
        let mgu_k = read_mgu_k(&k)?;
        k.finish()?;
        let mgu_h = match table.table("mgu_h")? {
            Some(h) => {
                let mgu_h = read_mgu_h(&h)?;
                h.finish()?;
                Some(mgu_h)
            }
            None => None,
        };
        let s = table.required_table("store")?;
        let store = Store {
            capacity_j: 1e6 * s.required_number("capacity_mj", 0.01, 1000.0, "MJ")?,
            start_soc: s.number("start_soc", 0.0, 1.0, "")?.unwrap_or(1.0),
            overflow: false,
        };
        s.finish()?;
        let rules = match table.table("rules")? {
            Some(r) => {
                let rules = read_rules(&r)?;
                r.finish()?;
                rules
            }
            None => EnergyRules::default(),
        };
        Ok(Self {
            mgu_k,
            mgu_h,
            store,
            rules,
        })
    }

    /// Writes `[hybrid]` and its tables.
    pub fn to_toml(&self) -> String {
        let k = &self.mgu_k;
        let mut text = format!(
            "[hybrid.mgu_k]\nratio = {:?}\nspeed_rpm = {:?}\ntorque_nm = {:?}\n\
             power_kw = {:?}\nmotor_efficiency = {:?}\ngenerator_efficiency = {:?}\n\n[hybrid.store]\ncapacity_mj = {:?}\n\
             start_soc = {:?}\n",
            k.ratio,
            k.speed_rpm,
            k.torque_nm,
            k.power_w / 1e3,
            k.motor_efficiency,
            k.generator_efficiency,
            self.store.capacity_j / 1e6,
            self.store.start_soc
        );
        if let Some(h) = &self.mgu_h {
            text += &format!(
                "\n[hybrid.mgu_h]\ngenerator_kw = {:?}\ngenerator_cost_kw = {:?}\n\
                 from_speed_mps = {:?}\nto_ax_mps2 = {:?}\n",
                h.generator_w / 1e3,
                h.generator_cost_w / 1e3,
                h.from_speed_mps,
                h.to_ax_mps2
            );
            if h.motors() {
                text += &format!(
                    "motor_kw = {:?}\nmotor_gain_kw = {:?}\n",
                    h.motor_w / 1e3,
                    h.motor_gain_w / 1e3
                );
            }
        }
        let rules = &self.rules;
        if *rules != EnergyRules::default() {
            text += "\n[hybrid.rules]\n";
            if let Some(j) = rules.deployed_j {
                let key = if rules.scaled {
                    "le_mans_mj"
                } else {
                    "deployed_mj_per_lap"
                };
                text += &format!("{key} = {:?}\n", j / 1e6);
            }
            if let Some(j) = rules.harvested_k_j {
                text += &format!("harvested_mj_per_lap = {:?}\n", j / 1e6);
            }
        }
        text
    }
}

fn read_mgu_k(table: &Table<'_>) -> Result<MguK> {
    let speed_rpm = table.numbers("speed_rpm")?.unwrap_or_default();
    let rising = speed_rpm.windows(2).all(|w| w[1] > w[0]);
    if speed_rpm.len() < 2 || speed_rpm[0] < 0.0 || !rising {
        return Err(table.refuse("speed_rpm", "at least two speeds (rpm) that rise from 0 or more"));
    }
    let torque_nm = table.numbers("torque_nm")?.unwrap_or_default();
    if torque_nm.len() != speed_rpm.len() || torque_nm.iter().any(|t| *t < 0.0) {
        let expected = format!("{} torques of 0 N m or more, one per speed", speed_rpm.len());
        return Err(table.refuse("torque_nm", expected));
    }
    let efficiency = |key: &str| -> Result<f64> { Ok(table.number(key, 0.05, 1.0, "")?.unwrap_or(1.0)) };
    Ok(MguK {
        ratio: table.required_number("ratio", 0.05, 100.0, "")?,
        power_w: 1e3 * table.required_number("power_kw", 0.0, 2000.0, "kW")?,
        motor_efficiency: efficiency("motor_efficiency")?,
        generator_efficiency: efficiency("generator_efficiency")?,
        speed_rpm,
        torque_nm,
    })
}

fn read_mgu_h(table: &Table<'_>) -> Result<MguH> {
    let motor_kw = table.number("motor_kw", 0.1, 1000.0, "kW")?;
    let gain_kw = table.number("motor_gain_kw", 0.1, 1000.0, "kW")?;
    let mgu_h = MguH {
        generator_w: 1e3 * table.required_number("generator_kw", 0.1, 1000.0, "kW")?,
        generator_cost_w: 1e3
            * table
                .number("generator_cost_kw", 0.0, 1000.0, "kW")?
                .unwrap_or(0.0),
        from_speed_mps: table.number("from_speed_mps", 0.0, 200.0, "m/s")?.unwrap_or(0.0),
        to_ax_mps2: table.number("to_ax_mps2", 0.0, 100.0, "m/s^2")?.unwrap_or(100.0),
        motor_w: 1e3 * motor_kw.unwrap_or(0.0),
        motor_gain_w: 1e3 * gain_kw.unwrap_or(0.0),
    };
    match (motor_kw, gain_kw) {
        (Some(_), None) => Err(table.refuse("motor_gain_kw", "what the engine gives more for motor_kw (kW)")),
        (None, Some(_)) => Err(table.refuse("motor_kw", "what motor_gain_kw takes out of the store (kW)")),
        (Some(_), Some(_)) if mgu_h.from_speed_mps == 0.0 => Err(table.refuse(
            "from_speed_mps",
            "a speed above 0 m/s: below it the machine is a motor, from it on a generator",
        )),
        _ => Ok(mgu_h),
    }
}

fn read_rules(table: &Table<'_>) -> Result<EnergyRules> {
    let mut rules = match table.string("class")? {
        None | Some("none") => EnergyRules::default(),
        Some("formula_one") => EnergyRules::FORMULA_ONE,
        Some("le_mans_8mj") => EnergyRules::le_mans(8.0e6),
        Some(_) => return Err(table.refuse("class", "\"none\", \"formula_one\" or \"le_mans_8mj\"")),
    };
    let classed = rules != EnergyRules::default();
    for key in ["le_mans_mj", "deployed_mj_per_lap", "harvested_mj_per_lap"] {
        let Some(mj) = table.number(key, 0.0, 1000.0, "MJ")? else {
            continue;
        };
        if classed {
            return Err(table.refuse(key, "nothing beside a class, which has its own limits"));
        }
        match key {
            "le_mans_mj" => rules = EnergyRules::le_mans(1e6 * mj),
            "deployed_mj_per_lap" if rules.scaled => {
                return Err(table.refuse(key, "nothing beside le_mans_mj, which says the same"));
            }
            "deployed_mj_per_lap" => rules.deployed_j = Some(1e6 * mj),
            _ => rules.harvested_k_j = Some(1e6 * mj),
        }
    }
    Ok(rules)
}
