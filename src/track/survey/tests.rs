//! Every format, read right and refused by place.

use super::*;
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

fn parse(text: &str, name: &str, options: &SurveyOptions) -> Result<Survey> {
    Survey::parse(text.as_bytes(), name, options)
}

fn refusal(text: &str, name: &str, options: &SurveyOptions) -> String {
    match parse(text, name, options) {
        Ok(_) => panic!("not refused: {}", &text[..text.len().min(300)]),
        Err(error) => error.to_string(),
    }
}

pub(super) fn wide() -> SurveyOptions {
    SurveyOptions {
        width_m: Some(8.0),
        ..SurveyOptions::default()
    }
}

/// An oval of 60 points, anticlockwise.
pub(super) fn oval() -> Vec<DVec2> {
    (0..60)
        .map(|i| TAU * f64::from(i) / 60.0)
        .map(|t| DVec2::new(200.0 * t.cos(), 120.0 * t.sin()))
        .collect()
}

pub(super) fn racetrack() -> String {
    let mut text = "# x_m,y_m,w_tr_right_m,w_tr_left_m\n".to_owned();
    for p in oval() {
        let _ = writeln!(text, "{:.6},{:.6},5.5,6.25", p.x, p.y);
    }
    text
}

/// Places about Silverstone of points on a plane, by the lengths of a degree there on WGS 84.
fn places(points: &[DVec2]) -> Vec<(f64, f64)> {
    let metres = (111268.7, 68570.8);
    let place = |p: &DVec2| (52.07 + p.y / metres.0, -1.016 + p.x / metres.1);
    points.iter().map(place).collect()
}

pub(super) fn gpx(points: &[DVec2], version: &str) -> String {
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<gpx version=\"{version}\" creator=\"t\" \
         xmlns=\"http://www.topografix.com/GPX/{}\">\n<trk><name>Oval &amp; more</name><trkseg>\n",
        version.replace('.', "/")
    );
    for (lat, lon) in places(points) {
        let _ = writeln!(
            text,
            "<trkpt lat=\"{lat:.9}\" lon=\"{lon:.9}\"><ele>150</ele></trkpt>"
        );
    }
    text + "</trkseg></trk>\n</gpx>\n"
}

pub(super) fn kml(points: &[DVec2]) -> String {
    let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\">\n<Document>\
                    <Placemark><name>Oval</name><LineString><coordinates>\n"
        .to_owned();
    for (lat, lon) in places(points) {
        let _ = writeln!(text, "{lon:.9},{lat:.9},0");
    }
    text + "</coordinates></LineString></Placemark></Document></kml>\n"
}

pub(super) fn latitudes(points: &[DVec2]) -> String {
    let mut text = "time,Latitude,Longitude\n".to_owned();
    for (i, (lat, lon)) in places(points).into_iter().enumerate() {
        let _ = writeln!(text, "{i},{lat:.9},{lon:.9}");
    }
    text
}

pub(super) fn edges(left: &[DVec2], right: &[DVec2]) -> String {
    let mut text = "left_x_m,left_y_m,right_x_m,right_y_m\n".to_owned();
    let cell = |p: Option<&DVec2>| p.map_or_else(|| ",".to_owned(), |p| format!("{},{}", p.x, p.y));
    for i in 0..left.len().max(right.len()) {
        let _ = writeln!(text, "{},{}", cell(left.get(i)), cell(right.get(i)));
    }
    text
}

pub(super) fn ring(radius: f64, points: u32) -> Vec<DVec2> {
    (0..points)
        .map(|i| radius * DVec2::from_angle(TAU * f64::from(i) / f64::from(points)))
        .collect()
}

/// A log with GPS: an out lap, two laps and an in lap, each once round the oval.
pub(super) fn log() -> String {
    let mut text = "# made up\ntime_s,lap,lap_complete,gps_lat,gps_long\n".to_owned();
    for i in 0..1200 {
        let t = TAU * f64::from(i) / 300.0;
        let lap = i / 300;
        let radius = if lap == 2 { 1.01 } else { 1.0 };
        let (lat, lon) = places(&[radius * DVec2::new(200.0 * t.cos(), 120.0 * t.sin())])[0];
        let complete = u8::from(lap == 1 || lap == 2);
        let _ = writeln!(
            text,
            "{:.2},{lap},{complete},{lat:.9},{lon:.9}",
            f64::from(i) * 0.1
        );
    }
    text
}

/// Points without regard to where the origin is.
fn shape(points: &[DVec2]) -> Vec<DVec2> {
    let middle = points.iter().sum::<DVec2>() / points.len() as f64;
    points.iter().map(|p| p - middle).collect()
}

fn furthest(a: &[DVec2], b: &[DVec2]) -> f64 {
    assert_eq!(a.len(), b.len());
    let gaps = shape(a).into_iter().zip(shape(b)).map(|(p, q)| p.distance(q));
    gaps.fold(0.0, f64::max)
}

#[test]
fn the_racetrack_database_is_read() {
    let options = SurveyOptions::default();
    let survey = parse(&racetrack(), "oval.csv", &options).unwrap();
    assert!(survey.closed && survey.name == "oval");
    assert!(furthest(&survey.centre_m, &oval()) < 1e-5);
    assert_eq!(
        (survey.right_m[3], survey.left_m[3], survey.lines[0]),
        (5.5, 6.25, 2)
    );
    // A header without its hash, other separators, comments and blank lines between, the first point repeated.
    let first = racetrack().lines().nth(1).unwrap().to_owned();
    let other = format!("\u{feff}{}\n# on\n\n{first}\n", &racetrack()[2..]).replace(',', "; ");
    let again = parse(&other, "oval.csv", &options).unwrap();
    assert_eq!(
        (&again.centre_m, &again.left_m),
        (&survey.centre_m, &survey.left_m)
    );
    assert_eq!(again.lines.len(), 60);
    // As a spreadsheet writes it where numbers have decimal commas.
    let commas = racetrack().replace(',', ";").replace('.', ",");
    let again = parse(&commas, "oval.csv", &options).unwrap();
    assert_eq!((again.centre_m, again.left_m), (survey.centre_m, survey.left_m));
}

#[test]
fn a_centreline_takes_its_width_from_a_column_or_from_the_user() {
    let mut bare = "x_m,y_m\n".to_owned();
    let mut whole = "x_m,y_m,width_m\n".to_owned();
    for p in oval() {
        let _ = writeln!(bare, "{},{}", p.x, p.y);
        let _ = writeln!(whole, "{},{},9", p.x, p.y);
    }
    assert_eq!(parse(&bare, "a.csv", &wide()).unwrap().left_m[0], 4.0);
    assert_eq!(parse(&whole, "a.csv", &wide()).unwrap().left_m[0], 4.5);
    let text = refusal(&bare, "a.csv", &SurveyOptions::default());
    assert!(
        text.contains("width of the road") && text.contains("width_m"),
        "{text}"
    );
}

#[test]
fn the_globe_is_read_from_gpx_kml_and_csv() {
    for (text, name) in [
        (gpx(&oval(), "1.1"), "a.gpx"),
        (gpx(&oval(), "1.0"), "a.gpx"),
        (
            gpx(&oval(), "1.1")
                .replace("<trkseg>", "")
                .replace("</trkseg>", "")
                .replace("trkpt", "rtept")
                .replace("trk>", "rte>"),
            "r.gpx",
        ),
        (kml(&oval()), "a.kml"),
        (kml(&oval()).replace("LineString", "LinearRing"), "a.kml"),
        (latitudes(&oval()), "a.csv"),
    ] {
        let survey = parse(&text, name, &wide()).unwrap();
        assert!(survey.closed, "{name}");
        // Over the oval's 240 m the length of a degree of longitude changes by 2e-5.
        assert!(furthest(&survey.centre_m, &oval()) < 0.01, "{name}");
        assert_eq!(survey.left_m.len(), 60);
    }
    let named = parse(&gpx(&oval(), "1.1"), "a.gpx", &wide()).unwrap();
    assert_eq!(
        (named.name.as_str(), named.lines[0], named.lines[59]),
        ("Oval & more", 4, 63)
    );
    let track: String = places(&oval())
        .iter()
        .map(|(lat, lon)| format!("<gx:coord>{lon} {lat} 0</gx:coord>\n"))
        .collect();
    let track = format!(
        "<kml xmlns=\"http://www.opengis.net/kml/2.2\" xmlns:gx=\"http://www.google.com/kml/ext/2.2\"><Placemark>\
         <gx:Track>{track}</gx:Track></Placemark></kml>"
    );
    assert_eq!(parse(&track, "t.kml", &wide()).unwrap().centre_m.len(), 60);
}

#[test]
fn an_open_road_is_told_from_a_lap() {
    let hill: Vec<DVec2> = (0..80)
        .map(|i| DVec2::new(10.0 * f64::from(i), 60.0 * (0.1 * f64::from(i)).sin()))
        .collect();
    assert!(!parse(&gpx(&hill, "1.1"), "hill.gpx", &wide()).unwrap().closed);
    // Most of an oval: neither a lap nor a hill.
    let most: Vec<DVec2> = (0..232)
        .map(|i| TAU * f64::from(i) / 240.0)
        .map(|t| DVec2::new(200.0 * t.cos(), 120.0 * t.sin()))
        .collect();
    let most = &most[..];
    let text = refusal(&gpx(most, "1.1"), "most.gpx", &wide());
    assert!(
        text.contains("closed or open") && text.contains("line 4 and line 235"),
        "{text}"
    );
    for closed in [true, false] {
        let said = SurveyOptions {
            closed: Some(closed),
            ..wide()
        };
        assert_eq!(
            parse(&gpx(most, "1.1"), "most.gpx", &said).unwrap().closed,
            closed
        );
    }
    let said = SurveyOptions {
        closed: Some(true),
        ..wide()
    };
    assert!(refusal(&gpx(&hill, "1.1"), "hill.gpx", &said).contains("closed"));
}

#[test]
fn a_lap_of_a_log_becomes_a_line() {
    let options = wide();
    let survey = parse(&log(), "outing.csv", &options).unwrap();
    assert!(survey.closed && survey.name == "outing, lap 1", "{}", survey.name);
    let length: f64 = survey.centre_m.windows(2).map(|p| p[0].distance(p[1])).sum();
    let around = |x: f64, y: f64| PI * (3.0 * (x + y) - ((3.0 * x + y) * (x + 3.0 * y)).sqrt());
    assert!((length - around(200.0, 120.0)).abs() < 8.0, "{length}");
    let second = SurveyOptions {
        lap: Some(2),
        ..options.clone()
    };
    let second = parse(&log(), "outing.csv", &second).unwrap();
    assert!(second.centre_m[0].x > survey.centre_m[0].x + 1.0);
    assert_eq!(second.lines[0], 603);
    let none = SurveyOptions {
        lap: Some(3),
        ..options.clone()
    };
    let text = refusal(&log(), "outing.csv", &none);
    assert!(text.contains("lap 3") && text.contains("one of 1, 2"), "{text}");
    let blind = log().replace("gps_lat", "oil");
    assert!(refusal(&blind, "outing.csv", &options).contains("channel latitude"));
    let lost = log().replacen("\n45.00,1,1,5", "\n45.00,1,1,x5", 1);
    let text = refusal(&lost, "outing.csv", &options);
    assert!(text.contains("line 453") && text.contains("x5"), "{text}");
}

/// A log with lap numbers alone, whose first lap begins and whose last lap ends half-way round.
#[test]
fn the_part_of_a_lap_that_a_log_begins_with_is_no_line() {
    let numbered = |first: u32, last: u32| {
        let mut text = "time_s,lap,gps_lat,gps_long\n".to_owned();
        for i in first..last {
            let t = TAU * f64::from(i) / 300.0;
            let (lat, lon) = places(&[DVec2::new(200.0 * t.cos(), 120.0 * t.sin())])[0];
            let _ = writeln!(
                text,
                "{:.2},{},{lat:.9},{lon:.9}",
                f64::from(i) * 0.1,
                1 + i / 300
            );
        }
        text
    };
    let name = |text: &str| parse(text, "outing.csv", &wide()).unwrap().name;
    assert_eq!(name(&numbered(150, 1050)), "outing, lap 2");
    // From line to line the first lap is one, as the second says.
    assert_eq!(name(&numbered(0, 600)), "outing, lap 1");
    let parts = refusal(&numbered(150, 500), "outing.csv", &wide());
    assert!(parts.contains("no complete lap"), "{parts}");
}

#[test]
fn a_motec_export_with_gps_becomes_a_line() {
    let mut text = "\"Format\",\"MoTeC CSV File\"\n\"Beacon Markers\",\"10.0 40.0 70.0\"\n\n\"Time\",\"GPS Latitude\",\"GPS \
                    Longitude\"\n\"s\",\"deg\",\"deg\"\n\n"
        .to_owned();
    for i in 0..800 {
        let t = TAU * f64::from(i) / 300.0;
        let (lat, lon) = places(&[DVec2::new(200.0 * t.cos(), 120.0 * t.sin())])[0];
        let _ = writeln!(text, "\"{:.1}\",\"{lat:.9}\",\"{lon:.9}\"", f64::from(i) * 0.1);
    }
    let survey = parse(&text, "m.csv", &wide()).unwrap();
    assert!(survey.closed && survey.name == "m, lap 1");
    let elsewhere = text.replace("10.0 40.0 70.0", "-90.0 -60.0 200.0 230.0");
    assert!(refusal(&elsewhere, "m.csv", &wide()).contains("no complete lap"));
    let text = refusal(
        &text.replace("\"deg\",\"deg\"", "\"V\",\"deg\""),
        "m.csv",
        &wide(),
    );
    assert!(
        text.contains("channel GPS Latitude: found \"V\", expected deg, rad or min"),
        "{text}"
    );
}

#[test]
fn two_edges_have_a_middle_whatever_their_points() {
    let (inner, outer) = (ring(95.0, 201), ring(105.0, 333));
    // Anticlockwise the left edge is the inner one.
    let survey = parse(&edges(&inner, &outer), "e.csv", &SurveyOptions::default()).unwrap();
    assert!(survey.closed);
    for (i, p) in survey.centre_m.iter().enumerate() {
        assert!((p.length() - 100.0).abs() < 0.05, "{p}");
        assert!((survey.left_m[i] - 5.0).abs() < 0.05 && (survey.right_m[i] - 5.0).abs() < 0.05);
    }
    // Another start of the right edge changes little.
    let mut turned = outer.clone();
    turned.rotate_left(100);
    let again = parse(&edges(&inner, &turned), "e.csv", &SurveyOptions::default()).unwrap();
    assert!(again.centre_m.iter().all(|p| (p.length() - 100.0).abs() < 0.05));
    // Clockwise.
    let (mut inner, mut outer) = (inner, outer);
    inner.reverse();
    outer.reverse();
    assert!(parse(&edges(&outer, &inner), "e.csv", &SurveyOptions::default()).is_ok());
    // Open, one side with three times the points.
    let side = |y: f64, n: u32| -> Vec<DVec2> {
        (0..=n)
            .map(|i| 600.0 * f64::from(i) / f64::from(n))
            .map(|x| DVec2::new(x, y + 20.0 * (x / 60.0).sin()))
            .collect()
    };
    let road = parse(
        &edges(&side(4.0, 60), &side(-4.0, 180)),
        "e.csv",
        &SurveyOptions::default(),
    )
    .unwrap();
    assert!(!road.closed);
    for (p, w) in road.centre_m.iter().zip(&road.left_m) {
        let middle = 20.0 * (p.x / 60.0).sin();
        assert!((p.y - middle).abs() < 0.6, "{p}");
        assert!(*w < 4.1 && *w > 3.6, "{w}");
    }
    road.smoothed(&crate::track::Smoothing::default())
        .unwrap()
        .cross_sections(100)
        .unwrap();
}

#[test]
fn the_edges_of_a_circuit_give_it_back() {
    let circuit = crate::track::Circuit::silverstone_gp().unwrap();
    let left: Vec<DVec2> = circuit.left_edge().into_iter().step_by(3).collect();
    let right: Vec<DVec2> = circuit.right_edge().into_iter().step_by(7).collect();
    let survey = parse(&edges(&left, &right), "e.csv", &SurveyOptions::default()).unwrap();
    assert!(survey.closed && survey.centre_m.len() > 1900);
    // Seven samples outside the tightest bend, of 16 m radius, are a chord of 10.3 m on a radius of 23.5 m: it cuts
    // the edge by 0.56 m, which the width loses whole and the middle by half.
    for (i, &p) in survey.centre_m.iter().enumerate() {
        let foot = circuit.project_anywhere(p);
        assert!(foot.lateral_offset_m.abs() < 0.3, "{foot:?}");
        let width = survey.left_m[i] + survey.right_m[i];
        assert!((width - 15.0).abs() < 0.6, "{width} at {foot:?}");
    }
    let cross_sections = survey.as_surveyed().unwrap();
    let cross_sections = cross_sections.cross_sections(360).unwrap();
    assert!(
        (cross_sections.length_m - circuit.length_m).abs() < 5.0,
        "{}",
        cross_sections.length_m
    );
}

#[test]
fn edges_that_cannot_be_are_refused() {
    let (inner, outer) = (ring(95.0, 200), ring(105.0, 200));
    let options = SurveyOptions::default();
    let swapped = refusal(&edges(&outer, &inner), "e.csv", &options);
    assert!(
        swapped.contains("swapped") && swapped.contains("to the right"),
        "{swapped}"
    );
    let mut backwards = outer.clone();
    backwards.reverse();
    let against = refusal(&edges(&inner, &backwards), "e.csv", &options);
    assert!(
        against.contains("right edge") && against.contains("run against"),
        "{against}"
    );
    // Edges that change sides half way round.
    let weave = |sign: f64| -> Vec<DVec2> {
        (0..200)
            .map(|i| TAU * f64::from(i) / 200.0)
            .map(|t| (100.0 + sign * 5.0 * (t + 0.7).cos()) * DVec2::from_angle(t))
            .collect()
    };
    let woven = refusal(&edges(&weave(-1.0), &weave(1.0)), "e.csv", &options);
    assert!(
        woven.contains("line ") && woven.contains("do not cross"),
        "{woven}"
    );
    let mixed = refusal(&edges(&inner, &outer[..120]), "e.csv", &options);
    assert!(
        mixed.contains("closed left edge and a") || mixed.contains("open"),
        "{mixed}"
    );
    let crossing = refusal(
        &edges(&inner, &{
            let mut tangled = outer;
            tangled.swap(50, 53);
            tangled
        }),
        "e.csv",
        &options,
    );
    assert!(
        crossing.contains("line 5") && crossing.contains("right edge"),
        "{crossing}"
    );
}

#[test]
fn mistakes_are_named_by_line() {
    let good = racetrack();
    let with = |line: usize, text: &str| -> String {
        let mut lines: Vec<&str> = good.lines().collect();
        lines[line - 1] = text;
        lines.join("\n")
    };
    let line = |n: usize| good.lines().nth(n - 1).unwrap();
    let cases: Vec<(String, &str, &[&str])> = vec![
        (String::new(), "a.csv", &["line 1", "no rows"]),
        ("a,b\n1,2\n".into(), "a.csv", &["line 1", "`a,b`", "x_m,y_m"]),
        ("x_m,y_m,x_m\n".into(), "a.csv", &["line 1, column 3", "second"]),
        ("x_m,w_tr_left_m\n1,2\n".into(), "a.csv", &["header"]),
        (
            with(7, "nan,1,5,5"),
            "a.csv",
            &["line 7, column 1 (x_m)", "`nan`"],
        ),
        (
            with(7, "1,inf,5,5"),
            "a.csv",
            &["line 7, column 2 (y_m)", "`inf`"],
        ),
        (with(7, "1,2,5"), "a.csv", &["line 7", "3 cells", "4"]),
        (with(7, "1,2,5,5,5"), "a.csv", &["line 7", "5 cells"]),
        (
            with(7, "1,2,five,5"),
            "a.csv",
            &["line 7, column 3 (w_tr_right_m)", "`five`"],
        ),
        (
            with(7, "1,2,-1,5"),
            "a.csv",
            &["line 7, column 3", "`-1`", "0 to 200"],
        ),
        (with(7, "1,2,900,5"), "a.csv", &["line 7, column 3", "`900`"]),
        (
            with(9, &line(9).replace("5.5,6.25", "0,0")),
            "a.csv",
            &["line 9, width", "0.1 m"],
        ),
        (
            with(8, line(7)),
            "a.csv",
            &["line 8", "the same point as in line 7"],
        ),
        (with(8, line(5)), "a.csv", &["line ", "degrees at one point"]),
        (
            good.lines().take(4).collect::<Vec<_>>().join("\n"),
            "a.csv",
            &["3 points", "open"],
        ),
        (
            "x_m,y_m,width_m\n0,0,5\n".into(),
            "a.csv",
            &["1 points", "at least 4"],
        ),
        (
            "lat,lon\n91,0\n".into(),
            "a.csv",
            &["line 2, column 1", "`91`", "-90 to 90"],
        ),
        (
            "lat,lon\n1,-181\n".into(),
            "a.csv",
            &["line 2, column 2", "`-181`"],
        ),
        (
            "lat,lon\n1,1\n1,1.001\n1,60\n".into(),
            "a.csv",
            &["line ", "km from the middle"],
        ),
        ("<gpx".into(), "a.gpx", &["line 1"]),
        ("<svg/>".into(), "a.gpx", &["line 1", "<svg>", "<gpx> or <kml>"]),
        (
            "<gpx/>".into(),
            "a.gpx",
            &["whole file", "0 of them", "exactly one"],
        ),
        (
            "<kml/>".into(),
            "a.kml",
            &["whole file", "0 of them", "LineString"],
        ),
        (
            "<!DOCTYPE x [<!ENTITY a \"b\">]>\n<gpx>&a;</gpx>".into(),
            "a.gpx",
            &["line 1", "DTD"],
        ),
        (
            gpx(&oval(), "1.1").replacen("lat=\"52.0", "lat=\"152.0", 1),
            "a.gpx",
            &["line 4", "`152.0", "-90 to 90"],
        ),
        (
            gpx(&oval(), "1.1").replacen("lon=", "long=", 1),
            "a.gpx",
            &["line 4", "``", "-180 to 180"],
        ),
        (
            kml(&oval()).replacen("-1.01", "-1.x1", 1),
            "a.kml",
            &["line ", "`-1.x1", "degrees"],
        ),
        (
            gpx(&oval(), "1.1").replace(
                "</gpx>",
                "<trk><trkseg><trkpt lat='1' lon='1'/></trkseg></trk>\n</gpx>",
            ),
            "a.gpx",
            &["line 65", "2 of them", "exactly one trk"],
        ),
    ];
    for (text, name, wanted) in cases {
        let refused = refusal(&text, name, &wide());
        assert!(refused.contains(name), "{refused}");
        for part in wanted {
            assert!(refused.contains(part), "`{part}` is not in: {refused}");
        }
    }
    let narrow = SurveyOptions {
        width_m: Some(f64::NAN),
        ..SurveyOptions::default()
    };
    assert!(refusal(&good, "a.csv", &narrow).contains("width_m"));
    let missing = Survey::read("no/such/file.csv", &wide()).unwrap_err();
    assert!(matches!(missing, Error::Io { action: "read", .. }));
}

#[test]
fn a_line_that_crosses_itself_is_refused_where_it_does() {
    let eight: Vec<DVec2> = (0..100)
        .map(|i| TAU * f64::from(i) / 100.0 + 0.02)
        .map(|t| DVec2::new(200.0 * t.sin(), 200.0 * (2.0 * t).sin()))
        .collect();
    // Steep, it is a bridge by itself. At a shallow angle, it has to be said to be one.
    assert!(parse(&gpx(&eight, "1.1"), "a.gpx", &wide()).is_ok());
    let eight: Vec<DVec2> = eight.iter().map(|p| DVec2::new(p.x, 0.1 * p.y)).collect();
    let text = refusal(&gpx(&eight, "1.1"), "a.gpx", &wide());
    assert!(
        text.contains("crosses itself") && text.contains("line "),
        "{text}"
    );
    let bridged = SurveyOptions { bridges: 1, ..wide() };
    assert!(parse(&gpx(&eight, "1.1"), "a.gpx", &bridged).is_ok());
}

/// A loop of a survey's own is a knot, and no bridge.
#[test]
fn bridges_have_road_between_their_decks() {
    let crossing = |size: f64| {
        let loop_of = [
            [0.0, 0.0],
            [10.0, 0.0],
            [11.0, 1.0],
            [10.0, 2.0],
            [9.0, 1.0],
            [9.0, -10.0],
        ];
        let points = loop_of.map(|p| size * DVec2::from(p));
        super::check::check_crossings(&points, false, 0, "a.csv", &crate::error::Place::point)
    };
    let refused = crossing(10.0).unwrap_err().to_string();
    assert!(refused.contains("crosses itself"), "{refused}");
    assert!(crossing(30.0).is_ok());
}

#[test]
fn more_points_than_may_be_are_refused() {
    let mut text = "x_m,y_m\n".to_owned();
    for i in 0..=MOST_POINTS {
        let _ = writeln!(text, "{i},0");
    }
    let refused = refusal(&text, "a.csv", &wide());
    assert!(
        refused.contains("line 1000002") && refused.contains("1000000"),
        "{refused}"
    );
}

#[test]
fn a_toml_file_says_what_a_survey_cannot() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("oval.gpx"), gpx(&oval(), "1.1")).unwrap();
    let path = folder.path().join("oval.toml");
    let toml = "survey = \"oval.gpx\"\nname = \"The oval\"\nwidth_m = 9\nsmoothing_line_m = 0.1\n\n[[sections]]\nname = \
                \"Top\"\nstart_m = 100\nend_m = 300\n\n[[corners]]\nname = \"One\"\nstation_m = 20\n";
    std::fs::write(&path, toml).unwrap();
    let circuit = crate::track::Circuit::load(&path).unwrap();
    let (left, right) = circuit.widths_at(50.0);
    assert!(
        circuit.name == "The oval" && (left + right - 9.0).abs() < 1e-6,
        "{left} {right}"
    );
    assert!(circuit.section("top").is_ok() && circuit.corners[0].name == "One");
    let cross_sections = crate::track::Track::load(path.to_str().unwrap()).unwrap();
    let cross_sections = cross_sections.cross_sections(100, false).unwrap();
    assert_eq!(
        (cross_sections.sections.len(), cross_sections.corners.len()),
        (1, 1)
    );
    for (from, to, part) in [
        ("width_m = 9", "width_m = -9", "line 3, field width_m"),
        ("end_m = 300", "end_m = 90000", "field end_m"),
        ("name = \"The oval\"", "colour = 1", "line 2"),
    ] {
        std::fs::write(&path, toml.replace(from, to)).unwrap();
        let text = crate::track::Circuit::load(&path).unwrap_err().to_string();
        assert!(text.contains("oval.toml") && text.contains(part), "{text}");
    }
}
