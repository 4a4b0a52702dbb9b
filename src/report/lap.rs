//! Traces over a lap and the map that they are linked with.

use super::axis::{Axis, Labels, Plot, draw_legend, extent, legend_rows};
use super::canvas::{Align, Canvas, Type, draw_to_file};
use super::html::thin::{POINTS, picked, thinned};
use super::html::{Numbers, raised};
use super::style::{FAINT_INK, GREYED, INK, LABEL_PX, SHADE, TICK_PX, series_colour, with_unit};
use super::{Figure, HtmlReport, Road, TrackMap};
use crate::{Error, Result};
use glam::DVec2;
use plotters::style::RGBColor;
use serde_json::{Value, json};
use std::path::Path;

/// A quantity along the lap.
#[derive(Clone, Debug)]
struct Panel {
    label: String,
    unit: String,
    /// Height as a share of a full panel's. A panel lower than 1 belongs to the one above it, as errors do.
    height: f64,
    /// What the picture says beside the panel's name.
    note: String,
}

#[derive(Clone, Debug)]
struct Trace {
    panel: usize,
    values: Vec<f64>,
    band: Option<[Vec<f64>; 2]>,
}

/// What was driven or simulated: a line of the map and its traces.
#[derive(Clone, Debug, Default)]
pub struct LapLine {
    name: String,
    x: Vec<f64>,
    traces: Vec<Trace>,
    place_m: Vec<DVec2>,
    wide: bool,
}

impl LapLine {
    /// A line without traces over values of the common horizontal axis, which rise.
    pub fn new(name: impl Into<String>, x: impl Into<Vec<f64>>) -> Self {
        Self {
            name: name.into(),
            x: x.into(),
            ..Self::default()
        }
    }

    /// Adds a trace to a panel, by the panel's number from 0: one value per `x`, gaps where not finite.
    #[must_use]
    pub fn trace(mut self, panel: usize, values: impl Into<Vec<f64>>) -> Self {
        self.traces.push(Trace {
            panel,
            values: values.into(),
            band: None,
        });
        self
    }

    /// Adds a trace if there is one.
    #[must_use]
    pub fn maybe(self, panel: usize, values: Option<Vec<f64>>) -> Self {
        match values {
            Some(values) => self.trace(panel, values),
            None => self,
        }
    }

    /// Draws a band about the last trace, from its lower to its upper end, one value each per `x`.
    #[must_use]
    pub fn band(mut self, lower: &[f64], upper: &[f64]) -> Self {
        if let Some(trace) = self.traces.last_mut() {
            trace.band = Some([lower.to_vec(), upper.to_vec()]);
        }
        self
    }

    /// Places the line on the map (m): one point per `x`, or none.
    #[must_use]
    pub fn at(mut self, place_m: impl Into<Vec<DVec2>>) -> Self {
        self.place_m = place_m.into();
        self
    }

    /// Draws the line wide and pale, to stand behind what is compared with it.
    #[must_use]
    pub fn wide(mut self) -> Self {
        self.wide = true;
        self
    }

    /// Whether it has no trace.
    pub fn is_empty(&self) -> bool {
        self.traces.is_empty()
    }

    fn fits(&self, panels: usize) -> bool {
        let n = self.x.len();
        let fits = |t: &Trace| {
            let banded = t.band.iter().flatten().all(|b| b.len() == n);
            t.values.len() == n && t.panel < panels && banded
        };
        n > 0 && self.traces.iter().all(fits) && (self.place_m.is_empty() || self.place_m.len() == n)
    }
}

/// A stretch of the horizontal axis to shade and name.
#[derive(Clone, Debug)]
struct Section {
    name: String,
    start: f64,
    end: f64,
}

/// Traces of one or several lines over a common distance, beside a map: moving along the traces moves a dot on the map,
/// and the other way round. The first line's first trace colours the map until the reader asks for another.
#[derive(Clone, Debug, Default)]
pub struct LapView {
    title: String,
    note: String,
    x_label: String,
    x_unit: String,
    panels: Vec<Panel>,
    lines: Vec<LapLine>,
    sections: Vec<Section>,
    road: Option<Road>,
}

impl LapView {
    /// An empty view over a distance in metres.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            x_label: "distance".to_owned(),
            x_unit: "m".to_owned(),
            ..Self::default()
        }
    }

    /// What a reader should know of it.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// The common quantity and its unit, if it is not the distance in metres.
    #[must_use]
    pub fn x(mut self, label: &str, unit: &str) -> Self {
        (self.x_label, self.x_unit) = (label.to_owned(), unit.to_owned());
        self
    }

    /// Adds a panel below the others; the unit may be empty.
    #[must_use]
    pub fn panel(self, label: &str, unit: &str) -> Self {
        self.sized(label, unit, 1.0)
    }

    /// Adds panels below the others, by their labels and units.
    #[must_use]
    pub fn panels<'p>(self, panels: impl IntoIterator<Item = (&'p str, &'p str)>) -> Self {
        panels
            .into_iter()
            .fold(self, |view, (label, unit)| view.panel(label, unit))
    }

    /// Adds a panel of half the height that belongs to the one above it, as errors do.
    #[must_use]
    pub fn low_panel(self, label: &str, unit: &str) -> Self {
        self.sized(label, unit, 0.5)
    }

    fn sized(mut self, label: &str, unit: &str, height: f64) -> Self {
        self.panels.push(Panel {
            label: label.to_owned(),
            unit: unit.to_owned(),
            height,
            note: String::new(),
        });
        self
    }

    /// Writes a note beside the name of the last panel of the picture.
    #[must_use]
    pub fn panel_note(mut self, note: impl Into<String>) -> Self {
        if let Some(panel) = self.panels.last_mut() {
            panel.note = note.into();
        }
        self
    }

    /// Adds a line.
    #[must_use]
    pub fn line(mut self, line: LapLine) -> Self {
        self.lines.push(line);
        self
    }

    /// Adds lines.
    #[must_use]
    pub fn lines(mut self, lines: impl IntoIterator<Item = LapLine>) -> Self {
        self.lines.extend(lines);
        self
    }

    /// Shades and names stretches, by their names, starts and ends in the unit of `x`.
    #[must_use]
    pub fn sections(mut self, sections: impl IntoIterator<Item = (String, f64, f64)>) -> Self {
        let named = sections
            .into_iter()
            .map(|(name, start, end)| Section { name, start, end });
        self.sections.extend(named);
        self
    }

    /// The road under the lines.
    #[must_use]
    pub fn road(mut self, road: impl Into<Option<Road>>) -> Self {
        self.road = road.into();
        self
    }

    /// The circuit under the lines, with its sections, where there is one.
    #[cfg(feature = "vehicle")]
    #[must_use]
    pub fn circuit(self, circuit: Option<&crate::track::Circuit>) -> Self {
        let sections = circuit.iter().flat_map(|c| &c.sections);
        let sections = sections.map(|s| (s.name.clone(), s.start_m, s.end_m));
        self.sections(sections).road(circuit.map(Road::of))
    }

    /// The map alone, coloured by the first line's first trace; nothing without a line on a road.
    pub fn track_map(&self, title: impl Into<String>) -> Option<TrackMap> {
        let line = self.lines.first().filter(|line| !line.place_m.is_empty())?;
        let trace = line.traces.first()?;
        let panel = self.panels.get(trace.panel)?;
        Some(TrackMap {
            title: title.into(),
            road: self.road.clone()?,
            line_m: line.place_m.clone(),
            values: trace.values.clone(),
            value_label: panel.label.clone(),
            value_unit: panel.unit.clone(),
        })
    }

    fn check(&self, path: &Path) -> Result<()> {
        match self.lines.iter().find(|line| !line.fits(self.panels.len())) {
            None => Ok(()),
            Some(line) => {
                let place = format!("{}, line {}", self.title, line.name);
                let found = "no point, lengths that differ, or no such panel";
                Err(Error::input(path, place, found, "values for each x"))
            }
        }
    }

    fn colour(&self, line: usize) -> RGBColor {
        if self.lines[line].wide {
            GREYED
        } else {
            series_colour(line)
        }
    }

    /// The part of a section that lies on the axis (px), if any does.
    fn shaded(&self, x: Axis, range: (f64, f64)) -> impl Iterator<Item = (&str, f64, f64)> {
        self.sections.iter().filter_map(move |section| {
            let (start, end) = (section.start.max(range.0), section.end.min(range.1));
            (start < end).then(|| (section.name.as_str(), x.at(start), x.at(end)))
        })
    }

    fn name_sections(&self, canvas: &mut Canvas<'_>, x: Axis, range: (f64, f64), head: f64) {
        let look = Type::new(TICK_PX, FAINT_INK, Align::Centre);
        let mut taken = f64::NEG_INFINITY;
        for (name, left, right) in self.shaded(x, range) {
            let half = 0.5 * look.width(name);
            let middle = (0.5 * (left + right)).clamp(LEFT + half, (RIGHT - half).max(LEFT + half));
            // Neighbours whose names would touch are named on two levels.
            let low = middle - half > taken + 6.0;
            canvas.text(name, (middle, if low { head - 8.0 } else { head - 21.0 }), look);
            if low {
                taken = middle + half;
            }
        }
    }

    fn draw_panel(&self, canvas: &mut Canvas<'_>, number: usize, x: Axis, range: (f64, f64), y: (f64, f64)) {
        let (panel, (top, bottom)) = (&self.panels[number], y);
        for (_, left, right) in self.shaded(x, range) {
            canvas.rect((left, top), (right, bottom), SHADE, 1.0);
        }
        let size = if panel.height < 1.0 { TICK_PX } else { LABEL_PX };
        let name = Type::new(size, INK, Align::Left).bold();
        canvas.text(&with_unit(&panel.label, &panel.unit), (LEFT, top - 10.0), name);
        let note = Type::new(LABEL_PX - 1.0, INK, Align::Right);
        canvas.text(&panel.note, (RIGHT, top - 10.0), note);
        let own = || {
            let all = self.lines.iter().enumerate();
            all.flat_map(|(i, line)| line.traces.iter().map(move |t| (i, line, t)))
                .filter(|(.., t)| t.panel == number)
        };
        let values = || {
            own().flat_map(|(.., t)| {
                std::iter::once(&t.values)
                    .chain(t.band.iter().flatten())
                    .flatten()
            })
        };
        let spread = extent(values()).unwrap_or((0.0, 0.0));
        let axis = if panel.height < 1.0 {
            Axis::around_zero(spread.0.abs().max(spread.1.abs()), (bottom, top))
        } else {
            Axis::padded(spread, 0.06, (bottom, top))
        };
        let plot = Plot { x, y: axis };
        let across = with_unit(&self.x_label, &self.x_unit);
        plot.draw_axes(
            canvas,
            Labels {
                x: (number + 1 == self.panels.len()).then_some(&across),
                y: None,
                x_ticks: 12,
                y_ticks: if panel.height < 1.0 { 3 } else { 5 },
            },
        );
        for (i, line, trace) in own() {
            let mut draw = |values: &[f64], width_px| {
                let points = line.x.iter().copied().zip(values.iter().copied());
                plot.curve(canvas, points, self.colour(i), width_px);
            };
            for end in trace.band.iter().flatten() {
                draw(end, 0.6);
            }
            draw(&trace.values, if line.wide { 3.0 } else { 1.3 });
        }
    }

    /// Checks lengths and thins what is drawn; also how many points of how many the longest line keeps.
    fn data(&self) -> Result<(Value, Option<(usize, usize)>)> {
        self.check(Path::new("report.html"))?;
        let mut thinnest = None;
        let lines: Vec<Value> = self
            .lines
            .iter()
            .map(|line| {
                let n = line.x.len();
                let series: Vec<&[f64]> = line.traces.iter().map(|t| t.values.as_slice()).collect();
                let which = thinned(&line.x, &series, POINTS);
                if which.len() < n && thinnest.is_none_or(|(_, most)| n > most) {
                    thinnest = Some((which.len(), n));
                }
                let pick = |values: &[f64]| Numbers::new(picked(values, &which));
                let trace = |t: &Trace| {
                    let mut trace = json!({ "panel": t.panel, "values": pick(&t.values) });
                    if let Some([low, high]) = &t.band {
                        trace["band"] = json!([pick(low), pick(high)]);
                    }
                    trace
                };
                json!({
                    "name": line.name,
                    "x": pick(&line.x),
                    "traces": line.traces.iter().map(trace).collect::<Vec<_>>(),
                    "place": (!line.place_m.is_empty()).then(|| places(&picked(&line.place_m, &which))),
                    "wide": line.wide,
                })
            })
            .collect();
        let panel = |p: &Panel| json!({ "label": p.label, "unit": raised(&p.unit), "height": p.height });
        let section = |s: &Section| json!({ "name": s.name, "start": s.start, "end": s.end });
        let map = self.road.as_ref().map(|road| {
            let names = road.names.iter().map(|(name, at)| (name, at.x, at.y));
            json!({
                "left": edge(&road.left_edge_m),
                "right": edge(&road.right_edge_m),
                "closed": road.closed,
                "names": names.collect::<Vec<_>>(),
            })
        });
        let data = json!({
            "kind": "lap",
            "x_label": self.x_label,
            "x_unit": raised(&self.x_unit),
            "panels": self.panels.iter().map(panel).collect::<Vec<_>>(),
            "lines": lines,
            "sections": self.sections.iter().map(section).collect::<Vec<_>>(),
            "map": map,
        });
        Ok((data, thinnest))
    }
}

const WIDTH: f64 = 1200.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 1180.0;
/// Height of a full panel, and room above one for its name.
const PANEL_PX: f64 = 112.0;
const NAME_PX: f64 = 26.0;

impl Figure for LapView {
    /// The traces, panel below panel. The map is a picture of its own: see [`LapView::track_map`].
    fn write_svg(&self, path: &Path) -> Result<()> {
        self.check(path)?;
        let range = extent(self.lines.iter().flat_map(|line| &line.x));
        let Some(range) = range.filter(|(low, high)| high > low && !self.panels.is_empty()) else {
            let expected = "a panel, and two different finite places";
            return Err(Error::input(path, "horizontal axis", "nothing to draw", expected));
        };
        let legend: Vec<_> = self
            .lines
            .iter()
            .enumerate()
            .map(|(i, line)| {
                let width_px = if line.wide { 4.0 } else { 2.0 };
                (line.name.as_str(), self.colour(i), width_px)
            })
            .collect();
        let legend = legend_rows(&legend, RIGHT - LEFT);
        let names = if self.sections.is_empty() { 4.0 } else { 32.0 };
        let head = 50.0 + 17.0 * legend.len() as f64 + names;
        let mut tops = Vec::new();
        let mut bottom = head;
        for panel in &self.panels {
            tops.push(bottom + NAME_PX);
            bottom += NAME_PX + PANEL_PX * panel.height;
        }
        draw_to_file(path, (WIDTH, bottom + 48.0), &self.title, |canvas| {
            for (row, entries) in legend.into_iter().enumerate() {
                draw_legend(canvas, entries, RIGHT, 54.0 + 17.0 * row as f64);
            }
            let x = Axis::linear(range, (LEFT, RIGHT));
            self.name_sections(canvas, x, range, head);
            for (number, top) in tops.into_iter().enumerate() {
                let bottom = top + PANEL_PX * self.panels[number].height;
                self.draw_panel(canvas, number, x, range, (top, bottom));
            }
        })
    }

    fn place(&self, page: &mut HtmlReport) -> Result<()> {
        let (data, thinned) = self.data()?;
        let mut note = self.note.clone();
        if let Some((kept, of)) = thinned {
            note += &format!(" {kept} of up to {of} samples are drawn, chosen so that peaks stay.");
        }
        page.chart(&self.title, note.trim(), data);
        Ok(())
    }
}

/// Points of an edge that go into a page at most.
const EDGE_POINTS: usize = 3000;

fn places(points: &[DVec2]) -> [Numbers; 2] {
    [
        Numbers::new(points.iter().map(|p| p.x)),
        Numbers::new(points.iter().map(|p| p.y)),
    ]
}

fn edge(points: &[DVec2]) -> [Numbers; 2] {
    let every = points.len().div_ceil(EDGE_POINTS).max(1);
    let thin: Vec<DVec2> = points.iter().copied().step_by(every).collect();
    places(&thin)
}
