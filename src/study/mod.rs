//! The studies that users run.

pub mod envelope;
pub mod identify;
pub mod keeper;
pub mod memory;
pub mod raceline;
pub mod run;
pub mod run_folder;
pub mod sensitivity;
pub mod surface;
pub mod transient;
