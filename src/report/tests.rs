//! Figures from made-up laps. Set `LAPSWARM_FIGURES` to a folder to keep the pictures.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use glam::DVec2;
use proptest::prelude::*;

use super::*;
use crate::{Error, Result};

/// Draws to a temporary file and returns the SVG, having checked what holds for all figures.
fn drawn(name: &str, draw: impl FnOnce(&Path) -> Result<()>) -> Result<String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name).with_extension("svg");
    draw(&path)?;
    let svg = std::fs::read_to_string(&path).expect("the figure was written");
    assert_eq!(
        std::fs::read_dir(&folder).expect("listed").count(),
        1,
        "nothing left over"
    );
    if let Some(keep) = std::env::var_os("LAPSWARM_FIGURES").map(PathBuf::from) {
        std::fs::write(keep.join(name).with_extension("svg"), &svg).expect("kept");
    }
    assert!(svg.len() < 400_000, "{} bytes", svg.len());
    assert!(!svg.contains("NaN") && !svg.contains("inf\""));
    assert_well_formed(&svg);
    Ok(svg)
}

/// Every tag closes in order and text holds no stray markup.
fn assert_well_formed(svg: &str) {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = svg.trim_end();
    while let Some(start) = rest.find('<') {
        assert!(!rest[..start].contains('>'), "stray > in {}", &rest[..start]);
        let end = start + rest[start..].find('>').expect("a tag ends");
        let tag = &rest[start + 1..end];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split_whitespace().next().expect("a name"));
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty() && rest.is_empty(), "{open:?} {rest}");
    assert!(svg.chars().all(|c| c == '\n' || !c.is_control()));
}

/// Noise that is the same every time.
fn noise(i: usize) -> f64 {
    let x = (i as f64 * 12.9898).sin() * 43_758.545_3;
    2.0 * (x - x.floor()) - 1.0
}

fn lap(samples: usize, scale: f64, phase: f64) -> (Vec<f64>, Vec<f64>) {
    let smooth = |i: usize| {
        let s = TAU * i as f64 / samples as f64;
        scale * ((3.0 * s + phase).sin() + 0.6 * (11.0 * s).cos() + 0.3 * (29.0 * s + phase).sin())
    };
    let measured = (0..samples).map(|i| smooth(i) + 0.06 * scale * noise(i));
    let fitted = (0..samples).map(|i| 0.98 * smooth(i) + 0.02 * scale);
    (measured.collect(), fitted.collect())
}

fn traces(name: &str, samples: usize, title: &str, section: &str) -> Result<String> {
    let x: Vec<f64> = (0..samples).map(|i| 5887.0 * i as f64 / samples as f64).collect();
    let channels = [
        ("speed", "m/s", 18.0, 0.3),
        ("longitudinal acceleration", "m/s²", 7.0, 1.4),
        ("lateral acceleration", "m/s²", 9.0, 2.0),
        ("yaw rate", "rad/s", 0.35, 2.2),
    ];
    let line = |name| LapLine::new(name, &x[..]);
    let (mut logged, mut model, mut error) = (line("measured").wide(), line("fitted"), line("error"));
    let mut view = LapView::new(title);
    for (k, (label, unit, scale, phase)) in channels.into_iter().enumerate() {
        let (mut measured, fitted) = lap(samples, scale, phase);
        if samples > 100 && k == 2 {
            measured[samples / 2..samples / 2 + samples / 30].fill(f64::NAN);
        }
        let errors: Vec<f64> = fitted.iter().zip(&measured).map(|(f, m)| f - m).collect();
        view = view
            .panel(label, unit)
            .low_panel("error", unit)
            .panel_note("rms error 0.3");
        logged = logged.trace(2 * k, measured);
        model = model.trace(2 * k, fitted);
        error = error.trace(2 * k + 1, errors);
    }
    let sections = [
        (section, 310.0, 520.0),
        ("Village/The Loop", 790.0, 1320.0),
        ("Luffield", 1840.0, 2400.0),
        ("Maggotts/Becketts", 3500.0, 4260.0),
        ("Vale", 5380.0, 5700.0),
    ];
    let view = view
        .lines([logged, model, error])
        .sections(sections.map(|(name, start, end)| (name.to_owned(), start, end)));
    drawn(name, |path| view.write_svg(path))
}

#[test]
fn traces_show_channels_errors_and_sections() {
    let svg = traces("traces", 12_000, "Silverstone: measured and fitted", "Abbey").expect("drawn");
    for label in [
        "yaw rate (rad/s)",
        "speed (m/s)",
        "distance (m)",
        "measured",
        "rms error",
        "Luffield",
    ] {
        assert!(svg.contains(label), "{label}");
    }
}

#[test]
fn names_from_files_cannot_inject_markup() {
    let svg = traces(
        "markup",
        50,
        "<script>alert(1)</script> & \"co\"\u{1b}\u{0}",
        "<b>]]>",
    )
    .expect("drawn");
    assert!(!svg.contains("<script") && svg.contains("&lt;script&gt;"));
}

#[test]
fn hopeless_traces_are_refused_and_poor_ones_drawn() {
    let error = traces("short", 0, "short", "A").expect_err("no point");
    assert!(error.to_string().contains("no point"), "{error}");
    let error = traces("short", 1, "short", "A").expect_err("no extent");
    assert!(error.to_string().contains("horizontal axis"), "{error}");
    let draw = |values: &[f64]| {
        let line = LapLine::new("one", vec![0.0, 1.0, 2.0])
            .trace(0, values)
            .band(values, values);
        let view = LapView::new("poor")
            .x("time", "s")
            .panel("roll", "rad")
            .line(line);
        drawn("poor", |path| view.write_svg(path))
    };
    assert!(draw(&[f64::NAN; 3]).is_ok());
    assert!(draw(&[1.0; 3]).is_ok());
    assert!(draw(&[1e300, -1e300, 0.0]).is_ok());
    assert!(draw(&[f64::INFINITY, 0.0, 1e-300]).is_ok());
    let error = draw(&[1.0; 2]).expect_err("lengths differ");
    assert!(error.to_string().contains("poor, line one"), "{error}");
}

#[test]
fn curves_show_every_run() {
    let spent: Vec<f64> = (1..=400).map(|i| i as f64 * 4096.0).collect();
    let curve = |rate: f64, floor: f64| -> Vec<f64> {
        spent
            .iter()
            .map(|e| floor + 8.0 * (-rate * e / 1e5).exp())
            .collect()
    };
    let panel = || {
        Panel::new("Cost")
            .x("evaluations", "")
            .y("cost", "1")
            .scales(Scale::Linear, Scale::Log)
    };
    let draw = |panels: &[Panel]| {
        let figure = Curves::new("Convergence", panels.to_vec());
        drawn("curves", |p| figure.write_svg(p))
    };
    let several = panel()
        .curve("GPU, seed 1", &spent, &curve(1.0, 2e-4))
        .curve("CPU, seed 2", &spent, &curve(0.7, 3e-3))
        .shaded(0.4, "median", &spent, &curve(0.4, 2e-2));
    let svg = draw(std::slice::from_ref(&several)).expect("drawn");
    assert!(svg.contains("evaluations") && svg.contains("GPU, seed 1") && svg.contains("cost (1)"));
    let population: Vec<f64> = (6..18).map(|k| f64::from(1 << k)).collect();
    let rate: Vec<f64> = population.iter().map(|p| 2.5e6 * p / (p + 2e4)).collect();
    let rates = Panel::new("Rate")
        .x("population", "candidates")
        .scales(Scale::Log, Scale::Log)
        .curve("GPU (Vulkan)", &population, &rate)
        .curve("one", &[64.0], &[5.0]);
    let shown = Panel::new("Quality")
        .shown(0.4, 0.9)
        .dots("late", [(1.0, 0.1), (2.0, 0.8)]);
    let svg = draw(&[several.clone(), rates, shown]).expect("drawn");
    assert!(svg.contains("population (candidates)") && svg.contains("GPU (Vulkan)"));
    assert!(draw(&[]).is_err());
    let nothing = panel().curve("lost", &spent, &[f64::NAN; 400]);
    assert!(!nothing.has_points() && draw(&[nothing]).is_err());
    let negative = panel().curve("below", &spent, &[-1.0; 400]);
    assert!(draw(&[negative]).is_err());
    assert!(draw(&[several.curve("short", &spent, &[1.0])]).is_err());
    assert!(draw(&[panel().curve("one", &[0.0], &[0.5])]).is_ok());
}

/// A legend of three lines takes their room from the plot: no word of it lies beyond the picture's edge, which is 472 px high.
#[test]
fn a_long_legend_stays_within_the_picture() {
    let names = (0..9).map(|k| format!("a curve with a long name, number {k}"));
    let panel = Panel::new("many").x("x", "m").y("y", "N");
    let panel = names.fold(panel, |panel, name| panel.curve(name, &[0.0, 1.0], &[0.0, 1.0]));
    let figure = Curves::new("Legend", [panel.clone(), panel]);
    let svg = drawn("legend", |p| figure.write_svg(p)).expect("drawn");
    assert!(svg.contains("height=\"472\""), "{}", &svg[..300]);
    let heights = svg.split("<text ").skip(1).map(|text| {
        let (_, from) = text.split_once(" y=\"").expect("a place");
        from.split('"')
            .next()
            .expect("a number")
            .parse::<f64>()
            .expect("a number")
            / 10.0
    });
    // Half of the type's height lies below the middle of a line.
    let lowest = heights.fold(0.0, f64::max);
    assert!((440.0..466.0).contains(&lowest), "{lowest}");
}

#[test]
fn pareto_marks_the_choice() {
    let names = [("lap time", "s"), ("fuel", "l"), ("tyre energy", "MJ")];
    let points: Vec<Vec<f64>> = (0..200)
        .map(|i| {
            let t = i as f64 / 199.0;
            vec![118.0 + 5.0 * t * t, 1.2 + 1.5 * (1.0 - t).powi(2), 8.0 + noise(i)]
        })
        .collect();
    let front = |points: &[Vec<f64>], k: usize, chosen: usize| {
        let front = Front::new("Compromises", points).mark(chosen, "chosen");
        let named = names[..k].iter();
        named.fold(front, |front, (name, unit)| front.objective(*name, *unit))
    };
    let draw = |name: &str, k: usize, chosen: usize| {
        let some: Vec<Vec<f64>> = points.iter().map(|p| p[..k].to_vec()).collect();
        drawn(name, |p| front(&some, k, chosen).write_svg(p))
    };
    assert!(draw("pareto2", 2, 90).expect("drawn").contains("chosen: "));
    assert!(draw("pareto3", 3, 90).expect("drawn").contains("tyre energy"));
    assert!(draw("bad", 2, 200).is_err() && draw("bad", 1, 0).is_err());
    let bad = [vec![f64::NAN, 1.0]];
    assert!(drawn("bad", |p| front(&bad, 2, 0).write_svg(p)).is_err());
    let one = [vec![1.0, 1.0]];
    assert!(drawn("one", |p| front(&one, 2, 0).write_svg(p)).is_ok());
    let parallel = |p: &Path| front(&points, 3, 90).write_parallel(p, "Parallel");
    assert!(
        drawn("parallel", parallel)
            .expect("drawn")
            .contains("tyre energy")
    );
}

fn row(i: usize, name: &str) -> ParameterRow {
    let scale = 10f64.powi(i as i32 % 7 - 2);
    let place = 0.5 + 0.4 * noise(i);
    ParameterRow {
        name: name.to_owned(),
        unit: ["", "N m/rad", "N m s/rad"][i % 3].to_owned(),
        lower: -scale,
        upper: 3.0 * scale,
        swarm: scale * (-1.0 + 4.0 * place) + 0.2 * scale * noise(i + 99),
        fitted: scale * (-1.0 + 4.0 * place),
        standard_error: (i % 4 != 3).then_some(0.3 * scale * noise(i + 7).abs()),
        truth: Some(scale * (-1.0 + 4.0 * place) + 0.05 * scale),
        identifiable: i % 9 != 5,
    }
}

#[test]
fn parameters_list_every_row() {
    let names: Vec<String> = (0..60)
        .map(|i| {
            if i % 7 == 3 {
                format!("roll_damping_{i}")
            } else {
                format!("rBx{i}")
            }
        })
        .collect();
    let draw = |name: &str, rows: &[ParameterRow]| {
        let figure = Parameters {
            title: "Identified parameters".to_owned(),
            note: String::new(),
            rows: rows.to_vec(),
        };
        drawn(name, |p| figure.write_svg(p))
    };
    for n in [1, 22, 60] {
        let rows: Vec<_> = (0..n).map(|i| row(i, &names[i])).collect();
        let svg = draw(&format!("parameters{n}"), &rows).expect("drawn");
        assert!(rows.iter().all(|r| svg.contains(&r.name)));
        assert_eq!(svg.contains("not identifiable"), n > 5);
    }
    let wild = ParameterRow {
        swarm: f64::NAN,
        fitted: 1e300,
        standard_error: Some(f64::INFINITY),
        truth: Some(f64::NEG_INFINITY),
        ..row(0, "wild")
    };
    assert!(draw("wild", std::slice::from_ref(&wild)).is_ok());
    let reversed = ParameterRow {
        lower: 2.0,
        upper: 1.0,
        ..wild
    };
    let error = draw("bad", &[reversed]).expect_err("reversed");
    assert!(error.to_string().contains("parameter wild: found bounds 2 to 1"));
    assert!(draw("bad", &[]).is_err());
}

#[cfg(feature = "studies")]
#[test]
fn the_map_shows_a_circuit() {
    let circuit = crate::track::Circuit::silverstone_gp().expect("bundled");
    let mut speed: Vec<f64> = circuit
        .curvature_1pm
        .iter()
        .map(|k| (14.0 / k.abs().max(1e-6)).sqrt().min(72.0))
        .collect();
    let n = speed.len();
    for (ahead, gain) in [(true, 8.0), (false, 22.0)] {
        for j in 0..2 * n {
            let i = if ahead { j % n } else { (2 * n - 1 - j) % n };
            let from = if ahead { (i + n - 1) % n } else { (i + 1) % n };
            let reachable: f64 = speed[from] * speed[from] + 2.0 * gain;
            speed[i] = speed[i].min(reachable.sqrt());
        }
    }
    let sections = circuit.sections.iter();
    let mut map = TrackMap {
        title: "Silverstone Grand Prix: speed along the lap".to_owned(),
        road: Road {
            left_edge_m: circuit.left_edge(),
            right_edge_m: circuit.right_edge(),
            closed: true,
            names: sections
                .map(|s| (s.name.clone(), circuit.position_at(0.5 * (s.start_m + s.end_m))))
                .collect(),
        },
        line_m: circuit.centreline_m.clone(),
        values: speed,
        value_label: "speed".to_owned(),
        value_unit: "m/s".to_owned(),
    };
    let svg = drawn("track_map", |p| map.write_svg(p)).expect("drawn");
    for label in ["Abbey", "Village/The Loop", "start", "speed (m/s)", "500 m"] {
        assert!(svg.contains(label), "{label}");
    }
    let corners = circuit.corners.iter();
    map.road.names = corners
        .map(|c| (c.name.clone(), circuit.position_at(c.station_m)))
        .collect();
    assert!(drawn("track_map_corners", |p| map.write_svg(p)).is_ok());
}

#[test]
fn poor_maps_are_drawn_or_refused() {
    let draw = |line_m: &[DVec2], values: &[f64]| {
        let map = TrackMap {
            title: "poor".to_owned(),
            road: Road {
                closed: true,
                names: vec![("lost".to_owned(), DVec2::NAN), (String::new(), DVec2::ZERO)],
                ..Road::default()
            },
            line_m: line_m.to_vec(),
            values: values.to_vec(),
            ..TrackMap::default()
        };
        drawn("poor_map", |p| map.write_svg(p))
    };
    let line = [
        DVec2::ZERO,
        DVec2::X * 50.0,
        DVec2::NAN,
        DVec2::Y * 50.0,
        DVec2::ONE,
    ];
    assert!(draw(&line, &[f64::NAN, 1.0, 1.0, f64::INFINITY, 2.0]).is_ok());
    assert!(draw(&[], &[]).is_err());
    assert!(draw(&[DVec2::ONE], &[1.0]).is_err());
    assert!(draw(&[DVec2::ONE; 3], &[1.0; 3]).is_err());
    assert!(draw(&[DVec2::ONE; 3], &[1.0; 2]).is_err());
}

#[test]
fn tables_keep_their_digits_and_their_units() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("table.csv");
    let names = ["plain".to_owned(), "with, comma\u{1b}[31m".to_owned()];
    let numbers = [0.1 + 0.2, f64::NAN];
    let words = || Table::new().texts("candidate", &names);
    let whole = words().numbers("yaw rate", "rad/s", &numbers[..]);
    whole.write_csv(&path).expect("written");
    let text = std::fs::read_to_string(&path).expect("read");
    assert!(
        text.starts_with("candidate,yaw rate (rad/s)\nplain,0.30000000000000004\n"),
        "{text}"
    );
    let table = whole.to_text();
    assert!(
        !table.contains('\u{1b}') && table.contains("             0.3\n"),
        "{table}"
    );
    assert_eq!(table.lines().count(), 4);
    assert_eq!(Table::new().to_text(), "");

    let short = words().numbers("yaw rate", "rad/s", &numbers[..1]);
    let error = short.write_csv(&path).expect_err("lengths differ");
    assert!(
        error
            .to_string()
            .contains("column yaw rate: found 1 rows, expected 2")
    );
    assert!(Table::new().write_csv(&path).is_err());
    assert_eq!(
        std::fs::read_to_string(&path).expect("read"),
        text,
        "left as it was"
    );
    let nowhere = folder.path().join("absent/table.csv");
    assert!(matches!(whole.write_csv(&nowhere), Err(Error::Io { .. })));
    assert_eq!(std::fs::read_dir(&folder).expect("listed").count(), 1);
}

/// The margin of an axis from here to zero would end beyond the greatest number.
#[test]
fn the_greatest_numbers_have_axes() {
    let x = [-1.69e308, 0.0, 1.69e308];
    for n in [2, 3] {
        let panel = Panel::new("greatest").curve("r", &x[..n], &x[..n]);
        drawn("greatest", |p| Curves::new("greatest", [panel]).write_svg(p)).expect("drawn");
        let points: Vec<Vec<f64>> = x[..n].iter().map(|x| vec![*x, -x]).collect();
        let front = Front::new("greatest", &points)
            .objective("a", "")
            .objective("b", "");
        drawn("front", |p| front.write_svg(p)).expect("drawn");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn any_numbers_draw_without_panic(
        values in prop::collection::vec(prop::num::f64::ANY, 2..12),
        places in prop::collection::vec(prop::num::f64::ANY, 12),
    ) {
        let places = &places[..values.len()];
        let line = LapLine::new("a", places).trace(0, &values[..]).trace(1, places);
        let view = LapView::new("any").panel("a", "1").low_panel("b", "").line(line);
        let view = view.sections([("s".to_owned(), values[0], values[1])]);
        let _ = drawn("any", |p| view.write_svg(p));
        for scale in [Scale::Linear, Scale::Log] {
            let panel = Panel::new("any").scales(scale, scale).curve("r", places, &values);
            let _ = drawn("any", |p| Curves::new("any", [panel]).write_svg(p));
        }
        let line: Vec<DVec2> = places.iter().zip(&values).map(|(&x, &y)| DVec2::new(x, y)).collect();
        let road = Road {
            left_edge_m: line.clone(), right_edge_m: line.clone(), closed: false, names: vec![("n".to_owned(), line[0])],
        };
        let points: Vec<Vec<f64>> = line.iter().map(|p| vec![p.x, p.y]).collect();
        let map = TrackMap { road, line_m: line, values, ..TrackMap::default() };
        let _ = drawn("any", |p| map.write_svg(p));
        let front = Front::new("any", &points).objective("a", "").objective("a", "").mark(0, "m");
        let _ = drawn("any", |p| front.write_svg(p));
    }
}
