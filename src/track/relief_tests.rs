//! Height, banking and friction of roads: read, smoothed, laid across and written back.

use super::{Smoothing, Survey, SurveyOptions, Track};
use glam::DVec2;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

/// A circle of 100 m in the racetrack database's format, with these columns after: their header, and their cells by angle.
fn circle(header: &str, cells: impl Fn(f64) -> String, repeat: Option<&str>) -> String {
    let mut text = format!("# x_m,y_m,w_tr_right_m,w_tr_left_m{header}\n");
    for i in 0..120 {
        let angle = TAU * f64::from(i) / 120.0;
        let (sin, cos) = angle.sin_cos();
        let _ = writeln!(text, "{},{},5,5{}", 100.0 * cos, 100.0 * sin, cells(angle));
    }
    if let Some(cells) = repeat {
        let _ = writeln!(text, "100,0,5,5{cells}");
    }
    text
}

fn survey(text: &str) -> crate::Result<Survey> {
    Survey::parse(
        text.as_bytes(),
        Path::new("circle.csv"),
        &SurveyOptions::default(),
    )
}

#[test]
fn height_and_banking_come_through_to_the_cross_sections() {
    let height = |angle: f64| 5.0 * angle.sin();
    let text = circle(",z_m,bank_deg", |angle| format!(",{},-6", height(angle)), None);
    let reference = survey(&text).unwrap().smoothed(&Smoothing::default()).unwrap();
    let (circuit, _) = reference.circuit().unwrap();
    let facts = circuit.relief_facts().unwrap();
    assert!((facts.climb_m - 10.0).abs() < 0.2, "{facts:?}");
    assert!((facts.range_m - 10.0).abs() < 0.2 && (facts.gradient - 0.05).abs() < 2e-3);
    assert!((facts.bank_rad.to_degrees() - 6.0).abs() < 0.5);
    assert!(circuit.relief.as_ref().unwrap().change.height_m <= 0.5);
    let road = circuit.cross_sections(100).unwrap();
    // The inside of a left-hander lies on the left: with its right side up it is lower there.
    let right = road.relief_of(&road.right_m).unwrap();
    let left = road.relief_of(&road.left_m).unwrap();
    for i in 0..100 {
        let fall = right[i][0] - left[i][0];
        assert!(
            (fall - 10.0 * right[i][1].abs().tan()).abs() < 1e-9 && fall > 0.9,
            "{fall}"
        );
    }
    // Narrower for a car, and along a line: the planes stay where they are.
    let narrow = road.narrowed(2.0).unwrap();
    let middle = narrow.relief_of(&narrow.points(&[0.5; 100])).unwrap();
    let along = road.relief_along(&narrow.points(&[0.5; 100])).unwrap();
    for (own, found) in middle.iter().zip(&along) {
        assert!((own[0] - found[0]).abs() < 1e-6, "{own:?} {found:?}");
    }
    let stretch = road.stretch(90, 20).unwrap();
    assert_eq!(
        stretch.relief.as_ref().unwrap().z_m[15],
        road.relief.as_ref().unwrap().z_m[5]
    );
}

/// Points of a survey that are off by up to 5 cm turn the reference line by degrees. Along a line 5 m beside it heights keep the curvature
/// of the hill, up to 0.003 1/m where the ellipse is tight. Along normals of the reference line they have 0.013 and 0.044 1/m.
#[test]
fn heights_beside_a_rough_survey_are_smooth() {
    let random = crate::random::Random::new(1);
    let (half_x_m, half_y_m) = (300.0, 90.0);
    let mut text = "# x_m,y_m,w_tr_right_m,w_tr_left_m,z_m\n".to_owned();
    for i in 0..600 {
        let (sin, cos) = (TAU * f64::from(i) / 600.0).sin_cos();
        let [x, y] = [0, 1].map(|k| 0.1 * (random.uniform(1, 0, i, k) - 0.5));
        let _ = writeln!(
            text,
            "{},{},6,6,{}",
            half_x_m * cos + x,
            half_y_m * sin + y,
            15.0 * cos
        );
    }
    let reference = survey(&text).unwrap().as_surveyed().unwrap();
    let beside = (0..1000).map(|i| {
        let (sin, cos) = (TAU * f64::from(i) / 1000.0).sin_cos();
        let inward = -DVec2::new(half_y_m * cos, half_x_m * sin).normalize();
        DVec2::new(half_x_m * cos, half_y_m * sin) + 5.0 * inward
    });
    let points: Vec<DVec2> = beside.collect();
    for count in [400, 800] {
        let road = reference.cross_sections(count).unwrap();
        let surface = road.relief_along(&points).unwrap();
        let next = |i: usize| (i + 1) % points.len();
        let step = |i: usize| points[i].distance(points[next(i)]);
        let gradient = |i: usize| (surface[next(i)][0] - surface[i][0]) / step(i);
        let bow = |i: usize| 2.0 * (gradient(next(i)) - gradient(i)) / (step(i) + step(next(i)));
        let most = (0..points.len()).map(|i| bow(i).abs()).fold(0.0, f64::max);
        assert!(
            (0.0025..0.005).contains(&most),
            "{count} cross-sections: {most} 1/m"
        );
    }
}

/// Friction at both edges is linear across the road and between the rows, and comes back from an exported file.
#[test]
fn friction_comes_through_to_the_cross_sections() {
    let wet = |angle: f64| if (1.0..2.0).contains(&angle) { 0.5 } else { 1.0 };
    let text = circle(
        ",friction_left,friction_right",
        |angle| format!(",{},1", wet(angle)),
        None,
    );
    let reference = survey(&text).unwrap().smoothed(&Smoothing::default()).unwrap();
    let (circuit, _) = reference.circuit().unwrap();
    let relief = circuit.relief.as_ref().unwrap();
    assert!(relief.is_level() && !relief.is_dry());
    let [least, most] = circuit.relief_facts().unwrap().friction;
    assert!(
        (least - 0.5).abs() < 1e-3 && (most - 1.0).abs() < 1e-9,
        "{least} {most}"
    );
    let of = |road: &crate::track::CrossSections, angle: f64, alpha: f64| {
        let i = (angle / TAU * 240.0).round() as usize;
        road.relief_of(&road.points(&vec![alpha; 240])).unwrap()[i][2]
    };
    let road = circuit.cross_sections(240).unwrap();
    let narrow = road.narrowed(2.0).unwrap();
    for (angle, alpha, wanted) in [
        (1.5, 1.0, 0.5),
        (1.5, 0.5, 0.75),
        (1.5, 0.0, 1.0),
        (4.0, 1.0, 1.0),
    ] {
        let found = of(&road, angle, alpha);
        assert!((found - wanted).abs() < 2e-3, "{angle}, {alpha}: {found}");
    }
    // A car of 2 m has its middle a metre from the edge of 10 m of road.
    assert!((of(&narrow, 1.5, 1.0) - 0.55).abs() < 2e-3);
    let middle = narrow.points(&[0.7; 240]);
    let along = road.relief_along(&middle).unwrap();
    for (own, found) in narrow.relief_of(&middle).unwrap().iter().zip(&along) {
        assert!((own[2] - found[2]).abs() < 1e-3, "{own:?} {found:?}");
    }
    let written = circuit.to_racetrack_csv();
    let again = survey(&written).unwrap().smoothed(&Smoothing::default()).unwrap();
    let again = again.circuit().unwrap().0.cross_sections(240).unwrap();
    for angle in [0.5, 1.5, 2.5, 4.0] {
        let [before, after] = [&road, &again].map(|road| of(road, angle, 0.8));
        assert!((before - after).abs() < 2e-3, "{angle}: {before} {after}");
    }
    // One column is both edges'; dry is no surface at all. A TOML file may say it of the whole road, and columns say more.
    let whole = survey(&circle(",friction", |_| ",0.6".to_owned(), None)).unwrap();
    assert!(whole.friction.iter().all(|f| *f == [0.6; 5]));
    let dry = survey(&circle(",friction", |_| ",1".to_owned(), None)).unwrap();
    let (dry, _) = dry.smoothed(&Smoothing::default()).unwrap().circuit().unwrap();
    assert!(dry.relief.is_none());
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("plain.csv"),
        circle("", |_| String::new(), None),
    )
    .unwrap();
    std::fs::write(
        folder.path().join("told.csv"),
        circle(",friction", |_| ",0.6".to_owned(), None),
    )
    .unwrap();
    let friction = |text: &str| {
        let path = folder.path().join("road.toml");
        std::fs::write(&path, text).unwrap();
        let circuit = Track::load(&path.display().to_string())?.circuit()?;
        Ok::<_, crate::Error>(circuit.relief_facts().map(|facts| facts.friction))
    };
    assert_eq!(
        friction("survey = \"plain.csv\"\nfriction = 0.7").unwrap(),
        Some([0.7; 2])
    );
    assert_eq!(
        friction("survey = \"told.csv\"\nfriction = 0.7").unwrap(),
        Some([0.6; 2])
    );
    assert_eq!(friction("survey = \"told.csv\"\nflat = true").unwrap(), None);
    let refused = friction("survey = \"plain.csv\"\nfriction = 7")
        .unwrap_err()
        .to_string();
    assert!(
        refused.contains("field friction: found 7, expected 0.05 to 1.5"),
        "{refused}"
    );
}

#[test]
fn a_level_road_has_no_relief() {
    let plain = survey(&circle("", |_| String::new(), None)).unwrap();
    let level = survey(&circle(",z_m,bank_deg", |_| ",12,0".to_owned(), None)).unwrap();
    let cut = |survey: &Survey| {
        let road = survey.smoothed(&Smoothing::default()).unwrap();
        (road.circuit().unwrap(), road.cross_sections(60).unwrap())
    };
    assert_eq!(cut(&plain), cut(&level));
    let flat = SurveyOptions {
        flat: true,
        ..SurveyOptions::default()
    };
    let text = circle(",z_m", |angle| format!(",{}", angle.sin()), None);
    let asked = Survey::parse(text.as_bytes(), Path::new("circle.csv"), &flat).unwrap();
    assert_eq!(cut(&plain), cut(&asked));
}

#[test]
fn a_gap_in_height_is_spread_or_refused() {
    // It drifts by 2 m in the lap, where the repeated point says so, and where the first point alone does.
    let drift = |angle: f64| format!(",{}", 5.0 * angle.sin() + 2.0 * angle / TAU);
    for repeat in [Some(",2"), None] {
        let survey = survey(&circle(",z_m", drift, repeat)).unwrap();
        assert_eq!(survey.z_m.len(), 120);
        // The repeated point says what it is. Without it, a fall at a gradient of a third is a gap, as large as the step is high.
        let last = TAU * 119.0 / 120.0;
        let wanted = if repeat.is_some() {
            2.0
        } else {
            5.0 * last.sin() + 2.0 * last / TAU
        };
        assert!((survey.height_gap_m - wanted).abs() < 1e-9);
        let reference = survey.smoothed(&Smoothing::default()).unwrap();
        let (circuit, _) = reference.circuit().unwrap();
        assert_eq!(circuit.relief.unwrap().change.gap_m, survey.height_gap_m);
    }
    let broken = |angle: f64| format!(",{}", 40.0 * angle / TAU);
    let error = survey(&circle(",z_m", broken, Some(",40")))
        .unwrap_err()
        .to_string();
    assert!(error.contains("an end 40.0 m above the start"), "{error}");
    // A step of 3 m from the last point to the first is no slope, but a gap.
    let step = |angle: f64| format!(",{}", 3.0 * angle / TAU);
    let found = survey(&circle(",z_m", step, None)).unwrap();
    assert!((found.height_gap_m - 3.0 * 119.0 / 120.0).abs() < 1e-9);
}

#[test]
fn what_no_road_can_be_is_refused_by_name() {
    for (text, wanted) in [
        (
            circle(",bank_deg", |_| ",50".to_owned(), None),
            "a number from -40 to 40",
        ),
        (circle(",z_m", |_| ",high".to_owned(), None), "column 5 (z_m)"),
        (
            circle(",friction", |_| ",0".to_owned(), None),
            "a number from 0.05 to 1.5",
        ),
        (
            circle(",friction_left", |_| ",1".to_owned(), None),
            "both friction_left and friction_right",
        ),
        (
            circle(
                ",friction_left,friction_right,friction_50",
                |_| ",1,1,1".to_owned(),
                None,
            ),
            "found some of friction_right, friction_25",
        ),
    ] {
        let error = survey(&text).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
    let steep = circle(",z_m", |angle| format!(",{}", 80.0 * angle.cos()), None);
    let error = survey(&steep)
        .unwrap()
        .smoothed(&Smoothing::default())
        .unwrap_err();
    assert!(error.to_string().contains("a gradient of"), "{error}");
    let edges = "left_x_m,left_y_m,right_x_m,right_y_m,z_m\n0,0,0,-8,1\n";
    assert!(
        survey(edges)
            .unwrap_err()
            .to_string()
            .contains("beside two edges")
    );
}

#[test]
fn heights_of_gpx_and_kml_are_read_where_all_points_have_one() {
    let point = |i: i32, height: Option<f64>| {
        let (sin, cos) = (TAU * f64::from(i) / 100.0).sin_cos();
        let ele = height.map_or(String::new(), |z| format!("<ele>{z}</ele>"));
        let (latitude, longitude) = (50.0 + 1e-3 * sin, 7.0 + 1.5e-3 * cos);
        format!("<trkpt lat=\"{latitude}\" lon=\"{longitude}\">{ele}</trkpt>")
    };
    let wide = SurveyOptions {
        width_m: Some(10.0),
        ..SurveyOptions::default()
    };
    let gpx = |height: &dyn Fn(i32) -> Option<f64>| {
        let points: String = (0..100).map(|i| point(i, height(i))).collect();
        let text = format!("<gpx><trk><trkseg>{points}</trkseg></trk></gpx>");
        Survey::parse(text.as_bytes(), Path::new("a.gpx"), &wide).unwrap()
    };
    let all = gpx(&|i| Some(200.0 + f64::from(i % 3)));
    assert_eq!((all.z_m.len(), all.z_m[1]), (100, 201.0));
    assert!(gpx(&|i| (i != 40).then_some(200.0)).z_m.is_empty());
    let points: Vec<String> = (0..100)
        .map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / 100.0).sin_cos();
            format!("{},{},{}", 7.0 + 1.5e-3 * cos, 50.0 + 1e-3 * sin, 300 + i % 2)
        })
        .collect();
    let kml = format!(
        "<kml><LineString><coordinates>{}</coordinates></LineString></kml>",
        points.join(" ")
    );
    let kml = Survey::parse(kml.as_bytes(), Path::new("a.kml"), &wide).unwrap();
    assert_eq!(kml.z_m[1], 301.0);
}

/// Five columns from edge to edge keep a wet strip where it is, on narrower roads and in an exported file.
#[test]
fn a_wet_strip_stays_in_the_middle_of_the_road() {
    let text = circle(
        ",friction_right,friction_25,friction_50,friction_75,friction_left",
        |_| ",1,1,0.5,1,0.9".to_owned(),
        None,
    );
    let road = |text: &str| {
        let reference = survey(text).unwrap().smoothed(&Smoothing::default()).unwrap();
        reference.circuit().unwrap().0
    };
    let circuit = road(&text);
    assert_eq!(circuit.relief_facts().unwrap().friction, [0.5, 1.0]);
    let written = circuit.to_racetrack_csv();
    assert!(written.contains(",friction_50,"), "{}", &written[..120]);
    for circuit in [circuit, road(&written)] {
        let whole = circuit.cross_sections(240).unwrap();
        let narrow = whole.narrowed(2.0).unwrap();
        for (share, wanted) in [(0.2, 1.0), (0.4, 0.7), (0.5, 0.5), (0.6, 0.7), (0.85, 0.96)] {
            // The middle of a car of 2 m on 10 m of road.
            for (road, alpha) in [(&whole, share), (&narrow, (10.0 * share - 1.0) / 8.0)] {
                let found = road.relief_of(&road.points(&[alpha; 240])).unwrap()[17][2];
                assert!((found - wanted).abs() < 2e-3, "{share}: {found}");
            }
        }
    }
}

/// A map of points on a grid of half a metre, slippery on the left half of the road over a quarter of the circle: the friction of the
/// line through it from edge to edge, that of the whole road where no point is near, and what is refused.
#[test]
fn friction_is_read_from_a_map() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    file("circle.csv", &circle("", |_| String::new(), None));
    let (mut points, mut told, mut values) = ("# x_m;y_m\n".to_owned(), String::new(), Vec::new());
    for i in -220..=220 {
        for j in -220..=220 {
            let (x, y) = (0.5 * f64::from(i), 0.5 * f64::from(j));
            let (radius, angle) = (x.hypot(y), y.atan2(x));
            // The left side of a left-hander is its inside. The map ends at an angle of two.
            if (94.0..=106.0).contains(&radius) && (0.0..2.0).contains(&angle) {
                let wet = radius < 100.0 && (0.3..1.2).contains(&angle);
                let friction = if wet { 0.5 } else { 1.0 };
                let _ = writeln!(points, "{x};{y}");
                let _ = writeln!(told, "{x},{y},{friction}");
                values.push(format!("\"{}\": [{friction}]", values.len()));
            }
        }
    }
    file("circle_tpamap.csv", &points);
    file("circle_tpadata.json", &format!("{{{}}}", values.join(",")));
    file("told.csv", &told);
    let read = |text: &str| {
        let path = folder.path().join("road.toml");
        std::fs::write(&path, text).unwrap();
        super::load_survey::read(&path, text).map(|(survey, _)| survey.friction)
    };
    let map = read("survey = \"circle.csv\"\nfriction_map = \"circle_tpamap.csv\"\nfriction = 0.8").unwrap();
    assert_eq!(
        map,
        read("survey = \"circle.csv\"\nfriction_map = \"told.csv\"\nfriction = 0.8").unwrap()
    );
    let at = |angle: f64| map[(angle / TAU * 120.0).round() as usize];
    assert_eq!((at(1.6), at(4.0)), ([1.0; 5], [0.8; 5]));
    // The map's points tell the middle to a quarter of a metre.
    for (found, wanted) in at(0.8).iter().zip([1.0, 1.0, 0.7, 0.5, 0.5]) {
        assert!((found - wanted).abs() < 0.05, "{:?}", at(0.8));
    }

    file("far.csv", "1000,1000,0.5\n");
    file("half.csv", "100,0,0.5\n100,1\n");
    file("words.csv", "x_m,y_m,friction\n100,zero,0.5\n");
    file("ice.csv", "100,0,0.5\n100,1,0.01\n");
    file("bare.csv", "100,0\n");
    file("slick_tpamap.csv", "100,0\n");
    file("slick_tpadata.json", "{\"0\": [2]}");
    file("lost_tpamap.csv", "100,0\n100,1\n");
    file("lost_tpadata.json", "{\"0\": [0.5]}");
    for (map, named) in [
        ("far.csv", "no point within 5 m"),
        ("half.csv", "line 2"),
        ("words.csv", "line 2"),
        ("ice.csv", "line 2"),
        ("bare.csv", "_tpadata.json"),
        ("lost_tpamap.csv", "no friction of point 1"),
        ("slick_tpamap.csv", "2 at point 0"),
        ("none.csv", "none.csv"),
    ] {
        let text = format!("survey = \"circle.csv\"\nfriction_map = \"{map}\"");
        let refused = read(&text).unwrap_err().to_string();
        assert!(refused.contains(named), "{map}: {refused}");
    }
}
