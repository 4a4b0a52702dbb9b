// A car whose figures are read once, and whose wheels are computed all at once. Software drivers go faster so: a processor keeps
// figures in its caches, and the wheels' chains of operations hide each other's latency.

struct CarModel {
    chassis: Chassis,
    // The front axle's figures in the first two places, the rear's in the others.
    tyres: Tyre,
}

fn load_car(candidate: u32) -> CarModel {
    return CarModel(load_chassis(candidate), load_tyres(candidate));
}

fn chassis_of(car: CarModel) -> Chassis {
    return car.chassis;
}

fn forces_of_all(car: CarModel, body: BodyState, friction: f32, all: AllWheels) -> AllForces {
    let least_speed = car.chassis.slip_speed_floor;
    let at = SomeWheels(all.load, all.rim_speed, all.x, all.y, all.side, all.cosine, all.sine);
    let forces = forces_of_some(car.tyres, body, least_speed, friction, at);
    return AllForces(forces.x, forces.y, forces.moment);
}

fn cos_of_four(x: vec4<f32>) -> vec4<f32> {
    return own_cos(x);
}

fn sin_of_four(x: vec4<f32>) -> vec4<f32> {
    return own_sin(x);
}
