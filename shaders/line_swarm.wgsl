// Exchange between a swarm on the device and the kernels of lines and of laps with energy. Twin of
// `src/evaluate/line/gpu/exchange.rs`. The swarm's rows are in blocks of particles, the kernels' in planes of candidates.

struct Exchange {
    // The first particle of the batch, and how many it has.
    first: u32,
    candidates: u32,
    // Distance between the planes.
    stride: u32,
    figures: u32,
    // Rows of a block of positions, and of objectives.
    rows: u32,
    objectives: u32,
    // What stands in the place of an objective that is no number.
    failed: f32,
}

// A figure is `lower + range * position`, an objective a result, or its root, over `range`.
struct Scaled {
    lower: f32,
    range: f32,
    // Its row among the positions, or its place among the results.
    row: u32,
    root: u32,
}

@group(0) @binding(0) var<uniform> exchange: Exchange;
@group(0) @binding(1) var<storage, read> scaled: array<Scaled>;
// Positions or results, then figures or objectives.
@group(0) @binding(2) var<storage, read> given: array<f32>;
@group(0) @binding(3) var<storage, read_write> taken: array<f32>;

const BLOCK: u32 = 64u;
// Objectives of this size and more say why a particle failed.
const FAILED: f32 = 3.40277175e38;

fn place(who: u32, width: u32, k: u32) -> u32 {
    return (who / BLOCK * width + k) * BLOCK + who % BLOCK;
}

fn candidate_of(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.y * groups.x * BLOCK + id.x;
}

// A slice of a candidate's figures: along the third dimension of the dispatch lie the slices of a block.
@compute @workgroup_size(BLOCK)
fn figures_of_positions(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let candidate = candidate_of(id, groups);
    if candidate >= exchange.candidates { return; }
    let who = exchange.first + candidate;
    let width = (exchange.figures + groups.z - 1u) / groups.z;
    for (var k = id.z * width; k < min((id.z + 1u) * width, exchange.figures); k++) {
        let at = given[place(who, exchange.rows, scaled[k].row)];
        taken[k * exchange.stride + candidate] = scaled[k].lower + scaled[k].range * at;
    }
}

@compute @workgroup_size(BLOCK)
fn objectives_of_results(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let candidate = candidate_of(id, groups);
    if candidate >= exchange.candidates { return; }
    let who = exchange.first + candidate;
    var sound = true;
    for (var k = 0u; k < exchange.objectives; k++) {
        var value = given[scaled[k].row * exchange.stride + candidate];
        if scaled[k].root == 1u { value = sqrt(value); }
        value = value / scaled[k].range;
        sound = sound && is_finite(value) && abs(value) < FAILED;
        taken[place(who, exchange.objectives, k)] = value;
    }
    if sound { return; }
    for (var k = 0u; k < exchange.objectives; k++) { taken[place(who, exchange.objectives, k)] = exchange.failed; }
}
