//! Tyres prepared for an axle: scale factors, camber and all else that does not change while driving are folded into fewer
//! figures. Kernels on every backend read this form.

use super::TyreCoefficients;
use crate::scalar::Real;
use crate::vehicle::parameters::fields;

fields! {
    /// Magic Formula 5.2 of one axle, with its static camber folded in. Twin of `MagicFormula` in `shaders/tyre.wgsl`.
    ///
    /// Terms odd in camber hold for the left wheel and are multiplied by the side (`+1` left, `-1` right), on which the same
    /// camber leans the other way; even terms hold for both. Terms that tell left from right without any camber hold for the side on
    /// which the tyre was measured: on the other its mirror image runs, and they are multiplied by `as_measured + by_side side`,
    /// which is 1 on both sides where nobody says which it was. The shape factors that multiply an angle (`cx`, `cy`, `rcx1`,
    /// `rcy1`, `rvy5` and `ct`) are divided by pi, so that the product is in half turns; `bct` is the shape factor of the trail,
    /// undivided.
    pub struct MagicFormula {
        inverse_nominal,
        cx, inverse_cx, dx1, dx2, kx1, kx2, kx3, hx1, hx2, vx1, vx2, ex1, ex2, ex3, ex4,
        cy, inverse_cy, dy1, dy2, ky, ky_load, hy1, hy2, hy_camber, vy1, vy2, vy_camber1, vy_camber2,
        ey1, ey2, ey3, ey_camber,
        rbx1, rbx2, rcx1, rex1, rex2, rhx1,
        rby1, rby2, rby3, rcy1, rey1, rey2, rhy1, rhy2,
        rvy1, rvy2, rvy_camber, rvy4, rvy5, rvy6,
        ct, bct, bt1, bt2, bt3, bt_even, bt_odd, dt1, dt2, dt_even, dt_odd, et1, et2, et3, et4, et_camber,
        ht1, ht2, ht_camber1, ht_camber2,
        br1, br2, dr1, dr2, dr_camber1, dr_camber2,
        s1, s2, s_camber1, s_camber2,
        as_measured, by_side,
    }
}

impl<R: Real> TyreCoefficients<R> {
    /// Prepares the tyre for an axle whose left wheel leans to the right by `inclination` (rad); the right wheel leans to the
    /// left as much (the book, chapter Model, section 1).
    pub fn prepare(&self, inclination: R) -> MagicFormula<R> {
        let one = R::lit(1.0);
        let nominal = self.fnomin * self.lfz0;
        let sine = inclination.sin();
        let gamma_x = inclination * self.lgax;
        let g = sine * self.lgay;
        let gamma_z = inclination * self.lgaz;
        let g_z = sine * self.lgaz;
        let friction_x = (one - self.pdx3 * (gamma_x * gamma_x)) * self.lmux;
        let friction_y = (one - self.pdy3 * (g * g)) * self.lmuy;
        let cx = self.pcx1 * self.lcx;
        let cy = self.pcy1 * self.lcy;
        let stiffness_scale = self.lky / self.lmuy;
        let trail_scale = self.r0 / nominal * self.ltr;
        let residual_scale = self.r0 * self.lmuy;
        let arm_scale = self.r0 * self.ls;
        let over_pi = R::lit(std::f64::consts::FRAC_1_PI);
        let two_over_pi = R::lit(std::f64::consts::FRAC_2_PI);
        MagicFormula {
            inverse_nominal: one / nominal,
            cx: cx * over_pi,
            inverse_cx: one / cx,
            dx1: self.pdx1 * friction_x,
            dx2: self.pdx2 * friction_x,
            kx1: self.pkx1 * self.lkx,
            kx2: self.pkx2 * self.lkx,
            kx3: self.pkx3,
            hx1: self.phx1 * self.lhx,
            hx2: self.phx2 * self.lhx,
            vx1: self.pvx1 * self.lvx * self.lmux,
            vx2: self.pvx2 * self.lvx * self.lmux,
            ex1: self.pex1 * self.lex,
            ex2: self.pex2 * self.lex,
            ex3: self.pex3 * self.lex,
            ex4: self.pex4,
            cy: cy * over_pi,
            inverse_cy: one / cy,
            dy1: self.pdy1 * friction_y,
            dy2: self.pdy2 * friction_y,
            // This contains the factor 2 of sin(2 atan z) = 2 z / (1 + z^2).
            ky: R::lit(2.0) * self.pky1 * nominal * (one - self.pky3 * g.abs()) * self.lky,
            ky_load: one / (self.pky2 * nominal),
            hy1: self.phy1 * self.lhy,
            hy2: self.phy2 * self.lhy,
            hy_camber: self.phy3 * g,
            vy1: self.pvy1 * self.lvy * self.lmuy,
            vy2: self.pvy2 * self.lvy * self.lmuy,
            vy_camber1: self.pvy3 * g * self.lmuy,
            vy_camber2: self.pvy4 * g * self.lmuy,
            ey1: self.pey1 * self.ley,
            ey2: self.pey2 * self.ley,
            ey3: self.pey3,
            ey_camber: self.pey4 * g,
            rbx1: self.rbx1 * self.lxal,
            rbx2: self.rbx2,
            rcx1: self.rcx1 * over_pi,
            rex1: self.rex1,
            rex2: self.rex2,
            rhx1: self.rhx1,
            rby1: self.rby1 * self.lyka,
            rby2: self.rby2,
            rby3: self.rby3,
            rcy1: self.rcy1 * over_pi,
            rey1: self.rey1,
            rey2: self.rey2,
            rhy1: self.rhy1,
            rhy2: self.rhy2,
            rvy1: self.rvy1 * self.lvyka,
            rvy2: self.rvy2 * self.lvyka,
            rvy_camber: self.rvy3 * g * self.lvyka,
            rvy4: self.rvy4,
            rvy5: self.rvy5 * over_pi,
            rvy6: self.rvy6,
            ct: self.qcz1 * over_pi,
            bct: self.qcz1,
            bt1: self.qbz1,
            bt2: self.qbz2,
            bt3: self.qbz3,
            bt_even: (one + self.qbz5 * gamma_z.abs()) * stiffness_scale,
            bt_odd: self.qbz4 * gamma_z * stiffness_scale,
            dt1: self.qdz1 * trail_scale,
            dt2: self.qdz2 * trail_scale,
            dt_even: one + self.qdz4 * (gamma_z * gamma_z),
            dt_odd: self.qdz3 * gamma_z,
            et1: self.qez1,
            et2: self.qez2,
            et3: self.qez3,
            et4: self.qez4 * two_over_pi,
            et_camber: self.qez5 * g_z * two_over_pi,
            ht1: self.qhz1,
            ht2: self.qhz2,
            ht_camber1: self.qhz3 * g_z,
            ht_camber2: self.qhz4 * g_z,
            br1: self.qbz9 * stiffness_scale,
            br2: self.qbz10,
            dr1: self.qdz6 * self.lres * residual_scale,
            dr2: self.qdz7 * self.lres * residual_scale,
            dr_camber1: self.qdz8 * g_z * residual_scale,
            dr_camber2: self.qdz9 * g_z * residual_scale,
            s1: self.ssz1 * arm_scale,
            s2: self.ssz2 * arm_scale / self.fnomin,
            s_camber1: self.ssz3 * gamma_z * arm_scale,
            s_camber2: self.ssz4 * gamma_z * arm_scale,
            as_measured: one - self.tyre_side * self.tyre_side,
            by_side: self.tyre_side,
        }
    }
}
