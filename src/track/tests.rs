use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

use glam::DVec2;
use proptest::prelude::*;

use super::*;
use crate::Error;

fn silverstone() -> Circuit {
    Circuit::silverstone_gp().expect("the bundled circuit is sound")
}

/// The last sample carried one step further by the circuit's own curvature.
fn end_of_lap(c: &Circuit) -> DVec2 {
    c.position_at(c.length_m - 1e-9) + 1e-9 * DVec2::from_angle(c.heading_rad[0])
}

#[test]
fn silverstone_closes_and_stays_consistent() {
    let c = silverstone();
    assert_eq!(c.station_m.len(), 5887);
    assert!(end_of_lap(&c).distance(c.centreline_m[0]) < 1e-9);
    assert!((c.total_turn_rad() + TAU).abs() < 1e-9);
    let integral: f64 = c.curvature_1pm.iter().sum::<f64>() * c.spacing_m();
    assert!((integral + TAU).abs() < 1e-9, "{integral}");
    let lap = c.heading_at(10.0 + c.length_m) - c.heading_at(10.0);
    assert!((lap + TAU).abs() < 1e-9);
    // Arc length of the positions themselves: chords are short of arcs by k^2 h^3 / 24 each.
    let n = c.station_m.len();
    let chords: f64 = (0..n)
        .map(|i| c.centreline_m[i].distance(c.centreline_m[(i + 1) % n]))
        .sum();
    assert!((c.length_m - chords).abs() < 0.05, "{chords}");
}

#[test]
fn closing_silverstone_takes_little() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/circuits/silverstone_gp.toml");
    let (circuit, closure) = Circuit::load_with_closure(&path).expect("the bundled file loads");
    println!("{closure:?}");
    assert_eq!(circuit, silverstone());
    assert!(closure.gap_m < 5.0);
    assert!(closure.curvature_change_1pm < 2e-5);
    assert!(closure.heading_change_rad < 0.01);
    assert!(closure.position_change_m < 3.0);
}

#[test]
fn circles_have_their_radius_either_way_round() {
    for anticlockwise in [true, false] {
        let (c, closure) = CurvatureTable::circle(50.0, 12.0, anticlockwise)
            .build()
            .expect("a circle is a circuit");
        let side = if anticlockwise { 50.0 } else { -50.0 };
        let centre = DVec2::new(0.0, side);
        for i in 0..500 {
            let p = c.position_at(f64::from(i) * 0.7);
            assert!((p.distance(centre) - 50.0).abs() < 1e-9);
        }
        assert!(closure.gap_m < 1e-9 && closure.curvature_change_1pm < 1e-12);
        let inner = if anticlockwise {
            c.left_edge()
        } else {
            c.right_edge()
        };
        assert!(inner.iter().all(|p| (p.distance(centre) - 44.0).abs() < 1e-9));
    }
}

/// Every step round a circle rounds the same way, so that the end misses the start by more the longer the lap is.
#[test]
fn long_circles_close() {
    for radius_m in [700.0, 1500.0, 4000.0, 30_000.0] {
        let (c, _) = CurvatureTable::circle(radius_m, 12.0, true).build().unwrap();
        let centre = DVec2::new(0.0, radius_m);
        let across_m = c.position_at(0.5 * c.length_m).distance(c.position_at(0.0));
        assert!(
            (across_m / radius_m - 2.0).abs() < 1e-9,
            "{radius_m} m: {across_m}"
        );
        let away = |p: &DVec2| (p.distance(centre) / radius_m - 1.0).abs();
        let farthest = c.centreline_m.iter().map(away).fold(0.0, f64::max);
        assert!(farthest < 1e-9, "{radius_m} m: {farthest}");
    }
}

#[test]
fn an_open_road_ends_where_it_should() {
    let mut table = CurvatureTable::circle(100.0, 10.0, true);
    table.closed = false;
    table.length_m = PI * 100.0;
    table.rows.truncate(2);
    let half = table.length_m;
    let mut last = table.rows[1].clone();
    last.station_m = half;
    table.rows.push(last);
    let (c, closure) = table.build().expect("half a circle is a road");
    assert_eq!(closure, Closure::default());
    assert!(c.position_at(half).distance(DVec2::new(0.0, 200.0)) < 1e-9);
    assert!(c.position_at(half + 50.0).distance(DVec2::new(0.0, 200.0)) < 1e-9);
    assert!((c.total_turn_rad() - PI).abs() < 1e-9);
    let beyond = c.project(DVec2::new(-20.0, 201.0), half - 3.0);
    assert_eq!(beyond.station_m, half);
}

#[test]
fn corners_and_sections_are_found_by_name() {
    let c = silverstone();
    assert_eq!(c.corners.len(), 15);
    assert_eq!(c.corners[0].name, "Abbey");
    for name in ["Luffield", "luff", "LUFFIELD", "becketts", "the loop", "Village"] {
        assert!(c.section(name).is_ok(), "{name}");
    }
    for name in ["v", "", "Monza"] {
        let text = c.section(name).expect_err(name).to_string();
        assert!(text.contains("Abbey, Village/The Loop, Luffield"), "{text}");
    }
    let text = Circuit::bundled("monza").expect_err("not bundled").to_string();
    assert!(text.contains("`monza`") && text.contains("silverstone_gp"));
    assert!(Circuit::bundled("Silverstone-GP").is_ok());
}

#[test]
fn a_point_is_found_without_a_hint() {
    let c = silverstone();
    for s in [0.0, 905.0, 1050.0, 2100.0, 5519.0, 5886.9] {
        let point = c.position_at(s) + 3.0 * DVec2::from_angle(c.heading_at(s)).perp();
        let found = c.project_anywhere(point);
        assert!((found.station_m - s).abs() < 1e-6, "{s} {found:?}");
        assert!((found.lateral_offset_m - 3.0).abs() < 1e-6);
    }
}

proptest! {
    #[test]
    fn projection_round_trips(s in 0.0..5887.0f64, n in -7.5..7.5f64, off in -4.0..4.0f64) {
        let c = silverstone();
        let heading = c.heading_at(s);
        let point = c.position_at(s) + n * DVec2::from_angle(heading).perp();
        let found = c.project(point, s + off);
        let along = (found.station_m - s + 0.5 * c.length_m).rem_euclid(c.length_m)
            - 0.5 * c.length_m;
        prop_assert!(along.abs() < 1e-6, "{found:?}");
        prop_assert!((found.lateral_offset_m - n).abs() < 1e-6, "{found:?}");
        prop_assert!((found.heading_error_rad(heading + 0.1) - 0.1).abs() < 1e-6);
        prop_assert!((found.curvature_1pm - c.curvature_at(s)).abs() < 1e-6);
    }

    #[test]
    fn any_nearly_closed_table_closes(seed in prop::collection::vec(-0.002..0.002f64, 8)) {
        let mut table = CurvatureTable::circle(150.0, 10.0, false);
        let rows = seed.len();
        table.rows = (0..rows)
            .map(|i| CurvatureRow {
                station_m: table.length_m * i as f64 / rows as f64,
                curvature_1pm: -1.0 / 150.0 + 0.1 * seed[i],
                ..table.rows[0].clone()
            })
            .collect();
        let (c, closure) = table.build().expect("nearly closed");
        prop_assert!(end_of_lap(&c).distance(DVec2::ZERO) < 1e-9);
        prop_assert!((c.total_turn_rad() + TAU).abs() < 1e-9);
        prop_assert!(closure.curvature_change_1pm < 5e-4, "{closure:?}");
    }
}

#[test]
fn wild_questions_get_answers_not_panics() {
    let c = silverstone();
    for s in [f64::NAN, f64::INFINITY, -1e-20, -5.0, 1e12, c.length_m] {
        let _ = (c.curvature_at(s), c.heading_at(s), c.widths_at(s));
        let _ = c.project(DVec2::new(1e6, -1e6), s);
        let _ = c.project(DVec2::NAN, s);
    }
    assert_eq!(c.curvature_at(-1e-20), c.curvature_at(0.0));
    let far = c.project(DVec2::new(1e6, -1e6), 1000.0);
    assert!((far.station_m - 1000.0).abs() < 300.0);
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn with(toml: &str, table: &str) -> (Self, PathBuf) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("own.toml");
        std::fs::write(&path, toml).expect("written");
        std::fs::write(folder.path().join("own.csv"), table).expect("written");
        (Self(folder), path)
    }
}

const TOML: &str = "name = \"Own\"\ncurvature_table = \"own.csv\"\nlength_m = 628.3\nwidth_m = 10\n";
const TABLE: &str = "# a circle\nstation_m,curvature_1pm\n0,0.01\n# on\n\n200,0.01\n400,0.01\n";

#[test]
fn a_users_own_circuit_loads() {
    let (folder, path) = Folder::with(TOML, TABLE);
    let c = Circuit::load(&path).expect("a circle");
    assert_eq!((c.name.as_str(), c.length_m), ("Own", 628.3));
    assert_eq!(c.widths_at(100.0), (5.0, 5.0));
    let widths = "station_m,curvature_1pm,width_left_m,width_right_m\n0,.01,4,6\n200,.01,4,6\n400,.01,8,6\n";
    std::fs::write(folder.0.path().join("own.csv"), widths).expect("written");
    let c = Circuit::load(&path).expect("a circle");
    let (left, right) = c.widths_at(300.0);
    assert!((left - 6.0).abs() < 1e-9 && (right - 6.0).abs() < 1e-9);
}

/// The first zone passes the start line; an open road has none that does.
#[test]
fn zones_of_the_drs_come_from_the_file_and_reach_the_cross_sections() {
    let zone = |start: f64, end: f64| format!("[[drs_zones]]\nstart_m = {start}\nend_m = {end}\n");
    let (_folder, path) = Folder::with(
        &format!("{TOML}{}{}", zone(600.0, 50.0), zone(100.0, 200.0)),
        TABLE,
    );
    let c = Circuit::load(&path).expect("a circle");
    assert_eq!(c.drs_zones_m, [[600.0, 50.0], [100.0, 200.0]]);
    for (station, wanted) in [
        (0.0, true),
        (50.0, false),
        (100.0, true),
        (250.0, false),
        (620.0, true),
        (630.0, true),
    ] {
        assert_eq!(c.drs_at(station), wanted, "{station}");
    }
    let sections = c.cross_sections(100).expect("a road");
    let open = sections.drs.iter().filter(|open| **open).count();
    // The middles of 5, 8 and 16 stretches of 6.283 m lie within.
    assert_eq!((sections.drs.len(), open), (100, 29));
    assert_eq!(
        sections.stretch(10, 20).expect("a stretch").drs,
        sections.drs[10..30]
    );
    assert!(silverstone().cross_sections(100).expect("a road").drs.is_empty());
    for (toml, part) in [
        (zone(10.0, 700.0), "field end_m: found 700, expected 0 to 628.3"),
        (
            zone(10.0, 10.0),
            "found 10, expected another station than start_m, 10",
        ),
        (
            format!("closed = false\n{}", zone(20.0, 10.0)),
            "beyond it on an open road",
        ),
    ] {
        let (_folder, path) = Folder::with(&format!("{TOML}{toml}"), TABLE);
        let said = Circuit::load(&path).expect_err("refused").to_string();
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn names_that_files_cannot_have_or_share_are_refused() {
    let section = |name: &str, start: u32| {
        format!(
            "[[sections]]\nname = \"{name}\"\nstart_m = {start}\nend_m = {}\n",
            start + 5
        )
    };
    let long = "n".repeat(121);
    for (toml, parts) in [
        (
            format!("{TOML}{}{}", section("A b", 0), section("a/B", 10)),
            ["line 10, field name", "`a/B`", "differs from `A b`"],
        ),
        (
            format!("{TOML}{}", section(&long, 0)),
            ["line 6, field name", "121 bytes", "at most 120 bytes"],
        ),
        (
            TOML.replace("Own", &long),
            ["line 1, field name", "121 bytes", "at most 120 bytes"],
        ),
    ] {
        let (_folder, path) = Folder::with(&toml, TABLE);
        let said = Circuit::load(&path).expect_err("refused").to_string();
        for part in parts {
            assert!(said.contains(part), "{said}");
        }
    }
    let (_folder, path) = Folder::with(&TOML.replace("Own", &long[1..]), TABLE);
    drop(Circuit::load(&path).expect("a name of 120 bytes"));
}

#[test]
fn mistakes_are_named_by_file_line_and_field() {
    let section = "[[sections]]\nname = \"A\"\nstart_m = 10\nend_m = 5\n";
    let cases: [(String, String, &[&str]); 15] = [
        (
            format!("{TOML}colour = 1\n"),
            TABLE.into(),
            &["own.toml", "line 5", "`colour`", "length_m"],
        ),
        (
            TOML.replace("628.3", "-3"),
            TABLE.into(),
            &["own.toml", "line 3, field length_m", "-3", "10 to"],
        ),
        (
            TOML.replace("628.3", "\"long\""),
            TABLE.into(),
            &["own.toml", "line 3", "found \"long\""],
        ),
        (
            TOML.replace("width_m = 10", "width_m = nan"),
            TABLE.into(),
            &["line 4, field width_m", "NaN"],
        ),
        (
            TOML.replace("name = \"Own\"\n", ""),
            TABLE.into(),
            &["own.toml", "missing field `name`"],
        ),
        (
            format!("{TOML}{section}"),
            TABLE.into(),
            &["line 8, field end_m", "found 5", "10"],
        ),
        (
            TOML.replace("width_m = 10\n", ""),
            TABLE.into(),
            &["own.csv", "width_left_m"],
        ),
        (
            TOML.into(),
            TABLE.replace("200,0.01", "200,fast"),
            &["own.csv", "line 6, field curvature_1pm", "`fast`"],
        ),
        (
            TOML.into(),
            TABLE.replace("200,0.01", "200,NaN"),
            &["line 6, field curvature_1pm", "`NaN`"],
        ),
        (
            TOML.into(),
            TABLE.replace("400,", "100,"),
            &["line 7, field station_m", "100"],
        ),
        (
            TOML.into(),
            TABLE.replace("200,0.01", "200"),
            &["own.csv", "line 6", "1 fields"],
        ),
        (
            TOML.into(),
            TABLE.replace("curvature_1pm", "kappa"),
            &["own.csv", "line 2", "`kappa`"],
        ),
        (
            TOML.into(),
            TABLE.replace("0.01", "0.02"),
            &["own.csv", "720", "360"],
        ),
        (
            TOML.into(),
            "station_m,curvature_1pm\n0,0\n100,0.062832\n200,0\n".into(),
            &["own.csv", "away from the start"],
        ),
        (TOML.into(), String::new(), &["own.csv", "station_m"]),
    ];
    for (toml, table, wanted) in cases {
        let (_folder, path) = Folder::with(&toml, &table);
        let error = Circuit::load(&path).expect_err("refused");
        assert!(matches!(error, Error::Input { .. }), "{error}");
        let text = error.to_string();
        for part in wanted {
            assert!(text.contains(part), "`{part}` is not in: {text}");
        }
    }
    let absent = Circuit::load("no/such/circuit.toml").expect_err("absent");
    assert!(matches!(absent, Error::Io { .. }));
}
