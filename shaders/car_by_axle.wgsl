// A car whose figures are read where they are used, and whose axles are computed one after the other. Graphics processors have some
// hundred registers for a lane and a hundred for all lanes: figures that are kept, and four wheels at once, do not fit.

struct CarModel {
    candidate: u32,
}

fn load_car(candidate: u32) -> CarModel {
    return CarModel(candidate);
}

fn chassis_of(car: CarModel) -> Chassis {
    return load_chassis(car.candidate);
}

fn forces_of_all(car: CarModel, body: BodyState, friction: f32, all: AllWheels) -> AllForces {
    let least_speed = chassis_of(car).slip_speed_floor;
    let at_front = SomeWheels(
        all.load.xy,
        all.rim_speed.xy,
        all.x.xy,
        all.y.xy,
        all.side.xy,
        all.cosine.xy,
        all.sine.xy,
    );
    let front = forces_of_some(load_front_tyres(car.candidate), body, least_speed, friction, at_front);
    let at_rear = SomeWheels(
        all.load.zw,
        all.rim_speed.zw,
        all.x.zw,
        all.y.zw,
        all.side.zw,
        all.cosine.zw,
        all.sine.zw,
    );
    let rear = forces_of_some(load_rear_tyres(car.candidate), body, least_speed, friction, at_rear);
    return AllForces(
        vec4<f32>(front.x, rear.x),
        vec4<f32>(front.y, rear.y),
        vec4<f32>(front.moment, rear.moment),
    );
}

fn cos_of_four(x: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(own_cos(x.xy), own_cos(x.zw));
}

fn sin_of_four(x: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(own_sin(x.xy), own_sin(x.zw));
}
