//! An archive of compromises between objectives.

mod parallel;

use std::path::Path;

use serde_json::json;

use super::axis::{Axis, Labels, Plot, extent};
use super::canvas::{Align, Canvas, Type, draw_to_file};
use super::html::{Numbers, raised};
use super::style::{BLUE, FRAME, GRID, INK, TICK_PX, VERMILLION, significant, viridis, with_unit};
use super::{Figure, HtmlReport};
use crate::{Error, Result};

/// One objective, to be made small.
#[derive(Debug, Clone)]
struct Objective {
    name: String,
    unit: String,
}

/// Candidates by their objectives: scatters of every two, on a page also parallel coordinates.
#[derive(Clone, Debug, Default)]
pub struct Front {
    title: String,
    objectives: Vec<Objective>,
    points: Vec<Vec<f64>>,
    marked: Vec<(usize, String)>,
}

impl Front {
    /// Candidates, one row each with one value per objective.
    pub fn new(title: impl Into<String>, points: &[Vec<f64>]) -> Self {
        Self {
            title: title.into(),
            points: points.to_vec(),
            ..Self::default()
        }
    }

    /// Adds an objective by its name, as in `lap time`, and its unit, which may be empty.
    #[must_use]
    pub fn objective(mut self, name: impl Into<String>, unit: impl Into<String>) -> Self {
        self.objectives.push(Objective {
            name: name.into(),
            unit: unit.into(),
        });
        self
    }

    /// Marks a candidate, by its row and a name; pictures mark the first that is marked.
    #[must_use]
    pub fn mark(mut self, candidate: usize, name: impl Into<String>) -> Self {
        self.marked.push((candidate, name.into()));
        self
    }

    /// Draws parallel coordinates to an SVG file (A. Inselberg, *The plane with parallel coordinates*, The Visual Computer
    /// 1, 1985). Every axis goes from the least value, below, to the greatest; lines are coloured by the last objective.
    /// Points that are not finite are left out.
    ///
    /// # Errors
    /// [`Error::Input`] when there are fewer than two objectives, when a point has another number of values, when no
    /// point is finite or the marked one is not there; [`Error::Io`] when the file cannot be written.
    pub fn write_parallel(&self, path: impl AsRef<Path>, title: &str) -> Result<()> {
        parallel::draw(path.as_ref(), title, &self.drawable(path.as_ref(), usize::MAX)?)
    }

    /// Checks an archive of which a picture can hold `most` objectives.
    fn drawable(&self, path: &Path, most: usize) -> Result<Archive<'_>> {
        let refuse =
            |place: String, found: String, expected: &str| Err(Error::input(path, place, found, expected));
        let n = self.objectives.len();
        if !(2..=most).contains(&n) {
            let expected = match most {
                usize::MAX => "2 or more".to_owned(),
                most => format!("2 to {most}"),
            };
            return refuse("objectives".into(), n.to_string(), &expected);
        }
        if let Some((i, point)) = self.points.iter().enumerate().find(|(_, p)| p.len() != n) {
            let found = format!("{} values", point.len());
            return refuse(format!("point {i}"), found, &format!("{n} values"));
        }
        if let Some((index, name)) = self.marked.iter().find(|(i, _)| *i >= self.points.len()) {
            let expected = format!("one of {} points", self.points.len());
            return refuse(format!("{name} point"), index.to_string(), &expected);
        }
        let finite: Vec<&Vec<f64>> = self
            .points
            .iter()
            .filter(|p| p.iter().all(|v| v.is_finite()))
            .collect();
        let ranges: Option<Vec<(f64, f64)>> = (0..n).map(|k| extent(finite.iter().map(|p| &p[k]))).collect();
        let Some(ranges) = ranges else {
            return refuse("points".into(), "none that is finite".into(), "at least one");
        };
        let mark = self
            .marked
            .first()
            .map(|(i, name)| (&self.points[*i], name.as_str()));
        Ok(Archive {
            objectives: &self.objectives,
            mark: mark.filter(|(p, _)| finite.contains(p)),
            finite,
            ranges,
        })
    }
}

impl Figure for Front {
    /// A scatter of two objectives, or a matrix of scatters of up to six.
    fn write_svg(&self, path: &Path) -> Result<()> {
        let archive = self.drawable(path, 6)?;
        let n = self.objectives.len();
        if n == 2 {
            return draw_to_file(path, (1200.0, 680.0), &self.title, |canvas| {
                archive.scatter(canvas, (0, 1), (110.0, 1170.0), (610.0, 76.0), Axes::Full);
                archive.legend(canvas, 1170.0);
            });
        }
        // The lower triangle holds every pair once; the legend stands in the empty half.
        let cells = n - 1;
        let cell = (1000.0 / cells as f64).clamp(200.0, 420.0);
        let (left, top) = (100.0, 60.0);
        let side = cell * cells as f64;
        let size = (left + side + 20.0, top + side + 50.0);
        draw_to_file(path, size, &self.title, |canvas| {
            for (row, column) in (0..cells).flat_map(|r| (0..=r).map(move |c| (r, c))) {
                let x = left + cell * column as f64;
                let y = top + cell * row as f64;
                let axes = Axes::Edges {
                    below: row + 1 == cells,
                    beside: column == 0,
                };
                let (across, up) = ((x + 6.0, x + cell - 6.0), (y + cell - 6.0, y + 6.0));
                archive.scatter(canvas, (column, row + 1), across, up, axes);
            }
            archive.legend(canvas, size.0 - 26.0);
            if n == 3 {
                archive.in_space(canvas, (left + cell, top + 20.0), cell);
            }
        })
    }

    fn place(&self, page: &mut HtmlReport) -> Result<()> {
        self.drawable(Path::new(&self.title), usize::MAX)?;
        let column = |k: usize| Numbers::new(self.points.iter().map(|p| p[k]));
        let named = |o: &Objective| (o.name.clone(), raised(&o.unit));
        let chart = json!({
            "kind": "front",
            "objectives": self.objectives.iter().map(named).collect::<Vec<_>>(),
            "points": (0..self.objectives.len()).map(column).collect::<Vec<_>>(),
            "marked": self.marked,
        });
        page.chart(&self.title, "", chart);
        Ok(())
    }
}

/// Which axes of a scatter are labelled.
#[derive(Clone, Copy)]
enum Axes {
    Full,
    Edges { below: bool, beside: bool },
}

/// What of a front can be drawn.
struct Archive<'a> {
    objectives: &'a [Objective],
    /// Points that are finite.
    finite: Vec<&'a Vec<f64>>,
    /// Least and greatest value of each objective over these.
    ranges: Vec<(f64, f64)>,
    /// The marked point with its name, if it is one of them.
    mark: Option<(&'a Vec<f64>, &'a str)>,
}

impl Archive<'_> {
    fn title(&self, k: usize) -> String {
        with_unit(&self.objectives[k].name, &self.objectives[k].unit)
    }

    fn scatter(
        &self,
        canvas: &mut Canvas<'_>,
        (across, up): (usize, usize),
        x_pixels: (f64, f64),
        y_pixels: (f64, f64),
        axes: Axes,
    ) {
        let plot = Plot {
            x: Axis::padded(self.ranges[across], 0.06, x_pixels),
            y: Axis::padded(self.ranges[up], 0.06, y_pixels),
        };
        let (x_title, y_title) = (self.title(across), self.title(up));
        let (below, beside, ticks) = match axes {
            Axes::Full => (true, true, 10),
            Axes::Edges { below, beside } => (below, beside, 4),
        };
        let labels = Labels {
            x: below.then_some(x_title.as_str()),
            y: beside.then_some(y_title.as_str()),
            x_ticks: ticks,
            y_ticks: ticks,
        };
        if beside {
            plot.draw_axes(canvas, labels);
        } else {
            plot.draw_inner(canvas, labels);
        }
        let radius = if matches!(axes, Axes::Full) { 4.0 } else { 2.5 };
        for point in &self.finite {
            let at = (plot.x.at(point[across]), plot.y.at(point[up]));
            canvas.dot(at, radius, BLUE, 0.55);
        }
        if let Some((point, _)) = self.mark {
            let at = (plot.x.at(point[across]), plot.y.at(point[up]));
            canvas.dot(at, radius + 1.0, VERMILLION, 1.0);
            canvas.ring(at, radius + 5.0, VERMILLION, 1.6);
        }
    }

    /// The three objectives in space, in a square cell, coloured by the last; each point stands on the floor's plane.
    fn in_space(&self, canvas: &mut Canvas<'_>, (left, top): (f64, f64), side: f64) {
        let (turn, tilt) = (0.62f64, 0.42f64);
        let project = |[u, v, w]: [f64; 3]| -> (f64, f64) {
            let (a, b) = (u - 0.5, v - 0.5);
            let across = a * turn.cos() - b * turn.sin();
            let away = a * turn.sin() + b * turn.cos();
            let up = (w - 0.5) * tilt.cos() + away * tilt.sin();
            (
                left + side * (0.5 + 0.52 * across),
                top + side * (0.46 - 0.52 * up),
            )
        };
        let share = |point: &[f64]| -> [f64; 3] {
            std::array::from_fn(|k| {
                let (least, most) = self.ranges[k];
                (point[k] - least) / (most - least).max(f64::MIN_POSITIVE)
            })
        };
        // The floor and the two walls at the back.
        for (fixed, at) in [(2, 0.0), (0, 0.0), (1, 1.0)] {
            let corner = |u: f64, v: f64| {
                let mut place = [u, v, v];
                if fixed == 0 {
                    place = [at, u, v];
                } else if fixed == 1 {
                    place = [u, at, v];
                } else {
                    place[2] = at;
                }
                project(place)
            };
            let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
            canvas.path(corners.map(|(u, v)| corner(u, v)), FRAME, 0.8);
        }
        let mut order: Vec<[f64; 3]> = self.finite.iter().map(|p| share(p)).collect();
        // From the back to the front.
        let depth = |p: &[f64; 3]| p[0] * turn.sin() + p[1] * turn.cos();
        order.sort_by(|a, b| depth(b).total_cmp(&depth(a)));
        for place in order {
            let (foot, head) = (project([place[0], place[1], 0.0]), project(place));
            canvas.line(foot, head, GRID, 0.6);
            canvas.dot(head, 3.0, viridis(place[2]), 0.95);
        }
        if let Some((point, _)) = self.mark {
            canvas.ring(project(share(point)), 7.5, VERMILLION, 1.6);
        }
        let name = |canvas: &mut Canvas<'_>, k: usize, at: [f64; 3], align: Align| {
            canvas.text(&self.title(k), project(at), Type::new(TICK_PX, INK, align));
        };
        name(canvas, 0, [0.45, -0.12, 0.0], Align::Right);
        name(canvas, 1, [1.1, 0.45, 0.0], Align::Left);
        name(canvas, 2, [0.0, 1.0, 1.06], Align::Centre);
    }

    fn legend(&self, canvas: &mut Canvas<'_>, right: f64) {
        let look = Type::new(TICK_PX + 1.0, INK, Align::Right);
        let archive = format!("{} candidates", self.finite.len());
        canvas.text(&archive, (right, 28.0), look);
        canvas.dot((right - look.width(&archive) - 10.0, 28.0), 4.0, BLUE, 0.55);
        if let Some((point, name)) = self.mark {
            let values: Vec<String> = point
                .iter()
                .zip(self.objectives)
                .map(|(v, o)| format!("{} {}", significant(*v, 4), o.unit))
                .collect();
            let text = format!("{name}: {}", values.join(", "));
            canvas.text(text.trim_end(), (right, 52.0), look);
            // Viewers choose wider fonts than the one that widths are guessed by.
            let x = right - 1.1 * look.width(text.trim_end()) - 14.0;
            canvas.dot((x, 52.0), 4.0, VERMILLION, 1.0);
            canvas.ring((x, 52.0), 7.5, VERMILLION, 1.4);
        }
    }
}
