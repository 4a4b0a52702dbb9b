//! The hybrid: where every joule goes on a lap, and what it buys.

mod scenario;
mod settings;
mod setup;

pub use scenario::{ReportedLap, Scenario, drive, published};
pub use settings::{FreePart, HYBRID_OBJECTIVES, HybridStudySettings};
pub use setup::{HybridSetup, set_up};
