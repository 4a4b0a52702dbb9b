//! Devices that fail and devices that are small, and figures that are none, for every kind of problem.

use crate::common::Random;
use crate::common::kinds::{Kind, Problems, alone, bits, choices};
use crate::common::line::{gt_car, ring};
use lapswarm::evaluate::gpu::GpuContext;
use lapswarm::evaluate::gpu::faults::{self, Fault, Place};
use lapswarm::evaluate::line::{GpuLineEvaluator, LineBatching, LineObjective, LineProblem};
use lapswarm::evaluate::portions::{self, Portions};
use lapswarm::evaluate::{BackendChoice, Evaluation, Evaluator, Failure};
use lapswarm::line::Parametrisation;

tests! {
    a_fault_at_any_submission_or_allocation_costs_nothing_but_time: device full,
    lanes_take_over_from_a_device_that_keeps_failing: device full,
    the_least_limits_change_no_bit: device full,
    portions_change_no_bit: also_device full,
    no_number_that_is_none_gets_through: also_device,
}

/// What came of a drill.
struct Told {
    runs: Vec<Evaluation>,
    faults: Vec<String>,
    backend: &'static str,
    /// What the drill counted.
    counted: u64,
}

/// Opens an evaluator and has these populations evaluated while `count` faults strike from the `from`-th place on.
fn drill(
    kind: &Kind<'_>,
    populations: &[Vec<f64>],
    place: Place,
    fault: Fault,
    from: u64,
    count: u64,
) -> Told {
    faults::inject_at(place, fault, from, count);
    let mut evaluator = kind.with_fallback();
    let evaluate = |population: &Vec<f64>| evaluator.evaluate(population);
    let runs = populations.iter().map(evaluate).collect::<Result<_, _>>();
    let told = Told {
        runs: runs.expect("a device or lanes"),
        faults: evaluator.device_faults().to_vec(),
        backend: evaluator.backend().backend,
        counted: faults::end(),
    };
    drop(evaluator);
    // No other drill finds what this one has left.
    if !told.faults.is_empty() {
        GpuContext::forget();
    }
    told
}

/// What an undisturbed device says, lanes, and how far they may be apart.
struct Wanted {
    populations: Vec<Vec<f64>>,
    clean: Told,
    lanes: Vec<Evaluation>,
    parity: Vec<Vec<Option<Vec<f64>>>>,
}

impl Wanted {
    fn of(kind: &Kind<'_>, place: Place) -> Self {
        // More than a workgroup, so that there are two batches.
        let populations: Vec<_> = [(70, 1), (5, 2)]
            .map(|(count, seed)| kind.population(count, seed))
            .into();
        // An evaluator's own, whoever had it compiled.
        GpuContext::forget();
        let clean = drill(kind, &populations, place, Fault::Lost, u64::MAX, 0);
        assert!(
            clean.faults.is_empty() && clean.backend == "gpu",
            "{:?}",
            clean.faults
        );
        let mut lanes = (kind.open)(BackendChoice::Simd);
        Self {
            lanes: populations
                .iter()
                .map(|p| lanes.evaluate(p).expect("it runs"))
                .collect(),
            parity: populations.iter().map(|p| kind.parity(p)).collect(),
            populations,
            clean,
        }
    }

    /// Every generation is that of the device or that of lanes, the latter from some generation on; how many are those.
    fn taken_over(&self, kind: &Kind<'_>, what: &str, told: &Told) -> usize {
        let mut taken_over = 0;
        for (i, run) in told.runs.iter().enumerate() {
            kind.is_sound(what, run, &self.populations[i]);
            // They may have the same bits.
            let by_lanes = bits(run) == bits(&self.lanes[i]);
            let by_device = bits(run) == bits(&self.clean.runs[i]);
            assert!(by_lanes || by_device, "{}, {what}, generation {i}", kind.name);
            assert!(
                by_lanes || taken_over == 0,
                "{}, {what}: the device again",
                kind.name
            );
            taken_over += usize::from(by_lanes);
            // Both are off by as much at the most.
            let clean = &self.clean.runs[i];
            kind.compare(what, (run, clean), &self.parity[i], 2.0);
        }
        taken_over
    }

    /// What must be told of one fault that struck while the second device works.
    fn check_one(&self, kind: &Kind<'_>, fault: Fault, at: u64, told: &Told) {
        let what = format!("{fault:?} at {at} of {}", self.clean.counted);
        let Told { faults, backend, .. } = told;
        assert_eq!(faults.len(), 1, "{}, {what}: {faults:?}", kind.name);
        let words = match fault {
            Fault::Lost => "was opened anew",
            Fault::Gone => "does not open again (no usable device: the adapter is gone)",
            Fault::OutOfMemory => "emory",
            Fault::Validation => "MAP_READ",
            Fault::Hung => "counts as hung",
        };
        assert!(faults[0].contains(words), "{}, {what}: {faults:?}", kind.name);
        if fault == Fault::Gone {
            assert!(faults[0].contains("simd takes over"), "{}, {faults:?}", kind.name);
            assert_eq!(*backend, "simd", "{}, {what}", kind.name);
            assert!(self.taken_over(kind, &what, told) > 0);
        } else {
            assert!(faults[0].contains("was opened anew"), "{}, {faults:?}", kind.name);
            assert_eq!(*backend, "gpu", "{}, {what}", kind.name);
            for (run, clean) in told.runs.iter().zip(&self.clean.runs) {
                assert_eq!(bits(run), bits(clean), "{}, {what}", kind.name);
            }
        }
    }
}

/// One fault at every submission and every allocation of each kind of evaluation: the device is opened anew, and the results
/// are the same to the bit; or it does not open, and lanes take over within the backends' parity.
fn a_fault_at_any_submission_or_allocation_costs_nothing_but_time() {
    let _turn = alone();
    let problems = Problems::new();
    for kind in problems.kinds() {
        for (place, struck) in [
            (Place::Submission, &Fault::ALL[..]),
            // A device that has gone is first met by the next thing that is done.
            (Place::Allocation, &[Fault::Lost, Fault::OutOfMemory]),
        ] {
            let wanted = Wanted::of(&kind, place);
            let all = wanted.clean.counted;
            assert!(all >= 5, "{}: {all} of {place:?}", kind.name);
            // Every place is struck, and every fault strikes: by turns, as each opens a device and compiles its kernels.
            for (at, &fault) in (0..all).zip(struck.iter().cycle()) {
                let told = drill(&kind, &wanted.populations, place, fault, at, 1);
                wanted.check_one(&kind, fault, at, &told);
            }
        }
    }
}

/// A device that keeps failing from some submission or allocation on: lanes take over.
fn lanes_take_over_from_a_device_that_keeps_failing() {
    let _turn = alone();
    let problems = Problems::new();
    for kind in problems.kinds() {
        for place in [Place::Submission, Place::Allocation] {
            let wanted = Wanted::of(&kind, place);
            let all = wanted.clean.counted;
            let struck = match place {
                Place::Submission => &Fault::ALL[..],
                Place::Allocation => &[Fault::Gone, Fault::OutOfMemory],
            };
            for &fault in struck {
                for at in [0, all - 1] {
                    let told = drill(&kind, &wanted.populations, place, fault, at, u64::MAX);
                    let what = format!("{place:?}, {fault:?} from {at} of {all}");
                    let Told { faults, backend, .. } = &told;
                    assert_eq!(*backend, "simd", "{}, {what}: {faults:?}", kind.name);
                    let last = faults.last().expect("a fault");
                    assert!(
                        last.contains("simd takes over"),
                        "{}, {what}: {faults:?}",
                        kind.name
                    );
                    assert!(
                        wanted.taken_over(&kind, &what, &told) > 0,
                        "{}, {what}",
                        kind.name
                    );
                }
            }
        }
    }
}

fn lines(sections: usize) -> LineProblem {
    LineProblem::new(
        ring(90.0, 104.0, sections),
        Parametrisation::sections(),
        &[LineObjective::Length, LineObjective::LapTime],
        Some(gt_car()),
        10.0,
    )
    .expect("a sound problem")
}

fn the_least_limits_change_no_bit() {
    let _turn = alone();
    let small = GpuContext::with_least_limits(None).expect("it opens");
    let limits = small.limits();
    assert_eq!(limits.max_storage_buffer_binding_size, 128 << 20);
    assert_eq!(limits.max_compute_workgroups_per_dimension, 65_535);
    let whole = GpuContext::shared(None).expect("it opens");
    let problems = Problems::new();
    for kind in problems.kinds() {
        let population = kind.population(200, 1);
        let on = |context| {
            let mut evaluator = (kind.cut)(context).expect("it opens");
            bits(&evaluator.evaluate(&population).expect("it runs"))
        };
        assert_eq!(on(small.clone()), on(whole.clone()), "{}", kind.name);
    }
    // Lines of so many sections that 128 MiB hold fewer than the population.
    let sections = 1500;
    let line = lines(sections);
    let mut random = Random(9);
    let row: Vec<f64> = (0..sections).map(|_| random.within(0.4, 0.6)).collect();
    let count = 12_000;
    assert!(count * sections * 2 * 4 > 128 << 20);
    let population: Vec<f64> = (0..count)
        .flat_map(|i| row.iter().map(move |x| x + 1e-6 * i as f64))
        .collect();
    let on = |context| {
        let evaluator = GpuLineEvaluator::new(&line, context).expect("it opens");
        let batching = LineBatching {
            bytes: u64::MAX,
            ..evaluator.batching()
        };
        let mut evaluator = evaluator.with_batching(batching);
        bits(&evaluator.evaluate(&population).expect("it runs"))
    };
    assert_eq!(on(small), on(whole));
}

/// A population in one go and in portions of every size, on every backend.
fn portions_change_no_bit() {
    let _turn = alone();
    let problems = Problems::new();
    for kind in problems.kinds() {
        for &choice in choices() {
            // The reference drives one car after the other.
            let long = choice == BackendChoice::Cpu && kind.name == "drive";
            // Else more than the least portion, so that the least memory cuts it.
            let count = if long { 90 } else { portions::LEAST + 100 };
            let population = kind.population(count, 3);
            let wanted = bits(&(kind.open)(choice).evaluate(&population).expect("it runs"));
            assert_eq!(wanted.1.len(), count);
            for size in [37, 1000] {
                if size == 37 && kind.name == "drive" && !long {
                    continue;
                }
                let mut portions = Portions::of((kind.open)(choice), size);
                let found = bits(&portions.evaluate(&population).expect("it runs"));
                assert!(
                    found == wanted,
                    "{} on {choice:?} in portions of {size}",
                    kind.name
                );
            }
            let least = portions::allow(0);
            let mut evaluator = (kind.open)(choice);
            drop(least);
            let found = bits(&evaluator.evaluate(&population).expect("it runs"));
            assert!(found == wanted, "{} on {choice:?} in the least memory", kind.name);
        }
    }
}

/// What no optimiser should ask for, in every variable of every kind of candidate.
fn no_number_that_is_none_gets_through() {
    let _turn = alone();
    // None in single precision at the least.
    let none = [
        f64::NAN,
        -f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MAX,
        f64::MIN,
        1e300,
        -1e300,
        1e39,
        -1e39,
    ];
    // Numbers that are as good as zero.
    let tiny = [
        5e-324,
        -5e-324,
        f64::MIN_POSITIVE,
        1e-300,
        f64::from(f32::MIN_POSITIVE) / 4.0,
        0.0,
        -0.0,
    ];
    let problems = Problems::new();
    for kind in problems.kinds() {
        let (dimensions, _) = kind.widths();
        let sound = kind.population(1, 4);
        let variables = dimensions.min(10);
        let mut population = Vec::new();
        let mut with = |variable: usize, value: f64| {
            population.extend_from_slice(&sound);
            let last = population.len() - dimensions + variable;
            population[last] = value;
        };
        for variable in 0..variables {
            none.iter().for_each(|value| with(variable, *value));
        }
        let numbers = none.len() * variables;
        for variable in 0..variables {
            let v = &kind.problem.variables[variable];
            let range = v.upper - v.lower;
            // Out of bounds by a little and by a lot.
            let beyond = [0.5, 10.0, 1e3, 1e9, 1e30].map(|far| far * range);
            tiny.iter().for_each(|value| with(variable, *value));
            for far in beyond {
                with(variable, v.lower - far);
                with(variable, v.upper + far);
            }
        }
        let exact = (kind.open)(BackendChoice::Cpu)
            .evaluate(&population)
            .expect("it runs");
        let parity = kind.parity(&population);
        for &choice in choices() {
            let what = format!("{choice:?}");
            let found = (kind.open)(choice).evaluate(&population).expect("it runs");
            kind.is_sound(&what, &found, &population);
            for (i, failure) in found.failures[..numbers].iter().enumerate() {
                let candidate = &population[i * dimensions..(i + 1) * dimensions];
                assert_eq!(
                    *failure,
                    Some(Failure::NotFinite),
                    "{}, {what}: {candidate:?}",
                    kind.name
                );
            }
            let compared = kind.compare(&what, (&found, &exact), &parity, 1.0);
            println!("{} on {what}: {compared} of {}", kind.name, parity.len());
            assert!(
                compared - numbers > (parity.len() - numbers) / 2,
                "{}: {compared} of {}",
                kind.name,
                parity.len()
            );
        }
    }
}
