//! Forces and fuel flows of engine and motors over speed, as tables that every backend looks up in the same way.

use super::super::point_mass::{ENVELOPE_WIDTH, EnvelopeTable};
use crate::error::{Error, Result};
use crate::scalar::Real;
use crate::vehicle::hybrid::MguH;
use crate::vehicle::powertrain::EngineMap;
use crate::vehicle::{Car, Envelope, EnvelopeRow, Hybrid, Powertrain, Traction};

/// Figures of a car's energy over even steps of the speed squared, those of its [`EnvelopeTable`].
///
/// Each row of a table has the figures at its start, then their rises to its end. Forces are over the car's mass, in m/s^2 at the
/// wheels.
#[derive(Clone, Debug, PartialEq)]
pub struct EnergyTable<S> {
    /// Mass (kg).
    pub mass: S,
    /// Rows per speed squared (s^2/m^2).
    pub rows_per_speed_squared: S,
    /// Mass that is accelerated over that of the car.
    pub rotating: S,
    /// Energy out of the store for each joule at the wheels.
    pub deploy_cost: S,
    /// Energy into the store for each joule at the wheels.
    pub harvest_gain: S,
    /// Force over mass for each joule out of the store, times the length (m^2/s^2/J).
    pub force_per_deployed: S,
    /// Force over mass for each joule of the MGU-K into the store, times the length (m^2/s^2/J).
    pub force_per_harvested: S,
    /// Energy that the MGU-K may put into the store in a lap (J).
    pub harvest_most: S,
    /// What the store takes beyond the charge at the start (J).
    pub store_room: S,
    /// Energy of the MGU-H into the store for each kilogram of fuel (J/kg).
    pub exhaust_gain: S,
    /// Energy that the wheels lack for each joule of the MGU-H, while the engine gives no more.
    pub exhaust_cost: S,
    /// Whether the MGU-H drives the compressor at lower speeds.
    pub assists: bool,
    /// Energy out of the store for each joule at the wheels by that, beyond the MGU-K's,
    pub assist_extra: S,
    /// and the force over mass for each joule out of the store, over the MGU-K's.
    pub assist_share: S,
    /// Speed squared from which the MGU-H generates (m^2/s^2).
    pub exhaust_from: S,
    /// Greatest acceleration at which the MGU-H generates (m/s^2).
    pub exhaust_to_ax: S,
    /// Engine, motor, generator, drag, then their rises.
    pub forces: Vec<S>,
    /// Fuel flow (kg/s) at a load of 0, 1/3, 2/3 and 1, then the rises.
    pub flows: Vec<S>,
    /// What the motor adds to the acceleration (m/s^2), the room that engine and tyres leave for it, what the MGU-H takes from it at
    /// full load as a generator and adds to it as a motor; then their rises.
    pub boosts: Vec<S>,
}

/// Stands for unlimited room (m/s^2); its rises are finite numbers.
const ENDLESS_MPS2: f64 = 1e4;
/// At standstill motors have a torque, but power divided by speed is undefined.
const SLOWEST_MPS: f64 = 1.0;

/// The parts of a car that energy needs: gears, engine map and hybrid drive.
///
/// # Errors
/// [`Error::Input`] for a car that lacks one of them.
pub fn hybrid_parts(car: &Car) -> Result<(&Powertrain, &EngineMap, &Hybrid)> {
    let missing = |place: &str, expected: &str| Error::input(&car.name, place, "none", expected);
    let Some(hybrid) = &car.hybrid else {
        let expected = "a motor-generator and a store, as the bundled car gt_hybrid has";
        return Err(missing("[hybrid]", expected));
    };
    let Some(powertrain) = &car.powertrain else {
        return Err(missing("[powertrain]", "an engine and gears"));
    };
    let Some(engine) = &powertrain.engine else {
        return Err(missing(
            "powertrain.throttle_deg",
            "maps of torque and fuel flow over engine speed and throttle, as the bundled gt_hybrid has",
        ));
    };
    Ok((powertrain, engine, hybrid))
}

impl EnergyTable<f64> {
    /// The tables of `car` on the rows of `table`, which are those of `envelope`; `traction` limits what motor and engine
    /// give together.
    ///
    /// # Errors
    /// [`Error::Input`] for a car without an engine map or without a hybrid drive.
    pub fn new(
        car: &Car,
        envelope: &Envelope,
        traction: &Traction,
        table: &EnvelopeTable<f64>,
    ) -> Result<Self> {
        let (powertrain, engine, hybrid) = hybrid_parts(car)?;
        let mass = car.chassis.mass;
        let radius = car.chassis.radius_rear;
        let k = &hybrid.mgu_k;
        let rows = table.rows.len() / ENVELOPE_WIDTH;
        let top_ratio = powertrain.gear_ratios[powertrain.gear_ratios.len() - 1] * powertrain.final_drive;
        let last: EnvelopeRow = envelope.rows()[envelope.rows().len() - 1];
        let h = hybrid.mgu_h;
        let (mut forces, mut flows, mut boosts) = (Vec::new(), Vec::new(), Vec::new());
        for knot in 0..=rows {
            let v = (table.top * knot as f64 / rows as f64).sqrt();
            let gear = powertrain.gear(v, radius);
            let rpm = gear.map_or(v / radius * 60.0 / std::f64::consts::TAU * top_ratio, |g| {
                g.engine_speed_rpm
            });
            let drive = gear.map_or(0.0, |g| g.force_n / mass);
            // An envelope has no drive at its last speed. The tables take the drive just below it.
            let driven = if knot == rows {
                last.ax_drive_mps2
            } else {
                envelope.at(v).ax_drive_mps2
            };
            let drag = envelope.at(v).drag_mps2;
            let slow = v.max(SLOWEST_MPS);
            let shaft = k.power_at(rpm * slow / v.max(1e-9));
            let motor = shaft * powertrain.efficiency / (mass * slow);
            let generator = shaft / powertrain.efficiency / (mass * slow);
            forces.push([drive, motor, generator, drag]);
            let most_nm = powertrain.torque_at(rpm);
            flows.push(std::array::from_fn::<f64, 4, _>(|i| {
                let throttle = engine.throttle_for(rpm, most_nm * i as f64 / 3.0);
                engine.fuel_flow_at(rpm, throttle) / 3600.0
            }));
            boosts.push([
                motor / powertrain.rotating_mass_factor,
                (traction.at(v) - driven).clamp(0.0, ENDLESS_MPS2),
                flows[knot][3],
                h.map_or(0.0, |h| h.motor_gain_w) * powertrain.efficiency
                    / (mass * slow * powertrain.rotating_mass_factor),
            ]);
        }
        let greatest_flow = flows.iter().flatten().fold(0.0, |a: f64, b| a.max(*b));
        let exhaust_gain = h.map_or(0.0, |h| h.generated_w(1.0) / greatest_flow);
        let exhaust_cost = h.map_or(0.0, |h| {
            powertrain.efficiency * h.generator_cost_w / h.generator_w
        });
        for (knot, row) in boosts.iter_mut().enumerate() {
            let slow = (table.top * knot as f64 / rows as f64).sqrt().max(SLOWEST_MPS);
            let per_flow = exhaust_cost * exhaust_gain / (mass * slow * powertrain.rotating_mass_factor);
            row[2] *= per_flow;
        }
        let deploy_cost = 1.0 / (k.motor_efficiency * powertrain.efficiency);
        let motor = h.filter(MguH::motors);
        let assist_cost = motor.map_or(deploy_cost, |h| {
            h.motor_w / (h.motor_gain_w * powertrain.efficiency)
        });
        let harvest_gain = k.generator_efficiency * powertrain.efficiency;
        Ok(Self {
            mass,
            rotating: powertrain.rotating_mass_factor,
            rows_per_speed_squared: table.rows_per_speed_squared,
            deploy_cost,
            harvest_gain,
            force_per_deployed: 1.0 / (mass * deploy_cost),
            force_per_harvested: 1.0 / (mass * harvest_gain),
            harvest_most: hybrid.rules.harvested_k_j.unwrap_or(1e12),
            store_room: hybrid.store.room_j(),
            exhaust_gain,
            exhaust_cost,
            assists: motor.is_some(),
            assist_extra: assist_cost - deploy_cost,
            assist_share: deploy_cost / assist_cost,
            exhaust_from: h.map_or(1e9, |h| h.from_speed_mps.powi(2)),
            exhaust_to_ax: h.map_or(0.0, |h| h.to_ax_mps2),
            forces: with_rises(&forces),
            flows: with_rises(&flows),
            boosts: with_rises(&boosts),
        })
    }

    /// The tables in the precision that the scalar `R` stores tables in.
    pub fn stored<R: Real>(&self) -> EnergyTable<R::Storage> {
        let all = |table: &[f64]| table.iter().map(|x| R::store(*x)).collect();
        EnergyTable {
            mass: R::store(self.mass),
            rotating: R::store(self.rotating),
            rows_per_speed_squared: R::store(self.rows_per_speed_squared),
            deploy_cost: R::store(self.deploy_cost),
            harvest_gain: R::store(self.harvest_gain),
            force_per_deployed: R::store(self.force_per_deployed),
            force_per_harvested: R::store(self.force_per_harvested),
            harvest_most: R::store(self.harvest_most),
            store_room: R::store(self.store_room),
            exhaust_gain: R::store(self.exhaust_gain),
            exhaust_cost: R::store(self.exhaust_cost),
            assists: self.assists,
            assist_extra: R::store(self.assist_extra),
            assist_share: R::store(self.assist_share),
            exhaust_from: R::store(self.exhaust_from),
            exhaust_to_ax: R::store(self.exhaust_to_ax),
            forces: all(&self.forces),
            flows: all(&self.flows),
            boosts: all(&self.boosts),
        }
    }
}

/// Rows of the figures at each knot but the last and their rises to the next.
fn with_rises<const N: usize>(knots: &[[f64; N]]) -> Vec<f64> {
    let mut table = Vec::with_capacity(2 * N * knots.len());
    for pair in knots.windows(2) {
        table.extend(pair[0]);
        table.extend((0..N).map(|i| pair[1][i] - pair[0][i]));
    }
    table
}
