// Twin of `src/vehicle/tyre/magic_formula.rs`: Magic Formula 5.2 forces and moment, the same functions in the same
// order. The struct is that of `src/vehicle/tyre/prepared.rs`: the tyre made ready for its axle on the host.

struct MagicFormula {
    inverse_nominal: f32,
    cx: f32,
    inverse_cx: f32,
    dx1: f32,
    dx2: f32,
    kx1: f32,
    kx2: f32,
    kx3: f32,
    hx1: f32,
    hx2: f32,
    vx1: f32,
    vx2: f32,
    ex1: f32,
    ex2: f32,
    ex3: f32,
    ex4: f32,
    cy: f32,
    inverse_cy: f32,
    dy1: f32,
    dy2: f32,
    ky: f32,
    ky_load: f32,
    hy1: f32,
    hy2: f32,
    hy_camber: f32,
    vy1: f32,
    vy2: f32,
    vy_camber1: f32,
    vy_camber2: f32,
    ey1: f32,
    ey2: f32,
    ey3: f32,
    ey_camber: f32,
    rbx1: f32,
    rbx2: f32,
    rcx1: f32,
    rex1: f32,
    rex2: f32,
    rhx1: f32,
    rby1: f32,
    rby2: f32,
    rby3: f32,
    rcy1: f32,
    rey1: f32,
    rey2: f32,
    rhy1: f32,
    rhy2: f32,
    rvy1: f32,
    rvy2: f32,
    rvy_camber: f32,
    rvy4: f32,
    rvy5: f32,
    rvy6: f32,
    ct: f32,
    bt1: f32,
    bt2: f32,
    bt3: f32,
    bt_even: f32,
    bt_odd: f32,
    dt1: f32,
    dt2: f32,
    dt_even: f32,
    dt_odd: f32,
    et1: f32,
    et2: f32,
    et3: f32,
    et4: f32,
    et_camber: f32,
    ht1: f32,
    ht2: f32,
    ht_camber1: f32,
    ht_camber2: f32,
    br1: f32,
    br2: f32,
    dr1: f32,
    dr2: f32,
    dr_camber1: f32,
    dr_camber2: f32,
    s1: f32,
    s2: f32,
    s_camber1: f32,
    s_camber2: f32,
}

alias Tyre = MagicFormula;

// `LEAST_LOAD` in `src/vehicle/tyre/mod.rs`.
const LEAST_LOAD: f32 = 1e-3;

fn stretched_slip(b: Pair, e: Pair, x: Pair) -> Pair {
    let bx = b * x;
    return bx - e * (bx - own_atan(bx));
}

fn sine_shape(c: f32, b: Pair, e: Pair, x: Pair) -> Pair {
    return own_sin(c * own_atan(stretched_slip(b, e, x)));
}

fn cosine_shape(c: f32, b: Pair, e: Pair, x: Pair) -> Pair {
    return own_cos(c * own_atan(stretched_slip(b, e, x)));
}

fn weight(c: f32, b: Pair, e: Pair, x: Pair, shift: Pair) -> Pair {
    return cosine_shape(c, b, e, x) / cosine_shape(c, b, e, shift);
}

fn clamp_curvature(e: Pair) -> Pair {
    return min(e, Pair(1.0));
}

struct Load {
    force: Pair,
    difference: Pair,
}

struct PureLongitudinal {
    force: Pair,
    stiffness: Pair,
}

fn pure_longitudinal(t: MagicFormula, load: Load, slip_ratio: Pair) -> PureLongitudinal {
    let dfz = load.difference;
    let mu = t.dx1 + t.dx2 * dfz;
    let k = (t.kx1 + t.kx2 * dfz) * own_exp(t.kx3 * dfz);
    let b = k * t.inverse_cx / mu;
    let x = slip_ratio + (t.hx1 + t.hx2 * dfz);
    let e = clamp_curvature((t.ex1 + dfz * (t.ex2 + t.ex3 * dfz)) * (1.0 - t.ex4 * sign_of(x)));
    let force = load.force * (mu * sine_shape(t.cx, b, e, x) + (t.vx1 + t.vx2 * dfz));
    return PureLongitudinal(force, load.force * k);
}

struct PureLateral {
    force: Pair,
    peak: Pair,
    stiffness: Pair,
    slope: Pair,
    residual_shift: Pair,
}

fn pure_lateral(t: MagicFormula, load: Load, slip_tangent: Pair, side: Pair) -> PureLateral {
    let dfz = load.difference;
    let peak = (t.dy1 + t.dy2 * dfz) * load.force;
    let z = load.force * t.ky_load;
    let stiffness = t.ky * (z / (1.0 + z * z));
    let slope = stiffness / peak;
    let horizontal_shift = t.hy1 + t.hy2 * dfz + t.hy_camber * side;
    let vertical_shift = load.force * ((t.vy1 + t.vy2 * dfz) + (t.vy_camber1 + t.vy_camber2 * dfz) * side);
    let x = slip_tangent + horizontal_shift;
    let e = clamp_curvature((t.ey1 + t.ey2 * dfz) * (1.0 - (t.ey3 + t.ey_camber * side) * sign_of(x)));
    return PureLateral(
        peak * sine_shape(t.cy, slope * t.inverse_cy, e, x) + vertical_shift,
        peak,
        stiffness,
        slope,
        horizontal_shift + vertical_shift / stiffness,
    );
}

fn longitudinal_weight(t: MagicFormula, load: Load, slip_ratio: Pair, slip_tangent: Pair) -> Pair {
    let b = t.rbx1 * cos_atan(t.rbx2 * slip_ratio);
    let e = clamp_curvature(t.rex1 + t.rex2 * load.difference);
    return weight(t.rcx1, b, e, slip_tangent + t.rhx1, Pair(t.rhx1));
}

fn lateral_weight(t: MagicFormula, load: Load, slip_ratio: Pair, slip_tangent: Pair) -> Pair {
    let b = t.rby1 * cos_atan(t.rby2 * (slip_tangent - t.rby3));
    let e = clamp_curvature(t.rey1 + t.rey2 * load.difference);
    let shift = t.rhy1 + t.rhy2 * load.difference;
    return weight(t.rcy1, b, e, slip_ratio + shift, shift);
}

fn induced_lateral(
    t: MagicFormula,
    load: Load,
    peak: Pair,
    slip_ratio: Pair,
    slip_tangent: Pair,
    side: Pair,
) -> Pair {
    let amplitude = peak * (t.rvy1 + t.rvy2 * load.difference + t.rvy_camber * side);
    return amplitude * cos_atan(t.rvy4 * slip_tangent) * own_sin(t.rvy5 * own_atan(t.rvy6 * slip_ratio));
}

fn equivalent_tangent(x: Pair, slip_share: Pair) -> Pair {
    let tangent = own_tan(x);
    return sqrt(tangent * tangent + slip_share * slip_share) * sign_of(x);
}

fn aligning_moment(
    t: MagicFormula,
    load: Load,
    input: TyreInput,
    lateral: PureLateral,
    longitudinal_stiffness: Pair,
    force_x: Pair,
    force_y: Pair,
    induced: Pair,
) -> Pair {
    let dfz = load.difference;
    let side = input.side;
    let slip_share = longitudinal_stiffness / lateral.stiffness * input.slip_ratio;

    let x = input.slip_tangent + (t.ht1 + t.ht2 * dfz + (t.ht_camber1 + t.ht_camber2 * dfz) * side);
    let b = (t.bt1 + dfz * (t.bt2 + t.bt3 * dfz)) * (t.bt_even + t.bt_odd * side);
    let d = load.force * (t.dt1 + t.dt2 * dfz) * (t.dt_even + t.dt_odd * side);
    let e = clamp_curvature(
        (t.et1 + dfz * (t.et2 + t.et3 * dfz)) * (1.0 + (t.et4 + t.et_camber * side) * own_atan(b * t.ct * x)),
    );
    let trail = d
        * cosine_shape(t.ct, b, e, own_atan(equivalent_tangent(x, slip_share)))
        * cos_atan(input.slip_tangent);

    let residual_slip = input.slip_tangent + lateral.residual_shift;
    let residual_slope = t.br1 + t.br2 * lateral.slope;
    let residual_peak = load.force
        * (t.dr1 + t.dr2 * dfz + (t.dr_camber1 + t.dr_camber2 * dfz) * side)
        * own_cos(input.slip_tangent);
    let residual =
        residual_peak * cos_atan(residual_slope * own_atan(equivalent_tangent(residual_slip, slip_share)));

    let arm = t.s1 + t.s2 * force_y + (t.s_camber1 + t.s_camber2 * dfz) * side;
    return residual - trail * (force_y - induced) + arm * force_x;
}

fn tyre_forces(t: MagicFormula, input: TyreInput) -> TyreForces {
    let force = max(input.load, Pair(LEAST_LOAD));
    let load = Load(force, force * t.inverse_nominal - 1.0);
    let pure_x = pure_longitudinal(t, load, input.slip_ratio);
    let lateral = pure_lateral(t, load, input.slip_tangent, input.side);
    let x = pure_x.force * longitudinal_weight(t, load, input.slip_ratio, input.slip_tangent);
    let induced = induced_lateral(t, load, lateral.peak, input.slip_ratio, input.slip_tangent, input.side);
    let y = lateral.force * lateral_weight(t, load, input.slip_ratio, input.slip_tangent) + induced;
    let moment = aligning_moment(t, load, input, lateral, pure_x.stiffness, x, y, induced);

    let zero = Pair(0.0);
    let loaded = zero < input.load;
    return TyreForces(select(zero, x, loaded), select(zero, y, loaded), select(zero, moment, loaded));
}
