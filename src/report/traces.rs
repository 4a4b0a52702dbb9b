//! Measured and fitted channels over a lap, with the error under each.

use std::path::Path;

use super::axis::{Axis, Labels, Plot, draw_legend, extent};
use super::canvas::{Align, Canvas, Type, draw_to_file};
use super::style::{
    BLUE, FAINT_INK, GREYED, INK, LABEL_PX, SHADE, TICK_PX, VERMILLION, significant, with_unit,
};
use crate::{Error, Result};

/// One channel of a [`TraceFigure`].
#[derive(Debug, Clone, Copy)]
pub struct TracePanel<'a> {
    /// The quantity, as in `yaw rate`.
    pub label: &'a str,
    /// Its unit, as in `rad/s`.
    pub unit: &'a str,
    /// Logged values, one per `x`; gaps where they are not finite.
    pub measured: &'a [f64],
    /// Values of the fitted model, one per `x`; gaps where they are not finite.
    pub fitted: &'a [f64],
}

/// A stretch of the horizontal axis to shade and name.
#[derive(Debug, Clone, Copy)]
pub struct ShadedSection<'a> {
    /// Name written above it.
    pub name: &'a str,
    /// Where it starts, in the unit of `x`.
    pub start: f64,
    /// Where it ends, in the unit of `x`.
    pub end: f64,
}

/// Channels over a common axis.
#[derive(Debug, Clone)]
pub struct TraceFigure<'a> {
    /// Title of the figure.
    pub title: &'a str,
    /// Quantity and unit of the horizontal axis, as in `distance (m)`.
    pub x_label: &'a str,
    /// Values of the horizontal axis, rising.
    pub x: &'a [f64],
    /// Up to 12 channels, drawn from the top.
    pub panels: Vec<TracePanel<'a>>,
    /// Stretches to shade.
    pub sections: Vec<ShadedSection<'a>>,
}

const WIDTH: f64 = 1200.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 1180.0;
const HEAD: f64 = 78.0;
const CURVES: f64 = 112.0;
const ERRORS: f64 = 42.0;
const BETWEEN: f64 = 5.0;
const PITCH: f64 = CURVES + BETWEEN + ERRORS + 34.0;
const MEASURED_PX: f64 = 3.0;
const FITTED_PX: f64 = 1.2;

/// Draws measured and fitted channels over a lap to an SVG file.
///
/// # Errors
/// [`Error::Input`] when there is no channel, when lengths differ or when fewer than two places on
/// the horizontal axis are finite; [`Error::Io`] when the file cannot be written.
pub fn plot_traces(path: impl AsRef<Path>, figure: &TraceFigure<'_>) -> Result<()> {
    let path = path.as_ref();
    let range = check(path, figure)?;
    let height = HEAD + PITCH * figure.panels.len() as f64 + 30.0;
    draw_to_file(path, (WIDTH, height), figure.title, |canvas| {
        let legend = [
            ("measured", GREYED, MEASURED_PX + 1.0),
            ("fitted", BLUE, FITTED_PX + 0.8),
            ("error (fitted \u{2212} measured)", VERMILLION, 1.8),
        ];
        draw_legend(canvas, &legend, RIGHT, 28.0);
        let x = Axis::linear(range, (LEFT, RIGHT));
        name_sections(canvas, figure, x, range);
        for (i, panel) in figure.panels.iter().enumerate() {
            let top = HEAD + PITCH * i as f64;
            let last = i + 1 == figure.panels.len();
            draw_panel(canvas, figure, panel, x, range, top, last);
        }
    })
}

fn check(path: &Path, figure: &TraceFigure<'_>) -> Result<(f64, f64)> {
    let refuse =
        |place: String, found: String, expected: &str| Err(Error::input(path, place, found, expected));
    let panels = figure.panels.len();
    if !(1..=12).contains(&panels) {
        return refuse("panels".into(), format!("{panels} panels"), "1 to 12");
    }
    for panel in &figure.panels {
        let lengths = (panel.measured.len(), panel.fitted.len());
        if lengths != (figure.x.len(), figure.x.len()) {
            return refuse(
                format!("panel {}", panel.label),
                format!("{} measured and {} fitted samples", lengths.0, lengths.1),
                &format!("{} of both, one per place", figure.x.len()),
            );
        }
    }
    match extent(figure.x) {
        Some((low, high)) if high > low => Ok((low, high)),
        _ => refuse(
            "horizontal axis".into(),
            format!("{} samples without any extent", figure.x.len()),
            "at least two different finite places",
        ),
    }
}

/// The part of a section that lies on the axis (px), if any does.
fn band(section: &ShadedSection<'_>, x: Axis, range: (f64, f64)) -> Option<(f64, f64)> {
    let (start, end) = (section.start.max(range.0), section.end.min(range.1));
    (start < end).then(|| (x.at(start), x.at(end)))
}

fn name_sections(canvas: &mut Canvas<'_>, figure: &TraceFigure<'_>, x: Axis, range: (f64, f64)) {
    let look = Type::new(TICK_PX, FAINT_INK, Align::Centre);
    let mut taken = f64::NEG_INFINITY;
    for section in &figure.sections {
        let Some((left, right)) = band(section, x, range) else {
            continue;
        };
        let half = 0.5 * look.width(section.name);
        let middle = (0.5 * (left + right)).clamp(LEFT + half, (RIGHT - half).max(LEFT + half));
        // Neighbours whose names would touch are named on two levels.
        let low = middle - half > taken + 6.0;
        canvas.text(
            section.name,
            (middle, if low { HEAD - 26.0 } else { HEAD - 39.0 }),
            look,
        );
        if low {
            taken = middle + half;
        }
    }
}

fn draw_panel(
    canvas: &mut Canvas<'_>,
    figure: &TraceFigure<'_>,
    panel: &TracePanel<'_>,
    x: Axis,
    range: (f64, f64),
    top: f64,
    last: bool,
) {
    let bottom = top + CURVES;
    let error_top = bottom + BETWEEN;
    let error_bottom = error_top + ERRORS;
    for (left, right) in figure.sections.iter().filter_map(|s| band(s, x, range)) {
        canvas.rect((left, top), (right, bottom), SHADE, 1.0);
        canvas.rect((left, error_top), (right, error_bottom), SHADE, 1.0);
    }

    let errors: Vec<f64> = panel
        .fitted
        .iter()
        .zip(panel.measured)
        .map(|(f, m)| f - m)
        .collect();
    let name = Type::new(LABEL_PX, INK, Align::Left).bold();
    canvas.text(&with_unit(panel.label, panel.unit), (LEFT, top - 11.0), name);
    canvas.text(
        &rms_text(&errors, panel.unit),
        (RIGHT, top - 11.0),
        Type::new(LABEL_PX - 1.0, INK, Align::Right),
    );

    let labels = Labels {
        x: None,
        y: None,
        x_ticks: 12,
        y_ticks: 5,
    };
    let values = extent(panel.measured.iter().chain(panel.fitted)).unwrap_or((0.0, 0.0));
    let curves = Plot {
        x,
        y: Axis::padded(values, 0.06, (bottom, top)),
    };
    curves.draw_axes(canvas, labels);
    let over = |values: &'_ [f64]| -> Vec<(f64, f64)> {
        figure.x.iter().copied().zip(values.iter().copied()).collect()
    };
    let measured = over(panel.measured).into_iter();
    curves.curve(canvas, measured, GREYED, MEASURED_PX);
    let fitted = over(panel.fitted).into_iter();
    curves.curve(canvas, fitted, BLUE, FITTED_PX);

    let largest = extent(&errors).map_or(0.0, |(low, high)| low.abs().max(high.abs()));
    let error = Plot {
        x,
        y: Axis::around_zero(largest, (error_bottom, error_top)),
    };
    error.draw_axes(
        canvas,
        Labels {
            x: last.then_some(figure.x_label),
            y_ticks: 3,
            ..labels
        },
    );
    error.curve(canvas, over(&errors).into_iter(), VERMILLION, 1.0);
}

fn rms_text(errors: &[f64], unit: &str) -> String {
    let finite: Vec<f64> = errors.iter().copied().filter(|e| e.is_finite()).collect();
    if finite.is_empty() {
        return "no common samples".to_owned();
    }
    let rms = (finite.iter().map(|e| e * e).sum::<f64>() / finite.len() as f64).sqrt();
    format!("rms error {} {unit}", significant(rms, 3))
}
