//! Simulated driving: a driver takes the 4DOF car round a circuit, and sensors log it.

mod lap;
mod sensors;

pub use crate::drive::{CorneringMap, Drive, DriverSettings, SpeedPlan, drive, drive_planned};
pub use lap::{SimulateSettings, Simulated, simulate_lap};
pub use sensors::{SensorSettings, distort};
