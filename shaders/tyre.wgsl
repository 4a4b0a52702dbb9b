// Twin of `src/vehicle/tyre/magic_formula.rs`: Magic Formula 5.2 forces and moment, the same functions in the
// same order. The coefficients are those of `src/vehicle/tyre/coefficients.rs`.

struct TyreCoefficients {
    r0: f32,
    fnomin: f32,
    lfz0: f32,
    lcx: f32,
    lmux: f32,
    lex: f32,
    lkx: f32,
    lhx: f32,
    lvx: f32,
    lgax: f32,
    lcy: f32,
    lmuy: f32,
    ley: f32,
    lky: f32,
    lhy: f32,
    lvy: f32,
    lgay: f32,
    ltr: f32,
    lres: f32,
    lgaz: f32,
    lxal: f32,
    lyka: f32,
    lvyka: f32,
    ls: f32,
    pcx1: f32,
    pdx1: f32,
    pdx2: f32,
    pdx3: f32,
    pex1: f32,
    pex2: f32,
    pex3: f32,
    pex4: f32,
    pkx1: f32,
    pkx2: f32,
    pkx3: f32,
    phx1: f32,
    phx2: f32,
    pvx1: f32,
    pvx2: f32,
    rbx1: f32,
    rbx2: f32,
    rcx1: f32,
    rex1: f32,
    rex2: f32,
    rhx1: f32,
    pcy1: f32,
    pdy1: f32,
    pdy2: f32,
    pdy3: f32,
    pey1: f32,
    pey2: f32,
    pey3: f32,
    pey4: f32,
    pky1: f32,
    pky2: f32,
    pky3: f32,
    phy1: f32,
    phy2: f32,
    phy3: f32,
    pvy1: f32,
    pvy2: f32,
    pvy3: f32,
    pvy4: f32,
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
    rvy3: f32,
    rvy4: f32,
    rvy5: f32,
    rvy6: f32,
    qbz1: f32,
    qbz2: f32,
    qbz3: f32,
    qbz4: f32,
    qbz5: f32,
    qbz9: f32,
    qbz10: f32,
    qcz1: f32,
    qdz1: f32,
    qdz2: f32,
    qdz3: f32,
    qdz4: f32,
    qdz6: f32,
    qdz7: f32,
    qdz8: f32,
    qdz9: f32,
    qez1: f32,
    qez2: f32,
    qez3: f32,
    qez4: f32,
    qez5: f32,
    qhz1: f32,
    qhz2: f32,
    qhz3: f32,
    qhz4: f32,
    ssz1: f32,
    ssz2: f32,
    ssz3: f32,
    ssz4: f32,
}

alias Tyre = TyreCoefficients;

// `LEAST_LOAD` in `src/vehicle/tyre/mod.rs`.
const LEAST_LOAD: f32 = 1e-3;

fn stretched_slip(b: f32, e: f32, x: f32) -> f32 {
    let bx = b * x;
    return bx - e * (bx - own_atan(bx));
}

fn sine_shape(c: f32, b: f32, e: f32, x: f32) -> f32 {
    return own_sin(c * own_atan(stretched_slip(b, e, x)));
}

fn cosine_shape(c: f32, b: f32, e: f32, x: f32) -> f32 {
    return own_cos(c * own_atan(stretched_slip(b, e, x)));
}

fn clamp_curvature(e: f32) -> f32 {
    return min(e, 1.0);
}

struct Load {
    force: f32,
    nominal: f32,
    difference: f32,
}

struct PureLongitudinal {
    force: f32,
    stiffness: f32,
}

fn pure_longitudinal(t: TyreCoefficients, load: Load, slip_ratio: f32, camber: Camber) -> PureLongitudinal {
    let dfz = load.difference;
    let gamma = camber.angle * t.lgax;
    let c = t.pcx1 * t.lcx;
    let mu = (t.pdx1 + t.pdx2 * dfz) * (1.0 - t.pdx3 * (gamma * gamma)) * t.lmux;
    let d = mu * load.force;
    let k = load.force * (t.pkx1 + t.pkx2 * dfz) * own_exp(t.pkx3 * dfz) * t.lkx;
    let b = k / (c * d);
    let x = slip_ratio + (t.phx1 + t.phx2 * dfz) * t.lhx;
    let shift = load.force * (t.pvx1 + t.pvx2 * dfz) * t.lvx * t.lmux;
    let e = clamp_curvature((t.pex1 + dfz * (t.pex2 + t.pex3 * dfz)) * (1.0 - t.pex4 * sign_of(x)) * t.lex);
    return PureLongitudinal(d * sine_shape(c, b, e, x) + shift, k);
}

struct PureLateral {
    force: f32,
    friction: f32,
    stiffness: f32,
    slope: f32,
    residual_shift: f32,
}

fn pure_lateral(t: TyreCoefficients, load: Load, slip_tangent: f32, camber: Camber) -> PureLateral {
    let dfz = load.difference;
    let g = camber.sine * t.lgay;
    let c = t.pcy1 * t.lcy;
    let mu = (t.pdy1 + t.pdy2 * dfz) * (1.0 - t.pdy3 * (g * g)) * t.lmuy;
    let d = mu * load.force;
    let z = load.force / (t.pky2 * load.nominal);
    let k = t.pky1 * load.nominal * ((z + z) / (1.0 + z * z)) * (1.0 - t.pky3 * abs(g)) * t.lky;
    let slope = k / d;
    let horizontal_shift = (t.phy1 + t.phy2 * dfz) * t.lhy + t.phy3 * g;
    let vertical_shift =
        load.force * ((t.pvy1 + t.pvy2 * dfz) * t.lvy + (t.pvy3 + t.pvy4 * dfz) * g) * t.lmuy;
    let x = slip_tangent + horizontal_shift;
    let e = clamp_curvature((t.pey1 + t.pey2 * dfz) * (1.0 - (t.pey3 + t.pey4 * g) * sign_of(x)) * t.ley);
    return PureLateral(
        d * sine_shape(c, slope / c, e, x) + vertical_shift,
        mu,
        k,
        slope,
        horizontal_shift + vertical_shift / k,
    );
}

fn longitudinal_weight(t: TyreCoefficients, load: Load, slip_ratio: f32, slip_tangent: f32) -> f32 {
    let b = t.rbx1 * cos_atan(t.rbx2 * slip_ratio) * t.lxal;
    let e = clamp_curvature(t.rex1 + t.rex2 * load.difference);
    return cosine_shape(t.rcx1, b, e, slip_tangent + t.rhx1) / cosine_shape(t.rcx1, b, e, t.rhx1);
}

fn lateral_weight(t: TyreCoefficients, load: Load, slip_ratio: f32, slip_tangent: f32) -> f32 {
    let b = t.rby1 * cos_atan(t.rby2 * (slip_tangent - t.rby3)) * t.lyka;
    let e = clamp_curvature(t.rey1 + t.rey2 * load.difference);
    let shift = t.rhy1 + t.rhy2 * load.difference;
    return cosine_shape(t.rcy1, b, e, slip_ratio + shift) / cosine_shape(t.rcy1, b, e, shift);
}

fn induced_lateral(
    t: TyreCoefficients,
    load: Load,
    friction: f32,
    slip_ratio: f32,
    slip_tangent: f32,
    camber: Camber,
) -> f32 {
    let g = camber.sine * t.lgay;
    let peak = friction
        * load.force
        * (t.rvy1 + t.rvy2 * load.difference + t.rvy3 * g)
        * cos_atan(t.rvy4 * slip_tangent);
    return peak * own_sin(t.rvy5 * own_atan(t.rvy6 * slip_ratio)) * t.lvyka;
}

fn equivalent_tangent(x: f32, slip_share: f32) -> f32 {
    let tangent = own_sin(x) / own_cos(x);
    return sqrt(tangent * tangent + slip_share * slip_share) * sign_of(x);
}

fn aligning_moment(
    t: TyreCoefficients,
    load: Load,
    input: TyreInput,
    lateral: PureLateral,
    longitudinal_stiffness: f32,
    force_x: f32,
    force_y: f32,
    induced: f32,
) -> f32 {
    let dfz = load.difference;
    let gamma = input.camber.angle * t.lgaz;
    let g = input.camber.sine * t.lgaz;
    let cos_slip = cos_atan(input.slip_tangent);
    let stiffness_scale = t.lky / t.lmuy;
    let slip_share = longitudinal_stiffness / lateral.stiffness * input.slip_ratio;

    let x = input.slip_tangent + t.qhz1 + t.qhz2 * dfz + (t.qhz3 + t.qhz4 * dfz) * g;
    let b = (t.qbz1 + dfz * (t.qbz2 + t.qbz3 * dfz))
        * (1.0 + t.qbz4 * gamma + t.qbz5 * abs(gamma))
        * stiffness_scale;
    let d = load.force
        * (t.qdz1 + t.qdz2 * dfz)
        * (1.0 + gamma * (t.qdz3 + t.qdz4 * gamma))
        * (t.r0 / load.nominal)
        * t.ltr;
    let e = clamp_curvature(
        (t.qez1 + dfz * (t.qez2 + t.qez3 * dfz))
            * (1.0 + (t.qez4 + t.qez5 * g) * (0.6366197723675814 * own_atan(b * t.qcz1 * x))),
    );
    let trail = d * cosine_shape(t.qcz1, b, e, own_atan(equivalent_tangent(x, slip_share))) * cos_slip;

    let residual_slip = input.slip_tangent + lateral.residual_shift;
    let residual_slope = t.qbz9 * stiffness_scale + t.qbz10 * lateral.slope;
    let residual_peak = load.force
        * t.r0
        * ((t.qdz6 + t.qdz7 * dfz) * t.lres + (t.qdz8 + t.qdz9 * dfz) * g)
        * t.lmuy
        * own_cos(input.slip_tangent);
    let residual =
        residual_peak * cos_atan(residual_slope * own_atan(equivalent_tangent(residual_slip, slip_share)));

    let arm = t.r0 * (t.ssz1 + t.ssz2 * (force_y / t.fnomin) + (t.ssz3 + t.ssz4 * dfz) * gamma) * t.ls;
    return residual - trail * (force_y - induced) + arm * force_x;
}

fn tyre_forces(t: TyreCoefficients, input: TyreInput) -> TyreForces {
    let nominal = t.fnomin * t.lfz0;
    let force = max(input.load, LEAST_LOAD);
    let load = Load(force, nominal, (force - nominal) / nominal);
    let pure_x = pure_longitudinal(t, load, input.slip_ratio, input.camber);
    let lateral = pure_lateral(t, load, input.slip_tangent, input.camber);
    let x = pure_x.force * longitudinal_weight(t, load, input.slip_ratio, input.slip_tangent);
    let induced = induced_lateral(
        t,
        load,
        lateral.friction,
        input.slip_ratio,
        input.slip_tangent,
        input.camber,
    );
    let y = lateral.force * lateral_weight(t, load, input.slip_ratio, input.slip_tangent) + induced;
    let moment = aligning_moment(t, load, input, lateral, pure_x.stiffness, x, y, induced);
    let loaded = 0.0 < input.load;
    return TyreForces(select(0.0, x, loaded), select(0.0, y, loaded), select(0.0, moment, loaded));
}
