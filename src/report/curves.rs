//! Panels of curves over a common quantity each.

use std::path::Path;

use serde::Serialize;
use serde_json::json;

use super::axis::{Axis, Labels, Plot, draw_legend, extent, legend_rows};
use super::canvas::{Align, Type, draw_to_file};
use super::html::thin::{POINTS, picked, thinned};
use super::html::{Numbers, raised, refused};
use super::style::{INK, LABEL_PX, TICK_PX, series_colour, significant, viridis, with_unit};
use super::{Figure, HtmlReport};
use crate::{Error, Result};

/// Whether an axis goes by equal steps or by equal ratios.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// Equal steps.
    #[default]
    Linear,
    /// Equal ratios, for positive values.
    Log,
}

/// A curve.
#[derive(Debug, Clone, Default)]
struct Curve {
    /// Empty for none.
    label: String,
    /// Gaps where not finite.
    x: Vec<f64>,
    y: Vec<f64>,
    /// Where the curve stands on a scale of colour from 0 to 1, for families of curves.
    shade: Option<f64>,
    /// The band about it, below and above at each `x`.
    band: Option<[Vec<f64>; 2]>,
}

/// Curves over one quantity.
#[derive(Debug, Clone, Default)]
pub struct Panel {
    title: String,
    x_label: String,
    y_label: String,
    scales: [Scale; 2],
    /// The range shown, if not that of the curves.
    y_range: Option<(f64, f64)>,
    curves: Vec<Curve>,
}

impl Panel {
    /// An empty panel.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            ..Self::default()
        }
    }

    /// The horizontal quantity and its unit, which may be empty.
    #[must_use]
    pub fn x(mut self, name: &str, unit: &str) -> Self {
        self.x_label = with_unit(name, unit);
        self
    }

    /// The vertical quantity and its unit, which may be empty.
    #[must_use]
    pub fn y(mut self, name: &str, unit: &str) -> Self {
        self.y_label = with_unit(name, unit);
        self
    }

    /// Scales of the horizontal and the vertical axis.
    #[must_use]
    pub fn scales(mut self, x: Scale, y: Scale) -> Self {
        self.scales = [x, y];
        self
    }

    /// The vertical range of the picture, where curves begin far off what matters.
    #[must_use]
    pub fn shown(mut self, low: f64, high: f64) -> Self {
        self.y_range = Some((low, high));
        self
    }

    /// Adds a curve; the label may be empty.
    #[must_use]
    pub fn curve(mut self, label: impl Into<String>, x: &[f64], y: &[f64]) -> Self {
        self.curves.push(Curve {
            label: label.into(),
            x: x.to_vec(),
            y: y.to_vec(),
            ..Curve::default()
        });
        self
    }

    /// Adds a curve with a band about it, from below to above at each `x`.
    #[must_use]
    pub fn band(self, label: impl Into<String>, x: &[f64], y: &[f64], [below, above]: [&[f64]; 2]) -> Self {
        let mut panel = self.curve(label, x, y);
        if let Some(curve) = panel.curves.last_mut() {
            curve.band = Some([below.to_vec(), above.to_vec()]);
        }
        panel
    }

    /// Adds a curve of a family, at a place from 0 to 1 on the scale of colour.
    #[must_use]
    pub fn shaded(self, shade: f64, label: impl Into<String>, x: &[f64], y: &[f64]) -> Self {
        let mut panel = self.curve(label, x, y);
        if let Some(curve) = panel.curves.last_mut() {
            curve.shade = Some(shade);
        }
        panel
    }

    /// Adds a curve through points.
    #[must_use]
    pub fn points(self, label: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
        self.curve(label, &x, &y)
    }

    /// Adds points that nothing joins.
    #[must_use]
    pub fn dots(self, label: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        // A curve of gaps is dots.
        self.points(label, points.into_iter().flat_map(|p| [p, (p.0, f64::NAN)]))
    }

    /// Whether there is a finite point to draw.
    pub fn has_points(&self) -> bool {
        self.ranges().is_some()
    }

    /// Ranges of both axes; none without a point to draw.
    fn ranges(&self) -> Option<[(f64, f64); 2]> {
        let log = |k: usize| self.scales[k] == Scale::Log;
        let drawable = |k: usize| move |v: &&f64| !log(k) || **v > 0.0;
        let x = extent(self.curves.iter().flat_map(|c| &c.x).filter(drawable(0)))?;
        let heights = |c: &Curve| -> Vec<f64> {
            let band = c.band.iter().flatten().flatten();
            c.y.iter().chain(band).copied().collect()
        };
        let heights: Vec<f64> = self.curves.iter().flat_map(heights).collect();
        let y = extent(heights.iter().filter(drawable(1)))?;
        Some([x, self.y_range.filter(|(low, high)| high > low).unwrap_or(y)])
    }

    fn odd(&self) -> bool {
        let odd = |c: &Curve, given: &[f64]| given.len() != c.x.len();
        let banded = |c: &Curve| c.band.iter().flatten().any(|side| odd(c, side));
        self.curves.iter().any(|c| odd(c, &c.y) || banded(c))
    }
}

/// A figure of panels of curves.
#[derive(Debug, Clone, Default)]
pub struct Curves {
    title: String,
    panels: Vec<Panel>,
}

impl Curves {
    /// Panels under a common title.
    pub fn new(title: impl Into<String>, panels: impl IntoIterator<Item = Panel>) -> Self {
        Self {
            title: title.into(),
            panels: panels.into_iter().collect(),
        }
    }

    /// Whether there is no panel.
    pub fn is_empty(&self) -> bool {
        self.panels.is_empty()
    }
}

const PANEL: (f64, f64) = (590.0, 420.0);
const TOP: f64 = 52.0;
/// How much of what is below it a band hides.
const BAND_OPACITY: f64 = 0.16;
/// Points of a curve that are few enough to be marked.
const FEW: usize = 40;

impl Figure for Curves {
    /// Panels stand two beside each other.
    fn write_svg(&self, path: &Path) -> Result<()> {
        let mut ranges = Vec::new();
        for panel in &self.panels {
            let Some(range) = panel.ranges().filter(|_| !panel.odd()) else {
                let place = format!("panel {}", panel.title);
                let found = "no point to draw, or lengths that differ";
                return Err(Error::input(path, place, found, "curves with points"));
            };
            ranges.push(range);
        }
        if ranges.is_empty() {
            return Err(Error::input(path, "panels", "none", "at least one"));
        }
        let columns = ranges.len().min(2);
        // A single panel takes the width of two.
        let width = if columns == 1 { 2.0 * PANEL.0 } else { PANEL.0 };
        let rows = ranges.len().div_ceil(columns);
        let size = (width * columns as f64 + 20.0, TOP + PANEL.1 * rows as f64);
        draw_to_file(path, size, &self.title, |canvas| {
            for (index, (panel, [x, y])) in self.panels.iter().zip(ranges).enumerate() {
                let left = width * (index % columns) as f64 + 78.0;
                let right = width * (index % columns + 1) as f64;
                let top = TOP + PANEL.1 * (index / columns) as f64 + 34.0;
                let colour = |i: usize, curve: &Curve| curve.shade.map_or_else(|| series_colour(i), viridis);
                let named = panel
                    .curves
                    .iter()
                    .enumerate()
                    .filter(|(_, c)| !c.label.is_empty());
                let legend: Vec<_> = named
                    .map(|(i, c)| (c.label.as_str(), colour(i, c), 2.0))
                    .collect();
                let lines = legend_rows(&legend, right - left + 60.0);
                // A long legend takes its room from the plot, but never most of it.
                let legend_px = (17.0 * lines.len().saturating_sub(1) as f64).min(120.0);
                let bottom = TOP + PANEL.1 * (index / columns + 1) as f64 - 76.0 - legend_px;
                let name = Type::new(LABEL_PX, INK, Align::Left).bold();
                canvas.text(&panel.title, (left, top - 14.0), name);
                let axis = |k: usize, range, margin, pixels| match (panel.scales[k], panel.y_range) {
                    (Scale::Log, _) => Axis::log(range, pixels),
                    (Scale::Linear, Some(_)) if k == 1 => Axis::linear(range, pixels),
                    _ => Axis::padded(range, margin, pixels),
                };
                let plot = Plot {
                    x: axis(0, x, 0.02, (left, right)),
                    y: axis(1, y, 0.06, (bottom, top)),
                };
                plot.draw_axes(
                    canvas,
                    Labels {
                        x: Some(&panel.x_label),
                        y: Some(&panel.y_label),
                        x_ticks: 8,
                        y_ticks: 7,
                    },
                );
                for (i, curve) in panel.curves.iter().enumerate() {
                    let Some([below, above]) = &curve.band else {
                        continue;
                    };
                    let positive = |v: f64| v.is_finite() && (panel.scales[1] == Scale::Linear || v > 0.0);
                    let both = curve.x.iter().zip(below.iter().zip(above));
                    let seen: Vec<(f64, (f64, f64))> = both
                        .map(|(x, (low, high))| (plot.x.at(*x), (*low, *high)))
                        .filter(|(_, (low, high))| positive(*low) && positive(*high))
                        .collect();
                    let lower = seen.iter().map(|(x, (low, _))| (*x, plot.y.at(*low)));
                    let upper = seen.iter().rev().map(|(x, (_, high))| (*x, plot.y.at(*high)));
                    if seen.len() > 1 {
                        canvas.polygon(lower.chain(upper), colour(i, curve), BAND_OPACITY);
                    }
                }
                for (i, curve) in panel.curves.iter().enumerate() {
                    let all = curve.x.iter().copied().zip(curve.y.iter().copied());
                    let positive = |k: usize, v: f64| panel.scales[k] == Scale::Linear || v > 0.0;
                    let inside = |v: f64| panel.y_range.is_none_or(|(low, _)| v >= low);
                    let seen = |&(x, y): &(f64, f64)| {
                        x.is_finite() && y.is_finite() && positive(0, x) && positive(1, y) && inside(y)
                    };
                    let mut points = all.map(|p| if seen(&p) { p } else { (f64::NAN, f64::NAN) });
                    plot.curve(canvas, points.clone(), colour(i, curve), 1.8);
                    let ratios = panel.scales.contains(&Scale::Log);
                    if ratios && curve.x.len() <= FEW {
                        for (x, y) in points.clone().filter(seen) {
                            canvas.dot((plot.x.at(x), plot.y.at(y)), 3.5, colour(i, curve), 1.0);
                        }
                    }
                    // What a search came to is read at its end.
                    if let Some((x, y)) = points.rfind(seen).filter(|_| ratios) {
                        let at = (plot.x.at(x), plot.y.at(y));
                        canvas.dot(at, 3.5, colour(i, curve), 1.0);
                        if panel.curves.len() <= 2 {
                            let look = Type::new(TICK_PX, INK, Align::Right);
                            canvas.text(&significant(y, 3), (at.0 - 2.0, at.1 - 12.0), look);
                        }
                    }
                }
                // Below the axis: the head of a panel is its title's.
                for (row, entries) in lines.into_iter().enumerate() {
                    draw_legend(canvas, entries, right, bottom + 54.0 + 17.0 * row as f64);
                }
            }
        })
    }

    /// Every panel becomes a chart of its own.
    fn place(&self, page: &mut HtmlReport) -> Result<()> {
        for panel in &self.panels {
            if panel.odd() {
                return refused(&panel.title, "lengths that differ", "a y for each x");
            }
            let curves = panel.curves.iter().map(|c| {
                // A curve that turns back, as round a friction ellipse, has no buckets along x.
                let rising = c.x.windows(2).all(|w| w[0] <= w[1]);
                let which = if rising {
                    thinned(&c.x, &[&c.y], POINTS)
                } else {
                    (0..c.x.len()).collect()
                };
                let pick = |values: &[f64]| Numbers::new(picked(values, &which));
                let band = c
                    .band
                    .as_ref()
                    .map(|sides| sides.each_ref().map(|side| pick(side)));
                json!({ "label": c.label, "x": pick(&c.x), "y": pick(&c.y), "shade": c.shade, "band": band })
            });
            let chart = json!({
                "kind": "curves",
                "x_label": raised(&panel.x_label),
                "y_label": raised(&panel.y_label),
                "x_scale": panel.scales[0],
                "y_scale": panel.scales[1],
                "y_range": panel.y_range,
                "curves": curves.collect::<Vec<_>>(),
            });
            page.chart(&panel.title, "", chart);
        }
        Ok(())
    }
}
