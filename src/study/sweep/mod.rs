//! The same study over a grid of settings and seeds: one row for each run, medians over the seeds.
//!
//! A run is a study file of its own, made of the base's keys and those of one point of the grid. Rows are kept as they
//! come, so that a sweep that was broken off goes on where it stopped; they hold nothing that depends on the clock.

mod grid;
mod identified;
mod joint;
mod results;

pub use grid::{Point, SweepSettings};
pub use results::{Row, Summary, medians};

use self::identified::{alike, identified};
use crate::error::{Error, Result};
use crate::report::write_whole;
use crate::study::identify::IdentifySettings;
use crate::study::memory::USUAL_MIB;
use crate::study::raceline::{self, RacelineSettings};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// The studies that can be swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweptStudy {
    /// Identification.
    Identify,
    /// Racing lines.
    Raceline,
}

/// Rows of a sweep as they are kept, one JSON object per line.
const ROWS: &str = "rows.jsonl";
/// The sweep that a folder holds.
pub const SWEEP_FILE: &str = "sweep.toml";

/// What an observer is told before each run.
pub struct SweepProgress<'a> {
    /// Runs done.
    pub done: usize,
    /// Runs in all.
    pub planned: usize,
    /// The point of the grid.
    pub point: &'a Point,
}

/// Runs what is left of a sweep in `folder`, which holds nothing yet or, to `resume`, a part of the same sweep.
///
/// # Errors
/// [`Error::Input`] if the folder holds another sweep, or a point of the grid is no study; [`Error::Interrupted`] if the
/// observer broke the sweep off; those of the studies.
pub fn sweep(
    settings: &SweepSettings,
    folder: &Path,
    resume: bool,
    mut observe: impl FnMut(&SweepProgress<'_>) -> ControlFlow<()>,
) -> Result<Summary> {
    let points = settings.points()?;
    let studies = folder.join("studies");
    let path_of = |number: usize| studies.join(format!("{number:05}.toml"));
    // Every point is read before anything is written: a mistake in the last shows at once, and leaves nothing behind.
    for (number, point) in points.iter().enumerate() {
        let read = match settings.study {
            SweptStudy::Identify => IdentifySettings::parse(&path_of(number), &point.study).map(|s| s.size()),
            SweptStudy::Raceline => RacelineSettings::parse(&path_of(number), &point.study).map(|s| s.size()),
        };
        read.and_then(|size| size.check(USUAL_MIB))
            .map_err(|e| settings.of_point(e, number, point, &path_of(number)))?;
    }
    let mut rows = if resume {
        results::read_rows(&folder.join(ROWS), &folder.join(SWEEP_FILE), settings, &points)?
    } else {
        Vec::new()
    };
    let began_with = rows.len();
    let ran = write_studies(settings, folder, &points, path_of, resume)
        .and_then(|()| run_points(settings, folder, &points, path_of, &mut rows, &mut observe));
    if let Err(error) = ran {
        // What has come to nothing does not stand in the way of the next; what was broken off may be gone on with.
        if !resume && rows.len() == began_with && !matches!(error, Error::Interrupted(_)) {
            let _ = std::fs::remove_dir_all(&studies);
            let _ = std::fs::remove_file(folder.join(SWEEP_FILE));
        }
        return Err(error);
    }
    let summary = Summary::new(rows)?;
    summary.write(folder)?;
    Ok(summary)
}

/// Writes the sweep and the study of every point.
fn write_studies(
    settings: &SweepSettings,
    folder: &Path,
    points: &[Point],
    path_of: impl Fn(usize) -> PathBuf,
    resume: bool,
) -> Result<()> {
    let studies = folder.join("studies");
    std::fs::create_dir_all(&studies).map_err(|e| Error::io(&studies, "create", e))?;
    if !resume {
        write_whole(folder.join(SWEEP_FILE), settings.text.as_bytes())?;
    }
    for (number, point) in points.iter().enumerate() {
        write_whole(path_of(number), point.study.as_bytes())?;
    }
    Ok(())
}

/// Runs the points that have no row yet, and keeps the rows as they come.
fn run_points(
    settings: &SweepSettings,
    folder: &Path,
    points: &[Point],
    path_of: impl Fn(usize) -> PathBuf,
    rows: &mut Vec<Row>,
    observe: &mut dyn FnMut(&SweepProgress<'_>) -> ControlFlow<()>,
) -> Result<()> {
    let paths: Vec<PathBuf> = (0..points.len()).map(path_of).collect();
    while rows.len() < points.len() {
        let number = rows.len();
        let progress = SweepProgress {
            done: number,
            planned: points.len(),
            point: &points[number],
        };
        if observe(&progress).is_break() {
            return Err(Error::Interrupted(folder.to_owned()));
        }
        let told = || observe(&progress);
        let found = match settings.study {
            SweptStudy::Identify => {
                let together = alike(&paths[number..]);
                identified(&paths[number..number + together], told)
            }
            SweptStudy::Raceline => Ok(vec![lined(&paths[number], told)]),
        };
        let found = found.map_err(|e| settings.of_point(e, number, &points[number], &paths[number]))?;
        for (run, found) in (number..).zip(found) {
            let found = found.map_err(|e| settings.of_point(e, run, &points[run], &paths[run]))?;
            // A run that was broken off is no row: it is done anew, as is what comes after it.
            let Some((figures, front)) = found else {
                return Err(Error::Interrupted(folder.to_owned()));
            };
            rows.push(Row {
                run,
                settings: points[run].settings.clone(),
                figures,
                front,
            });
            results::write_rows(&folder.join(ROWS), rows)?;
        }
    }
    Ok(())
}

type Figures = BTreeMap<String, Option<f64>>;
/// Figures, and the objectives of a front where there is one.
type Found = (Figures, Vec<Vec<f64>>);

fn lined(path: &Path, mut observe: impl FnMut() -> ControlFlow<()>) -> Result<Option<Found>> {
    let settings = RacelineSettings::read(path)?;
    let setup = raceline::set_up(&settings)?;
    let outcome = raceline::find_lines(&settings, &setup, |_| observe())?;
    if outcome.interrupted {
        return Ok(None);
    }
    let mut figures = Figures::from([("evaluations".to_owned(), Some(outcome.evaluations as f64))]);
    for o in &outcome.objectives {
        let name = o.objective.name();
        let unit = o.objective.unit().replace('/', "p").replace('^', "");
        figures.insert(format!("swarm_{name}_{unit}"), Some(o.swarm_cost));
        figures.insert(format!("best_{name}_{unit}"), Some(o.best.worth(o.objective)));
        figures.insert(
            format!("exact_{name}_{unit}"),
            o.exact.as_ref().map(|line| line.worth(o.objective)),
        );
    }
    let mut front = Vec::new();
    if let Some(found) = outcome.front {
        figures.insert("hypervolume".to_owned(), Some(found.hypervolume));
        figures.insert("front_size".to_owned(), Some(found.alpha.len() as f64));
        front = found.objectives;
    }
    Ok(Some((figures, front)))
}
