// Twin of `src/drive/driver.rs`: steering by preview and feedback, drive and brake by limited wheel slip.
// The constant STRETCHES is generated.

// A driver's figures; twin of `DriverTable`.
struct Driver {
    step: f32,
    heading_gain: f32,
    speed_gain: f32,
    slip_limit: f32,
    slip_stiffness: f32,
    max_steer: f32,
    steer_rate: f32,
    knows: f32,
    run_off: f32,
    driven_share: f32,
    steer_lag: f32,
    pedal_lag: f32,
    reach: f32,
    rolling: f32,
    rotating: f32,
    speed_ahead: f32,
    plan_ahead: f32,
}

@group(0) @binding(7) var<uniform> driver: Driver;
// Rows of the map of the car's steady cornering, and steps of the share of the grip; see `src/drive/cornering.rs`.
const SPEEDS = 8u;
const SHARES = 8u;
// Speed at the start of a stretch, torque there, slope. Behind the stretches stand the places of the map: steering beyond the geometry's,
// slip angle of the rear axle, friction, and by how much steering is ahead of a bend.
@group(0) @binding(8) var<uniform> torque: array<vec4<f32>, STRETCHES + SPEEDS * (SHARES + 1u)>;

fn torque_at(speed: f32) -> f32 {
    var found = 0.0;
    for (var i = 0u; i < STRETCHES; i++) {
        let stretch = torque[i];
        let past = speed - stretch.x;
        let here = stretch.y + past * stretch.z;
        found = select(here, found, past < 0.0);
    }
    return found;
}

struct Controls {
    steer: f32,
    front_slip: f32,
    rear_slip: f32,
    rear_force: f32,
    gain: f32,
}

struct Pace {
    plan: f32,
    share: f32,
}

fn speed_in_cell(cell: f32, share: f32) -> f32 {
    let at = place_of_number(cell);
    let speed = plans[at];
    return speed + share * (plans[at + 1u] - speed);
}

fn planned_speed(course: Course, pace: Pace, view: View, ahead: f32) -> f32 {
    let distance = view.pose.along + ahead;
    let place = view.row.cell_share + distance * course.cells_per_metre + 2.0;
    let cells = whole(place, CELLS_AHEAD);
    let share = place - cells;
    let number = course.plan_at + pace.plan * course.plan_stride + view.row.cell + cells;
    let speed = speed_in_cell(number, share);
    if !BLENDS {
        return speed;
    }
    let faster = speed_in_cell(number + course.plan_stride, share);
    return speed + pace.share * (faster - speed);
}

// A speed in the map: the row below it, a whole number, and the share of the way to the next.
struct SpeedPlace {
    row: f32,
    share: f32,
}

fn speed_place(speed: f32) -> SpeedPlace {
    let rows = (speed - 10.0) * 0.1;
    let row = whole(rows, f32(SPEEDS - 2u));
    return SpeedPlace(row, min(max(rows - row, 0.0), 1.0));
}

// The four figures of a place of the map at this speed.
fn cornering_at(speed: SpeedPlace, column: f32) -> vec4<f32> {
    let at = STRETCHES + place_of_number(speed.row * f32(SHARES + 1u) + column);
    let below = torque[at];
    return below + speed.share * (torque[at + SHARES + 1u] - below);
}

// Steering beyond the geometry's and the slip angle of the rear axle at a share of the grip.
fn cornering_angles(speed: SpeedPlace, share: f32) -> vec2<f32> {
    let used = min(abs(share), 1.1) * f32(SHARES);
    let column = whole(used, f32(SHARES - 1u));
    let below = cornering_at(speed, column).xy;
    let angles = below + (used - column) * (cornering_at(speed, column + 1.0).xy - below);
    return select(angles, -angles, share < 0.0);
}

fn act(
    course: Course,
    pace: Pace,
    c: Chassis,
    state: CarState,
    view: View,
    under: Footing,
    controls: Controls,
) -> Controls {
    let body = state.body;
    let v = max(body.vx, 3.0);
    let wheelbase = c.cg_to_front + c.cg_to_rear;
    let aero = aero_forces(c, v, view.row.flap);
    let weight = c.mass * c.gravity + (aero.downforce_front + aero.downforce_rear);
    let speed = speed_place(v);
    let known = cornering_at(speed, 0.0);
    let preview = known.w;
    let grip = under.friction * known.z * weight / c.mass;
    let behind = planned_speed(course, pace, view, driver.speed_ahead * v) - body.vx;
    let look = driver.plan_ahead * v;
    let before = planned_speed(course, pace, view, look - driver.reach);
    let after = planned_speed(course, pace, view, look + driver.reach);
    let planned = (after * after - before * before) / 8.0;
    let curvature = curvature_ahead(course, view.pose, preview * v);
    let bend = view.bend;
    let speed_ahead = max(v + driver.knows * planned * preview, 3.0);
    var across_ahead = curvature * speed_ahead * speed_ahead;
    var across = bend * v * v;
    var turning = body.yaw_rate * v;
    if HAS_RELIEF {
        across_ahead = across_ahead + under.lean;
        across = across + under.lean;
        turning = turning + under.lean;
    }
    // 19.6133 is the grip that a driver guesses who does not know the car.
    let held = driver.knows * grip + (1.0 - driver.knows) * (under.friction * 19.6133);
    let understeer = under.friction * cornering_angles(speed, across_ahead / held).x;
    let rear_slip = under.friction * cornering_angles(speed, across / held).y;
    let sideslip = driver.knows * (c.cg_to_rear * bend - rear_slip);
    let heading = view.heading_error + sideslip + view.offset * 0.9 / (v * 0.45 + 3.0);
    let yaw_lack = curvature_ahead(course, view.pose, 0.08 * v) * v - body.yaw_rate;
    let asked = wheelbase * curvature + understeer - driver.heading_gain * heading + 0.045 * yaw_lack;
    let steer = min(max(asked, -driver.max_steer), driver.max_steer);
    let rate = min(max((steer - controls.steer) / driver.steer_lag, -driver.steer_rate), driver.steer_rate);

    let wanted = planned + driver.speed_gain * behind;
    var force = c.mass * wanted + aero.drag;
    if HAS_RELIEF {
        force = force + c.mass * under.climb;
    }
    let used = min(driver.knows * abs(0.5 * (turning + across) / grip), 1.0);
    let left = sqrt(max(1.0 - used * used, 0.01));
    let limit = under.friction * driver.slip_limit * left;
    let stiffness = driver.driven_share * weight * driver.slip_stiffness;
    let pedal = select(controls.rear_slip, controls.front_slip, controls.rear_slip < 0.0);
    let slip = pedal + c.mass * (wanted - controls.gain) / stiffness;
    let rim_speed = v * (1.0 + max(controls.rear_slip, 0.0));
    let pull = torque_at(rim_speed / c.radius_rear) / c.radius_rear;
    let most = (pull - c.mass * driver.rolling + (driver.rotating - 1.0) * aero.drag) / driver.rotating;
    let within = max(controls.rear_slip, 0.0) + (most - controls.rear_force) / stiffness;
    let driven = min(min(min(slip, max(within, 0.0)), limit), max(force / stiffness, 0.0));
    let braked = max(slip, -limit);
    let brakes = slip < 0.0;
    let front = select(0.0, braked, brakes);
    let rear = select(driven, 0.75 * braked, brakes);
    return Controls(
        controls.steer + rate * driver.step,
        controls.front_slip + (front - controls.front_slip) * driver.step / driver.pedal_lag,
        controls.rear_slip + (rear - controls.rear_slip) * driver.step / driver.pedal_lag,
        controls.rear_force,
        controls.gain,
    );
}

fn car_input(c: Chassis, state: CarState, controls: Controls, flap: f32, friction: f32) -> CarInput {
    let cosine = own_cos(Wheels(controls.steer)).x;
    let sine = own_sin(Wheels(controls.steer)).x;
    return CarInput(
        wheel_speeds(c, state.body, cosine, sine, controls.front_slip, controls.rear_slip),
        controls.steer,
        select(flap, 0.0, controls.rear_slip < 0.0),
        friction,
    );
}
