//! Identification: which car drove this lap?

mod polish;
mod settings;
mod setup;

pub use polish::{Polished, polish};
pub use settings::{
    Algorithm, BackendChoice, FreeParameter, IdentifySettings, ObjectiveChoice, parse_algorithm,
    parse_backend, parse_norm, parse_objective,
};
pub use setup::{Setup, cost_unit, lap_format, load_circuit, set_up};
