//! Objectives over `alpha` at two neighbouring cross-sections, all others as they are on the best line.

use crate::error::Result;
use crate::evaluate::BackendChoice;
use crate::evaluate::line::{LineProblem, open_line_evaluator};
use crate::line::Parametrisation;
use crate::report::{Levels, Surface, with_unit};
use crate::study::raceline::{ObjectiveOutcome, RacelineSettings, Setup};

/// Values of each `alpha`.
const GRID: usize = 41;

/// An objective at the cross-section where its best line bends most and the next; none with fewer than two.
pub fn surface(
    settings: &RacelineSettings,
    setup: &Setup,
    found: &ObjectiveOutcome,
) -> Result<Option<Surface>> {
    let n = setup.cuts.len();
    let axis: Vec<f64> = (0..GRID).map(|i| i as f64 / (GRID - 1) as f64).collect();
    let line = &found.best;
    let bend = |i: usize| {
        let at = |place: &(usize, f64)| place.0 == i && place.1 == 0.0;
        let point = line.fine.section.iter().position(at);
        point.map_or(0.0, |p| line.fine.curvature_1pm[p].abs())
    };
    let bends = (0..n.saturating_sub(1)).map(|i| (i, bend(i)));
    let Some((cut, _)) = bends.max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Ok(None);
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
    let costs = evaluator.evaluate(&grid)?.worths(1).into_iter();
    let (name, unit) = (found.objective.name(), found.objective.unit());
    let label = |i: usize| format!("alpha at {:.1} m", setup.cuts.station_m[i]);
    Ok(Some(Surface {
        title: format!(
            "{}: {name} over the {} line's place on two neighbouring cross-sections",
            setup.track_name, line.name
        ),
        x_label: label(cut),
        y_label: label(cut + 1),
        z_label: with_unit(name, unit),
        y: axis.clone(),
        x: axis,
        z: costs
            .map(|worth| if worth.succeeded() { worth.cost } else { f64::NAN })
            .collect(),
        levels: Levels::Basin,
        marks: vec![(line.name.clone(), [line.alpha[cut], line.alpha[cut + 1]])],
    }))
}
