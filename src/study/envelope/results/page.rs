//! The interactive report of a car's limits.

use super::{EnvelopeSummary, surface};
use crate::error::Result;
use crate::evaluate::failures_in_words;
use crate::report::{Cells, Column, CurvePanel, HtmlReport, Scale};
use crate::study::envelope::{CarLimits, SpeedLimits, SteadySurface};
use std::path::Path;

pub fn write(
    folder: &Path,
    (limits, surface): (&CarLimits, Option<&SteadySurface>),
    summary: &EnvelopeSummary,
    panels: &[CurvePanel<'_>],
) -> Result<()> {
    let mut page = HtmlReport::new("envelope", &format!("Limits of the {}", summary.car));
    if let (Some(slow), Some(fast)) = (limits.speeds.first(), limits.speeds.last()) {
        page.sentence(format!(
            "The {} corners at up to {:.1} m/s\u{b2} at {:.0} m/s and {:.1} m/s\u{b2} at {:.0} m/s, brakes at up to {:.1} and \
             {:.1} m/s\u{b2}, and ends at {:.1} m/s.",
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
    page.section(
        "Limits",
        "From steady states of the 4DOF model at each speed; the engine's limit is that of its best gear.",
    );
    for panel in panels {
        page.curves(panel, "", [Scale::Linear; 2])?;
    }
    if let Some(found) = surface {
        page.section("The surface", surface::ABOUT);
        page.paragraph(&surface::in_words(&found.summary));
        surface::with_figure(found, &summary.car, |figure| page.surface(figure, ""))?;
    }
    let of = |f: &dyn Fn(&SpeedLimits) -> f64| limits.speeds.iter().map(f).collect::<Vec<f64>>();
    let figures = [
        ("speed", "m/s", of(&|s| s.row.v_mps)),
        ("cornering", "m/s^2", of(&|s| s.row.ay_mps2)),
        ("braking grip", "m/s^2", of(&|s| s.row.ax_grip_mps2)),
        ("drive", "m/s^2", of(&|s| s.row.ax_drive_mps2)),
        ("traction", "m/s^2", of(&|s| s.traction_mps2)),
        ("engine", "m/s^2", of(&|s| s.engine_mps2)),
        ("drag", "m/s^2", of(&|s| s.row.drag_mps2)),
    ];
    let columns: Vec<Column<'_>> = figures
        .iter()
        .map(|(name, unit, values)| Column {
            name,
            unit,
            cells: Cells::Numbers(values),
        })
        .collect();
    page.table(
        "Limits at each speed",
        "Drive is the lesser of traction and engine. Drag is to be taken off drive, and helps the brakes.",
        &columns,
    )?;
    page.provenance("car", &summary.car);
    page.provenance("limits", "cpu, f64");
    if let Some(found) = surface {
        page.provenance("backend", found.backend.backend);
        page.provenance("adapter", &found.backend.device);
        page.provenance("driver", &found.backend.driver);
        page.provenance("cars that failed", failures_in_words(&found.summary.failures));
    }
    page.provenance("steady states", summary.steady_states.to_string());
    page.provenance("time", format!("{:.2} s", summary.elapsed_s));
    page.write(folder.join("report.html"))
}
