//! Dots over a map of two quantities that is coloured by a third.

use std::path::Path;

use super::axis::{Axis, Labels, Plot, draw_legend, extent};
use super::canvas::{Align, Type, draw_to_file};
use super::style::{GREYED, INK, LABEL_PX, TICK_PX, VERMILLION, WHITE, significant, viridis, with_unit};
use crate::{Error, Result};
use plotters::style::RGBColor;

/// A map and the dots on it.
#[derive(Debug, Clone)]
pub struct SiteMap {
    /// Title of the figure.
    pub title: String,
    /// Quantity and unit across.
    pub x_label: String,
    /// Quantity and unit up.
    pub y_label: String,
    /// Ends of the map across.
    pub x: (f64, f64),
    /// Ends of the map up.
    pub y: (f64, f64),
    /// Rows of even cells, the lowest first; blank where not finite.
    pub cells: Vec<Vec<f64>>,
    /// The quantity that colours the cells.
    pub value_label: String,
    /// Its unit.
    pub value_unit: String,
    /// Families of dots, by name.
    pub sites: Vec<(String, Vec<(f64, f64)>)>,
}

const SIZE: (f64, f64) = (900.0, 620.0);
const LEFT: f64 = 84.0;
const RIGHT: f64 = 770.0;
const TOP: f64 = 76.0;
const BOTTOM: f64 = 550.0;
const DOT_PX: f64 = 2.0;
const SEAM_PX: f64 = 0.4;
/// Steps of colour: finer ones cannot be told apart and only make the file longer.
const SHADES: f64 = 48.0;
/// Families of dots beyond these share the last colour.
const COLOURS: [RGBColor; 3] = [WHITE, VERMILLION, INK];

impl SiteMap {
    /// Draws dots over a coloured map to an SVG file.
    ///
    /// # Errors
    /// [`Error::Input`] when the map has no finite cell or no extent; [`Error::Io`] when the file cannot be written.
    pub fn write_svg(&self, path: impl AsRef<Path>) -> Result<()> {
        let (path, map) = (path.as_ref(), self);
        let (Some((low, high)), true) = (
            extent(map.cells.iter().flatten()),
            map.x.1 > map.x.0 && map.y.1 > map.y.0,
        ) else {
            return Err(Error::input(
                path,
                "map",
                "no finite cell or no extent",
                "cells over a range",
            ));
        };
        draw_to_file(path, SIZE, &map.title, |canvas| {
            let plot = Plot {
                x: Axis::linear(map.x, (LEFT, RIGHT)),
                y: Axis::linear(map.y, (BOTTOM, TOP)),
            };
            plot.draw_axes(
                canvas,
                Labels {
                    x: Some(&map.x_label),
                    y: Some(&map.y_label),
                    x_ticks: 8,
                    y_ticks: 8,
                },
            );
            // Little is the better: dark for much would read the other way round.
            let share = |value: f64| {
                if high > low {
                    (high - value) / (high - low)
                } else {
                    0.5
                }
            };
            let shade = |value: f64| viridis((share(value) * SHADES).round() / SHADES);
            let rows = map.cells.len() as f64;
            for (j, row) in map.cells.iter().enumerate() {
                let x = |i: usize| LEFT + (RIGHT - LEFT) * i as f64 / row.len() as f64;
                let y = |j: usize| BOTTOM - (BOTTOM - TOP) * j as f64 / rows;
                // Neighbours that look alike are drawn as one.
                let mut start = 0;
                let look = |value: f64| value.is_finite().then(|| (share(value) * SHADES).round() as i64);
                for alike in row.chunk_by(|a, b| look(*a) == look(*b)) {
                    let end = start + alike.len();
                    if alike[0].is_finite() {
                        // Cells that only touch would let the ground shine through between them.
                        let corners = ((x(start), y(j + 1)), (x(end) + SEAM_PX, y(j) + SEAM_PX));
                        canvas.rect(corners.0, corners.1, shade(alike[0]), 1.0);
                    }
                    start = end;
                }
            }
            let mut legend = Vec::new();
            for (k, (name, sites)) in map.sites.iter().enumerate() {
                let colour = COLOURS[k.min(COLOURS.len() - 1)];
                for site in sites {
                    let at = (plot.x.at(site.0), plot.y.at(site.1));
                    if at.0.is_finite() && at.1.is_finite() {
                        canvas.dot(at, DOT_PX + 0.7, INK, 0.6);
                        canvas.dot(at, DOT_PX, colour, 1.0);
                    }
                }
                legend.push((name.as_str(), if colour == WHITE { GREYED } else { colour }, 4.0));
            }
            draw_legend(canvas, &legend, RIGHT, 30.0);
            let bar = (RIGHT + 34.0, RIGHT + 54.0);
            const STEPS: usize = 64;
            for step in 0..STEPS {
                let edge = |k: usize| BOTTOM - (BOTTOM - TOP) * k as f64 / STEPS as f64;
                let value = low + (high - low) * (step as f64 + 0.5) / STEPS as f64;
                canvas.rect((bar.0, edge(step + 1)), (bar.1, edge(step)), shade(value), 1.0);
            }
            canvas.frame((bar.0, TOP), (bar.1, BOTTOM), INK, 0.8);
            for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                let text = significant(low + share * (high - low), 3);
                let y = BOTTOM - share * (BOTTOM - TOP);
                canvas.text(&text, (bar.1 + 6.0, y), Type::new(TICK_PX, INK, Align::Left));
            }
            let label = with_unit(&map.value_label, &map.value_unit);
            canvas.text(
                &label,
                (bar.1 + 50.0, TOP - 20.0),
                Type::new(LABEL_PX, INK, Align::Right),
            );
        })
    }
}
