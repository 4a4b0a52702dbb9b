// The parts that the replay kernels share: the work of a dispatch, the layout of figures between dispatches, and the sums of
// errors. The constants NORM and WORKGROUP are generated.

// The work of a dispatch; twin of `Stretch` in `src/evaluate/replay/gpu.rs`.
struct Stretch {
    // Candidates in this batch, and the distance between their rows in the buffers.
    candidates: u32,
    stride: u32,
    // Windows in this batch, and the first of them.
    windows: u32,
    first_window: u32,
    // The first sample within every window, and how many.
    first_sample: u32,
    samples: u32,
    substeps: u32,
    step: f32,
}

@group(0) @binding(0) var<uniform> stretch: Stretch;

// Number of samples, and of windows, that are summed before they are added to the total; twin of `BLOCK`.
const BLOCK: u32 = 64u;

fn joined(sum: vec4<f32>, term: vec4<f32>) -> vec4<f32> {
    if NORM == NORM_INFINITY {
        return max(sum, term);
    }
    return sum + term;
}

// Where the progress buffer holds a figure: planes of 6 states, 4 totals and the drives flag; in each, one row of
// candidates per window.
fn place_of(plane: u32, window: u32, candidate: u32) -> u32 {
    return (plane * stretch.windows + window) * stretch.stride + candidate;
}
