//! Reference optima of racing lines, for comparison and for warm starts.
//!
//! Shortest path, squared length and second differences are convex problems, one cone program each. Their optima are exact:
//! global, with a bound that proves it. Curvature, lap time and weighted sums are minimised by sequences of cone programs
//! ([`descend`], [`polish_lines`]), which end at first-order points. Several starts that end in the same place suggest that the
//! point is the optimum.
//!
//! A line is judged at its points. If every cross-section has a variable of its own, curvature may alternate from point to
//! point and gain what no car could. [`LineMap::spline_about`] a smooth line, with two or more points for each control, leaves no
//! room for that. `alpha` as a spline only serves roads whose edges are smooth.

mod bounds;
mod conic;
mod convex;
mod deployment;
mod descent;
mod geometry;
mod lap;
mod mend;
mod objective;
mod point_mass;
mod reference;
#[cfg(feature = "studies")]
mod solver_thread;
#[cfg(test)]
mod tests;
mod tilt;
mod time_model;

pub use bounds::{Bounds, RowBound};
pub use conic::Status;
pub use convex::{Optimum, least_gamma, least_squared_length, shortest, spacing_m};
pub use deployment::{Deployment, DeploymentSearch};
pub use descent::{
    DescentSettings, Start, descend, fastest, minimum_curvature, minimum_curvature_of, polish_lines,
};
pub use geometry::LineMap;
pub use lap::{BendGrip, Grip, GripEnvelope, SegmentBend, Slope};
pub use mend::mended;
pub use objective::{Measures, ReferenceProblem, Weights};
pub use point_mass::PointMassEnvelope;
#[cfg(feature = "studies")]
pub(crate) use reference::within_road;
pub use reference::{OptimumLine, ReferenceSolvers, WeightedLine};
#[cfg(feature = "studies")]
pub(crate) use solver_thread::interruptible;
