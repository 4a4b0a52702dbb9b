//! An archive in parallel coordinates: an axis for each objective, a line for each compromise.

use super::super::canvas::{Align, Canvas, Type, draw_to_file};
use super::super::style::{
    FRAME, INK, LABEL_PX, TICK_PX, VERMILLION, WHITE, significant, viridis, with_unit,
};
use super::Archive;
use crate::Result;
use std::path::Path;

const SIZE: (f64, f64) = (900.0, 520.0);
const TOP: f64 = 100.0;
const BOTTOM: f64 = 460.0;

/// Draws the archive with an axis for each objective.
pub(super) fn draw(path: &Path, title: &str, archive: &Archive<'_>) -> Result<()> {
    let Archive {
        objectives,
        finite,
        ranges,
        ..
    } = archive;
    let n = objectives.len();
    let share = |point: &[f64], k: usize| {
        let (least, most) = ranges[k];
        if most > least {
            (point[k] - least) / (most - least)
        } else {
            0.5
        }
    };
    let across = |k: usize| 110.0 + (SIZE.0 - 220.0) * k as f64 / (n - 1) as f64;
    let course = |point: &[f64]| -> Vec<(f64, f64)> {
        (0..n)
            .map(|k| (across(k), BOTTOM - (BOTTOM - TOP) * share(point, k)))
            .collect()
    };
    // The smallest values of the last objective lie on top.
    let mut order: Vec<&&Vec<f64>> = finite.iter().collect();
    order.sort_by(|a, b| b[n - 1].total_cmp(&a[n - 1]));
    draw_to_file(path, SIZE, title, |canvas: &mut Canvas<'_>| {
        for point in order {
            canvas.path(course(point), viridis(share(point, n - 1)), 1.2);
        }
        if let Some((point, _)) = archive.mark {
            canvas.path(course(point), WHITE, 5.0);
            canvas.path(course(point), VERMILLION, 2.6);
        }
        for (k, objective) in objectives.iter().enumerate() {
            let (x, (least, most)) = (across(k), ranges[k]);
            canvas.line((x, TOP), (x, BOTTOM), FRAME, 1.2);
            let name = with_unit(&objective.name, &objective.unit);
            canvas.text(
                &name,
                (x, TOP - 36.0),
                Type::new(LABEL_PX, INK, Align::Centre).bold(),
            );
            let look = Type::new(TICK_PX, INK, Align::Centre);
            canvas.text(&significant(most, 5), (x, TOP - 14.0), look);
            canvas.text(&significant(least, 5), (x, BOTTOM + 16.0), look);
        }
    })
}
