//! Laps with energy on every backend: against `f64`, and their books.

use crate::common::Random;
use crate::common::line::circuit;
use crate::device::device;
use glam::DVec2;
use lapswarm::config::Choice;
use lapswarm::evaluate::energy::{
    CpuHybridEvaluator, Free, GpuHybridEvaluator, HybridLine, HybridObjective, HybridProblem,
    SimdHybridEvaluator, Strategy,
};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::{Evaluator, Failure};
use lapswarm::line::energy::{EnergyCar, EnergyLap, EnergyPlan, Gates, Mode};
use lapswarm::line::{Parametrisation, geometry};
use lapswarm::parity::energy::{Allowed, allowed};
use lapswarm::parity::in_relief;
use lapswarm::vehicle::limits::{SpeedRange, car_envelope};
use lapswarm::vehicle::{Car, Traction};

tests! {
    laps_with_energy_agree_and_balance: also_device,
    evaluations_are_rows_of_laps_and_candidates_that_are_no_numbers_fail: also_device,
}

fn hybrid_car(exponent: f64) -> EnergyCar {
    let mut car = Car::load("gt_hybrid").expect("bundled");
    if let Some(powertrain) = &mut car.powertrain {
        powertrain.rotating_mass_factor = 1.06;
    }
    if exponent < 2.0 {
        // Such that the MGU-H turns at full load too, which the bundled rule allows nowhere on these lines, and drives the compressor.
        let h = car
            .hybrid
            .as_mut()
            .and_then(|hybrid| hybrid.mgu_h.as_mut())
            .expect("bundled");
        (h.from_speed_mps, h.to_ax_mps2) = (45.0, 3.0);
        (h.motor_w, h.motor_gain_w) = (60e3, 20e3);
    }
    let coarse = SpeedRange {
        step_mps: 8.0,
        ..SpeedRange::USUAL
    };
    let limits = car_envelope(&car, &coarse).expect("limits");
    let traction = limits.traction();
    EnergyCar::new(car, limits.envelope, traction, exponent).expect("a hybrid")
}

const GATES: [Free; 6] = [
    Free::Steer,
    Free::Speed,
    Free::Acceleration,
    Free::Soc,
    Free::Energy,
    Free::Motor,
];

/// Problems of every kind, with all gates and all zones free.
fn problems() -> Vec<(String, HybridProblem)> {
    let mut random = Random(9);
    let mut problems = Vec::new();
    for (closed, sections, spacing, exponent) in [
        (true, 360, 16.0, 2.0),
        (true, 600, 5.0, 1.7),
        (false, 300, 8.0, 2.0),
    ] {
        let centre = DVec2::new(random.within(-2e3, 2e3), random.within(-2e3, 2e3));
        let cross_sections = circuit(sections, spacing, closed, centre, &mut random);
        let middle = cross_sections.points(&vec![0.5; sections]);
        let shape = geometry(&middle, closed);
        let mut length = shape.segment_m.clone();
        length.resize(sections, 0.0);
        for mode in [Mode::Offset, Mode::Additional] {
            let plan = EnergyPlan::zoned(&length, &[20, 90, 150, 260], closed, sections - 40, mode);
            let strategy = Strategy {
                free: GATES
                    .into_iter()
                    .chain((0..plan.count()).map(Free::Zone))
                    .collect(),
                ..Strategy::fixed(Gates::OPEN, plan.count())
            };
            let free = HybridLine::Free {
                cross_sections: Box::new(cross_sections.clone()),
                parametrisation: Parametrisation::control_points(sections / 6),
            };
            let fixed = HybridLine::Fixed {
                points_m: middle.clone(),
                closed,
                drs: Vec::new(),
                surface: Vec::new(),
            };
            let car = hybrid_car(exponent);
            let (hills, loaded) = in_relief(&cross_sections, &car.point_mass).expect("sound limits");
            let traction = Traction::of(&car.car, &loaded.envelope);
            let loaded = EnergyCar::of(car.car.clone(), loaded, traction).expect("a hybrid");
            let fixed_in_hills = HybridLine::Fixed {
                points_m: middle.clone(),
                closed,
                drs: Vec::new(),
                surface: hills.relief_of(&middle).expect("a surface"),
            };
            let free_in_hills = HybridLine::Free {
                cross_sections: Box::new(hills),
                parametrisation: Parametrisation::control_points(sections / 6),
            };
            let lines = [
                ("free", free, &car),
                ("fixed", fixed, &car),
                ("free in hills", free_in_hills, &loaded),
                ("fixed in hills", fixed_in_hills, &loaded),
            ];
            for (name, line, car) in lines {
                let problem = HybridProblem::new(
                    line,
                    car.clone(),
                    plan.clone(),
                    strategy.clone(),
                    &HybridObjective::ALL,
                    30.0,
                );
                let name = format!("{name} line, {} mode, closed {closed}", mode.name());
                problems.push((name, problem.expect("a sound problem")));
            }
        }
    }
    problems
}

/// Smooth lines with strategies from all over their ranges.
fn candidates(problem: &HybridProblem, count: usize, random: &mut Random) -> Vec<Vec<f64>> {
    let line = problem.line_variables();
    (0..count)
        .map(|_| {
            let phase = random.within(0.0, 6.0);
            let mut candidate: Vec<f64> = (0..line)
                .map(|i| 0.5 + 0.3 * (0.3 * i as f64 + phase).sin())
                .collect();
            candidate.extend([
                random.within(0.005, 0.15),
                random.within(30.0, 75.0),
                random.within(0.0, 3.0),
                random.within(0.7, 1.0),
                random.within(0.0, 4.0),
                random.within(0.0, 240.0),
            ]);
            candidate.extend((line + 6..problem.dimensions()).map(|_| random.within(0.0, 1.0)));
            candidate
        })
        .collect()
}

fn check_books(name: &str, problem: &HybridProblem, laps: &[EnergyLap<f64>], epsilon: f64) {
    for (i, lap) in laps.iter().enumerate() {
        // Each of the sums takes one rounding for every segment, of no more than what has passed so far.
        let passed = lap.deployed + lap.harvested_k + lap.harvested_h;
        let bound = 4.0 * problem.plan().rows.len() as f64 * epsilon * passed.max(1.0);
        let error = lap.change - (lap.harvested_k + lap.harvested_h - lap.deployed);
        assert!(
            error.abs() <= bound,
            "{name}, lap {i}: {error} J of {passed} J, at most {bound} J"
        );
    }
}

fn driven(laps: Vec<Result<EnergyLap<f64>, Failure>>) -> Vec<EnergyLap<f64>> {
    laps.into_iter().map(|lap| lap.expect("it is driven")).collect()
}

/// Books balance to rounding on every lap of every particle, and single precision gives the laps of `f64`.
///
/// How far off they may be says `lapswarm::parity::energy`.
fn laps_with_energy_agree_and_balance() {
    let mut random = Random(77);
    for (name, problem) in problems() {
        let rows = candidates(&problem, 70, &mut random);
        let slices: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
        let expected = driven(CpuHybridEvaluator::new(&problem).outcomes(&slices));
        check_books(&name, &problem, &expected, f64::EPSILON);
        let assists = |row: &Vec<f64>| problem.lap(row).1.iter().any(|s| s.assist > 0.0);
        assert_eq!(
            rows.iter().any(assists),
            problem.car().table.assists && problem.energy().mode == Mode::Additional,
            "{name}"
        );
        let mut found: Vec<(String, Vec<EnergyLap<f64>>)> = Vec::new();
        for set in InstructionSet::available() {
            let laps = driven(SimdHybridEvaluator::new(&problem, set).outcomes(&slices));
            found.push((format!("simd {}", set.name()), laps));
        }
        if let Some(context) = device() {
            let mut evaluator = GpuHybridEvaluator::new(&problem, context).expect("the kernel compiles");
            found.push((
                "gpu".to_owned(),
                driven(evaluator.outcomes(&slices).expect("it runs")),
            ));
        }
        for (backend, laps) in found {
            check_books(
                &format!("{backend}, {name}"),
                &problem,
                &laps,
                f64::from(f32::EPSILON),
            );
            let mut worst = [0.0f64; 3];
            for (i, (lap, exact)) in laps.iter().zip(&expected).enumerate() {
                let Allowed { time, fuel, energy } = allowed(&problem, exact);
                for (what, found, expected, tolerance) in [
                    ("time", lap.time, exact.time, time),
                    ("fuel", lap.fuel, exact.fuel, fuel),
                    ("deployed", lap.deployed, exact.deployed, energy),
                    ("harvested by K", lap.harvested_k, exact.harvested_k, energy),
                    ("harvested by H", lap.harvested_h, exact.harvested_h, energy),
                    ("change", lap.change, exact.change, 2.0 * energy),
                    ("swing", lap.swing, exact.swing, 2.0 * energy),
                ] {
                    let error = (found - expected).abs();
                    assert!(
                        error <= tolerance,
                        "{backend}, {name}, lap {i}, {what}: {found} for {expected}, {lap:?} for {exact:?}"
                    );
                }
                worst[0] = worst[0].max((lap.time / exact.time - 1.0).abs());
                worst[1] = worst[1].max((lap.fuel / exact.fuel - 1.0).abs());
                worst[2] = worst[2].max((lap.deployed - exact.deployed).abs());
            }
            println!(
                "{backend:12} {name}: time {:.1e}, fuel {:.1e}, deployed {:.0} J",
                worst[0], worst[1], worst[2]
            );
        }
    }
}

fn evaluations_are_rows_of_laps_and_candidates_that_are_no_numbers_fail() {
    let (_, problem) = problems().swap_remove(2);
    let mut random = Random(3);
    let mut rows = candidates(&problem, 3, &mut random);
    rows[1][0] = f64::NAN;
    let mut backends: Vec<Box<dyn Evaluator + '_>> = vec![
        Box::new(CpuHybridEvaluator::new(&problem)),
        Box::new(SimdHybridEvaluator::new(&problem, InstructionSet::best())),
    ];
    if let Some(context) = device() {
        backends.push(Box::new(
            GpuHybridEvaluator::new(&problem, context).expect("the kernel compiles"),
        ));
    }
    for evaluator in &mut backends {
        let evaluation = evaluator.evaluate(&rows.concat()).expect("it runs");
        assert_eq!(evaluation.failures.iter().filter(|f| f.is_some()).count(), 1);
        assert_eq!(evaluation.objectives[6..12], [lapswarm::evaluate::FAILED_COST; 6]);
        let lap = problem.lap(&rows[0]).0;
        assert!((evaluation.objectives[0] / lap.time - 1.0).abs() < 2.6e-4);
        assert!((evaluation.objectives[1] / (lap.fuel / 0.748) - 1.0).abs() < 1e-2);
    }
}
