//! lapswarm evaluates whole swarms of race cars at once.
//!
//! A [`evaluate::Problem`] names bounded decision variables and objectives, an [`evaluate::Evaluator`] scores whole
//! populations of candidates of it, and a [`swarm::Optimiser`] is asked for candidates and told what they are worth.
//! Evaluators come in three kinds that can stand in for one another: `f64` on the processor (the reference), `f32`
//! lanes on the processor, and WGSL kernels on any graphics processor.
//!
//! | | |
//! |---|---|
//! | [`vehicle`] | the car: tyres, body, loads, aero; written once over a [`scalar::Real`], with a WGSL twin in `shaders/` |
//! | [`track`], [`telemetry`] | circuits and logs, as read from files |
//! | [`simulate`] | a driver who takes a car round a circuit and logs it |
//! | [`mod@line`], [`optimum`] | racing lines, the point-mass lap on them, and their exact optima |
//! | [`evaluate`], [`swarm`] | problems and their evaluators; optimisers |
//! | [`study`], [`report`] | what users run, and the pictures and tables that it writes |
//!
//! Which car drove the bundled lap? A short search and no polish:
//!
//! ```no_run
//! use lapswarm::study::identify::{IdentifySettings, search, set_up};
//! use std::ops::ControlFlow;
//!
//! let settings = IdentifySettings {
//!     population: Some(32),
//!     iterations: Some(3),
//!     polish: false,
//!     ..IdentifySettings::default()
//! };
//! let setup = set_up(&settings)?;
//! let outcome = search(&settings, &setup, |_| ControlFlow::Continue(()))?;
//! let unknowns = &setup.replay.problem.variables;
//! for (unknown, value) in unknowns.iter().zip(&outcome.swarm_candidate) {
//!     println!("{} = {value:.4} {}", unknown.name, unknown.unit);
//! }
//! # Ok::<(), lapswarm::Error>(())
//! ```

#![warn(missing_docs)]

pub mod config;
pub mod error;
pub mod evaluate;
pub mod line;
pub mod optimum;
pub mod parity;
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
