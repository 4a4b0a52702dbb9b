//! Identification: which car drove this lap?

mod coordinates;
mod hops;
mod identifiability;
mod page;
mod polish;
mod refine;
mod results;
mod search;
mod settings;
mod setup;
mod state;
mod study_file;

pub use identifiability::{Identifiability, judge};
pub use polish::{Polished, polish};
pub use results::{Summary, summarise, write_results};
pub use search::{
    Front, HistoryRow, Judged, Outcome, Report, Stage, check_swarms, judge_candidate, search, search_from,
    search_with, total_parameter_error,
};
pub use settings::{
    Algorithm, FreeParameter, IdentifySettings, ObjectiveChoice, parse_algorithm, parse_backend, parse_norm,
    parse_objective,
};
pub use setup::{Setup, cost_unit, lap_format, load_circuit, set_up};
pub use state::SearchState;
pub use study_file::write_settings;
