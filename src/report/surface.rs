//! A cost over two parameters: levels from above, and the surface in space.

use super::axis::{Axis, Labels, Plot, extent};
use super::canvas::{Align, Canvas, Type, draw_to_file};
use super::html::thin::picked;
use super::html::{Numbers, raised};
use super::style::{FAINT_INK, INK, LABEL_PX, TICK_PX, VERMILLION, WHITE, significant, viridis};
use super::{Figure, HtmlReport};
use crate::{Error, Result};
use contour::ContourBuilder;
use serde_json::json;
use std::path::Path;

/// How colours and levels are spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Levels {
    /// With the root of the cost above its least, which spreads a basin's bottom.
    Basin,
    /// Evenly.
    Even,
}

/// A cost over an even grid of two parameters: its levels from above, and the surface in space.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Above it.
    pub title: String,
    /// Horizontal parameter with its unit.
    pub x_label: String,
    /// Vertical parameter with its unit.
    pub y_label: String,
    /// The cost with its unit.
    pub z_label: String,
    /// Values of the horizontal parameter, evenly spaced and ascending.
    pub x: Vec<f64>,
    /// Values of the vertical parameter, likewise.
    pub y: Vec<f64>,
    /// The cost, row by row of `y`; what is not finite is left white.
    pub z: Vec<f64>,
    /// How colours and levels are spread over it.
    pub levels: Levels,
    /// Places to mark, with their names.
    pub marks: Vec<(String, [f64; 2])>,
}

impl Levels {
    /// The place on the scale of colours of a share of the spread of costs.
    fn colour(self, share: f64) -> f64 {
        match self {
            Self::Basin => share.sqrt(),
            Self::Even => share,
        }
    }

    /// The share of the spread of costs at a place on the scale.
    fn share(self, place: f64) -> f64 {
        match self {
            Self::Basin => place.powi(2),
            Self::Even => place,
        }
    }
}

const SIZE: (f64, f64) = (1400.0, 640.0);
/// Radius of a mark.
const MARK_PX: f64 = 5.0;
/// Levels between the least and the greatest cost.
const LEVELS: usize = 12;

/// Values along each side of a surface that go into a page at most.
const GRID: usize = 100;

impl Figure for Surface {
    fn write_svg(&self, path: &Path) -> Result<()> {
        let (least, most) = self.check(path)?;
        let spread = (most - least).max(1e-300);
        let levels = self.levels;
        let share = move |z: f64| levels.colour(((z - least) / spread).max(0.0));
        draw_to_file(path, SIZE, &self.title, |canvas| {
            draw_levels(canvas, self, &share, (least, spread));
            draw_in_space(canvas, self, &share);
            draw_scale(canvas, self, (least, spread));
        })
    }

    fn place(&self, page: &mut HtmlReport) -> Result<()> {
        self.check(Path::new(&self.title))?;
        let (nx, ny) = (self.x.len(), self.y.len());
        // The ends stay; what is between them is as even as it can be.
        let kept = |n: usize| -> Vec<usize> {
            let count = n.min(GRID);
            (0..count).map(|i| i * (n - 1) / (count - 1)).collect()
        };
        let (columns, rows) = (kept(nx), kept(ny));
        let note = if nx.max(ny) > GRID {
            let (kept, of) = (columns.len().max(rows.len()), nx.max(ny));
            format!("{kept} of up to {of} values along a side are drawn.")
        } else {
            String::new()
        };
        let row = |j: &usize| Numbers::new(columns.iter().map(|i| self.z[j * nx + i]));
        let marked = self.marks.iter().map(|(name, [x, y])| (x, y, name));
        let chart = json!({
            "kind": "surface",
            "x_label": raised(&self.x_label),
            "y_label": raised(&self.y_label),
            "value_label": raised(&self.z_label),
            "x": Numbers::new(picked(&self.x, &columns)),
            "y": Numbers::new(picked(&self.y, &rows)),
            "values": rows.iter().map(row).collect::<Vec<_>>(),
            "marked": marked.collect::<Vec<_>>(),
        });
        page.chart(&self.title, &note, chart);
        Ok(())
    }
}

impl Surface {
    /// The least and the greatest cost of a sound grid.
    fn check(&self, path: &Path) -> Result<(f64, f64)> {
        let (nx, ny) = (self.x.len(), self.y.len());
        let sound = nx >= 2 && ny >= 2 && nx * ny == self.z.len();
        extent(&self.z).filter(|_| sound).ok_or_else(|| {
            let found = format!("{nx} by {ny} places and {} costs", self.z.len());
            let expected = "2 by 2 places or more, one cost each, some of them finite";
            Error::input(path, "grid", found, expected)
        })
    }
}

fn draw_levels(
    canvas: &mut Canvas<'_>,
    figure: &Surface,
    share: &dyn Fn(f64) -> f64,
    (least, spread): (f64, f64),
) {
    let (nx, ny) = (figure.x.len(), figure.y.len());
    let step = |v: &[f64]| (v[v.len() - 1] - v[0]) / (v.len() - 1) as f64;
    let (dx, dy) = (step(&figure.x), step(&figure.y));
    let plot = Plot {
        x: Axis::linear(
            (figure.x[0] - 0.5 * dx, figure.x[nx - 1] + 0.5 * dx),
            (110.0, 610.0),
        ),
        y: Axis::linear(
            (figure.y[0] - 0.5 * dy, figure.y[ny - 1] + 0.5 * dy),
            (560.0, 70.0),
        ),
    };
    for (row, y) in figure.y.iter().enumerate() {
        for (column, x) in figure.x.iter().enumerate() {
            let z = figure.z[row * nx + column];
            if z.is_finite() {
                // A little more than the cell, so that no seams show between neighbours.
                let left = (plot.x.at(x - 0.5 * dx), plot.y.at(y + 0.5 * dy));
                let right = (plot.x.at(x + 0.5 * dx) + 0.3, plot.y.at(y - 0.5 * dy) + 0.3);
                canvas.rect(left, right, viridis(share(z)), 1.0);
            }
        }
    }
    let finite: Vec<f64> = figure
        .z
        .iter()
        .map(|z| if z.is_finite() { *z } else { least + 4.0 * spread })
        .collect();
    let thresholds: Vec<f64> = (1..LEVELS)
        .map(|i| least + spread * figure.levels.share(i as f64 / LEVELS as f64))
        .collect();
    // The builder counts places from the corner of their cell.
    if let Ok(lines) = ContourBuilder::new(nx, ny, true).lines(&finite, &thresholds) {
        for line in lines.iter().flat_map(|l| &l.geometry().0) {
            let points = line.coords().map(|c| {
                let x = figure.x[0] + (c.x - 0.5) * dx;
                let y = figure.y[0] + (c.y - 0.5) * dy;
                (plot.x.at(x), plot.y.at(y))
            });
            canvas.path(points, WHITE, 0.8);
        }
    }
    plot.draw_axes(
        canvas,
        Labels {
            x: Some(&figure.x_label),
            y: Some(&figure.y_label),
            x_ticks: 6,
            y_ticks: 8,
        },
    );
    if figure.z.iter().any(|z| !z.is_finite()) {
        let look = Type::new(TICK_PX, FAINT_INK, Align::Right);
        canvas.text("white: the car does not drive", (610.0, 58.0), look);
    }
    let places = figure
        .marks
        .iter()
        .map(|(_, at)| (plot.x.at(at[0]), plot.y.at(at[1])));
    // Names read inwards, away from the frame.
    draw_marks(canvas, figure, places.collect(), 520.0);
}

/// Dots with names, those that fall together under one; names right of `inwards_px` stand on the left.
fn draw_marks(canvas: &mut Canvas<'_>, figure: &Surface, places: Vec<(f64, f64)>, inwards_px: f64) {
    let mut told: Vec<((f64, f64), String)> = Vec::new();
    for ((name, _), at) in figure.marks.iter().zip(places) {
        let together = told
            .iter_mut()
            .find(|(there, _)| !name.is_empty() && (there.0 - at.0).hypot(there.1 - at.1) < 2.0 * MARK_PX);
        match together {
            Some((_, names)) => *names = format!("{names}, {name}"),
            None => told.push((at, name.clone())),
        }
    }
    for (at, names) in told {
        canvas.dot(at, MARK_PX, WHITE, 1.0);
        canvas.dot(at, MARK_PX - 1.4, VERMILLION, 1.0);
        if names.is_empty() {
            continue;
        }
        let left = at.0 > inwards_px;
        let look = Type::new(TICK_PX, WHITE, Align::Left).bold();
        let wide = look.width(&names);
        let from = if left { at.0 - 9.0 - wide } else { at.0 + 9.0 };
        // White on a dark ground reads on every colour below.
        canvas.rect(
            (from - 3.0, at.1 - 8.0),
            (from + wide + 3.0, at.1 + 8.0),
            INK,
            0.6,
        );
        canvas.text(&names, (from, at.1), look);
    }
}

/// The surface seen from the front right and above, drawn from the back to the front.
fn draw_in_space(canvas: &mut Canvas<'_>, figure: &Surface, share: &dyn Fn(f64) -> f64) {
    let (nx, ny) = (figure.x.len(), figure.y.len());
    let (turn, tilt) = (0.62f64, 0.52f64);
    let project = |u: f64, v: f64, w: f64| -> (f64, f64) {
        let (a, b) = (u - 0.5, v - 0.5);
        let across = a * turn.cos() - b * turn.sin();
        let away = a * turn.sin() + b * turn.cos();
        let up = w * tilt.cos() + away * tilt.sin();
        (985.0 + 390.0 * across, 450.0 - 330.0 * up)
    };
    let floor = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
    canvas.path(floor.map(|(u, v)| project(u, v, 0.0)), FAINT_INK, 0.8);
    let place = |column: usize, row: usize| -> Option<(f64, f64)> {
        let z = figure.z[row * nx + column];
        let (u, v) = (column as f64 / (nx - 1) as f64, row as f64 / (ny - 1) as f64);
        z.is_finite().then(|| project(u, v, 0.75 * share(z)))
    };
    for row in (0..ny - 1).rev() {
        for column in (0..nx - 1).rev() {
            let corners = [
                (column, row),
                (column + 1, row),
                (column + 1, row + 1),
                (column, row + 1),
            ];
            let points: Vec<(f64, f64)> = corners.iter().filter_map(|(c, r)| place(*c, *r)).collect();
            if points.len() == 4 {
                let mean = corners
                    .iter()
                    .map(|(c, r)| share(figure.z[r * nx + c]))
                    .sum::<f64>()
                    / 4.0;
                canvas.polygon(points.iter().copied(), viridis(mean), 1.0);
                canvas.path(points.iter().copied().chain([points[0]]), WHITE, 0.25);
            }
        }
    }
    // Names and ends of the axes stand before the two near edges, where the surface never is.
    let name = |align| Type::new(LABEL_PX, INK, align);
    let end = |align| Type::new(TICK_PX, INK, align);
    let along_x = |u: f64| project(u, -0.08, 0.0);
    let along_y = |v: f64| project(-0.08, v, 0.0);
    let down = |at: (f64, f64)| (at.0, at.1 + 8.0);
    canvas.text(&figure.x_label, down(along_x(0.5)), name(Align::Left));
    canvas.text(&figure.y_label, down(along_y(0.5)), name(Align::Right));
    for (share, at) in [(0.04, 0), (1.0, nx - 1)] {
        canvas.text(&significant(figure.x[at], 3), along_x(share), end(Align::Left));
    }
    for (share, at) in [(0.04, 0), (1.0, ny - 1)] {
        canvas.text(&significant(figure.y[at], 3), along_y(share), end(Align::Right));
    }
    // The value of a mark is that of the cell it lies in.
    let nearest = |values: &[f64], x: f64| {
        let step = (values[values.len() - 1] - values[0]) / (values.len() - 1) as f64;
        (((x - values[0]) / step).round().max(0.0) as usize).min(values.len() - 1)
    };
    let places = figure.marks.iter().map(|(_, at)| {
        let (column, row) = (nearest(&figure.x, at[0]), nearest(&figure.y, at[1]));
        let (u, v) = (column as f64 / (nx - 1) as f64, row as f64 / (ny - 1) as f64);
        place(column, row).unwrap_or_else(|| project(u, v, 0.0))
    });
    draw_marks(canvas, figure, places.collect(), SIZE.0 - 160.0);
}

fn draw_scale(canvas: &mut Canvas<'_>, figure: &Surface, (least, spread): (f64, f64)) {
    let (left, right, y) = (760.0, 1220.0, 600.0);
    // As many figures as tell the labels apart, where a cost is far from zero.
    let far = (least.abs().max((least + spread).abs()) / spread).log10();
    let figures = 3 + far.clamp(0.0, 9.0) as usize;
    for i in 0..92 {
        let at = left + (right - left) * f64::from(i) / 92.0;
        canvas.rect((at, y), (at + 5.3, y + 12.0), viridis(f64::from(i) / 91.0), 1.0);
    }
    for i in 0..=4 {
        let part = f64::from(i) / 4.0;
        let text = significant(least + spread * figure.levels.share(part), figures);
        canvas.text(
            &text,
            (left + part * (right - left), y + 24.0),
            Type::new(TICK_PX, INK, Align::Centre),
        );
    }
    let look = Type::new(LABEL_PX, INK, Align::Left);
    canvas.text(&figure.z_label, (left, y - 12.0), look);
}
