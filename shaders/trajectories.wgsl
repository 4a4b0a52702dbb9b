// Twin of `src/evaluate/gpu/trajectories.rs`: candidates that are integrated step by step.
//
// One lane per candidate. A dispatch computes some steps and leaves its state in a buffer for the next, so that no dispatch runs
// long enough for a watchdog to kill it. Results do not depend on how the steps are divided. A car is given as in `replay.wgsl`;
// the other figures of the candidate follow its own. The loaders and the constants WORKGROUP and VARYING are generated.

// The work of a dispatch.
struct TrajectoryStretch {
    // Candidates in this batch, and the distance between their rows in the buffers.
    candidates: u32,
    stride: u32,
    // The first step since the beginning, and how many.
    first_step: u32,
    steps: u32,
}

@group(0) @binding(0) var<uniform> stretch: TrajectoryStretch;
@group(0) @binding(1) var<uniform> base: array<vec4<f32>, BASE_VECTORS>;
@group(0) @binding(2) var<storage, read> figures: array<f32>;
// The figures of a state, one plane of candidates each.
@group(0) @binding(3) var<storage, read_write> progress: array<f32>;

// A figure of the candidate, after those of its car.
fn other_figure(number: u32, candidate: u32) -> f32 {
    return figures[(VARYING + number) * stretch.stride + candidate];
}

fn progress_of(figure: u32, candidate: u32) -> f32 {
    return progress[figure * stretch.stride + candidate];
}

