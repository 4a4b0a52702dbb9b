// Twin of the types in `src/vehicle/tyre/mod.rs` that every tyre model shares.

struct Camber {
    angle: f32,
    sine: f32,
}

fn camber_of(angle: f32) -> Camber {
    return Camber(angle, own_sin(angle));
}

struct TyreInput {
    load: f32,
    slip_ratio: f32,
    slip_tangent: f32,
    camber: Camber,
}

struct TyreForces {
    x: f32,
    y: f32,
    aligning_moment: f32,
}
