//! The studies that users run.

pub mod identify;
