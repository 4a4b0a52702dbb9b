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
    let mut data: Vec<_> = channels.iter().map(|c| lap(samples, c.2, c.3)).collect();
    for v in &mut data[0].0 {
        *v += 45.0;
    }
    for v in &mut data[0].1 {
        *v += 45.0;
    }
    if samples > 100 {
        data[2].0[samples / 2..samples / 2 + samples / 30].fill(f64::NAN);
    }
    let panels = channels
        .iter()
        .zip(&data)
        .map(|(c, (measured, fitted))| TracePanel {
            label: c.0,
            unit: c.1,
            measured,
            fitted,
        })
        .collect();
    let sections = [
        (section, 310.0, 520.0),
        ("Village/The Loop", 790.0, 1320.0),
        ("Luffield", 1840.0, 2400.0),
        ("Maggotts/Becketts", 3500.0, 4260.0),
        ("Vale", 5380.0, 5700.0),
    ];
    let figure = TraceFigure {
        title,
        x_label: "distance (m)",
        x: &x,
        panels,
        sections: sections
            .map(|(name, start, end)| ShadedSection { name, start, end })
            .to_vec(),
    };
    drawn(name, |path| plot_traces(path, &figure))
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
    for samples in [0, 1] {
        let error = traces("short", samples, "short", "A").expect_err("no extent");
        assert!(error.to_string().contains("horizontal axis"), "{error}");
    }
    let x = [0.0, 1.0, 2.0];
    let draw = |measured: &[f64], fitted: &[f64]| {
        let figure = TraceFigure {
            title: "poor",
            x_label: "time (s)",
            x: &x,
            panels: vec![TracePanel {
                label: "roll",
                unit: "rad",
                measured,
                fitted,
            }],
            sections: vec![],
        };
        drawn("poor", |path| plot_traces(path, &figure))
    };
    let gap = [f64::NAN; 3];
    assert!(draw(&gap, &gap).expect("drawn").contains("no common samples"));
    assert!(draw(&[1.0; 3], &[1.0; 3]).is_ok());
    assert!(draw(&[1e300, -1e300, 0.0], &[f64::INFINITY, 0.0, 1e-300]).is_ok());
    let error = draw(&[1.0; 2], &[1.0; 3]).expect_err("lengths differ");
    assert!(
        error
            .to_string()
            .contains("panel roll: found 2 measured and 3 fitted")
    );
}

#[test]
fn convergence_shows_every_run() {
    let spent: Vec<f64> = (1..=400).map(|i| i as f64 * 4096.0).collect();
    let curve = |rate: f64, floor: f64| -> Vec<f64> {
        spent
            .iter()
            .map(|e| floor + 8.0 * (-rate * e / 1e5).exp())
            .collect()
    };
    let (a, b, m) = (curve(1.0, 2e-4), curve(0.7, 3e-3), curve(0.4, 2e-2));
    let run = |label, best, median| ConvergenceRun {
        label,
        evaluations: &spent,
        best,
        median,
    };
    let runs = [
        run("GPU, seed 1", a.as_slice(), Some(m.as_slice())),
        run("CPU, seed 2", &b, None),
    ];
    let draw = |runs: &[ConvergenceRun<'_>]| {
        drawn("convergence", |p| {
            plot_convergence(p, "Convergence", "cost (1)", runs)
        })
    };
    let svg = draw(&runs).expect("drawn");
    assert!(svg.contains("evaluations") && svg.contains("GPU, seed 1") && svg.contains("cost (1)"));
    assert!(draw(&[]).is_err());
    let nothing = vec![f64::NAN; 400];
    assert!(draw(&[run("lost", &nothing, None)]).is_err());
    assert!(draw(&[run("short", &a[1..], None)]).is_err());
    let one = ConvergenceRun {
        label: "one",
        evaluations: &[0.0],
        best: &[0.5],
        median: None,
    };
    assert!(drawn("one", |p| plot_convergence(p, "One", "cost", &[one])).is_ok());
    assert!(draw(&runs[..1]).is_ok());
}

#[test]
fn pareto_marks_the_choice() {
    let objectives = [("lap time", "s"), ("fuel", "l"), ("tyre energy", "MJ")]
        .map(|(name, unit)| Objective { name, unit });
    let points: Vec<Vec<f64>> = (0..200)
        .map(|i| {
            let t = i as f64 / 199.0;
            vec![118.0 + 5.0 * t * t, 1.2 + 1.5 * (1.0 - t).powi(2), 8.0 + noise(i)]
        })
        .collect();
    let draw = |name: &str, k: usize, chosen| {
        let some: Vec<Vec<f64>> = points.iter().map(|p| p[..k].to_vec()).collect();
        drawn(name, |p| {
            plot_pareto(p, "Compromises", &objectives[..k], &some, chosen)
        })
    };
    assert!(draw("pareto2", 2, Some(90)).expect("drawn").contains("chosen: "));
    assert!(
        draw("pareto3", 3, Some(90))
            .expect("drawn")
            .contains("tyre energy")
    );
    assert!(draw("bad", 2, Some(200)).is_err() && draw("bad", 1, None).is_err());
    let bad = [vec![f64::NAN, 1.0]];
    assert!(drawn("bad", |p| plot_pareto(p, "Bad", &objectives[..2], &bad, None)).is_err());
    let one = [vec![1.0, 1.0]];
    assert!(drawn("one", |p| plot_pareto(p, "One", &objectives[..2], &one, Some(0))).is_ok());
}

fn row(i: usize, name: &str) -> ParameterRow<'_> {
    let scale = 10f64.powi(i as i32 % 7 - 2);
    let place = 0.5 + 0.4 * noise(i);
    ParameterRow {
        name,
        unit: ["", "N m/rad", "N m s/rad"][i % 3],
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
    for n in [1, 22, 60] {
        let rows: Vec<_> = (0..n).map(|i| row(i, &names[i])).collect();
        let name = format!("parameters{n}");
        let svg = drawn(&name, |p| plot_parameters(p, "Identified parameters", &rows)).expect("drawn");
        assert!(rows.iter().all(|r| svg.contains(r.name)));
        assert_eq!(svg.contains("not identifiable"), n > 5);
    }
    let wild = ParameterRow {
        swarm: f64::NAN,
        fitted: 1e300,
        standard_error: Some(f64::INFINITY),
        truth: Some(f64::NEG_INFINITY),
        ..row(0, "wild")
    };
    assert!(drawn("wild", |p| plot_parameters(p, "Wild", &[wild])).is_ok());
    let reversed = ParameterRow {
        lower: 2.0,
        upper: 1.0,
        ..wild
    };
    let error = drawn("bad", |p| plot_parameters(p, "Bad", &[reversed])).expect_err("reversed");
    assert!(error.to_string().contains("parameter wild: found bounds 2 to 1"));
    assert!(drawn("bad", |p| plot_parameters(p, "Bad", &[])).is_err());
}

#[test]
fn scaling_shows_every_backend() {
    let population: Vec<f64> = (6..18).map(|k| f64::from(1 << k)).collect();
    let rate =
        |peak: f64, half: f64| -> Vec<f64> { population.iter().map(|p| peak * p / (p + half)).collect() };
    let (gpu, cpu) = (rate(2.5e6, 2e4), rate(9e3, 8.0));
    let series = [("GPU (Vulkan)", &gpu), ("CPU, 16 threads", &cpu)].map(|(label, rates)| ScalingSeries {
        label,
        population: &population,
        evaluations_per_s: rates,
    });
    let svg = drawn("scaling", |p| plot_scaling(p, "Throughput", &series)).expect("drawn");
    assert!(svg.contains("population (candidates)") && svg.contains("GPU (Vulkan)"));
    assert!(drawn("bad", |p| plot_scaling(p, "None", &[])).is_err());
    assert!(
        drawn("one", |p| plot_scaling(
            p,
            "One",
            &[ScalingSeries {
                label: "one",
                population: &[64.0],
                evaluations_per_s: &[5.0],
            }]
        ))
        .is_ok()
    );
}

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
    let (left, right) = (circuit.left_edge(), circuit.right_edge());
    let names = circuit
        .sections
        .iter()
        .map(|s| (s.name.as_str(), circuit.position_at(0.5 * (s.start_m + s.end_m))))
        .collect();
    let mut map = TrackMap {
        title: "Silverstone Grand Prix: speed along the lap",
        left_edge_m: &left,
        right_edge_m: &right,
        line_m: &circuit.centreline_m,
        values: &speed,
        value_label: "speed",
        value_unit: "m/s",
        closed: true,
        names,
    };
    let svg = drawn("track_map", |p| plot_track_map(p, &map)).expect("drawn");
    for label in ["Abbey", "Village/The Loop", "start", "speed (m/s)", "500 m"] {
        assert!(svg.contains(label), "{label}");
    }
    let corners = circuit.corners.iter();
    map.names = corners
        .map(|c| (c.name.as_str(), circuit.position_at(c.station_m)))
        .collect();
    assert!(drawn("track_map_corners", |p| plot_track_map(p, &map)).is_ok());
}

#[test]
fn poor_maps_are_drawn_or_refused() {
    let nan = DVec2::NAN;
    let line = [DVec2::ZERO, DVec2::X * 50.0, nan, DVec2::Y * 50.0, DVec2::ONE];
    let map = |line_m: &'static [DVec2], values: &'static [f64]| TrackMap {
        title: "poor",
        left_edge_m: &[],
        right_edge_m: &[],
        line_m,
        values,
        value_label: "speed",
        value_unit: "m/s",
        closed: true,
        names: vec![("lost", DVec2::NAN), ("", DVec2::ZERO)],
    };
    let draw = |m: TrackMap<'_>| drawn("poor_map", |p| plot_track_map(p, &m));
    let mut poor = map(&[], &[f64::NAN, 1.0, 1.0, f64::INFINITY, 2.0]);
    poor.line_m = &line;
    assert!(draw(poor).is_ok());
    assert!(draw(map(&[], &[])).is_err());
    assert!(draw(map(&[DVec2::ONE], &[1.0])).is_err());
    assert!(draw(map(&[DVec2::ONE; 3], &[1.0; 3])).is_err());
    assert!(draw(map(&[DVec2::ONE; 3], &[1.0; 2])).is_err());
}

#[test]
fn tables_keep_their_digits_and_their_units() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("table.csv");
    let names = ["plain".to_owned(), "with, comma\u{1b}[31m".to_owned()];
    let numbers = [0.1 + 0.2, f64::NAN];
    let columns = [
        Column {
            name: "candidate",
            unit: "",
            cells: Cells::Texts(&names),
        },
        Column {
            name: "yaw rate",
            unit: "rad/s",
            cells: Cells::Numbers(&numbers),
        },
    ];
    write_csv(&path, &columns).expect("written");
    let text = std::fs::read_to_string(&path).expect("read");
    assert!(
        text.starts_with("candidate,yaw rate (rad/s)\nplain,0.30000000000000004\n"),
        "{text}"
    );
    let table = text_table(&columns);
    assert!(
        !table.contains('\u{1b}') && table.contains("             0.3\n"),
        "{table}"
    );
    assert_eq!(table.lines().count(), 4);
    assert_eq!(text_table(&[]), "");

    let short = Column {
        cells: Cells::Numbers(&numbers[..1]),
        ..columns[1]
    };
    let error = write_csv(&path, &[columns[0], short]).expect_err("lengths differ");
    assert!(
        error
            .to_string()
            .contains("column yaw rate: found 1 rows, expected 2")
    );
    assert!(write_csv(&path, &[]).is_err());
    assert_eq!(
        std::fs::read_to_string(&path).expect("read"),
        text,
        "left as it was"
    );
    let nowhere = folder.path().join("absent/table.csv");
    assert!(matches!(write_csv(&nowhere, &columns), Err(Error::Io { .. })));
    assert_eq!(std::fs::read_dir(&folder).expect("listed").count(), 1);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn any_numbers_draw_without_panic(
        values in prop::collection::vec(prop::num::f64::ANY, 2..12),
        places in prop::collection::vec(prop::num::f64::ANY, 12),
    ) {
        let places = &places[..values.len()];
        let figure = TraceFigure {
            title: "any",
            x_label: "time (s)",
            x: places,
            panels: vec![TracePanel { label: "a", unit: "1", measured: &values, fitted: places }],
            sections: vec![ShadedSection { name: "s", start: values[0], end: values[1] }],
        };
        let _ = drawn("any", |p| plot_traces(p, &figure));
        let run = ConvergenceRun { label: "r", evaluations: places, best: &values, median: None };
        let _ = drawn("any", |p| plot_convergence(p, "any", "cost", &[run]));
        let one = ScalingSeries { label: "s", population: places, evaluations_per_s: &values };
        let _ = drawn("any", |p| plot_scaling(p, "any", &[one]));
        let line: Vec<DVec2> = places.iter().zip(&values).map(|(&x, &y)| DVec2::new(x, y)).collect();
        let map = TrackMap {
            title: "any", left_edge_m: &line, right_edge_m: &line, line_m: &line, values: &values,
            value_label: "v", value_unit: "1", closed: false, names: vec![("n", line[0])],
        };
        let _ = drawn("any", |p| plot_track_map(p, &map));
        let points: Vec<Vec<f64>> = line.iter().map(|p| vec![p.x, p.y]).collect();
        let objectives = [Objective { name: "a", unit: "" }; 2];
        let _ = drawn("any", |p| plot_pareto(p, "any", &objectives, &points, Some(0)));
    }
}
