//! Horizontal bars, several to a name, with intervals; or strips of single values about their median.

use super::axis::{Axis, Labels, Plot, draw_legend, extent};
use super::canvas::{Align, Type, draw_to_file};
use super::curves::Scale;
use super::html::{Numbers, raised};
use super::style::{INK, LABEL_PX, TICK_PX, series_colour};
use super::{Figure, HtmlReport};
use crate::{Error, Result};
use serde_json::json;
use std::path::Path;

/// The bars of one kind, one for each name.
#[derive(Clone, Debug)]
struct Series {
    label: String,
    values: Vec<f64>,
    /// What each may be instead, lower and upper; empty for none.
    intervals: Vec<[f64; 2]>,
    /// The single values behind each, drawn instead of bars; empty for none.
    singles: Vec<Vec<f64>>,
}

impl Series {
    /// All that is drawn of it. Bars begin at zero.
    fn ends(&self) -> impl Iterator<Item = f64> {
        let zero = self.singles.is_empty().then_some(0.0);
        let singles = self.singles.iter().flatten();
        let drawn = self
            .values
            .iter()
            .chain(self.intervals.iter().flatten())
            .chain(singles);
        zero.into_iter().chain(drawn.copied())
    }
}

/// Bars of one quantity, names from the top.
#[derive(Clone, Debug)]
pub struct BarPanel {
    title: String,
    x_label: String,
    names: Vec<String>,
    series: Vec<Series>,
}

impl BarPanel {
    /// A panel of the quantity, with its unit, of things of these names.
    pub fn new<S: Into<String>>(
        title: impl Into<String>,
        x_label: impl Into<String>,
        names: impl IntoIterator<Item = S>,
    ) -> Self {
        Self {
            title: title.into(),
            x_label: x_label.into(),
            names: names.into_iter().map(Into::into).collect(),
            series: Vec::new(),
        }
    }

    /// Adds bars, one for each name; the label may be empty.
    #[must_use]
    pub fn bars(self, label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        self.with_intervals(label, values, [])
    }

    /// Adds bars with intervals, one for each name.
    #[must_use]
    pub fn with_intervals(
        mut self,
        label: &str,
        values: impl IntoIterator<Item = f64>,
        intervals: impl IntoIterator<Item = [f64; 2]>,
    ) -> Self {
        self.series.push(Series {
            label: label.to_owned(),
            values: values.into_iter().collect(),
            intervals: intervals.into_iter().collect(),
            singles: Vec::new(),
        });
        self
    }

    /// Adds strips, one for each name: all single values, and their quartiles and median, on an axis that goes as far as they do.
    #[must_use]
    pub fn strips(mut self, singles: impl IntoIterator<Item = Vec<f64>>, quartiles: &[[f64; 3]]) -> Self {
        let medians = quartiles.iter().map(|q| q[1]);
        self = self.with_intervals("", medians, quartiles.iter().map(|q| [q[0], q[2]]));
        if let Some(series) = self.series.last_mut() {
            series.singles = singles.into_iter().collect();
        }
        self
    }

    /// Whether the axis goes by equal ratios: where single values are all positive and go over more than two powers of ten.
    fn by_ratios(&self) -> bool {
        let strips = self.series.iter().all(|s| !s.singles.is_empty());
        let ends = self.series.iter().flat_map(Series::ends);
        let range = extent(&ends.collect::<Vec<f64>>());
        strips && range.is_some_and(|(low, high)| low > 0.0 && high / low > 100.0)
    }

    /// Whether a bar can be drawn.
    pub fn has_bars(&self) -> bool {
        self.series.iter().flat_map(|s| &s.values).any(|v| v.is_finite())
    }

    fn check(&self, path: &Path) -> Result<()> {
        let n = self.names.len();
        let fits = |given: usize| given == 0 || given == n;
        let sound = |s: &Series| s.values.len() == n && fits(s.intervals.len()) && fits(s.singles.len());
        if n > 0 && self.series.iter().all(sound) {
            return Ok(());
        }
        let expected = "as many bars as names, at least one";
        Err(Error::input(path, &*self.title, "lengths that differ", expected))
    }
}

/// A figure of panels of bars.
#[derive(Clone, Debug)]
pub struct Bars {
    title: String,
    panels: Vec<BarPanel>,
}

impl Bars {
    /// Panels under a common title.
    pub fn new(title: impl Into<String>, panels: impl IntoIterator<Item = BarPanel>) -> Self {
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

const PANEL_WIDTH: f64 = 620.0;
const ROW: f64 = 24.0;
const HEAD: f64 = 84.0;
const FOOT: f64 = 64.0;
const NAMES: f64 = 190.0;

impl Figure for Bars {
    /// Panels stand side by side, two to a row.
    fn write_svg(&self, path: &Path) -> Result<()> {
        let panels = &self.panels;
        panels.iter().try_for_each(|panel| panel.check(path))?;
        if let Some(panel) = panels.iter().find(|p| !p.has_bars()) {
            return Err(Error::input(path, &*panel.title, "no finite bar", "at least one"));
        }
        if panels.is_empty() {
            return Err(Error::input(path, "panels", "none", "at least one"));
        }
        let columns = panels.len().min(2);
        let most = panels.iter().map(|p| p.names.len()).max().unwrap_or(1) as f64;
        let height = HEAD + ROW * most + FOOT;
        let rows = panels.len().div_ceil(columns) as f64;
        let size = (PANEL_WIDTH * columns as f64 + 24.0, height * rows);
        draw_to_file(path, size, &self.title, |canvas| {
            for (index, panel) in panels.iter().enumerate() {
                let left = PANEL_WIDTH * (index % columns) as f64 + NAMES;
                let right = PANEL_WIDTH * (index % columns + 1) as f64 - 8.0;
                let top = height * (index / columns) as f64 + HEAD;
                let bottom = top + ROW * panel.names.len() as f64;
                let ends: Vec<f64> = panel.series.iter().flat_map(Series::ends).collect();
                let range = extent(&ends).unwrap_or((0.0, 1.0));
                let plot = Plot {
                    x: if panel.by_ratios() {
                        Axis::log(range, (left, right))
                    } else {
                        Axis::padded(range, 0.02, (left, right))
                    },
                    y: Axis::linear((0.0, panel.names.len() as f64), (bottom, top)),
                };
                // Names stand where figures would.
                plot.draw_inner(
                    canvas,
                    Labels {
                        x: Some(&panel.x_label),
                        y: None,
                        x_ticks: 7,
                        y_ticks: 1,
                    },
                );
                let look = Type::new(LABEL_PX, INK, Align::Left).bold();
                canvas.text(&panel.title, (left, top - 34.0), look);
                let zero = plot.x.at(0.0);
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
                        let singles = series.singles.get(row).map_or(&[][..], |all| all);
                        if singles.is_empty() {
                            canvas.rect(
                                (zero.min(end), upper),
                                (zero.max(end), upper + thick - 1.0),
                                series_colour(i),
                                0.85,
                            );
                        } else {
                            canvas.line((end, upper), (end, upper + thick - 1.0), INK, 2.0);
                        }
                        for single in singles.iter().filter(|v| v.is_finite()) {
                            canvas.dot((plot.x.at(*single), y), 3.5, series_colour(i), 0.55);
                        }
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
                    .map(|(i, s)| (s.label.as_str(), series_colour(i), 6.0))
                    .collect();
                draw_legend(canvas, &legend, right, top - 14.0);
            }
        })
    }

    /// Every panel becomes a chart of its own.
    fn place(&self, page: &mut HtmlReport) -> Result<()> {
        for panel in &self.panels {
            panel.check(Path::new("report.html"))?;
            let series = panel.series.iter().map(|s| {
                let end = |k: usize| Numbers::new(s.intervals.iter().map(|i| i[k]));
                let interval = (!s.intervals.is_empty()).then(|| [end(0), end(1)]);
                let singles: Vec<Numbers> = s
                    .singles
                    .iter()
                    .map(|v| Numbers::new(v.iter().copied()))
                    .collect();
                let values = Numbers::new(s.values.iter().copied());
                json!({ "name": s.label, "values": values, "interval": interval, "singles": singles })
            });
            let chart = json!({
                "kind": "bars",
                "scale": if panel.by_ratios() { Scale::Log } else { Scale::Linear },
                "value_label": raised(&panel.x_label),
                "categories": panel.names,
                "series": series.collect::<Vec<_>>(),
            });
            page.chart(&panel.title, "", chart);
        }
        Ok(())
    }
}
