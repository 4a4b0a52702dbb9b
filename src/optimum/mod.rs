//! Exact optima of racing lines, for reference and for warm starts.
//!
//! Shortest path, squared length and second difference are convex and go to an interior-point solver; curvature and lap
//! time are smooth but for kinks, and are led downhill by gradients in reverse mode.

mod bounded;
mod bounds;
mod conic;
mod convex;
mod curvature;
mod fastest;
mod geometry;
mod lap;
mod objective;
mod polish;
#[cfg(test)]
mod tests;

pub use bounded::{Budget, Ending};
pub use bounds::{Bounds, RowBound};
pub use conic::Status;
pub use convex::{Optimum, least_gamma, least_squared_length, shortest, spacing_m};
pub use curvature::least_curvature;
pub use fastest::{FastestSettings, fastest};
pub use geometry::LineMap;
pub use lap::{Grip, Limits, Slope};
pub use objective::{LineProblem, Measures, Weights};
pub use polish::{Polished, Start, polish_lines};
