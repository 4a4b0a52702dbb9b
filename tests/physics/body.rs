//! The 4DOF body: energy, momentum, and 150 cases that a mass-matrix solve of the same mechanics made.

use crate::support::chassis_from;
use lapswarm::vehicle::Chassis;
use lapswarm::vehicle::chassis::{BodyForces, BodyState, body_derivative};

const FREE: BodyForces<f64> = BodyForces {
    x: 0.0,
    y: 0.0,
    yaw_moment: 0.0,
};

/// Derivatives of the state as a function of the state: the body's own, or a spoilt one.
type Derivative<'a> = dyn Fn(&BodyState<f64>) -> BodyState<f64> + 'a;

fn to_array(s: &BodyState<f64>) -> [f64; 5] {
    [s.vx, s.vy, s.yaw_rate, s.roll, s.roll_rate]
}

fn from_array([vx, vy, yaw_rate, roll, roll_rate]: [f64; 5]) -> BodyState<f64> {
    BodyState {
        vx,
        vy,
        yaw_rate,
        roll,
        roll_rate,
    }
}

/// Classical Runge-Kutta of the body and, beside it, of the heading (rad).
fn runge_kutta(
    derivative: &Derivative,
    state: BodyState<f64>,
    heading: f64,
    step: f64,
) -> (BodyState<f64>, f64) {
    let y0 = to_array(&state);
    let at = |k: Option<([f64; 5], f64)>| match k {
        None => state,
        Some((k, h)) => from_array(std::array::from_fn(|i| y0[i] + h * k[i])),
    };
    let slope = |s: BodyState<f64>| (to_array(&derivative(&s)), s.yaw_rate);
    let (k1, r1) = slope(at(None));
    let (k2, r2) = slope(at(Some((k1, step / 2.0))));
    let (k3, r3) = slope(at(Some((k2, step / 2.0))));
    let (k4, r4) = slope(at(Some((k3, step))));
    let next = std::array::from_fn(|i| y0[i] + step / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    (
        from_array(next),
        heading + step / 6.0 * (r1 + 2.0 * (r2 + r3) + r4),
    )
}

/// Kinetic energy of translation, roll and yaw, and potential energy of weight and roll spring, J.
fn energy(c: &Chassis<f64>, s: &BodyState<f64>) -> f64 {
    let (m, h) = (c.mass, c.cg_height);
    let (sin, cos) = s.roll.sin_cos();
    let (r, p) = (s.yaw_rate, s.roll_rate);
    let velocity = [s.vx + h * sin * r, s.vy - h * cos * p, -h * sin * p];
    let yaw_inertia = c.inertia_pitch * sin * sin + c.inertia_yaw * cos * cos;
    0.5 * m * velocity.iter().map(|v| v * v).sum::<f64>()
        + 0.5 * (c.inertia_roll * p * p + yaw_inertia * r * r)
        + m * c.gravity * h * cos
        + 0.5 * c.roll_stiffness * s.roll * s.roll
}

/// What no force changes: momentum along the two horizontal axes at rest (N s), and the angular momentum about the
/// vertical through the centre of gravity (N m s).
///
/// The roll spring pushes the body against its own wheels and ground, whose forces are vertical: it has no share in
/// any of the three.
fn momenta(c: &Chassis<f64>, s: &BodyState<f64>, heading: f64) -> [f64; 3] {
    let (sin, cos) = s.roll.sin_cos();
    let forward = s.vx + c.cg_height * sin * s.yaw_rate;
    let left = s.vy - c.cg_height * cos * s.roll_rate;
    let (sin_h, cos_h) = heading.sin_cos();
    [
        c.mass * (cos_h * forward - sin_h * left),
        c.mass * (sin_h * forward + cos_h * left),
        (c.inertia_pitch * sin * sin + c.inertia_yaw * cos * cos) * s.yaw_rate,
    ]
}

/// The free body of the energy check: no force, no damping.
fn free_body() -> (Chassis<f64>, BodyState<f64>) {
    let chassis = chassis_from(
        "mass_kg=1245 cg_height_m=0.45 roll_inertia_kgm2=300 pitch_inertia_kgm2=700 yaw_inertia_kgm2=1500
         roll_stiffness_nm_per_rad=1e5 roll_damping_nms_per_rad=0",
    );
    let state = BodyState {
        vx: 20.0,
        vy: 1.0,
        yaw_rate: 0.8,
        roll: 0.08,
        roll_rate: 0.6,
    };
    (chassis, state)
}

const STEP: f64 = 1e-3;
const STEPS: usize = 10_000;
/// The free body rolls at omega = sqrt((1e5 - 1245 * 9.80665 * 0.45)/300) = 17.7 1/s. RK4 loses (omega h)^6/144 of an
/// oscillation's amplitude a step: 2.1e-13, or 4e-9 of its energy in the 10,000 steps. The roll holds 374 J of 250 kJ,
/// so the method itself loses 6e-12 of the whole; the rest of the room is for ten thousand roundings of 1e-16 each
/// in sums that cancel to a hundredth.
const DRIFT: f64 = 1e-9;

/// Greatest change of energy over 10 s, as a share of the energy at the start.
fn energy_drift(chassis: &Chassis<f64>, start: BodyState<f64>, derivative: &Derivative) -> f64 {
    let at_start = energy(chassis, &start);
    let mut state = start;
    let mut worst = 0.0f64;
    for _ in 0..STEPS {
        state = runge_kutta(derivative, state, 0.0, STEP).0;
        worst = worst.max((energy(chassis, &state) - at_start).abs() / at_start);
    }
    worst
}

/// Greatest change of the momenta over 10 s, as shares of `m |v|` and of the angular momentum at the start.
fn momentum_drift(chassis: &Chassis<f64>, start: BodyState<f64>, derivative: &Derivative) -> f64 {
    let at_start = momenta(chassis, &start, 0.0);
    let linear = at_start[0].hypot(at_start[1]);
    let scale = [linear, linear, at_start[2].abs()];
    let (mut state, mut heading) = (start, 0.0);
    let mut worst = 0.0f64;
    for _ in 0..STEPS {
        (state, heading) = runge_kutta(derivative, state, heading, STEP);
        let now = momenta(chassis, &state, heading);
        for i in 0..3 {
            worst = worst.max((now[i] - at_start[i]).abs() / scale[i]);
        }
    }
    worst
}

#[test]
fn a_free_body_keeps_its_energy() {
    let (chassis, start) = free_body();
    let drift = energy_drift(&chassis, start, &|s| body_derivative(&chassis, s, &FREE));
    println!("energy drift {drift:e}");
    assert!(drift < DRIFT, "{drift:e}");
}

#[test]
fn a_free_body_keeps_its_momentum() {
    let (chassis, start) = free_body();
    let drift = momentum_drift(&chassis, start, &|s| body_derivative(&chassis, s, &FREE));
    println!("momentum drift {drift:e}");
    assert!(drift < DRIFT, "{drift:e}");
}

/// A change to a derivative, given chassis and state.
type Spoil = fn(&Chassis<f64>, &BodyState<f64>, &mut BodyState<f64>);

/// The checks have teeth: each term dropped or doubled by itself shows in the energy.
#[test]
fn a_wrong_term_shows_in_the_energy() {
    let spoilt: [(&str, Spoil); 10] = [
        ("2 h c p r in Vxdot", |c, s, d| {
            d.vx += 2.0 * c.cg_height * s.roll.cos() * s.roll_rate * s.yaw_rate
        }),
        ("h s rdot in Vxdot", |c, s, d| {
            d.vx += c.cg_height * s.roll.sin() * d.yaw_rate
        }),
        ("Vy r in Vxdot", |_, s, d| d.vx -= s.vy * s.yaw_rate),
        ("Vx r in Vydot", |_, s, d| d.vy += s.vx * s.yaw_rate),
        ("h c pdot in Vydot", |c, s, d| {
            d.vy -= c.cg_height * s.roll.cos() * d.roll_rate
        }),
        ("h s p^2 in Vydot", |c, s, d| {
            d.vy += c.cg_height * s.roll.sin() * s.roll_rate * s.roll_rate
        }),
        ("h s r^2 in Vydot", |c, s, d| {
            d.vy += c.cg_height * s.roll.sin() * s.yaw_rate * s.yaw_rate
        }),
        ("2 (Iyy - Izz) s c p r in rdot", |c, s, d| {
            let (sin, cos) = s.roll.sin_cos();
            let inertia = c.inertia_pitch * sin * sin + c.inertia_yaw * cos * cos;
            d.yaw_rate +=
                2.0 * (c.inertia_pitch - c.inertia_yaw) * sin * cos * s.roll_rate * s.yaw_rate / inertia;
        }),
        ("(Iyy - Izz) s c r^2 in pdot", |c, s, d| {
            let (sin, cos) = s.roll.sin_cos();
            let inertia = c.inertia_roll + c.mass * (c.cg_height * sin).powi(2);
            d.roll_rate -= (c.inertia_pitch - c.inertia_yaw) * sin * cos * s.yaw_rate.powi(2) / inertia;
        }),
        ("m h^2 s c p^2 in pdot", |c, s, d| {
            let (sin, cos) = s.roll.sin_cos();
            let inertia = c.inertia_roll + c.mass * (c.cg_height * sin).powi(2);
            d.roll_rate += c.mass * c.cg_height.powi(2) * sin * cos * s.roll_rate.powi(2) / inertia;
        }),
    ];
    let (chassis, start) = free_body();
    for (term, spoil) in spoilt {
        let drift = energy_drift(&chassis, start, &|s| {
            let mut derivative = body_derivative(&chassis, s, &FREE);
            spoil(&chassis, s, &mut derivative);
            derivative
        });
        println!("without {term}: energy drift {drift:e}");
        assert!(
            drift > 100.0 * DRIFT,
            "{term} may be dropped unnoticed: {drift:e}"
        );
    }
}

/// Damping only ever takes energy, at the rate `C p^2`.
#[test]
fn damping_takes_energy_at_its_rate() {
    let (mut chassis, start) = free_body();
    chassis.roll_damping = 1.9e4;
    let (mut state, mut work) = (start, 0.0);
    let power = |s: &BodyState<f64>| chassis.roll_damping * s.roll_rate * s.roll_rate;
    let derivative = |s: &BodyState<f64>| body_derivative(&chassis, s, &FREE);
    for _ in 0..STEPS {
        // Simpson's rule, of the same order as the integration.
        let middle = runge_kutta(&derivative, state, 0.0, STEP / 2.0).0;
        let next = runge_kutta(&derivative, state, 0.0, STEP).0;
        work += STEP / 6.0 * (power(&state) + 4.0 * power(&middle) + power(&next));
        state = next;
    }
    let lost = energy(&chassis, &start) - energy(&chassis, &state);
    println!("lost {lost} J of work {work} J");
    assert!(work > 100.0);
    // Both are of fourth order on a mode of C/Ixx = 63 1/s: (0.063)^4/120 = 1.3e-7 of the work in each.
    assert!((lost - work).abs() < 1e-6 * work);
}

/// One of the 150 cases: the vehicle, its state, the forces, and the accelerations they cause.
struct Case {
    chassis: Chassis<f64>,
    state: BodyState<f64>,
    forces: BodyForces<f64>,
    /// dVx, dVy, dr, dp.
    accelerations: [f64; 4],
}

fn cases() -> Vec<Case> {
    let (template, _) = free_body();
    include_str!("../data/eom_cases.csv")
        .lines()
        .skip(1)
        .map(|line| {
            let f: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
            let mut chassis = template;
            chassis.mass = f[0];
            chassis.cg_height = f[1];
            chassis.inertia_roll = f[2];
            chassis.inertia_pitch = f[3];
            chassis.inertia_yaw = f[4];
            chassis.roll_stiffness = f[5];
            chassis.roll_damping = f[6];
            chassis.gravity = f[7];
            Case {
                chassis,
                state: BodyState {
                    vx: f[8],
                    vy: f[9],
                    yaw_rate: f[10],
                    roll: f[11],
                    roll_rate: f[12],
                },
                forces: BodyForces {
                    x: f[13],
                    y: f[14],
                    yaw_moment: f[15],
                },
                accelerations: f[16..20].try_into().unwrap(),
            }
        })
        .collect()
}

/// The size of the terms that each acceleration is a sum of. Terms cancel (a roll spring of 1e5 N m against the
/// weight's and the tyres' moments), so an error is to be measured against them and not against their sum.
fn term_sizes(case: &Case) -> [f64; 4] {
    let (c, s, f) = (&case.chassis, &case.state, &case.forces);
    let (sin, cos) = s.roll.sin_cos();
    let (m, h, r, p) = (c.mass, c.cg_height, s.yaw_rate, s.roll_rate);
    let difference = c.inertia_pitch - c.inertia_yaw;
    let norm = |terms: &[f64]| terms.iter().map(|t| t * t).sum::<f64>().sqrt();
    let yaw = norm(&[f.yaw_moment, h * sin * f.x, 2.0 * difference * sin * cos * p * r])
        / (c.inertia_pitch * sin * sin + c.inertia_yaw * cos * cos);
    let roll = norm(&[
        h * cos * f.y,
        m * c.gravity * h * sin,
        c.roll_stiffness * s.roll,
        c.roll_damping * p,
        difference * sin * cos * r * r,
        m * h * h * sin * cos * p * p,
    ]) / (c.inertia_roll + m * (h * sin).powi(2));
    [
        norm(&[f.x / m, s.vy * r, h * sin * yaw, 2.0 * h * cos * p * r]),
        norm(&[f.y / m, s.vx * r, h * cos * roll, h * sin * (p * p + r * r)]),
        yaw,
        roll,
    ]
}

#[test]
fn agrees_with_the_mass_matrix_solve() {
    // A dozen roundings on each side, and the solve's condition number of about 1e3: 24 * 1.1e-16 * 1e3 = 3e-12.
    const TOLERANCE: f64 = 1e-10;
    let cases = cases();
    assert_eq!(cases.len(), 150);
    let mut worst = [0.0f64; 4];
    for case in &cases {
        let d = body_derivative(&case.chassis, &case.state, &case.forces);
        assert_eq!(d.roll, case.state.roll_rate);
        let sizes = term_sizes(case);
        for (i, got) in [d.vx, d.vy, d.yaw_rate, d.roll_rate].into_iter().enumerate() {
            worst[i] = worst[i].max((got - case.accelerations[i]).abs() / sizes[i]);
        }
    }
    println!("greatest differences of dVx, dVy, dr, dp: {worst:?}");
    assert!(worst.iter().all(|w| *w <= TOLERANCE), "{worst:?}");
}
