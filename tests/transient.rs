//! A line driven by the 4DOF car, and the whole way from a log to a lap.

use lapswarm::evaluate::BackendChoice;
use lapswarm::evaluate::line::LineObjective;
use lapswarm::study::identify::{Algorithm, IdentifySettings};
use lapswarm::study::memory::USUAL_MIB;
use lapswarm::study::raceline::{RacelineSettings, set_up};
use lapswarm::study::run::{Means, RunSettings, prepare, run};
use lapswarm::study::transient::{
    AGREEMENT, NamedLine, PopulationSettings, TransientSettings, drive_line, drive_population, read_line,
    summarise, summarise_population, table_of, write_population, write_results,
};
use lapswarm::vehicle::Car;
use std::ops::ControlFlow;
use std::time::Duration;

fn stadium() -> lapswarm::study::raceline::Setup {
    set_up(&RacelineSettings {
        track: "stadium:400:120:14".to_owned(),
        sections: 200,
        ..RacelineSettings::default()
    })
    .expect("a stadium")
}

#[test]
fn the_car_drives_a_line_as_fast_as_the_point_mass() {
    let setup = stadium();
    let car = Car::bundled().expect("the bundled car");
    let points = setup.cuts.points(&setup.cuts.reference);
    let edges = [setup.edges_m[0].as_slice(), setup.edges_m[1].as_slice()];
    let outcome =
        drive_line(&car, &setup.car, &points, edges, &TransientSettings::default()).expect("it drives");
    assert!(
        outcome.disagreement().abs() <= AGREEMENT,
        "{}",
        outcome.disagreement()
    );
    assert!(outcome.margin_m > 0.0, "{}", outcome.margin_m);
    assert!(outcome.grip_share > 0.7, "{}", outcome.grip_share);
    // The time is that of the samples: speeds integrated over the lap give its length.
    let driven: f64 = outcome.drive.states.iter().map(|s| s[0].hypot(s[1]) * 0.01).sum();
    let length = outcome.line.length_m;
    assert!((driven / length - 1.0).abs() < 0.005, "{driven} and {length}");

    let folder = tempfile::tempdir().expect("a temporary folder");
    let summary = summarise("gt", &outcome, 1.0);
    let words = summary.to_text();
    assert!(
        summary.agrees && words.contains("Chosen: the greatest share of the grip"),
        "{words}"
    );
    write_results(folder.path(), &outcome, &summary).expect("files are written");
    for name in [
        "drive.csv",
        "speeds.svg",
        "map.svg",
        "envelope_driven.csv",
        "summary.json",
    ] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
}

/// Set-ups on two lines: the fastest within the edges comes first, the car as it is on a line laps as that line driven alone
/// with the same share of the grip, and a search can be broken off.
#[test]
fn set_ups_and_lines_are_driven_all_at_once() {
    let setup = stadium();
    let car = Car::bundled().expect("the bundled car");
    let edges = [setup.edges_m[0].as_slice(), setup.edges_m[1].as_slice()];
    let middle = setup.cuts.points(&setup.cuts.reference);
    let inner: Vec<f64> = setup.cuts.reference.iter().map(|a| a - 0.1).collect();
    let lines = [
        NamedLine {
            name: "middle".to_owned(),
            points_m: middle.clone(),
        },
        NamedLine {
            name: "beside it".to_owned(),
            points_m: setup.cuts.points(&inner),
        },
    ];
    let settings = PopulationSettings {
        setups: 5,
        grip_shares: vec![0.7, 0.8, 0.9],
        backend: BackendChoice::Simd,
        ..PopulationSettings::default()
    };
    let outcome = drive_population(&car, &setup.car, &lines, edges, &settings, |_, _| {
        ControlFlow::Continue(())
    })
    .expect("they are driven");
    assert_eq!(outcome.evaluations, 6 * 2 * 3);
    assert_eq!(outcome.driven.len(), 6 * 2);
    let times: Vec<f64> = outcome
        .driven
        .iter()
        .map(|d| d.best.map_or(f64::INFINITY, |b| b.lap_time_s))
        .collect();
    assert!(times.is_sorted() && times[0].is_finite(), "{times:?}");
    assert!(
        outcome
            .driven
            .iter()
            .flat_map(|d| d.best)
            .all(|b| b.room_m >= 0.0)
    );

    let own = outcome
        .driven
        .iter()
        .find(|d| d.setup == 0 && d.line == 0)
        .and_then(|d| d.best)
        .expect("the bundled car drives");
    let alone = TransientSettings {
        shares: vec![own.grip_share],
        ..TransientSettings::default()
    };
    let alone = drive_line(&car, &setup.car, &middle, edges, &alone).expect("it drives");
    // Single precision, and a recording every 10 ms: see the parity of drives.
    assert!(
        (own.lap_time_s / alone.lap_time_s - 1.0).abs() < 5e-5,
        "{own:?} and {}",
        alone.lap_time_s
    );
    assert!(
        (own.room_m - alone.margin_m).abs() < 0.01,
        "{own:?} and {}",
        alone.margin_m
    );

    let folder = tempfile::tempdir().expect("a temporary folder");
    let summary = summarise_population("gt", &lines, &settings, &outcome, 1.0);
    let words = summary.to_text();
    assert!(
        words.contains("Chosen of each set-up on each line: the fastest lap within the edges"),
        "{words}"
    );
    write_population(folder.path(), &car, &lines, &outcome, &summary).expect("files are written");
    let fastest = Car::load(&folder.path().join("car.toml").display().to_string()).expect("a car");
    let value = |name: &str, car: &Car| car.to_flat()[car.parameter(name).expect(name).slots[0]];
    for (parameter, expected) in outcome.parameters.iter().zip(&outcome.driven[0].values) {
        assert!(
            (value(&parameter.name, &fastest) - expected).abs() < 1e-12,
            "{}",
            parameter.name
        );
    }
    let table = std::fs::read_to_string(folder.path().join("setups.csv")).expect("a table");
    assert_eq!(table.lines().count(), 1 + outcome.driven.len(), "{table}");
    assert!(table_of(&lines, &outcome).contains("beside it"));

    let many = PopulationSettings {
        setups: 700,
        grip_shares: vec![0.3],
        ..settings
    };
    let after = |laps: usize| {
        let (car, setup, many, lines) = (&car, &setup, &many, &lines);
        drive_population(car, &setup.car, lines, edges, many, |driven, _| {
            if driven >= laps {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
    };
    // While the lines are planned there is nothing yet to tell of.
    assert_eq!(after(0).expect_err("no lap").exit_code(), 1);
    let broken = after(1).expect("it is broken off");
    assert!(
        broken.interrupted && broken.evaluations < 2 * 701,
        "{}",
        broken.evaluations
    );
}

#[test]
fn a_road_too_narrow_for_the_car_and_a_table_of_something_else_are_refused() {
    let setup = stadium();
    let car = Car::bundled().expect("the bundled car");
    let points = setup.cuts.points(&setup.cuts.reference);
    let edges = [setup.edges_m[0].as_slice(), setup.edges_m[1].as_slice()];
    let wide = TransientSettings {
        car_width_m: 16.0,
        ..TransientSettings::default()
    };
    let error = drive_line(&car, &setup.car, &points, edges, &wide).expect_err("no room");
    assert_eq!(error.exit_code(), 2, "{error}");

    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("line.csv");
    for (text, place) in [
        ("a,b\n1,2\n", "line 1"),
        ("x_m,y_m\n1,2\n3,oops\n", "line 3"),
        ("x_m,y_m\n1,2\n", "rows"),
    ] {
        std::fs::write(&path, text).expect("a file");
        let error = read_line(&path).expect_err("no line").to_string();
        assert!(error.contains(place), "{error}");
    }
}

#[test]
fn a_run_goes_from_the_log_to_a_driven_lap_and_remembers_its_stages() {
    let base = RunSettings::default();
    let free = base
        .identify
        .free
        .iter()
        .filter(|f| f.name == "K")
        .cloned()
        .collect();
    let settings = RunSettings {
        identify: IdentifySettings {
            free,
            // Without a hybrid drive, whose study would take longer than all the others here.
            car: "gt".to_owned(),
            algorithm: Algorithm::Pso,
            population: Some(8),
            iterations: Some(3),
            ..base.identify.clone()
        },
        raceline: RacelineSettings {
            // Coarser cuts leave kinks in the spline that no steering follows.
            objectives: vec![LineObjective::LapTime],
            ..base.raceline.clone()
        },
        rounds: 1,
        ..base
    };
    let root = tempfile::tempdir().expect("a temporary folder");
    let cache = root.path().join("cache");
    let go = |name: &str| {
        run(
            &prepare(&settings).expect("it is sound"),
            &root.path().join(name),
            &Means {
                cache: Some(&cache),
                every: Duration::from_secs(5),
                memory_limit_mib: USUAL_MIB,
            },
            |_| ControlFlow::Continue(()),
        )
        .expect("it runs")
    };
    let first = go("first");
    assert!(first.reused.is_empty(), "{:?}", first.reused);
    assert!(first.agrees, "{:?}", first.rounds);
    assert!(first.rounds[0].margin_m > 0.0, "the car stays on the road");
    assert!(
        first.total_parameter_error.is_some_and(|e| e < 1e-3),
        "{:?}",
        first.total_parameter_error
    );
    let again = go("again");
    assert_eq!(again.reused, ["identify", "envelope", "raceline", "transient"]);
    assert_eq!(format!("{:?}", again.rounds), format!("{:?}", first.rounds));
    for name in [
        "story.txt",
        "summary.json",
        "1_identify/car.toml",
        "3_raceline/line_fastest.csv",
        "4_transient/drive.csv",
    ] {
        assert!(root.path().join("again").join(name).is_file(), "{name}");
    }
}
