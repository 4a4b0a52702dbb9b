//! Objectives over `alpha` at two neighbouring cuts, all others as they are on the best line.

use crate::error::Result;
use crate::evaluate::line::{LineProblem, open_line_evaluator};
use crate::evaluate::{BackendChoice, FAILED_COST};
use crate::files::stem;
use crate::line::Parametrisation;
use crate::report::{Levels, SurfaceFigure, plot_surface};
use crate::study::raceline::{Outcome, RacelineSettings, Setup};
use std::path::Path;

/// Values of each `alpha`.
const GRID: usize = 41;

/// Draws `surface_<line>.svg` of each objective, at the cut where its best line bends most and the next.
pub fn draw(folder: &Path, settings: &RacelineSettings, setup: &Setup, outcome: &Outcome) -> Result<()> {
    let n = setup.cuts.len();
    let axis: Vec<f64> = (0..GRID).map(|i| i as f64 / (GRID - 1) as f64).collect();
    for found in &outcome.objectives {
        let line = &found.best;
        let bend = |i: usize| {
            let at = |place: &(usize, f64)| place.0 == i && place.1 == 0.0;
            let point = line.fine.section.iter().position(at);
            point.map_or(0.0, |p| line.fine.curvature_1pm[p].abs())
        };
        let Some((cut, _)) = (0..n.saturating_sub(1))
            .map(|i| (i, bend(i)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
        else {
            continue;
        };
        let pair = Parametrisation::sections().with_free(vec![cut, cut + 1], line.alpha.clone());
        let problem = LineProblem::new(
            setup.cuts.clone(),
            pair,
            &[found.objective],
            Some(setup.car.clone()),
            settings.entry_mps,
        )?;
        let grid: Vec<f64> = axis
            .iter()
            .flat_map(|y| axis.iter().flat_map(|x| [*x, *y]))
            .collect();
        // In f64: a surface's bottom is flatter than single precision.
        let mut evaluator = open_line_evaluator(&problem, BackendChoice::Cpu, None)?;
        let costs: Vec<f64> = evaluator
            .evaluate(&grid)?
            .objectives
            .into_iter()
            .map(|c| if c < FAILED_COST { c } else { f64::NAN })
            .collect();
        let (name, unit) = (found.objective.name(), found.objective.unit());
        let station = |i: usize| setup.cuts.station_m[i];
        let figure = SurfaceFigure {
            title: &format!(
                "{}: {name} over the {} line's place on two neighbouring cuts",
                setup.track_name, line.name
            ),
            x_label: &format!("alpha at {:.1} m", station(cut)),
            y_label: &format!("alpha at {:.1} m", station(cut + 1)),
            z_label: &format!("{name} ({unit})"),
            x: &axis,
            y: &axis,
            z: &costs,
            levels: Levels::Basin,
            marks: vec![(line.name.as_str(), [line.alpha[cut], line.alpha[cut + 1]])],
        };
        plot_surface(folder.join(format!("surface_{}.svg", stem(&line.name))), &figure)?;
    }
    Ok(())
}
