//! Cross-sections, reference lines, shapes and exports.

use super::*;
use glam::DVec2;
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

fn polygon_length(points: &[DVec2], closed: bool) -> f64 {
    let open: f64 = points.windows(2).map(|p| p[0].distance(p[1])).sum();
    open + if closed {
        points[0].distance(points[points.len() - 1])
    } else {
        0.0
    }
}

fn line_length(cross_sections: &CrossSections, alpha: f64) -> f64 {
    polygon_length(
        &cross_sections.points(&vec![alpha; cross_sections.len()]),
        cross_sections.closed,
    )
}

/// A survey of a line at even steps, with one width on each side.
fn survey(points: Vec<DVec2>, closed: bool, width_m: f64) -> Survey {
    let n = points.len();
    Survey {
        name: "test".into(),
        source: "test.csv".into(),
        closed,
        centre_m: points,
        left_m: vec![0.5 * width_m; n],
        right_m: vec![0.5 * width_m; n],
        lines: Vec::new(),
        sections: Vec::new(),
        corners: Vec::new(),
        drs_zones_m: Vec::new(),
        bridges: 0,
        z_m: Vec::new(),
        bank_deg: Vec::new(),
        friction: Vec::new(),
        height_gap_m: 0.0,
    }
}

/// A road that goes out, turns by half a turn of this radius to the left, and comes back.
fn hairpin(radius: f64, width: f64) -> Survey {
    let mut points: Vec<DVec2> = (0..40).map(|i| DVec2::new(5.0 * f64::from(i), 0.0)).collect();
    let bend = (PI * radius / 3.0).ceil() as i32;
    let start = DVec2::new(200.0, 0.0);
    for i in 0..=bend {
        let angle = PI * f64::from(i) / f64::from(bend) - 0.5 * PI;
        points.push(start + DVec2::new(0.0, radius) + radius * DVec2::from_angle(angle));
    }
    points.extend((1..40).map(|i| DVec2::new(200.0 - 5.0 * f64::from(i), 2.0 * radius)));
    survey(points, false, width)
}

#[test]
fn circle_polygons_have_their_lengths() {
    let cross_sections = Shape::parse("circle:590:600").unwrap().unwrap();
    let cross_sections = cross_sections.cross_sections(361).unwrap();
    for (alpha, radius) in [(0.0, 590.0), (1.0, 600.0), (0.5, 595.0)] {
        let wanted = 2.0 * 361.0 * radius * (PI / 361.0).sin();
        assert!(
            (line_length(&cross_sections, alpha) - wanted).abs() < 1e-9,
            "{alpha}"
        );
        for p in cross_sections.points(&[alpha; 361]) {
            assert!((p.length() - radius).abs() < 1e-10);
        }
    }
    // Clockwise: the right edge is the inner one.
    let area: f64 = (0..361)
        .map(|i| cross_sections.left_m[i].perp_dot(cross_sections.left_m[(i + 1) % 361]))
        .sum();
    assert!(area < 0.0);
}

#[test]
fn shapes_have_their_lengths_and_close() {
    for (name, length) in [
        ("stadium:500:100:12", 1000.0 + 200.0 * PI),
        ("ellipse:300:300:12", 600.0 * PI),
        // Ramanujan's second approximation, good to 1e-9 here.
        ("ellipse:400:250:12", {
            let h = (150.0f64 / 650.0).powi(2);
            PI * 650.0 * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()))
        }),
    ] {
        let shape = Shape::parse(name).unwrap().unwrap();
        assert_eq!(shape.name(), name);
        let cross_sections = shape.cross_sections(720).unwrap();
        assert!(
            (cross_sections.length_m - length).abs() < 1e-6,
            "{name}: {}",
            cross_sections.length_m
        );
        let circuit = shape.circuit().unwrap();
        assert!((circuit.total_turn_rad() - TAU).abs() < 1e-9);
        for (i, &s) in cross_sections.station_m.iter().enumerate() {
            let middle = cross_sections.right_m[i].midpoint(cross_sections.left_m[i]);
            let gap = circuit.position_at(s).distance(middle);
            assert!(gap < 0.01, "{name} at {s}: {gap}");
            assert!((cross_sections.right_m[i].distance(cross_sections.left_m[i]) - 12.0).abs() < 1e-9);
        }
    }
}

#[test]
fn shapes_that_cannot_be_are_refused() {
    for (name, part) in [
        ("circle:590", "circle:RIGHT:LEFT"),
        ("circle:590:x", "circle:RIGHT:LEFT"),
        ("circle:590:590", "width"),
        ("circle:-590:600", "radius of the right edge"),
        ("ellipse:400:20:12", "less than 2.0 m"),
        ("stadium:500:NaN:12", "radius_m"),
    ] {
        let error = Shape::parse(name).unwrap().unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    assert!(Shape::parse("silverstone_gp").is_none() && Shape::parse("C:\\a.csv").is_none());
    assert!(Track::load("circle:590:600").is_ok());
}

#[test]
fn the_bundled_circuit_has_cross_sections() {
    let circuit = Circuit::silverstone_gp().unwrap();
    let cross_sections = circuit.cross_sections(360).unwrap();
    assert_eq!(
        (
            cross_sections.len(),
            cross_sections.sections.len(),
            cross_sections.corners.len()
        ),
        (360, 5, 15)
    );
    for i in 0..360 {
        assert!((cross_sections.right_m[i].distance(cross_sections.left_m[i]) - 15.0).abs() < 1e-9);
        assert!((cross_sections.station_m[i] - 5887.0 * i as f64 / 360.0).abs() < 1e-9);
        let wanted = circuit.position_at(cross_sections.station_m[i]);
        assert!(
            cross_sections.right_m[i]
                .midpoint(cross_sections.left_m[i])
                .distance(wanted)
                < 1e-9
        );
    }
    // The right-hand circuit's right edge is the shorter one, by the width times a whole turn.
    let (right, left) = (
        line_length(&cross_sections, 0.0),
        line_length(&cross_sections, 1.0),
    );
    assert!((left - right - 15.0 * TAU).abs() < 1.0, "{right} {left}");
}

#[test]
fn too_few_cross_sections_are_refused() {
    assert!(Circuit::silverstone_gp().unwrap().cross_sections(2).is_err());
}

#[test]
fn a_hairpin_with_room_has_cross_sections_along_its_normals() {
    let line = hairpin(20.0, 12.0).as_surveyed().unwrap();
    let cross_sections = line.cross_sections(300).unwrap();
    for i in 0..300 {
        assert!((cross_sections.right_m[i].distance(cross_sections.left_m[i]) - 12.0).abs() < 1e-9);
    }
}

#[test]
fn normals_that_cross_in_a_short_kink_are_turned_until_they_do_not() {
    // A bend of 8 m radius through 40 degrees, 9 m of road inside it.
    let mut points = vec![DVec2::ZERO];
    let mut heading = 0.0f64;
    for i in 0..120 {
        let s = f64::from(i) - 60.0;
        heading += 40f64.to_radians() * (-(s / 2.2).powi(2)).exp() / (2.2 * PI.sqrt());
        points.push(points[points.len() - 1] + DVec2::from_angle(heading));
    }
    let mut kink = survey(points, false, 10.0);
    kink.left_m.iter_mut().for_each(|w| *w = 9.0);
    let line = kink.as_surveyed().unwrap();
    let tightest = (0..1200)
        .map(|i| line.curvature_at(0.1 * f64::from(i)))
        .fold(0.0, f64::max);
    assert!(tightest * 9.0 > 1.2, "the kink is no kink: {tightest}");
    let cross_sections = line.cross_sections(121).unwrap();
    for i in 0..120 {
        let forwards = cross_sections.right_m[i + 1] - cross_sections.right_m[i];
        let along = (cross_sections.left_m[i + 1] - cross_sections.left_m[i]).dot(forwards);
        assert!(along > 0.0, "cut {i} crosses the next");
        // Ends stay on the road: no nearer to the line's samples than the width says.
        let near = |p: DVec2| {
            (0..2400)
                .map(|k| line.position_at(0.05 * f64::from(k)).distance(p))
                .fold(f64::INFINITY, f64::min)
        };
        assert!(near(cross_sections.left_m[i]) < 9.01 && near(cross_sections.right_m[i]) < 5.01);
        assert!(near(cross_sections.right_m[i]) > 4.9, "{i}");
    }
}

#[test]
fn a_hairpin_whose_edges_cross_is_refused_by_station() {
    // More road inside than the radius, all the way round.
    let tight = hairpin(8.0, 20.0).smoothed(&Smoothing::default()).unwrap();
    let error = tight.cross_sections(200).unwrap_err().to_string();
    assert!(error.contains("test.csv: station"), "{error}");
    let error = tight.circuit().unwrap_err().to_string();
    assert!(error.contains("test.csv: station"), "{error}");
    // Legs that lean towards each other until their roads overlap.
    let mut points: Vec<DVec2> = (0..60).map(|i| DVec2::new(5.0 * f64::from(i), 0.0)).collect();
    for i in 1..30 {
        let angle = 3.4 * f64::from(i) / 30.0 - 0.5 * PI;
        points.push(DVec2::new(295.0, 40.0) + 40.0 * DVec2::from_angle(angle));
    }
    let back = DVec2::from_angle(3.4);
    let last = points[points.len() - 1];
    points.extend((1..57).map(|i| last + 5.0 * f64::from(i) * back));
    let legs = survey(points, false, 14.0).as_surveyed().unwrap();
    let error = legs.cross_sections(120).unwrap_err().to_string();
    assert!(
        error.contains("station") && error.contains("overlaps itself"),
        "{error}"
    );
}

#[test]
fn a_bridge_is_steep_or_announced() {
    let eight = |height: f64| -> Survey {
        let t = (0..400).map(|i| f64::from(i) * TAU / 400.0 + 0.01);
        let points = t.map(|t| DVec2::new(300.0 * t.sin(), height * (2.0 * t).sin()));
        survey(points.collect(), true, 10.0)
    };
    let mut flat = eight(40.0);
    let error = flat.check().unwrap_err().to_string();
    assert!(
        error.contains("crosses itself") && error.contains("point "),
        "{error}"
    );
    flat.bridges = 1;
    assert!(flat.check().is_ok());
    let steep = eight(300.0);
    let line = steep.smoothed(&Smoothing::default()).unwrap();
    line.cross_sections(300).unwrap();
    let (circuit, _) = line.circuit().unwrap();
    assert!(circuit.total_turn_rad().abs() < 1e-6);
    let cross_sections = circuit.cross_sections(300).unwrap();
    for bridges in [circuit.bridges(), cross_sections.bridges()] {
        let [[a, b]] = bridges[..] else {
            panic!("{bridges:?}")
        };
        let [a, b] = [a, b].map(|s| circuit.position_at(s).length());
        assert!(a < 15.0 && b < 15.0, "{a} {b}");
    }
}

#[test]
fn smoothing_keeps_to_the_deviation_it_states() {
    let noisy: Vec<DVec2> = (0..600)
        .map(|i| {
            let t = TAU * f64::from(i) / 600.0;
            let jag = 0.15 * (f64::from(i) * 2.4).sin();
            (400.0 + jag) * DVec2::from_angle(t)
        })
        .collect();
    let mut noisy = survey(noisy, true, 12.0);
    for (i, w) in noisy.left_m.iter_mut().enumerate() {
        *w += if i % 2 == 0 { 0.2 } else { -0.2 };
    }
    let line = noisy.smoothed(&Smoothing::default()).unwrap();
    println!("{:?} {:?}", line.line_deviation, line.left_deviation);
    assert!(line.line_deviation.greatest_m <= 0.25 && line.line_deviation.rms_m > 0.05);
    assert!(line.left_deviation.greatest_m <= 0.25 + 1e-9 && line.left_deviation.rms_m > 0.1);
    for i in 0..100 {
        let s = line.length_m() * f64::from(i) / 100.0;
        assert!(
            (line.curvature_at(s) - 1.0 / 400.0).abs() < 2e-4,
            "{}",
            line.curvature_at(s)
        );
        assert!((line.widths_at(s).0 - 6.0).abs() < 0.2);
    }
    let rough = noisy.as_surveyed().unwrap();
    assert!(rough.line_deviation.greatest_m < 1e-9);
    for wrong in [-1.0, f64::NAN, 100.0] {
        let smoothing = Smoothing {
            line_m: wrong,
            edges_m: 0.1,
            ..Smoothing::default()
        };
        assert!(noisy.smoothed(&smoothing).is_err());
    }
}

#[test]
fn an_open_road_keeps_its_ends() {
    let points: Vec<DVec2> = (0..100)
        .map(|i| DVec2::new(5.0 * f64::from(i), 30.0 * (0.05 * f64::from(i)).sin()))
        .collect();
    let hill = survey(points.clone(), false, 6.0);
    let line = hill.as_surveyed().unwrap();
    let cross_sections = line.cross_sections(50).unwrap();
    assert!(!cross_sections.closed && cross_sections.station_m[49] == cross_sections.length_m);
    for (section, wanted) in [(0, points[0]), (49, points[99])] {
        assert!(
            cross_sections.right_m[section]
                .midpoint(cross_sections.left_m[section])
                .distance(wanted)
                < 1e-9
        );
    }
    let (circuit, _) = line.circuit().unwrap();
    assert!(circuit.position_at(1e9).distance(points[99]) < 0.05);
    let car = crate::vehicle::Car::load("gt").unwrap();
    let refused =
        crate::simulate::simulate_lap(&car, &circuit, &crate::simulate::SimulateSettings::default());
    assert!(refused.unwrap_err().to_string().contains("an open road"));
}

#[test]
fn exports_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let circuit = Circuit::silverstone_gp().unwrap();
    let path = folder.path().join("circuit.csv");
    circuit.write_racetrack(&path).unwrap();
    let back = Survey::read(&path, &SurveyOptions::default()).unwrap();
    assert!(back.closed && back.centre_m.len() == 5887 && back.name == "circuit");
    for (p, q) in back.centre_m.iter().zip(&circuit.centreline_m) {
        assert!(p.distance(*q) < 1e-6);
    }
    assert_eq!((back.left_m[7], back.right_m[7]), (7.5, 7.5));
    // A file that is there is left alone.
    assert!(
        circuit
            .write_racetrack(&path)
            .unwrap_err()
            .to_string()
            .contains("cannot write")
    );

    let cross_sections = circuit.cross_sections(1200).unwrap();
    let alpha: Vec<f64> = (0..1200)
        .map(|i| 0.5 + 0.5 * (0.01 * f64::from(i)).sin())
        .collect();
    let path = folder.path().join("line.csv");
    cross_sections.write_racetrack_line(&alpha, &path).unwrap();
    let line = Survey::read(&path, &SurveyOptions::default()).unwrap();
    for (i, point) in cross_sections.points(&alpha).into_iter().enumerate() {
        assert!(line.centre_m[i].distance(point) < 1e-6);
        assert!((line.right_m[i] - 15.0 * alpha[i]).abs() < 2e-6);
        assert!((line.left_m[i] - 15.0 * (1.0 - alpha[i])).abs() < 2e-6);
    }
    assert!(
        cross_sections
            .write_racetrack_line(&alpha[1..], folder.path().join("x.csv"))
            .is_err()
    );
    let path = folder.path().join("cuts.csv");
    cross_sections.write_racetrack(&path).unwrap();
    let again = Track::read(&path).unwrap();
    let again = again.cross_sections(1200, true).unwrap();
    for i in 0..1200 {
        assert!(again.right_m[i].distance(cross_sections.right_m[i]) < 0.05, "{i}");
        assert!(again.left_m[i].distance(cross_sections.left_m[i]) < 0.05, "{i}");
    }
}

proptest! {
    #[test]
    fn any_survey_is_cut_or_refused_by_place(
        radii in prop::collection::vec(20.0..120.0f64, 8..40),
        width in 1.0..60.0f64,
        cross_sections in 8usize..200,
        smooth: bool,
    ) {
        let n = radii.len() as f64;
        let points = radii.iter().enumerate().map(|(i, r)| *r * DVec2::from_angle(TAU * i as f64 / n));
        let survey = survey(points.collect(), true, width);
        let line = if smooth { survey.smoothed(&Smoothing::default()) } else { survey.as_surveyed() };
        let result = line.and_then(|line| line.cross_sections(cross_sections));
        match result {
            Ok(found) => {
                prop_assert_eq!(found.len(), cross_sections);
                for i in 0..cross_sections {
                    prop_assert!(found.right_m[i].is_finite() && found.left_m[i].is_finite());
                    let j = (i + 1) % cross_sections;
                    let cross = super::crossing::meet(
                        &[found.right_m[i], found.left_m[i]],
                        &[found.right_m[j], found.left_m[j]],
                    );
                    prop_assert!(!cross, "{} {}", i, j);
                }
            }
            Err(error) => {
                let text = error.to_string();
                prop_assert!(text.contains("station") || text.contains("point"), "{}", text);
            }
        }
    }
}

#[test]
fn hostile_lines_are_checked_in_seconds() {
    // Long strokes side by side, slanted so that all their bounding boxes overlap.
    let slant = DVec2::from_angle(0.25 * PI);
    let stroke = |i: u32| {
        let (near, far) = (
            DVec2::new(0.0, 0.1 * f64::from(i)),
            DVec2::new(19.0, 0.1 * f64::from(i)),
        );
        let ends = if i.is_multiple_of(2) {
            [near, far]
        } else {
            [far, near]
        };
        ends.map(|p| slant.rotate(p))
    };
    let comb = survey((0..5000).flat_map(stroke).collect(), false, 0.2);
    let begun = std::time::Instant::now();
    comb.check().unwrap();
    let points = (0..200_000).map(|i| 20_000.0 * DVec2::from_angle(TAU * f64::from(i) / 200_000.0));
    let long = survey(points.collect(), true, 10.0);
    let line = long.smoothed(&Smoothing::default()).unwrap();
    let (circuit, _) = line.circuit().unwrap();
    assert!((circuit.length_m - 40_000.0 * PI).abs() < 2.0);
    // About a second alone; the margin is for busy machines.
    assert!(begun.elapsed().as_secs() < 60);
}
