// Copies the positions of the particles at the head of the list of those found side by side, so that no others need to be read back.

struct Gathering {
    most: u32,
    dimensions: u32,
}

// As in `swarm.wgsl`.
struct Found {
    count: u32,
    least: u32,
    most: u32,
    failed: array<u32, 13>,
    points: array<vec4<u32>>,
}

@group(0) @binding(0) var<uniform> gathering: Gathering;
@group(0) @binding(1) var<storage, read> found: Found;
@group(0) @binding(2) var<storage, read> position: array<f32>;
@group(0) @binding(3) var<storage, read_write> rows: array<f32>;

const BLOCK: u32 = 64u;

// A lane to a coordinate.
@compute @workgroup_size(BLOCK)
fn gather(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.y * groups.x * BLOCK + id.x;
    let d = gathering.dimensions;
    let point = i / d;
    if point >= min(found.count, gathering.most) { return; }
    let who = found.points[point].x;
    rows[i] = position[(who / BLOCK * d + i % d) * BLOCK + who % BLOCK];
}
