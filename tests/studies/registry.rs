//! Every study of the registry, whichever it is: it is planned, starved, interrupted and resumed by the same means.

use crate::small_studies::{command, small};
use lapswarm::Error;
use lapswarm::study::framework::memory::USUAL_MIB;
use lapswarm::study::framework::{Answer, Finished, Request};
use lapswarm::study::registry::{Registered, STUDIES};
use std::ops::ControlFlow;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

/// Asks a study; it is interrupted when its observer is told for the `interrupted`-th time.
fn ask(
    study: &dyn Registered,
    flags: &[(String, String)],
    out: &Path,
    (resume, dry_run, interrupted): (bool, bool, Option<usize>),
) -> lapswarm::Result<Answer> {
    ask_within(study, flags, out, (resume, dry_run, interrupted), None)
}

/// As [`ask`], of a study that has so much time.
fn ask_within(
    study: &dyn Registered,
    flags: &[(String, String)],
    out: &Path,
    (resume, dry_run, interrupted): (bool, bool, Option<usize>),
    limit: Option<Duration>,
) -> lapswarm::Result<Answer> {
    let mut told = 0;
    study.run(Request {
        file: None,
        text: None,
        flags,
        out: Some(out),
        resume,
        save_every: Duration::ZERO,
        time_limit: limit,
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
        let mut program = Command::new(env!("CARGO_BIN_EXE_lapswarm"));
        program
            .args(command(study, &flags))
            .args(["--memory-limit-mib", "1", "--out"])
            .arg(&out);
        let told = program.output().expect("the program starts");
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

/// A study without time ends in order: with what it has and the word of it, or with none of it and saying so. In either case it is
/// resumed to the figures of a run that had time.
#[test]
fn every_study_ends_in_order_when_its_time_is_over() {
    let mut reported = 0;
    for study in STUDIES.iter().copied().filter(|study| study.name() != "run") {
        let name = study.name();
        let root = tempfile::tempdir().expect("a folder");
        let flags = small(name, root.path());
        let within = |out: &str, resume: bool, limit: Option<Duration>| {
            let flags = if resume { &[] } else { &flags[..] };
            ask_within(study, flags, &root.path().join(out), (resume, false, None), limit)
        };
        let whole = finished(within("whole", false, Some(Duration::from_secs(86_400))), name);
        assert!(
            figures(&whole.json)["ended_by"].is_null(),
            "{name}: {}",
            whole.json
        );
        match within("out", false, Some(Duration::ZERO)) {
            Ok(Answer::Finished(finished)) => {
                reported += 1;
                finished.verdict.expect(name);
                assert_eq!(figures(&finished.json)["ended_by"], "time_limit", "{name}");
                assert!(finished.folder.join("summary.json").is_file(), "{name}");
            }
            Err(Error::Study(said)) => assert!(said.contains("time limit"), "{name}: {said}"),
            Err(error) => panic!("{name}: {error}"),
            Ok(Answer::Planned(_)) => panic!("{name} was planned only"),
        }
        assert!(root.path().join("out/state.lapswarm").is_file(), "{name}");
        let resumed = finished(within("out", true, None), name);
        assert_eq!(figures(&resumed.json), figures(&whole.json), "{name}");
    }
    assert!(reported > 0, "some have a result at their first step");
}
