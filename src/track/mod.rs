//! Circuits: centrelines with curvature, widths and named sections.
//!
//! A circuit is built from a table of curvature against station ([`CurvatureTable`]), read from a
//! TOML file ([`Circuit::load`]) or taken from the ones that come with the crate
//! ([`Circuit::bundled`]). Curvature, heading and position of a [`Circuit`] agree with one another
//! to rounding, so a car that follows the curvature follows the positions.

mod circuit;
mod cross_sections;
mod from_curvature;
mod load;

pub use circuit::{Circuit, Corner, Projection, Section};
pub use cross_sections::CrossSections;
pub use from_curvature::{Closure, CurvatureRow, CurvatureTable};
pub use load::BUNDLED;

#[cfg(test)]
mod tests;
