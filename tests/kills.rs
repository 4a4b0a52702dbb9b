//! Runs that are killed at any moment lose nothing, and end as if they had been left alone.

#![cfg(unix)]

mod common;

use common::kinds::has_device;
use common::runs::{
    along, finish, let_work, moments, nothing_half_written, nothing_on_its_way, same_results, start, summary,
    works_for,
};
use lapswarm::study::run_folder::STATE;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::Command;

const STUDY: &str =
    "section = \"Abbey\"\nbackend = \"simd\"\nhops = 0\n[swarm]\npopulation = 24\niterations = 120\n";

/// A whole run, small. Without a hybrid drive, whose study would take longer than all the others here.
const RUN: &str = "identify = \"car.toml\"\nraceline = \"line.toml\"\nrounds = 1\n";
const RUN_CAR: &str = "car = \"gt\"\nsection = \"Abbey\"\nbackend = \"simd\"\npolish = false\n[free]\nK = [3e4, 3e5]\n\
                       [swarm]\npopulation = 16\niterations = 40\n";
const RUN_LINE: &str =
    "track = \"stadium:500:100:14\"\nsections = 360\nobjectives = [\"lap_time\"]\nbackend = \"simd\"\n";

/// Runs of two problems, each by itself.
const SWEEP: &str = "study = \"identify\"\n[base]\nsection = \"Abbey\"\npolish = false\nbackend = \"simd\"\n[base.free]\n\
                     K = [3e4, 3e5]\n[base.swarm]\nalgorithm = \"thesis\"\niterations = 60\n[grid]\nnorm = [\"1\", \"2\"]\n\
                     \"swarm.population\" = [8, 12, 16]\nseed = [1, 2]\n";

/// A study, and how it is gone on with.
struct Study<'a> {
    arguments: &'a [&'a str],
    again: &'a [&'a str],
    /// The file whose first version says that there is something to go on with.
    marker: &'a str,
    signal: &'a str,
}

impl<'a> Study<'a> {
    fn new(arguments: &'a [&'a str]) -> Self {
        Self {
            arguments,
            again: &arguments[..1],
            marker: STATE,
            signal: "-KILL",
        }
    }

    /// Kills it `kills` times at moments that are drawn from the time between its first save and its end, goes on each time, and
    /// holds what it ends with, every file of it, against a run that was left alone.
    fn kill_and_go_on(&self, kills: usize) {
        let root = tempfile::tempdir().expect("a temporary folder");
        let root = root.path();
        for (name, text) in [
            ("study.toml", STUDY),
            ("run.toml", RUN),
            ("car.toml", RUN_CAR),
            ("line.toml", RUN_LINE),
            ("sweep.toml", SWEEP),
            ("line.csv", &along("stadium:400:120:14", 0.01)),
        ] {
            std::fs::write(root.join(name), text).expect("a study");
        }
        let study = self.arguments;
        let begin = |out: &str| start(root, &[study, &["--out", out]].concat());
        let whole = root.join("whole");
        let mut child = begin("whole");
        // It writes less than what a pipe holds.
        let mut working_s = works_for(&mut child, &whole.join(self.marker)).as_secs_f64();
        let wanted = summary(&finish(child));
        let mut random = moments(&study.join(" "));
        let mut caught = 0;
        for k in 0..kills {
            let out = format!("killed-{k}");
            let folder = root.join(&out);
            let marker = folder.join(self.marker);
            let mut child = begin(&out);
            let at_s = random.within(0.0, working_s);
            let what = format!(
                "{study:?} with {} after {at_s:.3} s of {working_s:.3} s",
                self.signal
            );
            if !let_work(&mut child, &marker, (at_s * 1e3) as u64) {
                // The machine has more time than it had.
                working_s *= 0.8;
            }
            let told = Command::new("kill")
                .args([self.signal, &child.id().to_string()])
                .output();
            told.expect("kill");
            let ended = finish(child);
            nothing_half_written(&folder);
            let kept = self.rows(&folder);
            let resumed = finish(start(root, &[self.again, &["--resume", "--out", &out]].concat()));
            let killed = ended.status.signal().is_some() || ended.status.code() == Some(130);
            if folder.join("manifest.json").is_file() && resumed.status.code() == Some(2) {
                // It had finished before it was killed.
                let said = String::from_utf8_lossy(&resumed.stderr).into_owned();
                assert!(said.contains("finished"), "{what}: {said}");
                same_results(&what, &folder, &whole);
                continue;
            }
            caught += usize::from(killed);
            assert_eq!(summary(&resumed), wanted, "{what}");
            same_results(&what, &folder, &whole);
            assert!(!folder.join(STATE).exists());
            nothing_on_its_way(&folder);
            // Of what was done nothing is done again.
            let rows = self.rows(&folder);
            assert!(rows.starts_with(&kept), "{what}: {kept:?}");
        }
        println!("{study:?}: {caught} of {kills} caught at work");
        assert!(
            2 * caught >= kills,
            "{study:?}: {caught} of {kills} caught at work"
        );
    }

    /// When each run of a sweep was done.
    fn rows(&self, folder: &Path) -> Vec<std::time::SystemTime> {
        let rows = std::fs::read_to_string(folder.join("rows.jsonl")).unwrap_or_default();
        (0..rows.lines().count())
            .map(|run| folder.join(format!("studies/{run:05}.json")))
            .map(|path| path.metadata().and_then(|m| m.modified()).expect("a manifest"))
            .collect()
    }
}

#[test]
fn a_killed_identification_ends_as_one_that_was_left_alone() {
    Study::new(&["identify", "study.toml"]).kill_and_go_on(6);
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
    Study::new(&study).kill_and_go_on(8);
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
    Study::new(&study).kill_and_go_on(8);
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
    Study::new(&study).kill_and_go_on(6);
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
    Study::new(&study).kill_and_go_on(6);
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
        "160",
        "--backend",
        "simd",
    ];
    Study::new(&study).kill_and_go_on(5);
}

#[test]
fn a_killed_drive_ends_as_one_that_was_left_alone() {
    let study = ["transient", "--line", "line.csv", "--track", "stadium:400:120:14"];
    Study::new(&study).kill_and_go_on(5);
}

#[test]
fn a_killed_run_ends_as_one_that_was_left_alone() {
    let study = ["run", "run.toml", "--no-cache"];
    Study::new(&study).kill_and_go_on(5);
}

/// Rows that are there stay, and what was at work goes on.
#[test]
fn a_killed_sweep_goes_on_with_the_rows_that_it_has() {
    let sweep = Study {
        again: &["sweep", "sweep.toml"],
        marker: "rows.jsonl",
        ..Study::new(&["sweep", "sweep.toml"])
    };
    sweep.kill_and_go_on(6);
}

/// On a device, whose work is cut by the time that it takes: killed, and told to stop.
#[test]
fn runs_on_a_device_that_are_broken_off_end_as_those_that_were_left_alone() {
    if !has_device() {
        return;
    }
    let identify = [
        "identify",
        "study.toml",
        "--backend",
        "gpu",
        "--population",
        "8",
        "--iterations",
        "20",
    ];
    let raceline = [
        "raceline",
        "--track",
        "stadium:300:80:12",
        "--sections",
        "60",
        "--objectives",
        "lap_time",
        "--population",
        "16",
        "--iterations",
        "20",
        "--backend",
        "gpu",
    ];
    for study in [&identify[..], &raceline] {
        for signal in ["-KILL", "-TERM"] {
            let study = Study {
                signal,
                ..Study::new(study)
            };
            study.kill_and_go_on(2);
        }
    }
}
