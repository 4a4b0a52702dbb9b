//! A point mass with engine, motors and store.

use super::super::point_mass::{EnvelopeTable, PointMass};
use super::table::{EnergyTable, hybrid_parts};
use crate::error::Result;
use crate::vehicle::{Car, Envelope, Hybrid, MassLimits, Traction};

/// A car for laps with energy.
#[derive(Clone, Debug)]
pub struct EnergyCar {
    /// Its name.
    pub name: String,
    /// The point mass.
    pub point_mass: PointMass,
    /// The table of its envelope.
    pub envelope_table: EnvelopeTable<f64>,
    /// The tables of its energy.
    pub table: EnergyTable<f64>,
    /// Its hybrid drive.
    pub hybrid: Hybrid,
    /// Density of its fuel (kg/l).
    pub fuel_density_kgpl: f64,
    /// The car that it was made from.
    pub car: Car,
    traction: Traction,
}

impl EnergyCar {
    /// `car` within `envelope` and `traction`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] for a car without engine map or hybrid drive, or limits that cannot be.
    pub fn new(car: Car, envelope: Envelope, traction: Traction, ellipse_exponent: f64) -> Result<Self> {
        let wheelbase = car.chassis.cg_to_front + car.chassis.cg_to_rear;
        let point_mass = PointMass {
            ellipse_exponent,
            max_steer_rad: Some(car.max_steer_rad),
            max_steer_rate_radps: Some(car.max_steer_rate_radps),
            rotating_mass_factor: car.rotating_mass_factor(),
            ..PointMass::new(envelope, wheelbase)
        };
        Self::of(car, point_mass, traction)
    }

    /// `car` as this point mass, within `traction`.
    ///
    /// # Errors
    /// As [`EnergyCar::new`].
    pub fn of(car: Car, point_mass: PointMass, traction: Traction) -> Result<Self> {
        let (_, engine, hybrid) = hybrid_parts(&car)?;
        let (fuel_density_kgpl, hybrid) = (engine.fuel_density_kgpl, hybrid.clone());
        let envelope_table = point_mass.table()?;
        let table = EnergyTable::new(&car, &point_mass.envelope, &traction, &envelope_table)?;
        Ok(Self {
            name: car.name.clone(),
            fuel_density_kgpl,
            point_mass,
            envelope_table,
            table,
            hybrid,
            traction,
            car,
        })
    }

    /// Another car on the same roads, within other limits.
    fn with(&self, car: Car, envelope: Envelope, traction: Traction) -> Result<Self> {
        let point_mass = PointMass {
            envelope,
            ..self.point_mass.clone()
        };
        Self::of(car, point_mass, traction)
    }

    /// The same car with another hybrid drive.
    ///
    /// # Errors
    /// As [`EnergyCar::new`].
    pub fn with_hybrid(&self, hybrid: Hybrid) -> Result<Self> {
        let mut car = self.car.clone();
        car.hybrid = Some(hybrid);
        self.with(car, self.point_mass.envelope.clone(), self.traction.clone())
    }

    /// The same car with another mass (kg), within the limits that it has then.
    ///
    /// # Errors
    /// As [`EnergyCar::new`].
    pub fn with_mass(&self, mass_kg: f64, limits: &MassLimits) -> Result<Self> {
        let own = (&self.point_mass.envelope, &self.traction);
        let (envelope, traction) = limits.carry(own, self.car.chassis.mass, mass_kg)?;
        let mut car = self.car.clone();
        car.chassis.mass = mass_kg;
        self.with(car, envelope, traction)
    }

    /// The same car with torque and fuel flow of the engine multiplied by `share` at every engine speed, within its traction.
    ///
    /// # Errors
    /// As [`EnergyCar::new`].
    pub fn with_engine(&self, share: f64) -> Result<Self> {
        let coasting = 1.0 - 1.0 / self.table.rotating;
        let mut car = self.car.clone();
        if let Some(powertrain) = &mut car.powertrain {
            *powertrain = powertrain.scaled(share);
        }
        let own = &self.point_mass.envelope;
        let envelope = own.with_rows(own.name(), &|limits, row| {
            let swept = limits.straight_traction().filter(|_| !std::ptr::eq(limits, own));
            let traction = swept.unwrap_or_else(|| self.traction.clone());
            crate::vehicle::EnvelopeRow {
                ax_drive_mps2: (row.ax_drive_mps2 * share + coasting * row.drag_mps2 * (1.0 - share))
                    .min(traction.at(row.v_mps)),
                ..*row
            }
        })?;
        self.with(car, envelope, self.traction.clone())
    }

    /// The figures of gates that kernels read.
    pub fn gate_figures(&self, gates: &super::Gates) -> [f64; super::GATES] {
        let store = &self.hybrid.store;
        gates.figures(self.point_mass.wheelbase_m, store.capacity_j, store.start_soc)
    }
}
