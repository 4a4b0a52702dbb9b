//! Magic Formula 5.2 forces and moment (Pacejka, *Tyre and Vehicle Dynamics*, ch. 4, equations 4.E1-4.E78;
//! the book, chapter Model, section 1). Twin of `shaders/tyre.wgsl`: the same functions in the same order.

#![deny(clippy::disallowed_methods)]

use super::prepared::MagicFormula;
use super::{LEAST_LOAD, Tyre, TyreCoefficients, TyreForces, TyreInput, TyreModel};
use crate::scalar::{Pair, Real};

/// The angle `C atan(B x - E (B x - atan(B x)))`, in half turns. A curve of the formula is its sine or cosine.
#[derive(Clone, Copy)]
struct Curve<R> {
    /// `C / pi`.
    c: R,
    b: R,
    e: R,
    x: R,
}

impl<R: Real> Curve<R> {
    /// `B x`.
    #[inline(always)]
    fn bx(&self) -> R {
        self.b * self.x
    }

    /// `B x - E (B x - atan(B x))`, given `atan(B x)`.
    #[inline(always)]
    fn stretched(&self, atan_bx: R) -> R {
        let bx = self.bx();
        bx - self.e * (bx - atan_bx)
    }
}

/// Curvature factors above one turn the curve back on itself.
#[inline(always)]
fn clamp_curvature<R: Real>(e: R) -> R {
    e.min(R::lit(1.0))
}

/// The load (N, at least `LEAST_LOAD`) and its difference from the nominal load, as a share of it.
#[derive(Clone, Copy)]
struct Load<R> {
    force: R,
    difference: R,
}

/// Results of pure slip that the other formulas need. The force is `peak sin(angle) + shift`.
#[derive(Clone, Copy)]
struct PureSlip<R> {
    curve: Curve<R>,
    /// Peak force `D`, N.
    peak: R,
    /// `SV`, N.
    vertical_shift: R,
    /// Slip stiffness `K`, N.
    stiffness: R,
}

/// Pure longitudinal slip.
#[inline(always)]
fn pure_longitudinal<R: Real>(t: &MagicFormula<R>, load: Load<R>, slip_ratio: R) -> PureSlip<R> {
    let dfz = load.difference;
    let mu = t.dx1 + t.dx2 * dfz;
    let k = (t.kx1 + t.kx2 * dfz) * (t.kx3 * dfz).exp();
    let x = slip_ratio + (t.hx1 + t.hx2 * dfz);
    PureSlip {
        curve: Curve {
            c: t.cx,
            b: k * t.inverse_cx / mu,
            e: clamp_curvature((t.ex1 + dfz * (t.ex2 + t.ex3 * dfz)) * (R::lit(1.0) - t.ex4 * x.sign())),
            x,
        },
        peak: load.force * mu,
        vertical_shift: load.force * (t.vx1 + t.vx2 * dfz),
        stiffness: load.force * k,
    }
}

/// What terms are multiplied by that tell left from right without any camber: -1 where the mirror image of the tyre runs.
#[inline(always)]
fn mirror<R: Real>(t: &MagicFormula<R>, side: R) -> R {
    t.as_measured + t.by_side * side
}

/// Pure side slip, with two figures for the residual moment: `By Cy` and `SHy + SVy/Ky`.
#[inline(always)]
fn pure_lateral<R: Real>(
    t: &MagicFormula<R>,
    load: Load<R>,
    slip_tangent: R,
    side: R,
) -> (PureSlip<R>, R, R) {
    let (dfz, mirror) = (load.difference, mirror(t, side));
    let one = R::lit(1.0);
    let peak = (t.dy1 + t.dy2 * dfz) * load.force;
    // sin(2 atan z) = 2 z / (1 + z^2).
    let z = load.force * t.ky_load;
    let stiffness = t.ky * (z / (one + z * z));
    let slope = stiffness / peak;
    let horizontal_shift = (t.hy1 + t.hy2 * dfz) * mirror + t.hy_camber * side;
    let vertical_shift =
        load.force * ((t.vy1 + t.vy2 * dfz) * mirror + (t.vy_camber1 + t.vy_camber2 * dfz) * side);
    let x = slip_tangent + horizontal_shift;
    let pure = PureSlip {
        curve: Curve {
            c: t.cy,
            b: slope * t.inverse_cy,
            e: clamp_curvature(
                (t.ey1 + t.ey2 * dfz) * (one - (t.ey3 * mirror + t.ey_camber * side) * x.sign()),
            ),
            x,
        },
        peak,
        vertical_shift,
        stiffness,
    };
    (pure, slope, horizontal_shift + vertical_shift / stiffness)
}

/// The curve of the weight by which side slip reduces the longitudinal force: its cosine at `x` over its cosine at the shift.
#[inline(always)]
fn longitudinal_weight<R: Real>(
    t: &MagicFormula<R>,
    load: Load<R>,
    slip_ratio: R,
    (slip_tangent, mirror): (R, R),
) -> [Curve<R>; 2] {
    let b = t.rbx1 / (t.rbx2 * slip_ratio).sec_atan();
    let e = clamp_curvature(t.rex1 + t.rex2 * load.difference);
    let (c, shift) = (t.rcx1, t.rhx1 * mirror);
    let x = slip_tangent + shift;
    [Curve { c, b, e, x }, Curve { c, b, e, x: shift }]
}

/// The curve of the weight by which slip ratio reduces the side force.
#[inline(always)]
fn lateral_weight<R: Real>(
    t: &MagicFormula<R>,
    load: Load<R>,
    slip_ratio: R,
    (slip_tangent, mirror): (R, R),
) -> [Curve<R>; 2] {
    let b = t.rby1 / (t.rby2 * (slip_tangent - t.rby3 * mirror)).sec_atan();
    let e = clamp_curvature(t.rey1 + t.rey2 * load.difference);
    let (c, shift) = (t.rcy1, t.rhy1 + t.rhy2 * load.difference);
    let x = slip_ratio + shift;
    [Curve { c, b, e, x }, Curve { c, b, e, x: shift }]
}

/// The tangent of the equivalent slip angle, which adds the share of the slip ratio to `x`. `x` is itself the tangent of a slip
/// angle; the published formula takes the tangent of it once more, and so does this function.
#[inline(always)]
fn equivalent_tangent<R: Real>(x: R, tangent: R, slip_share: R) -> R {
    (tangent * tangent + slip_share * slip_share).sqrt() * x.sign()
}

/// Forces and aligning moment under combined slip.
#[inline(always)]
fn combined_slip<R: Real>(t: &MagicFormula<R>, input: TyreInput<R>) -> TyreForces<R> {
    let force = input.load.max(R::lit(LEAST_LOAD));
    let load = Load {
        force,
        difference: force * t.inverse_nominal - R::lit(1.0),
    };
    let (dfz, side, one) = (load.difference, input.side, R::lit(1.0));
    let (slip_ratio, slip_tangent) = (input.slip_ratio, input.slip_tangent);
    let mirror = mirror(t, side);
    let pure_x = pure_longitudinal(t, load, slip_ratio);
    let (pure_y, slope, residual_shift) = pure_lateral(t, load, slip_tangent, side);

    // Each curve is a chain of an inner arc tangent, an outer one and a sine or cosine: `f` of a pure force, `w` of a weight and
    // `w0` of its shift, `m` of the trail. Curves of one kind are computed side by side.
    let [wx, wx0] = longitudinal_weight(t, load, slip_ratio, (slip_tangent, mirror));
    let [wy, wy0] = lateral_weight(t, load, slip_ratio, (slip_tangent, mirror));
    let (fx, fy) = (pure_x.curve, pure_y.curve);

    // Equivalent slip angles of the trail and the residual moment.
    let slip_share = pure_x.stiffness / pure_y.stiffness * slip_ratio;
    let trail_x =
        slip_tangent + ((t.ht1 + t.ht2 * dfz) * mirror + (t.ht_camber1 + t.ht_camber2 * dfz) * side);
    let residual_x = slip_tangent + residual_shift;
    let [trail_tangent, residual_tangent] = R::tan_each([trail_x, residual_x]);
    let trail_b = (t.bt1 + dfz * (t.bt2 + t.bt3 * dfz)) * (t.bt_even + t.bt_odd * (side * mirror));
    let [
        fx_atan,
        fy_atan,
        wx_atan,
        wx0_atan,
        wy_atan,
        wy0_atan,
        trail_angle,
        induced_angle,
    ] = R::atan_each([
        fx.bx(),
        fy.bx(),
        wx.bx(),
        wx0.bx(),
        wy.bx(),
        wy0.bx(),
        trail_b * t.bct * trail_x,
        t.rvy6 * slip_ratio,
    ]);
    let [trail_slip, residual_slip, wx_atan, wx0_atan, wy_atan, wy0_atan] = R::atan_each([
        equivalent_tangent(trail_x, trail_tangent, slip_share),
        equivalent_tangent(residual_x, residual_tangent, slip_share),
        wx.stretched(wx_atan),
        wx0.stretched(wx0_atan),
        wy.stretched(wy_atan),
        wy0.stretched(wy0_atan),
    ]);
    let m = Curve {
        c: t.ct,
        b: trail_b,
        e: clamp_curvature(
            (t.et1 + dfz * (t.et2 + t.et3 * dfz))
                * (one + (t.et4 * mirror + t.et_camber * side) * trail_angle),
        ),
        x: trail_slip,
    };
    let [m_atan, fx_atan, fy_atan] = R::atan_each([m.bx(), fx.stretched(fx_atan), fy.stretched(fy_atan)]);
    let [cos_wx, cos_wx0, cos_wy, cos_wy0] =
        R::cos_pi_each([wx.c * wx_atan, wx0.c * wx0_atan, wy.c * wy_atan, wy0.c * wy0_atan]);
    let m_atan = m.stretched(m_atan).atan();
    let [sin_x, sin_y, sin_induced] =
        R::sin_pi_each([fx.c * fx_atan, fy.c * fy_atan, t.rvy5 * induced_angle]);
    let cos_m = (m.c * m_atan).cos_pi();

    let x = (pure_x.peak * sin_x + pure_x.vertical_shift) * (cos_wx / cos_wx0);
    let amplitude = pure_y.peak * ((t.rvy1 + t.rvy2 * dfz) * mirror + t.rvy_camber * side);
    let induced = amplitude / (t.rvy4 * slip_tangent).sec_atan() * sin_induced;
    let y = (pure_y.peak * sin_y + pure_y.vertical_shift) * (cos_wy / cos_wy0) + induced;

    let d = load.force * (t.dt1 + t.dt2 * dfz) * (t.dt_even + t.dt_odd * (side * mirror));
    let trail = d * cos_m / slip_tangent.sec_atan();
    let residual_slope = t.br1 + t.br2 * slope;
    // This is the cosine of `a* = tan(alpha)` itself, as in the reference implementation. The trail uses another cosine.
    let residual_peak = load.force
        * ((t.dr1 + t.dr2 * dfz) * mirror + (t.dr_camber1 + t.dr_camber2 * dfz) * side)
        * slip_tangent.cos();
    let residual = residual_peak / (residual_slope * residual_slip).sec_atan();
    let arm = t.s1 * mirror + t.s2 * y + (t.s_camber1 + t.s_camber2 * dfz) * side;
    let moment = residual - trail * (y - induced) + arm * x;

    let zero = R::lit(0.0);
    let loaded = zero.less_than(input.load);
    TyreForces {
        x: R::select(loaded, x, zero),
        y: R::select(loaded, y, zero),
        aligning_moment: R::select(loaded, moment, zero),
    }
}

impl<R: Real> Tyre<R> for MagicFormula<R> {
    const FIELDS: &'static [&'static str] = MagicFormula::<R>::FIELDS;
    const MODEL: TyreModel = TyreModel::MagicFormula;

    fn from_parameters(flat: &[R], inclination: R) -> Self {
        TyreCoefficients::from_flat(flat).prepare(inclination)
    }

    fn from_flat(flat: &[R]) -> Self {
        MagicFormula::from_flat(flat)
    }

    fn to_flat(&self) -> Vec<R> {
        MagicFormula::to_flat(self)
    }

    #[inline(always)]
    fn forces(&self, input: TyreInput<R>) -> TyreForces<R> {
        combined_slip(self, input)
    }

    #[inline(always)]
    fn axle_forces(&self, [left, right]: [TyreInput<R>; 2]) -> [TyreForces<R>; 2] {
        let input = TyreInput {
            load: Pair(left.load, right.load),
            slip_ratio: Pair(left.slip_ratio, right.slip_ratio),
            slip_tangent: Pair(left.slip_tangent, right.slip_tangent),
            side: Pair(left.side, right.side),
        };
        let forces = combined_slip(&self.map(|figure| Pair(figure, figure)), input);
        let of = |x, y, aligning_moment| TyreForces {
            x,
            y,
            aligning_moment,
        };
        [
            of(forces.x.0, forces.y.0, forces.aligning_moment.0),
            of(forces.x.1, forces.y.1, forces.aligning_moment.1),
        ]
    }
}
