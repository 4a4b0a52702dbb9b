//! The studies that users run.

pub mod identify;
pub mod run_folder;
