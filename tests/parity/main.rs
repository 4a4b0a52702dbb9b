//! The single-precision backends against each other and against the `f64` reference, in four layers: elementary
//! functions, one derivative and one Runge-Kutta step, whole laps, and how the work is cut.
//!
//! A machine without an adapter says so and skips what needs one; `LAPSWARM_REQUIRE_GPU=1` makes that a failure.

#[path = "../common/mod.rs"]
mod common;
mod cutting;
mod device;
mod drive;
mod elementary;
mod energy;
mod lap;
mod line;
mod steady;
mod step;
mod swarm;
mod swarm_lines;
