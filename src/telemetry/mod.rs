//! Logged laps: reading them, bringing them to SI and ISO 8855 signs, and checking that they can be believed.
//!
//! [`Recording`] holds a file as it was logged: named channels, each with its own unit and clock. [`ChannelMap`]
//! says which of them plays which [`Role`]. [`Log`] is what an identification works on: the eleven channels it needs,
//! on one uniform clock, calibrated, cut into laps.
//!
//! ```no_run
//! use lapswarm::telemetry::{ChannelMap, Log, LogOptions};
//!
//! let map = ChannelMap::read("car.toml")?;
//! let log = Log::read("outing.csv", &map, &LogOptions::default())?;
//! println!("{} samples, {} laps", log.samples(), log.laps.len());
//! # Ok::<(), lapswarm::Error>(())
//! ```

mod audit;
mod build;
mod calibrate;
mod calibration;
mod channel_list;
mod channel_map;
#[cfg(test)]
mod conditioned_tests;
mod csv_headed;
mod csv_native;
mod delays;
mod derived;
mod driven;
mod export;
mod expression;
mod laps;
mod log;
mod make_log;
mod motec_csv;
mod motec_ld;
mod outing;
mod path;
mod positions;
mod read;
mod recording;
mod resample;
mod role;
mod ros;
mod statistics;
#[cfg(test)]
mod synthetic;
mod table;
mod text;
mod units;
mod vbox;

pub use calibration::{Calibration, CalibrationOptions, Finding, FindingKind, Switch};
pub use channel_list::{ChannelList, ListedChannel, Missing};
pub use channel_map::{Axle, ChannelEntry, ChannelMap, Mapped};
pub use csv_native::{COLUMNS, NativeFormat, write_native};
pub use driven::DrivenLap;
pub use export::{LapChannel, LapLabels, SampledLap};
pub use expression::Expression;
pub use laps::Lap;
pub use log::{Log, LogOptions, Steering};
pub use outing::Outing;
pub use recording::{Channel, Clock, Format, Metadata, Recording, Unreadable};
pub use role::Role;
pub use units::{Quantity, Unit};
