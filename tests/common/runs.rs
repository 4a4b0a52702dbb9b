//! Running the program, breaking it off, and holding what it leaves against what it should have left.

use super::Random;
use lapswarm::hold::{self, Point};
use lapswarm::study::raceline::{RacelineSettings, set_up};
use lapswarm::study::registry::STUDIES;
use lapswarm::vehicle::Car;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// The environment variable that gives the seed of the moments at which runs are killed.
const SEED_VARIABLE: &str = "KILL_SEED";

/// Moments drawn at random, each time others unless the seed is given; it is printed.
pub fn moments(study: &str) -> Random {
    let given = std::env::var(SEED_VARIABLE).ok().and_then(|s| s.parse().ok());
    let seed: u64 = given.unwrap_or_else(|| {
        let since = std::time::SystemTime::UNIX_EPOCH.elapsed().expect("a clock");
        since.as_nanos() as u64
    });
    println!("{study}: {SEED_VARIABLE}={seed}");
    Random(seed)
}

/// The line that a held program writes.
const HELD: &str = "held";

fn program(folder: &Path, arguments: &[&str]) -> Command {
    let saves: &[&str] = match arguments[0] {
        // Keeps every row as it comes.
        "sweep" => &[],
        _ => &["--save-every-s", "0"],
    };
    let mut program = Command::new(env!("CARGO_BIN_EXE_lapswarm"));
    program
        .args(arguments)
        .args(["--json", "--quiet"])
        .args(saves)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    program
}

pub fn start(folder: &Path, arguments: &[&str]) -> Child {
    program(folder, arguments).spawn().expect("the program starts")
}

pub fn finish(child: Child) -> Output {
    child.wait_with_output().expect("the program ends")
}

pub fn summary(output: &Output) -> Value {
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
pub fn timeless(summary: Value) -> Value {
    match summary {
        Value::Object(fields) => fields
            .into_iter()
            .filter(|(key, _)| {
                // Nor with what a run found done: one that goes on finds more.
                key != "reused"
                    && key != "longest_dispatch_ms"
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

/// A run that is held at a point, as `lapswarm::hold` has them.
pub struct Held {
    child: Child,
    /// What it has passed.
    passed: PathBuf,
}

impl Held {
    /// Begins a study in `folder` that is held when it passes `point` for the `number`-th time; never if that is 0.
    pub fn start(folder: &Path, study: &[&str], out: &str, (point, number): (&str, usize)) -> Self {
        let passed = folder.join(format!("{out}.passed"));
        let child = program(folder, &[study, &["--out", out]].concat())
            .env(hold::VARIABLE, format!("{point}:{number}:{}", passed.display()))
            .spawn()
            .expect("the program starts");
        Self { child, passed }
    }

    /// The points that it has passed until now.
    pub fn passed(&self) -> Vec<String> {
        let text = std::fs::read_to_string(&self.passed).unwrap_or_default();
        text.lines().map(str::to_owned).collect()
    }

    /// Waits until it is held, or until it ends without having been; whether it is.
    pub fn is_held(&mut self) -> bool {
        // No run here takes a tenth of this on any machine: a guard against waiting for ever.
        let limit = Instant::now() + Duration::from_secs(1200);
        loop {
            let ended = self.child.try_wait().expect("its state").is_some();
            if self.passed().iter().any(|line| line == HELD) {
                return true;
            }
            if ended {
                return false;
            }
            assert!(
                Instant::now() < limit,
                "neither held nor ended: {:?}",
                self.passed
            );
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Sends it a signal and waits for its end; with how many steps it and its solvers took after that.
    pub fn signal(self, signal: &str) -> (Output, usize) {
        // The shell's own: a bare machine has no program of that name.
        let told = Command::new("sh")
            .args(["-c", &format!("kill {signal} {}", self.child.id())])
            .status();
        assert!(told.expect("kill").success());
        let passed = self.passed.clone();
        let ended = finish(self.child);
        let text = std::fs::read_to_string(passed).expect("what it passed");
        let after = text.lines().skip_while(|line| *line != HELD);
        let steps = [Point::Step, Point::Solver].map(Point::name);
        (ended, after.filter(|line| steps.contains(line)).count())
    }

    /// Waits for its end.
    pub fn finish(self) -> Output {
        finish(self.child)
    }
}

/// Whether a file waits to be put in the place of another, which a lock does not.
fn on_its_way(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with('.') && name != ".lock" || name.ends_with(".part")
}

/// No file of a folder is part of one, but for those on their way.
pub fn nothing_half_written(folder: &Path) {
    for entry in folder.read_dir().expect("a folder").flatten() {
        let path = entry.path();
        let name = path.display();
        // The stages of a run.
        if path.is_dir() {
            nothing_half_written(&path);
            continue;
        }
        let locks = path.ends_with(".lock") || path.extension().is_some_and(|e| e == "lock");
        if on_its_way(&path) || locks {
            continue;
        }
        let bytes = std::fs::read(&path).expect("a file");
        let text = || std::str::from_utf8(&bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        let json =
            |text: &str| drop(serde_json::from_str::<Value>(text).unwrap_or_else(|e| panic!("{name}: {e}")));
        match path.extension().and_then(|e| e.to_str()) {
            Some("json") => json(text()),
            Some("jsonl") => {
                assert!(text().is_empty() || text().ends_with('\n'), "{name}");
                text().lines().for_each(json);
            }
            Some("toml") => {
                drop(toml::from_str::<toml::Table>(text()).unwrap_or_else(|e| panic!("{name}: {e}")))
            }
            Some("csv" | "txt") => assert!(bytes.ends_with(b"\n"), "{name}"),
            Some("svg") => assert!(text().trim_end().ends_with("</svg>"), "{name}"),
            Some("html") => assert!(text().trim_end().ends_with("</html>"), "{name}"),
            Some("parquet") => {
                let both = bytes.len() > 8 && bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1");
                assert!(both, "{name}");
            }
            Some("lapswarm" | "checkpoint") => {
                let is_whole = STUDIES.iter().any(|study| study.read_state(&path).is_ok());
                assert!(is_whole, "{name} is no whole state");
            }
            // Every car's tyres here are the bundled ones with other figures.
            Some("tir") => {
                let key = |text: &str| {
                    let last = text.lines().next_back().unwrap_or_default();
                    last.split_once('=').map(|(key, _)| key.trim().to_owned())
                };
                let whole = text().ends_with('\n') && key(text()) == key(Car::BUNDLED_TYRE);
                assert!(whole, "{name}");
            }
            // The mark of a stage of a run that is whole.
            None if path.ends_with("done") => json(text()),
            other => panic!("{name}: nobody knows what a whole one is ({other:?})"),
        }
    }
}

/// A table without the columns that the clock fills.
fn without_times(table: &str) -> String {
    let mut kept: Vec<usize> = Vec::new();
    let mut text = String::new();
    for (number, line) in table.lines().enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        if number == 0 {
            kept = (0..cells.len())
                .filter(|i| !cells[*i].contains("elapsed"))
                .collect();
        }
        let cells: Vec<&str> = kept.iter().map(|i| cells[*i]).collect();
        text += &(cells.join(",") + "\n");
    }
    text
}

/// All results in a folder and those below it that do not depend on the clock, by their names: tables, cars and settings, and
/// pictures but for those of how the search went on and those that say how long it took.
pub fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn gather(folder: &Path, below: &str, results: &mut BTreeMap<String, Vec<u8>>) {
        for entry in folder.read_dir().expect("a folder").flatten() {
            let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
            let place = format!("{below}{name}");
            if path.is_dir() {
                gather(&path, &format!("{place}/"), results);
                continue;
            }
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
            if !["csv", "toml", "tir", "svg", "parquet", "jsonl"].contains(&extension) {
                continue;
            }
            let mut bytes = std::fs::read(&path).expect("a file");
            let of_the_clock = ["traces.svg", "times.csv"].contains(&&*name);
            if of_the_clock || name.contains("convergence") && extension != "csv" {
                continue;
            }
            if name.contains("convergence") {
                bytes = without_times(&String::from_utf8_lossy(&bytes)).into_bytes();
            }
            results.insert(place, bytes);
        }
    }
    let mut found = BTreeMap::new();
    gather(folder, "", &mut found);
    // Stages of a run name the files of those before them.
    let own = folder.display().to_string();
    for (name, bytes) in &mut found {
        if name.ends_with(".toml") {
            *bytes = String::from_utf8_lossy(bytes).replace(&own, "RUN").into_bytes();
        }
    }
    found
}

/// The results in a folder are those in another, to the byte.
pub fn same_results(what: &str, found: &Path, wanted: &Path) {
    let (found, wanted) = (results(found), results(wanted));
    let names = |r: &BTreeMap<String, Vec<u8>>| r.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&found), names(&wanted), "{what}");
    assert!(!wanted.is_empty(), "{what}");
    for (name, bytes) in &wanted {
        assert!(found[name] == *bytes, "{what}: another {name}");
    }
}

/// Nothing that a run has on its way is left in its folder.
pub fn nothing_on_its_way(folder: &Path) {
    let left = folder.read_dir().expect("a folder").flatten();
    let left: Vec<_> = left.map(|e| e.path()).filter(|p| on_its_way(p)).collect();
    assert!(left.is_empty(), "{left:?}");
}

/// A line at a share of a road's width from the right, as `transient` reads one. At its edge many shares of the grip are tried
/// until one is held.
pub fn along(track: &str, alpha: f64) -> String {
    let setup = set_up(&RacelineSettings {
        track: track.to_owned(),
        sections: Some(200),
        ..RacelineSettings::default()
    })
    .expect("a track");
    let points = setup
        .cross_sections
        .points(&vec![alpha; setup.cross_sections.len()]);
    let rows = points.iter().map(|p| format!("{},{}\n", p.x, p.y));
    format!("x_m,y_m\n{}", rows.collect::<String>())
}
