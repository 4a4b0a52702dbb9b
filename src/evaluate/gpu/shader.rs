//! Composition of the kernels from the fragments under `shaders/`, one list per kernel, and the generated parts:
//! constants, and the loaders, which read shared figures from one table and varying figures from the candidate's row.

#[cfg(feature = "vehicle")]
mod physics;

#[cfg(feature = "vehicle")]
pub use physics::*;

const ELEMENTARY: &str = include_str!("../../../shaders/elementary.wgsl");
const WHEELS_SIDE_BY_SIDE: &str = include_str!("../../../shaders/wheels_side_by_side.wgsl");
const WHEELS_BY_AXLE: &str = include_str!("../../../shaders/wheels_by_axle.wgsl");
const RANDOM: &str = include_str!("../../../shaders/random.wgsl");
const SWARM: &str = include_str!("../../../shaders/swarm.wgsl");
const SWARM_GATHER: &str = include_str!("../../../shaders/swarm_gather.wgsl");
const TEST_PROBLEMS: &str = include_str!("../../../shaders/test_problems.wgsl");
const LINE_SWARM: &str = include_str!("../../../shaders/line_swarm.wgsl");

/// How a kernel goes through the wheels of a car. Results have the same bits either way where a device rounds as the processor does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WheelOrder {
    /// All four at once, with the car's figures read once: for software drivers.
    SideBySide,
    /// The two of an axle at once, with figures read where they are used: for graphics processors, whose registers are few.
    ByAxle,
}

/// Our own `sin`, `cos`, `atan` and `exp` of as many figures at once as a kernel takes wheels. Kernels without a car take four.
pub fn elementary(wheels: WheelOrder) -> String {
    let width = match wheels {
        WheelOrder::SideBySide => WHEELS_SIDE_BY_SIDE,
        WheelOrder::ByAxle => WHEELS_BY_AXLE,
    };
    [width, "\n", ELEMENTARY].concat()
}

/// Philox, the twin of [`crate::random`].
pub fn random() -> &'static str {
    RANDOM
}

/// Source of the kernels that move a swarm; entry points `scatter`, `learn` and `advance`.
pub fn swarm() -> String {
    [&elementary(WheelOrder::SideBySide), RANDOM, SWARM].concat()
}

/// Source of the kernel that copies a few particles' positions; entry point `gather`.
pub fn swarm_gather() -> String {
    SWARM_GATHER.to_owned()
}

/// Source of the kernels between a swarm on the device and the kernels of lines and laps; entry points `figures_of_positions` and
/// `objectives_of_results`.
pub fn line_swarm() -> String {
    [&elementary(WheelOrder::SideBySide), LINE_SWARM].concat()
}

/// Source of the kernel of the test problem of that number among
/// [`crate::swarm::problems::NAMES`]; entry point `test_problem`.
pub fn test_problem(number: u32, factor: f32) -> String {
    let constants =
        format!("\n// Generated.\nconst PROBLEM: u32 = {number}u;\nconst FACTOR: f32 = {factor:e}f;\n\n");
    [&elementary(WheelOrder::SideBySide), &constants, TEST_PROBLEMS].concat()
}
