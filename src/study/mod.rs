//! The studies that users run.

mod circuit_view;
pub mod compare;
mod device_faults;
pub mod envelope;
pub mod hybrid;
pub mod identify;
pub mod journal;
pub mod keeper;
pub mod memory;
pub mod raceline;
pub mod run;
pub mod run_folder;
pub mod sensitivity;
pub mod surface;
pub mod sweep;
pub mod transient;
