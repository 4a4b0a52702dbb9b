// Twin of `src/drive/kernel.rs`: a driver takes a candidate car round a line, step by step. The candidate's other figures are its
// line, its plan and its share of the next plan. Its state is that of `DriveState::to_array`.

const UNDER_WAY: f32 = 0.0;
const FINISHED: f32 = 1.0;
const SPUN: f32 = 2.0;
const LEFT_ROAD: f32 = 3.0;
const TOO_LATE: f32 = 4.0;
const TURNED_ROUND: f32 = 1.5707963267948966;

struct DriveState {
    car: CarState,
    controls: Controls,
    pose: Pose,
    steps: f32,
    rest: f32,
    beyond: f32,
    turned: f32,
    turned_here: f32,
    ending: f32,
}

fn begin(course: Course, pace: Pace) -> DriveState {
    let pose = Pose(course.begin_row, -1.0, course.begin_along, course.begin_x, course.begin_y, course.begin_yaw);
    let speed = planned_speed(course, pace, look(course, pose), 0.0);
    return DriveState(
        CarState(BodyState(speed, 0.0, 0.0, 0.0, 0.0), 0.0),
        Controls(0.0, 0.0, 0.0, 0.0, 0.0),
        pose,
        0.0,
        0.0,
        -1e6,
        0.0,
        0.0,
        UNDER_WAY,
    );
}

// A lost car keeps its last state.
fn drive_step(car: CarModel, course: Course, pace: Pace, number: f32, before: DriveState) -> DriveState {
    var state = before;
    let view = look(course, before.pose);
    let pose = view.pose;
    if !(abs(view.heading_error) < TURNED_ROUND) {
        state.ending = SPUN;
        return state;
    }
    if course.most_steps < number {
        state.ending = TOO_LATE;
        return state;
    }
    if driver.run_off < view.beyond {
        state.ending = LEFT_ROAD;
        return state;
    }
    let since = (pose.row * course.spacing + pose.along) / before.car.body.vx;
    let started = !(pose.lap < -0.5);
    if before.pose.lap < -0.5 && started {
        state.rest = state.rest + since;
    }
    if !(pose.lap < 0.5) {
        state.rest = state.rest - since;
        state.ending = FINISHED;
        return state;
    }

    var under = Footing(0.0, 0.0, 0.0, 1.0);
    if HAS_RELIEF {
        under = footing(course, view, before.car.body.vx);
    }
    // Generated: the car with the gravity that its wheels feel.
    let loaded = under_load(car, under.load);
    var controls = act(course, pace, chassis_of(loaded), before.car, view, under, before.controls);
    let input = car_input(chassis_of(loaded), before.car, controls, view.row.flap, under.friction);
    var next = before.car;
    var reached = before.car;
    for (var stage = 0u; stage < STAGES; stage++) {
        var rate = car_rate(loaded, reached, input);
        if HAS_RELIEF {
            rate.state.body.vx = rate.state.body.vx - under.climb;
            rate.state.body.vy = rate.state.body.vy - under.lean;
        }
        if stage == 0u {
            controls.rear_force = rate.rear_force;
            controls.gain = rate.state.body.vx;
        }
        next = carried(next, driver.step * stage_weight(stage), rate.state);
        reached = carried(before.car, driver.step * stage_reach(stage), rate.state);
    }
    if !still_drives(next) {
        state.ending = SPUN;
        return state;
    }
    let body = before.car.body;
    let middle_yaw = pose.yaw + 0.25 * driver.step * (body.yaw_rate + next.body.yaw_rate);
    let cosine = own_cos(Wheels(middle_yaw)).x;
    let sine = own_sin(Wheels(middle_yaw)).x;
    let ahead = 0.5 * (body.vx + next.body.vx);
    let left = 0.5 * (body.vy + next.body.vy);
    state.car = next;
    state.controls = controls;
    state.pose = pose;
    state.pose.x = pose.x + (cosine * ahead - sine * left) * driver.step;
    state.pose.y = pose.y + (sine * ahead + cosine * left) * driver.step;
    state.pose.yaw = pose.yaw + 0.5 * driver.step * (body.yaw_rate + next.body.yaw_rate);
    var here = before.turned_here;
    if started {
        state.steps = before.steps + 1.0;
        state.beyond = max(before.beyond, view.beyond);
        here = here + abs(controls.steer - before.controls.steer);
    }
    state.turned = before.turned + select(0.0, here, view.passed);
    state.turned_here = select(here, 0.0, view.passed);
    return state;
}

@compute @workgroup_size(WORKGROUP)
fn drive(@builtin(global_invocation_id) id: vec3<u32>) {
    let candidate = id.x;
    if candidate >= stretch.candidates {
        return;
    }
    let course = courses[place_of_number(other_figure(0u, candidate))];
    let pace = Pace(other_figure(1u, candidate), other_figure(2u, candidate));
    var state: DriveState;
    if stretch.first_step == 0u {
        state = begin(course, pace);
    } else {
        state = DriveState(
            CarState(
                BodyState(
                    progress_of(0u, candidate),
                    progress_of(1u, candidate),
                    progress_of(2u, candidate),
                    progress_of(3u, candidate),
                    progress_of(4u, candidate),
                ),
                progress_of(5u, candidate),
            ),
            Controls(
                progress_of(6u, candidate),
                progress_of(7u, candidate),
                progress_of(8u, candidate),
                progress_of(9u, candidate),
                progress_of(10u, candidate),
            ),
            Pose(
                progress_of(11u, candidate),
                progress_of(12u, candidate),
                progress_of(13u, candidate),
                progress_of(14u, candidate),
                progress_of(15u, candidate),
                progress_of(16u, candidate),
            ),
            progress_of(17u, candidate),
            progress_of(18u, candidate),
            progress_of(19u, candidate),
            progress_of(20u, candidate),
            progress_of(21u, candidate),
            progress_of(22u, candidate),
        );
    }
    if state.ending != UNDER_WAY {
        return;
    }

    let car = load_car(candidate);
    for (var i = 0u; i < stretch.steps; i++) {
        state = drive_step(car, course, pace, f32(stretch.first_step + i), state);
        if state.ending != UNDER_WAY {
            break;
        }
    }

    let car_state = state.car;
    let pose = state.pose;
    let out = array<f32, 23>(
        car_state.body.vx,
        car_state.body.vy,
        car_state.body.yaw_rate,
        car_state.body.roll,
        car_state.body.roll_rate,
        car_state.pitch_acceleration,
        state.controls.steer,
        state.controls.front_slip,
        state.controls.rear_slip,
        state.controls.rear_force,
        state.controls.gain,
        pose.row,
        pose.lap,
        pose.along,
        pose.x,
        pose.y,
        pose.yaw,
        state.steps,
        state.rest,
        state.beyond,
        state.turned,
        state.turned_here,
        state.ending,
    );
    for (var i = 0u; i < 23u; i++) {
        progress[i * stretch.stride + candidate] = out[i];
    }
}
