// Twin of `src/vehicle/model.rs`: wheels, tyres, aero, loads and body put together. `Tyre` and `tyre_forces` come
// from the tyre model's own module.
//
// A shader cannot choose a tyre by reference, so the twin's loop over the axles is written out; the wheels of one
// axle are reckoned side by side. The order of every sum and every operation are the twin's.

struct CarInput {
    wheel_speed: vec4<f32>,
    steer: f32,
}

struct CarState {
    body: BodyState,
    pitch_acceleration: f32,
}

struct CarRate {
    state: CarState,
    ax: f32,
    ay: f32,
}

struct CarModel {
    chassis: Chassis,
    front: Tyre,
    rear: Tyre,
}

struct WheelSlip {
    ratio: Pair,
    tangent: Pair,
}

fn wheel_slip(
    body: BodyState,
    x: f32,
    y: Pair,
    direction: vec2<f32>,
    rim_speed: Pair,
    least_speed: f32,
) -> WheelSlip {
    let hub_x = body.vx - body.yaw_rate * y;
    let hub_y = body.vy + body.yaw_rate * x;
    let vx = direction.x * hub_x + direction.y * hub_y;
    let vy = direction.x * hub_y - direction.y * hub_x;
    let speed = max(abs(vx), Pair(least_speed));
    return WheelSlip((rim_speed - vx) / speed, vy / speed);
}

struct AxleForces {
    x: Pair,
    y: Pair,
}

fn to_body_axes(forces: TyreForces, direction: vec2<f32>) -> AxleForces {
    return AxleForces(
        forces.x * direction.x - forces.y * direction.y,
        forces.x * direction.y + forces.y * direction.x,
    );
}

// One pass of the twin's loop over the axles: `start` with the forces of the left, then of the right wheel.
fn with_axle(
    start: BodyForces,
    body: BodyState,
    tyre: Tyre,
    x: f32,
    half_track: f32,
    direction: vec2<f32>,
    rim_speed: Pair,
    least_speed: f32,
    load: Pair,
) -> BodyForces {
    let side = Pair(1.0, -1.0);
    let y = half_track * side;
    let slip = wheel_slip(body, x, y, direction, rim_speed, least_speed);
    let forces = tyre_forces(tyre, TyreInput(load, slip.ratio, slip.tangent, side));
    let force = to_body_axes(forces, direction);
    let moment = x * force.y - y * force.x + forces.aligning_moment;
    return BodyForces(
        start.x + force.x.x + force.x.y,
        start.y + force.y.x + force.y.y,
        start.yaw_moment + moment.x + moment.y,
    );
}

fn car_rate(car: CarModel, state: CarState, input: CarInput) -> CarRate {
    let body = state.body;
    let aero = aero_forces(car.chassis, body.vx);
    let loads = wheel_loads(car.chassis, body, state.pitch_acceleration, aero);
    let steer = input.steer * car.chassis.steer_scale + car.chassis.steer_offset;
    let turned = vec2<f32>(own_cos(Pair(steer)).x, own_sin(Pair(steer)).x);
    let straight = vec2<f32>(1.0, 0.0);
    var total = BodyForces(-aero.drag, 0.0, 0.0);
    total = with_axle(
        total,
        body,
        car.front,
        car.chassis.cg_to_front,
        car.chassis.half_track_front,
        turned,
        input.wheel_speed.xy * car.chassis.radius_front,
        car.chassis.slip_speed_floor,
        loads.xy,
    );
    total = with_axle(
        total,
        body,
        car.rear,
        -car.chassis.cg_to_rear,
        car.chassis.half_track_rear,
        straight,
        input.wheel_speed.zw * car.chassis.radius_rear,
        car.chassis.slip_speed_floor,
        loads.zw,
    );
    let rate = body_derivative(car.chassis, body, total);
    return CarRate(
        CarState(rate, (total.x / car.chassis.mass - state.pitch_acceleration) / car.chassis.pitch_lag),
        rate.vx - body.vy * body.yaw_rate,
        rate.vy + body.vx * body.yaw_rate,
    );
}

// `origin + share * slope`, component by component: the sums of `runge_kutta_step`.
fn carried(origin: CarState, share: f32, slope: CarState) -> CarState {
    return CarState(
        BodyState(
            origin.body.vx + share * slope.body.vx,
            origin.body.vy + share * slope.body.vy,
            origin.body.yaw_rate + share * slope.body.yaw_rate,
            origin.body.roll + share * slope.body.roll,
            origin.body.roll_rate + share * slope.body.roll_rate,
        ),
        origin.pitch_acceleration + share * slope.pitch_acceleration,
    );
}

// The stages of the classical Runge-Kutta method: `STAGES` in the twin. The number of the input is one of a
// step's three: start, middle, end.
const STAGES: u32 = 4u;

fn stage_input(fractions: vec4<f32>, stage: u32) -> f32 {
    return select(select(fractions.y, fractions.z, stage == 3u), fractions.x, stage == 0u);
}

fn stage_weight(stage: u32) -> f32 {
    return select(0.3333333333333333, 0.16666666666666666, stage == 0u || stage == 3u);
}

fn stage_reach(stage: u32) -> f32 {
    return select(select(0.5, 1.0, stage == 2u), 0.0, stage == 3u);
}

// `CarState::drives`. A state that is no number is lost; so says the exponent, whatever a driver thinks of NaN.
fn still_drives(state: CarState) -> bool {
    let b = state.body;
    return abs(b.vy) < b.vx + 3.0
        && b.vx < 200.0
        && abs(b.yaw_rate) < 6.0
        && abs(b.roll) < 0.7
        && abs(b.roll_rate) < 50.0
        && abs(state.pitch_acceleration) < 500.0
        && is_finite(b.vx)
        && is_finite(b.vy)
        && is_finite(b.yaw_rate)
        && is_finite(b.roll)
        && is_finite(b.roll_rate)
        && is_finite(state.pitch_acceleration);
}
