//! Racing lines: their shape, the point-mass lap on them, and what is reported of a line.
//!
//! A line crosses the cuts of [`crate::track::CrossSections`] at shares `alpha` of their width. [`kernel`] turns the
//! few numbers that a [`Parametrisation`] gives a line into lengths, curvatures and a lap time, in every scalar; the
//! evaluators of [`crate::evaluate::line`] run it on swarms. What a study reports of a line is worked out anew on a
//! fine spline through its points ([`FineLine`]) and checked against the edges of the road ([`check_line`]).

mod check;
pub mod energy;
mod fine;
mod geometry;
pub mod kernel;
mod parametrisation;
mod plan;
mod point_mass;
mod profile;
mod spline;
mod square;
#[cfg(test)]
mod tests;

pub(crate) use check::Polyline;
pub use check::{Clearance, check_line};
pub use fine::FineLine;
pub use geometry::{Geometry, geometry};
pub use parametrisation::Parametrisation;
pub use plan::{LinePlan, SectionRow, TERMS};
pub use point_mass::{LimitTable, PointMass};
pub use profile::{LapProfile, lap_profile};
pub use square::{cuts_about, shares_across};
