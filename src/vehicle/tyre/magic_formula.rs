//! Magic Formula 5.2 forces and moment (Pacejka, *Tyre and Vehicle Dynamics*, ch. 4, equations 4.E1-4.E78;
//! `physics.md` section 1). Twin of `shaders/tyre.wgsl`: the same functions in the same order.

use super::prepared::MagicFormula;
use super::{LEAST_LOAD, Tyre, TyreCoefficients, TyreForces, TyreInput, TyreModel};
use crate::scalar::Real;

/// `B x - E (B x - atan(B x))`, the argument of the outer `atan` of every curve.
#[inline(always)]
fn stretched_slip<R: Real>(b: R, e: R, x: R) -> R {
    let bx = b * x;
    bx - e * (bx - bx.atan())
}

/// `sin(C atan u)`: the shape of a force curve.
#[inline(always)]
fn sine_shape<R: Real>(c: R, b: R, e: R, x: R) -> R {
    (c * stretched_slip(b, e, x).atan()).sin()
}

/// `cos(C atan u)`: the shape of a weighting or trail curve.
#[inline(always)]
fn cosine_shape<R: Real>(c: R, b: R, e: R, x: R) -> R {
    (c * stretched_slip(b, e, x).atan()).cos()
}

/// A combined-slip weight: the cosine shape at `x` over that at its shift, where the other slip is nought.
#[inline(always)]
fn weight<R: Real>(c: R, b: R, e: R, x: R, shift: R) -> R {
    cosine_shape(c, b, e, x) / cosine_shape(c, b, e, shift)
}

/// Curvature factors above one turn the curve back on itself.
#[inline(always)]
fn clamp_curvature<R: Real>(e: R) -> R {
    e.min(R::lit(1.0))
}

/// The load (N, floored) and its difference from nominal as a share of nominal.
#[derive(Clone, Copy)]
struct Load<R> {
    force: R,
    difference: R,
}

/// Pure longitudinal slip: force (N) and slip stiffness `Kx` (N).
#[inline(always)]
fn pure_longitudinal<R: Real>(t: &MagicFormula<R>, load: Load<R>, slip_ratio: R) -> (R, R) {
    let dfz = load.difference;
    let mu = t.dx1 + t.dx2 * dfz;
    let k = (t.kx1 + t.kx2 * dfz) * (t.kx3 * dfz).exp();
    let b = k * t.inverse_cx / mu;
    let x = slip_ratio + (t.hx1 + t.hx2 * dfz);
    let e = clamp_curvature((t.ex1 + dfz * (t.ex2 + t.ex3 * dfz)) * (R::lit(1.0) - t.ex4 * x.sign()));
    let force = load.force * (mu * sine_shape(t.cx, b, e, x) + (t.vx1 + t.vx2 * dfz));
    (force, load.force * k)
}

/// What pure side slip yields and the other formulas need.
#[derive(Clone, Copy)]
struct PureLateral<R> {
    /// Force, N.
    force: R,
    /// Peak force `Dy`, N.
    peak: R,
    /// Cornering stiffness `Ky`, N.
    stiffness: R,
    /// `By Cy`, the initial slope per peak force.
    slope: R,
    /// `SHy + SVy/Ky`, the slip at which the residual moment turns.
    residual_shift: R,
}

/// Pure side slip.
#[inline(always)]
fn pure_lateral<R: Real>(t: &MagicFormula<R>, load: Load<R>, slip_tangent: R, side: R) -> PureLateral<R> {
    let dfz = load.difference;
    let one = R::lit(1.0);
    let peak = (t.dy1 + t.dy2 * dfz) * load.force;
    // sin(2 atan z) = 2 z / (1 + z^2).
    let z = load.force * t.ky_load;
    let stiffness = t.ky * (z / (one + z * z));
    let slope = stiffness / peak;
    let horizontal_shift = t.hy1 + t.hy2 * dfz + t.hy_camber * side;
    let vertical_shift = load.force * ((t.vy1 + t.vy2 * dfz) + (t.vy_camber1 + t.vy_camber2 * dfz) * side);
    let x = slip_tangent + horizontal_shift;
    let e = clamp_curvature((t.ey1 + t.ey2 * dfz) * (one - (t.ey3 + t.ey_camber * side) * x.sign()));
    PureLateral {
        force: peak * sine_shape(t.cy, slope * t.inverse_cy, e, x) + vertical_shift,
        peak,
        stiffness,
        slope,
        residual_shift: horizontal_shift + vertical_shift / stiffness,
    }
}

/// The weight that side slip leaves of the longitudinal force.
#[inline(always)]
fn longitudinal_weight<R: Real>(t: &MagicFormula<R>, load: Load<R>, slip_ratio: R, slip_tangent: R) -> R {
    let b = t.rbx1 * (t.rbx2 * slip_ratio).cos_atan();
    let e = clamp_curvature(t.rex1 + t.rex2 * load.difference);
    weight(t.rcx1, b, e, slip_tangent + t.rhx1, t.rhx1)
}

/// The weight that slip ratio leaves of the side force.
#[inline(always)]
fn lateral_weight<R: Real>(t: &MagicFormula<R>, load: Load<R>, slip_ratio: R, slip_tangent: R) -> R {
    let b = t.rby1 * (t.rby2 * (slip_tangent - t.rby3)).cos_atan();
    let e = clamp_curvature(t.rey1 + t.rey2 * load.difference);
    let shift = t.rhy1 + t.rhy2 * load.difference;
    weight(t.rcy1, b, e, slip_ratio + shift, shift)
}

/// The side force `SVyk` that slip ratio induces of itself, N; `peak` is `Dy`.
#[inline(always)]
fn induced_lateral<R: Real>(
    t: &MagicFormula<R>,
    load: Load<R>,
    peak: R,
    slip_ratio: R,
    slip_tangent: R,
    side: R,
) -> R {
    let amplitude = peak * (t.rvy1 + t.rvy2 * load.difference + t.rvy_camber * side);
    amplitude * (t.rvy4 * slip_tangent).cos_atan() * (t.rvy5 * (t.rvy6 * slip_ratio).atan()).sin()
}

/// The tangent of the equivalent slip angle: `x`'s with the slip ratio's share added. `x` is itself the tangent
/// of a slip angle, and the formula as published takes the tangent once more.
#[inline(always)]
fn equivalent_tangent<R: Real>(x: R, slip_share: R) -> R {
    let tangent = x.tan();
    (tangent * tangent + slip_share * slip_share).sqrt() * x.sign()
}

/// Aligning moment (N m) of the side force without its induced part, the residual moment and the arm of `Fx`.
///
/// `forces` are `Fx`, `Fy` and `SVyk` in N.
#[inline(always)]
fn aligning_moment<R: Real>(
    t: &MagicFormula<R>,
    load: Load<R>,
    input: &TyreInput<R>,
    lateral: &PureLateral<R>,
    longitudinal_stiffness: R,
    forces: (R, R, R),
) -> R {
    let (force_x, force_y, induced) = forces;
    let dfz = load.difference;
    let one = R::lit(1.0);
    let side = input.side;
    let slip_share = longitudinal_stiffness / lateral.stiffness * input.slip_ratio;

    let x = input.slip_tangent + (t.ht1 + t.ht2 * dfz + (t.ht_camber1 + t.ht_camber2 * dfz) * side);
    let b = (t.bt1 + dfz * (t.bt2 + t.bt3 * dfz)) * (t.bt_even + t.bt_odd * side);
    let d = load.force * (t.dt1 + t.dt2 * dfz) * (t.dt_even + t.dt_odd * side);
    let e = clamp_curvature(
        (t.et1 + dfz * (t.et2 + t.et3 * dfz)) * (one + (t.et4 + t.et_camber * side) * (b * t.ct * x).atan()),
    );
    let trail = d
        * cosine_shape(t.ct, b, e, equivalent_tangent(x, slip_share).atan())
        * input.slip_tangent.cos_atan();

    let residual_slip = input.slip_tangent + lateral.residual_shift;
    let residual_slope = t.br1 + t.br2 * lateral.slope;
    // The cosine of `a* = tan(alpha)` itself, unlike that of the trail: the reference implementation has it so.
    let residual_peak = load.force
        * (t.dr1 + t.dr2 * dfz + (t.dr_camber1 + t.dr_camber2 * dfz) * side)
        * input.slip_tangent.cos();
    let residual =
        residual_peak * (residual_slope * equivalent_tangent(residual_slip, slip_share).atan()).cos_atan();

    let arm = t.s1 + t.s2 * force_y + (t.s_camber1 + t.s_camber2 * dfz) * side;
    residual - trail * (force_y - induced) + arm * force_x
}

impl<R: Real> Tyre<R> for MagicFormula<R> {
    const FIELDS: &'static [&'static str] = MagicFormula::<R>::FIELDS;
    const MODEL: TyreModel = TyreModel::MagicFormula;

    fn from_parameters(at: impl FnMut(usize) -> R, inclination: R) -> Self {
        TyreCoefficients::from_flat(at).prepare(inclination)
    }

    #[inline(always)]
    fn from_flat(at: impl FnMut(usize) -> R) -> Self {
        MagicFormula::from_flat(at)
    }

    fn to_flat(&self) -> Vec<R> {
        MagicFormula::to_flat(self)
    }

    #[inline(always)]
    fn forces(&self, input: TyreInput<R>) -> TyreForces<R> {
        let force = input.load.max(R::lit(LEAST_LOAD));
        let load = Load {
            force,
            difference: force * self.inverse_nominal - R::lit(1.0),
        };
        let (pure_x, longitudinal_stiffness) = pure_longitudinal(self, load, input.slip_ratio);
        let lateral = pure_lateral(self, load, input.slip_tangent, input.side);
        let x = pure_x * longitudinal_weight(self, load, input.slip_ratio, input.slip_tangent);
        let induced = induced_lateral(
            self,
            load,
            lateral.peak,
            input.slip_ratio,
            input.slip_tangent,
            input.side,
        );
        let y = lateral.force * lateral_weight(self, load, input.slip_ratio, input.slip_tangent) + induced;
        let moment = aligning_moment(
            self,
            load,
            &input,
            &lateral,
            longitudinal_stiffness,
            (x, y, induced),
        );

        let zero = R::lit(0.0);
        let loaded = zero.less_than(input.load);
        TyreForces {
            x: R::select(loaded, x, zero),
            y: R::select(loaded, y, zero),
            aligning_moment: R::select(loaded, moment, zero),
        }
    }
}
