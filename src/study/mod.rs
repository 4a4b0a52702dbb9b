//! The studies that users run.

pub mod compare;
pub mod envelope;
pub mod identify;
pub mod raceline;
pub mod run_folder;
pub mod sensitivity;
