// Twin of `src/line/kernel.rs`: from a candidate's variables to the shape of its line and the time of a lap on it.
//
// One lane per candidate. Segment lengths, curvatures and speeds squared stand in a buffer, section by section, so that
// neighbouring lanes meet in neighbouring memory. All lanes start a lap's passes at the same section, for the same
// reason. The constants CLOSED, TERMS, WANTS_INTEGRAL, WANTS_LAP, LIMIT_ROWS, CORNER_ROWS, ELLIPSE_ROWS and WORKGROUP
// are generated.

// What a dispatch is to do; twin of `LineStretch` in `src/evaluate/line/gpu.rs`.
struct LineStretch {
    // One past the last candidate, the distance between rows in the buffers, and the first candidate.
    candidates: u32,
    stride: u32,
    first: u32,
    // Sections of the line, and where a closed lap's passes start.
    sections: u32,
    start: u32,
    // Speed squared at the start of an open line.
    entry: f32,
    rows_per_speed_squared: f32,
    rows_per_radius: f32,
}

struct Section {
    sources: vec4<u32>,
    weights: vec4<f32>,
    step: vec2<f32>,
    cut: vec2<f32>,
    constant: f32,
}

@group(0) @binding(0) var<uniform> stretch: LineStretch;
@group(0) @binding(1) var<storage, read> sections: array<Section>;
// Rows of lateral, grip, drive, drag at their start and then of their rises.
@group(0) @binding(2) var<storage, read> limits: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> corners: array<vec2<f32>>;
@group(0) @binding(4) var<storage, read> ellipse: array<vec2<f32>>;
@group(0) @binding(5) var<storage, read> variables: array<f32>;
@group(0) @binding(6) var<storage, read_write> course: array<f32>;
// Planes of length, squared length, squared second differences, integral and time.
@group(0) @binding(7) var<storage, read_write> results: array<f32>;

const BLOCK: u32 = 64u;
const LENGTH: u32 = 0u;
const CURVATURE: u32 = 1u;
const SPEED_SQUARED: u32 = 2u;

fn place_of(plane: u32, section: u32, candidate: u32) -> u32 {
    return (plane * stretch.sections + section) * stretch.stride + candidate;
}

struct Segment {
    direction: vec2<f32>,
    length: f32,
}

fn segment_between(step: vec2<f32>, here: vec2<f32>, next: vec2<f32>) -> Segment {
    let along = step + (next - here);
    let length = sqrt(max(along.x * along.x + along.y * along.y, 1e-8));
    return Segment(along / length, length);
}

fn variable(source: u32, candidate: u32) -> f32 {
    return variables[source * stretch.stride + candidate];
}

fn alpha(section: u32, candidate: u32) -> f32 {
    var sum = sections[section].constant;
    let weights = sections[section].weights;
    let sources = sections[section].sources;
    if TERMS > 0u {
        sum = sum + weights.x * variable(sources.x, candidate);
    }
    if TERMS > 1u {
        sum = sum + weights.y * variable(sources.y, candidate);
        sum = sum + weights.z * variable(sources.z, candidate);
        sum = sum + weights.w * variable(sources.w, candidate);
    }
    sum = select(sum, 0.0, sum < 0.0);
    return select(sum, 1.0, 1.0 < sum);
}

fn offset(section: u32, candidate: u32) -> vec2<f32> {
    return alpha(section, candidate) * sections[section].cut;
}

// Sums of length, squared length, squared second differences and integral.
fn shape(candidate: u32) -> vec4<f32> {
    let n = stretch.sections;
    let segments = select(n - 1u, n, CLOSED);
    let first = offset(0u, candidate);
    var here = first;
    var before = Segment(vec2<f32>(0.0), 0.0);
    if CLOSED {
        before = segment_between(sections[n - 1u].step, offset(n - 1u, candidate), first);
    }
    var total = vec4<f32>(0.0);
    var block = vec4<f32>(0.0);
    for (var i = 0u; i < segments; i++) {
        var next = first;
        if i + 1u < n {
            next = offset(i + 1u, candidate);
        }
        let segment = segment_between(sections[i].step, here, next);
        block.x = block.x + segment.length;
        block.y = block.y + segment.length * segment.length;
        var curvature = 0.0;
        if CLOSED || i > 0u {
            let turn = segment.direction - before.direction;
            let turned_squared = turn.x * turn.x + turn.y * turn.y;
            let spacing = 0.5 * (before.length + segment.length);
            let turned = sqrt(turned_squared);
            curvature = turned / spacing;
            block.z = block.z + curvature * curvature;
            if WANTS_INTEGRAL {
                let across = sqrt(max(4.0 - turned_squared, 1e-6));
                let half = own_atan(Wheels(turned / across)).x;
                block.w = block.w + 4.0 * half * (half / spacing);
            }
        }
        if WANTS_LAP {
            course[place_of(LENGTH, i, candidate)] = segment.length;
            course[place_of(CURVATURE, i, candidate)] = curvature;
        }
        if (i + 1u) % BLOCK == 0u || i + 1u == segments {
            total = total + block;
            block = vec4<f32>(0.0);
        }
        before = segment;
        here = next;
    }
    if WANTS_LAP && !CLOSED {
        course[place_of(CURVATURE, 0u, candidate)] = course[place_of(CURVATURE, 1u, candidate)];
        course[place_of(CURVATURE, n - 1u, candidate)] = course[place_of(CURVATURE, n - 2u, candidate)];
    }
    return total;
}

fn corner(curvature: f32) -> f32 {
    let radius = 1.0 / max(curvature, 1e-6);
    let held = min(max(radius * stretch.rows_per_radius, 0.0), f32(CORNER_ROWS));
    let row = min(u32(held), CORNER_ROWS - 1u);
    let figures = corners[row];
    return figures.x + (held - f32(row)) * figures.y;
}

// Greatest acceleration and greatest deceleration.
fn longitudinal(speed_squared: f32, curvature: f32) -> vec2<f32> {
    let held = min(max(speed_squared * stretch.rows_per_speed_squared, 0.0), f32(LIMIT_ROWS));
    let row = min(u32(held), LIMIT_ROWS - 1u);
    let at = limits[2u * row] + (held - f32(row)) * limits[2u * row + 1u];
    let share = curvature * speed_squared / at.x;
    var left = sqrt(max(1.0 - share * share, 0.0));
    if ELLIPSE_ROWS > 0u {
        let held = min(max(left * f32(ELLIPSE_ROWS), 0.0), f32(ELLIPSE_ROWS));
        let row = min(u32(held), ELLIPSE_ROWS - 1u);
        let figures = ellipse[row];
        left = figures.x + (held - f32(row)) * figures.y;
    }
    let grip = at.y * left;
    return vec2<f32>(min(grip, at.z) - at.w, grip + at.w);
}

fn driven(start: f32, length: f32, here: f32, there: f32) -> f32 {
    let middle = max(start + length * longitudinal(start, here).x, 0.0);
    let drive = longitudinal(middle, 0.5 * (here + there)).x;
    return max(start + 2.0 * length * drive, 0.0);
}

fn braked(end: f32, length: f32, there: f32, here: f32) -> f32 {
    let middle = end + length * longitudinal(end, there).y;
    let brake = longitudinal(middle, 0.5 * (here + there)).y;
    return end + 2.0 * length * brake;
}

fn lap_time(candidate: u32) -> f32 {
    let n = stretch.sections;
    for (var i = 0u; i < n; i++) {
        course[place_of(SPEED_SQUARED, i, candidate)] = corner(course[place_of(CURVATURE, i, candidate)]);
    }
    let start = select(0u, stretch.start, CLOSED);
    let first = place_of(SPEED_SQUARED, start, candidate);
    if !CLOSED {
        course[first] = min(course[first], stretch.entry);
    }
    let steps = select(n - 1u, 2u * n, CLOSED);

    var here = start;
    var speed_squared = course[first];
    var curvature = course[place_of(CURVATURE, start, candidate)];
    for (var i = 0u; i < steps; i++) {
        let next = select(0u, here + 1u, here + 1u < n);
        let there = course[place_of(CURVATURE, next, candidate)];
        let reached = driven(speed_squared, course[place_of(LENGTH, here, candidate)], curvature, there);
        let known = course[place_of(SPEED_SQUARED, next, candidate)];
        let slower = reached < known;
        if slower {
            course[place_of(SPEED_SQUARED, next, candidate)] = reached;
        } else if i + 1u >= n {
            break;
        }
        speed_squared = select(known, reached, slower);
        curvature = there;
        here = next;
    }

    var next = select(n - 1u, start, CLOSED);
    speed_squared = course[place_of(SPEED_SQUARED, next, candidate)];
    curvature = course[place_of(CURVATURE, next, candidate)];
    for (var i = 0u; i < steps; i++) {
        let before = select(n - 1u, next - 1u, next > 0u);
        let there = course[place_of(CURVATURE, before, candidate)];
        let reached = braked(speed_squared, course[place_of(LENGTH, before, candidate)], curvature, there);
        let known = course[place_of(SPEED_SQUARED, before, candidate)];
        let slower = reached < known;
        if slower {
            course[place_of(SPEED_SQUARED, before, candidate)] = reached;
        } else if i + 1u >= n {
            break;
        }
        speed_squared = select(known, reached, slower);
        curvature = there;
        next = before;
    }

    let segments = select(n - 1u, n, CLOSED);
    var total = 0.0;
    var block = 0.0;
    var speed = sqrt(course[place_of(SPEED_SQUARED, 0u, candidate)]);
    for (var i = 0u; i < segments; i++) {
        let after = select(0u, i + 1u, i + 1u < n);
        let to = sqrt(course[place_of(SPEED_SQUARED, after, candidate)]);
        block = block + 2.0 * course[place_of(LENGTH, i, candidate)] / (speed + to);
        speed = to;
        if (i + 1u) % BLOCK == 0u || i + 1u == segments {
            total = total + block;
            block = 0.0;
        }
    }
    return total;
}

@compute @workgroup_size(WORKGROUP)
fn line(@builtin(global_invocation_id) id: vec3<u32>) {
    let candidate = stretch.first + id.x;
    if candidate >= stretch.candidates {
        return;
    }
    let sums = shape(candidate);
    results[candidate] = sums.x;
    results[stretch.stride + candidate] = sums.y;
    results[2u * stretch.stride + candidate] = sums.z;
    results[3u * stretch.stride + candidate] = sums.w;
    if WANTS_LAP {
        results[4u * stretch.stride + candidate] = lap_time(candidate);
    }
}
