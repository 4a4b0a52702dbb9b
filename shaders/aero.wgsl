// Twin of `src/vehicle/aero.rs`: drag and downforce with centre of pressure, headwind and DRS.

struct AeroForces {
    drag: f32,
    downforce_front: f32,
    downforce_rear: f32,
}

fn aero_forces(chassis: Chassis, vx: f32, flap: f32) -> AeroForces {
    let airspeed = vx + chassis.headwind;
    let half_density = 0.5 * chassis.air_density;
    let drag = half_density * chassis.drag_area * (airspeed * abs(airspeed));
    let downforce = half_density * chassis.lift_area * (airspeed * airspeed);
    let open = 0.01 * flap;
    let rear_share = 1.0 - chassis.pressure_centre;
    return AeroForces(
        drag * (1.0 - chassis.drs_drag * open),
        downforce * chassis.pressure_centre,
        downforce * (rear_share - chassis.drs_lift * open),
    );
}
