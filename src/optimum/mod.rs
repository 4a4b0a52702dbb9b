//! Exact optima of racing lines, for reference and for warm starts.
//!
//! Shortest path, squared length and second difference are convex and go to an interior-point solver; curvature and lap
//! time are smooth but for kinks, and are led downhill by gradients in reverse mode.

mod bounds;
mod conic;
mod convex;
mod descent;
mod geometry;
mod lap;
mod objective;
mod point_mass;
#[cfg(test)]
mod tests;
mod time_model;

pub use bounds::{Bounds, RowBound};
pub use conic::Status;
pub use convex::{Optimum, least_gamma, least_squared_length, shortest, spacing_m};
pub use descent::{DescentSettings, Start, descend, fastest, least_curvature, polish_lines};
pub use geometry::LineMap;
pub use lap::{Grip, Limits, Slope};
pub use objective::{LineProblem, Measures, Weights};
pub use point_mass::PointMassLimits;
