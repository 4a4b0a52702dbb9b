//! `lapswarm bench whole` as its users run it.

use crate::bench;

#[test]
fn rows_as_json() {
    let flags = "--populations 64 --generations 1 --backend simd --json";
    let output = bench("whole", &flags.split(' ').collect::<Vec<_>>());
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let table: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = table["rows"].as_array().unwrap();
    let problems: Vec<_> = rows.iter().map(|r| r["problem"].as_str().unwrap()).collect();
    assert_eq!(problems, ["replay", "line", "energy", "drive", "steady"]);
    for row in rows {
        assert_eq!((&row["backend"], &row["swarm"]), (&"simd".into(), &"host".into()));
        assert_eq!(row["population"], 64);
        let figure = |key: &str| row[key].as_f64().unwrap();
        let (whole, kernels) = (figure("generation_ms"), figure("kernel_ms"));
        assert!(0.0 < kernels && kernels < whole, "{row}");
        assert!((figure("outside_kernels_share") - (1.0 - kernels / whole)).abs() < 1e-12);
    }
}

#[test]
fn the_reference_is_refused() {
    let output = bench("whole", &["--backend", "cpu"]);
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains("simd or gpu"), "{message}");
}
