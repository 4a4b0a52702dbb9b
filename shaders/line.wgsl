// Twin of `src/line/kernel.rs`: from a candidate's variables to the shape of its line and the time of a lap on it.
//
// One lane per candidate. Segment lengths, curvatures and speeds squared stand in a buffer, in tiles of TILE lanes: section by
// section within a tile, so that neighbouring lanes and neighbouring sections read neighbouring memory. All lanes start a lap's
// passes at the same section for the same reason. The constants CLOSED, TERMS, WANTS_INTEGRAL, WANTS_LAP, ENVELOPE_ROWS,
// CORNER_ROWS, ELLIPSE_ROWS, HAS_STEERING_RATE, HAS_TRACTION, TRACTION_SPEEDS, TRACTION_ROOTS, HAS_DRS, OPEN_AT, HAS_RELIEF,
// LOADS, LOADS_AT, LOAD_STEP, WORKGROUP and TILE are generated, and so are the bindings 1 to 4: `sections`; `envelope` in rows of
// lateral, grip, drive, drag at their start and then of their rises,
// behind them the cells of traction, and from OPEN_AT on the same of the car with its DRS open. On a road that is not level and dry
// the same again from LOADS_AT on, under each of LOADS loads, LOAD_STEP rows apart; behind the sections then stand as many whose
// weights are height and banking: `step_rise`, `across_rise`, sine and cosine, whose `constant` is the friction at the right edge of the road,
// whose `sources` are the bits of what it gains on each of four steps to the left edge, and whose `step` says how many of these steps the
// right end of the cross-section is from the edge, and the left end from that. Then `corners` and `ellipse` in rows of a figure and its rise.
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
    // Of roads in three dimensions: load over mass of the first table, tables per load, the least and the greatest load in tables,
    // the radius on the steering lock, gravity, and the share of the mass that is accelerated which rotates.
    load_first: f32,
    tables_per_load: f32,
    load_least: f32,
    load_most: f32,
    lock_radius: f32,
    gravity: f32,
    coasting: f32,
    // Square of the greatest rate at which the curvature may change in time.
    curvature_rate_squared: f32,
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
// Length of the segment and curvature, section by section. On a road that is not level and dry three more planes follow: curvature
// square to the surface and gravity along the segment, then gravity to the left and square to the surface, then the friction.
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

// Where a line crosses a cross-section, from its right end: east, north and up; and the friction there.
fn crossing(section: u32, candidate: u32) -> vec4<f32> {
    let share = alpha(section, variables_of(section, candidate));
    let relief = sections[stretch.sections + section];
    let steps = vec4<f32>(relief.step.x + share * relief.step.y) - vec4<f32>(0.0, 1.0, 2.0, 3.0);
    let rises = min(max(steps, vec4<f32>(0.0)), vec4<f32>(1.0)) * bitcast<vec4<f32>>(relief.sources);
    let friction = relief.constant + rises.x + rises.y + rises.z + rises.w;
    return vec4<f32>(share * sections[section].across, share * relief.weights.y, friction);
}

// A segment's direction in space and its length.
struct Rising {
    direction: vec3<f32>,
    length: f32,
}

fn rising_between(section: u32, here: vec4<f32>, next: vec4<f32>) -> Rising {
    let step = sections[section].step + (next.xy - here.xy);
    let rise = sections[stretch.sections + section].weights.x + (next.z - here.z);
    let length = sqrt(max(step.x * step.x + step.y * step.y + rise * rise, 1e-8));
    return Rising(vec3<f32>(step, rise) / length, length);
}

// Curvature along and square to a surface that is banked by an angle of this sine and cosine, and gravity to the left and square to
// it.
fn turned(after: Rising, before: Rising, sine: f32, cosine: f32) -> vec4<f32> {
    let change = after.direction - before.direction;
    let mean = 0.5 * (after.direction + before.direction);
    let level = sqrt(max(mean.x * mean.x + mean.y * mean.y, 1e-8));
    let forward = mean.xy / level;
    let slope = mean.z;
    let spacing = 0.5 * (before.length + after.length);
    let flat_share = sqrt(max(1.0 - slope * slope, 0.0));
    let turn = (forward.x * change.y - forward.y * change.x) / spacing;
    let bow = (flat_share * change.z - slope * (forward.x * change.x + forward.y * change.y)) / spacing;
    let gravity = stretch.gravity * flat_share;
    return vec4<f32>(
        turn * cosine + bow * sine,
        bow * cosine - turn * sine,
        gravity * sine,
        gravity * cosine,
    );
}

// Gives the course the lengths and curvatures of a line in three dimensions, in the place of those of the plane.
fn relieve(candidate: u32) {
    let n = stretch.sections;
    let segments = select(n - 1u, n, CLOSED);
    let first = crossing(0u, candidate);
    var here = first;
    var before = Rising(vec3<f32>(0.0), 0.0);
    if CLOSED {
        before = rising_between(n - 1u, crossing(n - 1u, candidate), first);
    }
    for (var i = 0u; i < segments; i++) {
        var next = first;
        if i + 1u < n {
            next = crossing(i + 1u, candidate);
        }
        let rising = rising_between(i, here, next);
        let climb = stretch.gravity * rising.direction.z;
        var found = vec4<f32>(0.0);
        if CLOSED || i > 0u {
            let relief = sections[n + i].weights;
            found = turned(rising, before, relief.z, relief.w);
        }
        course[place_of(i, candidate)] = vec2<f32>(rising.length, found.x);
        course[relief_at(1u, i, candidate)] = vec2<f32>(found.y, climb);
        course[relief_at(2u, i, candidate)] = found.zw;
        course[relief_at(3u, i, candidate)].x = here.w;
        before = rising;
        here = next;
    }
    if !CLOSED {
        // The last that was crossed is the end of the line.
        copy_relief(0u, 1u, 0u, first.w, candidate);
        copy_relief(n - 1u, n - 2u, n - 2u, here.w, candidate);
    }
}

// Gives an end of an open line its neighbour's figures, the climb of a segment, and its own friction.
fn copy_relief(end: u32, inner: u32, segment: u32, friction: f32, candidate: u32) {
    course[place_of(end, candidate)].y = course[place_of(inner, candidate)].y;
    let climb = course[relief_at(1u, segment, candidate)].y;
    course[relief_at(1u, end, candidate)] = vec2<f32>(course[relief_at(1u, inner, candidate)].x, climb);
    course[relief_at(2u, end, candidate)] = course[relief_at(2u, inner, candidate)];
    course[relief_at(3u, end, candidate)].x = friction;
}

// The planes of a road that is not level and dry behind the first.
fn relief_at(plane: u32, section: u32, candidate: u32) -> u32 {
    return plane * stretch.stride * stretch.sections + place_of(section, candidate);
}

// A place of the road; twin of `Sloped` in `src/line/ground.rs`. On a level road `bend` alone is used.
struct Ground {
    bend: f32,
    dip: f32,
    climb: f32,
    lean: f32,
    press: f32,
    friction: f32,
}

// A bend of a level road.
fn level(curvature: f32) -> Ground {
    return Ground(curvature, 0.0, 0.0, 0.0, 0.0, 1.0);
}

// A section with the segment after it.
struct Spot {
    length: f32,
    ground: Ground,
}

fn spot_at(section: u32, candidate: u32) -> Spot {
    let first = course[place_of(section, candidate)];
    if !HAS_RELIEF {
        return Spot(first.x, level(first.y));
    }
    let second = course[relief_at(1u, section, candidate)];
    let third = course[relief_at(2u, section, candidate)];
    let friction = course[relief_at(3u, section, candidate)].x;
    return Spot(first.x, Ground(first.y, second.x, second.y, third.x, third.y, friction));
}

// The ground at the end of a segment, of which it has the climb.
fn end_of(segment: Spot, end: Ground) -> Ground {
    return Ground(end.bend, end.dip, segment.ground.climb, end.lean, end.press, end.friction);
}

fn half_way(here: Ground, there: Ground) -> Ground {
    let bend = 0.5 * (here.bend + there.bend);
    if !HAS_RELIEF {
        return level(bend);
    }
    return Ground(
        bend,
        0.5 * (here.dip + there.dip),
        here.climb,
        0.5 * (here.lean + there.lean),
        0.5 * (here.press + there.press),
        0.5 * (here.friction + there.friction),
    );
}

// The lower of the two tables that a load lies between, and how far it is beyond that, as a share of the step to the next.
fn layer_of(ground: Ground, speed_squared: f32) -> vec2<f32> {
    let load = speed_squared * ground.dip + ground.press;
    let place = min(max((load - stretch.load_first) * stretch.tables_per_load, stretch.load_least), stretch.load_most);
    let below = min(u32(max(place, 0.0)), LOADS - 2u);
    return vec2<f32>(f32(below), place - f32(below));
}

// The row of limits under a load: figures and their rises over a row.
struct LoadedRow {
    figures: vec4<f32>,
    rises: vec4<f32>,
}

fn loaded_row(layer: vec2<f32>, row: u32, table: u32) -> LoadedRow {
    let low = table + LOADS_AT + u32(layer.x) * LOAD_STEP + 2u * row;
    let high = low + LOAD_STEP;
    return LoadedRow(
        envelope[low] + layer.y * (envelope[high] - envelope[low]),
        envelope[low + 1u] + layer.y * (envelope[high + 1u] - envelope[low + 1u]),
    );
}

const LEAST_GRIP: f32 = 0.05;
const CORNER_STEPS: u32 = 12u;

// The lateral limit at a speed squared, and its slope over it.
fn loaded_lateral(ground: Ground, speed_squared: f32) -> vec2<f32> {
    let per_row = stretch.rows_per_speed_squared;
    let held = min(max(speed_squared * per_row, 0.0), f32(ENVELOPE_ROWS));
    let row = min(u32(held), ENVELOPE_ROWS - 1u);
    let beyond = held - f32(row);
    let layer = layer_of(ground, speed_squared);
    let low = loaded_row(vec2<f32>(layer.x, 0.0), row, 0u);
    let high = loaded_row(vec2<f32>(layer.x, 1.0), row, 0u);
    let here = loaded_row(layer, row, 0u);
    let by_load = ((high.figures.x + beyond * high.rises.x) - (low.figures.x + beyond * low.rises.x)) * stretch.tables_per_load;
    return vec2<f32>(
        max(ground.friction * (here.figures.x + beyond * here.rises.x), LEAST_GRIP),
        ground.friction * (here.rises.x * per_row + by_load * ground.dip),
    );
}

fn sloped_corner(ground: Ground) -> f32 {
    var low = 0.0;
    var high = f32(ENVELOPE_ROWS) / stretch.rows_per_speed_squared;
    var speed_squared = high;
    for (var i = 0u; i < CORNER_STEPS; i++) {
        let limit = loaded_lateral(ground, speed_squared);
        let across = speed_squared * ground.bend + ground.lean;
        let spare = limit.x - abs(across);
        let slope = limit.y - select(-ground.bend, ground.bend, 0.0 < across);
        if spare < 0.0 {
            high = speed_squared;
        } else {
            low = speed_squared;
        }
        let next = speed_squared - spare / slope;
        speed_squared = select(0.5 * (low + high), next, !(next < low) && next < high);
    }
    let radius = 1.0 / max(abs(ground.bend), 1e-6);
    let share = min(radius / stretch.lock_radius, 1.0);
    let squared = share * share;
    return speed_squared * (squared * squared);
}

fn corner(ground: Ground) -> f32 {
    if HAS_RELIEF {
        return sloped_corner(ground);
    }
    let radius = 1.0 / max(ground.bend, 1e-6);
    let held = min(max(radius * stretch.rows_per_radius, 0.0), f32(CORNER_ROWS));
    let row = min(u32(held), CORNER_ROWS - 1u);
    let figures = corners[row];
    return figures.x + (held - f32(row)) * figures.y;
}

// The corner speed squared at the end of a segment of a length, no greater than the steering follows the change of curvature at.
fn steered_corner(length: f32, before: Ground, ground: Ground) -> f32 {
    let most = corner(ground);
    if !HAS_STEERING_RATE {
        return most;
    }
    let change = abs(ground.bend) - abs(before.bend);
    let change_squared = max(change * change, 1e-14);
    return min(most, stretch.curvature_rate_squared * (length * length) / change_squared);
}

// Lateral, grip, drive and drag. `table` is where the limits begin: 0, or OPEN_AT with the DRS open.
fn limits_at(speed_squared: f32, ground: Ground, table: u32) -> vec4<f32> {
    let held = min(max(speed_squared * stretch.rows_per_speed_squared, 0.0), f32(ENVELOPE_ROWS));
    let row = min(u32(held), ENVELOPE_ROWS - 1u);
    if HAS_RELIEF {
        let under = loaded_row(layer_of(ground, speed_squared), row, table);
        let limits = under.figures + (held - f32(row)) * under.rises;
        let of_tyres = max(ground.friction * limits.xy, vec2<f32>(LEAST_GRIP));
        // The engine climbs with the car alone: what rotates need not be lifted.
        return vec4<f32>(of_tyres, limits.z + stretch.coasting * ground.climb, limits.w);
    }
    return envelope[table + 2u * row] + (held - f32(row)) * envelope[table + 2u * row + 1u];
}

fn root_left(speed_squared: f32, ground: Ground, lateral: f32) -> f32 {
    var share = ground.bend * speed_squared / lateral;
    if HAS_RELIEF {
        share = (speed_squared * ground.bend + ground.lean) / lateral;
    }
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

// The share of the longitudinal grip that is left for driving, and what the tyres take from the drive.
fn left_for_driving(speed_squared: f32, root: f32, ground: Ground, table: u32) -> vec2<f32> {
    if !HAS_TRACTION {
        return vec2<f32>(left_for_braking(root), 0.0);
    }
    let per_row = f32(TRACTION_SPEEDS) / f32(ENVELOPE_ROWS);
    let along = speed_squared * stretch.rows_per_speed_squared * per_row;
    let held = min(max(along, 0.0), f32(TRACTION_SPEEDS));
    let across = root * f32(TRACTION_ROOTS);
    let speed = min(u32(held), TRACTION_SPEEDS - 1u);
    let cell = min(u32(across), TRACTION_ROOTS - 1u);
    let beyond = vec2<f32>(held - f32(speed), across - f32(cell));
    let place = table + 2u * (ENVELOPE_ROWS + speed * TRACTION_ROOTS + cell);
    if HAS_RELIEF {
        let layer = layer_of(ground, speed_squared);
        let below = place + LOADS_AT + u32(layer.x) * LOAD_STEP;
        let low = traction_in(below, beyond);
        let high = traction_in(below + LOAD_STEP, beyond);
        // Beyond the loads that were swept the tyres give nothing back.
        let both = max(low + layer.y * (high - low), vec2<f32>(0.0));
        return vec2<f32>(both.x, ground.friction * ground.friction * both.y);
    }
    return traction_in(place, beyond);
}

fn traction_in(place: u32, beyond: vec2<f32>) -> vec2<f32> {
    let left = envelope[place];
    let lost = envelope[place + 1u];
    let start = vec2<f32>(left.x, lost.x) + beyond.x * vec2<f32>(left.y, lost.y);
    return start + beyond.y * (vec2<f32>(left.z, lost.z) + beyond.x * vec2<f32>(left.w, lost.w));
}

// The traction that is left, the drive that the tyres leave of what the engine gives, the drag, and what the tyres take.
fn driving_at(speed_squared: f32, ground: Ground, table: u32) -> vec4<f32> {
    let at = limits_at(speed_squared, ground, table);
    let in_bend = left_for_driving(speed_squared, root_left(speed_squared, ground, at.x), ground, table);
    return vec4<f32>(at.y * in_bend.x, at.z - in_bend.y, at.w, in_bend.y);
}

fn may_open(section: u32) -> bool {
    return HAS_DRS && sections[section].drs != 0u;
}

fn driving_with_drs(drs: bool, speed_squared: f32, ground: Ground) -> vec4<f32> {
    let shut = driving_at(speed_squared, ground, 0u);
    if !drs {
        return shut;
    }
    let open = driving_at(speed_squared, ground, OPEN_AT);
    let pays = min(shut.x, shut.y) - shut.z < min(open.x, open.y) - open.z;
    return select(shut, open, pays);
}

// An acceleration by forces, less the part of gravity that the car climbs against.
fn uphill(forces: f32, ground: Ground) -> f32 {
    if HAS_RELIEF {
        return forces - ground.climb;
    }
    return forces;
}

fn acceleration(drs: bool, speed_squared: f32, ground: Ground) -> f32 {
    let at = driving_with_drs(drs, speed_squared, ground);
    return uphill(min(at.x, at.y) - at.z, ground);
}

fn deceleration(speed_squared: f32, ground: Ground) -> f32 {
    let at = limits_at(speed_squared, ground, 0u);
    let forces = at.y * left_for_braking(root_left(speed_squared, ground, at.x)) + at.w;
    if HAS_RELIEF {
        return forces + ground.climb;
    }
    return forces;
}

fn driven(drs: bool, start: f32, length: f32, here: Ground, there: Ground) -> f32 {
    let first = acceleration(drs, start, here);
    let middle = max(start + length * first, 0.0);
    let drive = acceleration(drs, middle, half_way(here, there));
    return max(start + length * (first + drive), 0.0);
}

fn braked(end: f32, length: f32, there: Ground, here: Ground) -> f32 {
    let first = deceleration(end, there);
    let middle = end + length * first;
    let brake = deceleration(middle, half_way(here, there));
    return end + length * (first + brake);
}

fn previous(section: u32) -> u32 {
    return select(stretch.sections - 1u, section - 1u, section > 0u);
}

fn lap_time(candidate: u32) -> f32 {
    let n = stretch.sections;
    let start = select(0u, stretch.start, CLOSED);
    let steps = select(n - 1u, 2u * n, CLOSED);

    var here = start;
    var spot = spot_at(start, candidate);
    var speed_squared = 0.0;
    if CLOSED {
        let before = spot_at(previous(start), candidate);
        speed_squared = steered_corner(before.length, before.ground, spot.ground);
    } else {
        speed_squared = min(corner(spot.ground), stretch.entry);
    }
    speeds_squared[place_of(start, candidate)] = speed_squared;
    for (var i = 0u; i < steps; i++) {
        let next = select(0u, here + 1u, here + 1u < n);
        let there = spot_at(next, candidate);
        let reached = driven(may_open(here), speed_squared, spot.length, spot.ground, there.ground);
        // In the first round a section is limited by its corner speed alone.
        let again = i + 1u >= n;
        var most: f32;
        if again {
            most = speeds_squared[place_of(next, candidate)];
        } else {
            most = steered_corner(spot.length, spot.ground, there.ground);
        }
        let slower = reached < most;
        if again && !slower {
            break;
        }
        speed_squared = select(most, reached, slower);
        speeds_squared[place_of(next, candidate)] = speed_squared;
        spot = there;
        here = next;
    }

    var next = select(n - 1u, start, CLOSED);
    speed_squared = speeds_squared[place_of(next, candidate)];
    spot = spot_at(next, candidate);
    for (var i = 0u; i < steps; i++) {
        let before = previous(next);
        let there = spot_at(before, candidate);
        let reached = braked(speed_squared, there.length, end_of(there, spot.ground), there.ground);
        let known = speeds_squared[place_of(before, candidate)];
        let slower = reached < known;
        if slower {
            speeds_squared[place_of(before, candidate)] = reached;
        } else if i + 1u >= n {
            break;
        }
        speed_squared = select(known, reached, slower);
        spot = there;
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
        if HAS_RELIEF {
            relieve(candidate);
        }
        results[4u * stretch.stride + candidate] = lap_time(candidate);
    }
}
