//! Panels of curves over a common quantity each.

use std::path::Path;

use super::axis::{Axis, Labels, Plot, draw_legend, extent, legend_rows};
use super::canvas::{Align, Type, draw_to_file};
use super::style::{INK, LABEL_PX, series_colour, viridis};
use crate::{Error, Result};

/// A curve.
#[derive(Debug, Clone)]
pub struct Curve<'a> {
    /// Its name in the legend; empty for none.
    pub label: &'a str,
    /// Horizontal values; gaps where not finite.
    pub x: Vec<f64>,
    /// Vertical values, one per horizontal one.
    pub y: Vec<f64>,
    /// Where the curve stands on a scale of colour from 0 to 1, for families of curves; its own colour if none.
    pub shade: Option<f64>,
}

/// Curves over one quantity.
#[derive(Debug, Clone)]
pub struct CurvePanel<'a> {
    /// What is shown.
    pub title: &'a str,
    /// Horizontal quantity and unit.
    pub x_label: &'a str,
    /// Vertical quantity and unit.
    pub y_label: &'a str,
    /// The curves.
    pub curves: Vec<Curve<'a>>,
}

const PANEL: (f64, f64) = (590.0, 420.0);
const TOP: f64 = 52.0;

/// Draws panels of curves, two beside each other, to an SVG file.
///
/// # Errors
/// [`Error::Input`] when there is no panel or a panel has nothing finite to draw; [`Error::Io`] when the file cannot be
/// written.
pub fn plot_curves(path: impl AsRef<Path>, title: &str, panels: &[CurvePanel<'_>]) -> Result<()> {
    let path = path.as_ref();
    if panels.is_empty() {
        return Err(Error::input(path, "panels", "none", "at least one"));
    }
    let mut ranges = Vec::new();
    for panel in panels {
        let x = extent(panel.curves.iter().flat_map(|c| &c.x));
        let y = extent(panel.curves.iter().flat_map(|c| &c.y));
        match (x, y) {
            (Some(x), Some(y)) if panel.curves.iter().all(|c| c.x.len() == c.y.len()) => ranges.push((x, y)),
            _ => {
                let place = format!("panel {}", panel.title);
                return Err(Error::input(
                    path,
                    place,
                    "no finite point, or lengths that differ",
                    "curves with points",
                ));
            }
        }
    }
    let columns = panels.len().min(2);
    let rows = panels.len().div_ceil(columns);
    let size = (PANEL.0 * columns as f64 + 20.0, TOP + PANEL.1 * rows as f64);
    draw_to_file(path, size, title, |canvas| {
        for (index, (panel, (x, y))) in panels.iter().zip(ranges).enumerate() {
            let left = PANEL.0 * (index % columns) as f64 + 78.0;
            let right = PANEL.0 * (index % columns + 1) as f64;
            let top = TOP + PANEL.1 * (index / columns) as f64 + 34.0;
            let bottom = TOP + PANEL.1 * (index / columns + 1) as f64 - 76.0;
            let name = Type::new(LABEL_PX, INK, Align::Left).bold();
            canvas.text(panel.title, (left, top - 14.0), name);
            let plot = Plot {
                x: Axis::padded(x, 0.02, (left, right)),
                y: Axis::padded(y, 0.06, (bottom, top)),
            };
            plot.draw_axes(
                canvas,
                Labels {
                    x: Some(panel.x_label),
                    y: Some(panel.y_label),
                    x_ticks: 8,
                    y_ticks: 7,
                },
            );
            let colour = |i: usize, curve: &Curve<'_>| curve.shade.map_or_else(|| series_colour(i), viridis);
            for (i, curve) in panel.curves.iter().enumerate() {
                let points = curve.x.iter().copied().zip(curve.y.iter().copied());
                plot.curve(canvas, points, colour(i, curve), 1.8);
            }
            let legend: Vec<_> = panel
                .curves
                .iter()
                .enumerate()
                .filter(|(_, c)| !c.label.is_empty())
                .map(|(i, c)| (c.label, colour(i, c), 2.0))
                .collect();
            // Below the axis: the head of a panel is its title's.
            for (row, entries) in legend_rows(&legend, right - left + 60.0).into_iter().enumerate() {
                draw_legend(canvas, entries, right, bottom + 54.0 + 17.0 * row as f64);
            }
        }
    })
}
