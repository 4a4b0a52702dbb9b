//! Runs that are killed at any point lose nothing, and end as if they had been left alone.

use crate::common::runs::{
    Held, along, finish, moments, nothing_half_written, nothing_on_its_way, same_results, start, summary,
};
use crate::common::{Random, studies};
use lapswarm::files::run_folder::STATE;
use lapswarm::study::registry::STUDIES;
use std::path::Path;

tests! {
    every_study_that_is_killed_ends_as_one_that_was_left_alone: full,
    a_killed_swarm_over_groups_ends_as_one_that_was_left_alone: full,
    a_killed_drive_of_one_line_ends_as_one_that_was_left_alone: full,
    a_killed_sweep_keeps_the_rows_that_it_has: full,
    runs_on_a_device_that_are_broken_off_end_as_those_that_were_left_alone: device full,
}

const STUDY: &str = "section = \"Abbey\"\nbackend = \"simd\"\nhops = 0\n[free]\nK = [3e4, 3e5]\nrBy1 = [8, 30]\n[swarm]\npopulation = 24\n\
                     iterations = 20\n";

/// Runs of two problems, each by itself.
const SWEEP: &str = "study = \"identify\"\n[base]\nsection = \"Abbey\"\npolish = false\nbackend = \"simd\"\n[base.free]\n\
                     K = [3e4, 3e5]\n[base.swarm]\nalgorithm = \"thesis\"\niterations = 10\n[grid]\nnorm = [\"1\", \"2\"]\n\
                     \"swarm.population\" = [8, 12, 16]\nseed = [1, 2]\n";

/// A study, and how it is resumed.
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

    /// Kills it `kills` times at points that are drawn from all that it passes after its first save, resumes it each time, and
    /// holds what it ends with, every file of it, against a run that was left alone.
    fn kill_and_resume(&self, kills: usize) {
        let root = tempfile::tempdir().expect("a temporary folder");
        let root = root.path();
        self.kill_and_resume_in(root, kills);
    }

    /// As [`Study::kill_and_resume`], in a folder that holds what the study reads.
    fn kill_and_resume_in(&self, root: &Path, kills: usize) {
        for (name, text) in [
            ("study.toml", STUDY),
            ("sweep.toml", SWEEP),
            ("line.csv", &along("stadium:400:120:14", 0.01)),
        ] {
            std::fs::write(root.join(name), text).expect("a study");
        }
        let study = self.arguments;
        let whole = root.join("whole");
        let mut alone = Held::start(root, study, "whole", ("none", 0));
        assert!(!alone.is_held());
        let passed = alone.passed();
        // It writes less than what a pipe holds.
        let wanted = summary(&alone.finish());
        let mut random = moments(&study.join(" "));
        for k in 0..kills {
            let (what, out) = self.kill(root, &passed, &mut random, k);
            let folder = root.join(&out);
            let kept = self.rows(&folder);
            let resumed = finish(start(root, &[self.again, &["--resume", "--out", &out]].concat()));
            if folder.join("manifest.json").is_file() && resumed.status.code() == Some(2) {
                // Nothing was left to do.
                let said = String::from_utf8_lossy(&resumed.stderr).into_owned();
                assert!(said.contains("finished"), "{what}: {said}");
                same_results(&what, &folder, &whole);
                continue;
            }
            assert_eq!(summary(&resumed), wanted, "{what}");
            same_results(&what, &folder, &whole);
            assert!(!folder.join(STATE).exists());
            nothing_on_its_way(&folder);
            // Of what was done nothing is done again.
            let rows = self.rows(&folder);
            assert!(rows.starts_with(&kept), "{what}: {kept:?}");
        }
    }

    /// Kills it at a point that is drawn from those that a whole run has `passed`, once there is something to go on with. Says
    /// where that was, and the run's folder.
    fn kill(&self, root: &Path, passed: &[String], random: &mut Random, k: usize) -> (String, String) {
        let (mut first, mut last) = (0, passed.len());
        loop {
            assert!(first < last, "{:?}: no point to kill it at", self.arguments);
            let at = random.within(first as f64, last as f64) as usize;
            let point = &passed[at];
            let number = passed[..=at].iter().filter(|p| *p == point).count();
            let out = format!("killed-{k}-{at}");
            let folder = root.join(&out);
            let mut held = Held::start(root, self.arguments, &out, (point, number));
            if !held.is_held() {
                // Questions while a solver works go by the clock: this time there were fewer.
                held.finish();
                last = at;
                continue;
            }
            held.signal(self.signal);
            if folder.exists() {
                nothing_half_written(&folder);
            }
            if folder.join(self.marker).is_file() || folder.join("manifest.json").is_file() {
                let what = format!("{:?} with {} at {point} {number}", self.arguments, self.signal);
                return (what, out);
            }
            first = at + 1;
        }
    }

    /// When each run of a sweep was done.
    fn rows(&self, folder: &Path) -> Vec<std::time::SystemTime> {
        (0..)
            .map(|run| folder.join(format!("rows/{run:05}.json")))
            .take_while(|path| path.is_file())
            .map(|path| path.metadata().and_then(|m| m.modified()).expect("a row"))
            .collect()
    }
}

fn every_study_that_is_killed_ends_as_one_that_was_left_alone() {
    for &study in STUDIES {
        let root = tempfile::tempdir().expect("a temporary folder");
        let command = studies::command(study, &studies::longer(study.name(), root.path()));
        let arguments: Vec<&str> = command.iter().map(String::as_str).collect();
        Study::new(&arguments).kill_and_resume_in(root.path(), 7);
    }
}

fn a_killed_swarm_over_groups_ends_as_one_that_was_left_alone() {
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
        "20",
        "--backend",
        "simd",
    ];
    Study::new(&study).kill_and_resume(5);
}

fn a_killed_drive_of_one_line_ends_as_one_that_was_left_alone() {
    let study = ["transient", "--line", "line.csv", "--track", "stadium:400:120:14"];
    Study::new(&study).kill_and_resume(5);
}

/// Rows that are there stay, and the others are added.
fn a_killed_sweep_keeps_the_rows_that_it_has() {
    let sweep = Study {
        again: &["sweep", "sweep.toml"],
        marker: "rows/00000.json",
        ..Study::new(&["sweep", "sweep.toml"])
    };
    sweep.kill_and_resume(6);
}

/// On a device, whose work is cut by the time that it takes: killed, and told to stop.
fn runs_on_a_device_that_are_broken_off_end_as_those_that_were_left_alone() {
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
            study.kill_and_resume(2);
        }
    }
}
