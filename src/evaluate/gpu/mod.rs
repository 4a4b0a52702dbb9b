//! The graphics processor: which one, its device, the kernels' sources and the rules they keep.

mod adapter;
mod backend;
mod context;
mod fallback;
pub mod faults;
pub mod lint;
mod pacing;
#[cfg(feature = "vehicle")]
mod planes;
pub mod shader;
mod spread;
#[cfg(feature = "vehicle")]
mod trajectories;
mod tuning;

pub use super::dispatches::DispatchWatch;
pub use adapter::{ADAPTER_VARIABLE, ALL_ADAPTERS, DeviceKind, DeviceSummary, asks_for_all, devices};
pub use backend::{DeviceKernel, GpuBackend, OnDevice};
pub(super) use backend::{is_real, open, would_be};
pub use context::{Binding, GpuContext, Kernel};
pub use fallback::FallbackEvaluator;
pub use pacing::Batching;
#[cfg(feature = "vehicle")]
pub(crate) use pacing::{LOOP_ROUNDS, LanePacing, most_rounds, rounds_of};
#[cfg(feature = "vehicle")]
pub(in crate::evaluate) use planes::{made_ahead, planes};
pub use spread::Spread;
#[cfg(feature = "vehicle")]
pub use trajectories::TrajectoryStretch;
#[cfg(feature = "vehicle")]
pub(crate) use trajectories::{FigurePlanes, Trajectories, TrajectoryKernel, workgroup};
pub use tuning::Tuning;
