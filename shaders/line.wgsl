// Twin of `src/line/kernel.rs`: from a candidate's variables to the shape of its line and the time of a lap on it.
//
// One lane per candidate. Segment lengths, curvatures and speeds squared stand in a buffer, in tiles of TILE lanes: section by
// section within a tile, so that neighbouring lanes and neighbouring sections read neighbouring memory. All lanes start a lap's
// passes at the same section for the same reason. The constants CLOSED, TERMS, WANTS_INTEGRAL, WANTS_LAP, ENVELOPE_ROWS,
// CORNER_ROWS, ELLIPSE_ROWS, HAS_TRACTION, TRACTION_SPEEDS, TRACTION_ROOTS, HAS_DRS, OPEN_AT, WORKGROUP and TILE are generated, and
// so are the bindings 1 to 4: `sections`; `envelope` in rows of lateral, grip, drive, drag at their start and then of their rises,
// behind them the cells of traction, and from OPEN_AT on the same of the car with its DRS open; `corners` and `ellipse` in rows of a figure and its rise.
// All lanes read the same section, so these tables are uniform buffers if they fit. The envelope is one only on drivers that let
// lanes read different rows at full speed.

// The work of a dispatch; twin of `LineStretch` in `src/evaluate/line/gpu.rs`.
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
    across: vec2<f32>,
    constant: f32,
    inverse_spacing: f32,
    // The next section that takes other variables, or one past the last.
    until: u32,
    // Whether the DRS may be open from here to the next section.
    drs: u32,
}

@group(0) @binding(0) var<uniform> stretch: LineStretch;
@group(0) @binding(5) var<storage, read> variables: array<f32>;
// Length of the segment and curvature, section by section.
@group(0) @binding(6) var<storage, read_write> course: array<vec2<f32>>;
@group(0) @binding(7) var<storage, read_write> speeds_squared: array<f32>;
// Planes of length, squared length, squared second differences, integral and time.
@group(0) @binding(8) var<storage, read_write> results: array<f32>;

const BLOCK: u32 = 64u;

fn place_of(section: u32, candidate: u32) -> u32 {
    return (candidate / TILE * stretch.sections + section) * TILE + candidate % TILE;
}

struct Segment {
    direction: vec2<f32>,
    length: f32,
    slope: vec2<f32>,
    inverse_spacing: f32,
}

fn segment_between(section: u32, here: vec2<f32>, next: vec2<f32>) -> Segment {
    let along = sections[section].step + (next - here);
    let length = sqrt(max(along.x * along.x + along.y * along.y, 1e-8));
    let inverse_spacing = sections[section].inverse_spacing;
    return Segment(along / length, length, along * inverse_spacing, inverse_spacing);
}

fn second_difference_squared(segment: Segment, before: Segment) -> f32 {
    let change = segment.slope - before.slope;
    let spacings = segment.inverse_spacing + before.inverse_spacing;
    let scale = 2.0 * (segment.inverse_spacing * before.inverse_spacing) / spacings;
    return (change.x * change.x + change.y * change.y) * (scale * scale);
}

fn variable(source: u32, candidate: u32) -> f32 {
    return variables[source * stretch.stride + candidate];
}

// The variables that are summed for `alpha` at a section.
fn variables_of(section: u32, candidate: u32) -> vec4<f32> {
    var own = vec4<f32>(0.0);
    let sources = sections[section].sources;
    if TERMS > 0u {
        own.x = variable(sources.x, candidate);
    }
    if TERMS > 1u {
        own.y = variable(sources.y, candidate);
        own.z = variable(sources.z, candidate);
        own.w = variable(sources.w, candidate);
    }
    return own;
}

fn alpha(section: u32, own: vec4<f32>) -> f32 {
    var sum = sections[section].constant;
    let weights = sections[section].weights;
    if TERMS > 0u {
        sum = sum + weights.x * own.x;
    }
    if TERMS > 1u {
        sum = sum + weights.y * own.y;
        sum = sum + weights.z * own.z;
        sum = sum + weights.w * own.w;
    }
    sum = select(sum, 0.0, sum < 0.0);
    return select(sum, 1.0, 1.0 < sum);
}

fn offset(section: u32, own: vec4<f32>) -> vec2<f32> {
    return alpha(section, own) * sections[section].across;
}

// Sums of length, squared length, squared second differences and integral.
fn shape(candidate: u32) -> vec4<f32> {
    let n = stretch.sections;
    let segments = select(n - 1u, n, CLOSED);
    let first = offset(0u, variables_of(0u, candidate));
    var here = first;
    var before = Segment(vec2<f32>(0.0), 0.0, vec2<f32>(0.0), 0.0);
    if CLOSED {
        before = segment_between(n - 1u, offset(n - 1u, variables_of(n - 1u, candidate)), first);
    }
    var total = vec4<f32>(0.0);
    var block = vec4<f32>(0.0);
    // The segment before section `i`. Variables are read once for all neighbouring sections that take the same.
    var i = 1u;
    while i <= segments {
        let own = variables_of(min(i, n - 1u), candidate);
        let until = select(n + 1u, sections[min(i, n - 1u)].until, i < n);
        for (; i < until && i <= segments; i++) {
            let next = select(first, offset(min(i, n - 1u), own), i < n);
            let segment = segment_between(i - 1u, here, next);
            block.x = block.x + segment.length;
            block.y = block.y + segment.length * segment.length;
            var curvature = 0.0;
            if CLOSED || i > 1u {
                let turn = segment.direction - before.direction;
                let turned_squared = turn.x * turn.x + turn.y * turn.y;
                let spacing = 0.5 * (before.length + segment.length);
                let turned = sqrt(turned_squared);
                curvature = turned / spacing;
                block.z = block.z + second_difference_squared(segment, before);
                if WANTS_INTEGRAL {
                    let across = sqrt(max(4.0 - turned_squared, 1e-6));
                    let half = own_atan(Wheels(turned / across)).x;
                    block.w = block.w + 4.0 * half * (half / spacing);
                }
            }
            if WANTS_LAP {
                course[place_of(i - 1u, candidate)] = vec2<f32>(segment.length, curvature);
            }
            if i % BLOCK == 0u || i == segments {
                total = total + block;
                block = vec4<f32>(0.0);
            }
            before = segment;
            here = next;
        }
    }
    if WANTS_LAP && !CLOSED {
        course[place_of(0u, candidate)].y = course[place_of(1u, candidate)].y;
        course[place_of(n - 1u, candidate)] = vec2<f32>(0.0, course[place_of(n - 2u, candidate)].y);
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

// Lateral, grip, drive and drag. `table` is where the limits begin: 0, or OPEN_AT with the DRS open.
fn limits_at(speed_squared: f32, table: u32) -> vec4<f32> {
    let held = min(max(speed_squared * stretch.rows_per_speed_squared, 0.0), f32(ENVELOPE_ROWS));
    let row = min(u32(held), ENVELOPE_ROWS - 1u);
    return envelope[table + 2u * row] + (held - f32(row)) * envelope[table + 2u * row + 1u];
}

fn root_left(speed_squared: f32, curvature: f32, lateral: f32) -> f32 {
    let share = curvature * speed_squared / lateral;
    return sqrt(max(1.0 - share * share, 0.0));
}

fn left_for_braking(root: f32) -> f32 {
    if ELLIPSE_ROWS == 0u {
        return root;
    }
    let held = min(max(root * f32(ELLIPSE_ROWS), 0.0), f32(ELLIPSE_ROWS));
    let row = min(u32(held), ELLIPSE_ROWS - 1u);
    let figures = ellipse[row];
    return figures.x + (held - f32(row)) * figures.y;
}

fn left_for_driving(speed_squared: f32, root: f32, table: u32) -> f32 {
    if !HAS_TRACTION {
        return left_for_braking(root);
    }
    let per_row = f32(TRACTION_SPEEDS) / f32(ENVELOPE_ROWS);
    let along = speed_squared * stretch.rows_per_speed_squared * per_row;
    let held = min(max(along, 0.0), f32(TRACTION_SPEEDS));
    let across = root * f32(TRACTION_ROOTS);
    let speed = min(u32(held), TRACTION_SPEEDS - 1u);
    let cell = min(u32(across), TRACTION_ROOTS - 1u);
    let figures = envelope[table + 2u * ENVELOPE_ROWS + speed * TRACTION_ROOTS + cell];
    let beyond = held - f32(speed);
    let start = figures.x + beyond * figures.y;
    return start + (across - f32(cell)) * (figures.z + beyond * figures.w);
}

// The traction that is left, the drive and the drag.
fn driving_at(speed_squared: f32, curvature: f32, table: u32) -> vec3<f32> {
    let at = limits_at(speed_squared, table);
    let left = left_for_driving(speed_squared, root_left(speed_squared, curvature, at.x), table);
    return vec3<f32>(at.y * left, at.z, at.w);
}

fn may_open(section: u32) -> bool {
    return HAS_DRS && sections[section].drs != 0u;
}

fn driving_with_drs(drs: bool, speed_squared: f32, curvature: f32) -> vec3<f32> {
    let shut = driving_at(speed_squared, curvature, 0u);
    if !drs {
        return shut;
    }
    let open = driving_at(speed_squared, curvature, OPEN_AT);
    let pays = min(shut.x, shut.y) - shut.z < min(open.x, open.y) - open.z;
    return select(shut, open, pays);
}

fn acceleration(drs: bool, speed_squared: f32, curvature: f32) -> f32 {
    let at = driving_with_drs(drs, speed_squared, curvature);
    return min(at.x, at.y) - at.z;
}

fn deceleration(speed_squared: f32, curvature: f32) -> f32 {
    let at = limits_at(speed_squared, 0u);
    return at.y * left_for_braking(root_left(speed_squared, curvature, at.x)) + at.w;
}

fn driven(drs: bool, start: f32, length: f32, here: f32, there: f32) -> f32 {
    let first = acceleration(drs, start, here);
    let middle = max(start + length * first, 0.0);
    let drive = acceleration(drs, middle, 0.5 * (here + there));
    return max(start + length * (first + drive), 0.0);
}

fn braked(end: f32, length: f32, there: f32, here: f32) -> f32 {
    let first = deceleration(end, there);
    let middle = end + length * first;
    let brake = deceleration(middle, 0.5 * (here + there));
    return end + length * (first + brake);
}

fn lap_time(candidate: u32) -> f32 {
    let n = stretch.sections;
    let start = select(0u, stretch.start, CLOSED);
    let steps = select(n - 1u, 2u * n, CLOSED);

    var here = start;
    var bend = course[place_of(start, candidate)];
    var speed_squared = corner(bend.y);
    if !CLOSED {
        speed_squared = min(speed_squared, stretch.entry);
    }
    speeds_squared[place_of(start, candidate)] = speed_squared;
    for (var i = 0u; i < steps; i++) {
        let next = select(0u, here + 1u, here + 1u < n);
        let there = course[place_of(next, candidate)];
        let reached = driven(may_open(here), speed_squared, bend.x, bend.y, there.y);
        // In the first round a section is limited by its corner speed alone.
        let again = i + 1u >= n;
        var most: f32;
        if again {
            most = speeds_squared[place_of(next, candidate)];
        } else {
            most = corner(there.y);
        }
        let slower = reached < most;
        if again && !slower {
            break;
        }
        speed_squared = select(most, reached, slower);
        speeds_squared[place_of(next, candidate)] = speed_squared;
        bend = there;
        here = next;
    }

    var next = select(n - 1u, start, CLOSED);
    speed_squared = speeds_squared[place_of(next, candidate)];
    var curvature = course[place_of(next, candidate)].y;
    for (var i = 0u; i < steps; i++) {
        let before = select(n - 1u, next - 1u, next > 0u);
        let there = course[place_of(before, candidate)];
        let reached = braked(speed_squared, there.x, curvature, there.y);
        let known = speeds_squared[place_of(before, candidate)];
        let slower = reached < known;
        if slower {
            speeds_squared[place_of(before, candidate)] = reached;
        } else if i + 1u >= n {
            break;
        }
        speed_squared = select(known, reached, slower);
        curvature = there.y;
        next = before;
    }

    let segments = select(n - 1u, n, CLOSED);
    var total = 0.0;
    var block = 0.0;
    var speed = sqrt(speeds_squared[place_of(0u, candidate)]);
    for (var i = 0u; i < segments; i++) {
        let after = select(0u, i + 1u, i + 1u < n);
        let to = sqrt(speeds_squared[place_of(after, candidate)]);
        block = block + 2.0 * course[place_of(i, candidate)].x / (speed + to);
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
