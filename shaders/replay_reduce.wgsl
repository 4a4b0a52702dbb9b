// Joins the windows' errors per candidate: twin of `ReplayProblem::accumulate`, in single precision. Sums are taken in blocks of
// BLOCK windows, and batches of windows hold whole blocks, so results do not depend on the batches.

@group(0) @binding(1) var<storage, read> progress: array<f32>;
// Planes of 4 errors and the drives flag.
@group(0) @binding(2) var<storage, read_write> results: array<f32>;

@compute @workgroup_size(WORKGROUP)
fn replay_reduce(@builtin(global_invocation_id) id: vec3<u32>) {
    let candidate = id.x;
    if candidate >= stretch.candidates {
        return;
    }
    var total = vec4<f32>(0.0);
    var drives = true;
    if stretch.first_window > 0u {
        total = vec4<f32>(
            results[candidate],
            results[stretch.stride + candidate],
            results[2u * stretch.stride + candidate],
            results[3u * stretch.stride + candidate],
        );
        drives = results[4u * stretch.stride + candidate] != 0.0;
    }
    var block = vec4<f32>(0.0);
    for (var row = 0u; row < stretch.windows; row++) {
        let errors = vec4<f32>(
            progress[place_of(6u, row, candidate)],
            progress[place_of(7u, row, candidate)],
            progress[place_of(8u, row, candidate)],
            progress[place_of(9u, row, candidate)],
        );
        block = joined(block, errors);
        drives = drives && progress[place_of(10u, row, candidate)] != 0.0;
        if (row + 1u) % BLOCK == 0u || row + 1u == stretch.windows {
            total = joined(total, block);
            block = vec4<f32>(0.0);
        }
    }
    results[candidate] = total.x;
    results[stretch.stride + candidate] = total.y;
    results[2u * stretch.stride + candidate] = total.z;
    results[3u * stretch.stride + candidate] = total.w;
    results[4u * stretch.stride + candidate] = select(0.0, 1.0, drives);
}
