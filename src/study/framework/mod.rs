//! What all studies share: the shape of a study, its life from settings to results, its state, its folder, its record.

mod coefficients;
mod inputs;
pub mod journal;
mod life;
mod manifest;
pub mod memory;
mod plan;
mod record;
pub mod setups;
pub(in crate::study) mod shared_settings;
pub mod state_file;
mod study;
mod tyres;

pub use coefficients::{Coefficients, Mutated, Scheduled};
pub use inputs::{InputFiles, Inputs};
pub use life::{Answer, Finished, Request, TIME_LIMIT, solve_unobserved, write_results};
pub(in crate::study) use life::{TimeLimit, resumed_or_new};
pub use manifest::{Manifest, write_json, write_study};
pub use plan::Plan;
pub use record::RunRecord;
pub(in crate::study) use record::Watch;
pub use study::{AnyStudy, Entry, Figures, Head, Progress, Searched, Solved, State, Study, Subject, Work};
pub use tyres::{tyre_view, with_tyres};
