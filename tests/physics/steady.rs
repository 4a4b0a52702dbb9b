//! Cars settled on circles against known answers: the bicycle model's, and the curve of trims that continuation follows in
//! `f64`.

use crate::common::{Random, bundled_car, linear_car};
use lapswarm::evaluate::steady::kernel::Settling;
use lapswarm::evaluate::steady::{CpuSteadyEvaluator, SETTLED, SteadyObjective, SteadyProblem};
use lapswarm::evaluate::{BackendChoice, Failure};
use lapswarm::study::envelope::{EnvelopeSettings, EnvelopeStudy, Prepared};
use lapswarm::study::framework::solve_unobserved;
use lapswarm::vehicle::limits::{EnvelopeAtSpeed, SpeedRange, car_envelope};
use lapswarm::vehicle::{Car, Turn, Tyres, steady_car};

fn on_circles(car: Car) -> SteadyProblem {
    SteadyProblem::new(car, Vec::new(), [18.0, 70.0], [-0.2, 0.2], &SteadyObjective::ALL)
        .expect("a sound problem")
}

#[test]
fn a_linear_car_settles_where_the_bicycle_model_has_it() {
    let mut car = linear_car();
    car.chassis.lift_area = 0.0;
    car.chassis.drag_area = 0.0;
    if let Tyres::Linear { front, rear } = &mut car.tyres {
        (front.trail, rear.trail) = (0.0, 0.0);
    }
    let c = car.chassis;
    let (a, b) = (c.cg_to_front, c.cg_to_rear);
    // Loads are static without aero or push, so an axle's stiffness is two tyres' at their static load.
    let weight = c.mass * c.gravity;
    let front = 52_000.0 * weight * b / (a + b) / 3000.0;
    let rear = 60_000.0 * weight * a / (a + b) / 3000.0;
    let gradient = c.mass / (a + b) * (b / front - a / rear);
    let problem = on_circles(car);
    for (speed, steer) in [(20.0, 1e-3), (30.0, -5e-4), (45.0, 2e-4)] {
        let found = CpuSteadyEvaluator::new(&problem).outcomes(&[&[speed, steer]]);
        let state = found[0].expect("it is driven");
        let trim = problem.settled(&[speed, steer], &state).expect("it settles");
        let bicycle = (a + b) * trim.ay_mps2 / (speed * speed) + gradient * trim.ay_mps2;
        // Angles of 1e-3 rad, whose squares are a millionth, and load transfer of 1e-3 of the load, which cancels across an
        // axle of tyres linear in load.
        assert!(
            (steer / bicycle - 1.0).abs() < 1e-4,
            "{speed} m/s: {steer} for {bicycle}"
        );
        // The rear axle's slip angle is its share of the force over its stiffness.
        let slip = c.mass * trim.ay_mps2 * a / (a + b) / rear;
        let sideslip = b * trim.yaw_rate_radps / speed - slip;
        assert!(
            (trim.sideslip_rad - sideslip).abs() < 1e-4 * steer.abs(),
            "{} {sideslip}",
            trim.sideslip_rad
        );
    }
}

/// The bundled car with every parameter of the body and a few of the tyres up to a tenth off.
fn random_car(seed: u64) -> Car {
    let mut random = Random(seed);
    let base = bundled_car();
    let mut flat = base.to_flat();
    for name in [
        "mass_kg",
        "cg_height_m",
        "roll_inertia_kgm2",
        "yaw_inertia_kgm2",
        "roll_stiffness_nm_per_rad",
        "roll_damping_nms_per_rad",
        "front_roll_moment_share",
        "downforce_area_m2",
        "front.pKy1",
        "front.pDy1",
        "rBy1",
    ] {
        let parameter = base.parameter(name).expect(name);
        // The front tyres at most as good as the rear ones, so that the car runs wide at its limit.
        let high = if name.starts_with("front.p") { 1.0 } else { 1.1 };
        let factor = random.within(0.9, high);
        for slot in parameter.slots {
            flat[slot] *= factor;
        }
    }
    base.with_flat(&flat)
}

#[test]
fn cars_settle_on_the_curve_of_trims() {
    for car in [bundled_car(), random_car(3)] {
        let steady = steady_car(&car);
        let problem = on_circles(car);
        let evaluator = CpuSteadyEvaluator::new(&problem);
        for speed in [20.0, 42.0, 68.0] {
            let curve = steady.cornering(speed, 0.2, Turn::Left);
            let aims: Vec<Vec<f64>> = (1..=16).map(|i| vec![speed, 0.01 * f64::from(i)]).collect();
            let rows: Vec<&[f64]> = aims.iter().map(Vec::as_slice).collect();
            let mut compared = 0;
            for (aim, state) in aims.iter().zip(evaluator.outcomes(&rows)) {
                let Some(exact) = steady.trim_at(speed, aim[1], &curve) else {
                    continue;
                };
                let state: Settling<f64> = state.expect("it is driven");
                let found = problem.settled(aim, &state).expect("it settles");
                let open = problem
                    .left_open(aim, state.figures)
                    .expect("it is held in its place");
                let off = (found.ay_mps2 - exact.ay_mps2).abs();
                // What is open is in proportion to the residual, here the car's own, which a step may double; f64 rounds at 1e-9.
                let open = 2.0 * open * state.residual / SETTLED + 1e-9;
                assert!(off <= open, "{speed} m/s, {} rad: {off} of {open}", aim[1]);
                compared += 1;
            }
            assert!(compared > 8, "{compared} at {speed} m/s");
        }
    }
}

#[test]
fn the_populations_ridge_is_that_of_the_curves() {
    let range = SpeedRange {
        step_mps: 13.0,
        ..SpeedRange::USUAL
    };
    let settings = EnvelopeSettings {
        step_mps: range.step_mps,
        steers: 96,
        backend: BackendChoice::Simd,
        ..EnvelopeSettings::default()
    };
    for car in [bundled_car(), random_car(7)] {
        let speeds = range.speeds_of(&car).expect("speeds");
        let prepared = Prepared {
            car,
            speeds,
            log: None,
        };
        let solved = || solve_unobserved::<EnvelopeStudy>(&settings, &prepared).expect("a surface");
        let found = solved();
        let (limits, surface) = (found.limits, found.surface);
        let summary = &surface.summary;
        assert_eq!(found.record.evaluations, 96 * limits.speeds.len() as u64);
        assert!(summary.ridge_agrees, "{summary:?}\n{:#?}", surface.ridge);
        assert_eq!(summary.ridge_speeds, limits.speeds.len(), "{:#?}", surface.ridge);
        // The limits' own ridge is the greatest of the points that continuation came by; the exact one between them is above.
        for (ridge, speed) in surface.ridge.iter().zip(&limits.speeds) {
            let exact = ridge.exact_mps2.expect("a curve");
            let along = speed
                .cornering
                .iter()
                .filter(|t| t.steer_rad < prepared.car.max_steer_rad);
            let known = along.map(|t| t.ay_mps2).fold(0.0, f64::max);
            assert!(exact >= known - 1e-9 && exact < 1.01 * known, "{exact} {known}");
        }
        let again = solved().surface;
        assert_eq!(again.figures.map(bits), surface.figures.map(bits));
    }
}

fn bits(figures: Vec<f64>) -> Vec<u64> {
    figures.into_iter().map(f64::to_bits).collect()
}

#[test]
fn what_cannot_be_asked_is_refused() {
    let refused = |speeds, steers, objectives: &[SteadyObjective]| {
        SteadyProblem::new(bundled_car(), Vec::new(), speeds, steers, objectives)
            .expect_err("out of range")
            .to_string()
    };
    let all = &SteadyObjective::ALL;
    assert!(refused([1.0, 20.0], [0.0, 0.1], all).contains("speed_mps"));
    assert!(refused([20.0, f64::NAN], [0.0, 0.1], all).contains("speed_mps"));
    assert!(refused([20.0, 30.0], [0.1, 0.0], all).contains("steer_rad"));
    assert!(refused([20.0, 30.0], [0.0, 0.1], &[]).contains("objectives"));
    let problem = on_circles(bundled_car());
    let found = CpuSteadyEvaluator::new(&problem).outcomes(&[&[f64::NAN, 0.0]]);
    assert_eq!(found[0], Err(Failure::NotFinite));
}

#[test]
fn limits_hold_for_turns_to_both_sides() {
    let limits_of = |share: f64| {
        let mut car = bundled_car();
        (car.chassis.left_share_front, car.chassis.left_share_rear) = (share, share);
        let range = SpeedRange {
            step_mps: 15.0,
            ..SpeedRange::USUAL
        };
        car_envelope(&car, &range).expect("a car that corners").speeds
    };
    let left = |s: &EnvelopeAtSpeed| s.cornering.iter().map(|t| t.ay_mps2).fold(0.0, f64::max);
    let (light, heavy, even) = (limits_of(0.4), limits_of(0.6), limits_of(0.5));
    for ((light, heavy), even) in light.iter().zip(&heavy).zip(&even) {
        // The one car is the other's mirror image: towards the heavier side no wheel lifts, and the curves are smooth. Their points
        // lie up to 1.4 m/s^2 apart, which is 0.5 % near the flat top.
        let apart = |a: f64, b: f64| (a / b - 1.0).abs();
        assert!(apart(light.right_mps2, left(heavy)) < 0.005, "{:?}", light.row);
        assert!((light.right_mps2 - left(light)).abs() > 0.01, "{:?}", light.row);
        assert_eq!(light.row.ay_mps2, left(light).min(light.right_mps2));
        assert_eq!((even.row.ay_mps2, even.right_mps2), (left(even), left(even)));
    }
}
