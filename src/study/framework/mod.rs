//! What all studies share: the shape of a study, its life from settings to results, its state, its folder, its record.

pub(in crate::study) mod circuit_view;
mod device_faults;
mod inputs;
pub mod journal;
mod life;
pub mod memory;
mod plan;
mod record;
pub mod run_folder;
pub mod state_file;
mod study;

pub use inputs::{InputFiles, Inputs};
pub(in crate::study) use life::resumed_or_new;
pub use life::{Answer, Finished, Request, TIME_LIMIT, solve_unobserved, write_results};
pub use plan::Plan;
pub(in crate::study) use record::Watch;
pub use record::{Losses, RunRecord};
pub use study::{AnyStudy, Entry, Figures, Head, Progress, State, Study, Subject, Work};

pub(in crate::study) use device_faults::DeviceFaults;
