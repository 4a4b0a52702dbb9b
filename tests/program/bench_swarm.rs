//! `lapswarm bench swarm` as its users run it.

use crate::bench;

#[test]
fn rows_as_json() {
    let output = bench(
        "swarm",
        &[
            "--populations",
            "200,5000",
            "--repeats",
            "1",
            "--generations",
            "15",
            "--backend",
            "simd",
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
    let named: Vec<_> = rows
        .iter()
        .map(|r| {
            (
                r["backend"].as_str().unwrap(),
                r["problem"].as_str().unwrap(),
                r["population"].as_u64().unwrap(),
            )
        })
        .collect();
    assert_eq!(
        named,
        [
            ("cpu", "zdt1", 200),
            ("simd", "zdt1", 5000),
            ("cpu", "dtlz2", 200),
            ("simd", "dtlz2", 5000)
        ]
    );
    for row in rows {
        let figure = |key: &str| row[key].as_f64().unwrap();
        assert!(figure("generation_ms") > 0.0 && figure("slowest_generation_ms") >= figure("generation_ms"));
        assert_eq!(row["variables"], 12);
    }
    // 12 variables and m objectives of four bytes each.
    assert_eq!(rows[1]["bytes_per_particle"], 4 * (3 * 12 + 2));
    assert!(rows[3]["hypervolume"].as_f64().unwrap() > 0.74);
    assert_eq!(table["growth"].as_array().unwrap().len(), 2);
}

#[test]
fn unknown_problems_are_refused() {
    for name in ["zdt5", "sphere"] {
        let output = bench("swarm", &["--problems", name]);
        assert_eq!(output.status.code(), Some(2));
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            message.contains("--problems") && message.contains(name),
            "{message}"
        );
    }
}
