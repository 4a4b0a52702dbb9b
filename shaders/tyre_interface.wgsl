// Twin of the types in `src/vehicle/tyre/mod.rs` that every tyre model shares.

struct TyreInput {
    load: f32,
    slip_ratio: f32,
    slip_tangent: f32,
    side: f32,
}

struct TyreForces {
    x: f32,
    y: f32,
    aligning_moment: f32,
}
