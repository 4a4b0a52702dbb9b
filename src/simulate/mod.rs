//! Simulated driving: a driver takes the 4DOF car round a circuit, and sensors log it.

mod driver;
mod lap;
mod sensors;
mod speed_plan;

pub use driver::{CarKnowledge, Drive, DriverSettings, drive, drive_planned};
pub use lap::{SimulateSettings, simulate_lap};
pub use sensors::{SensorSettings, distort};
pub use speed_plan::SpeedPlan;
