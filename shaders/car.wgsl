// Twin of `src/vehicle/model.rs`: wheels, tyres, aero, loads and body put together. `Tyre` and `tyre_forces` come
// from the tyre model's own module.
//
// A shader cannot choose a tyre by reference, so the twin's loop over the wheels is written out; the wheels' order
// and every operation are the twin's.

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
    ratio: f32,
    tangent: f32,
}

fn wheel_slip(body: BodyState, place: vec2<f32>, direction: vec2<f32>, rim_speed: f32, least_speed: f32) -> WheelSlip {
    let hub_x = body.vx - body.yaw_rate * place.y;
    let hub_y = body.vy + body.yaw_rate * place.x;
    let vx = direction.x * hub_x + direction.y * hub_y;
    let vy = direction.x * hub_y - direction.y * hub_x;
    let speed = max(abs(vx), least_speed);
    return WheelSlip((rim_speed - vx) / speed, vy / speed);
}

fn to_body_axes(forces: TyreForces, direction: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(
        forces.x * direction.x - forces.y * direction.y,
        forces.x * direction.y + forces.y * direction.x,
    );
}

// One pass of the twin's loop over the wheels.
fn with_wheel(
    total: BodyForces,
    body: BodyState,
    tyre: Tyre,
    place: vec2<f32>,
    direction: vec2<f32>,
    rim_speed: f32,
    least_speed: f32,
    load: f32,
    side: f32,
) -> BodyForces {
    let slip = wheel_slip(body, place, direction, rim_speed, least_speed);
    let forces = tyre_forces(tyre, TyreInput(load, slip.ratio, slip.tangent, side));
    let force = to_body_axes(forces, direction);
    return BodyForces(
        total.x + force.x,
        total.y + force.y,
        total.yaw_moment + (place.x * force.y - place.y * force.x + forces.aligning_moment),
    );
}

// The pair of wheels of one axle, left then right.
fn with_axle(
    start: BodyForces,
    body: BodyState,
    tyre: Tyre,
    axle_x: f32,
    half_track: f32,
    direction: vec2<f32>,
    rim_speed: vec2<f32>,
    least_speed: f32,
    load: vec2<f32>,
) -> BodyForces {
    let left = vec2<f32>(axle_x, half_track);
    let right = vec2<f32>(axle_x, -half_track);
    let total = with_wheel(start, body, tyre, left, direction, rim_speed.x, least_speed, load.x, 1.0);
    return with_wheel(total, body, tyre, right, direction, rim_speed.y, least_speed, load.y, -1.0);
}

fn car_rate(car: CarModel, state: CarState, input: CarInput) -> CarRate {
    let body = state.body;
    let aero = aero_forces(car.chassis, body.vx);
    let loads = wheel_loads(car.chassis, body, state.pitch_acceleration, aero);
    let steer = input.steer * car.chassis.steer_scale + car.chassis.steer_offset;
    let turned = vec2<f32>(own_cos(steer), own_sin(steer));
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
