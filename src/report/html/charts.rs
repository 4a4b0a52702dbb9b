//! Charts of the page beside the lap view.

use super::escape::{Numbers, raised};
use super::lap::LapData;
use super::thin::{POINTS, picked, thinned};
use crate::report::{BarPanel, BarSeries, CurvePanel, Objective, ParameterRow, SurfaceFigure};
use crate::{Error, Result};
use serde::Serialize;
use std::path::Path;

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

/// Candidates by their objectives: a scatter whose axes can be chosen and, from three objectives on, parallel coordinates.
#[derive(Clone, Debug, Default)]
pub struct Front<'a> {
    /// What is shown.
    pub title: &'a str,
    /// What a reader should know of it; may be empty.
    pub note: &'a str,
    /// The objectives.
    pub objectives: Vec<Objective<'a>>,
    /// One row per candidate with one value per objective.
    pub points: &'a [Vec<f64>],
    /// Candidates to mark, with their names.
    pub marked: Vec<(usize, &'a str)>,
}

/// Values along each side of a surface that go into a page at most.
const GRID: usize = 100;

#[derive(Serialize)]
pub(super) struct CurveData {
    label: String,
    x: Numbers,
    y: Numbers,
    shade: Option<f64>,
}

#[derive(Serialize)]
pub(super) struct ParameterData {
    name: String,
    unit: String,
    lower: f64,
    upper: f64,
    swarm: f64,
    fitted: f64,
    error: Option<f64>,
    truth: Option<f64>,
    told: bool,
}

#[derive(Serialize)]
pub(super) struct BarData {
    name: String,
    values: Numbers,
    interval: Option<[Numbers; 2]>,
}

/// As the page's script reads it.
#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(super) enum Chart {
    Lap(LapData),
    Curves {
        x_label: String,
        y_label: String,
        x_scale: Scale,
        y_scale: Scale,
        curves: Vec<CurveData>,
    },
    Front {
        objectives: Vec<(String, String)>,
        points: Vec<Numbers>,
        marked: Vec<(usize, String)>,
    },
    Parameters {
        rows: Vec<ParameterData>,
    },
    Surface {
        x_label: String,
        y_label: String,
        value_label: String,
        x: Numbers,
        y: Numbers,
        values: Vec<Numbers>,
        marked: Vec<(f64, f64, String)>,
    },
    Bars {
        value_label: String,
        categories: Vec<String>,
        series: Vec<BarData>,
    },
}

fn refused<T>(title: &str, found: &str, expected: &str) -> Result<T> {
    Err(Error::input(Path::new("report.html"), title, found, expected))
}

impl Chart {
    pub fn curves(panel: &CurvePanel<'_>, [x_scale, y_scale]: [Scale; 2]) -> Result<Self> {
        if panel.curves.iter().any(|c| c.x.len() != c.y.len()) {
            return refused(panel.title, "lengths that differ", "a y for each x");
        }
        let curves = panel.curves.iter().map(|c| {
            // A curve that turns back, as round a friction ellipse, has no buckets along x.
            let rising = c.x.windows(2).all(|w| w[0] <= w[1]);
            let which = if rising {
                thinned(&c.x, &[&c.y], POINTS)
            } else {
                (0..c.x.len()).collect()
            };
            CurveData {
                label: c.label.to_owned(),
                x: Numbers::new(picked(&c.x, &which)),
                y: Numbers::new(picked(&c.y, &which)),
                shade: c.shade,
            }
        });
        Ok(Self::Curves {
            x_label: panel.x_label.to_owned(),
            y_label: panel.y_label.to_owned(),
            x_scale,
            y_scale,
            curves: curves.collect(),
        })
    }

    pub fn front(front: &Front<'_>) -> Result<Self> {
        let m = front.objectives.len();
        let lost = front.marked.iter().any(|(i, _)| *i >= front.points.len());
        if m < 2 || lost || front.points.iter().any(|p| p.len() != m) {
            return refused(
                front.title,
                "points of another kind",
                "two or more objectives, a value each",
            );
        }
        let column = |k: usize| Numbers::new(front.points.iter().map(|p| p[k]));
        let named = |o: &Objective<'_>| (o.name.to_owned(), raised(o.unit));
        Ok(Self::Front {
            objectives: front.objectives.iter().map(named).collect(),
            points: (0..m).map(column).collect(),
            marked: front.marked.iter().map(|(i, n)| (*i, (*n).to_owned())).collect(),
        })
    }

    pub fn parameters(rows: &[ParameterRow<'_>]) -> Self {
        Self::Parameters {
            rows: rows
                .iter()
                .map(|r| ParameterData {
                    name: r.name.to_owned(),
                    unit: raised(r.unit),
                    lower: r.lower,
                    upper: r.upper,
                    swarm: r.swarm,
                    fitted: r.fitted,
                    error: r.standard_error,
                    truth: r.truth,
                    told: r.identifiable,
                })
                .collect(),
        }
    }

    /// Also how many of how many values a side keeps, where that is fewer.
    pub fn surface(figure: &SurfaceFigure<'_>) -> Result<(Self, Option<(usize, usize)>)> {
        let (nx, ny) = (figure.x.len(), figure.y.len());
        if nx < 2 || ny < 2 || nx * ny != figure.z.len() || !figure.z.iter().any(|v| v.is_finite()) {
            return refused(figure.title, "another number of values", "a finite one per pair");
        }
        // The ends stay; what is between them is as even as it can be.
        let kept = |n: usize| -> Vec<usize> {
            let count = n.min(GRID);
            (0..count).map(|i| i * (n - 1) / (count - 1)).collect()
        };
        let (columns, rows) = (kept(nx), kept(ny));
        let thinned = (nx.max(ny) > GRID).then(|| (columns.len().max(rows.len()), nx.max(ny)));
        let row = |j: &usize| Numbers::new(columns.iter().map(|i| figure.z[j * nx + i]));
        let chart = Self::Surface {
            x_label: figure.x_label.to_owned(),
            y_label: figure.y_label.to_owned(),
            value_label: figure.z_label.to_owned(),
            x: Numbers::new(picked(figure.x, &columns)),
            y: Numbers::new(picked(figure.y, &rows)),
            values: rows.iter().map(row).collect(),
            marked: figure
                .marks
                .iter()
                .map(|(n, [x, y])| (*x, *y, (*n).to_owned()))
                .collect(),
        };
        Ok((chart, thinned))
    }

    pub fn bars(panel: &BarPanel<'_>) -> Result<Self> {
        let n = panel.names.len();
        let fits =
            |s: &BarSeries<'_>| s.values.len() == n && matches!(s.intervals.len(), m if m == n || m == 0);
        if n == 0 || !panel.series.iter().all(fits) {
            return refused(panel.title, "another number of values", "one per name");
        }
        let interval = |s: &BarSeries<'_>| {
            let end = |k: usize| Numbers::new(s.intervals.iter().map(|i| i[k]));
            (!s.intervals.is_empty()).then(|| [end(0), end(1)])
        };
        Ok(Self::Bars {
            value_label: panel.x_label.to_owned(),
            categories: panel.names.iter().map(|c| (*c).to_owned()).collect(),
            series: panel
                .series
                .iter()
                .map(|s| BarData {
                    name: s.label.to_owned(),
                    values: Numbers::new(s.values.iter().copied()),
                    interval: interval(s),
                })
                .collect(),
        })
    }
}
