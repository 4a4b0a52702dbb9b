//! lapswarm evaluates whole swarms of race cars at once.

pub mod config;
pub mod error;
pub mod evaluate;
pub mod line;
pub mod random;
pub mod report;
pub mod scalar;
pub mod simulate;
pub mod study;
pub mod swarm;
pub mod telemetry;
pub mod track;
pub mod vehicle;

pub use error::{Error, Result};
