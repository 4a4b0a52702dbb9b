//! Racing lines: their shape, the quasi-steady-state lap on them, and the figures that are reported of a line.
//!
//! A line crosses the cross-sections of [`crate::track::CrossSections`] at shares `alpha` of their width. [`kernel`] turns the
//! few numbers that a [`Parametrisation`] gives a line into lengths, curvatures and a lap time, in every scalar; the
//! evaluators of [`crate::evaluate::line`] run it on swarms. Studies report figures of a fine spline through the line's
//! points ([`FineLine`]), checked against the edges of the road ([`check_line`]).

mod check;
mod circuit;
pub mod energy;
mod fine;
mod geometry;
pub mod ground;
pub mod kernel;
mod loads;
mod parametrisation;
mod perpendicular;
mod plan;
mod point_mass;
mod profile;
mod relief;
#[cfg(test)]
mod relief_tests;
mod spline;
mod table;
#[cfg(test)]
mod tests;

pub use check::{CarPlan, Clearance, ON_ROAD_M, RoadEdges, check_line};
pub use fine::{FineLine, fine_m, scale_of};
pub use geometry::{Geometry, geometry};
pub use kernel::{BySection, Within};
pub use loads::LoadTables;
pub(crate) use loads::MOST_LOAD;
pub use parametrisation::Parametrisation;
pub use perpendicular::{Spread, cross_sections_about, shares_across};
pub use plan::{LinePlan, ReliefRow, SectionRow, TERMS};
pub use point_mass::{EnvelopeTable, PointMass, TRACTION_ROOTS, TRACTION_SPEEDS, TRACTION_WIDTH};
pub use profile::{LapProfile, lap_profile, lap_profile_on};
pub use relief::LineRelief;
pub use table::{read_columns, read_line, read_line_apart};
