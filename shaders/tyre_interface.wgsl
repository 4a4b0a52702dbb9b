// Twin of the types in `src/vehicle/tyre/mod.rs` that every tyre model shares. An axle's two wheels, left and right,
// are reckoned side by side.

struct TyreInput {
    load: Pair,
    slip_ratio: Pair,
    slip_tangent: Pair,
    side: Pair,
}

struct TyreForces {
    x: Pair,
    y: Pair,
    aligning_moment: Pair,
}
