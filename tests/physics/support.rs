//! What the physics tests share.
#![allow(dead_code)] // each test binary uses its own part

use lapswarm::scalar::Real;
use lapswarm::vehicle::model::runge_kutta_step;
use lapswarm::vehicle::tyre::{Tyre, TyreFile, TyreForces, TyreInput};
use lapswarm::vehicle::{Car, CarInput, CarModel, CarState, Chassis, TyreCoefficients};
use std::collections::BTreeMap;
use std::path::Path;

/// Set B: a published MF 5.2 set of a 235/60 R16 road tyre; scale factors are one.
pub const SET_B: &str = "
    UNLOADED_RADIUS=0.344 FNOMIN=4850 PCX1=1.6411 PDX1=1.1739 PDX2=-0.16395 PDX3=5 PEX1=0.46403 PEX2=0.25022
    PEX3=0.067842 PEX4=-3.7604e-05 PKX1=22.303 PKX2=0.48896 PKX3=0.21253 PHX1=0.0012297 PHX2=0.0004318
    PVX1=-8.8098e-06 PVX2=1.862e-05 RBX1=13.276 RBX2=-13.778 RCX1=1.2568 REX1=0.65225 REX2=-0.24948 RHX1=0.0050722
    PCY1=1.3507 PDY1=1.0489 PDY2=-0.18033 PDY3=-2.8821 PEY1=-0.0074722 PEY2=-0.0063208 PEY3=-9.9935 PEY4=-760.14
    PKY1=-21.92 PKY2=2.0012 PKY3=-0.024778 PHY1=0.0026747 PHY2=8.9094e-05 PHY3=0.031415 PVY1=0.037318 PVY2=-0.010049
    PVY3=-0.32931 PVY4=-0.69553 RBY1=7.1433 RBY2=9.1916 RBY3=-0.027856 RCY1=1.0719 REY1=-0.27572 REY2=0.32802
    RHY1=5.7448e-06 RHY2=-3.1368e-05 RVY1=-0.027825 RVY2=0.053604 RVY3=-0.27568 RVY4=12.12 RVY5=1.9 RVY6=-10.704
    QBZ1=10.904 QBZ2=-1.8412 QBZ3=-0.52041 QBZ4=0.039211 QBZ5=0.41511 QBZ9=8.9846 QBZ10=0 QCZ1=1.2136 QDZ1=0.093509
    QDZ2=-0.009218 QDZ3=-0.057061 QDZ4=0.73954 QDZ6=-0.0067783 QDZ7=0.0052254 QDZ8=-0.18175 QDZ9=0.029952
    QEZ1=-1.5697 QEZ2=0.33394 QEZ3=0 QEZ4=0.26711 QEZ5=-3.594 QHZ1=0.0047326 QHZ2=0.0026687 QHZ3=0.11998
    QHZ4=0.059083 SSZ1=0.033372 SSZ2=0.0043624 SSZ3=0.56742 SSZ4=-0.24116";

/// A tyre from `KEY=value` words, of which the last of a key counts.
pub fn tyre_from(words: &str) -> TyreCoefficients<f64> {
    let entries: BTreeMap<&str, &str> = words
        .split_whitespace()
        .filter_map(|word| word.split_once('='))
        .collect();
    let lines: Vec<String> = entries
        .iter()
        .map(|(key, value)| format!("{key} = {value}"))
        .collect();
    let text = format!("[MODEL]\nFITTYP = 6\n{}\n", lines.join("\n"));
    TyreFile::parse(Path::new("a tyre of a test"), &text)
        .unwrap()
        .coefficients
}

/// The coefficients of [`SET_B`].
pub fn set_b() -> TyreCoefficients<f64> {
    tyre_from(SET_B)
}

/// Forces of an upright tyre or one made ready for its camber, at a load (N), slip ratio, and tangent of the slip angle.
pub fn ready_forces(tyre: &impl Tyre<f64>, load: f64, slip_ratio: f64, slip_tangent: f64) -> TyreForces<f64> {
    tyre.forces(TyreInput {
        load,
        slip_ratio,
        slip_tangent,
        side: 1.0,
    })
}

/// Forces at a load (N), slip ratio, tangent of the slip angle, and camber (rad, positive with the top to the right).
pub fn forces_at(
    tyre: &TyreCoefficients<f64>,
    load: f64,
    slip_ratio: f64,
    slip_tangent: f64,
    camber: f64,
) -> TyreForces<f64> {
    ready_forces(&tyre.prepare(camber), load, slip_ratio, slip_tangent)
}

/// A car of a chassis and the flat forms of its tyres.
pub fn car_model<R: Real, T: Tyre<R>>(chassis: &Chassis<R>, front: &[R], rear: &[R]) -> CarModel<R, T> {
    let flat = [&chassis.to_flat()[..], front, rear].concat();
    CarModel::from_parameters(&flat)
}

/// One Runge-Kutta step of a car, `input` giving the inputs at a share of the step.
pub fn car_step<T: Tyre<f64>>(
    model: &CarModel<f64, T>,
    state: &CarState<f64>,
    input: impl Fn(f64) -> CarInput<f64>,
    step: f64,
) -> CarState<f64> {
    runge_kutta_step(model, state, |number| input(0.5 * number as f64), step, |_| ())
}

/// A chassis from `key=value` words; what they leave out stands as in the bundled car.
pub fn chassis_from(words: &str) -> Chassis<f64> {
    let table = Chassis::<f64>::PARAMETERS;
    let mut flat = Car::bundled().unwrap().chassis.to_flat();
    for word in words.split_whitespace() {
        let (key, value) = word.split_once('=').unwrap();
        let index = table
            .iter()
            .position(|p| p.name == key)
            .unwrap_or_else(|| panic!("no chassis key {key}"));
        flat[index] = value.parse().unwrap();
    }
    Chassis::from_flat(&flat)
}

/// How far from MFeval forces (N) and moment (Nm) may be.
///
/// MFeval adds 1e-6 to the denominators of `By`, `Bx`, `Kx/Ky` and `SVy/Ky`. On `By = Ky/(Cy Dy)` that is a share of
/// 1e-6/(1.35 * 500 N) = 1.5e-9 at the least load of the table; times the 8 kN of the greatest force, 1.2e-5 N is
/// more than it can do (the share falls as the force rises). In `Mz` the same shares multiply arms under 0.35 m and,
/// in the residual moment, a slope `Br` of 9 that acts on a slip displaced by 1e-6 of `SVy/Ky`.
pub const FORCE_TOLERANCE: f64 = 1e-5;
pub const MOMENT_TOLERANCE: f64 = 1e-4;

/// The greatest differences in Fx, Fy and Mz over rows of load, slip ratio, slip angle, camber, Fx, Fy, Mz.
pub fn worst_differences(tyre: &TyreCoefficients<f64>, rows: impl Iterator<Item = [f64; 7]>) -> [f64; 3] {
    rows.fold([0.0; 3], |worst, [load, ratio, angle, camber, fx, fy, mz]| {
        // A wheel leans by its axle's inclination on the left and by the opposite on the right; both ways to lean.
        [1.0, -1.0].into_iter().fold(worst, |worst, side| {
            let got = tyre.prepare(side * camber).forces(TyreInput {
                load,
                slip_ratio: ratio,
                slip_tangent: angle.tan(),
                side,
            });
            let differences = [got.x - fx, got.y - fy, got.aligning_moment - mz].map(f64::abs);
            // `max` would drop a NaN; this keeps it.
            std::array::from_fn(|i| {
                if differences[i] <= worst[i] {
                    worst[i]
                } else {
                    differences[i]
                }
            })
        })
    })
}

/// Forces and moments are MFeval's.
pub fn assert_agreement([fx, fy, mz]: [f64; 3]) {
    assert!(fx <= FORCE_TOLERANCE, "Fx differs by {fx} N");
    assert!(fy <= FORCE_TOLERANCE, "Fy differs by {fy} N");
    assert!(mz <= MOMENT_TOLERANCE, "Mz differs by {mz} Nm");
}
