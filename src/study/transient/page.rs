//! The figures of a closed-loop lap and its interactive report.

use super::{DrivenLine, LineSummary};
use crate::error::Result;
use crate::report::{HtmlReport, LapLine, LapView, Road};
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

pub(super) fn write(
    folder: &Path,
    outcome: &DrivenLine,
    summary: &LineSummary,
    driven_m: &[DVec2],
) -> Result<()> {
    let mut page = HtmlReport::new("transient", &format!("A line driven by the {}", summary.car));
    for sentence in summary.to_text().lines() {
        page.sentence(sentence);
    }
    page.tile("Driven lap", format!("{:.3}", summary.lap_time_s), "s");
    page.tile(
        "Quasi-steady-state lap",
        format!("{:.3}", summary.point_mass_lap_time_s),
        "s",
    );
    page.tile("Grip held", format!("{:.0}", 100.0 * summary.grip_share), "%");
    page.tile("Least room", format!("{:.2}", summary.margin_m), "m");
    if !summary.agrees {
        page.warning("The two laps differ by more than the half percent asked for.");
    }
    let (drive, line) = (&outcome.drive, &outcome.line);
    let state = |k: usize| drive.states.iter().map(|s| s[k]).collect::<Vec<f64>>();
    let steer_deg = drive.inputs.iter().map(|(_, steer)| steer.to_degrees());
    let driven = LapLine::new("4DOF car and driver", &drive.station_m[..])
        .trace(0, state(0))
        .trace(1, &drive.offset_m[..])
        .trace(2, steer_deg.collect::<Vec<f64>>())
        .trace(3, state(2))
        .trace(4, state(1))
        .at(driven_m);
    let point_mass = outcome.point_mass.lap.iter().map(|lap| {
        LapLine::new("quasi-steady-state lap", &lap.station_m[..])
            .trace(0, &lap.v_mps[..])
            .at(&outcome.point_mass.points_m[..])
    });
    let view = LapView::new("The line, driven")
        .note("Of the road, the map shows what the middle of the car may use. Positive is to the left.")
        .x("distance along the line", "m")
        .panels(PANELS)
        .line(driven)
        .lines(point_mass)
        .road(Road {
            left_edge_m: line.left_edge(),
            right_edge_m: line.right_edge(),
            closed: true,
            names: Vec::new(),
        });
    page.section("Lap", "");
    page.figure(folder.join("speeds.svg"), &view)?;
    if let Some(map) = view.track_map(format!("Driven in {:.2} s", outcome.lap_time_s)) {
        map.write_svg(folder.join("map.svg"))?;
    }
    page.provenance("car", &summary.car);
    summary.record.provenance(&mut page, "laps driven");
    page.write(folder.join("report.html"))
}
