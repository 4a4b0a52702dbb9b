// Twin of `src/vehicle/model.rs`: wheels, tyres, aero, loads and body put together. `Tyre` and `tyre_forces` come
// from the tyre model's own module.
//
// The twin's loop over the wheels is one pass over all four, or one for each axle: `car_side_by_side.wgsl` and `car_by_axle.wgsl`
// have `CarModel`, how its figures are read, and `forces_of_all`. The order of every sum and every operation are the twin's.

struct CarInput {
    wheel_speed: vec4<f32>,
    steer: f32,
    flap: f32,
    friction: f32,
}

struct CarState {
    body: BodyState,
    pitch_acceleration: f32,
}

struct CarRate {
    state: CarState,
    ax: f32,
    ay: f32,
    rear_force: f32,
}

struct WheelSlip {
    ratio: Wheels,
    tangent: Wheels,
}

fn wheel_slip(
    body: BodyState,
    x: Wheels,
    y: Wheels,
    cosine: Wheels,
    sine: Wheels,
    rim_speed: Wheels,
    least_speed: f32,
) -> WheelSlip {
    let hub_x = body.vx - body.yaw_rate * y;
    let hub_y = body.vy + body.yaw_rate * x;
    let vx = cosine * hub_x + sine * hub_y;
    let vy = cosine * hub_y - sine * hub_x;
    let speed = max(abs(vx), Wheels(least_speed));
    return WheelSlip((rim_speed - vx) / speed, vy / speed);
}

fn wheel_speed(c: Chassis, body: BodyState, x: f32, y: f32, cosine: f32, sine: f32, slip: f32, radius: f32) -> f32 {
    let hub = cosine * (body.vx - body.yaw_rate * y) + sine * (body.vy + body.yaw_rate * x);
    return (hub + slip * max(abs(hub), c.slip_speed_floor)) / radius;
}

fn wheel_speeds(c: Chassis, body: BodyState, cosine: f32, sine: f32, front_slip: f32, rear_slip: f32) -> vec4<f32> {
    let a = c.cg_to_front;
    let b = -c.cg_to_rear;
    return vec4<f32>(
        wheel_speed(c, body, a, c.half_track_front, cosine, sine, front_slip, c.radius_front),
        wheel_speed(c, body, a, -c.half_track_front, cosine, sine, front_slip, c.radius_front),
        wheel_speed(c, body, b, c.half_track_rear, 1.0, 0.0, rear_slip, c.radius_rear),
        wheel_speed(c, body, b, -c.half_track_rear, 1.0, 0.0, rear_slip, c.radius_rear),
    );
}

struct WheelForces {
    x: Wheels,
    y: Wheels,
    moment: Wheels,
}

// Some wheels: loads, speeds of rims, places from the centre of gravity, side of the car, cosine and sine of their angles.
struct SomeWheels {
    load: Wheels,
    rim_speed: Wheels,
    x: Wheels,
    y: Wheels,
    side: Wheels,
    cosine: Wheels,
    sine: Wheels,
}

// The same of FL, FR, RL and RR.
struct AllWheels {
    load: vec4<f32>,
    rim_speed: vec4<f32>,
    x: vec4<f32>,
    y: vec4<f32>,
    side: vec4<f32>,
    cosine: vec4<f32>,
    sine: vec4<f32>,
}

struct AllForces {
    x: vec4<f32>,
    y: vec4<f32>,
    moment: vec4<f32>,
}

// Forces in the body's axes, and moments about the centre of gravity; on a road with this share of the tyres' own friction. Twin of
// `axle_forces_on`: compilers drop what a friction of 1 does.
fn forces_of_some(tyres: Tyre, body: BodyState, least_speed: f32, friction: f32, at: SomeWheels) -> WheelForces {
    let slip = wheel_slip(body, at.x, at.y, at.cosine, at.sine, at.rim_speed, least_speed);
    let inverse = 1.0 / friction;
    let own = tyre_forces(tyres, TyreInput(at.load, slip.ratio * inverse, slip.tangent * inverse, at.side));
    let forces = TyreForces(own.x * friction, own.y * friction, own.aligning_moment * friction);
    let x = forces.x * at.cosine - forces.y * at.sine;
    let y = forces.x * at.sine + forces.y * at.cosine;
    return WheelForces(x, y, at.x * y - at.y * x + forces.aligning_moment);
}

// `start` with the four figures, one after the other.
fn with_all(start: f32, figures: vec4<f32>) -> f32 {
    return start + figures.x + figures.y + figures.z + figures.w;
}

fn car_rate(car: CarModel, state: CarState, input: CarInput) -> CarRate {
    let chassis = chassis_of(car);
    let body = state.body;
    let aero = aero_forces(chassis, body.vx, input.flap);
    let loads = wheel_loads(chassis, body, state.pitch_acceleration, aero);

    let steer = input.steer * chassis.steer_scale + chassis.steer_offset;
    let steer_cosine = own_cos(Wheels(steer)).x;
    let steer_sine = own_sin(Wheels(steer)).x;
    let cosine = vec4<f32>(steer_cosine, steer_cosine, 1.0, 1.0);
    let sine = vec4<f32>(steer_sine, steer_sine, 0.0, 0.0);
    let x = vec4<f32>(chassis.cg_to_front, chassis.cg_to_front, -chassis.cg_to_rear, -chassis.cg_to_rear);
    let half_track = vec4<f32>(
        chassis.half_track_front,
        chassis.half_track_front,
        chassis.half_track_rear,
        chassis.half_track_rear,
    );
    let radius = vec4<f32>(chassis.radius_front, chassis.radius_front, chassis.radius_rear, chassis.radius_rear);
    let side = vec4<f32>(1.0, -1.0, 1.0, -1.0);
    let y = half_track * side;

    let rim_speed = input.wheel_speed * radius;
    let forces = forces_of_all(car, body, input.friction, AllWheels(loads, rim_speed, x, y, side, cosine, sine));
    let total = BodyForces(
        with_all(-aero.drag, forces.x),
        with_all(0.0, forces.y),
        with_all(0.0, forces.moment),
    );

    let rate = body_derivative(chassis, body, total);
    return CarRate(
        CarState(rate, (total.x / chassis.mass - state.pitch_acceleration) / chassis.pitch_lag),
        rate.vx - body.vy * body.yaw_rate,
        rate.vy + body.vx * body.yaw_rate,
        forces.x.z + forces.x.w,
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

// `CarState::drives`. A state that is not a number is lost. The test reads the exponent, because drivers may assume that there is
// no NaN.
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
