//! Every study of the registry, whichever it is: it is planned, starved, interrupted and resumed by the same means.

use lapswarm::Error;
use lapswarm::config::settings::Flag;
use lapswarm::study::framework::memory::USUAL_MIB;
use lapswarm::study::framework::{Answer, Finished, Request};
use lapswarm::study::registry::{Registered, STUDIES};
use std::ops::ControlFlow;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

/// Flags that make a study small. A new study has a row here.
fn small(study: &str, folder: &Path) -> Vec<(String, String)> {
    let ring = || {
        let points = (0..400).map(|i| {
            let angle = std::f64::consts::TAU * f64::from(i) / 400.0;
            format!("{},{}\n", 300.0 * angle.cos(), 300.0 * angle.sin())
        });
        let path = folder.join("ring.csv");
        std::fs::write(&path, format!("x_m,y_m\n{}", points.collect::<String>())).expect("a line");
        path.display().to_string()
    };
    let flags: Vec<(&str, String)> = match study {
        "run" => vec![
            ("track", "stadium:400:120:14".to_owned()),
            ("backend", "simd".to_owned()),
            ("no_cache", "true".to_owned()),
        ],
        "identify" => vec![
            ("section", "Abbey".to_owned()),
            ("swarm.population", "16".to_owned()),
            ("swarm.iterations", "8".to_owned()),
            ("polish", "false".to_owned()),
            ("backend", "simd".to_owned()),
        ],
        "envelope" => vec![
            ("step_mps", "25".to_owned()),
            ("steers", "8".to_owned()),
            ("backend", "simd".to_owned()),
        ],
        "raceline" => vec![
            ("track", "stadium:400:120:14".to_owned()),
            ("sections", "60".to_owned()),
            ("objectives", "gamma,length".to_owned()),
            ("population", "16".to_owned()),
            ("iterations", "8".to_owned()),
            ("backend", "simd".to_owned()),
        ],
        "hybrid" => vec![
            ("track", "stadium:400:120:14".to_owned()),
            ("sections", "60".to_owned()),
            ("budgets_mj", "0.5".to_owned()),
            ("objectives", "lap_time_s".to_owned()),
            ("population", "16".to_owned()),
            ("iterations", "8".to_owned()),
            ("backend", "simd".to_owned()),
        ],
        "transient" => vec![
            ("line", ring()),
            ("track", "circle:294:306".to_owned()),
            ("setups", "3".to_owned()),
            ("backend", "simd".to_owned()),
        ],
        "sensitivity" => vec![
            ("free", "K,C".to_owned()),
            ("section", "Abbey".to_owned()),
            ("samples", "8".to_owned()),
            ("backend", "simd".to_owned()),
        ],
        "surface" => vec![
            ("section", "Abbey".to_owned()),
            ("grid", "3".to_owned()),
            ("backend", "simd".to_owned()),
        ],
        other => panic!("{other} is new: say how it is made small"),
    };
    flags
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
}

/// Asks a study; it is interrupted when its observer is told for the `interrupted`-th time.
fn ask(
    study: &dyn Registered,
    flags: &[(String, String)],
    out: &Path,
    (resume, dry_run, interrupted): (bool, bool, Option<usize>),
) -> lapswarm::Result<Answer> {
    let mut told = 0;
    study.run(Request {
        file: None,
        flags,
        out: Some(out),
        resume,
        save_every: Duration::ZERO,
        memory_limit_mib: USUAL_MIB,
        dry_run,
        stop: Arc::default(),
        observe: &mut |_| {
            told += 1;
            if interrupted.is_some_and(|at| told >= at) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        },
    })
}

fn finished(answer: lapswarm::Result<Answer>, study: &str) -> Finished {
    match answer.unwrap_or_else(|error| panic!("{study}: {error}")) {
        Answer::Finished(finished) => finished,
        Answer::Planned(_) => panic!("{study} was planned only"),
    }
}

/// The figures that do not depend on the clock.
fn figures(json: &str) -> serde_json::Value {
    fn without_clock(value: &mut serde_json::Value) {
        match value {
            serde_json::Value::Object(entries) => {
                let clock = ["elapsed_s", "_per_s", "dispatch_ms"];
                entries.retain(|key, _| !clock.iter().any(|end| key.ends_with(end)));
                entries.values_mut().for_each(without_clock);
            }
            serde_json::Value::Array(values) => values.iter_mut().for_each(without_clock),
            _ => {}
        }
    }
    let mut value = serde_json::from_str(json).expect("an object");
    without_clock(&mut value);
    value
}

#[test]
fn every_study_is_planned_and_leaves_nothing() {
    for &study in STUDIES {
        let root = tempfile::tempdir().expect("a folder");
        let out = root.path().join("out");
        let flags = small(study.name(), root.path());
        let answer = ask(study, &flags, &out, (false, true, None));
        assert!(matches!(answer, Ok(Answer::Planned(_))), "{}", study.name());
        assert!(!out.exists(), "{}", study.name());
    }
}

/// In a process of its own: the limit is the process's.
#[test]
fn every_study_that_has_too_little_memory_is_refused_and_leaves_nothing() {
    for &study in STUDIES {
        let root = tempfile::tempdir().expect("a folder");
        let out = root.path().join("out");
        let flags = small(study.name(), root.path());
        let mut command = Command::new(env!("CARGO_BIN_EXE_lapswarm"));
        command
            .arg(study.name())
            .args(["--memory-limit-mib", "1", "--out"])
            .arg(&out);
        for d in study.declared() {
            let value = flags.iter().find(|(key, _)| key == d.key).map(|(_, value)| value);
            match (d.flag, d.typed(), value) {
                (Flag::Switch(_, on), Some(flag), Some(value)) if *value == on.to_string() => {
                    command.arg(flag);
                }
                (Flag::Switch(..), ..) => {}
                (_, Some(flag), Some(value)) => {
                    command.arg(flag).arg(value);
                }
                _ => {}
            }
        }
        let told = command.output().expect("the program starts");
        let words = String::from_utf8_lossy(&told.stderr);
        assert_eq!(told.status.code(), Some(2), "{}: {words}", study.name());
        assert!(words.contains("--memory-limit-mib"), "{}: {words}", study.name());
        assert!(!out.exists(), "{}", study.name());
    }
}

/// All but `run`, whose stages are these studies: its own interruptions are in `tests/interrupted`.
#[test]
fn every_study_that_is_interrupted_is_resumed_to_the_same_figures() {
    for study in STUDIES.iter().copied().filter(|study| study.name() != "run") {
        let name = study.name();
        let root = tempfile::tempdir().expect("a folder");
        let flags = small(name, root.path());
        let whole = finished(
            ask(study, &flags, &root.path().join("whole"), (false, false, None)),
            name,
        );
        let out = root.path().join("out");
        let error = match ask(study, &flags, &out, (false, false, Some(1))) {
            Err(error) => error,
            Ok(Answer::Finished(finished)) => finished.verdict.expect_err(name),
            Ok(Answer::Planned(_)) => panic!("{name} was planned only"),
        };
        assert!(matches!(error, Error::Interrupted(_)), "{name}: {error}");
        assert!(out.join("state.lapswarm").is_file(), "{name}");
        let resumed = finished(ask(study, &[], &out, (true, false, None)), name);
        assert_eq!(figures(&resumed.json), figures(&whole.json), "{name}");
        assert!(!out.join("state.lapswarm").exists(), "{name}");
    }
}
