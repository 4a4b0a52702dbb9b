//! `lapswarm bench optimisers` as its users run it.

use crate::bench;

#[test]
fn rows_as_json() {
    let output = bench(
        "optimisers",
        &[
            "--seeds",
            "2",
            "--problems",
            "zdt6,ackley",
            "--algorithms",
            "default,nsga2",
            "--json",
        ],
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let table: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = table["rows"].as_array().unwrap();
    let names: Vec<(&str, &str)> = rows
        .iter()
        .map(|r| (r["problem"].as_str().unwrap(), r["algorithm"].as_str().unwrap()))
        .collect();
    assert_eq!(
        names,
        [("zdt6", "default"), ("zdt6", "nsga2"), ("ackley", "default")]
    );
    let figure = |row: usize, key: &str| rows[row][key].as_f64().unwrap();
    // The volume under the whole front is 0.6164; NSGA-II is a little slow on this one.
    assert!((0.610..0.6164).contains(&figure(0, "hypervolume_median")));
    assert!((0.58..0.61).contains(&figure(1, "hypervolume_median")));
    assert!(figure(0, "igd_plus_median") < figure(1, "igd_plus_median"));
    // Rounding: four times 2^-46 of the bounds of 32.
    assert!(figure(2, "error_median") < 2e-12 && rows[2]["hypervolume_median"].is_null());
    assert!(rows.iter().all(|r| r["seeds"] == 2));
}

#[test]
fn halves_and_fronts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fronts.csv");
    let mut flags: Vec<&str> =
        "--suites constrained,shifted --half published --seeds 2 --evaluations 2000 --json"
            .split(' ')
            .collect();
    flags.extend(["--algorithms", "default", "--fronts", path.to_str().unwrap()]);
    let output = bench("optimisers", &flags);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let table: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = table["rows"].as_array().unwrap();
    let problems: Vec<&str> = rows.iter().map(|r| r["problem"].as_str().unwrap()).collect();
    let several = ["osy", "welded_beam", "c2_dtlz2"];
    assert_eq!(problems, [several.as_slice(), &["rosenbrock", "ackley"]].concat());
    for row in rows {
        assert_eq!(row["half"], "published");
        assert_eq!(row["feasible_seeds"], 2, "{row}");
        // No formula of these fronts is known to the program.
        assert!(row["igd_plus_median"].is_null());
    }
    // Nothing of one objective; every member has its three or two objectives and the volume of its front.
    let text = std::fs::read_to_string(&path).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("problem,algorithm,seed,hypervolume,f1,f2,f3"));
    let mut seen = std::collections::BTreeSet::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        assert!(cells.len() == 7 && cells[1] == "default", "{line}");
        assert_eq!(cells[6].is_empty(), cells[0] != "c2_dtlz2", "{line}");
        seen.insert((cells[0], cells[2]));
    }
    assert_eq!(seen.len(), 6);
}

#[test]
fn unknown_names_are_refused() {
    for flags in [
        ["--problems", "zdt5"],
        ["--algorithms", "best"],
        ["--suites", "zdt9"],
        ["--half", "third"],
    ] {
        let output = bench("optimisers", &flags);
        assert_eq!(output.status.code(), Some(2));
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            message.contains(flags[0]) && message.contains(flags[1]),
            "{message}"
        );
    }
    assert_eq!(bench("optimisers", &["--seeds", "0"]).status.code(), Some(2));
}
