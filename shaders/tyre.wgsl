// Twin of `src/vehicle/tyre/magic_formula.rs`: Magic Formula 5.2 forces and moment, the same functions in the same order. The
// struct is that of `src/vehicle/tyre/prepared.rs`: the tyre prepared for its axle on the host.

struct MagicFormula {
    inverse_nominal: Wheels,
    cx: Wheels,
    inverse_cx: Wheels,
    dx1: Wheels,
    dx2: Wheels,
    kx1: Wheels,
    kx2: Wheels,
    kx3: Wheels,
    hx1: Wheels,
    hx2: Wheels,
    vx1: Wheels,
    vx2: Wheels,
    ex1: Wheels,
    ex2: Wheels,
    ex3: Wheels,
    ex4: Wheels,
    cy: Wheels,
    inverse_cy: Wheels,
    dy1: Wheels,
    dy2: Wheels,
    ky: Wheels,
    ky_load: Wheels,
    hy1: Wheels,
    hy2: Wheels,
    hy_camber: Wheels,
    vy1: Wheels,
    vy2: Wheels,
    vy_camber1: Wheels,
    vy_camber2: Wheels,
    ey1: Wheels,
    ey2: Wheels,
    ey3: Wheels,
    ey_camber: Wheels,
    rbx1: Wheels,
    rbx2: Wheels,
    rcx1: Wheels,
    rex1: Wheels,
    rex2: Wheels,
    rhx1: Wheels,
    rby1: Wheels,
    rby2: Wheels,
    rby3: Wheels,
    rcy1: Wheels,
    rey1: Wheels,
    rey2: Wheels,
    rhy1: Wheels,
    rhy2: Wheels,
    rvy1: Wheels,
    rvy2: Wheels,
    rvy_camber: Wheels,
    rvy4: Wheels,
    rvy5: Wheels,
    rvy6: Wheels,
    ct: Wheels,
    bct: Wheels,
    bt1: Wheels,
    bt2: Wheels,
    bt3: Wheels,
    bt_even: Wheels,
    bt_odd: Wheels,
    dt1: Wheels,
    dt2: Wheels,
    dt_even: Wheels,
    dt_odd: Wheels,
    et1: Wheels,
    et2: Wheels,
    et3: Wheels,
    et4: Wheels,
    et_camber: Wheels,
    ht1: Wheels,
    ht2: Wheels,
    ht_camber1: Wheels,
    ht_camber2: Wheels,
    br1: Wheels,
    br2: Wheels,
    dr1: Wheels,
    dr2: Wheels,
    dr_camber1: Wheels,
    dr_camber2: Wheels,
    s1: Wheels,
    s2: Wheels,
    s_camber1: Wheels,
    s_camber2: Wheels,
    as_measured: Wheels,
    by_side: Wheels,
}

alias Tyre = MagicFormula;

// `LEAST_LOAD` in `src/vehicle/tyre/mod.rs`.
const LEAST_LOAD: f32 = 1e-3;

// The angle `C atan(B x - E (B x - atan(B x)))`, in half turns. A curve of the formula is its sine or cosine.
struct Curve {
    c: Wheels,
    b: Wheels,
    e: Wheels,
    x: Wheels,
}

fn curve_angles(k: Curve, l: Curve) -> WheelsPair {
    let bk = k.b * k.x;
    let bl = l.b * l.x;
    let inner = own_atan_each(bk, bl);
    let outer = own_atan_each(bk - k.e * (bk - inner.first), bl - l.e * (bl - inner.second));
    return WheelsPair(k.c * outer.first, l.c * outer.second);
}

fn curve_angle(curve: Curve) -> Wheels {
    return curve_angles(curve, curve).first;
}

fn clamp_curvature(e: Wheels) -> Wheels {
    return min(e, Wheels(1.0));
}

struct Load {
    force: Wheels,
    difference: Wheels,
}

struct PureSlip {
    curve: Curve,
    peak: Wheels,
    vertical_shift: Wheels,
    stiffness: Wheels,
}

fn pure_longitudinal(t: MagicFormula, load: Load, slip_ratio: Wheels) -> PureSlip {
    let dfz = load.difference;
    let mu = t.dx1 + t.dx2 * dfz;
    let k = (t.kx1 + t.kx2 * dfz) * own_exp(t.kx3 * dfz);
    let x = slip_ratio + (t.hx1 + t.hx2 * dfz);
    let e = clamp_curvature((t.ex1 + dfz * (t.ex2 + t.ex3 * dfz)) * (1.0 - t.ex4 * sign_of(x)));
    return PureSlip(
        Curve(t.cx, k * t.inverse_cx / mu, e, x),
        load.force * mu,
        load.force * (t.vx1 + t.vx2 * dfz),
        load.force * k,
    );
}

fn mirror(t: MagicFormula, side: Wheels) -> Wheels {
    return t.as_measured + t.by_side * side;
}

struct PureLateral {
    pure_slip: PureSlip,
    slope: Wheels,
    residual_shift: Wheels,
}

fn pure_lateral(t: MagicFormula, load: Load, slip_tangent: Wheels, side: Wheels) -> PureLateral {
    let dfz = load.difference;
    let mirrored = mirror(t, side);
    let peak = (t.dy1 + t.dy2 * dfz) * load.force;
    let z = load.force * t.ky_load;
    let stiffness = t.ky * (z / (1.0 + z * z));
    let slope = stiffness / peak;
    let horizontal_shift = (t.hy1 + t.hy2 * dfz) * mirrored + t.hy_camber * side;
    let vertical_shift = load.force * ((t.vy1 + t.vy2 * dfz) * mirrored + (t.vy_camber1 + t.vy_camber2 * dfz) * side);
    let x = slip_tangent + horizontal_shift;
    let e = clamp_curvature((t.ey1 + t.ey2 * dfz) * (1.0 - (t.ey3 * mirrored + t.ey_camber * side) * sign_of(x)));
    return PureLateral(
        PureSlip(Curve(t.cy, slope * t.inverse_cy, e, x), peak, vertical_shift, stiffness),
        slope,
        horizontal_shift + vertical_shift / stiffness,
    );
}

fn weight(curve: Curve, shift: Wheels) -> Wheels {
    let at_shift = Curve(curve.c, curve.b, curve.e, shift);
    let angles = curve_angles(curve, at_shift);
    let cosines = own_cos_pi_each(angles.first, angles.second);
    return cosines.first / cosines.second;
}

fn longitudinal_weight(
    t: MagicFormula,
    load: Load,
    slip_ratio: Wheels,
    slip_tangent: Wheels,
    mirrored: Wheels,
) -> Wheels {
    let b = t.rbx1 / sec_atan(t.rbx2 * slip_ratio);
    let e = clamp_curvature(t.rex1 + t.rex2 * load.difference);
    let shift = t.rhx1 * mirrored;
    return weight(Curve(t.rcx1, b, e, slip_tangent + shift), shift);
}

fn lateral_weight(
    t: MagicFormula,
    load: Load,
    slip_ratio: Wheels,
    slip_tangent: Wheels,
    mirrored: Wheels,
) -> Wheels {
    let b = t.rby1 / sec_atan(t.rby2 * (slip_tangent - t.rby3 * mirrored));
    let e = clamp_curvature(t.rey1 + t.rey2 * load.difference);
    let shift = t.rhy1 + t.rhy2 * load.difference;
    return weight(Curve(t.rcy1, b, e, slip_ratio + shift), shift);
}

fn equivalent_tangent(x: Wheels, tangent: Wheels, slip_share: Wheels) -> Wheels {
    return sqrt(tangent * tangent + slip_share * slip_share) * sign_of(x);
}

// `combined_slip`. The twin works out the functions of all curves in rounds; here, where the four wheels are side by
// side already, two at a time are enough.
fn tyre_forces(t: MagicFormula, input: TyreInput) -> TyreForces {
    let force = max(input.load, Wheels(LEAST_LOAD));
    let load = Load(force, force * t.inverse_nominal - 1.0);
    let dfz = load.difference;
    let side = input.side;
    let slip_ratio = input.slip_ratio;
    let slip_tangent = input.slip_tangent;
    let mirrored = mirror(t, side);
    let pure_x = pure_longitudinal(t, load, slip_ratio);
    let lateral = pure_lateral(t, load, slip_tangent, side);
    let pure_y = lateral.pure_slip;

    let pure = curve_angles(pure_x.curve, pure_y.curve);
    let sines = own_sin_pi_each(pure.first, pure.second);
    let x = (pure_x.peak * sines.first + pure_x.vertical_shift)
        * longitudinal_weight(t, load, slip_ratio, slip_tangent, mirrored);
    let trail_x = slip_tangent + ((t.ht1 + t.ht2 * dfz) * mirrored + (t.ht_camber1 + t.ht_camber2 * dfz) * side);
    let trail_b = (t.bt1 + dfz * (t.bt2 + t.bt3 * dfz)) * (t.bt_even + t.bt_odd * (side * mirrored));
    let angles = own_atan_each(t.rvy6 * slip_ratio, trail_b * t.bct * trail_x);
    let amplitude = pure_y.peak * ((t.rvy1 + t.rvy2 * dfz) * mirrored + t.rvy_camber * side);
    let induced = amplitude / sec_atan(t.rvy4 * slip_tangent) * own_sin_pi(t.rvy5 * angles.first);
    let y = (pure_y.peak * sines.second + pure_y.vertical_shift)
        * lateral_weight(t, load, slip_ratio, slip_tangent, mirrored)
        + induced;

    let slip_share = pure_x.stiffness / pure_y.stiffness * slip_ratio;
    let residual_x = slip_tangent + lateral.residual_shift;
    let tangents = own_tan_each(trail_x, residual_x);
    let slips = own_atan_each(
        equivalent_tangent(trail_x, tangents.first, slip_share),
        equivalent_tangent(residual_x, tangents.second, slip_share),
    );
    let trail_e = clamp_curvature(
        (t.et1 + dfz * (t.et2 + t.et3 * dfz)) * (1.0 + (t.et4 * mirrored + t.et_camber * side) * angles.second),
    );
    let cos_m = own_cos_pi(curve_angle(Curve(t.ct, trail_b, trail_e, slips.first)));
    let d = load.force * (t.dt1 + t.dt2 * dfz) * (t.dt_even + t.dt_odd * (side * mirrored));
    let trail = d * cos_m / sec_atan(slip_tangent);
    let residual_slope = t.br1 + t.br2 * lateral.slope;
    let residual_peak = load.force
        * ((t.dr1 + t.dr2 * dfz) * mirrored + (t.dr_camber1 + t.dr_camber2 * dfz) * side)
        * own_cos(slip_tangent);
    let residual = residual_peak / sec_atan(residual_slope * slips.second);
    let arm = t.s1 * mirrored + t.s2 * y + (t.s_camber1 + t.s_camber2 * dfz) * side;
    let moment = residual - trail * (y - induced) + arm * x;

    let zero = Wheels(0.0);
    let loaded = zero < input.load;
    return TyreForces(select(zero, x, loaded), select(zero, y, loaded), select(zero, moment, loaded));
}
