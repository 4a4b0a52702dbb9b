//! Devices that fail, devices that are small, none at all, and studies that are too large.

mod common;

use common::{Random, linear_car, problem};
use lapswarm::evaluate::gpu::GpuContext;
use lapswarm::evaluate::gpu::faults::{self, Fault};
use lapswarm::evaluate::hybrid::{HybridObjective, open_hybrid_evaluator};
use lapswarm::evaluate::line::{GpuLineEvaluator, LineObjective, LineProblem, open_line_evaluator};
use lapswarm::evaluate::portions::{self, Portions};
use lapswarm::evaluate::replay::{GpuEvaluator, ReplayProblem, open_evaluator};
use lapswarm::evaluate::{BackendChoice, Evaluation, Evaluator, FAILED_COST, Failure};
use lapswarm::line::Parametrisation;
use lapswarm::parity::Draws;
use lapswarm::parity::made_up::{Lap, candidates};
use lapswarm::study::hybrid::{self, HybridStudySettings};
use lapswarm::study::keeper::Keeper;
use lapswarm::study::raceline::{self, LineAlgorithm, LinesState, RacelineSettings, find_lines_from};
use lapswarm::study::run_folder::STATE;
use lapswarm::study::sweep::{SweepSettings, sweep};
use lapswarm::swarm::checkpoint;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Faults are of the whole process: one test at a time.
fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn has_device() -> bool {
    match GpuContext::shared(None) {
        Ok(_) => true,
        Err(error) => {
            let required = std::env::var("LAPSWARM_REQUIRE_GPU").is_ok_and(|x| x == "1");
            assert!(!required, "LAPSWARM_REQUIRE_GPU=1, but {error}");
            eprintln!("IGNORED: no GPU adapter ({error})");
            false
        }
    }
}

fn bits(evaluation: &Evaluation) -> (Vec<u64>, Vec<Option<Failure>>) {
    let objectives = evaluation.objectives.iter().map(|x| x.to_bits()).collect();
    (objectives, evaluation.failures.clone())
}

fn replay() -> ReplayProblem {
    let lap = Lap {
        samples: 200,
        ..Lap::default()
    };
    problem(linear_car(), &["K", "C"], lap)
}

/// Three generations on whatever works, and what went wrong.
fn generations(
    replay: &ReplayProblem,
    choice: BackendChoice,
) -> (Vec<Evaluation>, Vec<String>, &'static str) {
    let mut evaluator = open_evaluator(replay, choice, None).unwrap();
    let runs = (0..3)
        .map(|seed| {
            let population = candidates(replay, 40, 0.2, &mut Draws::new(seed));
            evaluator.evaluate(&population).unwrap()
        })
        .collect();
    (
        runs,
        evaluator.device_faults().to_vec(),
        evaluator.backend().backend,
    )
}

#[test]
fn a_fault_at_any_submission_costs_nothing_but_time() {
    let _turn = alone();
    if !has_device() {
        return;
    }
    let replay = replay();
    faults::inject(Fault::Lost, u64::MAX, 0);
    let (clean, none, backend) = generations(&replay, BackendChoice::Gpu);
    let submissions = faults::end();
    assert!(none.is_empty() && backend == "gpu");
    assert!(submissions >= 6, "{submissions} submissions");
    let (lanes, _, _) = generations(&replay, BackendChoice::Simd);
    for fault in [Fault::Lost, Fault::OutOfMemory, Fault::Validation] {
        for at in 0..submissions {
            faults::inject(fault, at, 1);
            let (runs, told, backend) = generations(&replay, BackendChoice::Gpu);
            let seen = faults::end();
            assert_eq!(backend, "gpu", "{fault:?} at {at}: {told:?}");
            // The last submission reads a clock: a device that goes then is missed by nobody. How many there are goes with the
            // time that they take.
            if at + 1 < seen || !told.is_empty() {
                assert_eq!(told.len(), 1, "{fault:?} at {at} of {submissions}: {told:?}");
                assert!(told[0].contains("opened anew"), "{told:?}");
            }
            for (run, clean) in runs.iter().zip(&clean) {
                assert_eq!(bits(run), bits(clean), "{fault:?} at {at}");
            }
        }
        // A device that keeps failing from some submission on.
        for at in [0, submissions / 2, submissions - 1] {
            faults::inject(fault, at, u64::MAX);
            let (runs, told, backend) = generations(&replay, BackendChoice::Gpu);
            let seen = faults::end();
            if at > 0 && at + 1 >= seen && told.is_empty() {
                continue;
            }
            assert_eq!(backend, "simd", "{fault:?} from {at}: {told:?}");
            assert!(told.last().unwrap().contains("simd takes over"), "{told:?}");
            let mut taken_over = 0;
            for ((run, clean), lanes) in runs.iter().zip(&clean).zip(&lanes) {
                // What was scored before came from the device, the rest from lanes, and nothing from between.
                taken_over += usize::from(bits(run) == bits(lanes));
                assert!(
                    bits(run) == bits(clean) || bits(run) == bits(lanes),
                    "{fault:?} from {at}"
                );
                assert_eq!(run.failures, clean.failures);
                for (a, b) in run.objectives.iter().zip(&clean.objectives) {
                    // The backends' parity.
                    assert!((a - b).abs() <= 1e-3 * b.abs(), "{a} {b}");
                }
            }
            assert!(taken_over > 0);
        }
    }
}

fn lines(objectives: &[LineObjective], sections: usize) -> LineProblem {
    let cuts = common::line::ring(90.0, 104.0, sections);
    LineProblem::new(
        cuts,
        Parametrisation::sections(),
        objectives,
        Some(common::line::gt_car()),
        10.0,
    )
    .unwrap()
}

#[test]
fn lines_survive_a_lost_device() {
    let _turn = alone();
    if !has_device() {
        return;
    }
    let line = lines(&[LineObjective::Length, LineObjective::LapTime], 60);
    let mut random = Random(5);
    let population: Vec<f64> = (0..50 * 60).map(|_| random.within(0.0, 1.0)).collect();
    let mut clean = open_line_evaluator(&line, BackendChoice::Gpu, None).unwrap();
    let wanted = bits(&clean.evaluate(&population).unwrap());
    for fault in [Fault::Lost, Fault::OutOfMemory, Fault::Validation] {
        let mut evaluator = open_line_evaluator(&line, BackendChoice::Gpu, None).unwrap();
        faults::inject(fault, 0, 1);
        let found = evaluator.evaluate(&population).unwrap();
        faults::end();
        assert_eq!(bits(&found), wanted, "{fault:?}");
        assert_eq!(
            evaluator.device_faults().len(),
            1,
            "{:?}",
            evaluator.device_faults()
        );
    }
}

#[test]
fn the_least_limits_change_no_bit() {
    let _turn = alone();
    if !has_device() {
        return;
    }
    let small = GpuContext::with_least_limits(None).unwrap();
    let limits = small.limits();
    assert_eq!(limits.max_storage_buffer_binding_size, 128 << 20);
    assert_eq!(limits.max_compute_workgroups_per_dimension, 65_535);
    let whole = GpuContext::shared(None).unwrap();
    let replay = replay();
    let population = candidates(&replay, 3000, 0.2, &mut Draws::new(1));
    let on = |context| {
        let mut evaluator = GpuEvaluator::new(&replay, context).unwrap();
        bits(&evaluator.evaluate(&population).unwrap())
    };
    assert_eq!(on(small.clone()), on(whole.clone()));
    // Lines of so many sections that 128 MiB hold fewer than the population.
    let sections = 1500;
    let line = lines(&[LineObjective::Length, LineObjective::LapTime], sections);
    let mut random = Random(9);
    let row: Vec<f64> = (0..sections).map(|_| random.within(0.4, 0.6)).collect();
    let count = 12_000;
    assert!(count * sections * 2 * 4 > 128 << 20);
    let population: Vec<f64> = (0..count)
        .flat_map(|i| row.iter().map(move |x| x + 1e-6 * i as f64))
        .collect();
    let on = |context| {
        let mut evaluator = GpuLineEvaluator::new(&line, context).unwrap();
        bits(&evaluator.evaluate(&population).unwrap())
    };
    assert_eq!(on(small), on(whole));
}

/// A population in one go and in portions of every size, on every backend.
#[test]
fn portions_change_no_bit() {
    let _turn = alone();
    let choices = [BackendChoice::Cpu, BackendChoice::Simd, BackendChoice::Gpu];
    let choices = &choices[..if has_device() { 3 } else { 2 }];
    // More than the least portion, so that the least memory cuts it.
    let count = portions::LEAST + 500;
    let replay = replay();
    let line = lines(&[LineObjective::Length, LineObjective::LapTime], 24);
    let settings = HybridStudySettings {
        track: "stadium:300:80:12".to_owned(),
        sections: 120,
        ..HybridStudySettings::default()
    };
    let setup = hybrid::set_up(&settings).unwrap();
    let energy = setup
        .zone_problem(1.0, &[HybridObjective::LapTime, HybridObjective::Fuel])
        .unwrap();
    type Open<'a> = Box<dyn Fn(BackendChoice) -> Box<dyn Evaluator + 'a> + 'a>;
    let opened: [(&str, Open<'_>); 3] = [
        (
            "replay",
            Box::new(|choice| open_evaluator(&replay, choice, None).unwrap()),
        ),
        (
            "line",
            Box::new(|choice| open_line_evaluator(&line, choice, None).unwrap()),
        ),
        (
            "hybrid",
            Box::new(|choice| open_hybrid_evaluator(&energy, choice, None).unwrap()),
        ),
    ];
    for (name, open) in &opened {
        for &choice in choices {
            let mut whole = open(choice);
            let mut random = Random(3);
            let variables = whole.problem().variables.clone();
            let population: Vec<f64> = (0..count)
                .flat_map(|_| {
                    variables
                        .iter()
                        .map(|v| random.within(v.lower, v.upper))
                        .collect::<Vec<_>>()
                })
                .collect();
            let wanted = bits(&whole.evaluate(&population).unwrap());
            assert_eq!(wanted.1.len(), count);
            for size in [37, 256, 1000] {
                let found = Portions::of(open(choice), size).evaluate(&population).unwrap();
                assert!(
                    bits(&found) == wanted,
                    "{name} on {choice:?} in portions of {size}"
                );
            }
            let least = portions::allow(0);
            let mut evaluator = open(choice);
            drop(least);
            let found = bits(&evaluator.evaluate(&population).unwrap());
            assert!(found == wanted, "{name} on {choice:?} in the least memory");
        }
    }
}

/// What went wrong with devices before a run was broken off is told at its end, and what ended it is what it names.
#[test]
fn faults_survive_a_resume_and_the_summary_names_what_ended_the_run() {
    let _turn = alone();
    if !has_device() {
        return;
    }
    for algorithm in [LineAlgorithm::Windows, LineAlgorithm::Thesis] {
        let settings = RacelineSettings {
            track: "stadium:300:80:12".to_owned(),
            sections: 60,
            population: 16,
            iterations: 12,
            objectives: vec![LineObjective::Length],
            warm_start: false,
            local_search: false,
            backend: BackendChoice::Gpu,
            algorithm,
            ..RacelineSettings::default()
        };
        let setup = raceline::set_up(&settings).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mut seen = 0;
        // One submission fails, and the device is opened anew.
        let found = find_lines_from(&settings, &setup, None, &mut Keeper::new(folder.path()), |_| {
            seen += 1;
            if seen == 2 {
                faults::inject(Fault::Lost, 0, 1);
            }
            if seen == 4 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .unwrap();
        faults::end();
        assert!(found.interrupted);
        assert_eq!(found.device_faults.len(), 1, "{:?}", found.device_faults);
        let state: LinesState = checkpoint::load(&folder.path().join(STATE)).unwrap();
        let mut keeper = Keeper::new(folder.path());
        let mut seen = 0;
        // The same again, and then it stays away.
        let ended = find_lines_from(&settings, &setup, Some(state), &mut keeper, |_| {
            seen += 1;
            if seen == 2 {
                faults::inject(Fault::Lost, 0, u64::MAX);
            }
            ControlFlow::Continue(())
        })
        .unwrap();
        faults::end();
        assert!(!ended.interrupted);
        assert_eq!(ended.device_faults[0], found.device_faults[0]);
        let last = ended.device_faults.last().unwrap();
        assert!(last.contains("simd takes over"), "{:?}", ended.device_faults);
        assert_eq!(ended.backend.backend, "simd", "{algorithm:?}");
    }
}

#[test]
fn no_number_that_is_none_gets_through() {
    let _turn = alone();
    let choices = [BackendChoice::Cpu, BackendChoice::Simd, BackendChoice::Gpu];
    let choices = &choices[..if has_device() { 3 } else { 2 }];
    let evils = [
        f64::NAN,
        -f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MAX,
        f64::MIN,
        1e39,
        5e-324,
        f64::MIN_POSITIVE,
        f64::from(f32::MIN_POSITIVE) / 4.0,
        0.0,
        -0.0,
    ];
    let replay = problem(
        common::bundled_car(),
        &["rBx1", "rCy1", "K", "C"],
        Lap {
            samples: 200,
            ..Lap::default()
        },
    );
    let line = lines(&[LineObjective::Length, LineObjective::LapTime], 24);
    let sound = |name: &str, width: usize, evaluation: &Evaluation, population: &[f64]| {
        let rows = evaluation.objectives.chunks_exact(width);
        let dimensions = population.len() / evaluation.failures.len();
        for ((row, failure), candidate) in rows
            .zip(&evaluation.failures)
            .zip(population.chunks_exact(dimensions))
        {
            assert!(
                row.iter().all(|x| x.is_finite() && *x <= FAILED_COST),
                "{name}: {row:?} of {candidate:?}"
            );
            if candidate.iter().any(|x| !x.is_finite()) {
                assert_eq!(*failure, Some(Failure::NotFinite), "{name}: {candidate:?}");
            }
            assert_eq!(
                failure.is_some(),
                row.iter().all(|x| *x >= FAILED_COST),
                "{name}: {row:?} {failure:?} of {candidate:?}"
            );
        }
    };
    for &choice in choices {
        let mut evaluator = open_evaluator(&replay, choice, None).unwrap();
        let mut population = candidates(&replay, evils.len() * 4, 0.1, &mut Draws::new(2));
        for (k, evil) in evils.iter().enumerate() {
            for variable in 0..4 {
                population[(4 * k + variable) * 4 + variable] = *evil;
            }
        }
        let evaluation = evaluator.evaluate(&population).unwrap();
        sound(
            &format!("replay on {choice:?}"),
            replay.problem.objectives.len(),
            &evaluation,
            &population,
        );
        let counts = evaluation.failure_counts();
        assert_eq!(counts.get("variable_not_finite"), Some(&16), "{counts:?}");
        let mut evaluator = open_line_evaluator(&line, choice, None).unwrap();
        let mut population = vec![0.5; evils.len() * 24];
        for (k, evil) in evils.iter().enumerate() {
            population[k * 24 + k] = *evil;
        }
        sound(
            &format!("line on {choice:?}"),
            2,
            &evaluator.evaluate(&population).unwrap(),
            &population,
        );
    }
}

fn lapswarm(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lapswarm"))
        .args(arguments)
        .current_dir(folder)
        .env("VK_DRIVER_FILES", "/nowhere/none.json")
        .env("VK_ICD_FILENAMES", "/nowhere/none.json")
        .output()
        .expect("the program starts")
}

const STUDY: &str =
    "section = \"Abbey\"\npolish = false\n[swarm]\nalgorithm = \"pso\"\npopulation = 8\niterations = 2\n";

#[test]
fn without_a_driver_auto_works_and_gpu_says_why_not() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("study.toml"), STUDY).unwrap();
    let run = |backend: &str, out: &str| {
        lapswarm(
            folder.path(),
            &[
                "identify",
                "study.toml",
                "--json",
                "--quiet",
                "--backend",
                backend,
                "--out",
                out,
            ],
        )
    };
    let auto = run("auto", "auto");
    assert!(auto.status.success(), "{}", String::from_utf8_lossy(&auto.stderr));
    let summary: serde_json::Value = serde_json::from_slice(&auto.stdout).unwrap();
    assert_eq!(summary["backend"], "simd");
    assert!(summary["failures"].is_object() && summary["device_faults"].is_array());
    let gpu = run("gpu", "gpu");
    assert_eq!(gpu.status.code(), Some(3));
    let said = String::from_utf8_lossy(&gpu.stderr).into_owned();
    assert!(
        said.contains("adapter was found") && said.contains("simd"),
        "{said}"
    );
    let listed = lapswarm(folder.path(), &["devices"]);
    assert!(matches!(listed.status.code(), Some(0 | 3)), "{listed:?}");
}

/// Identifications that go together in a sweep share their device, and what goes wrong with it; each says so, and how long its
/// dispatches took.
#[test]
fn a_sweep_tells_of_faults_and_dispatches_run_by_run() {
    let _turn = alone();
    if !has_device() {
        return;
    }
    let text = "study = \"identify\"\n[base]\nsection = \"Abbey\"\npolish = false\nbackend = \"gpu\"\n[base.swarm]\n\
                algorithm = \"thesis\"\npopulation = 6\niterations = 3\n[grid]\nseed = [1, 2, 3]\n";
    let settings = SweepSettings::parse(Path::new("s.toml"), text).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut begun = 0;
    let summary = sweep(&settings, folder.path(), false, |_| {
        begun += 1;
        // Not before the device is open: told first before the runs, then before each call.
        if begun == 2 {
            faults::inject(Fault::Lost, 0, 1);
        }
        ControlFlow::Continue(())
    });
    faults::end();
    let summary = summary.unwrap();
    assert_eq!(summary.device_faults.len(), 1, "{:?}", summary.device_faults);
    let told = &summary.device_faults[0];
    assert!(
        told.starts_with("runs 00000, 00001, 00002: ") && told.contains("opened anew"),
        "{told}"
    );
    for (run, row) in summary.rows.iter().enumerate() {
        let path = folder.path().join(format!("studies/{run:05}.json"));
        let manifest: serde_json::Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
        assert_eq!(manifest["backend"], "gpu");
        assert_eq!(manifest["seed"], run + 1);
        assert_eq!(manifest["device_faults"], serde_json::json!(row.device_faults));
        assert!(
            manifest["longest_dispatch_ms"]
                .as_f64()
                .is_some_and(|ms| ms > 0.0),
            "{manifest}"
        );
    }
}

#[test]
fn what_would_take_all_memory_is_refused_with_what_would_not() {
    let folder = tempfile::tempdir().unwrap();
    let huge = std::fs::File::create(folder.path().join("huge.csv")).unwrap();
    let sweep = "study = \"identify\"\n[grid]\nseed = [1, 2]\n\"swarm.population\" = [10, 100000]\n";
    std::fs::write(folder.path().join("sweep.toml"), sweep).unwrap();
    // Ten gigabytes that take no space: a file with a hole.
    huge.set_len(10 << 30).unwrap();
    for arguments in [
        &["identify", "--population", "1000000000"][..],
        &["identify", "--iterations", "100000000000"],
        &["raceline", "--population", "9999999"],
        &["raceline", "--sections", "1000000"],
        &["raceline", "--sections", "1000000000"],
        &["identify", "--population", "100000", "--memory-limit-mib", "16"],
        &["hybrid", "--population", "9999999"],
        &["hybrid", "--iterations", "1000000", "--population", "100000"],
        &["sensitivity", "--samples", "65536", "--memory-limit-mib", "64"],
        &["surface", "--grid", "2000", "--memory-limit-mib", "64"],
        &["sweep", "sweep.toml", "--memory-limit-mib", "16"],
        &["identify", "--log", "huge.csv"],
        &["raceline", "--track", "huge.csv"],
        &["raceline", "--envelope", "huge.csv"],
        &["check", "huge.csv"],
    ] {
        let refused = lapswarm(folder.path(), arguments);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains("expected"), "{arguments:?}: {said}");
    }
    assert!(
        !folder.path().join("runs").exists(),
        "a refused study leaves no folder"
    );
}
