//! `lapswarm bench studies` as its users run it.

use crate::bench;

#[test]
fn rows_and_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("quality.svg");
    let output = bench(
        "studies",
        &[
            "--populations",
            "20,60",
            "--evaluations",
            "120",
            "--seeds",
            "2",
            "--algorithms",
            "default,nsga2",
            "--sections",
            "120",
            "--backend",
            "simd",
            "--json",
            "--plot",
            picture.to_str().unwrap(),
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
                r["problem"].as_str().unwrap(),
                r["population"].as_u64().unwrap(),
                r["algorithm"].as_str().unwrap(),
            )
        })
        .collect();
    assert_eq!(
        named,
        [
            ("identify", 20, "default"),
            ("identify", 20, "nsga2"),
            ("identify", 60, "default"),
            ("identify", 60, "nsga2"),
            ("raceline", 20, "default"),
            ("raceline", 20, "nsga2"),
            ("raceline", 60, "default"),
            ("raceline", 60, "nsga2"),
        ]
    );
    for row in rows {
        assert_eq!(row["evaluations"], 120);
        let list = |key: &str| -> Vec<f64> {
            let values = row["history"][key].as_array().unwrap();
            values.iter().map(|x| x.as_f64().unwrap()).collect()
        };
        let (evaluations, seconds, volumes) = (list("evaluations"), list("seconds"), list("hypervolume"));
        assert_eq!(evaluations.last(), Some(&120.0));
        assert!(evaluations.is_sorted() && seconds.is_sorted() && seconds.len() == volumes.len());
        // Its archive is not full yet, so that nothing is lost.
        assert!(
            row["algorithm"] != "default" || volumes.is_sorted(),
            "{volumes:?}"
        );
        let reached = row["hypervolume_median"].as_f64().unwrap();
        assert!((0.0..=1.0).contains(&reached) && reached > 0.0, "{row}");
        // The exact lines are among the first candidates.
        assert!(row["problem"] == "identify" || volumes[0] > 0.2, "{volumes:?}");
    }
    let boxes = table["problems"].as_array().unwrap();
    for (problem, variables) in boxes.iter().zip([22, 120]) {
        let list = |key: &str| problem[key].as_array().unwrap().clone();
        assert_eq!(problem["variables"], variables);
        for (ideal, reference) in list("ideal").iter().zip(list("reference")) {
            assert!(ideal.as_f64() < reference.as_f64());
        }
        assert_eq!(list("objectives").len(), 3);
    }
    let drawn = std::fs::read_to_string(picture).unwrap();
    for word in ["identify, population 20", "raceline, population 60", "nsga2"] {
        assert!(drawn.contains(word), "{word}");
    }
}

#[test]
fn unknown_names_are_refused() {
    for flags in [
        ["--problems", "zdt1"],
        ["--algorithms", "best"],
        ["--populations", "3"],
    ] {
        let output = bench("studies", &flags);
        assert_eq!(output.status.code(), Some(2));
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains(flags[0]), "{message}");
    }
}
