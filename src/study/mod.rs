//! The studies that users run.

pub mod envelope;
pub mod identify;
pub mod run_folder;
