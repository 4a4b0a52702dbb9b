//! A line driven by the 4DOF car, and the whole way from a log to a lap.

use crate::solve;
use glam::DVec2;
use lapswarm::drive::{DriverSettings, SpeedPlan, drive_planned};
use lapswarm::evaluate::BackendChoice;
use lapswarm::evaluate::line::LineObjective;
use lapswarm::line::energy::{Gates, Mode};
use lapswarm::study::framework::state_file::StateFile;
use lapswarm::study::framework::{Study, solve_unobserved, write_results};
use lapswarm::study::hybrid::{Hybrid, HybridStudySettings, Scenario};
use lapswarm::study::identify::{Algorithm, IdentifySettings};
use lapswarm::study::raceline::{RacelineSettings, set_up};
use lapswarm::study::run::{Run, RunSettings};
use lapswarm::study::transient::{
    AGREEMENT, DrivenLine, INTERVAL_S, LineSummary, NamedLine, Outcome, PopulationOutcome, Prepared, Summary,
    Transient, TransientSettings,
};
use lapswarm::vehicle::Car;
use std::ops::ControlFlow;
use std::path::PathBuf;

fn stadium() -> lapswarm::study::raceline::Setup {
    set_up(&RacelineSettings {
        track: "stadium:400:120:14".to_owned(),
        sections: Some(200),
        ..RacelineSettings::default()
    })
    .expect("a stadium")
}

/// The bundled car, and lines at these distances from the reference line, as shares of the road's width.
fn on_lines(lines: &[(&str, f64)]) -> Prepared {
    let road = stadium();
    let line = |(name, beside): &(&str, f64)| {
        let alpha: Vec<f64> = road.cross_sections.reference.iter().map(|a| a - beside).collect();
        let points = road.cross_sections.points(&alpha);
        NamedLine::new((*name).to_owned(), points, &road, 2.0).expect("a line")
    };
    Prepared {
        car: Car::bundled().expect("the bundled car"),
        lines: lines.iter().map(line).collect(),
        road,
        motor: None,
    }
}

fn line_of(outcome: &Outcome) -> &DrivenLine {
    match outcome {
        Outcome::Line(line) => line,
        Outcome::Population(_) => panic!("one line was to be driven"),
    }
}

fn population_of(outcome: &Outcome) -> &PopulationOutcome {
    match outcome {
        Outcome::Population(population) => population,
        Outcome::Line(_) => panic!("a population was to be driven"),
    }
}

/// A hybrid's motor works where a lap of the study `hybrid` has it work: beside the engine it gains time, in its place it gains none.
/// Both laps move the same car over the same way, and the books balance.
#[test]
fn a_hybrids_lap_has_accounts_that_agree_with_the_quasi_steady_state_lap() {
    let road = stadium();
    let points = road.cross_sections.points(&road.cross_sections.reference);
    // A lap that is up to half a percent slower has a percent less of energy in its speed; measured is 1.4 %.
    accounts_agree("stadium:400:120:14", &points, 2.0);
}

/// The same on a road with hills of 20 m and a slippery quarter.
#[test]
fn a_hybrids_lap_in_hills_has_accounts_that_agree() {
    let road = stadium();
    let points = road.cross_sections.points(&road.cross_sections.reference);
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / points.len() as f64;
    let row = |(i, p): (usize, &DVec2)| {
        let z = 9.0 * angle(i).sin() + 1.5 * (3.0 * angle(i)).cos();
        let friction = 1.0 - 0.2 * angle(i).cos().max(0.0);
        format!("{},{},7,7,{z},{friction}\n", p.x, p.y)
    };
    let rows: String = points.iter().enumerate().map(row).collect();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let track = folder.path().join("hills.csv");
    std::fs::write(
        &track,
        format!("# x_m,y_m,w_tr_right_m,w_tr_left_m,z_m,friction\n{rows}"),
    )
    .expect("a file");
    accounts_agree(&track.display().to_string(), &points, 3.0);
}

/// Drives the bundled hybrid on a line of a track, by the engine alone and with the motor, and holds the accounts against those of the
/// quasi-steady-state laps. The work that moves the car may differ by so much (%).
fn accounts_agree(track: &str, points: &[DVec2], moving_percent: f64) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let line = folder.path().join("middle.csv");
    let rows: String = points.iter().map(|p| format!("{},{}\n", p.x, p.y)).collect();
    std::fs::write(&line, format!("x_m,y_m\n{rows}")).expect("a file");
    let scenario = |name: &str, mode: Mode| Scenario {
        name: name.to_owned(),
        mode,
        gates: Gates {
            energy_mj: 0.5,
            ..Gates::OPEN
        },
        start_soc: Some(0.6),
    };
    let hybrid = HybridStudySettings {
        track: track.to_owned(),
        line: Some(line.clone()),
        optimise: false,
        scenarios: vec![
            scenario("beside", Mode::Additional),
            scenario("instead", Mode::Offset),
        ],
        ..HybridStudySettings::default()
    };
    let inputs = Hybrid::prepare(&hybrid).expect("a hybrid");
    let found = solve_unobserved::<Hybrid>(&hybrid, &inputs).expect("laps");
    write_results::<Hybrid>(folder.path(), &hybrid, &inputs, &found).expect("files are written");
    let car = Car::load("gt_hybrid").expect("bundled");
    let (engine, radius) = (
        car.powertrain.as_ref().expect("an engine"),
        car.chassis.radius_rear,
    );
    let power_kw = |v: i32| engine.wheel_force(f64::from(v), radius) * f64::from(v) / 1e3;
    let greatest_kw = (10..70).map(power_kw).fold(0.0, f64::max);
    let driven = |lap: &str, deployment_mode: Mode| {
        let settings = TransientSettings {
            line: vec![folder.path().join("line.csv")],
            track: Some(track.to_owned()),
            car: "gt_hybrid".to_owned(),
            deployment: Some(folder.path().join(lap)),
            deployment_mode,
            ..TransientSettings::default()
        };
        let prepared = Transient::prepare(&settings).expect("a lap to drive");
        let found = solve_unobserved::<Transient>(&settings, &prepared).expect("it drives");
        let out = tempfile::tempdir().expect("a temporary folder");
        let summary = write_results::<Transient>(out.path(), &settings, &prepared, &found);
        let Summary::Line(summary) = summary.expect("files are written") else {
            panic!("the figures of one line")
        };
        let table = std::fs::read_to_string(out.path().join("drive.csv")).expect("a table");
        let header: Vec<&str> = table.lines().next().expect("a header").split(',').collect();
        let column = |name: &str| header.iter().position(|h| *h == name).expect("a column");
        column("motor_power (kW)");
        let engine = column("engine_power (kW)");
        let powers_kw: Vec<f64> = table
            .lines()
            .skip(1)
            .map(|row| {
                row.split(',')
                    .nth(engine)
                    .expect("a power")
                    .parse()
                    .expect("a number")
            })
            .collect();
        let beyond: f64 = powers_kw.iter().map(|p| (p - greatest_kw).max(0.0)).sum();
        let all: f64 = powers_kw.iter().sum();
        // The foot lags behind where the motor stops.
        assert!(beyond < 5e-3 * all, "{beyond} of {all}");
        *summary
    };
    let none = driven("lap_engine_alone.csv", Mode::Offset);
    let beside = driven("lap_beside.csv", Mode::Additional);
    let instead = driven("lap_instead.csv", Mode::Offset);
    for (summary, start_soc) in [(&none, 1.0), (&beside, 0.6), (&instead, 0.6)] {
        let energy = summary.energy.as_ref().expect("accounts");
        println!("{energy:?}");
        assert!(summary.agrees);
        for accounts in [&energy.driven, &energy.quasi_steady_state] {
            assert!(accounts.balance_error_j.abs() < 1.0, "{accounts:?}");
            let change = accounts.harvested_k_mj + accounts.harvested_h_mj - accounts.deployed_mj;
            assert!((accounts.soc_end - start_soc - change / 5.3).abs() < 1e-6);
        }
        assert!((energy.driven.lap_time_s / summary.lap_time_s - 1.0).abs() < 1e-6);
        assert!(energy.deployed_difference_percent.abs() < 3.0);
        // The driver brakes later than his plan and harder, beyond the generator's power for longer.
        assert!(energy.harvested_k_difference_percent.abs() < 5.0);
        assert!(energy.moving_difference_percent.abs() < moving_percent);
        assert!(energy.driven.tyres_mj > 0.0);
    }
    let out = |summary: &LineSummary| summary.energy.as_ref().expect("accounts").driven.deployed_mj;
    assert_eq!(out(&none), 0.0);
    assert!((out(&instead) - 0.5).abs() < 0.015 && (out(&beside) - 0.5).abs() < 0.015);
    let gained = none.lap_time_s - beside.lap_time_s;
    let planned = none.point_mass_lap_time_s - beside.point_mass_lap_time_s;
    assert!(
        gained > 0.5 * planned && planned > 0.1,
        "{gained} s of {planned} s"
    );
    assert!((instead.lap_time_s / none.lap_time_s - 1.0).abs() < 1e-3);
    let fuel = |summary: &LineSummary| summary.energy.as_ref().expect("accounts").driven.fuel_l;
    assert!(fuel(&instead) < fuel(&none));
}

#[test]
fn the_car_drives_a_line_as_fast_as_the_point_mass() {
    let prepared = on_lines(&[("middle", 0.0)]);
    let settings = TransientSettings::default();
    let found = solve_unobserved::<Transient>(&settings, &prepared).expect("it drives");
    let outcome = line_of(&found);
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
    let summary = write_results::<Transient>(folder.path(), &settings, &prepared, &found);
    let Summary::Line(summary) = summary.expect("files are written") else {
        panic!("the figures of one line")
    };
    let words = summary.to_text();
    assert!(
        summary.agrees && words.contains("Chosen: the greatest share of the grip"),
        "{words}"
    );
    for name in [
        "drive.csv",
        "speeds.svg",
        "map.svg",
        "envelope_driven.csv",
        "summary.json",
    ] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
    let drive = std::fs::read_to_string(folder.path().join("drive.csv")).expect("it is there");
    let header = drive.lines().next().unwrap_or_default();
    for channel in ["load_fl (N)", "slip_angle_rr (rad)", "friction_used_rl"] {
        assert!(
            header.split(',').any(|column| column == channel),
            "{channel} in {header}"
        );
    }
}

/// A car with half a metre of room. In one of an ellipse's two tight ends its line lies aside, with less room on the outside, so that
/// it holds less grip there than in the other.
fn beside_in_one_end() -> Prepared {
    let road = set_up(&RacelineSettings {
        track: "ellipse:200:100:10".to_owned(),
        sections: Some(120),
        ..RacelineSettings::default()
    });
    let road = road.expect("an ellipse");
    let cross_sections = &road.cross_sections;
    let beside = |i: usize| {
        let turn = std::f64::consts::TAU * i as f64 / cross_sections.len() as f64;
        0.05 * (0.5 - 0.5 * turn.cos())
    };
    let reference = cross_sections.reference.iter().enumerate();
    let alpha: Vec<f64> = reference.map(|(i, a)| a - beside(i)).collect();
    let line = NamedLine::new("aside".to_owned(), cross_sections.points(&alpha), &road, 9.0);
    Prepared {
        car: Car::bundled().expect("the bundled car"),
        lines: vec![line.expect("a line")],
        road,
        motor: None,
    }
}

#[test]
fn each_corner_has_the_grip_that_the_car_holds_there() {
    let found = solve_unobserved::<Transient>(&TransientSettings::default(), &beside_in_one_end());
    let found = found.expect("it drives");
    let whole = line_of(&found);
    let shares: Vec<f64> = whole.corners.iter().map(|corner| corner.grip_share).collect();
    println!("{} on the whole lap, {shares:?} by corner", whole.grip_share);
    let least = shares.iter().copied().fold(f64::INFINITY, f64::min);
    let most = shares.iter().copied().fold(0.0, f64::max);
    assert!(
        least >= whole.grip_share && most > whole.grip_share + 0.05,
        "{shares:?}"
    );
    assert!(whole.margin_m > 0.0 && whole.disagreement().abs() <= AGREEMENT);
    let by_corner: f64 = whole.corners.iter().map(|corner| corner.driven_s).sum();
    assert!(
        (by_corner - whole.lap_time_s).abs() < 1e-9,
        "{by_corner} {}",
        whole.lap_time_s
    );
}

#[test]
#[ignore = "full tier: a search that is broken off at each of its steps"]
fn a_search_that_is_broken_off_anywhere_ends_with_the_same_lap() {
    let (settings, prepared) = (TransientSettings::default(), beside_in_one_end());
    let found = solve_unobserved::<Transient>(&settings, &prepared).expect("it drives");
    let whole = line_of(&found);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("checkpoint.bin");
    let mut state = None;
    let resumed = loop {
        let mut state_file = StateFile::at(path.clone()).every(std::time::Duration::ZERO);
        // Each time it comes one step further.
        let mut steps = 0;
        let found = solve::<Transient>(&settings, &prepared, (state.take(), &mut state_file), |_| {
            steps += 1;
            if steps > 1 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        if let Some(found) = found.expect("it drives") {
            break found;
        }
        state = state_file.saved::<TransientSettings, _>();
        assert!(state.is_some());
    };
    let resumed = line_of(&resumed);
    assert_eq!(
        (resumed.lap_time_s, &resumed.corners),
        (whole.lap_time_s, &whole.corners)
    );
    assert_eq!(resumed.drive.states, whole.drive.states);
}

/// A line that bends too much for the steering lock is driven with the least grip first: lost there, it is lost. No other share is tried.
#[test]
fn a_line_beyond_the_steering_lock_is_refused_at_once() {
    let road = set_up(&RacelineSettings {
        track: "circle:10:6".to_owned(),
        sections: Some(60),
        ..RacelineSettings::default()
    });
    let road = road.expect("a circle");
    let points = road.cross_sections.points(&road.cross_sections.reference);
    let prepared = Prepared {
        car: Car::bundled().expect("the bundled car"),
        lines: vec![NamedLine::new("middle".to_owned(), points, &road, 2.0).expect("a line")],
        road,
        motor: None,
    };
    let mut state_file = StateFile::idle();
    let settings = TransientSettings::default();
    let mut steps = 0;
    let lost = solve::<Transient>(&settings, &prepared, (None, &mut state_file), |_| {
        steps += 1;
        ControlFlow::Continue(())
    });
    let said = lost.map(drop).expect_err("it is too tight").to_string();
    let words = ["at 0.30: ", "radius of 8.0 m", "on its steering lock"];
    assert!(words.iter().all(|word| said.contains(word)), "{said}");
    assert_eq!(steps, 0, "{said}");
}

/// Set-ups on two lines: the fastest within the edges comes first, the car as it is on a line laps as that line driven alone
/// with the same share of the grip, and a search can be broken off.
#[test]
fn set_ups_and_lines_are_driven_all_at_once() {
    let prepared = on_lines(&[("middle", 0.0), ("beside it", 0.1)]);
    let settings = TransientSettings {
        line: ["middle.csv", "beside it.csv"].map(PathBuf::from).to_vec(),
        setups: Some(5),
        grip_shares: Some(vec![0.7, 0.8, 0.9]),
        backend: BackendChoice::Simd,
        ..TransientSettings::default()
    };
    let found = solve_unobserved::<Transient>(&settings, &prepared).expect("they are driven");
    let outcome = population_of(&found);
    assert_eq!(outcome.record.evaluations, 6 * 2 * 3);
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
        grip_shares: Some(vec![own.grip_share]),
        ..TransientSettings::default()
    };
    let alone = solve_unobserved::<Transient>(&alone, &on_lines(&[("middle", 0.0)])).expect("it drives");
    let alone = line_of(&alone);
    // All set-ups are driven by the first of the drivers; a line alone has the fastest of them.
    let lap = alone.point_mass.lap.as_ref().expect("a lap");
    let plan = SpeedPlan::of_speeds(&lap.station_m, &lap.v_mps, alone.point_mass.length_m);
    let first = DriverSettings::racing(&prepared.car).expect("steady states");
    let driven = drive_planned(&prepared.car, &alone.line, plan, &first, INTERVAL_S).expect("it drives");
    let driven_s = driven.lap_time_s(alone.line.length_m, INTERVAL_S).expect("a lap");
    assert!(
        alone.lap_time_s <= driven_s,
        "{} and {driven_s}",
        alone.lap_time_s
    );
    // Single precision, and a recording every 10 ms: see the parity of drives.
    assert!(
        (own.lap_time_s / driven_s - 1.0).abs() < 5e-5,
        "{own:?} and {driven_s}"
    );
    let room_m = driven.least_room_m(&alone.line);
    assert!((own.room_m - room_m).abs() < 0.01, "{own:?} and {room_m}");

    let folder = tempfile::tempdir().expect("a temporary folder");
    let summary = write_results::<Transient>(folder.path(), &settings, &prepared, &found);
    let Summary::Population(summary) = summary.expect("files are written") else {
        panic!("the figures of a population")
    };
    let words = summary.to_text();
    assert!(
        words.contains("Chosen of each set-up on each line: the fastest lap within the edges"),
        "{words}"
    );
    let fastest = Car::load(&folder.path().join("car.toml").display().to_string()).expect("a car");
    let value = |name: &str, car: &Car| car.to_flat()[car.parameter(name).expect(name).slots[0]];
    for (parameter, expected) in outcome.parameters.iter().zip(&outcome.driven[0].values) {
        assert!(
            (value(&parameter.name, &fastest) - expected).abs() < 1e-12,
            "{}",
            parameter.name
        );
    }
    // The page has the fastest lap, driven once more: the same one, in another precision.
    let page = std::fs::read_to_string(folder.path().join("report.html")).expect("a page");
    let again = page.split("in double precision: ").nth(1).expect("the laps");
    let mut times = again.split(" in ").skip(1).map(|text| {
        let (time, _) = text.split_once(" s").expect("a time");
        time.parse::<f64>().expect("a number")
    });
    let best = outcome.driven[0].best.expect("a lap");
    let off = times.next().expect("the fastest") / best.lap_time_s - 1.0;
    assert!(off.abs() < 5e-5, "{off:e}");
    for name in ["speeds.svg", "map.svg"] {
        let svg = std::fs::read_to_string(folder.path().join(name)).expect(name);
        assert!(svg.starts_with("<svg"), "{name}");
    }
    let table = std::fs::read_to_string(folder.path().join("setups.csv")).expect("a table");
    assert_eq!(table.lines().count(), 1 + outcome.driven.len(), "{table}");
    assert!(summary.table().contains("beside it"));

    let many = TransientSettings {
        setups: Some(700),
        grip_shares: Some(vec![0.3]),
        ..settings
    };
    let after = |laps: u64| {
        let mut state_file = StateFile::idle();
        solve::<Transient>(&many, &prepared, (None, &mut state_file), |told| {
            if told.done >= laps {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .expect("it is broken off")
    };
    // While the lines are planned there is nothing yet to tell of.
    assert!(after(0).is_none());
    let broken = after(1).expect("some laps");
    let record = Transient::record(&broken);
    assert!(
        record.interrupted && record.evaluations < 2 * 701,
        "{}",
        record.evaluations
    );
}

#[test]
fn a_road_too_narrow_for_the_car_is_refused() {
    let setup = stadium();
    let points = setup.cross_sections.points(&setup.cross_sections.reference);
    let error = NamedLine::new("middle".to_owned(), points, &setup, 16.0).expect_err("no room");
    assert_eq!(error.exit_code(), 2, "{error}");
}

#[test]
fn a_run_goes_from_the_log_to_a_driven_lap_and_remembers_its_stages() {
    let root = tempfile::tempdir().expect("a temporary folder");
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
            // A short circuit, with as many cross-sections as it has by default: coarser ones leave kinks in the spline that no
            // steering follows.
            track: "stadium:400:120:14".to_owned(),
            objectives: vec![LineObjective::LapTime],
            ..base.raceline.clone()
        },
        rounds: 1,
        cache: Some(root.path().join("cache")),
        ..base
    };
    let go = |name: &str| {
        let folder = root.path().join(name);
        std::fs::create_dir(&folder).expect("a folder");
        let prepared = Run::prepare(&settings).expect("it is sound");
        let mut state_file = StateFile::new(&folder);
        let outcome = solve::<Run>(&settings, &prepared, (None, &mut state_file), |_| {
            ControlFlow::Continue(())
        });
        let outcome = outcome.expect("it runs").expect("to its end");
        write_results::<Run>(&folder, &settings, &prepared, &outcome).expect("files are written")
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
