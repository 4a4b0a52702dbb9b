//! Traces over a lap and the map that they are linked with.

use super::escape::{Numbers, raised};
use super::thin::{POINTS, picked, thinned};
use crate::report::ShadedSection;
use crate::{Error, Result};
use glam::DVec2;
use serde::Serialize;
use std::path::Path;

/// A quantity along the lap: one row of [`LapView`].
#[derive(Clone, Copy, Debug)]
pub struct LapPanel<'a> {
    /// The quantity, as in `speed`.
    pub label: &'a str,
    /// Its unit, as in `m/s`; empty for none.
    pub unit: &'a str,
    /// Height as a share of a full panel's. A panel lower than 1 belongs to the one above it, as errors do.
    pub height: f64,
}

/// A trace of one quantity.
#[derive(Clone, Debug, Default)]
pub struct LapTrace<'a> {
    /// Which of the panels it stands in.
    pub panel: usize,
    /// One value per `x` of its line; gaps where not finite.
    pub values: Vec<f64>,
    /// Lower and upper end of a band about it, one value each per `x`.
    pub band: Option<[&'a [f64]; 2]>,
}

/// What was driven or simulated: a line of the map and its traces.
#[derive(Clone, Debug, Default)]
pub struct LapLine<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// Values of the common horizontal axis, rising.
    pub x: Vec<f64>,
    /// The traces that it has.
    pub traces: Vec<LapTrace<'a>>,
    /// Where it lies (m), one point per `x`; empty if it is not on the map.
    pub place_m: Vec<DVec2>,
    /// Drawn wide and pale, to stand behind what is compared with it.
    pub wide: bool,
}

/// The road under the lines.
#[derive(Clone, Debug, Default)]
pub struct LapMap<'a> {
    /// Left edge of the road (m); may be empty.
    pub left_edge_m: &'a [DVec2],
    /// Right edge of the road (m); may be empty.
    pub right_edge_m: &'a [DVec2],
    /// Whether the ends of the edges join.
    pub closed: bool,
    /// Names and the places they belong to (m).
    pub names: Vec<(&'a str, DVec2)>,
}

/// Traces of one or several lines over a common distance, beside a map: moving along the traces moves a dot on the map,
/// and the other way round. The first line's first trace colours the map until the reader asks for another.
#[derive(Clone, Debug, Default)]
pub struct LapView<'a> {
    /// What is shown.
    pub title: &'a str,
    /// What a reader should know of it; may be empty.
    pub note: &'a str,
    /// The common quantity, as in `distance`.
    pub x_label: &'a str,
    /// Its unit.
    pub x_unit: &'a str,
    /// The rows, from the top.
    pub panels: Vec<LapPanel<'a>>,
    /// The lines.
    pub lines: Vec<LapLine<'a>>,
    /// Stretches to shade and name.
    pub sections: Vec<ShadedSection<'a>>,
    /// The map; none without places.
    pub map: Option<LapMap<'a>>,
}

#[derive(Serialize)]
pub(super) struct Panel {
    label: String,
    unit: String,
    height: f64,
}

#[derive(Serialize)]
struct Trace {
    panel: usize,
    values: Numbers,
    #[serde(skip_serializing_if = "Option::is_none")]
    band: Option<[Numbers; 2]>,
}

#[derive(Serialize)]
struct Line {
    name: String,
    x: Numbers,
    traces: Vec<Trace>,
    place: Option<[Numbers; 2]>,
    wide: bool,
}

#[derive(Serialize)]
struct Section {
    name: String,
    start: f64,
    end: f64,
}

#[derive(Serialize)]
struct Map {
    left: [Numbers; 2],
    right: [Numbers; 2],
    closed: bool,
    names: Vec<(String, f64, f64)>,
}

/// As the page's script reads it.
#[derive(Serialize)]
pub(super) struct LapData {
    x_label: String,
    x_unit: String,
    panels: Vec<Panel>,
    lines: Vec<Line>,
    sections: Vec<Section>,
    map: Option<Map>,
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

impl LapView<'_> {
    /// Checks lengths and thins what is drawn; also how many points of how many the longest line keeps.
    pub(super) fn data(&self) -> Result<(LapData, Option<(usize, usize)>)> {
        let mut thinnest = None;
        let lines = self
            .lines
            .iter()
            .map(|line| {
                let n = line.x.len();
                let bands = || line.traces.iter().filter_map(|t| t.band).flatten();
                let fits = line
                    .traces
                    .iter()
                    .all(|t| t.values.len() == n && t.panel < self.panels.len())
                    && bands().all(|b| b.len() == n)
                    && (line.place_m.is_empty() || line.place_m.len() == n);
                if n == 0 || !fits {
                    let place = format!("{}, line {}", self.title, line.name);
                    let found = "no point, lengths that differ, or no such panel";
                    return Err(Error::input(
                        Path::new("report.html"),
                        place,
                        found,
                        "values for each x",
                    ));
                }
                let series: Vec<&[f64]> = line.traces.iter().map(|t| t.values.as_slice()).collect();
                let which = thinned(&line.x, &series, POINTS);
                if which.len() < n && thinnest.is_none_or(|(_, most)| n > most) {
                    thinnest = Some((which.len(), n));
                }
                let pick = |values: &[f64]| Numbers::new(picked(values, &which));
                let traces = line.traces.iter().map(|t| Trace {
                    panel: t.panel,
                    values: pick(&t.values),
                    band: t.band.map(|b| b.map(pick)),
                });
                Ok(Line {
                    name: line.name.to_owned(),
                    x: pick(&line.x),
                    traces: traces.collect(),
                    place: (!line.place_m.is_empty()).then(|| places(&picked(&line.place_m, &which))),
                    wide: line.wide,
                })
            })
            .collect::<Result<Vec<Line>>>()?;
        let data = LapData {
            x_label: self.x_label.to_owned(),
            x_unit: raised(self.x_unit),
            panels: self
                .panels
                .iter()
                .map(|p| Panel {
                    label: p.label.to_owned(),
                    unit: raised(p.unit),
                    height: p.height,
                })
                .collect(),
            lines,
            sections: self
                .sections
                .iter()
                .map(|s| Section {
                    name: s.name.to_owned(),
                    start: s.start,
                    end: s.end,
                })
                .collect(),
            map: self.map.as_ref().map(|map| Map {
                left: edge(map.left_edge_m),
                right: edge(map.right_edge_m),
                closed: map.closed,
                names: map
                    .names
                    .iter()
                    .map(|(n, p)| ((*n).to_owned(), p.x, p.y))
                    .collect(),
            }),
        };
        Ok((data, thinnest))
    }
}
