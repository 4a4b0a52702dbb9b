//! Magic Formula 5.2 forces and moment (Pacejka, *Tyre and Vehicle Dynamics*, ch. 4, equations 4.E1-4.E78;
//! `physics.md` section 1). Twin of `shaders/tyre.wgsl`: the same functions in the same order.

use super::{Camber, LEAST_LOAD, Tyre, TyreCoefficients, TyreForces, TyreInput, TyreModel};
use crate::scalar::Real;
use crate::vehicle::parameters::ParameterInfo;

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

/// Curvature factors above one turn the curve back on itself.
#[inline(always)]
fn clamp_curvature<R: Real>(e: R) -> R {
    e.min(R::lit(1.0))
}

/// Loads of one evaluation: the load itself (floored), and its relative difference from nominal.
#[derive(Clone, Copy)]
struct Load<R> {
    force: R,
    nominal: R,
    difference: R,
}

/// Pure longitudinal slip: force (N) and slip stiffness `Kx` (N).
#[inline(always)]
fn pure_longitudinal<R: Real>(
    t: &TyreCoefficients<R>,
    load: Load<R>,
    slip_ratio: R,
    camber: Camber<R>,
) -> (R, R) {
    let dfz = load.difference;
    let one = R::lit(1.0);
    let gamma = camber.angle * t.lgax;
    let c = t.pcx1 * t.lcx;
    let mu = (t.pdx1 + t.pdx2 * dfz) * (one - t.pdx3 * (gamma * gamma)) * t.lmux;
    let d = mu * load.force;
    let k = load.force * (t.pkx1 + t.pkx2 * dfz) * (t.pkx3 * dfz).exp() * t.lkx;
    let b = k / (c * d);
    let x = slip_ratio + (t.phx1 + t.phx2 * dfz) * t.lhx;
    let shift = load.force * (t.pvx1 + t.pvx2 * dfz) * t.lvx * t.lmux;
    let e = clamp_curvature((t.pex1 + dfz * (t.pex2 + t.pex3 * dfz)) * (one - t.pex4 * x.sign()) * t.lex);
    (d * sine_shape(c, b, e, x) + shift, k)
}

/// What pure side slip yields and the other formulas need.
#[derive(Clone, Copy)]
struct PureLateral<R> {
    force: R,
    /// Friction coefficient `mu_y`.
    friction: R,
    /// Cornering stiffness `Ky`, N.
    stiffness: R,
    /// `By Cy`, the initial slope per peak force.
    slope: R,
    /// `SHy + SVy/Ky`, the slip at which the residual moment turns.
    residual_shift: R,
}

/// Pure side slip.
#[inline(always)]
fn pure_lateral<R: Real>(
    t: &TyreCoefficients<R>,
    load: Load<R>,
    slip_tangent: R,
    camber: Camber<R>,
) -> PureLateral<R> {
    let dfz = load.difference;
    let one = R::lit(1.0);
    let g = camber.sine * t.lgay;
    let c = t.pcy1 * t.lcy;
    let mu = (t.pdy1 + t.pdy2 * dfz) * (one - t.pdy3 * (g * g)) * t.lmuy;
    let d = mu * load.force;
    // sin(2 atan z) = 2 z / (1 + z^2).
    let z = load.force / (t.pky2 * load.nominal);
    let k = t.pky1 * load.nominal * ((z + z) / (one + z * z)) * (one - t.pky3 * g.abs()) * t.lky;
    let slope = k / d;
    let horizontal_shift = (t.phy1 + t.phy2 * dfz) * t.lhy + t.phy3 * g;
    let vertical_shift =
        load.force * ((t.pvy1 + t.pvy2 * dfz) * t.lvy + (t.pvy3 + t.pvy4 * dfz) * g) * t.lmuy;
    let x = slip_tangent + horizontal_shift;
    let e = clamp_curvature((t.pey1 + t.pey2 * dfz) * (one - (t.pey3 + t.pey4 * g) * x.sign()) * t.ley);
    PureLateral {
        force: d * sine_shape(c, slope / c, e, x) + vertical_shift,
        friction: mu,
        stiffness: k,
        slope,
        residual_shift: horizontal_shift + vertical_shift / k,
    }
}

/// The weight that side slip leaves of the longitudinal force.
#[inline(always)]
fn longitudinal_weight<R: Real>(t: &TyreCoefficients<R>, load: Load<R>, slip_ratio: R, slip_tangent: R) -> R {
    let b = t.rbx1 * (t.rbx2 * slip_ratio).cos_atan() * t.lxal;
    let e = clamp_curvature(t.rex1 + t.rex2 * load.difference);
    cosine_shape(t.rcx1, b, e, slip_tangent + t.rhx1) / cosine_shape(t.rcx1, b, e, t.rhx1)
}

/// The weight that slip ratio leaves of the side force.
#[inline(always)]
fn lateral_weight<R: Real>(t: &TyreCoefficients<R>, load: Load<R>, slip_ratio: R, slip_tangent: R) -> R {
    let b = t.rby1 * (t.rby2 * (slip_tangent - t.rby3)).cos_atan() * t.lyka;
    let e = clamp_curvature(t.rey1 + t.rey2 * load.difference);
    let shift = t.rhy1 + t.rhy2 * load.difference;
    cosine_shape(t.rcy1, b, e, slip_ratio + shift) / cosine_shape(t.rcy1, b, e, shift)
}

/// The side force `SVyk` that slip ratio induces of itself, N.
#[inline(always)]
fn induced_lateral<R: Real>(
    t: &TyreCoefficients<R>,
    load: Load<R>,
    friction: R,
    slip_ratio: R,
    slip_tangent: R,
    camber: Camber<R>,
) -> R {
    let g = camber.sine * t.lgay;
    let peak = friction
        * load.force
        * (t.rvy1 + t.rvy2 * load.difference + t.rvy3 * g)
        * (t.rvy4 * slip_tangent).cos_atan();
    peak * (t.rvy5 * (t.rvy6 * slip_ratio).atan()).sin() * t.lvyka
}

/// `tan^2 x` with the slip ratio's share added: the square of the tangent of the equivalent slip angle. Its
/// argument is itself a tangent of a small angle, and the formula as published takes the tangent once more.
#[inline(always)]
fn equivalent_tangent<R: Real>(x: R, slip_share: R) -> R {
    let tangent = x.sin() / x.cos();
    (tangent * tangent + slip_share * slip_share).sqrt() * x.sign()
}

/// Aligning moment (N m) of the side force without its induced part, the residual moment and the arm of `Fx`.
#[inline(always)]
fn aligning_moment<R: Real>(
    t: &TyreCoefficients<R>,
    load: Load<R>,
    input: &TyreInput<R>,
    lateral: &PureLateral<R>,
    longitudinal_stiffness: R,
    forces: (R, R, R),
) -> R {
    let (force_x, force_y, induced) = forces;
    let dfz = load.difference;
    let one = R::lit(1.0);
    let gamma = input.camber.angle * t.lgaz;
    let g = input.camber.sine * t.lgaz;
    let cos_slip = input.slip_tangent.cos_atan();
    let stiffness_scale = t.lky / t.lmuy;
    let slip_share = longitudinal_stiffness / lateral.stiffness * input.slip_ratio;

    let x = input.slip_tangent + t.qhz1 + t.qhz2 * dfz + (t.qhz3 + t.qhz4 * dfz) * g;
    let b = (t.qbz1 + dfz * (t.qbz2 + t.qbz3 * dfz))
        * (one + t.qbz4 * gamma + t.qbz5 * gamma.abs())
        * stiffness_scale;
    let d = load.force
        * (t.qdz1 + t.qdz2 * dfz)
        * (one + gamma * (t.qdz3 + t.qdz4 * gamma))
        * (t.r0 / load.nominal)
        * t.ltr;
    let e = clamp_curvature(
        (t.qez1 + dfz * (t.qez2 + t.qez3 * dfz))
            * (one + (t.qez4 + t.qez5 * g) * (R::lit(std::f64::consts::FRAC_2_PI) * (b * t.qcz1 * x).atan())),
    );
    let trail = d * cosine_shape(t.qcz1, b, e, equivalent_tangent(x, slip_share).atan()) * cos_slip;

    let residual_slip = input.slip_tangent + lateral.residual_shift;
    let residual_slope = t.qbz9 * stiffness_scale + t.qbz10 * lateral.slope;
    // The cosine of `a* = tan(alpha)` itself, unlike that of the trail: the reference implementation has it so.
    let residual_peak = load.force
        * t.r0
        * ((t.qdz6 + t.qdz7 * dfz) * t.lres + (t.qdz8 + t.qdz9 * dfz) * g)
        * t.lmuy
        * input.slip_tangent.cos();
    let residual =
        residual_peak * (residual_slope * equivalent_tangent(residual_slip, slip_share).atan()).cos_atan();

    let arm = t.r0 * (t.ssz1 + t.ssz2 * (force_y / t.fnomin) + (t.ssz3 + t.ssz4 * dfz) * gamma) * t.ls;
    residual - trail * (force_y - induced) + arm * force_x
}

impl<R: Real> Tyre<R> for TyreCoefficients<R> {
    const PARAMETERS: &'static [ParameterInfo] = TyreCoefficients::<R>::PARAMETERS;
    const MODEL: TyreModel = TyreModel::MagicFormula;

    #[inline(always)]
    fn from_flat(at: impl FnMut(usize) -> R) -> Self {
        TyreCoefficients::from_flat(at)
    }

    #[inline(always)]
    fn forces(&self, input: TyreInput<R>) -> TyreForces<R> {
        let nominal = self.fnomin * self.lfz0;
        let force = input.load.max(R::lit(LEAST_LOAD));
        let load = Load {
            force,
            nominal,
            difference: (force - nominal) / nominal,
        };
        let (pure_x, longitudinal_stiffness) = pure_longitudinal(self, load, input.slip_ratio, input.camber);
        let lateral = pure_lateral(self, load, input.slip_tangent, input.camber);
        let x = pure_x * longitudinal_weight(self, load, input.slip_ratio, input.slip_tangent);
        let induced = induced_lateral(
            self,
            load,
            lateral.friction,
            input.slip_ratio,
            input.slip_tangent,
            input.camber,
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
