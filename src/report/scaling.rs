//! Evaluations per second against the size of the population.

use std::path::Path;

use super::axis::{Axis, Labels, Plot, draw_legend, extent};
use super::canvas::draw_to_file;
use super::style::series_colour;
use crate::{Error, Result};

/// One backend's throughput.
#[derive(Debug, Clone, Copy)]
pub struct ScalingSeries<'a> {
    /// Name in the legend.
    pub label: &'a str,
    /// Population sizes.
    pub population: &'a [f64],
    /// Evaluations per second at each, one per population size.
    pub evaluations_per_s: &'a [f64],
}

/// Draws evaluations per second against population, both logarithmic, to an SVG file.
///
/// # Errors
/// [`Error::Input`] when lengths differ or no series has a positive pair; [`Error::Io`] when the
/// file cannot be written.
pub fn plot_scaling(path: impl AsRef<Path>, title: &str, series: &[ScalingSeries<'_>]) -> Result<()> {
    let path = path.as_ref();
    for one in series {
        let (n, found) = (one.population.len(), one.evaluations_per_s.len());
        if n != found {
            return Err(Error::input(
                path,
                format!("series {}", one.label),
                format!("{found} rates for {n} populations"),
                "one rate per population",
            ));
        }
    }
    let pairs = |s: &ScalingSeries<'_>| -> Vec<(f64, f64)> {
        let all = s.population.iter().zip(s.evaluations_per_s);
        all.map(|(&p, &r)| (p, r))
            .filter(|(p, r)| p.is_finite() && r.is_finite() && *p > 0.0 && *r > 0.0)
            .collect()
    };
    let drawn: Vec<Vec<(f64, f64)>> = series.iter().map(pairs).collect();
    let populations = extent(drawn.iter().flatten().map(|(p, _)| p));
    let rates = extent(drawn.iter().flatten().map(|(_, r)| r));
    let (Some(populations), Some(rates)) = (populations, rates) else {
        return Err(Error::input(
            path,
            "series",
            "no positive rate",
            "at least one population with a positive rate",
        ));
    };
    draw_to_file(path, (1200.0, 640.0), title, |canvas| {
        let plot = Plot {
            x: Axis::log(populations, (100.0, 1170.0)),
            y: Axis::log(rates, (570.0, 76.0)),
        };
        plot.draw_axes(
            canvas,
            Labels {
                x: Some("population (candidates)"),
                y: Some("evaluations per second (1/s)"),
                x_ticks: 10,
                y_ticks: 10,
            },
        );
        for (i, points) in drawn.iter().enumerate() {
            plot.curve(canvas, points.iter().copied(), series_colour(i), 2.0);
            for &(p, r) in points {
                canvas.dot((plot.x.at(p), plot.y.at(r)), 4.0, series_colour(i), 1.0);
            }
        }
        let legend: Vec<_> = series
            .iter()
            .enumerate()
            .map(|(i, s)| (s.label, series_colour(i), 2.4))
            .collect();
        draw_legend(canvas, &legend, 1170.0, 54.0);
    })
}
