//! The graphics processor: which one, its device, the kernels' sources and the rules they keep.

mod adapter;
mod context;
mod dispatches;
pub mod faults;
pub mod lint;
mod pacing;
pub mod shader;
mod trajectories;

pub use adapter::{ADAPTER_VARIABLE, DeviceKind, DeviceSummary, devices};
pub use context::{Binding, GpuContext, Kernel};
pub use dispatches::DispatchWatch;
pub use pacing::Batching;
pub(crate) use pacing::{LOOP_ROUNDS, LanePacing, rounds_of};
pub use trajectories::TrajectoryStretch;
pub(crate) use trajectories::{Trajectories, TrajectoryKernel, workgroup};
