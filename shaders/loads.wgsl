// Twin of `src/vehicle/loads.rs`: vertical wheel loads FL FR RL RR.

fn wheel_loads(chassis: Chassis, state: BodyState, longitudinal_acceleration: f32, aero: AeroForces) -> vec4<f32> {
    let wheelbase = chassis.cg_to_front + chassis.cg_to_rear;
    let weight = chassis.mass * chassis.gravity;
    let pitch = chassis.pitch_transfer
        * (chassis.mass * longitudinal_acceleration * chassis.cg_height + aero.drag * chassis.drag_height)
        / wheelbase;
    let front_static = weight * chassis.cg_to_rear / wheelbase;
    let rear_static = weight * chassis.cg_to_front / wheelbase;
    let front_even = 0.5 * (aero.downforce_front - pitch);
    let rear_even = 0.5 * (aero.downforce_rear + pitch);
    let roll_moment = chassis.roll_stiffness * state.roll + chassis.roll_damping * state.roll_rate;
    let front_roll = 0.5 * (chassis.roll_share_front * roll_moment) / chassis.half_track_front;
    let rear_roll = 0.5 * ((1.0 - chassis.roll_share_front) * roll_moment) / chassis.half_track_rear;
    return vec4<f32>(
        front_static * chassis.left_share_front + front_even - front_roll,
        front_static * (1.0 - chassis.left_share_front) + front_even + front_roll,
        rear_static * chassis.left_share_rear + rear_even - rear_roll,
        rear_static * (1.0 - chassis.left_share_rear) + rear_even + rear_roll,
    );
}
