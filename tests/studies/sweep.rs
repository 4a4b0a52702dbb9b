//! Sweeps: a grid of small studies, interrupted and resumed.

use lapswarm::hold;
use lapswarm::study::sweep::{RowsRequest, SweepSettings, begin, gather, run_rows, sweep};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

const SWEEP: &str = "study = \"identify\"
[base]
polish = false
[base.free]
K = [3e4, 3e5]
[base.swarm]
algorithm = \"thesis\"
iterations = 2
[grid]
\"swarm.population\" = [4, 6]
norm = [\"1\", \"2\"]
seed = [1, 2]
";

fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    [
        "sweep.csv",
        "medians.csv",
        "sweep.parquet",
        "medians.parquet",
        "rows.jsonl",
        "summary.json",
        "sweep.toml",
    ]
    .map(|name| (name.to_owned(), std::fs::read(folder.join(name)).expect(name)))
    .to_vec()
}

/// The states of the studies of a sweep.
fn states(folder: &Path) -> Vec<PathBuf> {
    let files = std::fs::read_dir(folder.join("studies")).expect("its studies");
    files
        .map(|file| file.expect("a file").path())
        .filter(|path| path.extension().is_some_and(|e| e == "checkpoint"))
        .collect()
}

const LINES: &str = "study = \"raceline\"
[base]
track = \"stadium:300:80:12\"
sections = 60
objectives = [\"gamma\"]
algorithm = \"thesis\"
warm_start = false
local_search = false
backend = \"simd\"
population = 8
iterations = 30
[grid]
seed = [1, 2]
";

/// Two searches for fronts, each with two seeds: what they had reached by what it cost, and their fronts over
/// one another. What the clock says has a file of its own.
#[test]
fn searches_are_set_beside_one_another() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let text = LINES
        .replace("[\"gamma\"]", "[\"length\", \"gamma\"]")
        .replace("algorithm = \"thesis\"\n", "")
        .replace("[grid]", "[grid]\nalgorithm = [\"thesis\", \"nsga2\"]");
    let settings = SweepSettings::parse(Path::new("sweep.toml"), &text).expect("a sweep");
    let folder = root.path().join("fronts");
    let summary = sweep(&settings, &folder, false, |_| ControlFlow::Continue(())).expect("it runs");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect(name);
    let rows: Vec<Vec<f64>> = read("convergence.csv")
        .lines()
        .skip(1)
        .map(|line| {
            line.split(',')
                .map(|cell| cell.parse().expect("a number"))
                .collect()
        })
        .collect();
    for run in 0..4 {
        let own: Vec<&Vec<f64>> = rows.iter().filter(|row| row[0] == f64::from(run)).collect();
        // After the first of thirty iterations, and after each twenty-fourth of them.
        assert_eq!(own.len(), 25);
        for two in own.windows(2) {
            assert!(two[1][1] > two[0][1] && two[1][2] >= two[0][2], "{two:?}");
        }
        let (last, row) = (own[24], &summary.rows[run as usize]);
        // NSGA-II keeps eight members, and may lose a little of what they had.
        assert!(last[3] > own[0][3] - 0.02, "{own:?}");
        // The mutants of the published swarm are evaluated beside its particles.
        assert!(last[1] >= 240.0);
        // Thirty iterations over every cross-section leave the published swarm beyond the point that volumes go up to.
        let least = if row.settings["algorithm"] == "nsga2" {
            0.5
        } else {
            0.0
        };
        assert!((least..1.0 + 1e-9).contains(&last[3]), "{last:?}");
        assert!(row.figures["hypervolume_share"].is_some_and(|share| share >= 0.0));
    }
    assert_eq!(read("times.csv").lines().count(), 5);
    let page = read("report.html");
    for told in [
        "What was reached by what it cost",
        "Fronts over one another",
        "hypervolume share",
        "length, by the swarm",
    ] {
        assert!(page.contains(told), "{told}");
    }
    for picture in ["convergence.svg", "fronts.svg", "medians.svg"] {
        assert!(read(picture).contains("<svg"), "{picture}");
    }
}

/// A line's study within a sweep goes on from where it was; from another's state, or from none that can be read, it does not.
#[test]
fn the_study_at_work_is_resumed_and_foreign_states_are_not_trusted() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let settings = SweepSettings::parse(Path::new("sweep.toml"), LINES).expect("a sweep");
    let whole = root.path().join("whole");
    sweep(&settings, &whole, false, |_| ControlFlow::Continue(())).expect("it runs");
    let broken_off = |name: &str| {
        let part = root.path().join(name);
        let mut told = 0;
        let broken = sweep(&settings, &part, false, |p| {
            told += usize::from(p.done == 1);
            if told > 20 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        assert_eq!(broken.expect_err("broken off").exit_code(), 130);
        let kept = states(&part);
        assert_eq!(kept.len(), 1);
        (part, kept[0].clone())
    };
    let (part, kept) = broken_off("part");
    let mut told = 0;
    sweep(&settings, &part, true, |p| {
        told += usize::from(p.done == 1);
        ControlFlow::Continue(())
    })
    .expect("it goes on");
    assert_eq!(files(&part), files(&whole));
    // Thirty iterations are thirty words, of which most were said before.
    assert!(told < 20, "told {told} times");
    assert!(!kept.exists());

    let (part, kept) = broken_off("garbled");
    std::fs::write(&kept, b"no state at all").expect("room");
    sweep(&settings, &part, true, |_| ControlFlow::Continue(())).expect("it begins anew");
    assert_eq!(files(&part), files(&whole));

    // The state of the same study with another seed.
    let (part, kept) = broken_off("foreign");
    let other = SweepSettings::parse(Path::new("sweep.toml"), &LINES.replace("[1, 2]", "[7, 8]"));
    let mut told = 0;
    let elsewhere = root.path().join("elsewhere");
    let _ = sweep(&other.expect("a sweep"), &elsewhere, false, |p| {
        told += usize::from(p.done == 1);
        if told > 20 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    std::fs::copy(&states(&elsewhere)[0], &kept).expect("room");
    sweep(&settings, &part, true, |_| ControlFlow::Continue(())).expect("it begins anew");
    assert_eq!(files(&part), files(&whole));
}

#[test]
#[ignore = "full tier: eleven sweeps"]
fn an_interrupted_and_resumed_sweep_is_the_same_to_the_byte() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let settings = SweepSettings::parse(Path::new("sweep.toml"), SWEEP).expect("a sweep");
    let whole = root.path().join("whole");
    let summary = sweep(&settings, &whole, false, |_| ControlFlow::Continue(())).expect("it runs");
    assert_eq!((summary.rows.len(), summary.groups.len()), (8, 4));
    assert!(
        summary
            .rows
            .iter()
            .all(|r| r.figures["best_cost"].is_some_and(f64::is_finite))
    );
    // Broken off at the n-th word from it about a run, be it before the run or within it. Runs of one problem go together, here
    // the four of each norm.
    for (run, stop) in [(0usize, 1usize), (0, 2), (4, 1), (4, 2), (4, 3)] {
        let part = root.path().join(format!("part{run}_{stop}"));
        let mut told = 0;
        let broken = sweep(&settings, &part, false, |p| {
            told += usize::from(p.done == run as u64);
            if told >= stop {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        assert_eq!(
            broken.expect_err("broken off").exit_code(),
            130,
            "after {run} and {stop}"
        );
        // Those at work have left their states, which the rows make needless.
        assert_eq!(states(&part).is_empty(), stop == 1, "after {run} and {stop}");
        sweep(&settings, &part, true, |_| ControlFlow::Continue(())).expect("it goes on");
        assert_eq!(files(&part), files(&whole), "after {run} and {stop}");
        assert!(states(&part).is_empty());
    }
    let other =
        SweepSettings::parse(Path::new("sweep.toml"), &SWEEP.replace("[4, 6]", "[4]")).expect("a sweep");
    let refused = sweep(&other, &whole, true, |_| ControlFlow::Continue(()));
    assert_eq!(refused.expect_err("another sweep").exit_code(), 2);
}

#[test]
fn a_mistake_in_the_last_point_shows_before_the_first_is_run() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let text = SWEEP.replace("[4, 6]", "[4, -6]");
    let settings = SweepSettings::parse(Path::new("sweep.toml"), &text).expect("a sweep");
    let mut told = 0;
    let folder = root.path().join("s");
    let refused = sweep(&settings, &folder, false, |_| {
        told += 1;
        ControlFlow::Continue(())
    });
    let refused = refused.expect_err("a negative population");
    assert_eq!(refused.exit_code(), 2);
    assert_eq!(told, 0);
    // Of the file that the user wrote, and the point in it.
    let said = refused.to_string();
    assert!(
        said.starts_with("sweep.toml: run 3 (norm 1, seed 1, swarm.population -6), field"),
        "{said}"
    );
    assert!(!folder.exists(), "nothing was begun");
}

#[test]
fn a_sweep_that_fails_leaves_nothing_that_stops_the_next() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = root.path().join("s");
    // A log that is not there shows when the first point is set up.
    let text = SWEEP.replace("polish = false", "polish = false\nlog = \"nowhere.csv\"");
    let settings = SweepSettings::parse(Path::new("sweep.toml"), &text).expect("a sweep");
    let failed = sweep(&settings, &folder, false, |_| ControlFlow::Continue(()));
    assert_eq!(failed.expect_err("no log").exit_code(), 2);
    let left: Vec<_> = folder.read_dir().expect("a folder").flatten().collect();
    assert!(left.is_empty(), "{left:?}");
    let settings = SweepSettings::parse(Path::new("sweep.toml"), SWEEP).expect("a sweep");
    sweep(&settings, &folder, false, |_| ControlFlow::Continue(())).expect("the mended one runs");
}

#[test]
fn sweeps_beyond_all_measure_are_refused() {
    let runs = "[1,2,3,4,5,6,7,8,9,10]";
    let many: String = ["a", "b", "c", "d", "e", "f"]
        .iter()
        .map(|k| format!("{k} = {runs}\n"))
        .collect();
    let deep = format!("\"{}\" = [1]\n", ["a"; 100_000].join("."));
    // Each a small file; the studies of the second would fill 400 MB.
    let long = format!("# {}\n", "long ".repeat(8000));
    let four: String = ["a", "b", "c", "d"]
        .iter()
        .map(|k| format!("{k} = {runs}\n"))
        .collect();
    for (grid, word) in [
        (many, "1000000 runs"),
        (four + &long, "10000 runs of"),
        (deep, "a.a.a"),
    ] {
        let text = format!("study = \"identify\"\n[grid]\n{grid}");
        let refused = SweepSettings::parse(Path::new("s.toml"), &text).expect_err(word);
        assert!(refused.to_string().contains(word), "{refused}");
        assert!(refused.to_string().len() < 500);
    }
}

/// What a Parquet file holds, as the CSV beside it has it.
fn parquet_as_csv(path: &Path) -> String {
    let file = std::fs::File::open(path).expect("a file");
    let reader = SerializedFileReader::new(file).expect("a Parquet file");
    let schema = reader.metadata().file_metadata().schema_descr();
    let mut table = csv::Writer::from_writer(Vec::new());
    let names = schema.columns().iter().map(|column| column.name());
    table.write_record(names).expect("a head");
    for row in reader.get_row_iter(None).expect("rows") {
        let row = row.expect("a row");
        let cells = row.get_column_iter().map(|(_, cell)| match cell {
            Field::Str(text) => text.clone(),
            Field::Double(number) => number.to_string(),
            Field::Null => String::new(),
            other => panic!("{other} is no text and no number"),
        });
        table.write_record(cells).expect("a row");
    }
    String::from_utf8(table.into_inner().expect("a table")).expect("text")
}

#[test]
fn figures_of_all_objectives_have_their_columns() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let text = "study = \"raceline\"
[base]
track = \"stadium:200:60:12\"
sections = 40
warm_start = false
local_search = false
algorithm = \"thesis\"
population = 8
iterations = 2
[grid]
objectives = [[\"length\"], [\"gamma\"]]
seed = [1, 2]
";
    let settings = SweepSettings::parse(Path::new("sweep.toml"), text).expect("a sweep");
    let folder = root.path().join("lines");
    sweep(&settings, &folder, false, |_| ControlFlow::Continue(())).expect("it runs");
    for (file, ending) in [("sweep.csv", ""), ("medians.csv", "_median")] {
        let table = std::fs::read_to_string(folder.join(file)).expect(file);
        let head = table.lines().next().expect("a head");
        for name in ["best_length_m", "best_gamma_1pm"] {
            let name = format!("{name}{ending}");
            assert!(head.split(',').any(|column| column == name), "{file}: {head}");
        }
        assert_eq!(
            parquet_as_csv(&folder.join(file).with_extension("parquet")),
            table
        );
    }
}

/// A circuit by a survey of its own, a bundled car by a file, and a sweep of its lines.
fn sweep_of_files(folder: &Path) -> SweepSettings {
    let cars = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/cars");
    for file in cars.read_dir().expect("the cars").flatten() {
        std::fs::copy(file.path(), folder.join(file.file_name())).expect("room");
    }
    let on = |i: usize| std::f64::consts::TAU * i as f64 / 120.0;
    let points = (0..120).map(|i| format!("{:.3},{:.3},12\n", 150.0 * on(i).cos(), 100.0 * on(i).sin()));
    let survey = format!("x_m,y_m,width_m\n{}", points.collect::<String>());
    std::fs::write(folder.join("survey.csv"), survey).expect("room");
    std::fs::write(folder.join("track.toml"), "survey = \"survey.csv\"\n").expect("room");
    let text = LINES.replace("stadium:300:80:12\"", "track.toml\"\ncar = \"gt.toml\"");
    SweepSettings::parse(&folder.join("sweep.toml"), &text).expect("a sweep")
}

#[test]
fn a_sweep_whose_files_have_changed_is_not_resumed() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let settings = sweep_of_files(root.path());
    let folder = root.path().join("s");
    let broken = sweep(&settings, &folder, false, |p| match p.done {
        0 => ControlFlow::Continue(()),
        _ => ControlFlow::Break(()),
    });
    assert_eq!(broken.expect_err("broken off").exit_code(), 130);
    for name in ["gt.toml", "gt_slick.tir", "track.toml", "survey.csv"] {
        let file = root.path().join(name);
        let before = std::fs::read_to_string(&file).expect(name);
        let refused = |change: &str| {
            let refused = sweep(&settings, &folder, true, |_| ControlFlow::Continue(()));
            let refused = refused.expect_err(change);
            assert_eq!(refused.exit_code(), 2);
            let said = refused.to_string();
            assert!(
                said.contains(name) && said.contains("begin anew"),
                "{change}: {said}"
            );
        };
        std::fs::write(&file, format!("{before}\n")).expect("room");
        refused("another file");
        std::fs::remove_file(&file).expect("it goes");
        refused("no file");
        std::fs::write(&file, before).expect("room");
    }
    let summary = sweep(&settings, &folder, true, |_| ControlFlow::Continue(())).expect("as it was");
    assert_eq!(summary.rows.len(), 2);
}

#[test]
fn a_file_that_changes_while_a_sweep_runs_ends_it() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let settings = sweep_of_files(root.path());
    let text = settings.text().replace("[grid]", "[grid]\nsections = [60, 64]");
    let settings = SweepSettings::parse(
        &root.path().join("sweep.toml"),
        &text.replace("sections = 60\n", ""),
    );
    let car = root.path().join("gt.toml");
    let ended = sweep(&settings.expect("a sweep"), &root.path().join("s"), false, |p| {
        if p.done >= 1 {
            let text = std::fs::read_to_string(&car).expect("the car");
            std::fs::write(&car, text + "\n").expect("room");
        }
        ControlFlow::Continue(())
    });
    let said = ended.expect_err("two cars in one sweep").to_string();
    assert!(said.contains("gt.toml"), "{said}");
}

/// A process that works on rows of the sweep of lines in `folder`, and writes what it passes to `passed`. It is held at `point`.
fn process(folder: &Path, flags: &[&str], passed: &str, point: (&str, usize)) -> Child {
    std::fs::write(
        folder.join("lines.toml"),
        LINES.replace("[1, 2]", "[1, 2, 3, 4, 5, 6]"),
    )
    .expect("room");
    let (name, number) = point;
    Command::new(env!("CARGO_BIN_EXE_lapswarm"))
        .args(["sweep", "lines.toml", "--out", "s", "--json", "--quiet"])
        .args(flags)
        .current_dir(folder)
        .env(
            hold::VARIABLE,
            format!("{name}:{number}:{}", folder.join(passed).display()),
        )
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts")
}

/// What a process prints, whose exit code is `code`.
fn told(process: Child, code: i32) -> Value {
    let output = process.wait_with_output().expect("it ends");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{errors}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {errors}"))
}

/// How many files a process has written, but for states, which are saved by the clock.
fn written(folder: &Path, passed: &str) -> usize {
    let text = std::fs::read_to_string(folder.join(passed)).expect("what it passed");
    let count = |point: &str| text.lines().filter(|line| *line == point).count();
    count("placed") - count("saved")
}

#[test]
fn two_processes_share_the_rows_and_do_none_twice() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let root = root.path();
    let [alone, shared] = ["alone", "shared"].map(|name| root.join(name));
    for folder in [&alone, &shared] {
        std::fs::create_dir(folder).expect("a folder");
    }
    let part = told(process(&alone, &["--rows", ".."], "passed", ("none", 0)), 0);
    let whole = json!({"study": "sweep", "rows": {"start": 0, "end": 6}, "finished": 6, "failed_runs": [],
                       "elsewhere": [], "ended_by": null});
    assert_eq!(part, whole);
    let both = ["one", "other"].map(|name| process(&shared, &["--rows", ".."], name, ("none", 0)));
    for process in both {
        assert_eq!(told(process, 0)["failed_runs"], json!([]));
    }
    // Every file of one process is written by one of two.
    assert_eq!(
        written(&shared, "one") + written(&shared, "other"),
        written(&alone, "passed")
    );
    for folder in [&alone, &shared] {
        assert!(
            !folder.join("s/summary.json").exists(),
            "tables are made when they are asked for"
        );
        let summary = told(process(folder, &["--gather"], "gather", ("none", 0)), 0);
        assert_eq!(summary["rows"].as_array().map(Vec::len), Some(6));
        assert!(!folder.join("s/.lock").exists());
    }
    assert_eq!(files(&shared.join("s")), files(&alone.join("s")));
    let row: Value = serde_json::from_slice(&std::fs::read(shared.join("s/rows/00003.json")).expect("a row"))
        .expect("an object");
    assert_eq!(
        (&row["run"], &row["exit_code"], &row["log"]),
        (&json!(3), &json!(0), &json!([]))
    );
    assert!(row["elapsed_s"].as_f64().is_some_and(|s| s > 0.0) && row["machine"].is_string());
}

#[test]
fn the_claim_of_a_killed_process_blocks_nobody() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let root = root.path();
    // Within its first run.
    let mut first = process(root, &[], "first", ("step", 12));
    let held = || {
        std::fs::read_to_string(root.join("first"))
            .unwrap_or_default()
            .ends_with("held\n")
    };
    while !held() {
        assert!(first.try_wait().expect("its state").is_none(), "it was not held");
        std::thread::sleep(Duration::from_millis(2));
    }
    let part = told(process(root, &["--rows", "0..3"], "second", ("none", 0)), 0);
    assert_eq!((&part["finished"], &part["elsewhere"]), (&json!(2), &json!([0])));
    let summary = told(process(root, &["--gather"], "gather", ("none", 0)), 0);
    assert_eq!(summary["missing_runs"], 4);
    assert_eq!(summary["rows"].as_array().map(Vec::len), Some(2));
    // Another sweep is not mixed in, nor is another run.
    std::fs::write(root.join("other.toml"), LINES).expect("room");
    for command in [
        &["sweep", "other.toml", "--resume"][..],
        &["sweep", "lines.toml"],
        &["identify"],
    ] {
        let refused = Command::new(env!("CARGO_BIN_EXE_lapswarm"))
            .args(command)
            .args(["--out", "s"])
            .current_dir(root)
            .output();
        assert_eq!(refused.expect("it starts").status.code(), Some(2), "{command:?}");
    }
    first.kill().expect("it is killed");
    first.wait().expect("it ends");
    let whole = told(process(root, &["--resume"], "third", ("none", 0)), 0);
    assert_eq!(whole["rows"].as_array().map(Vec::len), Some(6));
    assert_eq!(whole["missing_runs"], Value::Null);
    let left = root.join("s/rows").read_dir().expect("rows").flatten();
    let left: Vec<_> = left
        .map(|e| e.path())
        .filter(|p| p.extension().is_none_or(|e| e != "json"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn a_sweep_ends_in_time_and_goes_on() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let settings = SweepSettings::parse(Path::new("sweep.toml"), LINES).expect("a sweep");
    let folder = root.path().join("s");
    begin(&settings, &folder).expect("begun");
    let part = |rows, time_limit| {
        let asked = RowsRequest {
            rows,
            to_the_end: true,
            time_limit,
            stop: Arc::default(),
            observe: &mut |_| ControlFlow::Continue(()),
        };
        run_rows(&settings, &folder, asked)
    };
    let none = part(0..2, Some(Duration::ZERO)).expect("no error");
    assert_eq!((none.finished, none.ended_by.as_deref()), (0, Some("time_limit")));
    let second = part(1..9, None).expect("there is one");
    assert_eq!((second.rows, second.finished, second.ended_by), (1..2, 1, None));
    let refused = part(2..3, None).expect_err("there is none").to_string();
    assert!(refused.contains("rows of 0..2"), "{refused}");
    let some = gather(&settings, &folder).expect("tables");
    assert_eq!((some.rows.len(), some.rows[0].run, some.missing_runs), (1, 1, 1));
    let whole = sweep(&settings, &folder, true, |_| ControlFlow::Continue(())).expect("the rest");
    assert_eq!((whole.rows.len(), whole.missing_runs), (2, 0));
}

#[test]
fn a_run_that_fails_is_a_row_that_says_why_and_stops_no_other() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let text = LINES
        .replace("[grid]", "[grid]\nsections = [8, 60]")
        .replace("sections = 60\n", "");
    let text = text
        .replace("[1, 2]", "[1]")
        .replace("iterations = 30", "iterations = 1");
    let settings = SweepSettings::parse(Path::new("sweep.toml"), &text).expect("a sweep");
    let folder = root.path().join("s");
    // A failed run is tried again by the next process.
    for resume in [false, true] {
        let mut done = Vec::new();
        let summary = sweep(&settings, &folder, resume, |p| {
            done.push(p.done);
            ControlFlow::Continue(())
        });
        let summary = summary.expect("the other run");
        assert_eq!(done.first(), Some(&u64::from(resume)));
        assert_eq!(
            (summary.rows.len(), summary.rows[0].run, summary.missing_runs),
            (1, 1, 0)
        );
        let [why] = &summary.failed_runs[..] else {
            panic!("{:?}", summary.failed_runs)
        };
        assert!(
            why.starts_with("run 00000 failed: ") && why.contains("leaves the road"),
            "{why}"
        );
        let row: Value =
            serde_json::from_slice(&std::fs::read(folder.join("rows/00000.json")).expect("a row"))
                .expect("an object");
        assert_eq!((&row["exit_code"], &row["figures"]), (&json!(1), &json!({})));
    }
}
