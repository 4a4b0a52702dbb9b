//! Runs that are told to stop, and runs whose disk is full: nothing is lost, and they end as if they had been left alone.

use crate::common::runs::{
    Held, along, finish, nothing_half_written, nothing_on_its_way, same_results, start, summary,
};
use crate::common::studies;
use lapswarm::files::run_folder::STATE;
use lapswarm::study::registry::STUDIES;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

tests! {
    every_study_that_is_told_to_stop_is_resumed_to_the_same_results: full,
    a_hybrid_that_is_told_to_stop_while_it_looks_for_its_line_is_resumed: everywhere,
    a_drive_that_is_told_to_stop_is_resumed: everywhere,
    an_interrupted_run_says_so_and_what_is_not_its_state_is_refused: everywhere,
    a_full_disk_leaves_whole_files_or_none_and_room_lets_the_run_end: full,
}

const STUDY: &str = "section = \"Abbey\"\nbackend = \"simd\"\n[swarm]\npopulation = 24\niterations = 12\n";

/// A whole run of a study: its summary, and how often it passed each point.
fn whole(root: &Path, study: &[&str]) -> (Value, Vec<String>) {
    let mut alone = Held::start(root, study, "whole", ("none", 0));
    assert!(!alone.is_held());
    let passed = alone.passed();
    (summary(&alone.finish()), passed)
}

/// The number of the passing of a point in the middle of all of them.
fn middle(passed: &[String], point: &str) -> usize {
    passed.iter().filter(|p| *p == point).count().div_ceil(2)
}

/// Tells a study to stop when it is held at a point, resumes it, and holds what it ends with against `wanted`.
fn stop_and_resume(
    root: &Path,
    study: &[&str],
    (signal, point, number): (&str, &str, usize),
    wanted: &Value,
    files: &[&str],
) {
    let out = format!("stopped-{}{signal}-{number}", study[0]);
    let what = format!("{study:?} {signal} at {point} {number}");
    let folder = root.join(&out);
    let mut held = Held::start(root, study, &out, (point, number));
    assert!(held.is_held(), "{what}");
    let (ended, steps) = held.signal(signal);
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(130), "{what}: {said}");
    // It ends with the program at work, and not with the search: the next time that it is asked, it stops.
    assert!(steps <= 2, "{what}: {steps} steps after the signal");
    assert!(folder.join(STATE).is_file(), "{said}");
    nothing_half_written(&folder);
    let resumed = finish(start(root, &[study[0], "--resume", "--out", &out]));
    assert_eq!(summary(&resumed), *wanted, "{what}");
    for file in files {
        let read = |run: &str| std::fs::read(root.join(run).join(file)).expect("a file");
        assert!(read(&out) == read("whole"), "{file} of {what}");
    }
    assert!(!folder.join(STATE).exists());
}

/// Told to stop after its first save, and where it is first asked whether it goes on.
fn every_study_that_is_told_to_stop_is_resumed_to_the_same_results() {
    for &study in STUDIES {
        let root = tempfile::tempdir().expect("a temporary folder");
        let root = root.path();
        let command = studies::command(study, &studies::small(study.name(), root));
        let arguments: Vec<&str> = command.iter().map(String::as_str).collect();
        let (wanted, _) = whole(root, &arguments);
        for (signal, point) in [("-TERM", "saved"), ("-INT", "step")] {
            let out = format!("stopped{signal}");
            let mut held = Held::start(root, &arguments, &out, (point, 1));
            assert!(held.is_held(), "{arguments:?}: never at {point}");
            let (ended, _) = held.signal(signal);
            let said = String::from_utf8_lossy(&ended.stderr).into_owned();
            assert_eq!(ended.status.code(), Some(130), "{arguments:?}: {said}");
            let folder = root.join(&out);
            assert!(folder.join(STATE).is_file(), "{arguments:?}: {said}");
            nothing_half_written(&folder);
            let resumed = finish(start(root, &[study.name(), "--resume", "--out", &out]));
            assert_eq!(summary(&resumed), wanted, "{arguments:?}");
            same_results(&out, &folder, &root.join("whole"));
            assert!(!folder.join(STATE).exists(), "{arguments:?}");
        }
    }
}

fn a_hybrid_that_is_told_to_stop_while_it_looks_for_its_line_is_resumed() {
    let root = tempfile::tempdir().expect("a temporary folder");
    // The search for the line is nearly all there is to do.
    let study = [
        "hybrid",
        "--scenarios-only",
        "--sections",
        "600",
        "--backend",
        "simd",
    ];
    let (wanted, passed) = whole(root.path(), &study);
    for at in [
        ("-INT", "saved", 1),
        ("-TERM", "solver", middle(&passed, "solver")),
    ] {
        stop_and_resume(root.path(), &study, at, &wanted, &["study.toml"]);
    }
}

fn a_drive_that_is_told_to_stop_is_resumed() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let root = root.path();
    std::fs::write(root.join("line.csv"), along("stadium:400:120:14", 0.01)).expect("a line");
    let alone = ["transient", "--line", "line.csv", "--track", "stadium:400:120:14"];
    let (wanted, passed) = whole(root, &alone);
    for at in [("-TERM", "saved", 1), ("-INT", "saved", middle(&passed, "saved"))] {
        stop_and_resume(root, &alone, at, &wanted, &["drive.csv", "speeds.svg"]);
    }
    for left in ["whole", "whole.passed"] {
        std::fs::rename(root.join(left), root.join(left.replace("whole", "alone"))).expect("it moves");
    }
    // The plans of the lines come first, then laps in two batches.
    let small = "stadium:100:40:14";
    std::fs::write(root.join("small.csv"), along(small, 0.5)).expect("a line");
    let many = [
        "transient",
        "--line",
        "small.csv",
        "--track",
        small,
        "--setups",
        "60",
        "--backend",
        "simd",
    ];
    let (wanted, passed) = whole(root, &many);
    for at in [("-INT", "saved", 1), ("-TERM", "saved", middle(&passed, "saved"))] {
        stop_and_resume(root, &many, at, &wanted, &["setups.csv", "car.toml"]);
    }
}

fn an_interrupted_run_says_so_and_what_is_not_its_state_is_refused() {
    let root = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(root.path().join("study.toml"), STUDY).expect("a study");
    let folder = root.path().join("run");
    let mut held = Held::start(root.path(), &["identify", "study.toml"], "run", ("saved", 3));
    assert!(held.is_held());
    // While it works, nobody else gets its folder.
    for arguments in [
        &["identify", "study.toml", "--out", "run"][..],
        &["identify", "--resume", "--out", "run"],
    ] {
        let second = finish(start(root.path(), arguments));
        assert_eq!(second.status.code(), Some(2), "{arguments:?}");
    }
    let (ended, _) = held.signal("-TERM");
    assert_eq!(
        ended.status.code(),
        Some(130),
        "{}",
        String::from_utf8_lossy(&ended.stderr)
    );
    let state = folder.join(STATE);
    let kept = std::fs::read(&state).expect("a state");
    let refused = |arguments: &[&str], wanted: &str| {
        let output = finish(start(
            root.path(),
            &[&["identify", "--resume", "--out", "run"], arguments].concat(),
        ));
        let said: String = String::from_utf8_lossy(&output.stderr).replace(['\n', '│', ' '], "");
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(
            said.contains(&wanted.replace(' ', "")),
            "{said} should say {wanted}"
        );
    };
    refused(&["--seed", "2"], "other settings");
    refused(&["--population", "25"], "other settings");
    let mut bytes = kept.clone();
    bytes.truncate(kept.len() / 2);
    std::fs::write(&state, &bytes).expect("a file");
    refused(&[], "a damaged one");
    let mut bytes = kept.clone();
    bytes[kept.len() / 2] ^= 4;
    std::fs::write(&state, &bytes).expect("a file");
    refused(&[], "a damaged one");
    let mut bytes = kept.clone();
    bytes[8] = 77;
    std::fs::write(&state, &bytes).expect("a file");
    refused(&[], "version of the checkpoint");
    std::fs::write(&state, "something else").expect("a file");
    refused(&[], "a checkpoint of lapswarm");
    let output = finish(start(root.path(), &["raceline", "--resume", "--out", "run"]));
    assert_eq!(output.status.code(), Some(2));
    let output = finish(start(root.path(), &["identify", "--resume", "--out", "nowhere"]));
    assert_eq!(output.status.code(), Some(2));
}

/// Runs a study with room for files of so many blocks of 512 bytes: the write that would make a file larger fails.
fn with_room_for(blocks: u32, root: &Path, study: &[&str]) -> Output {
    // A limit that is met raises a signal, which would end the program before it can say anything.
    let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
    Command::new("sh")
        .args(["-c", &limited, env!("CARGO_BIN_EXE_lapswarm")])
        .args(study)
        .args(["--quiet", "--save-every-s", "0"])
        .current_dir(root)
        .output()
        .expect("a shell")
}

/// As on a full disk, from nothing at all to what the report alone does not fit into; once there is room, the run goes on from
/// what it could save.
fn a_full_disk_leaves_whole_files_or_none_and_room_lets_the_run_end() {
    let root = tempfile::tempdir().expect("a temporary folder");
    // What a stage of a run cannot write ends the run before there is anything to resume; its stages are the other studies.
    for study in STUDIES.iter().copied().filter(|study| study.name() != "run") {
        let command = studies::command(study, &studies::small(study.name(), root.path()));
        let study: Vec<&str> = command.iter().map(String::as_str).collect();
        let name = study[0];
        let whole = format!("{name}-whole");
        let wanted = summary(&finish(start(
            root.path(),
            &[&study[..], &["--out", &whole]].concat(),
        )));
        let mut files = Vec::new();
        let mut resumed_runs = 0;
        for blocks in [0, 1, 8, 64, 512] {
            let out = format!("{name}-{blocks}");
            let ended = with_room_for(blocks, root.path(), &[&study[..], &["--out", &out]].concat());
            let said = String::from_utf8_lossy(&ended.stderr).into_owned();
            let folder = root.path().join(&out);
            if ended.status.success() && blocks == 512 {
                // All of its files fit.
                same_results(&out, &folder, &root.path().join(&whole));
                files.push(usize::MAX);
                continue;
            }
            assert!(
                matches!(ended.status.code(), Some(1 | 2)),
                "{out}: {:?} {said}",
                ended.status
            );
            assert!(said.contains(&out) && !said.contains("panicked"), "{said}");
            // Where not even a state could be written, the folder has gone again.
            if folder.exists() {
                nothing_half_written(&folder);
                nothing_on_its_way(&folder);
            }
            files.push(folder.read_dir().map_or(0, |entries| entries.flatten().count()));
            // No summary or manifest says that a run is whole which is not.
            assert!(!folder.join("manifest.json").exists(), "{out}");
            if folder.join(STATE).is_file() {
                let resumed = finish(start(root.path(), &[name, "--resume", "--out", &out]));
                assert_eq!(summary(&resumed), wanted, "{out}");
                same_results(&out, &folder, &root.path().join(&whole));
                nothing_on_its_way(&folder);
                resumed_runs += 1;
            }
        }
        assert!(files.last() > files.first(), "{name}: {files:?}");
        assert!(resumed_runs > 0, "{name}");
    }
}
