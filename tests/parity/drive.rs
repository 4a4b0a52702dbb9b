//! Layer six: cars driven by a driver, on every backend against `f64` and against the recorded drive of one lap.

use crate::common::{bundled_car, linear_car};
use crate::device::{device, devices, subjects};
use lapswarm::drive::kernel::{DrivenLap, ending};
use lapswarm::drive::{DriverSettings, SpeedPlan, drive_planned};
use lapswarm::evaluate::drive::{
    CpuDriveEvaluator, DriveBatching, DriveProblem, GpuDriveEvaluator, SimdDriveEvaluator,
};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::{Evaluator, FAILED_COST, Failure};
use lapswarm::parity::Draws;
use lapswarm::parity::drive::{candidates, layer, problem};
use lapswarm::track::Track;

tests! {
    steps_of_the_driver_and_laps_agree_on_every_backend: also_device,
    the_evaluators_lap_is_the_recorded_one: everywhere,
    a_lap_is_the_same_alone_and_among_others_however_it_is_cut: also_device,
    candidates_that_fail_say_why: also_device,
    plans_blend_between_their_shares: everywhere,
}

fn steps_of_the_driver_and_laps_agree_on_every_backend() {
    let layer = layer().expect("the bundled car drives");
    for subject in subjects() {
        for found in layer(&subject).expect("the kernel runs") {
            println!(
                "{}: {:.1e} off, {:.1}% of what may be, bits as the scalar's: {:?}; {}",
                found.key(),
                found.max_relative,
                100.0 * found.share_of_tolerance,
                found.bits_as_scalar,
                found.worst
            );
            assert!(found.pass, "{}: {}", found.key(), found.worst);
        }
    }
}

/// A short lap in coarse steps.
fn small(car: lapswarm::vehicle::Car) -> DriveProblem {
    problem(car, &["stadium:150:60:14"], &[0.4, 0.55], 4e-3).expect("a sound problem")
}

fn slices(candidates: &[Vec<f64>]) -> Vec<&[f64]> {
    candidates.iter().map(Vec::as_slice).collect()
}

/// The evaluator's lap is that of the drive which is recorded: the same kernel, the times put together otherwise. The
/// recording has samples every 10 ms, between which it takes the speed for steady: at 10 m/s^2 and 20 m/s that is off by half
/// of `10 (0.01 s)^2 / 20 m/s`, 2.5e-5 s, at either line.
fn the_evaluators_lap_is_the_recorded_one() {
    let car = bundled_car();
    let circuit = Track::load("stadium:200:70:14")
        .and_then(|t| t.circuit())
        .expect("a stadium");
    let pace = 0.6;
    let problem = problem(car.clone(), &["stadium:200:70:14"], &[0.45, pace], 1e-3).expect("a sound problem");
    let flat = car.to_flat();
    let mut candidate: Vec<f64> = problem.free.parameters.iter().map(|p| flat[p.slots[0]]).collect();
    candidate.push(pace);
    let laps = CpuDriveEvaluator::new(&problem).outcomes(&[&candidate]);
    let lap = laps[0].expect("it is driven");
    assert_eq!(lap.ending, ending::FINISHED);

    let driver = DriverSettings::racing(&car).expect("it has steady states");
    let plan = SpeedPlan::new(&car, &circuit, pace, driver.top_speed_mps);
    let interval = 0.01;
    let recorded = drive_planned(&car, &circuit, plan, &driver, interval).expect("it gets round");
    let time = recorded.lap_time_s(circuit.length_m, interval).expect("samples");
    assert!((lap.time_s - time).abs() < 5e-5, "{} and {time}", lap.time_s);
    let beyond = recorded
        .station_m
        .iter()
        .zip(&recorded.offset_m)
        .map(|(station, offset)| {
            let (left, right) = circuit.widths_at(*station);
            (offset - left).max(-offset - right)
        })
        .fold(f64::NEG_INFINITY, f64::max);
    // The recording sees every tenth step; sideways the car moves by less than 1 m/s.
    assert!(
        lap.beyond_m >= beyond - 1e-12 && lap.beyond_m < beyond + 0.01,
        "{} and {beyond}",
        lap.beyond_m
    );
    // Of a lap that turns left by a whole turn the steering is wound on and off twice.
    assert!(lap.steering_radps > 0.0 && lap.steering_radps < 0.1, "{lap:?}");
}

fn bits(laps: &[Result<DrivenLap, Failure>]) -> Vec<Result<[u64; 4], Failure>> {
    laps.iter()
        .map(|lap| lap.map(|l| [l.time_s, l.beyond_m, l.steering_radps, l.ending].map(f64::to_bits)))
        .collect()
}

/// How the work is cut does not show, nor does the company; instruction sets have the same bits.
fn a_lap_is_the_same_alone_and_among_others_however_it_is_cut() {
    for car in [bundled_car(), linear_car()] {
        let linear = car.tyre_model() == linear_car().tyre_model();
        let problem = if linear {
            // Linear tyres have no such parameters as the others.
            lapswarm::parity::drive::problem_of(car, &["stadium:150:60:14"], &[0.4], 4e-3, &["mass_kg"])
        } else {
            Ok(small(car))
        }
        .expect("a sound problem");
        let all = candidates(&problem, 70, &mut Draws::new(5));
        let all = slices(&all);
        let mut same: Option<Vec<_>> = None;
        for set in InstructionSet::available() {
            let evaluator = SimdDriveEvaluator::new(&problem, set);
            let together = bits(&evaluator.outcomes(&all));
            assert_eq!(
                bits(&evaluator.outcomes(&all[33..34])),
                together[33..34],
                "{set:?}"
            );
            assert_eq!(*same.get_or_insert_with(|| together.clone()), together, "{set:?}");
        }
        let Some(context) = device() else { continue };
        let mut evaluator = GpuDriveEvaluator::new(&problem, context.clone()).expect("the kernel compiles");
        let whole = bits(&evaluator.outcomes(&all).expect("it runs"));
        // The last asks for a whole lap at once.
        for (lanes, steps, dispatch_ms) in [
            (64, None, 70.0),
            (128, Some(777), 70.0),
            (64, Some(usize::MAX), 1e9),
        ] {
            let batching = DriveBatching {
                lanes,
                steps,
                bytes: u64::MAX,
                dispatch_ms,
            };
            let mut cut = GpuDriveEvaluator::new(&problem, context.clone())
                .expect("the kernel compiles")
                .with_batching(batching);
            assert_eq!(bits(&cut.outcomes(&all).expect("it runs")), whole, "{batching:?}");
        }
        assert_eq!(
            bits(&evaluator.outcomes(&all[33..34]).expect("it runs")),
            whole[33..34]
        );
    }
}

/// What cannot be driven to the end costs the most and says why, alike on every backend.
fn candidates_that_fail_say_why() {
    // Twice the grip there is: the car runs wide at once.
    let circuits = ["stadium:150:60:14"];
    let problem = problem(bundled_car(), &circuits, &[0.4, 2.0], 4e-3).expect("a sound problem");
    let mut all = candidates(&problem, 5, &mut Draws::new(9));
    let pace = problem.dimensions() - 1;
    let tyre = problem
        .free
        .parameters
        .iter()
        .position(|p| p.name == "rBy1")
        .expect("it is free");
    for candidate in &mut all {
        candidate[pace] = 0.45;
    }
    all[1][pace] = 2.0;
    all[2][pace] = f64::NAN;
    all[3][tyre] = f64::INFINITY;
    let mut backends: Vec<Box<dyn Evaluator + '_>> = vec![Box::new(CpuDriveEvaluator::new(&problem))];
    for set in InstructionSet::available() {
        backends.push(Box::new(SimdDriveEvaluator::new(&problem, set)));
    }
    for context in devices() {
        backends.push(Box::new(
            GpuDriveEvaluator::new(&problem, context).expect("the kernel compiles"),
        ));
    }
    for backend in &mut backends {
        let found = backend.evaluate(&all.concat()).expect("it runs");
        let name = backend.backend().device;
        let width = problem.problem.objectives.len();
        assert_eq!(found.failures[0], None, "{name}");
        assert_eq!(found.failures[4], None, "{name}");
        assert_eq!(found.failures[2], Some(Failure::NotFinite), "{name}");
        assert_eq!(found.failures[3], Some(Failure::NotFinite), "{name}");
        let reason = found.failures[1];
        assert!(
            matches!(reason, Some(Failure::LeftRoad | Failure::Spun)),
            "{name}: {reason:?}"
        );
        for failed in 1..4 {
            let row = &found.objectives[failed * width..(failed + 1) * width];
            assert!(row.iter().all(|x| *x == FAILED_COST), "{name}: {row:?}");
        }
    }
}

/// A blend of two plans of the same speed is that plan; between two plans the lap time is between theirs.
fn plans_blend_between_their_shares() {
    let problem = small(bundled_car());
    let mut candidate = candidates(&problem, 1, &mut Draws::new(2)).remove(0);
    let pace = problem.dimensions() - 1;
    let mut times = Vec::new();
    for share in [0.4, 0.44, 0.5, 0.55] {
        candidate[pace] = share;
        let lap = CpuDriveEvaluator::new(&problem).outcomes(&[&candidate]).remove(0);
        times.push(lap.expect("it is driven").time_s);
    }
    assert!(times.windows(2).all(|w| w[1] < w[0]), "{times:?}");
}
