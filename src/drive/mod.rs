//! A driver takes the 4DOF car round a line: path, plan of speeds, driver and car as one kernel over the scalar, for one lap
//! in `f64` that is recorded ([`drive`]) or for whole populations of set-ups ([`crate::evaluate::drive`]).
//!
//! A car's position is kept relative to the path, in the frame of the last sample that it passed. These figures are a few metres
//! however long the lap is, so `f32` rounds them by a ten-millionth of a metre.

mod cornering;
pub mod driver;
pub mod kernel;
mod path;
mod plan;
mod record;
pub mod relief;
mod road;
mod settings;

pub use cornering::{CORNERING_WIDTH, CorneringMap, SHARES as CORNERING_SHARES, SPEEDS as CORNERING_SPEEDS};
pub use path::{Pose, Row, View, frame_at, look};
pub use plan::SpeedPlan;
pub use record::{Drive, Lost, MotorTorque, drive, drive_planned, drive_until_lost, drive_with_motor};
pub use road::{Course, FRONT_CELLS, Line, PATH_WIDTH, PLAN_REACH_M, Road};
pub use settings::DriverSettings;
