// Twin of the types in `src/vehicle/tyre/mod.rs` that every tyre model shares. The
// four wheels are computed side by side.

struct TyreInput {
    load: Wheels,
    slip_ratio: Wheels,
    slip_tangent: Wheels,
    side: Wheels,
}

struct TyreForces {
    x: Wheels,
    y: Wheels,
    aligning_moment: Wheels,
}
