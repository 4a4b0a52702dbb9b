// Twin of `src/line/energy/kernel.rs`: a lap on a line's lengths and curvatures with engine, motor-generators and store.
//
// Follows `line.wgsl`, whose course, envelope and variables it reads. The figures of the strategy are the variables from row
// STRATEGY on. The constants STRATEGY, ADDITIONAL, COUNTS_CHARGE, FLOWS_AT, BOOSTS_AT and ZONES_AT are generated: where in
// `energy` the flows, the boosts and the zones begin, after the forces. So is binding 10, `energy`, an array of vectors of four:
// rows of engine, motor, generator, drag and of their rises; of flows at four loads and of their rises; of the motor, the room
// for it, what the MGU-H takes and adds, and of their rises; of each section's zone, position and one over its share.

// Twin of `EnergyAccount` in `src/evaluate/energy/gpu.rs`.
struct EnergyAccount {
    mass: f32,
    rotating: f32,
    deploy_cost: f32,
    harvest_gain: f32,
    force_per_deployed: f32,
    force_per_harvested: f32,
    harvest_most: f32,
    store_room: f32,
    exhaust_gain: f32,
    exhaust_cost: f32,
    assist_extra: f32,
    assist_share: f32,
    exhaust_from: f32,
    exhaust_to_ax: f32,
    rows_per_speed_squared: f32,
    // The section that a lap is run in from.
    run_in: u32,
}

@group(0) @binding(9) var<uniform> account: EnergyAccount;

struct EnergyState {
    speed_squared: f32,
    change: f32,
    deployed: f32,
    harvested_k: f32,
}

struct Step {
    end: f32,
    motor: f32,
    assist: f32,
}

struct SegmentEnergy {
    time: f32,
    fuel: f32,
    deployed: f32,
    harvested_k: f32,
    harvested_h: f32,
}

// The gates of steering, speed squared and acceleration, the floor of the charge, the budget and the share of the motor, read once.
struct Gates {
    curvature: f32,
    speed_squared: f32,
    ax: f32,
    floor: f32,
    budget: f32,
    motor: f32,
}

var<private> gates: Gates;

fn strategy(figure: u32, candidate: u32) -> f32 {
    return variable(STRATEGY + figure, candidate);
}

fn zone_share(section: u32, candidate: u32) -> f32 {
    let zone = energy[ZONES_AT + section];
    let into = (strategy(6u + u32(zone.x), candidate) - zone.y) * zone.z;
    return min(max(into, 0.0), 1.0);
}

fn gates_open(curvature: f32, speed_squared: f32) -> bool {
    return !(gates.curvature < curvature) && !(gates.speed_squared < speed_squared);
}

// A remainder below this is left in the store. Rounding would spend it in ever smaller shares.
const LEAST_J: f32 = 5.0;

fn store_left(state: EnergyState) -> f32 {
    let of_charge = state.change - gates.floor;
    let of_budget = gates.budget - state.deployed;
    let left = min(of_charge, of_budget);
    return select(left, 0.0, left < LEAST_J);
}

// What the store takes yet.
fn store_space(state: EnergyState) -> f32 {
    return account.store_room - state.change;
}

fn spins(speed_squared: f32, ax: f32) -> bool {
    return !(speed_squared < account.exhaust_from) && 0.0 < ax && !(account.exhaust_to_ax < ax);
}

// The drag with the DRS shut, what an open one sheds of it, and what the tyres take on a section's segment.
fn resistance(section: u32, speed_squared: f32, ground: Ground, level_drag: f32) -> vec3<f32> {
    if !HAS_RELIEF && !HAS_TRACTION && !HAS_DRS {
        return vec3<f32>(level_drag, 0.0, 0.0);
    }
    let shut = driving_with_drs(false, speed_squared, ground);
    let drag = select(level_drag, shut.z, HAS_RELIEF);
    if !may_open(section) {
        return vec3<f32>(drag, 0.0, shut.w);
    }
    let open = driving_with_drs(true, speed_squared, ground);
    return vec3<f32>(drag, shut.z - open.z, open.w);
}

fn additional(
    section: u32,
    start: f32,
    length: f32,
    here: Ground,
    there: Ground,
    most: f32,
    left: f32,
    space: f32,
    candidate: u32,
) -> Step {
    let drs = may_open(section);
    let first = driving_with_drs(drs, start, here);
    let alone = uphill(min(first.x, first.y) - first.z, here);
    let ahead = max(start + length * alone, 0.0);
    let held = min(max(ahead * account.rows_per_speed_squared, 0.0), f32(ENVELOPE_ROWS));
    let row = min(u32(held), ENVELOPE_ROWS - 1u);
    let figures = energy[BOOSTS_AT + 2u * row] + (held - f32(row)) * energy[BOOSTS_AT + 2u * row + 1u];
    let greatest = min(figures.x * gates.motor, figures.y);
    let may = gates_open(abs(here.bend), start) && gates.ax < alone;
    let share = zone_share(section, candidate);
    let inverse = 1.0 / length;
    let reach = left * account.force_per_deployed * inverse / account.rotating;
    let slow = start < account.exhaust_from;
    let gain = select(0.0, min(figures.w, figures.y - greatest), slow);
    // The MGU-K first, whose joules are cheaper.
    let both_wanted = select(0.0, (greatest + gain) * share, may);
    let wanted = min(both_wanted, greatest);
    let own = min(wanted, reach);
    let assist = min(both_wanted - wanted, (reach - own) * account.assist_share);
    let boost = own + assist;

    let turns = spins(start, uphill(min(first.x, first.y + boost) - first.z, here)) && LEAST_J < space;
    let exhaust = select(0.0, figures.z, turns);

    let drive = first.y - exhaust;
    let engine = min(first.x, drive);
    let both = min(first.x, drive + boost);
    let gained = uphill(both - first.z, here);
    let middle = max(start + length * gained, 0.0);
    let between = half_way(here, there);
    let later = driving_with_drs(drs, middle, between);
    let later_drive = later.y - exhaust;
    let later_both = min(later.x, later_drive + boost);
    let motor = 0.5 * ((both - engine) + (later_both - min(later.x, later_drive)));
    let reached = max(start + length * (gained + uphill(later_both - later.z, between)), 0.0);
    let end = min(reached, most);
    // Where less force is needed than both can give, the motor is reduced first, and of the motors the dearer one.
    let spare = 0.5 * (reached - end) * inverse;
    let motors = max(motor - spare, 0.0);
    return Step(end, motors, min(assist, max(motors - own, 0.0)));
}

fn engine_only(section: u32, start: f32, length: f32, here: Ground, there: Ground, most: f32) -> f32 {
    let drs = may_open(section);
    let at_start = driving_with_drs(drs, start, here);
    let first = uphill(min(at_start.x, at_start.y) - at_start.z, here);
    let middle = max(start + length * first, 0.0);
    let between = half_way(here, there);
    let later = driving_with_drs(drs, middle, between);
    let second = uphill(min(later.x, later.y) - later.z, between);
    return min(max(start + length * (first + second), 0.0), most);
}

// One segment of the lap that only finds the speed at the start line.
fn provisional(
    state: ptr<function, EnergyState>,
    section: u32,
    length: f32,
    here: Ground,
    there: Ground,
    most: f32,
    candidate: u32,
) {
    let start = (*state).speed_squared;
    let space = store_space(*state);
    let step = additional(section, start, length, here, there, most, store_left(*state), space, candidate);
    let joules = account.mass * length;
    let deployed = joules * (account.rotating * step.motor) * account.deploy_cost
        + joules * (account.rotating * step.assist) * account.assist_extra;
    (*state).speed_squared = step.end;
    (*state).deployed = (*state).deployed + deployed;
    (*state).change = (*state).change - deployed;
    if COUNTS_CHARGE {
        let mean = 0.5 * (start + step.end);
        let held = min(max(mean * account.rows_per_speed_squared, 0.0), f32(ENVELOPE_ROWS));
        let row = min(u32(held), ENVELOPE_ROWS - 1u);
        let forces = energy[2u * row] + (held - f32(row)) * energy[2u * row + 1u];
        let inverse = 1.0 / length;
        let taken = resistance(section, mean, half_way(here, there), forces.w);
        let force = account.rotating * (0.5 * (step.end - start) * inverse) + taken.x + taken.z + here.climb;
        let unharvested = min(account.harvest_most - (*state).harvested_k, space);
        let room = max(unharvested * account.force_per_harvested * inverse, 0.0);
        let generator = min(min(max(-force, 0.0), forces.z * gates.motor), room);
        let harvested_k = joules * generator * account.harvest_gain;
        (*state).change = (*state).change + harvested_k;
        (*state).harvested_k = (*state).harvested_k + harvested_k;
    }
}

// Least energy at the wheels for a joule of the MGU-H that is told from none.
const LEAST_COST: f32 = 1e-6;

// The flow of fuel at a load, between those at 0, 1/3, 2/3 and 1.
fn flow_at(flows: vec4<f32>, load: f32) -> f32 {
    let thirds = 3.0 * load;
    return flows.x
        + (flows.y - flows.x) * min(thirds, 1.0)
        + (flows.z - flows.y) * min(max(thirds - 1.0, 0.0), 1.0)
        + (flows.w - flows.z) * max(thirds - 2.0, 0.0);
}

fn segment_energy(
    state: ptr<function, EnergyState>,
    section: u32,
    length: f32,
    here: Ground,
    there: Ground,
    most: f32,
    candidate: u32,
) -> SegmentEnergy {
    let start = (*state).speed_squared;
    let left = store_left(*state);
    let space = store_space(*state);
    var step: Step;
    if ADDITIONAL {
        step = additional(section, start, length, here, there, most, left, space, candidate);
    } else {
        step = Step(engine_only(section, start, length, here, there, most), 0.0, 0.0);
    }
    let end = step.end;
    let mean = 0.5 * (start + end);
    let held = min(max(mean * account.rows_per_speed_squared, 0.0), f32(ENVELOPE_ROWS));
    let row = min(u32(held), ENVELOPE_ROWS - 1u);
    let beyond = held - f32(row);
    let forces = energy[2u * row] + beyond * energy[2u * row + 1u];
    let inverse = 1.0 / length;
    let ax = 0.5 * (end - start) * inverse;
    // The force at the wheels, driving or braking.
    let taken = resistance(section, mean, half_way(here, there), forces.w);
    let shut = account.rotating * ax + taken.x + taken.z + here.climb;
    let open = shut - taken.y;
    // A driver shuts the flap on the brakes.
    let force = max(open, 0.0) + min(shut, 0.0);
    let demand = max(force, 0.0);
    let shed = max(-force, 0.0);
    let joules = account.mass * length;
    var motor: f32;
    var assist = 0.0;
    if ADDITIONAL {
        motor = min(account.rotating * step.motor, demand);
        let unneeded = account.rotating * step.motor - motor;
        assist = max(account.rotating * step.assist - unneeded, 0.0);
    } else {
        let may = gates_open(abs(here.bend), start) && gates.ax < ax;
        let share = zone_share(section, candidate);
        let reach = left * account.force_per_deployed * inverse;
        motor = min(min(select(0.0, forces.y * gates.motor * share, may), demand), reach);
    }
    let engine = demand - motor;
    let unharvested = min(account.harvest_most - (*state).harvested_k, space);
    let room = unharvested * account.force_per_harvested * inverse;
    let generator = min(min(shed, forces.z * gates.motor), max(room, 0.0));
    let deployed = joules * motor * account.deploy_cost + joules * assist * account.assist_extra;
    let harvested_k = joules * generator * account.harvest_gain;

    let flows = energy[FLOWS_AT + 2u * row] + beyond * energy[FLOWS_AT + 2u * row + 1u];
    let time = 2.0 * length / (sqrt(start) + sqrt(end));
    // The MGU-H generates by the flow of the exhaust, while the store has space and the engine power to spare for it. The engine
    // then burns for its load at the wheels and for this.
    let space_left = max(space + (deployed - harvested_k), 0.0);
    let spare = joules * max(forces.x - engine, 0.0) / max(account.exhaust_cost, LEAST_COST);
    let driving = min(engine / max(forces.x, 1e-3), 1.0);
    let exhaust = account.exhaust_gain * (flow_at(flows, driving) * time);
    let turns = spins(mean, ax) && !(0.0 < assist);
    let harvested_h = select(0.0, min(min(exhaust, spare), space_left), turns);
    let crank = engine + account.exhaust_cost * harvested_h / joules;
    let load = min(crank / max(forces.x, 1e-3), 1.0);

    (*state).speed_squared = end;
    (*state).change = (*state).change + ((harvested_k + harvested_h) - deployed);
    (*state).deployed = (*state).deployed + deployed;
    (*state).harvested_k = (*state).harvested_k + harvested_k;
    return SegmentEnergy(time, flow_at(flows, load) * time, deployed, harvested_k, harvested_h);
}

// Fills `speeds_squared` with the greatest speeds squared from which the car can brake for all that follows.
fn ceilings(candidate: u32) {
    let n = stretch.sections;
    let last = select(n - 1u, stretch.start, CLOSED);
    var spot = spot_at(last, candidate);
    var here = previous(last);
    var there = spot_at(here, candidate);
    var speed_squared = steered_corner(there.length, there.ground, spot.ground);
    speeds_squared[place_of(last, candidate)] = speed_squared;
    // In the first round a section is limited by its corner speed alone. On a closed line the pass continues until it meets its
    // own values.
    let steps = select(n - 1u, 2u * n, CLOSED);
    for (var i = 0u; i < steps; i++) {
        let before = previous(here);
        let earlier = spot_at(before, candidate);
        let reached = braked(speed_squared, there.length, end_of(there, spot.ground), there.ground);
        let again = i + 1u >= n;
        var most: f32;
        if again {
            most = speeds_squared[place_of(here, candidate)];
        } else if !CLOSED && here == 0u {
            most = corner(there.ground);
        } else {
            most = steered_corner(earlier.length, earlier.ground, there.ground);
        }
        let slower = reached < most;
        if again && !slower {
            break;
        }
        speed_squared = select(most, reached, slower);
        speeds_squared[place_of(here, candidate)] = speed_squared;
        spot = there;
        there = earlier;
        here = before;
    }
    if !CLOSED {
        let first = place_of(0u, candidate);
        speeds_squared[first] = min(speeds_squared[first], stretch.entry);
    }
}

fn energy_lap(candidate: u32) {
    gates = Gates(
        strategy(0u, candidate),
        strategy(1u, candidate),
        strategy(2u, candidate),
        strategy(3u, candidate),
        strategy(4u, candidate),
        strategy(5u, candidate),
    );
    ceilings(candidate);
    let n = stretch.sections;
    var speed_squared = speeds_squared[place_of(0u, candidate)];
    if CLOSED {
        // From a slow section late in the lap to the start line, with the store taken as full enough.
        var from_late = speeds_squared[place_of(account.run_in, candidate)];
        var spot = spot_at(account.run_in, candidate);
        for (var here = account.run_in; here < n; here++) {
            let after = select(0u, here + 1u, here + 1u < n);
            let there = spot_at(after, candidate);
            let end = end_of(spot, there.ground);
            let most = speeds_squared[place_of(after, candidate)];
            if ADDITIONAL {
                let space = account.store_room + gates.budget;
                from_late = additional(
                    here, from_late, spot.length, spot.ground, end, most, gates.budget, space, candidate
                ).end;
            } else {
                from_late = engine_only(here, from_late, spot.length, spot.ground, end, most);
            }
            spot = there;
        }
        speed_squared = from_late;
        if ADDITIONAL {
            var state = EnergyState(speed_squared, 0.0, 0.0, 0.0);
            var spot = spot_at(0u, candidate);
            for (var here = 0u; here < n; here++) {
                let after = select(0u, here + 1u, here + 1u < n);
                let there = spot_at(after, candidate);
                let most = speeds_squared[place_of(after, candidate)];
                let end = end_of(spot, there.ground);
                provisional(&state, here, spot.length, spot.ground, end, most, candidate);
                spot = there;
            }
            speed_squared = state.speed_squared;
        }
    }

    // The twin reuses results of the first drive where the second one would give the same. That changes nothing but the time it
    // takes.
    var state = EnergyState(speed_squared, 0.0, 0.0, 0.0);
    var greatest = 0.0;
    var least = 0.0;
    var total = SegmentEnergy(0.0, 0.0, 0.0, 0.0, 0.0);
    var total_motor = 0.0;
    var block = SegmentEnergy(0.0, 0.0, 0.0, 0.0, 0.0);
    var block_motor = 0.0;
    let segments = select(n - 1u, n, CLOSED);
    var spot = spot_at(0u, candidate);
    for (var here = 0u; here < segments; here++) {
        let after = select(0u, here + 1u, here + 1u < n);
        let there = spot_at(after, candidate);
        let most = speeds_squared[place_of(after, candidate)];
        let end = end_of(spot, there.ground);
        let segment = segment_energy(&state, here, spot.length, spot.ground, end, most, candidate);
        spot = there;
        block.time = block.time + segment.time;
        block.fuel = block.fuel + segment.fuel;
        block.deployed = block.deployed + segment.deployed;
        block.harvested_k = block.harvested_k + segment.harvested_k;
        block.harvested_h = block.harvested_h + segment.harvested_h;
        block_motor = block_motor + select(0.0, segment.time, 0.0 < segment.deployed);
        greatest = max(greatest, state.change);
        least = min(least, state.change);
        if (here + 1u) % BLOCK == 0u || here + 1u == segments {
            total.time = total.time + block.time;
            total.fuel = total.fuel + block.fuel;
            total.deployed = total.deployed + block.deployed;
            total.harvested_k = total.harvested_k + block.harvested_k;
            total.harvested_h = total.harvested_h + block.harvested_h;
            total_motor = total_motor + block_motor;
            block = SegmentEnergy(0.0, 0.0, 0.0, 0.0, 0.0);
            block_motor = 0.0;
        }
    }
    results[candidate] = total.time;
    results[stretch.stride + candidate] = total.fuel;
    results[2u * stretch.stride + candidate] = total.deployed;
    results[3u * stretch.stride + candidate] = total.harvested_k;
    results[4u * stretch.stride + candidate] = total.harvested_h;
    results[5u * stretch.stride + candidate] = state.change;
    results[6u * stretch.stride + candidate] = greatest - least;
    results[7u * stretch.stride + candidate] = total_motor;
}

@compute @workgroup_size(WORKGROUP)
fn energy_line(@builtin(global_invocation_id) id: vec3<u32>) {
    let candidate = stretch.first + id.x;
    if candidate >= stretch.candidates {
        return;
    }
    _ = shape(candidate);
    if HAS_RELIEF {
        relieve(candidate);
    }
    energy_lap(candidate);
}
