// Copies the positions of a few particles side by side, so that no others need to be read back.

struct Gathering {
    count: u32,
    dimensions: u32,
}

@group(0) @binding(0) var<uniform> gathering: Gathering;
@group(0) @binding(1) var<storage, read> who: array<u32>;
@group(0) @binding(2) var<storage, read> position: array<f32>;
@group(0) @binding(3) var<storage, read_write> rows: array<f32>;

@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= gathering.count { return; }
    let d = gathering.dimensions;
    let start = who[id.x] / 64u * d * 64u + who[id.x] % 64u;
    for (var k = 0u; k < d; k++) {
        rows[id.x * d + k] = position[start + k * 64u];
    }
}
