//! The interactive report of a car's g-g-v envelope.

use super::{EnvelopeSummary, curves, surface};
use crate::error::Result;
use crate::report::{HtmlReport, Table};
use crate::study::envelope::{CarLimits, Outcome};
use std::path::Path;

pub fn write(folder: &Path, outcome: &Outcome, summary: &EnvelopeSummary) -> Result<()> {
    let limits = &outcome.limits;
    let mut page = HtmlReport::new("envelope", &format!("g-g-v envelope of the {}", summary.car));
    if let (Some(slow), Some(fast)) = (limits.speeds.first(), limits.speeds.last()) {
        page.sentence(format!(
            "The {} corners at up to {:.1} m/s\u{b2} at {:.0} m/s and {:.1} m/s\u{b2} at {:.0} m/s, brakes at up to {:.1} and \
             {:.1} m/s\u{b2}, and reaches {:.1} m/s.",
            summary.car,
            slow.row.ay_mps2,
            slow.row.v_mps,
            fast.row.ay_mps2,
            fast.row.v_mps,
            slow.row.ax_grip_mps2,
            fast.row.ax_grip_mps2,
            summary.top_speed_mps
        ));
        page.tile("Cornering, slow", format!("{:.2}", slow.row.ay_mps2), "m/s\u{b2}");
        page.tile("Cornering, fast", format!("{:.2}", fast.row.ay_mps2), "m/s\u{b2}");
    }
    page.tile("Top speed", format!("{:.1}", summary.top_speed_mps), "m/s");
    page.tile(
        "Understeer gradient",
        format!("{:.3}", summary.understeer_gradient_deg_per_g).replace('-', "\u{2212}"),
        "deg/g",
    );
    page.sentence(format!("At small angles the car {}.", summary.balance()));
    for note in &summary.notes {
        page.sentence(note.clone());
    }
    page.section(
        "Limits",
        "From steady states of the 4DOF model at each speed. The engine's limit is that of its best gear.",
    );
    page.figure(folder.join("envelope.svg"), &curves(limits, &summary.car))?;
    if let Some(found) = &outcome.surface {
        surface::write_tables(folder, found)?;
        page.section("The surface", surface::ABOUT);
        page.paragraph(&surface::in_words(&found.summary, &outcome.record));
        if let Some(figure) = surface::figure(found, &summary.car) {
            page.figure(folder.join("surface.svg"), &figure)?;
        }
    }
    page.table(
        "Limits at each speed",
        "Drive is the lesser of traction and engine. Drag reduces the drive and helps the brakes.",
        &speeds_table(limits),
    )?;
    page.provenance("car", &summary.car);
    page.provenance("limits", "cpu, f64");
    page.provenance("steady states", summary.steady_states.to_string());
    summary.record.provenance(&mut page, "cars of the surface");
    page.write(folder.join("report.html"))
}

/// Accelerations by speed.
fn speeds_table(limits: &CarLimits) -> Table<'static> {
    Table::rows(&limits.speeds)
        .number("speed", "m/s", |s| s.row.v_mps)
        .number("cornering", "m/s^2", |s| s.row.ay_mps2)
        .number("braking grip", "m/s^2", |s| s.row.ax_grip_mps2)
        .number("drive", "m/s^2", |s| s.row.ax_drive_mps2)
        .number("traction", "m/s^2", |s| s.traction_mps2)
        .number("engine", "m/s^2", |s| s.engine_mps2)
        .number("drag", "m/s^2", |s| s.row.drag_mps2)
        .table()
}
