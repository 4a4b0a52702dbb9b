// Twin of `src/swarm/mopso/blocks.rs`: how the particles of a large swarm learn and move. One lane to a particle, state
// in blocks: a coordinate of all particles of a block lies in a row, and the coordinates of a block follow one another.
// With `elementary.wgsl` and `random.wgsl`.

// Figures that all particles of a generation share.
struct Generation {
    key: vec2<u32>,
    when: u32,
    particles: u32,
    dimensions: u32,
    objectives: u32,
    members: u32,
    // Members that pushed particles follow, behind the others; none where they follow the same.
    pushed_members: u32,
    signed: u32,
    per_dimension: u32,
    tournament: u32,
    // One where a row more than those of the objectives says by how much particles violate constraints.
    constrained: u32,
    // By how much the members of the archive do.
    violation: f32,
    // The violation that counts as none for pushed particles, and for an archive that they follow.
    allowance: f32,
    inertia: f32,
    cognitive: f32,
    social: f32,
    speed_limit: f32,
    rebound: f32,
    crossings: f32,
    no_pulls: f32,
    mutation_share: f32,
    mutation_power: f32,
    mutation_root: f32,
    pulls: vec2<f32>,
}

const BLOCK: u32 = 64u;
const UNKNOWN: f32 = 3.4028234e38;
// Objectives of this size and more say in their last eight bits why a particle failed; this many reasons are told apart.
const FAILED: u32 = 0x7f7fff00u;
const REASONS: u32 = 13u;
// One particle of so many keeps to the constraints; the others are pushed.
const KEEPING: u32 = 2u;
const SCALE: f32 = 0.5;
const CROSSOVER: f32 = 0.3;
const ALL_COORDINATES: f32 = 0.3;
const CROSSING_POWER: f32 = 21.0;
const MUTATION_POWER: f32 = 9.0;
const ANYWHERE: f32 = 0.15;

// What random draws are for, the counter's last word.
const START: u32 = 1u;
const COGNITIVE: u32 = 2u;
const SOCIAL: u32 = 3u;
const MUTATION: u32 = 5u;
const DIFFERENCE: u32 = 6u;
const COIN: u32 = 7u;
const PULLS: u32 = 8u;
const RECOMBINE: u32 = 9u;

@group(0) @binding(0) var<uniform> generation: Generation;
// Of the archive's members: to note who may enter it their objectives, three to each; to move their positions, ordered by their
// contribution, the greatest first.
@group(0) @binding(1) var<storage, read> archive: array<f32>;
@group(0) @binding(2) var<storage, read_write> position: array<f32>;
@group(0) @binding(3) var<storage, read_write> velocity: array<f32>;
@group(0) @binding(4) var<storage, read_write> best_position: array<f32>;
@group(0) @binding(5) var<storage, read_write> best_objectives: array<f32>;
@group(0) @binding(6) var<storage, read_write> objectives: array<f32>;
// How many points may enter the archive, the bits of the least and the greatest violation of a particle, and how many failed for each
// reason; then those points: the particle and its objectives, three to each.
struct Found {
    count: atomic<u32>,
    least: atomic<u32>,
    most: atomic<u32>,
    failed: array<atomic<u32>, REASONS>,
    points: array<vec4<u32>>,
}
@group(0) @binding(7) var<storage, read_write> found: Found;

fn words(purpose: u32, who: u32, index: u32) -> vec4<u32> {
    return philox(vec4<u32>(index, who, generation.when, purpose), generation.key);
}

// Where coordinate `k` of `width` of a particle stands.
fn place(who: u32, width: u32, k: u32) -> u32 {
    return (who / BLOCK * width + k) * BLOCK + who % BLOCK;
}

// Rows of objectives.
fn rows() -> u32 {
    return generation.objectives + generation.constrained;
}

fn is_pushed(who: u32) -> bool {
    return who % KEEPING != 0u;
}

// The bits of the violation that counts where one of this allowance counts as none.
fn counted(violation: f32, allowance: f32) -> u32 {
    let size = size_of(max(violation, 0.0));
    return select(size, 0u, size <= size_of(allowance));
}

// Where the leaders of a particle begin, and how many there are.
fn led_by(who: u32) -> vec2<u32> {
    if is_pushed(who) && generation.pushed_members > 0u { return vec2<u32>(generation.members, generation.pushed_members); }
    return vec2<u32>(0u, generation.members);
}

fn held(x: f32) -> f32 {
    return min(max(x, 0.0), 1.0);
}

@compute @workgroup_size(BLOCK)
fn scatter(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let who = id.y * groups.x * BLOCK + id.x;
    if who >= generation.particles { return; }
    scatter_one(who, vec2<u32>(0u, generation.dimensions));
    for (var k = 0u; k < generation.dimensions; k++) {
        let i = place(who, generation.dimensions, k);
        best_position[i] = position[i];
    }
    for (var k = 0u; k < rows(); k++) {
        best_objectives[place(who, rows(), k)] = UNKNOWN;
    }
}

fn scatter_one(who: u32, slice: vec2<u32>) {
    var four = vec4<u32>(0u);
    for (var k = slice.x; k < slice.y; k++) {
        if k % 4u == 0u { four = words(START, who, k / 4u); }
        let i = place(who, generation.dimensions, k);
        position[i] = unit(four[k % 4u]);
        velocity[i] = 0.0;
    }
}

// Takes positions for personal bests where they violate less, or as much and their objectives are better; where neither is better, at
// random. Counts failures.
@compute @workgroup_size(BLOCK)
fn learn(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let who = id.y * groups.x * BLOCK + id.x;
    if who >= generation.particles { return; }
    let width = rows();
    var no_worse = true;
    var no_better = true;
    // Of violations, which count first.
    var less = false;
    var more = false;
    var violation = 0.0;
    let allowance = select(0.0, generation.allowance, is_pushed(who));
    var sound = true;
    var reason = 0u;
    for (var k = 0u; k < width; k++) {
        let i = place(who, width, k);
        let value = objectives[i];
        let best = best_objectives[i];
        if k < generation.objectives {
            no_worse = no_worse && value <= best;
            no_better = no_better && best <= value;
        } else {
            violation = max(value, 0.0);
            let counts = counted(value, allowance);
            let known = counted(best, allowance);
            less = counts < known;
            more = counts > known;
        }
        let size = size_of(value);
        if size >= FAILED {
            sound = false;
            // What is no number, or a number beyond the costs, has the first reason.
            reason = select(0u, size - FAILED, size - FAILED < REASONS);
        }
    }
    if !sound {
        atomicAdd(&found.failed[reason], 1u);
        return;
    }
    if generation.constrained == 1u {
        atomicMin(&found.least, size_of(violation));
        atomicMax(&found.most, size_of(violation));
    }
    let heads = words(COIN, who, 0u).x < 0x80000000u;
    let better = no_worse && !no_better;
    let open = no_worse == no_better;
    if less || (!more && (better || (open && heads))) {
        for (var k = 0u; k < generation.dimensions; k++) {
            let i = place(who, generation.dimensions, k);
            best_position[i] = position[i];
        }
        for (var k = 0u; k < width; k++) {
            let i = place(who, width, k);
            best_objectives[i] = objectives[i];
        }
    }
}

// The bits of the size of an objective, in the order of the sizes.
fn size_of(value: f32) -> u32 {
    return bitcast<u32>(value) & 0x7fffffffu;
}

// Objectives of the block's particles; those of particles that may not enter the archive dominate nothing.
var<workgroup> block: array<vec3<f32>, BLOCK>;

// Notes the particles that neither a member of the archive nor another particle of their block dominates or equals; of equal ones the
// first.
@compute @workgroup_size(BLOCK)
fn note(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let who = id.y * groups.x * BLOCK + id.x;
    var at = vec3<f32>(UNKNOWN);
    if who < generation.particles { at = may_enter(who); }
    block[lane] = at;
    workgroupBarrier();
    if at.x == UNKNOWN { return; }
    for (var other = 0u; other < BLOCK; other++) {
        let its = block[other];
        if all(its <= at) && (other < lane || any(its != at)) { return; }
    }
    let slot = atomicAdd(&found.count, 1u);
    found.points[slot] = vec4<u32>(who, bitcast<vec3<u32>>(at));
}

// The objectives of a particle; unknown ones if it has failed, violates more than the least that is known, or a member of the archive
// dominates or equals it.
fn may_enter(who: u32) -> vec3<f32> {
    var at = vec3<f32>(0.0);
    for (var k = 0u; k < generation.objectives; k++) {
        at[k] = objectives[place(who, rows(), k)];
        if size_of(at[k]) >= FAILED { return vec3<f32>(UNKNOWN); }
    }
    if generation.constrained == 1u {
        let value = objectives[place(who, rows(), generation.objectives)];
        let least = counted(bitcast<f32>(atomicLoad(&found.least)), generation.allowance);
        let known = size_of(generation.violation);
        let counts = counted(value, generation.allowance);
        if size_of(value) >= FAILED || counts > min(least, known) { return vec3<f32>(UNKNOWN); }
        // The members leave.
        if least < known { return at; }
    }
    for (var i = 0u; i < 3u * generation.members; i += 3u) {
        if archive[i] <= at.x && archive[i + 1u] <= at.y && archive[i + 2u] <= at.z { return vec3<f32>(UNKNOWN); }
    }
    return at;
}

// What a particle does, in the order in which a block does it; those that are disturbed as well stand together.
const CROSSES: u32 = 0u;
const IS_PULLED: u32 = 1u;
const IS_PULLED_AND_DISTURBED: u32 = 2u;
const DIFFERS_AND_IS_DISTURBED: u32 = 3u;
const DIFFERS: u32 = 4u;
// Beyond the last particle.
const IS_ABSENT: u32 = 5u;

// How many of the block do each, and its particles in that order: the particle, its leader and what it does.
var<workgroup> doing: array<atomic<u32>, 6>;
var<workgroup> turns: array<vec3<u32>, BLOCK>;

// Moves a slice of the coordinates of a block's particles: along the third dimension of the dispatch lie the slices of a block. Draws
// go by fours. Particles that do the same are neighbours, as lanes of a subgroup wait for those that do something else.
@compute @workgroup_size(BLOCK)
fn advance(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let d = generation.dimensions;
    let width = ((d + groups.z - 1u) / groups.z + 3u) / 4u * 4u;
    let slice = vec2<u32>(id.z * width, min((id.z + 1u) * width, d));
    let particle = id.y * groups.x * BLOCK + id.x;
    if generation.members == 0u {
        // The archive is empty: nothing to learn from yet.
        if particle < generation.particles { scatter_one(particle, slice); }
        return;
    }
    var mine = vec3<u32>(particle, 0u, IS_ABSENT);
    if particle < generation.particles { mine = turn_of(particle); }
    let rank = atomicAdd(&doing[mine.z], 1u);
    workgroupBarrier();
    var at = rank;
    for (var other = 0u; other < mine.z; other++) { at += atomicLoad(&doing[other]); }
    turns[at] = mine;
    workgroupBarrier();
    let turn = turns[lane];
    let what = turn.z;
    if what == CROSSES { cross_one(turn.x, turn.y, slice); }
    if what == IS_PULLED || what == IS_PULLED_AND_DISTURBED { pull_one(turn.x, turn.y, slice); }
    if what == DIFFERS || what == DIFFERS_AND_IS_DISTURBED { differ_one(turn.x, turn.y, slice); }
    if what == IS_PULLED_AND_DISTURBED || what == DIFFERS_AND_IS_DISTURBED { disturb_one(turn.x, slice); }
}

fn turn_of(who: u32) -> vec3<u32> {
    let choice = words(RECOMBINE, who, 0u);
    let leaders = led_by(who);
    var leader = below(choice.y, leaders.y);
    if generation.tournament == 1u { leader = min(leader, below(choice.z, leaders.y)); }
    leader += leaders.x;
    let coin = unit(choice.x);
    let disturbed = unit(choice.w) < generation.mutation_share;
    var what = select(IS_PULLED, IS_PULLED_AND_DISTURBED, disturbed);
    if coin < generation.no_pulls { what = select(DIFFERS, DIFFERS_AND_IS_DISTURBED, disturbed); }
    if coin < generation.crossings { what = CROSSES; }
    return vec3<u32>(who, leader, what);
}

// Shares of the velocity and of the ways to the own best and to the leader.
struct Pulls {
    inertia: f32,
    own: f32,
    social: f32,
}

fn pulls_of(draws: vec4<u32>) -> Pulls {
    if generation.signed == 0u { return Pulls(generation.inertia, generation.cognitive, generation.social); }
    let c1 = generation.pulls.x + generation.pulls.y * unit(draws.x);
    let c2 = generation.pulls.x + generation.pulls.y * unit(draws.y);
    let sum = c1 + c2;
    let beyond = sum - 4.0;
    let root = sqrt(sum * max(beyond, 0.0));
    let chi = select(1.0, 2.0 / (-2.0 - beyond - root), beyond > 0.0);
    return Pulls(chi * generation.inertia, chi * c1, chi * c2);
}

// By inertia and the pulls to the own best and to the leader.
fn pull_one(who: u32, leader: u32, slice: vec2<u32>) {
    let d = generation.dimensions;
    let draws = words(PULLS, who, 0u);
    let pulls = pulls_of(draws);
    if generation.per_dimension == 0u {
        let shares = Pulls(pulls.inertia, pulls.own * unit(draws.z), pulls.social * unit(draws.w));
        for (var k = slice.x; k < slice.y; k++) { pull_coordinate(place(who, d, k), archive[leader * d + k], shares); }
        return;
    }
    for (var four = slice.x / 4u; 4u * four < slice.y; four++) {
        let first = words(COGNITIVE, who, four);
        let second = words(SOCIAL, who, four);
        for (var k = 4u * four; k < min(4u * four + 4u, slice.y); k++) {
            let shares = Pulls(pulls.inertia, pulls.own * unit(first[k % 4u]), pulls.social * unit(second[k % 4u]));
            pull_coordinate(place(who, d, k), archive[leader * d + k], shares);
        }
    }
}

fn pull_coordinate(i: u32, towards: f32, shares: Pulls) {
    let x = position[i];
    let wanted = shares.inertia * velocity[i] + shares.own * (best_position[i] - x) + shares.social * (towards - x);
    let speed = min(max(wanted, -generation.speed_limit), generation.speed_limit);
    let moved = x + speed;
    let inside = held(moved);
    velocity[i] = select(speed * generation.rebound, speed, moved == inside);
    position[i] = inside;
}

// From an archive member along the difference of two others, in some of the coordinates or in all.
fn differ_one(who: u32, leader: u32, slice: vec2<u32>) {
    let d = generation.dimensions;
    let picks = words(DIFFERENCE, who, 0u);
    let leaders = led_by(who);
    let one = leaders.x + below(picks.x, leaders.y);
    let two = leaders.x + below(picks.y, leaders.y);
    let always = below(picks.z, d);
    let whole = unit(picks.w) < ALL_COORDINATES;
    for (var four = slice.x / 4u; 4u * four < slice.y; four++) {
        let draws = words(DIFFERENCE, who, 1u + four);
        for (var k = 4u * four; k < min(4u * four + 4u, slice.y); k++) {
            let chosen = whole || k == always || unit(draws[k % 4u]) < CROSSOVER;
            let step = SCALE * (archive[one * d + k] - archive[two * d + k]);
            let i = place(who, d, k);
            position[i] = held(archive[leader * d + k] + select(0.0, step, chosen));
            velocity[i] = 0.0;
        }
    }
}

// Polynomial mutation of each coordinate with probability one over their number.
fn disturb_one(who: u32, slice: vec2<u32>) {
    let d = generation.dimensions;
    for (var two = slice.x / 2u; 2u * two < slice.y; two++) {
        let draws = words(MUTATION, who, two);
        for (var k = 2u * two; k < min(2u * two + 2u, slice.y); k++) {
            let pair = 2u * (k % 2u);
            if unit(draws[pair]) * f32(d) < 1.0 {
                let i = place(who, d, k);
                position[i] =
                    polynomial(position[i], unit(draws[pair + 1u]), generation.mutation_power, generation.mutation_root);
            }
        }
    }
}

// To a place between or about two archive members, each coordinate by itself, disturbed by mutation.
fn cross_one(who: u32, leader: u32, slice: vec2<u32>) {
    let d = generation.dimensions;
    let leaders = led_by(who);
    let other = leaders.x + below(words(RECOMBINE, who, 1u).x, leaders.y);
    for (var k = slice.x; k < slice.y; k++) {
        let draws = words(RECOMBINE, who, 2u + k);
        var x = cross_coordinates(archive[leader * d + k], archive[other * d + k], draws.x, unit(draws.y));
        let mutates = unit(draws.z) * f32(d);
        if mutates < ANYWHERE {
            x = unit(draws.w);
        } else if mutates < 1.0 {
            x = polynomial(x, unit(draws.w), MUTATION_POWER, 1.0 / MUTATION_POWER);
        }
        let i = place(who, d, k);
        position[i] = x;
        velocity[i] = 0.0;
    }
}

// The coordinate of `one` by half of the words at random, each of the two children of both by a quarter.
fn cross_coordinates(one: f32, other: f32, word: u32, uniform_draw: f32) -> f32 {
    let below_both = word < 0x40000000u;
    let low = select(other, one, one < other);
    let high = select(one, other, one < other);
    let gap = high - low;
    // Of two that are the same there is no other.
    if word >= 0x80000000u || gap == 0.0 { return one; }
    let room = select(1.0 - high, low, below_both);
    let share = uniform_draw * (2.0 - own_power(gap / (gap + (room + room)), CROSSING_POWER));
    let near = share <= 1.0;
    let root = own_power(select(2.0 - share, share, near), 1.0 / CROSSING_POWER);
    let half = 0.5 * (gap * select(1.0 / root, root, near));
    let middle = 0.5 * (low + high);
    return held(select(middle + half, middle - half, below_both));
}

fn polynomial(x: f32, uniform_draw: f32, exponent: f32, inverse: f32) -> f32 {
    let low = uniform_draw < 0.5;
    let part = select(2.0 - (uniform_draw + uniform_draw), uniform_draw + uniform_draw, low);
    let room = select(x, 1.0 - x, low);
    let base = part + (1.0 - part) * own_power(room, exponent);
    let step = own_power(base, inverse) - 1.0;
    return held(select(x - step, x + step, low));
}
