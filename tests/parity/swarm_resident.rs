//! Swarms that live on the device, scored by the kernels of laps and cars, against swarms on the host.

use crate::common::line::circuit;
use crate::common::{Random, bundled_car, linear_car};
use crate::device::the_device;
use glam::DVec2;
use lapswarm::evaluate::energy::{
    Free, GpuHybridEvaluator, HybridLine, HybridObjective, HybridProblem, Strategy,
};
use lapswarm::evaluate::gpu::GpuContext;
use lapswarm::evaluate::steady::{GpuSteadyEvaluator, SteadyObjective, SteadyProblem};
use lapswarm::evaluate::{Evaluator, FAILED_COST, GpuBackend, OnDevice, Problem};
use lapswarm::line::Parametrisation;
use lapswarm::line::energy::{EnergyCar, EnergyPlan, Gates, Mode};
use lapswarm::line::geometry;
use lapswarm::parity::drive;
use lapswarm::swarm::device::DeviceMopso;
use lapswarm::swarm::{MANY, Mopso, MopsoSettings, Optimiser};
use lapswarm::vehicle::Car;
use lapswarm::vehicle::limits::{SpeedRange, car_envelope};
use std::sync::Arc;

tests! {
    cars_of_a_swarm_on_the_device_are_those_of_the_host: device,
    laps_with_energy_of_a_swarm_on_the_device_are_those_of_the_host: device,
}

fn settings(population: usize, iterations: usize) -> MopsoSettings {
    MopsoSettings::default().with_size(population, iterations)
}

/// Figures of cars are made on the host for both swarms: candidates have the same bits in both, and so have failures and objectives,
/// but that those are rounded to single precision on the device. Whole numbers or not.
fn is_that_of_the_host<K: OnDevice>(kind: &K, population: usize, context: &Arc<GpuContext>) {
    let judge = || GpuBackend::new(kind, Arc::clone(context)).unwrap();
    let (mut there_judge, mut here_judge) = (judge(), judge());
    let problem: &Problem = Evaluator::problem(&there_judge);
    let width = problem.objectives.len();
    let settings = settings(population, 3);
    let mut here = Mopso::new(problem, settings.clone()).unwrap();
    let mut there = DeviceMopso::new(problem, settings, Arc::clone(context)).unwrap();
    // Fewer are kept in double precision on the host.
    if population >= MANY && crate::swarm::rounds_like_the_processor(context) {
        assert!(here.ask() == there.candidates().unwrap());
    }
    for generation in 0..3 {
        let candidates = there.candidates().unwrap();
        let expected = Evaluator::evaluate(&mut here_judge, &candidates).unwrap();
        let told = there.step(&mut there_judge).unwrap();
        assert_eq!(told.failures, expected.failure_counts(), "{generation}");
        let found = there.objectives().unwrap();
        for (i, failure) in expected.failures.iter().enumerate() {
            let (row, found) = (
                &expected.objectives[i * width..(i + 1) * width],
                &found[i * width..(i + 1) * width],
            );
            if failure.is_some() {
                assert!(row.iter().all(|x| *x == FAILED_COST));
                assert!(found.iter().all(|x| *x > 3.4e38), "{found:?}");
            } else {
                let narrow = |x: &f64| f64::from(*x as f32);
                assert_eq!(found, row.iter().map(narrow).collect::<Vec<_>>(), "{i}");
            }
        }
    }
    assert!(!there.front().objectives.is_empty());
}

fn cars_of_a_swarm_on_the_device_are_those_of_the_host() {
    let context = the_device();
    let car = bundled_car();
    let mass = car.parameter("mass_kg").unwrap();
    let lock = car.max_steer_rad;
    let steady = SteadyProblem::new(
        car,
        vec![(mass, 900.0, 1500.0)],
        [20.0, 70.0],
        // Beyond what cars hold at speed, so that some fail.
        [-lock, lock],
        &[SteadyObjective::Cornering, SteadyObjective::Sideslip],
    )
    .unwrap();
    // A few more than a whole number of blocks.
    is_that_of_the_host(&steady, MANY + 5, &context);
    let mut judge = GpuSteadyEvaluator::new(&steady, Arc::clone(&context)).unwrap();
    let mut swarm = DeviceMopso::new(&steady.problem, settings(1000, 2), Arc::clone(&context)).unwrap();
    let progress = swarm.step(&mut judge).unwrap();
    assert!((1..500).contains(&progress.failed), "{progress:?}");
    assert!(
        progress
            .failures
            .keys()
            .all(|word| word != "objective_beyond_single_precision"),
        "{progress:?}"
    );

    // Several lines, of which whole numbers choose.
    let circuits = ["stadium:60:40:14", "stadium:70:40:14"];
    let drive = drive::problem_of(linear_car(), &circuits, &[0.4, 0.5], 6e-3, &["mass_kg"]).unwrap();
    assert!(drive.problem.variables.iter().any(|v| v.whole));
    is_that_of_the_host(&drive, 70, &context);
}

fn hybrid(free: Vec<Free>) -> HybridProblem {
    let car = Car::load("gt_hybrid").expect("bundled");
    let coarse = SpeedRange {
        step_mps: 8.0,
        ..SpeedRange::USUAL
    };
    let limits = car_envelope(&car, &coarse).expect("limits");
    let traction = limits.traction();
    let car = EnergyCar::new(car, limits.envelope, traction, 2.0).expect("a hybrid");
    let cross_sections = circuit(120, 12.0, true, DVec2::new(300.0, -200.0), &mut Random(1));
    let length = geometry(&cross_sections.points(&[0.5; 120]), true).segment_m;
    let plan = EnergyPlan::zoned(&length, &[5, 45, 95], true, 80, Mode::Additional);
    let strategy = Strategy {
        free,
        // Of the first zone half, whatever the others are.
        shares: vec![0.5, 1.0, 1.0],
        ..Strategy::fixed(Gates::of_zones(1.5), 3)
    };
    let line = HybridLine::Free {
        cross_sections: Box::new(cross_sections),
        parametrisation: Parametrisation::control_points(30),
    };
    let objectives = [
        HybridObjective::LapTime,
        HybridObjective::Fuel,
        HybridObjective::EnergyUsed,
    ];
    HybridProblem::new(line, car, plan, strategy, &objectives, 30.0).expect("a sound problem")
}

/// The device scales positions in `f32`, as it does those of lines, and divides results in it: what holds for objectives of lines
/// holds for time and fuel. Energy hangs on the roots that corners on the limit leave: a curvature that is off by 1.5e-6 of itself
/// leaves a root of 1.7e-3, which is 0.02 m/s^2 for 1.3 t over 7 m, some 150 J in a corner: 1e-4 of the budget of 1.5 MJ.
fn laps_with_energy_of_a_swarm_on_the_device_are_those_of_the_host() {
    let context = the_device();
    // Gates are made into figures by the host.
    is_that_of_the_host(&hybrid(vec![Free::Energy, Free::Zone(1)]), MANY + 5, &context);
    let hybrid = hybrid(vec![Free::Zone(2), Free::Zone(1)]);
    let settings = settings(MANY + 5, 2);
    let mut swarm = DeviceMopso::new(&hybrid.problem, settings, Arc::clone(&context)).unwrap();
    let line = hybrid.line_variables();
    // Lines that are smooth, as their parity wants them: nearly parallel to the edges.
    let mut random = Random(2);
    let starts: Vec<Vec<f64>> = (0..MANY + 5)
        .map(|_| {
            let along = random.within(0.3, 0.7);
            let shares = [random.within(0.0, 1.0), random.within(0.0, 1.0)];
            vec![along; line].into_iter().chain(shares).collect()
        })
        .collect();
    swarm.start_from(&starts).unwrap();
    let mut judge = GpuHybridEvaluator::new(&hybrid, Arc::clone(&context)).unwrap();
    let expected = judge.evaluate(&swarm.candidates().unwrap()).unwrap();
    assert!(expected.failures.iter().all(Option::is_none));
    swarm.evaluate(&mut judge).unwrap();
    let found = swarm.objectives().unwrap();
    let (mut apart, mut energies) = (0, 0);
    for (found, expected) in found.chunks_exact(3).zip(expected.objectives.chunks_exact(3)) {
        for (k, least, share) in [(0, 0.0, 2e-5), (1, 0.0, 2e-5), (2, 1.5, 1e-4)] {
            let size = expected[k].abs().max(least);
            assert!(
                (found[k] - expected[k]).abs() <= share * size,
                "{found:?} for {expected:?}"
            );
        }
        apart += usize::from(found != expected);
        energies += usize::from(expected[2] > 0.1);
    }
    println!("{apart} of {} differ, {energies} use energy", starts.len());
    assert!(energies > MANY / 2, "{energies}");
    let told = swarm.step(&mut judge).unwrap();
    assert_eq!(told.failed, 0);
}
