//! The studies that users run.

pub mod envelope;
pub mod framework;
pub mod hybrid;
pub mod identify;
pub mod raceline;
mod ranges;
pub mod registry;
mod replayed;
pub mod reproduce;
pub mod run;
pub mod sensitivity;
pub mod surface;
pub mod sweep;
pub mod transient;

pub use ranges::OwnRange;
