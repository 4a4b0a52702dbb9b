//! The electric half of a hybrid: motor-generators on the crank (MGU-K) and on the turbocharger (MGU-H), the store, and the
//! energy flows that the rules allow.

mod read;
#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

/// The motor-generator on the crank.
#[derive(Clone, Debug, PartialEq)]
pub struct MguK {
    /// Its turns per turn of the crank.
    pub ratio: f64,
    /// Its speeds, ascending (rpm).
    pub speed_rpm: Vec<f64>,
    /// Greatest torque at those speeds, driving or generating (N m). It is linear between them and zero beyond the last.
    pub torque_nm: Vec<f64>,
    /// Greatest power, driving or generating (W).
    pub power_w: f64,
    /// Efficiency from the store to the shaft.
    pub motor_efficiency: f64,
    /// Efficiency from the shaft to the store.
    pub generator_efficiency: f64,
}

impl MguK {
    /// The same with its torque at every speed and its power multiplied by `share`.
    pub fn scaled(&self, share: f64) -> Self {
        Self {
            torque_nm: self.torque_nm.iter().map(|torque| share * torque).collect(),
            power_w: share * self.power_w,
            ..self.clone()
        }
    }

    /// The greatest power at its shaft (W), driving or generating, at a speed of the crank (rpm).
    pub fn power_at(&self, crank_rpm: f64) -> f64 {
        let rpm = self.ratio * crank_rpm;
        let after = self.speed_rpm.partition_point(|s| *s <= rpm);
        let torque = if after == 0 {
            self.torque_nm[0]
        } else if after == self.speed_rpm.len() {
            // At the last speed itself there still is torque.
            if rpm > self.speed_rpm[after - 1] {
                0.0
            } else {
                self.torque_nm[after - 1]
            }
        } else {
            let share =
                (rpm - self.speed_rpm[after - 1]) / (self.speed_rpm[after] - self.speed_rpm[after - 1]);
            self.torque_nm[after - 1] + share * (self.torque_nm[after] - self.torque_nm[after - 1])
        };
        (torque * rpm * TAU / 60.0).min(self.power_w)
    }
}

/// The motor-generator on the turbocharger. It generates on straights; below the speed from which it does, it may drive the compressor
/// as a motor, and the engine gives more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MguH {
    /// Greatest power out (W).
    pub generator_w: f64,
    /// Loss of power at the crank from that (W).
    pub generator_cost_w: f64,
    /// Least speed at which it generates (m/s),
    pub from_speed_mps: f64,
    /// and greatest acceleration of the car at which it does (m/s^2).
    pub to_ax_mps2: f64,
    /// Power out of the store while it drives the compressor (W), zero for a machine that only generates,
    pub motor_w: f64,
    /// and what the engine gives more at the crank for it (W): `P_add` of the thesis's (4.8), with all of its power on the compressor.
    pub motor_gain_w: f64,
}

impl MguH {
    /// Its power out (W) with the turbine's flow all on the generator, by the fuel flow as a share of its greatest: the thesis's
    /// (4.9) with a closed waste-gate.
    pub fn generated_w(&self, flow_share: f64) -> f64 {
        self.generator_w * flow_share
    }

    /// Whether it drives the compressor.
    pub fn motors(&self) -> bool {
        self.motor_w > 0.0
    }
}

/// The store.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Store {
    /// Energy at a state of charge of one (J). A lap in a study may need more: the study then says how large the store must be.
    pub capacity_j: f64,
    /// State of charge at the start of a lap.
    pub start_soc: f64,
    /// Whether accounts let the charge pass one, as published ones do; else a full store takes no more, and the friction brakes
    /// take what it leaves. Studies set it; no car's file has it.
    pub overflow: bool,
}

impl Store {
    /// What it takes beyond the charge at the start of a lap (J).
    pub fn room_j(&self) -> f64 {
        /// Stands for no limit.
        const ENDLESS_J: f64 = 1e12;
        if self.overflow {
            ENDLESS_J
        } else {
            (1.0 - self.start_soc) * self.capacity_j
        }
    }
}

/// Energies that the rules allow in a lap.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyRules {
    /// From the store to the MGU-K (J).
    pub deployed_j: Option<f64>,
    /// From the MGU-K to the store (J).
    pub harvested_k_j: Option<f64>,
    /// Whether the deployment is that of a lap of Le Mans, to be scaled by the circuit's length.
    pub scaled: bool,
}

/// Length of a lap of Le Mans (m).
const LE_MANS_M: f64 = 13_626.0;
/// Factor on the energy per metre for other circuits.
const ELSEWHERE: f64 = 1.55;

impl EnergyRules {
    /// Formula One's of 2014: 4 MJ from the store to the MGU-K and 2 MJ back.
    pub const FORMULA_ONE: Self = Self {
        deployed_j: Some(4.0e6),
        harvested_k_j: Some(2.0e6),
        scaled: false,
    };

    /// The class with this energy (J) for a lap of Le Mans.
    pub fn le_mans(deployed_j: f64) -> Self {
        Self {
            deployed_j: Some(deployed_j),
            harvested_k_j: None,
            scaled: true,
        }
    }

    /// What may be deployed in a lap of `length_m` (J): a class of Le Mans scales by `length x 1.55 / 13.626 km`.
    pub fn deployed_on(&self, length_m: f64) -> Option<f64> {
        let share = if self.scaled {
            length_m * ELSEWHERE / LE_MANS_M
        } else {
            1.0
        };
        self.deployed_j.map(|j| j * share)
    }
}

/// The electric half of a hybrid.
#[derive(Clone, Debug, PartialEq)]
pub struct Hybrid {
    /// On the crank.
    pub mgu_k: MguK,
    /// On the turbocharger, if there is one.
    pub mgu_h: Option<MguH>,
    /// The store.
    pub store: Store,
    /// The rules.
    pub rules: EnergyRules,
}

impl Hybrid {
    /// The same with a store whose charge may pass one.
    pub fn with_overflow(&self) -> Self {
        let store = Store {
            overflow: true,
            ..self.store
        };
        Self {
            store,
            ..self.clone()
        }
    }
}

/// How braking is shared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// Power into the generator's shaft (W).
    pub generator_w: f64,
    /// Power into the hydraulic brakes (W).
    pub hydraulic_w: f64,
}

impl MguK {
    /// Shares braking between generator and hydraulics: the generator takes as much as it can. `shed_w` (W) is the power that the
    /// wheels lose, and `efficiency` the share of it that reaches the crank.
    pub fn blend(&self, shed_w: f64, crank_rpm: f64, efficiency: f64) -> Blend {
        let generator_w = (shed_w * efficiency).clamp(0.0, self.power_at(crank_rpm));
        Blend {
            generator_w,
            hydraulic_w: shed_w.max(0.0) - generator_w / efficiency,
        }
    }
}
