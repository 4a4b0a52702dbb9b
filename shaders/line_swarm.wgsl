// Exchange between a swarm on the device and the line kernel. Twin of `src/evaluate/line/gpu/exchange.rs`. The swarm's rows are in
// blocks of particles, the kernel's in planes of candidates.

struct Exchange {
    // The first particle of the batch, and how many it has.
    first: u32,
    candidates: u32,
    // Distance between the planes.
    stride: u32,
    variables: u32,
    // Rows of a block of positions, and of objectives.
    rows: u32,
    objectives: u32,
}

// A variable is `lower + range * position`.
struct Scaled {
    lower: f32,
    range: f32,
    // Its row among the positions.
    row: u32,
}

@group(0) @binding(0) var<uniform> exchange: Exchange;
@group(0) @binding(1) var<storage, read> scaled: array<Scaled>;
// Positions or figures, then variables or objectives.
@group(0) @binding(2) var<storage, read> given: array<f32>;
@group(0) @binding(3) var<storage, read_write> wanted: array<f32>;

const BLOCK: u32 = 64u;
// The sum of squared second differences, of which the objective is the root.
const SECOND_DIFFERENCES: u32 = 2u;

fn place(who: u32, width: u32, k: u32) -> u32 {
    return (who / BLOCK * width + k) * BLOCK + who % BLOCK;
}

fn candidate_of(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.y * groups.x * BLOCK + id.x;
}

@compute @workgroup_size(BLOCK)
fn variables_of_positions(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let candidate = candidate_of(id, groups);
    if candidate >= exchange.candidates { return; }
    let who = exchange.first + candidate;
    for (var v = 0u; v < exchange.variables; v++) {
        let at = given[place(who, exchange.rows, scaled[v].row)];
        wanted[v * exchange.stride + candidate] = scaled[v].lower + scaled[v].range * at;
    }
}

// Here `row` is the figure that an objective is made of.
@compute @workgroup_size(BLOCK)
fn objectives_of_figures(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let candidate = candidate_of(id, groups);
    if candidate >= exchange.candidates { return; }
    let who = exchange.first + candidate;
    for (var k = 0u; k < exchange.objectives; k++) {
        let figure = scaled[k].row;
        var value = given[figure * exchange.stride + candidate];
        if figure == SECOND_DIFFERENCES { value = sqrt(value); }
        wanted[place(who, exchange.objectives, k)] = value;
    }
}
