// Twin of `src/evaluate/steady/kernel.rs`: a car that settles on a circle at a constant path speed. The candidate's other figures
// are speed and steering. Its state is that of `Settling::to_array`.

// Twin of `DevicePlan` in `src/evaluate/steady/gpu.rs`.
struct SettlePlan {
    // Length of a step, s.
    step: f32,
    // Share of the steering angle that each of the first steps adds.
    steer_per_step: f32,
    // How fast slip follows the push, s/m.
    gain: f32,
}

@group(0) @binding(4) var<uniform> plan: SettlePlan;

const SETTLING: f32 = 0.0;
const SPUN: f32 = 1.0;
const OFF_THE_ENVELOPE: f32 = 2.0;
const GREATEST_SIDESLIP_SINE: f32 = 0.479425538604203;
const GREATEST_SLIP: f32 = 0.4;
const LEAST_FORWARD_SHARE: f32 = 0.01;

struct Aim {
    speed: f32,
    steer: f32,
}

// The integrated figures.
struct Figures {
    vy: f32,
    yaw_rate: f32,
    roll: f32,
    roll_rate: f32,
    pitch_acceleration: f32,
    slip: f32,
}

struct Settling {
    figures: Figures,
    residual: f32,
    ending: f32,
}

fn begin() -> Settling {
    return Settling(Figures(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0, SETTLING);
}

fn car_state(speed: f32, f: Figures) -> CarState {
    let squared = speed * speed;
    let vx = sqrt(max(squared - f.vy * f.vy, LEAST_FORWARD_SHARE * squared));
    return CarState(BodyState(vx, f.vy, f.yaw_rate, f.roll, f.roll_rate), f.pitch_acceleration);
}

struct SettleRate {
    slopes: Figures,
    residual: f32,
}

fn settle_rate(car: CarModel, speed: f32, steer: f32, now: Figures) -> SettleRate {
    let c = chassis_of(car);
    let state = car_state(speed, now);
    let body = state.body;
    let cosine = own_cos(Wheels(steer)).x;
    let sine = own_sin(Wheels(steer)).x;
    let input = CarInput(
        wheel_speeds(c, body, cosine, sine, 0.0, now.slip),
        (steer - c.steer_offset) / c.steer_scale,
        0.0,
        1.0,
    );
    let rate = car_rate(car, state, input).state;
    let lag = rate.pitch_acceleration * c.pitch_lag;
    let drag = aero_forces(c, body.vx, 0.0).drag / c.mass;
    let push = state.pitch_acceleration + lag + drag + body.vy * body.yaw_rate;
    let damped = c.roll_damping * body.roll_rate / (c.mass * c.cg_height);
    var residual = max(abs(rate.body.vy), abs(rate.body.yaw_rate * (c.cg_to_front + c.cg_to_rear)));
    residual = max(residual, abs(rate.body.roll_rate * c.cg_height));
    residual = max(residual, abs(damped));
    residual = max(residual, abs(lag));
    residual = max(residual, abs(push));
    return SettleRate(
        Figures(
            rate.body.vy,
            rate.body.yaw_rate,
            rate.body.roll,
            rate.body.roll_rate,
            rate.pitch_acceleration,
            -(plan.gain * push),
        ),
        residual,
    );
}

// `origin + share * slope`, component by component: the sums of `settle_step`.
fn shifted(origin: Figures, share: f32, slope: Figures) -> Figures {
    return Figures(
        origin.vy + share * slope.vy,
        origin.yaw_rate + share * slope.yaw_rate,
        origin.roll + share * slope.roll,
        origin.roll_rate + share * slope.roll_rate,
        origin.pitch_acceleration + share * slope.pitch_acceleration,
        origin.slip + share * slope.slip,
    );
}

fn settle_step(car: CarModel, aim: Aim, number: f32, before: Settling) -> Settling {
    let steer = aim.steer * min(number * plan.steer_per_step, 1.0);
    let origin = before.figures;
    var reached = origin;
    var sum = origin;
    var state = before;
    for (var stage = 0u; stage < STAGES; stage++) {
        let rate = settle_rate(car, aim.speed, steer, reached);
        if stage == 0u {
            state.residual = rate.residual;
        }
        sum = shifted(sum, plan.step * stage_weight(stage), rate.slopes);
        reached = shifted(origin, plan.step * stage_reach(stage), rate.slopes);
    }
    let stands = abs(sum.vy) < GREATEST_SIDESLIP_SINE * aim.speed;
    if !(stands && still_drives(car_state(aim.speed, sum))) || !is_finite(sum.vy) {
        state.ending = SPUN;
    } else if !(abs(sum.slip) < GREATEST_SLIP) || !is_finite(sum.slip) {
        state.ending = OFF_THE_ENVELOPE;
    }
    if state.ending != SETTLING {
        state.residual = before.residual;
        return state;
    }
    state.figures = sum;
    return state;
}

@compute @workgroup_size(WORKGROUP)
fn settle(@builtin(global_invocation_id) id: vec3<u32>) {
    let candidate = id.x;
    if candidate >= stretch.candidates {
        return;
    }
    let aim = Aim(other_figure(0u, candidate), other_figure(1u, candidate));
    var state = begin();
    if stretch.first_step > 0u {
        state = Settling(
            Figures(
                progress_of(0u, candidate),
                progress_of(1u, candidate),
                progress_of(2u, candidate),
                progress_of(3u, candidate),
                progress_of(4u, candidate),
                progress_of(5u, candidate),
            ),
            progress_of(6u, candidate),
            progress_of(7u, candidate),
        );
    }
    if state.ending != SETTLING {
        return;
    }

    let car = load_car(candidate);
    for (var i = 0u; i < stretch.steps; i++) {
        state = settle_step(car, aim, f32(stretch.first_step + i), state);
        if state.ending != SETTLING {
            break;
        }
    }

    let f = state.figures;
    let out = array<f32, 8>(
        f.vy,
        f.yaw_rate,
        f.roll,
        f.roll_rate,
        f.pitch_acceleration,
        f.slip,
        state.residual,
        state.ending,
    );
    for (var i = 0u; i < 8u; i++) {
        progress[i * stretch.stride + candidate] = out[i];
    }
}
