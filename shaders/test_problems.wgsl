// Twin of `src/swarm/problems/zdt.rs`, `dtlz.rs` and `single.rs`: the test problems, one lane to a candidate. `PROBLEM` and
// `FACTOR` are generated. With `elementary.wgsl`. Drivers move literals to the outside of sums, so they are written
// there.

struct Task {
    candidates: u32,
    // Rows of a block of positions.
    rows: u32,
    variables: u32,
    objectives: u32,
}

// A variable is `lower + range * position - shift`.
struct Variable {
    lower: f32,
    range: f32,
    shift: f32,
    // Its row among the positions.
    row: u32,
}

@group(0) @binding(0) var<uniform> task: Task;
@group(0) @binding(1) var<storage, read> variables: array<Variable>;
@group(0) @binding(2) var<storage, read> position: array<f32>;
@group(0) @binding(3) var<storage, read_write> objectives: array<f32>;

var<private> who: u32;

fn x(v: u32) -> f32 {
    let variable = variables[v];
    let at = position[(who / 64u * task.rows + variable.row) * 64u + who % 64u];
    return (variable.lower + at * variable.range) - variable.shift;
}

fn give(k: u32, value: f32) {
    objectives[(who / 64u * task.objectives + k) * 64u + who % 64u] = value * FACTOR;
}

fn sin_pi(x: f32) -> f32 {
    return own_sin_pi(Wheels(x)).x;
}

fn cos_pi(x: f32) -> f32 {
    return own_cos_pi(Wheels(x)).x;
}

// The mean of all variables but the first.
fn mean_of_rest() -> f32 {
    var sum = 0.0;
    for (var v = 1u; v < task.variables; v++) { sum += x(v); }
    return sum / f32(task.variables - 1u);
}

fn zdt1() {
    let g = 1.0 + 9.0 * mean_of_rest();
    give(0u, x(0u));
    give(1u, g * (1.0 - sqrt(x(0u) / g)));
}

fn zdt2() {
    let g = 1.0 + 9.0 * mean_of_rest();
    let share = x(0u) / g;
    give(0u, x(0u));
    give(1u, g * (1.0 - share * share));
}

fn zdt3() {
    let g = 1.0 + 9.0 * mean_of_rest();
    let share = x(0u) / g;
    give(0u, x(0u));
    give(1u, g * (1.0 - sqrt(share) - share * sin_pi(10.0 * x(0u))));
}

fn zdt4() {
    var squares = 0.0;
    var cosines = 0.0;
    for (var v = 1u; v < task.variables; v++) {
        let y = x(v);
        squares += y * y;
        cosines += cos_pi(4.0 * y);
    }
    let g = 1.0 + (squares + 10.0 * (f32(task.variables - 1u) - cosines));
    give(0u, x(0u));
    give(1u, g * (1.0 - sqrt(x(0u) / g)));
}

fn zdt6() {
    let g = 1.0 + 9.0 * sqrt(sqrt(mean_of_rest()));
    let s = sin_pi(6.0 * x(0u));
    let s2 = s * s;
    let first = 1.0 - own_exp(Wheels(-4.0 * x(0u))).x * (s2 * s2 * s2);
    let share = first / g;
    give(0u, first);
    give(1u, g * (1.0 - share * share));
}

fn dtlz1() {
    var waves = 0.0;
    for (var v = 2u; v < task.variables; v++) {
        let y = x(v) - 0.5;
        waves += y * y - cos_pi(20.0 * y);
    }
    let size = 0.5 * (1.0 + 100.0 * (f32(task.variables - 2u) + waves));
    give(0u, size * x(0u) * x(1u));
    give(1u, size * x(0u) * (1.0 - x(1u)));
    give(2u, size * (1.0 - x(0u)));
}

fn dtlz2() {
    var sum = 0.0;
    for (var v = 2u; v < task.variables; v++) {
        let y = x(v) - 0.5;
        sum += y * y;
    }
    let size = 1.0 + sum;
    let a = 0.5 * x(0u);
    let b = 0.5 * x(1u);
    give(0u, size * cos_pi(a) * cos_pi(b));
    give(1u, size * cos_pi(a) * sin_pi(b));
    give(2u, size * sin_pi(a));
}

fn sphere() {
    var sum = 0.0;
    for (var v = 0u; v < task.variables; v++) {
        let y = x(v);
        sum += y * y;
    }
    give(0u, sum);
}

// With its optimum moved from one to zero.
fn rosenbrock() {
    var bends = 0.0;
    var squares = 0.0;
    for (var v = 0u; v + 1u < task.variables; v++) {
        let y = x(v);
        let bend = x(v + 1u) - (y * y + (y + y));
        bends += bend * bend;
        squares += y * y;
    }
    give(0u, 100.0 * bends + squares);
}

fn rastrigin() {
    var squares = 0.0;
    var cosines = 0.0;
    for (var v = 0u; v < task.variables; v++) {
        let y = x(v);
        squares += y * y;
        cosines += cos_pi(2.0 * y);
    }
    give(0u, squares + 10.0 * (f32(task.variables) - cosines));
}

fn ackley() {
    var squares = 0.0;
    var cosines = 0.0;
    for (var v = 0u; v < task.variables; v++) {
        let y = x(v);
        squares += y * y;
        cosines += cos_pi(2.0 * y);
    }
    let n = f32(task.variables);
    let root = sqrt(squares / n);
    let decays = own_exp(Wheels(-0.2 * root)).x;
    let waves = own_exp(Wheels(cosines / n)).x;
    give(0u, -20.0 * decays - waves + 22.718281828459045);
}

fn griewank() {
    var squares = 0.0;
    var product = 1.0;
    for (var v = 0u; v < task.variables; v++) {
        let y = x(v);
        squares += y * y;
        product *= own_cos(Wheels(y / sqrt(f32(v + 1u)))).x;
    }
    give(0u, squares / 4000.0 - product + 1.0);
}

@compute @workgroup_size(64)
fn test_problem(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    who = id.y * groups.x * 64u + id.x;
    if who >= task.candidates { return; }
    switch PROBLEM {
        case 0u: { zdt1(); }
        case 1u: { zdt2(); }
        case 2u: { zdt3(); }
        case 3u: { zdt4(); }
        case 4u: { zdt6(); }
        case 5u: { dtlz1(); }
        case 6u: { dtlz2(); }
        case 7u: { sphere(); }
        case 8u: { rosenbrock(); }
        case 9u: { rastrigin(); }
        case 10u: { ackley(); }
        default: { griewank(); }
    }
}
