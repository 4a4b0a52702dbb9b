//! The interactive report of a drive.

use super::{Outcome, Summary};
use crate::error::Result;
use crate::report::{HtmlReport, LapLine, LapMap, LapPanel, LapTrace, LapView};
use glam::DVec2;
use std::path::Path;

/// Rows of the traces, from the top.
const PANELS: [(&str, &str); 5] = [
    ("speed", "m/s"),
    ("off the line", "m"),
    ("steering", "deg"),
    ("yaw rate", "rad/s"),
    ("lateral speed", "m/s"),
];

pub(super) fn write(folder: &Path, outcome: &Outcome, summary: &Summary, driven_m: &[DVec2]) -> Result<()> {
    let mut page = HtmlReport::new("transient", &format!("A line driven by the {}", summary.car));
    for sentence in summary.to_text().lines() {
        page.sentence(sentence);
    }
    page.tile("Driven lap", format!("{:.3}", summary.lap_time_s), "s");
    page.tile("Point mass", format!("{:.3}", summary.point_mass_lap_time_s), "s");
    page.tile("Grip held", format!("{:.0}", 100.0 * summary.grip_share), "%");
    page.tile("Least room", format!("{:.2}", summary.margin_m), "m");
    if !summary.agrees {
        page.warning("The two laps differ by more than the half percent asked for.");
    }
    let (drive, line) = (&outcome.drive, &outcome.line);
    let trace = |panel, values| LapTrace {
        panel,
        values,
        band: None,
    };
    let state = |k: usize| drive.states.iter().map(|s| s[k]).collect::<Vec<f64>>();
    let steer_deg = drive.inputs.iter().map(|(_, steer)| steer.to_degrees()).collect();
    let mut lines = vec![LapLine {
        name: "4DOF car and driver",
        x: drive.station_m.clone(),
        traces: vec![
            trace(0, state(0)),
            trace(1, drive.offset_m.clone()),
            trace(2, steer_deg),
            trace(3, state(2)),
            trace(4, state(1)),
        ],
        place_m: driven_m.to_vec(),
        wide: false,
    }];
    if let Some(lap) = &outcome.point_mass.lap {
        lines.push(LapLine {
            name: "point mass",
            x: lap.station_m.clone(),
            traces: vec![trace(0, lap.v_mps.clone())],
            place_m: outcome.point_mass.points_m.clone(),
            wide: false,
        });
    }
    page.section("Lap", "");
    let (left, right) = (line.left_edge(), line.right_edge());
    page.lap(&LapView {
        title: "The line, driven",
        note: "Of the road, the map shows what the car's middle may use. Positive is to the left.",
        x_label: "distance along the line",
        x_unit: "m",
        panels: PANELS
            .iter()
            .map(|(label, unit)| LapPanel {
                label,
                unit,
                height: 1.0,
            })
            .collect(),
        lines,
        map: Some(LapMap {
            left_edge_m: &left,
            right_edge_m: &right,
            closed: true,
            names: Vec::new(),
        }),
        ..LapView::default()
    })?;
    page.provenance("car", &summary.car);
    page.provenance("backend", summary.backend);
    page.provenance("adapter", summary.adapter);
    page.provenance("laps driven", summary.evaluations.to_string());
    page.provenance("time", format!("{:.1} s", summary.elapsed_s));
    page.write(folder.join("report.html"))
}
