//! Horizontal bars, several to a name, with intervals.

use super::axis::{Axis, Labels, Plot, draw_legend};
use super::canvas::{Align, Type, draw_to_file};
use super::style::{INK, LABEL_PX, TICK_PX, series_colour};
use crate::{Error, Result};
use std::path::Path;

/// The bars of one kind, one for each name.
#[derive(Clone, Debug)]
pub struct BarSeries<'a> {
    /// What they show, in the legend.
    pub label: &'a str,
    /// How long they are.
    pub values: Vec<f64>,
    /// What each may be instead, lower and upper; empty for none.
    pub intervals: Vec<[f64; 2]>,
}

/// Bars of one quantity.
#[derive(Clone, Debug)]
pub struct BarPanel<'a> {
    /// Above it.
    pub title: &'a str,
    /// The quantity with its unit, under it.
    pub x_label: &'a str,
    /// Names of the rows, from the top.
    pub names: Vec<&'a str>,
    /// The bars.
    pub series: Vec<BarSeries<'a>>,
}

const PANEL_WIDTH: f64 = 620.0;
const ROW: f64 = 24.0;
const HEAD: f64 = 96.0;
const FOOT: f64 = 84.0;
const NAMES: f64 = 190.0;

/// Draws panels side by side, two to a row, to an SVG file.
///
/// # Errors
/// [`Error::Input`] when there is no panel, or one has no names, lengths that differ or nothing finite; [`Error::Io`] when
/// the file cannot be written.
pub fn plot_bars(path: impl AsRef<Path>, title: &str, panels: &[BarPanel<'_>]) -> Result<()> {
    let path = path.as_ref();
    let refuse = |place: String, found: &str| {
        Err(Error::input(
            path,
            place,
            found,
            "as many finite bars as names, at least one",
        ))
    };
    if panels.is_empty() {
        return refuse("panels".to_owned(), "none");
    }
    for panel in panels {
        let n = panel.names.len();
        let sound =
            |s: &BarSeries<'_>| s.values.len() == n && (s.intervals.is_empty() || s.intervals.len() == n);
        let finite = panel.series.iter().flat_map(|s| &s.values).any(|v| v.is_finite());
        if n == 0 || !finite || !panel.series.iter().all(sound) {
            return refuse(
                format!("panel {}", panel.title),
                "lengths that differ, or nothing to draw",
            );
        }
    }
    let columns = panels.len().min(2);
    let most = panels.iter().map(|p| p.names.len()).max().unwrap_or(1) as f64;
    let height = HEAD + ROW * most + FOOT;
    let rows = panels.len().div_ceil(columns) as f64;
    let size = (PANEL_WIDTH * columns as f64 + 24.0, height * rows);
    draw_to_file(path, size, title, |canvas| {
        for (index, panel) in panels.iter().enumerate() {
            let left = PANEL_WIDTH * (index % columns) as f64 + NAMES;
            let right = PANEL_WIDTH * (index % columns + 1) as f64 - 8.0;
            let top = height * (index / columns) as f64 + HEAD;
            let bottom = top + ROW * panel.names.len() as f64;
            let ends = panel.series.iter().flat_map(|s| {
                s.values
                    .iter()
                    .copied()
                    .chain(s.intervals.iter().flatten().copied())
            });
            let (low, high) = ends
                .filter(|v| v.is_finite())
                .fold((0.0f64, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
            let plot = Plot {
                x: Axis::padded((low, high), 0.02, (left, right)),
                y: Axis::linear((0.0, panel.names.len() as f64), (bottom, top)),
            };
            // Names stand where figures would.
            plot.draw_inner(
                canvas,
                Labels {
                    x: Some(panel.x_label),
                    y: None,
                    x_ticks: 7,
                    y_ticks: 1,
                },
            );
            let look = Type::new(LABEL_PX, INK, Align::Left).bold();
            canvas.text(panel.title, (left, top - 34.0), look);
            let nought = plot.x.at(0.0);
            let thick = (ROW - 6.0) / panel.series.len() as f64;
            for (row, name) in panel.names.iter().enumerate() {
                let y = top + ROW * (row as f64 + 0.5);
                canvas.text(name, (left - 8.0, y), Type::new(TICK_PX, INK, Align::Right));
                for (i, series) in panel.series.iter().enumerate() {
                    let upper = top + ROW * row as f64 + 3.0 + thick * i as f64;
                    let value = series.values[row];
                    if !value.is_finite() {
                        continue;
                    }
                    let end = plot.x.at(value);
                    canvas.rect(
                        (nought.min(end), upper),
                        (nought.max(end), upper + thick - 1.0),
                        series_colour(i),
                        0.85,
                    );
                    if let Some([a, b]) = series
                        .intervals
                        .get(row)
                        .filter(|i| i.iter().all(|v| v.is_finite()))
                    {
                        let middle = upper + 0.5 * (thick - 1.0);
                        canvas.line((plot.x.at(*a), middle), (plot.x.at(*b), middle), INK, 1.2);
                    }
                }
            }
            let legend: Vec<_> = panel
                .series
                .iter()
                .enumerate()
                .filter(|(_, s)| !s.label.is_empty())
                .map(|(i, s)| (s.label, series_colour(i), 6.0))
                .collect();
            draw_legend(canvas, &legend, right, top - 14.0);
        }
    })
}
