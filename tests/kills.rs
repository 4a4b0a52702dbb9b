//! Runs that are killed or interrupted at any moment lose nothing, and end as if they had been left alone.

use lapswarm::study::identify::SearchState;
use lapswarm::study::journal::Journal;
use lapswarm::study::raceline::{LinesState, RacelineSettings, set_up};
use lapswarm::study::run_folder::STATE;
use lapswarm::study::transient::DriveState;
use lapswarm::swarm::checkpoint;
use serde_json::Value;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const STUDY: &str = "section = \"Abbey\"\nbackend = \"simd\"\n[swarm]\npopulation = 24\niterations = 120\n";

/// A whole run, small. Without a hybrid drive, whose study would take longer than all the others here.
const RUN: &str = "identify = \"car.toml\"\nraceline = \"line.toml\"\nrounds = 1\n";
const RUN_CAR: &str = "car = \"gt\"\nsection = \"Abbey\"\nbackend = \"simd\"\npolish = false\n[free]\nK = [3e4, 3e5]\n\
                       [swarm]\npopulation = 16\niterations = 40\n";
const RUN_LINE: &str =
    "track = \"stadium:500:100:14\"\nsections = 360\nobjectives = [\"lap_time\"]\nbackend = \"simd\"\n";

fn start(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_lapswarm"))
        .args(arguments)
        .args(["--json", "--quiet", "--save-every-s", "0"])
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts")
}

fn finish(child: Child) -> Output {
    child.wait_with_output().expect("the program ends")
}

fn summary(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    // A small run need not come to a line that the car can drive as well as a point mass.
    assert!(
        matches!(output.status.code(), Some(0 | 1)),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    timeless(serde_json::from_str(&text).expect("a summary"))
}

/// A summary without its times and rates.
fn timeless(summary: Value) -> Value {
    match summary {
        Value::Object(fields) => fields
            .into_iter()
            .filter(|(key, _)| {
                // Nor with what a run found done: one that goes on finds more.
                key != "reused"
                    && !["elapsed_s", "per_s", "search_s"]
                        .iter()
                        .any(|e| key.ends_with(e))
            })
            .map(|(key, value)| (key, timeless(value)))
            .collect(),
        Value::Array(values) => values.into_iter().map(timeless).collect(),
        value => value,
    }
}

/// Waits until a run has saved a state, and a number of milliseconds more; no longer than it works.
fn let_work(child: &mut Child, folder: &Path, ms: u64) {
    let limit = Instant::now() + Duration::from_secs(60);
    let mut saved = None;
    while Instant::now() < limit && child.try_wait().expect("its state").is_none() {
        if saved.is_none() && folder.join(STATE).is_file() {
            saved = Some(Instant::now());
        }
        if saved.is_some_and(|at| at.elapsed() >= Duration::from_millis(ms)) {
            return;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// No file of a folder is part of one: JSON parses, tables end with a line, the state loads.
fn nothing_half_written(folder: &Path) {
    for entry in folder.read_dir().expect("a folder").flatten() {
        let path = entry.path();
        // The stages of a run.
        if path.is_dir() {
            nothing_half_written(&path);
            continue;
        }
        let bytes = std::fs::read(&path).expect("a file");
        match path.extension().and_then(|e| e.to_str()) {
            Some("json") => drop(serde_json::from_slice::<Value>(&bytes).expect("whole JSON")),
            Some("csv") => assert_eq!(bytes.last(), Some(&b'\n'), "{}", path.display()),
            Some("svg") => assert!(String::from_utf8_lossy(&bytes).trim_end().ends_with("</svg>")),
            Some("lapswarm") => {
                let loads = checkpoint::load::<SearchState>(&path).is_ok()
                    || checkpoint::load::<LinesState>(&path).is_ok()
                    || checkpoint::load::<Journal>(&path).is_ok()
                    || checkpoint::load::<DriveState>(&path).is_ok();
                assert!(loads, "{} is no whole state", path.display());
            }
            _ => {}
        }
    }
}

/// A line at a share of a road's width from the right, as `transient` reads one. At its edge many shares of the grip are tried
/// until one is held.
fn along(track: &str, alpha: f64) -> String {
    let setup = set_up(&RacelineSettings {
        track: track.to_owned(),
        sections: 200,
        ..RacelineSettings::default()
    })
    .expect("a track");
    let points = setup.cuts.points(&vec![alpha; setup.cuts.len()]);
    let rows = points.iter().map(|p| format!("{},{}\n", p.x, p.y));
    format!("x_m,y_m\n{}", rows.collect::<String>())
}

/// Tells a study to stop, so many milliseconds after it has saved its first state; goes on with it, and holds what it ends with
/// against `wanted`. Returns the time that it took to stop.
fn stop_and_go_on(
    root: &Path,
    study: &[&str],
    (signal, ms): (&str, u64),
    wanted: &Value,
    files: &[&str],
) -> Duration {
    let out = format!("stopped-{}{signal}-{ms}", study[0]);
    let folder = root.join(&out);
    let mut child = start(root, &[study, &["--out", &out]].concat());
    let_work(&mut child, &folder, ms);
    let told = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status();
    assert!(told.expect("kill").success());
    let signalled = Instant::now();
    let ended = finish(child);
    let took = signalled.elapsed();
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(
        ended.status.code(),
        Some(130),
        "{study:?} {signal} at {ms}: {said}"
    );
    assert!(folder.join(STATE).is_file(), "{said}");
    nothing_half_written(&folder);
    let resumed = finish(start(root, &[study[0], "--resume", "--out", &out]));
    assert_eq!(summary(&resumed), *wanted, "{study:?} {signal} at {ms}");
    for file in files {
        let read = |run: &str| std::fs::read(root.join(run).join(file)).expect("a file");
        assert!(
            read(&out) == read("whole"),
            "{file} of {study:?} {signal} at {ms}"
        );
    }
    assert!(!folder.join(STATE).exists());
    took
}

#[test]
fn a_hybrid_that_is_told_to_stop_while_it_looks_for_its_line_goes_on() {
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
    let began = Instant::now();
    let wanted = summary(&finish(start(
        root.path(),
        &[&study[..], &["--out", "whole"]].concat(),
    )));
    let whole = began.elapsed();
    for (signal, ms) in [("-INT", 0), ("-TERM", 300)] {
        let took = stop_and_go_on(root.path(), &study, (signal, ms), &wanted, &["study.toml"]);
        // It ends with the program at work, and not with the search.
        assert!(took < whole / 2, "{took:?} of {whole:?}");
    }
}

#[test]
fn a_drive_that_is_told_to_stop_goes_on() {
    let root = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(root.path().join("line.csv"), along("stadium:400:120:14", 0.01)).expect("a line");
    let alone = ["transient", "--line", "line.csv", "--track", "stadium:400:120:14"];
    let wanted = summary(&finish(start(
        root.path(),
        &[&alone[..], &["--out", "whole"]].concat(),
    )));
    for (signal, ms) in [("-TERM", 0), ("-INT", 100)] {
        stop_and_go_on(
            root.path(),
            &alone,
            (signal, ms),
            &wanted,
            &["drive.csv", "speeds.svg"],
        );
    }
    std::fs::rename(root.path().join("whole"), root.path().join("alone")).expect("it moves");
    // The plans of the lines come first, then laps in two batches.
    let small = "stadium:100:40:14";
    std::fs::write(root.path().join("small.csv"), along(small, 0.5)).expect("a line");
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
    let wanted = summary(&finish(start(
        root.path(),
        &[&many[..], &["--out", "whole"]].concat(),
    )));
    for (signal, ms) in [("-INT", 0), ("-TERM", 500)] {
        stop_and_go_on(
            root.path(),
            &many,
            (signal, ms),
            &wanted,
            &["setups.csv", "car.toml"],
        );
    }
}

/// Kills a study at moments that are spread at random (by the golden ratio) over the time that it takes when it is left alone,
/// goes on with it, and holds what it ends with against that of the run that was left alone.
fn kill_and_go_on(study: &[&str], files: &[&str], kills: u32) {
    let root = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in [
        ("study.toml", STUDY),
        ("run.toml", RUN),
        ("car.toml", RUN_CAR),
        ("line.toml", RUN_LINE),
        ("line.csv", &along("stadium:400:120:14", 0.01)),
    ] {
        std::fs::write(root.path().join(name), text).expect("a study");
    }
    let go = |arguments: &[&str]| finish(start(root.path(), arguments));
    let began = Instant::now();
    let wanted = summary(&go(&[study, &["--out", "whole"]].concat()));
    let took = began.elapsed();
    let mut resumed_runs = 0;
    for k in 0..kills {
        let out = format!("killed-{k}");
        let folder = root.path().join(&out);
        let mut child = start(root.path(), &[study, &["--out", &out]].concat());
        let share = (0.5 + f64::from(k) * 0.618_033_988_75).fract();
        let_work(&mut child, &folder, (took.as_secs_f64() * share * 1e3) as u64);
        child.kill().expect("a signal");
        finish(child);
        nothing_half_written(&folder);
        let resumed = go(&[study[0], "--resume", "--out", &out]);
        if folder.join("manifest.json").is_file() && resumed.status.code() == Some(2) {
            // It had finished before it was killed.
            let said = String::from_utf8_lossy(&resumed.stderr).into_owned();
            assert!(said.contains("finished"), "{said}");
            continue;
        }
        assert_eq!(
            summary(&resumed),
            wanted,
            "{study:?} killed at {share} of its time"
        );
        resumed_runs += 1;
        for file in files {
            let read = |run: &str| std::fs::read(root.path().join(run).join(file)).expect("a file");
            assert!(
                read(&out) == read("whole"),
                "{file} of {study:?} killed at {share}"
            );
        }
        assert!(!folder.join(STATE).exists());
        let left = folder.read_dir().expect("a folder").flatten();
        let hidden: Vec<_> = left
            .map(|e| e.file_name())
            .filter(|n| n.to_string_lossy().starts_with('.'))
            .collect();
        assert!(hidden.is_empty(), "{hidden:?}");
    }
    assert!(resumed_runs > 0, "{study:?} was never caught at work");
}

#[test]
fn a_killed_identification_ends_as_one_that_was_left_alone() {
    let files = ["car.toml", "parameters.csv", "traces.csv"];
    kill_and_go_on(&["identify", "study.toml"], &files, 10);
}

#[test]
fn a_killed_search_for_lines_ends_as_one_that_was_left_alone() {
    let study = [
        "raceline",
        "--track",
        "stadium:300:80:12",
        "--sections",
        "120",
        "--objectives",
        "length,lap_time",
        "--population",
        "24",
        "--iterations",
        "40",
        "--backend",
        "simd",
    ];
    kill_and_go_on(&study, &["line_fastest.csv"], 10);
}

#[test]
fn a_killed_hybrid_study_ends_as_one_that_was_left_alone() {
    let study = [
        "hybrid",
        "--track",
        "stadium:300:80:12",
        "--sections",
        "120",
        "--population",
        "16",
        "--iterations",
        "40",
        "--backend",
        "simd",
    ];
    kill_and_go_on(&study, &[], 10);
}

#[test]
fn a_killed_sensitivity_study_ends_as_one_that_was_left_alone() {
    let study = [
        "sensitivity",
        "--section",
        "Abbey",
        "--parameters",
        "rBy1,rCy1,K",
        "--samples",
        "64",
        "--backend",
        "simd",
    ];
    kill_and_go_on(&study, &[], 10);
}

#[test]
fn a_killed_surface_ends_as_one_that_was_left_alone() {
    let study = [
        "surface",
        "--section",
        "Abbey",
        "--grid",
        "60",
        "--backend",
        "simd",
    ];
    kill_and_go_on(&study, &[], 10);
}

#[test]
fn a_killed_plain_swarm_ends_as_one_that_was_left_alone() {
    let study = [
        "raceline",
        "--track",
        "stadium:300:80:12",
        "--sections",
        "120",
        "--objectives",
        "length,gamma",
        "--algorithm",
        "cooperative",
        "--population",
        "16",
        "--iterations",
        "240",
        "--backend",
        "simd",
    ];
    kill_and_go_on(&study, &["line_shortest.csv"], 5);
}

#[test]
fn a_killed_drive_ends_as_one_that_was_left_alone() {
    let study = ["transient", "--line", "line.csv", "--track", "stadium:400:120:14"];
    kill_and_go_on(&study, &["drive.csv", "envelope_driven.csv"], 4);
}

#[test]
fn a_killed_run_ends_as_one_that_was_left_alone() {
    let study = ["run", "run.toml", "--no-cache"];
    kill_and_go_on(
        &study,
        &["3_raceline/line_fastest.csv", "4_transient/drive.csv"],
        4,
    );
}

#[test]
fn an_interrupted_run_says_so_and_what_is_not_its_state_is_refused() {
    let root = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(root.path().join("study.toml"), STUDY.replace("120", "100000")).expect("a study");
    let folder = root.path().join("run");
    let mut child = start(root.path(), &["identify", "study.toml", "--out", "run"]);
    let_work(&mut child, &folder, 200);
    // While it works, nobody else gets its folder.
    for arguments in [
        &["identify", "study.toml", "--out", "run"][..],
        &["identify", "--resume", "--out", "run"],
    ] {
        let second = finish(start(root.path(), arguments));
        assert_eq!(second.status.code(), Some(2), "{arguments:?}");
    }
    let told = Command::new("kill")
        .args(["-TERM", &child.id().to_string()])
        .status();
    assert!(told.expect("kill").success());
    let ended = finish(child);
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

/// As on a full disk: no file grows beyond a limit, and the write that would make it fails.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_whole_files_or_none() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let study =
        "section = \"Abbey\"\nbackend = \"simd\"\npolish = false\n[swarm]\npopulation = 8\niterations = 4\n";
    std::fs::write(root.path().join("study.toml"), study).expect("a study");
    let mut files = Vec::new();
    // In blocks of 512 bytes, from nothing at all to what the report alone does not fit into.
    for blocks in [0, 1, 8, 64, 512] {
        let out = format!("full-{blocks}");
        // A limit that is met raises a signal, which would end the program before it can say anything.
        let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
        let ended = Command::new("sh")
            .args(["-c", &limited, env!("CARGO_BIN_EXE_lapswarm")])
            .args([
                "identify",
                "study.toml",
                "--out",
                &out,
                "--quiet",
                "--save-every-s",
                "0",
            ])
            .current_dir(root.path())
            .output()
            .expect("a shell");
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert!(
            matches!(ended.status.code(), Some(1 | 2)),
            "{blocks}: {:?} {said}",
            ended.status
        );
        assert!(said.contains(&out) && !said.contains("panicked"), "{said}");
        let folder = root.path().join(&out);
        // Where not even a state could be written, the folder has gone again.
        if folder.exists() {
            nothing_half_written(&folder);
        }
        files.push(folder.read_dir().map_or(0, |entries| entries.flatten().count()));
        // No summary or manifest says that a run is whole which is not.
        assert!(!folder.join("manifest.json").exists(), "{blocks}");
    }
    assert!(files.last() > files.first(), "{files:?}");
}
