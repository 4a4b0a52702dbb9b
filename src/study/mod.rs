//! The studies that users run.

pub mod envelope;
pub mod hybrid;
pub mod identify;
pub mod raceline;
pub mod run_folder;
