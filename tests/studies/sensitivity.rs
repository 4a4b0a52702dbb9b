//! The sensitivity study end to end on the bundled lap.

use crate::solve;
use lapswarm::config::settings::Settings;
use lapswarm::study::OwnRange;
use lapswarm::study::framework::state_file::StateFile;
use lapswarm::study::framework::{Study, solve_unobserved, write_results};
use lapswarm::study::identify::{self, IdentifySettings};
use lapswarm::study::sensitivity::{LEVELS, Sensitivity, SensitivitySettings};
use std::ops::ControlFlow;

fn settings() -> SensitivitySettings {
    let base = SensitivitySettings::default();
    let free = base
        .replay
        .free
        .iter()
        .filter(|f| ["rBy1", "rEy2", "K"].contains(&f.name.as_str()));
    SensitivitySettings {
        replay: IdentifySettings {
            free: free.cloned().collect(),
            ..base.replay.clone()
        },
        samples: 32,
        resamples: 50,
        share: 0.02,
        ranges: Vec::new(),
    }
}

/// Ranges of one's own are in place of the free parameters: the values of their steps, the bounds of the indices, traces. A lap feels
/// the roll stiffness in its roll rate, which no log has.
#[test]
fn parameters_go_over_ranges_of_their_own() {
    let range = |name: &str, lower: f64, upper: f64, step: Option<f64>| OwnRange {
        name: name.to_owned(),
        lower,
        upper,
        step,
    };
    let settings = SensitivitySettings {
        ranges: vec![
            range("K", 8e4, 1.2e5, Some(1e4)),
            range("front.lMUy", 0.98, 1.02, None),
        ],
        samples: 8,
        ..settings()
    };
    let setup = Sensitivity::prepare(&settings).expect("the bundled lap");
    let outcome = solve_unobserved::<Sensitivity>(&settings, &setup).expect("it runs");
    assert_eq!(outcome.record.evaluations, 1 + 5 + 2 + 8 * 4);
    assert_eq!(settings.evaluations(), 1 + 5 + 2 + 8 * 4);
    let values: Vec<f64> = outcome.one_at_a_time.iter().map(|row| row.value).collect();
    assert_eq!(values, [8e4, 9e4, 1e5, 1.1e5, 1.2e5, 0.98, 1.02]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let written = write_results::<Sensitivity>(folder.path(), &settings, &setup, &outcome);
    let summary = written.expect("files are written");
    let of = |name: &str| {
        let found = summary.parameters.iter().find(|p| p.name == name);
        found.expect("a parameter")
    };
    const ROLL: &str = "roll_stiffness_nm_per_rad";
    assert_eq!(of(ROLL).range, [8e4, 1.2e5]);
    let roll = |name: &str| of(name).rms_change["roll_rate"].expect("it drives");
    let yaw = |name: &str| of(name).rms_change["yaw_rate"].expect("it drives");
    assert!(roll(ROLL) / yaw(ROLL) > roll("front.lMUy") / yaw("front.lMUy"));
    for file in ["traces_K.svg", "report.html"] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
    let read = SensitivitySettings::read(&folder.path().join("study.toml")).expect("it reads back");
    assert_eq!(read.ranges, settings.ranges);
}

#[test]
fn the_lap_feels_grip_more_than_roll_and_files_say_so() {
    let settings = settings();
    let setup = Sensitivity::prepare(&settings).expect("the bundled lap");
    let outcome = solve_unobserved::<Sensitivity>(&settings, &setup).expect("it runs");
    assert_eq!(outcome.record.evaluations, 1 + 3 * LEVELS.len() as u64 + 32 * 5);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let written = write_results::<Sensitivity>(folder.path(), &settings, &setup, &outcome);
    let summary = written.expect("files are written");
    let ranked: Vec<&str> = summary.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(ranked[0], "rBy1", "{ranked:?}");
    let total = |name: &str| {
        let p = summary
            .parameters
            .iter()
            .find(|p| p.name == name)
            .expect("a parameter");
        p.sobol["ay"].total
    };
    // One parameter that matters far more than the others has nearly all of the variance.
    assert!(
        total("rBy1") > 0.9 && total("rEy2") < 0.1,
        "{} {}",
        total("rBy1"),
        total("rEy2")
    );
    for name in [
        "summary.json",
        "manifest.json",
        "study.toml",
        "sobol.csv",
        "one_at_a_time.csv",
        "sobol.svg",
        "bands.svg",
    ] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
    // The settings that were written are the ones that were used.
    let read = SensitivitySettings::read(&folder.path().join("study.toml")).expect("it reads back");
    assert_eq!(read.replay.free.len(), 3);
    assert_eq!((read.share, read.samples), (0.02, 32));

    // What matters most is handed to an identification, in the bounds that it has for it or else in the range here.
    let identify = IdentifySettings {
        free: read
            .replay
            .free
            .iter()
            .filter(|f| f.name == "rBy1")
            .cloned()
            .collect(),
        free_from: Some(folder.path().to_owned()),
        most: 2,
        ..settings.replay.clone()
    };
    let variables = identify::set_up(&identify)
        .expect("a setup")
        .replay
        .problem
        .variables;
    let found: Vec<(&str, [f64; 2])> = variables
        .iter()
        .map(|v| (v.name.as_str(), [v.lower, v.upper]))
        .collect();
    let second = &summary.parameters[1];
    assert_eq!(
        found,
        [("rBy1", [5.0, 25.0]), (second.name.as_str(), second.range)]
    );
    let study = folder.path().join("study.toml");
    let no_summary = identify::set_up(&IdentifySettings {
        free_from: Some(study),
        ..identify
    });
    let refused = no_summary.err().expect("it is no summary");
    assert!(
        refused.exit_code() == 2 && refused.to_string().contains("study.toml"),
        "{refused}"
    );
}

#[test]
fn a_study_that_is_broken_off_says_so() {
    let settings = settings();
    let setup = Sensitivity::prepare(&settings).expect("the bundled lap");
    let outcome = solve::<Sensitivity>(&settings, &setup, (None, &mut StateFile::idle()), |_| {
        ControlFlow::Break(())
    })
    .expect("it runs")
    .expect("what was found until then");
    assert!(outcome.record.interrupted && outcome.indices.is_empty());
    assert_eq!(outcome.one_at_a_time.len(), 3 * LEVELS.len());
}

#[test]
fn settings_out_of_range_are_named() {
    let base = settings();
    for (bad, place) in [
        (
            SensitivitySettings {
                share: 0.0,
                ..base.clone()
            },
            "share",
        ),
        (
            SensitivitySettings {
                samples: 1,
                ..base.clone()
            },
            "samples",
        ),
    ] {
        let error = bad.validate().expect_err("out of range").to_string();
        assert!(error.contains(place), "{error}");
    }
}
