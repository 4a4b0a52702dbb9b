// Twin of `src/vehicle/tyre/linear.rs`: forces proportional to slip and load.

struct LinearTyre {
    nominal_load: f32,
    slip_stiffness: f32,
    cornering_stiffness: f32,
    trail: f32,
}

alias Tyre = LinearTyre;

fn tyre_forces(t: LinearTyre, input: TyreInput) -> TyreForces {
    let share = max(input.load, Pair(0.0)) / t.nominal_load;
    let y = -(t.cornering_stiffness * own_atan(input.slip_tangent) * share);
    return TyreForces(t.slip_stiffness * input.slip_ratio * share, y, -(t.trail * y));
}
