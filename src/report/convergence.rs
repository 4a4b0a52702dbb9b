//! Cost against evaluations.

use std::path::Path;

use super::axis::{Axis, Labels, Plot, draw_legend, extent};
use super::canvas::{Align, Type, draw_to_file};
use super::style::{FAINT_INK, INK, TICK_PX, series_colour, significant};
use crate::{Error, Result};

/// The history of one run.
#[derive(Debug, Clone, Copy)]
pub struct ConvergenceRun<'a> {
    /// Name in the legend.
    pub label: &'a str,
    /// Evaluations spent so far, one per generation.
    pub evaluations: &'a [f64],
    /// Best cost so far; the axis is logarithmic, so costs of nought and below are gaps.
    pub best: &'a [f64],
    /// Median cost of the swarm, if recorded.
    pub median: Option<&'a [f64]>,
}

/// Draws best (and median) cost against evaluations for one or several runs to an SVG file.
/// `cost_label` is the cost's name with its unit, if it has one.
///
/// # Errors
/// [`Error::Input`] when lengths differ or nothing can be drawn; [`Error::Io`] when the file cannot
/// be written.
pub fn plot_convergence(
    path: impl AsRef<Path>,
    title: &str,
    cost_label: &str,
    runs: &[ConvergenceRun<'_>],
) -> Result<()> {
    let path = path.as_ref();
    for run in runs {
        let n = run.evaluations.len();
        if run.best.len() != n || run.median.is_some_and(|m| m.len() != n) {
            return Err(Error::input(
                path,
                format!("run {}", run.label),
                format!("{} costs for {n} generations", run.best.len()),
                "one cost per generation",
            ));
        }
    }
    let costs = runs
        .iter()
        .flat_map(|r| r.best.iter().chain(r.median.unwrap_or_default()))
        .filter(|&&c| c > 0.0);
    let spent = extent(runs.iter().flat_map(|r| r.evaluations));
    let (Some(costs), Some(spent)) = (extent(costs), spent) else {
        return Err(Error::input(
            path,
            "runs",
            "no positive cost",
            "at least one generation with a positive cost",
        ));
    };
    draw_to_file(path, (1200.0, 640.0), title, |canvas| {
        let plot = Plot {
            x: Axis::linear((0.0, spent.1), (100.0, 1170.0)),
            y: Axis::log(costs, (570.0, 76.0)),
        };
        plot.draw_axes(
            canvas,
            Labels {
                x: Some("evaluations"),
                y: Some(cost_label),
                x_ticks: 10,
                y_ticks: 10,
            },
        );
        for (i, run) in runs.iter().enumerate() {
            let colour = series_colour(i);
            let along = |costs: &'_ [f64]| -> Vec<(f64, f64)> {
                run.evaluations
                    .iter()
                    .copied()
                    .zip(costs.iter().copied())
                    .collect()
            };
            if let Some(median) = run.median {
                plot.curve(canvas, along(median).into_iter(), colour, 0.9);
            }
            plot.curve(canvas, along(run.best).into_iter(), colour, 2.4);
            let last = run.best.iter().rposition(|c| c.is_finite() && *c > 0.0);
            if let Some(last) = last {
                let at = (plot.x.at(run.evaluations[last]), plot.y.at(run.best[last]));
                canvas.dot(at, 3.5, colour, 1.0);
                if runs.len() == 1 {
                    let text = significant(run.best[last], 3);
                    let look = Type::new(TICK_PX, INK, Align::Right);
                    canvas.text(&text, (at.0 - 2.0, at.1 - 12.0), look);
                }
            }
        }
        let shown: Vec<_> = runs
            .iter()
            .enumerate()
            .take(8)
            .map(|(i, r)| (r.label, series_colour(i), 2.4))
            .collect();
        draw_legend(canvas, &shown, 1170.0, 54.0);
        if runs.iter().any(|r| r.median.is_some()) {
            canvas.text(
                "thick: best so far, thin: median of the swarm",
                (100.0, 54.0),
                Type::new(TICK_PX + 1.0, FAINT_INK, Align::Left),
            );
        }
    })
}
