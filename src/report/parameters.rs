//! Identified parameters against their bounds.

use std::path::Path;

use super::axis::Axis;
use super::canvas::{Align, Canvas, Type, draw_to_file};
use super::html::raised;
use super::style::{BLUE, FAINT_INK, GREYED, GRID, INK, SHADE, TICK_PX, VERMILLION, significant, trimmed};
use super::{Figure, HtmlReport};
use crate::{Error, Result};
use serde_json::json;

/// One parameter of the table.
#[derive(Debug, Clone)]
pub struct ParameterRow {
    /// Its name, as in `rBx1`.
    pub name: String,
    /// Its unit; empty for none.
    pub unit: String,
    /// Lower bound of the search.
    pub lower: f64,
    /// Upper bound of the search.
    pub upper: f64,
    /// Value the swarm reached.
    pub swarm: f64,
    /// Value after the final fit.
    pub fitted: f64,
    /// Standard error of the fitted value, where it could be told.
    pub standard_error: Option<f64>,
    /// The true value, where it is known.
    pub truth: Option<f64>,
    /// Whether the data determine it at all.
    pub identifiable: bool,
}

const WIDTH: f64 = 1200.0;
const ROW: f64 = 22.0;
const HEAD: f64 = 92.0;
const NAME_X: f64 = 28.0;
const TRACK_END: f64 = 720.0;
const UPPER_X: f64 = 735.0;
const SWARM_X: f64 = 900.0;
const FITTED_X: f64 = 985.0;
const TRUTH_X: f64 = 1172.0;

/// The columns whose places follow from the lengths of the names and units.
struct Layout {
    unit_x: f64,
    lower_x: f64,
    track: (f64, f64),
}

impl Layout {
    fn new(rows: &[ParameterRow]) -> Self {
        let look = Type::new(TICK_PX + 0.5, INK, Align::Left);
        let widest = |look: Type, text: &dyn Fn(&ParameterRow) -> f64| {
            rows.iter().map(text).fold(look.width("parameter"), f64::max)
        };
        let names = widest(look.bold(), &|r| look.bold().width(&r.name) + 20.0);
        let units = widest(look, &|r| look.width(&r.unit));
        let unit_x = (NAME_X + names + 20.0).min(340.0);
        let lower_x = (unit_x + units + 80.0).min(500.0);
        Self {
            unit_x,
            lower_x,
            track: (lower_x + 15.0, TRACK_END),
        }
    }

    /// The pixel of a value, held to just outside the bounds so that an escaped one is seen as such.
    fn place(&self, track: &Axis, value: f64) -> Option<f64> {
        let x = track.at(value);
        (!x.is_nan()).then(|| x.clamp(self.track.0 - 8.0, self.track.1 + 8.0))
    }
}

/// Parameters within their bounds, with standard errors and the truth where known.
#[derive(Debug, Clone)]
pub struct Parameters {
    /// Title of the figure.
    pub title: String,
    /// What a reader should know of it; may be empty.
    pub note: String,
    /// The parameters, from the top.
    pub rows: Vec<ParameterRow>,
}

impl Figure for Parameters {
    fn write_svg(&self, path: &Path) -> Result<()> {
        let rows = &self.rows;
        if !(1..=200).contains(&rows.len()) {
            return Err(Error::input(path, "rows", rows.len().to_string(), "1 to 200"));
        }
        for row in rows {
            let sound = row.lower.is_finite() && row.upper.is_finite() && row.lower < row.upper;
            if !sound {
                return Err(Error::input(
                    path,
                    format!("parameter {}", row.name),
                    format!("bounds {} to {}", row.lower, row.upper),
                    "a finite lower bound below a finite upper bound",
                ));
            }
        }
        let layout = Layout::new(rows);
        let bottom = HEAD + ROW * rows.len() as f64;
        draw_to_file(path, (WIDTH, bottom + 48.0), &self.title, |canvas| {
            draw_head(canvas, rows, &layout);
            for i in (0..rows.len()).step_by(2) {
                let y = HEAD + ROW * i as f64;
                canvas.rect((16.0, y), (WIDTH - 16.0, y + ROW), SHADE, 0.6);
            }
            for quarter in 0..=4 {
                let x = layout.track.0 + f64::from(quarter) / 4.0 * (layout.track.1 - layout.track.0);
                canvas.line((x, HEAD), (x, bottom), GRID, 0.8);
            }
            for (i, row) in rows.iter().enumerate() {
                let y = HEAD + ROW * (i as f64 + 0.5);
                draw_row(canvas, row, &layout, y);
            }
            draw_key(canvas, rows, &layout, bottom + 24.0);
        })
    }

    fn place(&self, page: &mut HtmlReport) -> Result<()> {
        let row = |r: &ParameterRow| {
            json!({
                "name": r.name,
                "unit": raised(&r.unit),
                "lower": r.lower,
                "upper": r.upper,
                "swarm": r.swarm,
                "fitted": r.fitted,
                "error": r.standard_error,
                "truth": r.truth,
                "told": r.identifiable,
            })
        };
        let rows: Vec<_> = self.rows.iter().map(row).collect();
        page.chart(
            &self.title,
            &self.note,
            json!({ "kind": "parameters", "rows": rows }),
        );
        Ok(())
    }
}

fn draw_head(canvas: &mut Canvas<'_>, rows: &[ParameterRow], layout: &Layout) {
    let head = |align| Type::new(TICK_PX + 1.0, INK, align).bold();
    let y = HEAD - 16.0;
    canvas.text("parameter", (NAME_X, y), head(Align::Left));
    canvas.text("unit", (layout.unit_x, y), head(Align::Left));
    canvas.text("lower", (layout.lower_x, y), head(Align::Right));
    let middle = 0.5 * (layout.track.0 + layout.track.1);
    canvas.text("place between the bounds", (middle, y), head(Align::Centre));
    canvas.text("upper", (UPPER_X, y), head(Align::Left));
    canvas.text("swarm", (SWARM_X, y), head(Align::Right));
    canvas.text("fitted \u{00b1} std. error", (FITTED_X, y), head(Align::Centre));
    if rows.iter().any(|r| r.truth.is_some()) {
        canvas.text("truth", (TRUTH_X, y), head(Align::Right));
    }
    canvas.line((16.0, HEAD - 2.0), (WIDTH - 16.0, HEAD - 2.0), INK, 1.0);
}

fn draw_row(canvas: &mut Canvas<'_>, row: &ParameterRow, layout: &Layout, y: f64) {
    let (ink, quiet) = if row.identifiable {
        (INK, FAINT_INK)
    } else {
        (GREYED, GREYED)
    };
    let cell = |colour, align| Type::new(TICK_PX + 0.5, colour, align);
    let name = if row.identifiable {
        row.name.to_owned()
    } else {
        format!("{} \u{2715}", row.name)
    };
    canvas.text(&name, (NAME_X, y), cell(ink, Align::Left).bold());
    canvas.text(&row.unit, (layout.unit_x, y), cell(quiet, Align::Left));
    let lower = trimmed(row.lower, 4);
    canvas.text(&lower, (layout.lower_x, y), cell(quiet, Align::Right));
    let upper = trimmed(row.upper, 4);
    canvas.text(&upper, (UPPER_X, y), cell(quiet, Align::Left));
    let swarm = significant(row.swarm, 4);
    canvas.text(&swarm, (SWARM_X, y), cell(ink, Align::Right));
    if row.identifiable {
        // The sign in the middle of the column lines up the figures on both sides.
        let error = row.standard_error.filter(|e| e.is_finite() && *e > 0.0);
        let fitted = error.map_or(significant(row.fitted, 4), |e| to_error(row.fitted, e));
        canvas.text(&fitted, (FITTED_X + 4.0, y), cell(ink, Align::Right));
        if let Some(error) = error {
            let text = significant(error, 2);
            canvas.text("\u{00b1}", (FITTED_X + 14.0, y), cell(quiet, Align::Centre));
            canvas.text(&text, (FITTED_X + 24.0, y), cell(quiet, Align::Left));
        }
    } else {
        let at = (FITTED_X + 14.0, y);
        canvas.text("not identifiable", at, cell(GREYED, Align::Centre));
    }
    if let Some(truth) = row.truth {
        let text = trimmed(truth, 5);
        canvas.text(&text, (TRUTH_X, y), cell(quiet, Align::Right));
    }

    let track = Axis::linear((row.lower, row.upper), layout.track);
    canvas.line((layout.track.0, y), (layout.track.1, y), GREYED, 0.8);
    for end in [layout.track.0, layout.track.1] {
        canvas.line((end, y - 4.0), (end, y + 4.0), GREYED, 0.8);
    }
    if let Some(x) = row.truth.and_then(|t| layout.place(&track, t)) {
        canvas.line((x, y - 8.0), (x, y + 8.0), VERMILLION, 1.8);
    }
    if let Some(x) = layout.place(&track, row.swarm) {
        canvas.ring((x, y), 4.0, ink, 1.2);
    }
    if !row.identifiable {
        return;
    }
    let error = row.standard_error.filter(|e| e.is_finite()).unwrap_or(0.0);
    let whisker = (
        layout.place(&track, row.fitted - error),
        layout.place(&track, row.fitted + error),
    );
    if let (Some(a), Some(b)) = whisker
        && error > 0.0
    {
        canvas.line((a, y), (b, y), BLUE, 2.2);
        for end in [a, b] {
            canvas.line((end, y - 4.0), (end, y + 4.0), BLUE, 1.4);
        }
    }
    if let Some(x) = layout.place(&track, row.fitted) {
        canvas.dot((x, y), 3.6, BLUE, 1.0);
    }
}

/// A value with as many decimals as its standard error is shown with.
fn to_error(value: f64, error: f64) -> String {
    let shown = significant(error, 2);
    let tiny_or_huge = |x: f64| x != 0.0 && !(1e-4..1e6).contains(&x.abs());
    if tiny_or_huge(value) || tiny_or_huge(error) {
        return significant(value, 5);
    }
    let decimals = shown.split_once('.').map_or(0, |(_, d)| d.len());
    format!("{value:.decimals$}").replace('-', "\u{2212}")
}

fn draw_key(canvas: &mut Canvas<'_>, rows: &[ParameterRow], layout: &Layout, y: f64) {
    let look = Type::new(TICK_PX, FAINT_INK, Align::Left);
    canvas.ring((layout.track.0 + 4.0, y), 4.0, INK, 1.2);
    canvas.text("swarm", (layout.track.0 + 16.0, y), look);
    let x = layout.track.0 + 84.0;
    canvas.line((x - 10.0, y), (x + 10.0, y), BLUE, 2.2);
    canvas.dot((x, y), 3.6, BLUE, 1.0);
    canvas.text("fitted \u{00b1} std. error", (x + 18.0, y), look);
    let x = layout.track.0 + 254.0;
    if rows.iter().any(|r| r.truth.is_some()) {
        canvas.line((x, y - 8.0), (x, y + 8.0), VERMILLION, 1.8);
        canvas.text("truth", (x + 10.0, y), look);
    }
    if rows.iter().any(|r| !r.identifiable) {
        let text = "\u{2715} the data do not determine this parameter";
        canvas.text(text, (NAME_X, y), look);
    }
}
