// Twin of the types in `src/vehicle/tyre/mod.rs` that every tyre model shares. Some
// wheels are computed side by side: see `Wheels`.

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
