//! How good what was found is against time.

use std::path::Path;

use super::axis::{Axis, Labels, Plot, draw_legend, extent};
use super::canvas::{Align, Type, draw_to_file};
use super::style::{INK, LABEL_PX, series_colour};
use crate::{Error, Result};

/// One run.
#[derive(Debug, Clone)]
pub struct QualityRun<'a> {
    /// Its name in the legend.
    pub label: &'a str,
    /// Time so far (s).
    pub seconds: Vec<f64>,
    /// Hypervolume then, one per time.
    pub hypervolume: Vec<f64>,
}

/// Runs of one problem.
#[derive(Debug, Clone)]
pub struct QualityPanel<'a> {
    /// What they have in common.
    pub title: &'a str,
    /// The runs.
    pub runs: Vec<QualityRun<'a>>,
    /// The range of hypervolumes shown.
    pub shown: (f64, f64),
}

const PANEL: (f64, f64) = (590.0, 400.0);
const TOP: f64 = 84.0;

/// Draws panels of hypervolume against time, which is logarithmic, two beside each other, to an SVG file. A name has the
/// same colour in all panels.
///
/// # Errors
/// [`Error::Input`] when a panel has nothing to draw or lengths differ; [`Error::Io`] when the file cannot be written.
pub fn plot_quality(path: impl AsRef<Path>, title: &str, panels: &[QualityPanel<'_>]) -> Result<()> {
    let path = path.as_ref();
    let runs = || panels.iter().flat_map(|p| &p.runs);
    if let Some(run) = runs().find(|r| r.seconds.len() != r.hypervolume.len()) {
        let found = format!("{} of {} times", run.hypervolume.len(), run.seconds.len());
        return Err(Error::input(
            path,
            run.label,
            found,
            "a hypervolume for each time",
        ));
    }
    let mut names: Vec<&str> = Vec::new();
    for run in runs() {
        if !names.contains(&run.label) {
            names.push(run.label);
        }
    }
    let mut times = Vec::new();
    for panel in panels {
        let all = panel.runs.iter().flat_map(|r| &r.seconds).filter(|s| **s > 0.0);
        match extent(all) {
            Some(range) if panel.shown.1 > panel.shown.0 => times.push(range),
            _ => {
                let found = "no time above nought, or no range to show";
                return Err(Error::input(path, panel.title, found, "a run to draw"));
            }
        }
    }
    let rows = panels.len().div_ceil(2);
    let size = (PANEL.0 * 2.0 + 20.0, TOP + PANEL.1 * rows as f64);
    draw_to_file(path, size, title, |canvas| {
        let legend: Vec<_> = names
            .iter()
            .enumerate()
            .map(|(i, name)| (*name, series_colour(i), 2.4))
            .collect();
        draw_legend(canvas, &legend, 2.0 * PANEL.0, 58.0);
        for (index, (panel, range)) in panels.iter().zip(times).enumerate() {
            let (column, row) = (index % 2, index / 2);
            let left = PANEL.0 * column as f64 + 84.0;
            let right = PANEL.0 * (column + 1) as f64;
            let top = TOP + PANEL.1 * row as f64 + 30.0;
            let bottom = TOP + PANEL.1 * (row + 1) as f64 - 60.0;
            let name = Type::new(LABEL_PX, INK, Align::Left).bold();
            canvas.text(panel.title, (left, top - 14.0), name);
            let plot = Plot {
                x: Axis::log(range, (left, right)),
                y: Axis::linear(panel.shown, (bottom, top)),
            };
            plot.draw_axes(
                canvas,
                Labels {
                    x: Some("time (s)"),
                    y: Some("hypervolume"),
                    x_ticks: 6,
                    y_ticks: 6,
                },
            );
            for run in &panel.runs {
                let colour = series_colour(names.iter().position(|n| *n == run.label).unwrap_or(0));
                let points = run.seconds.iter().copied().zip(run.hypervolume.iter().copied());
                let inside = points
                    .filter(|(t, h)| *t > 0.0 && *h >= panel.shown.0)
                    .collect::<Vec<_>>();
                if let Some(&(t, h)) = inside.last() {
                    canvas.dot((plot.x.at(t), plot.y.at(h)), 3.5, colour, 1.0);
                }
                plot.curve(canvas, inside.into_iter(), colour, 1.8);
            }
        }
    })
}
