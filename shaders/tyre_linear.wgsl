// Twin of `src/vehicle/tyre/linear.rs`: forces proportional to slip and load.

struct LinearTyre {
    nominal_load: Wheels,
    slip_stiffness: Wheels,
    cornering_stiffness: Wheels,
    trail: Wheels,
}

alias Tyre = LinearTyre;

fn tyre_forces(t: LinearTyre, input: TyreInput) -> TyreForces {
    let share = max(input.load, Wheels(0.0)) / t.nominal_load;
    let y = -(t.cornering_stiffness * own_atan(input.slip_tangent) * share);
    return TyreForces(t.slip_stiffness * input.slip_ratio * share, y, -(t.trail * y));
}
