//! Energy on a lap: engine, motor-generators, store and fuel, segment by segment, in every scalar.

mod car;
mod driven;
mod figures;
#[cfg(test)]
mod hill_tests;
pub mod kernel;
mod lap;
mod plan;
mod table;
#[cfg(test)]
mod tests;
mod zones;

pub use car::EnergyCar;
pub use driven::{DrivenLapEnergy, DrivenMoment, MotorPlan, driven_energy};
pub use figures::{EnergyLap, FIGURES, SegmentEnergy};
pub use lap::energy_lap;
pub use plan::{EnergyPlan, GATES, Gates, Mode, ZoneRow};
pub use table::{EnergyTable, hybrid_parts};
pub use zones::{GAP_M, late_bend, zone_starts};
