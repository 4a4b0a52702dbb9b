//! Lines on roads as surveys have them: every one that is reported is on the road, whatever the road is like.

use glam::DVec2;
use lapswarm::error::Error;
use lapswarm::evaluate::BackendChoice;
use lapswarm::evaluate::line::LineObjective;
use lapswarm::line::{FineLine, read_line};
use lapswarm::optimum::{DeploymentSearch, Status};
use lapswarm::random::Random;
use lapswarm::study::framework::{solve_unobserved, write_results};
use lapswarm::study::hybrid::{HybridStudySettings, set_up as hybrid_set_up};
use lapswarm::study::raceline::{LineAlgorithm, Raceline, RacelineSettings, Summary, set_up};
use lapswarm::study::transient::{AGREEMENT, NamedLine, Outcome, Prepared, Transient, TransientSettings};
use lapswarm::swarm::Schedule;
use lapswarm::vehicle::Car;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

/// A surveyed circuit: corners, each with the radius of its bend (m), the widths to the right and the left (m), and how jagged it
/// is (m).
struct Surveyed {
    corners: &'static [[f64; 3]],
    right_m: f64,
    left_m: f64,
    jagged_m: f64,
}

/// A hairpin of 10 m radius with 9 m of road on its inside, which the jags of the survey fold, and a chicane.
const HAIRPIN: Surveyed = Surveyed {
    corners: &[
        [0.0, 0.0, 10.0],
        [0.0, 20.5, 10.0],
        [-250.0, 20.5, 20.0],
        [-270.0, 60.0, 25.0],
        [-400.0, 60.0, 30.0],
        [-420.0, -80.0, 40.0],
        [-250.0, -90.0, 60.0],
        [-200.0, 0.0, 60.0],
    ],
    right_m: 7.0,
    left_m: 9.0,
    jagged_m: 0.1,
};
/// A street 7 m wide round corners of 12 to 18 m radius.
const STREET: Surveyed = Surveyed {
    corners: &[
        [0.0, 0.0, 12.0],
        [160.0, 0.0, 18.0],
        [160.0, 70.0, 14.0],
        [240.0, 80.0, 20.0],
        [250.0, 180.0, 12.0],
        [90.0, 190.0, 15.0],
        [80.0, 110.0, 12.0],
        [0.0, 100.0, 16.0],
    ],
    right_m: 3.5,
    left_m: 3.5,
    jagged_m: 0.03,
};
/// A figure of eight, whose straights cross at a steep angle.
const EIGHT: Surveyed = Surveyed {
    corners: &[
        [150.0, 120.0, 30.0],
        [-150.0, -120.0, 30.0],
        [-230.0, -20.0, 25.0],
        [-220.0, 60.0, 40.0],
        [-150.0, 120.0, 30.0],
        [150.0, -120.0, 30.0],
        [240.0, -10.0, 50.0],
    ],
    right_m: 5.0,
    left_m: 5.0,
    jagged_m: 0.03,
};

/// Wide corners of 60 to 90 m radius, between edges that are jagged a little.
const WIDE: Surveyed = Surveyed {
    corners: &[
        [0.0, 0.0, 80.0],
        [600.0, 0.0, 60.0],
        [650.0, 300.0, 90.0],
        [300.0, 250.0, 70.0],
        [100.0, 400.0, 60.0],
    ],
    right_m: 10.0,
    left_m: 10.0,
    jagged_m: 0.05,
};

impl Surveyed {
    /// The line in steps of 5 m.
    fn centre(&self) -> Vec<DVec2> {
        let n = self.corners.len();
        let corner = |i: usize| DVec2::new(self.corners[i % n][0], self.corners[i % n][1]);
        let mut path = Vec::new();
        for i in 0..n {
            let (before, here, after) = (corner(i + n - 1), corner(i), corner(i + 1));
            let radius = self.corners[i][2];
            let (back, on) = ((before - here).normalize(), (after - here).normalize());
            let half = 0.5 * back.dot(on).clamp(-1.0, 1.0).acos();
            let centre = here + (back + on).normalize() * (radius / half.sin());
            let from = here + back * (radius / half.tan()) - centre;
            let turn = (std::f64::consts::PI - 2.0 * half) * (-back).perp_dot(on).signum();
            let steps = (radius * turn.abs() / 0.2).ceil();
            path.extend((0..=steps as usize).map(|k| {
                let angle = DVec2::from_angle(turn * k as f64 / steps);
                centre + from.rotate(angle)
            }));
        }
        let line = FineLine::new(&path, true, 0.2, None, 0.0).expect("a line");
        let count = (line.length_m / 5.0) as usize;
        let at = |i: usize| {
            let station = i as f64 * line.length_m / count as f64;
            line.points_m[line.station_m.partition_point(|s| *s < station)]
        };
        (0..count).map(at).collect()
    }

    /// Writes the survey in the racetrack database's format.
    fn write(&self, path: &Path) {
        let random = Random::new(5);
        let mut text = "# x_m,y_m,w_tr_right_m,w_tr_left_m\n".to_owned();
        for (i, point) in (0..).zip(self.centre()) {
            let jag = |k: u32| self.jagged_m * random.normal(0, 0, i, k);
            let (x, y) = (point.x + jag(0), point.y + jag(1));
            let (right, left) = (self.right_m + jag(2), self.left_m + jag(3));
            let _ = writeln!(text, "{x:.4},{y:.4},{right:.4},{left:.4}");
        }
        std::fs::write(path, text).expect("a survey");
    }

    fn settings(&self, folder: &Path) -> RacelineSettings {
        let track = folder.join("survey.csv");
        self.write(&track);
        RacelineSettings {
            track: track.display().to_string(),
            sections: Some(200),
            objectives: vec![LineObjective::LapTime],
            backend: BackendChoice::Simd,
            ..RacelineSettings::default()
        }
    }
}

/// Solves a study, and writes what it found.
fn found(settings: &RacelineSettings, folder: &Path) -> Summary {
    let setup = set_up(settings).expect("a road");
    let outcome = solve_unobserved::<Raceline>(settings, &setup).expect("a line");
    write_results::<Raceline>(folder, settings, &setup, &outcome).expect("files")
}

/// Clearance of a car 2 m wide on the line of a run, by the distances from the surveyed centre line that it keeps, on the survey's
/// own terms and by nothing of the product: that of the widths where the two are abreast.
fn clearance_m(circuit: &Surveyed, folder: &Path) -> f64 {
    let text = std::fs::read_to_string(folder.join("survey.csv")).expect("the survey");
    let point = |row: &str| -> DVec2 {
        let mut row = row.split(',').map(|x| x.parse().expect("a number"));
        DVec2::new(row.next().expect("x"), row.next().expect("y"))
    };
    let centre: Vec<DVec2> = text.lines().skip(1).map(point).collect();
    let centre = FineLine::new(&centre, true, 0.25, None, 0.0).expect("a line");
    let n = centre.points_m.len() as isize;
    let line = read_line(&folder.join("line_fastest.csv")).expect("the line");
    let mut at = 0;
    let mut least = f64::INFINITY;
    for (i, point) in line.iter().enumerate() {
        let reach = if i == 0 { n / 2 } else { 120 };
        let distance = |k: &isize| centre.points_m[k.rem_euclid(n) as usize].distance(*point);
        let near = at - reach..=at + reach;
        at = near
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .expect("places");
        let [before, here, after] = [at - 1, at, at + 1].map(|k| centre.points_m[k.rem_euclid(n) as usize]);
        let leftward = (after - before).perp_dot(*point - here);
        let width = if leftward > 0.0 {
            circuit.left_m
        } else {
            circuit.right_m
        };
        least = least.min(width - 1.0 - distance(&at));
    }
    least
}

/// A car whose wheels turn at 5 deg/s takes longer than the usual one, on a line on which they never turn faster.
#[test]
fn slow_steering_is_obeyed_by_the_fastest_line() {
    let laps = [40.0, 5.0].map(|steering_rate_deg_s| {
        let folder = tempfile::tempdir().expect("a folder");
        let settings = RacelineSettings {
            steering_rate_deg_s: Some(steering_rate_deg_s),
            ..STREET.settings(folder.path())
        };
        let summary = found(&settings, folder.path());
        let line = &summary.best["lap_time"];
        let exact = summary.exact["lap_time"].as_ref().expect("one");
        println!(
            "{steering_rate_deg_s} deg/s: {:.3} s, turned at {:.2} deg/s; reference {:.3} s",
            line.lap_time_fine_s, line.steering_rate_deg_s, exact.lap_time_fine_s
        );
        assert!(line.clearance_m >= -0.01);
        assert!(line.steering_rate_deg_s < steering_rate_deg_s * (1.0 + 1e-9));
        line.lap_time_fine_s
    });
    assert!(laps[0] + 0.1 < laps[1], "{laps:?} s");
}

#[test]
fn fastest_lines_are_on_the_road() {
    for (name, circuit) in [("hairpin", &HAIRPIN), ("street", &STREET), ("eight", &EIGHT)] {
        let folder = tempfile::tempdir().expect("a folder");
        let settings = circuit.settings(folder.path());
        let summary = found(&settings, folder.path());
        let line = &summary.best["lap_time"];
        println!(
            "{name}: {:.3} s, clearance {:.4} m at {:.0} m, {:.3} m by the survey; reference {:.3} s",
            line.lap_time_fine_s,
            line.clearance_m,
            line.clearance_station_m,
            clearance_m(circuit, folder.path()),
            summary.exact["lap_time"].as_ref().expect("one").lap_time_fine_s,
        );
        assert!(
            line.clearance_m >= -0.01 && line.clearance_m < 0.3,
            "{name}: {}",
            line.clearance_m
        );
        let exact = summary.exact["lap_time"].as_ref().expect("one");
        assert!(exact.clearance_m >= -0.01, "{name}: {}", exact.clearance_m);
        assert!(summary.off_road.is_empty());
        assert!(
            summary
                .to_text()
                .contains("Least clearance of the best line by lap_time")
        );
        // The jags of the survey's own widths, four times their size, lie between the two.
        let by_survey = clearance_m(circuit, folder.path());
        assert!(by_survey > -0.01 - 4.0 * circuit.jagged_m, "{name}: {by_survey}");
        // What drives the line takes it for what it is, and knows the room on both decks of a bridge.
        let setup = set_up(&settings).expect("a road");
        let points = read_line(&folder.path().join("line_fastest.csv")).expect("a line");
        let driven = NamedLine::new("fastest".to_owned(), points, &setup, 2.0).expect("room");
        let widths = driven
            .circuit
            .width_left_m
            .iter()
            .zip(&driven.circuit.width_right_m);
        let room_m = widths.map(|(l, r)| l.min(*r)).fold(f64::INFINITY, f64::min);
        assert!(room_m > -0.02, "{name}: {room_m}");
    }
}

/// The fastest line is a line of the road, and not of the places where the road was cut.
#[test]
fn reference_optima_agree_across_cross_sections() {
    let folder = tempfile::tempdir().expect("a folder");
    let lap_s = [400, 800].map(|sections| {
        let settings = RacelineSettings {
            sections: Some(sections),
            ..WIDE.settings(folder.path())
        };
        let setup = set_up(&settings).expect("a road");
        let solvers = setup.solvers(&settings, &Arc::default()).expect("solvers");
        let report = |objective| {
            let line = solvers.best(objective).expect("a line").expect("a solver");
            setup.report("reference", &line.alpha, &settings).expect("a line")
        };
        let fastest = report(LineObjective::LapTime);
        assert!(fastest.clearance.is_on_road(), "{:?}", fastest.clearance);
        let least_curved_s = report(LineObjective::Kappa2).lap_time_fine_s();
        assert!(
            fastest.lap_time_fine_s() < 0.98 * least_curved_s,
            "{least_curved_s}"
        );
        fastest.lap_time_fine_s()
    });
    let apart = (lap_s[0] - lap_s[1]).abs() / lap_s[1];
    assert!(apart < 1e-3, "{lap_s:?}");
}

/// A road whose left half is wet for a third of the lap. The fastest line keeps to the right there, within the road; on the wet road it is
/// faster than the line that is fastest on the dry one, and the car with four wheels drives it as the point mass does.
#[test]
fn the_fastest_line_goes_round_a_wet_patch() {
    let folder = tempfile::tempdir().expect("a folder");
    let dry = RacelineSettings {
        car_width_m: 3.0,
        ..WIDE.settings(folder.path())
    };
    let text = std::fs::read_to_string(&dry.track).expect("the survey");
    let rows = text.lines().count() - 1;
    let is_wet = |row: usize| (rows / 3..2 * rows / 3).contains(&row);
    let with_friction = text.lines().enumerate().map(|(i, row)| match i {
        0 => format!("{row},friction_left,friction_right\n"),
        _ if is_wet(i - 1) => format!("{row},0.4,1\n"),
        _ => format!("{row},1,1\n"),
    });
    let track = folder.path().join("wet.csv");
    std::fs::write(&track, with_friction.collect::<String>()).expect("a survey");
    let wet = RacelineSettings {
        track: track.display().to_string(),
        ..dry.clone()
    };
    let fastest = |settings: &RacelineSettings| {
        let setup = set_up(settings).expect("a road");
        let solvers = setup.solvers(settings, &Arc::default()).expect("solvers");
        let line = solvers
            .best(LineObjective::LapTime)
            .expect("a line")
            .expect("a solver");
        let report = setup.report("fastest", &line.alpha, settings).expect("a line");
        (setup, report)
    };
    let ((dry_road, on_dry), (wet_road, on_wet)) = (fastest(&dry), fastest(&wet));
    assert!(on_wet.clearance.is_on_road() && on_dry.clearance.is_on_road());
    assert!(wet_road.cross_sections.relief.is_some() && dry_road.cross_sections.relief.is_none());
    // Friction under each line, at its own points, on the wet road.
    let under = |points: &[DVec2]| {
        let surfaces = wet_road.cross_sections.relief_along(points).expect("a surface");
        let wet: Vec<f64> = surfaces
            .iter()
            .map(|s| s[2])
            .filter(|friction| *friction < 0.995)
            .collect();
        wet.iter().sum::<f64>() / wet.len() as f64
    };
    let [there, dry_line] = [&on_wet, &on_dry].map(|line| under(&line.fine.points_m));
    assert!(there > dry_line + 0.05, "{there} {dry_line}");
    let surfaces = wet_road.cross_sections.relief_along(&on_dry.fine.points_m);
    let driven = Some((&wet_road.car, [].as_slice()));
    let same = FineLine::on(&on_dry.fine.points_m, surfaces.as_deref(), true, 1.0, driven, 0.0);
    let same_s = same.expect("a line").lap_time_s().expect("a lap");
    let found_s = on_wet.lap_time_fine_s();
    assert!(found_s < 0.99 * same_s, "{found_s} {same_s}");
    assert!(on_dry.lap_time_fine_s() < 0.99 * found_s);

    let line = NamedLine::new("fastest".to_owned(), on_wet.fine.points_m.clone(), &wet_road, 2.0);
    let prepared = Prepared {
        car: Car::bundled().expect("the bundled car"),
        lines: vec![line.expect("room")],
        road: wet_road,
        motor: None,
    };
    let found = solve_unobserved::<Transient>(&TransientSettings::default(), &prepared).expect("it drives");
    let Outcome::Line(driven) = found else {
        panic!("one line was to be driven")
    };
    assert!(
        driven.disagreement().abs() <= AGREEMENT,
        "{}",
        driven.disagreement()
    );
    assert!(
        driven.margin_m > 0.0 && driven.grip_share > 0.7,
        "{}",
        driven.grip_share
    );
    let full_s = driven.full_grip_s.expect("a lap at full grip");
    assert!((full_s / found_s - 1.0).abs() < 2e-3, "{full_s} {found_s}");
    let wettest = driven.drive.inputs.iter().filter_map(|input| input.friction);
    let wettest = wettest.fold(1.0, f64::min);
    assert!((0.4..0.95).contains(&wettest), "{wettest}");
}

#[test]
fn a_bridge_needs_no_word() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = EIGHT.settings(folder.path());
    let setup = set_up(&settings).expect("a road with a bridge");
    assert_eq!(setup.road.bridges().len(), 1);
    let reference = setup
        .report("reference", &setup.cross_sections.reference, &settings)
        .expect("a line");
    assert!(reference.clearance.margin_m > 2.0, "{:?}", reference.clearance);
}

#[test]
fn widths_of_written_lines_are_those_of_the_road() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = RacelineSettings {
        track: "circle:90:110".to_owned(),
        sections: Some(120),
        objectives: vec![LineObjective::Length],
        backend: BackendChoice::Simd,
        ..RacelineSettings::default()
    };
    found(&settings, folder.path());
    let text = std::fs::read_to_string(folder.path().join("racetrack_shortest.csv")).expect("a file");
    for row in text.lines().skip(1) {
        let row: Vec<f64> = row.split(',').map(|x| x.parse().expect("a number")).collect();
        // The shortest line keeps the car's side, a metre away, at the inner edge; edges are polygons.
        let [right, left] = [row[2], row[3]];
        let inner = right.min(left);
        assert!(
            (right + left - 20.0).abs() < 0.02 && (inner - 1.0).abs() < 0.03,
            "{right} {left}"
        );
    }
}

/// Between 60 cross-sections of the bundled circuit lie a hundred metres.
#[test]
fn a_line_that_cannot_be_on_the_road_is_no_result() {
    let settings = RacelineSettings {
        sections: Some(60),
        objectives: vec![LineObjective::Length],
        backend: BackendChoice::Simd,
        ..RacelineSettings::default()
    };
    let setup = set_up(&settings).expect("a road");
    let Err(error) = solve_unobserved::<Raceline>(&settings, &setup) else {
        panic!("a line where none is on the road");
    };
    let text = error.to_string();
    assert!(
        matches!(error, Error::Study(_)) && error.exit_code() == 1,
        "{text}"
    );
    assert!(
        text.contains("leaves the road") && text.contains(" edge at "),
        "{text}"
    );
}

/// The published swarm's line of this seed zigzags between cross-sections 16 m apart and is a metre off the road there.
#[test]
fn the_line_of_a_swarm_alone_gives_way_towards_the_reference_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = RacelineSettings {
        sections: Some(360),
        algorithm: LineAlgorithm::Thesis,
        car_width_m: 0.0,
        car_length_m: 0.0,
        objectives: vec![LineObjective::Length],
        population: 100,
        iterations: 200,
        inertia: Some(Schedule::Linear { from: 0.1, to: 1.0 }),
        cognitive: Some(Schedule::Fixed(2.0)),
        social: Some(Schedule::Fixed(2.0)),
        seed: 3,
        backend: BackendChoice::Simd,
        ..RacelineSettings::default()
    };
    let summary = found(&settings, folder.path());
    let clearance_m = summary.best["length"].clearance_m;
    assert!(clearance_m >= -0.01, "{clearance_m}");
    let gave_way =
        |warning: &String| warning.starts_with("shortest:") && warning.contains("gave way by 16 %");
    assert!(summary.warnings.iter().any(gave_way), "{:?}", summary.warnings);
}

/// The minimum-curvature line of the bundled circuit leaves the road by centimetres between its cross-sections, and bending alone
/// does not bring it back.
#[test]
fn the_minimum_curvature_line_is_on_the_road() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = RacelineSettings {
        objectives: vec![LineObjective::Gamma],
        backend: BackendChoice::Simd,
        ..RacelineSettings::default()
    };
    let summary = found(&settings, folder.path());
    let clearance_m = summary.best["gamma"].clearance_m;
    assert!(clearance_m >= -0.01, "{clearance_m}");
    assert!(summary.off_road.is_empty());
}

#[test]
fn a_margin_is_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = RacelineSettings {
        margin_m: 0.5,
        ..STREET.settings(folder.path())
    };
    let summary = found(&settings, folder.path());
    assert!(summary.best["lap_time"].clearance_m >= -0.01);
    let by_survey = clearance_m(&STREET, folder.path());
    assert!(by_survey > 0.5 - 0.01 - 4.0 * STREET.jagged_m, "{by_survey}");
}

/// A car that starts from a standstill deploys what it may, and what ends a search is said.
#[test]
fn deployments_start_from_a_standstill() {
    let settings = HybridStudySettings {
        track: "stadium:400:120:14".to_owned(),
        sections: Some(60),
        backend: BackendChoice::Simd,
        ..HybridStudySettings::default()
    };
    let setup = hybrid_set_up(&settings).expect("a hybrid car");
    let half = &setup.points_m[..setup.points_m.len() / 2];
    let search = DeploymentSearch {
        car: &setup.car,
        points_m: half,
        closed: false,
        drs: &[],
        surface: &[],
        run_in: 0,
        entry_mps: 0.0,
    };
    let none = search.best(0.0, None).expect("a lap");
    let deployed = search.best(2e6, None).expect("a lap");
    println!(
        "{:.3} s, {:.3} s: {}",
        none.lap.time, deployed.lap.time, deployed.status
    );
    assert!(
        deployed.lap.time < none.lap.time - 0.2,
        "{} {}",
        none.lap.time,
        deployed.lap.time
    );
    assert!(deployed.shares.iter().any(|share| *share > 0.5));
    let error = search
        .best(2e6, Some(&[0.5; 3]))
        .expect_err("a short start")
        .to_string();
    assert!(error.contains("start") && error.contains("3 shares"), "{error}");
}

/// With energy enough the MGU-H's motor makes the best lap faster, at its own price; with little, no more is spent than there is.
#[test]
fn deployments_pay_for_the_turbocharger_s_motor() {
    let settings = HybridStudySettings {
        track: "stadium:400:120:14".to_owned(),
        sections: Some(60),
        backend: BackendChoice::Simd,
        ..HybridStudySettings::default()
    };
    let mut setup = hybrid_set_up(&settings).expect("a hybrid car");
    let mut best = |gain_kw: f64, energy_j: f64| {
        let mut hybrid = setup.car.hybrid.clone();
        let h = hybrid.mgu_h.as_mut().expect("bundled");
        (h.motor_w, h.motor_gain_w) = (3e3 * gain_kw, 1e3 * gain_kw);
        setup.car = setup.car.with_hybrid(hybrid).expect("a car");
        let found = setup.exact(energy_j, None).expect("a lap");
        assert!(
            found.lap.deployed <= energy_j * (1.0 + 1e-6),
            "{}",
            found.lap.deployed
        );
        (found.lap, found.status)
    };
    let ((with, ended), (without, _)) = (best(20.0, 2e7), best(0.0, 2e7));
    println!("{with:?}\n{without:?}");
    assert_eq!(ended, Status::Solved);
    assert!(with.time < without.time - 0.01 && with.deployed > 1.1 * without.deployed);
    // With little energy the dearer joules stay where they are.
    let ((with, ended), (without, _)) = (best(20.0, 5e5), best(0.0, 5e5));
    println!("{with:?}, {ended}\n{without:?}");
    assert_eq!(ended, Status::Solved);
    assert!((with.time - without.time).abs() < 1e-3);
}

/// The published swarm searches the front as it does single lines: through every cross-section, cold, without gradients, with the
/// coefficients that the settings name. Where a warm start is asked for, it has one.
#[test]
fn the_published_swarm_finds_fronts_by_itself() {
    let settings = RacelineSettings {
        track: "stadium:300:80:12".to_owned(),
        sections: Some(60),
        objectives: vec![LineObjective::Gamma, LineObjective::Length],
        algorithm: LineAlgorithm::Thesis,
        population: 20,
        iterations: 20,
        backend: BackendChoice::Simd,
        ..RacelineSettings::default()
    };
    let front_of = |settings: &RacelineSettings| {
        let found = solve_unobserved::<Raceline>(settings, &set_up(settings).unwrap()).unwrap();
        (found.front.unwrap(), found.objectives)
    };
    let (cold, singles) = front_of(&settings);
    // Trials of mutation are evaluations beyond those of the particles.
    assert!(cold.evaluations > 20 * 20);
    // No line of its own swarm's front is as good as the reference optima, and none of these was put in.
    for (k, single) in singles.iter().enumerate() {
        let least = cold
            .objectives
            .iter()
            .map(|row| row[k])
            .fold(f64::INFINITY, f64::min);
        let exact = single.exact.as_ref().unwrap().worth(single.objective);
        assert!(least > 1.01 * exact, "{least} beside {exact}");
        assert!(single.best.worth(single.objective) > 1.01 * exact);
    }
    let heavy = RacelineSettings {
        inertia: Some(Schedule::Fixed(0.9)),
        ..settings.clone()
    };
    assert_ne!(front_of(&heavy).0.objectives, cold.objectives);
    let warm = RacelineSettings {
        warm_start: Some(true),
        ..settings
    };
    let (front, singles) = front_of(&warm);
    for (k, single) in singles.iter().enumerate() {
        let least = front
            .objectives
            .iter()
            .map(|row| row[k])
            .fold(f64::INFINITY, f64::min);
        assert!(least <= single.exact.as_ref().unwrap().worth(single.objective) * 1.001);
    }
}
