//! Lines of circuits that nobody has surveyed, and of set-ups.

use crate::made::Circuit;
use lapswarm::evaluate::BackendChoice;
use lapswarm::evaluate::line::LineObjective;
use lapswarm::line::{ON_ROAD_M, PointMass};
use lapswarm::optimum::ReferenceSolvers;
use lapswarm::study::framework::solve_unobserved;
use lapswarm::study::raceline::{Raceline, RacelineSettings, set_up};
use lapswarm::track::Track;
use lapswarm::vehicle::{Envelope, EnvelopeRow};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

/// One of the ten made circuits.
fn made_circuit(name: &str) -> Circuit {
    let mut ten = Circuit::ten().into_iter();
    ten.find(|circuit| circuit.name == name).expect("a made circuit")
}

fn settings(circuit: &Circuit, folder: &Path) -> RacelineSettings {
    let file = folder.join("circuit.csv");
    std::fs::write(&file, circuit.csv()).expect("a file");
    RacelineSettings {
        track: file.display().to_string(),
        objectives: vec![
            LineObjective::Length,
            LineObjective::Gamma,
            LineObjective::LapTime,
        ],
        backend: BackendChoice::Simd,
        ..RacelineSettings::default()
    }
}

/// Whatever the survey's noise, widths and corners: the shortest line, that of least curvature and the fastest are on the road.
#[test]
fn lines_of_any_circuit_are_on_its_road() {
    for seed in 0..5 {
        let folder = tempfile::tempdir().expect("a folder");
        let settings = settings(&Circuit::random(seed), folder.path());
        let setup = set_up(&settings).expect("a circuit");
        let solvers = setup.solvers(&settings, &Arc::default()).expect("solvers");
        let mut times_s = Vec::new();
        for objective in &settings.objectives {
            let best = solvers.best(*objective).expect("a line").expect("a solver");
            let line = setup.report("line", &best.alpha, &settings).expect("a lap");
            let margin_m = line.clearance.margin_m;
            assert!(
                margin_m >= -ON_ROAD_M,
                "circuit {seed}, {objective:?}: {margin_m} m"
            );
            times_s.push(line.lap_time_fine_s());
        }
        assert!(
            times_s[2] < times_s[0].min(times_s[1]),
            "circuit {seed}: {times_s:?}"
        );
    }
}

/// The bridge is one without a word, and its fastest line is on the road on both decks.
#[test]
fn a_figure_of_eight_has_a_fastest_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = settings(&made_circuit("bridge"), folder.path());
    let setup = set_up(&settings).expect("a circuit");
    assert_eq!(setup.road.bridges().len(), 1);
    let solvers = setup.solvers(&settings, &Arc::default()).expect("solvers");
    let best = solvers
        .best(LineObjective::LapTime)
        .expect("a line")
        .expect("a solver");
    let line = setup.report("line", &best.alpha, &settings).expect("a lap");
    assert!(line.clearance.margin_m >= -ON_ROAD_M, "{:?}", line.clearance);
}

/// On the chicanes the last stage's two programs still promise a quarter of a percent, and the line that they left was 0.12 % above
/// today's. Eight more programs about today's line gain less than the 0.05 % that lines may be above the optimum.
#[test]
fn the_fastest_line_through_chicanes_is_settled() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = settings(&made_circuit("chicanes"), folder.path());
    let setup = set_up(&settings).expect("a circuit");
    let solvers = setup.solvers(&settings, &Arc::default()).expect("solvers");
    let best = solvers.best(LineObjective::LapTime).expect("a line");
    let best = best.expect("a solver");
    let time_s = |alpha: &[f64]| solvers.lap(alpha).expect("a lap").0;
    let more = solvers.fastest_about(&best.alpha).expect("a line");
    let gain = more.map_or(0.0, |more| 1.0 - time_s(&more.x) / time_s(&best.alpha));
    assert!(gain < 5e-4, "{gain}");
    assert!(best.left < 5e-4, "{}", best.left);
}

/// On a kart circuit of 972 m, where lines touch the ends of many cross-sections, the fastest lines through few and many of them differ
/// by no more than the 0.05 % that lines may be above the optimum: 37.4130 and 37.4126 s. Held at those ends they had kinks, and
/// differed by 0.13 %.
#[test]
fn short_laps_do_not_depend_on_how_closely_they_are_cut() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = settings(&made_circuit("kart"), folder.path());
    let times_s = [480, 960].map(|sections| {
        let settings = RacelineSettings {
            sections: Some(sections),
            car_width_m: 3.0,
            ..settings.clone()
        };
        let setup = set_up(&settings).expect("a circuit");
        let solvers = setup.solvers(&settings, &Arc::default()).expect("solvers");
        let best = solvers.best(LineObjective::LapTime).expect("a line");
        let line = setup.report("line", &best.expect("a solver").alpha, &settings);
        let line = line.expect("a lap");
        assert!(line.clearance.margin_m >= 0.0, "{:?}", line.clearance);
        line.lap_time_fine_s()
    });
    assert!((times_s[0] / times_s[1] - 1.0).abs() < 5e-4, "{times_s:?}");
}

/// A circuit with all of its lengths multiplied, as a file in a folder.
fn scaled(circuit: &Circuit, scale: f64, folder: &Path) -> String {
    let csv = circuit.csv();
    let (head, rows) = csv.split_once('\n').expect("a header");
    let mut scaled = format!("{head}\n");
    for row in rows.lines() {
        let cells = row.split(',').map(|cell| cell.parse::<f64>().expect("a number"));
        let cells: Vec<String> = cells.map(|cell| (cell * scale).to_string()).collect();
        let _ = writeln!(scaled, "{}", cells.join(","));
    }
    let file = folder.join("circuit.csv");
    std::fs::write(&file, scaled).expect("a file");
    file.display().to_string()
}

/// The car has a decimetre of room on either side of a road of 2.1 m. Bending alone does not bring the line of least second differences
/// onto it: the study ended there, without its other lines.
#[test]
fn a_line_gives_way_on_a_narrow_road() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = RacelineSettings {
        track: scaled(&made_circuit("kart"), 0.3, folder.path()),
        car_width_m: 1.3,
        car_length_m: 2.6,
        margin_m: 0.3,
        objectives: vec![LineObjective::Gamma],
        backend: BackendChoice::Simd,
        ..RacelineSettings::default()
    };
    let setup = set_up(&settings).expect("a circuit");
    let outcome = solve_unobserved::<Raceline>(&settings, &setup).expect("a line");
    let best = &outcome.objectives[0].best;
    assert!(best.clearance.is_on_road(), "{:?}", best.clearance);
    assert!(best.gave_way.is_some());
}

/// With all lengths a quarter and all times half, nothing changes but the unit. The hairpins then have the radius of those of Formula
/// Student. With the stages of large roads the lap was 0.9 % slower there, and 0.2 % with points of the fine spline 1 m apart on roads of
/// either size. What is left is 0.12 %.
#[test]
fn small_roads_are_solved_as_large_ones() {
    let folder = tempfile::tempdir().expect("a folder");
    let time_s = |scale: f64| {
        let file = scaled(&made_circuit("hairpins"), scale, folder.path());
        let track = Track::load(&file).expect("a circuit");
        let road = track.cross_sections(960, true).expect("cross-sections");
        let road = road.narrowed(2.0 * scale).expect("a road wider than the car");
        let row = |v_mps: f64, [ay_mps2, ax_grip_mps2, ax_drive_mps2, drag_mps2]: [f64; 4]| EnvelopeRow {
            v_mps: v_mps * scale.sqrt(),
            ay_mps2,
            ax_grip_mps2,
            ax_drive_mps2,
            drag_mps2,
        };
        let rows = vec![
            row(20.0, [15.0, 14.0, 9.0, 0.5]),
            row(70.0, [18.0, 18.0, 4.0, 4.0]),
        ];
        let envelope = Envelope::new("scaled", rows).expect("an envelope");
        let car = PointMass {
            max_steer_rate_radps: Some(0.7 / scale.sqrt()),
            ..PointMass::new(envelope, 2.6 * scale)
        };
        let solvers = ReferenceSolvers::new(&road, &car, 0.0).expect("solvers");
        let best = solvers.best(LineObjective::LapTime).expect("a line");
        let (time_s, _) = solvers.lap(&best.expect("a solver").alpha).expect("a lap");
        time_s / scale.sqrt()
    };
    let times_s = [1.0, 0.25].map(time_s);
    assert!((times_s[0] / times_s[1] - 1.0).abs() < 1.5e-3, "{times_s:?}");
}

/// Lighter cars are faster, each on a line of its own that is no slower than that of the car as it is, and near a reference optimum.
#[test]
fn set_ups_have_lines_of_their_own() {
    let folder = tempfile::tempdir().expect("a folder");
    lighter_cars_are_faster(settings(&Circuit::random(3), folder.path()));
}

/// So they are on the same circuit with hills of 18 m and grip that varies by a fifth.
#[test]
#[ignore = "full tier: a batch of lines"]
fn set_ups_in_hills_have_lines_of_their_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = settings(&Circuit::random(3), folder.path());
    let level = std::fs::read_to_string(&settings.track).expect("the circuit");
    let rows: Vec<&str> = level.lines().filter(|row| !row.starts_with('#')).collect();
    let mut hills = "# x_m,y_m,w_tr_right_m,w_tr_left_m,z_m,friction\n".to_owned();
    for (i, row) in rows.iter().enumerate() {
        let angle = std::f64::consts::TAU * i as f64 / rows.len() as f64;
        let (z_m, friction) = (9.0 * angle.sin(), 0.9 + 0.1 * (2.0 * angle).cos());
        let _ = writeln!(hills, "{row},{z_m},{friction}");
    }
    std::fs::write(&settings.track, hills).expect("a file");
    lighter_cars_are_faster(settings);
}

fn lighter_cars_are_faster(settings: RacelineSettings) {
    let settings = RacelineSettings {
        objectives: vec![LineObjective::LapTime],
        setups: Some(5),
        parameters: vec!["mass_kg".to_owned()],
        ..settings
    };
    let setup = set_up(&settings).expect("a circuit");
    let found = solve_unobserved::<Raceline>(&settings, &setup).expect("lines");
    let setups = found.setups.expect("set-ups");
    assert_eq!(setups.solved.len(), 6);
    let mut laps = Vec::new();
    for solved in &setups.solved {
        let lap = solved.lap.as_ref().expect("a lap");
        assert!(
            lap.lap_time_s <= lap.on_first_line_s && lap.clearance_m >= -ON_ROAD_M,
            "{lap:?}"
        );
        if let Some(reference_s) = lap.reference_s {
            assert!(
                (lap.lap_time_s / reference_s - 1.0).abs() < 2e-3,
                "{} {reference_s}",
                lap.lap_time_s
            );
        }
        laps.push((solved.values[0], lap.lap_time_s));
    }
    laps.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(laps.windows(2).all(|pair| pair[0].1 < pair[1].1), "{laps:?}");
    assert_eq!(
        setups
            .solved
            .iter()
            .filter_map(|s| s.lap.as_ref()?.reference_s)
            .count(),
        4
    );
}
