// Twin of `src/vehicle/chassis.rs`: the 4DOF body with roll. Units and meanings are documented there.

struct Chassis {
    mass: f32,
    cg_to_front: f32,
    cg_to_rear: f32,
    half_track_front: f32,
    half_track_rear: f32,
    cg_height: f32,
    inertia_roll: f32,
    inertia_pitch: f32,
    inertia_yaw: f32,
    roll_stiffness: f32,
    roll_damping: f32,
    roll_share_front: f32,
    pitch_transfer: f32,
    pitch_lag: f32,
    left_share_front: f32,
    left_share_rear: f32,
    camber_front: f32,
    camber_rear: f32,
    radius_front: f32,
    radius_rear: f32,
    steer_scale: f32,
    steer_offset: f32,
    air_density: f32,
    drag_area: f32,
    lift_area: f32,
    pressure_centre: f32,
    drag_height: f32,
    headwind: f32,
    drs_drag: f32,
    drs_lift: f32,
    slip_speed_floor: f32,
    gravity: f32,
}

struct BodyState {
    vx: f32,
    vy: f32,
    yaw_rate: f32,
    roll: f32,
    roll_rate: f32,
}

struct BodyForces {
    x: f32,
    y: f32,
    yaw_moment: f32,
}

fn body_derivative(chassis: Chassis, state: BodyState, forces: BodyForces) -> BodyState {
    let m = chassis.mass;
    let h = chassis.cg_height;
    let ixx = chassis.inertia_roll;
    let iyy = chassis.inertia_pitch;
    let izz = chassis.inertia_yaw;
    let r = state.yaw_rate;
    let p = state.roll_rate;
    let s = own_sin(Wheels(state.roll)).x;
    let c = own_cos(Wheels(state.roll)).x;
    let hs = h * s;
    let hc = h * c;
    let sc = s * c;
    let inertia_difference = iyy - izz;

    let yaw_acceleration = (forces.yaw_moment - hs * forces.x - 2.0 * (inertia_difference * sc * (p * r)))
        / (iyy * (s * s) + izz * (c * c));
    let roll_acceleration = (hc * forces.y + m * chassis.gravity * hs
        - chassis.roll_stiffness * state.roll
        - chassis.roll_damping * p
        + inertia_difference * sc * (r * r)
        - m * (h * h) * (sc * (p * p)))
        / (ixx + m * (hs * hs));
    return BodyState(
        forces.x / m + state.vy * r - hs * yaw_acceleration - 2.0 * (hc * (p * r)),
        forces.y / m - state.vx * r + hc * roll_acceleration - hs * (p * p + r * r),
        yaw_acceleration,
        p,
        roll_acceleration,
    );
}
