//! Driven laps on a device that fails, and of figures that are no car's.

use crate::common::bundled_car;
use crate::common::kinds::{alone, choices};
use lapswarm::evaluate::drive::open_drive_evaluator;
use lapswarm::evaluate::gpu::faults::{self, Fault};
use lapswarm::evaluate::{BackendChoice, FAILED_COST, Failure};
use lapswarm::parity::Draws;
use lapswarm::parity::drive::candidates;

tests! {
    faults_of_devices_and_figures_that_are_no_car_come_to_no_harm: also_device,
}

fn faults_of_devices_and_figures_that_are_no_car_come_to_no_harm() {
    let _turn = alone();
    let problem = lapswarm::parity::drive::problem(bundled_car(), &["stadium:150:60:14"], &[0.4, 0.55], 4e-3)
        .expect("a sound problem");
    let width = problem.dimensions();
    let sound = candidates(&problem, 3, &mut Draws::new(6)).concat();
    // Finite here, and more or less than `f32` holds; zero, and what makes no sense.
    let evils = [
        f64::NAN,
        f64::NEG_INFINITY,
        f64::MAX,
        1e39,
        -1e39,
        5e-324,
        0.0,
        -1.0,
    ];
    let mut population = Vec::new();
    for evil in evils {
        for variable in 0..width {
            let mut candidate = sound[..width].to_vec();
            candidate[variable] = evil;
            population.extend(candidate);
        }
    }
    for &choice in choices() {
        let mut evaluator = open_drive_evaluator(&problem, choice, None).expect("it opens");
        let found = evaluator.evaluate(&population).expect("it runs");
        let objectives = problem.problem.objectives.len();
        for (i, failure) in found.failures.iter().enumerate() {
            let row = &found.objectives[i * objectives..(i + 1) * objectives];
            let evil = evils[i / width];
            let failed = row.iter().all(|x| *x == FAILED_COST);
            assert!(
                failed || row.iter().all(|x| x.is_finite()),
                "{choice:?}, {evil}: {row:?}"
            );
            assert_eq!(failure.is_some(), failed, "{choice:?}, {evil}: {row:?}");
            if !evil.is_finite() {
                assert_eq!(*failure, Some(Failure::NotFinite), "{choice:?}, {evil}");
            }
        }
    }
    if !choices().contains(&BackendChoice::Gpu) {
        return;
    }
    let open = || open_drive_evaluator(&problem, BackendChoice::Gpu, None).expect("it opens");
    let wanted = open().evaluate(&sound).expect("it runs");
    for (fault, submission) in [(Fault::Lost, 0), (Fault::OutOfMemory, 5), (Fault::Validation, 2)] {
        let mut evaluator = open();
        faults::inject(fault, submission, 1);
        let found = evaluator.evaluate(&sound).expect("it goes on");
        faults::end();
        assert_eq!(found, wanted, "{fault:?}");
        let told = evaluator.device_faults();
        assert_eq!(told.len(), 1, "{told:?}");
    }
}
