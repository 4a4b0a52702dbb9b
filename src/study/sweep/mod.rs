//! The same study over a grid of settings and seeds: one row for each run, medians over the seeds.
//!
//! A run is a study file of its own, made of the base's keys and those of one point of the grid. Rows are kept as they
//! come, and the states of the runs that are at work beside their study files, so that a sweep that was broken off goes on where
//! it stopped; rows hold nothing that depends on the clock.

mod grid;
mod identified;
mod joint;
mod page;
mod results;

pub use grid::{Point, SweepSettings};
pub use results::{Row, Summary, medians};

use self::identified::{alike, identified, problem_of};
use crate::error::{Error, Result};
use crate::evaluate::BackendInfo;
use crate::report::write_whole;
use crate::study::identify::{self, IdentifySettings};
use crate::study::keeper::Keeper;
use crate::study::memory::{Size, USUAL_MIB};
use crate::study::raceline::{self, LinesState, RacelineSettings};
use crate::study::run::go_on;
use crate::study::run_folder::{Manifest, write_json};
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

/// As [`sweep_within`], in the usual memory.
///
/// # Errors
/// As [`sweep_within`].
pub fn sweep(
    settings: &SweepSettings,
    folder: &Path,
    resume: bool,
    observe: impl FnMut(&SweepProgress<'_>) -> ControlFlow<()>,
) -> Result<Summary> {
    sweep_within(settings, folder, resume, USUAL_MIB, observe)
}

/// Runs what is left of a sweep in `folder`, which holds nothing yet or, to `resume`, a part of the same sweep. Runs that are
/// at work at the same time share `memory_limit_mib` (MiB), which changes no row.
///
/// # Errors
/// [`Error::Input`] if the folder holds another sweep, or a point of the grid is no study; [`Error::Interrupted`] if the
/// observer broke the sweep off; those of the studies.
pub fn sweep_within(
    settings: &SweepSettings,
    folder: &Path,
    resume: bool,
    memory_limit_mib: u64,
    mut observe: impl FnMut(&SweepProgress<'_>) -> ControlFlow<()>,
) -> Result<Summary> {
    let points = settings.points()?;
    let studies = folder.join("studies");
    let path_of = |number: usize| studies.join(format!("{number:05}.toml"));
    // Every point is read before anything is written: a mistake in the last shows at once, and leaves nothing behind.
    read_points(settings, &points, path_of, memory_limit_mib)?;
    let mut rows = if resume {
        results::read_rows(&folder.join(ROWS), &folder.join(SWEEP_FILE), settings, &points)?
    } else {
        Vec::new()
    };
    let began_with = rows.len();
    let ran = write_studies(settings, folder, &points, path_of, resume).and_then(|()| {
        let work = Work {
            settings,
            folder,
            points: &points,
            paths: (0..points.len()).map(path_of).collect(),
            memory_limit_mib,
        };
        work.run_points(&mut rows, &mut observe)
    });
    if let Err(error) = ran {
        // What has come to nothing does not stand in the way of the next; what was broken off may be gone on with.
        // So may what a full disk or a lost device has ended.
        let begun = || (0..points.len()).any(|number| keeper_of(&path_of(number)).file().exists());
        let mendable = match &error {
            Error::Interrupted(_) => true,
            Error::Io { .. } | Error::Device(_) | Error::NoDevice(_) => begun(),
            _ => false,
        };
        if !resume && rows.len() == began_with && !mendable {
            let _ = std::fs::remove_dir_all(&studies);
            let _ = std::fs::remove_file(folder.join(SWEEP_FILE));
        }
        return Err(error);
    }
    let summary = Summary::new(rows)?;
    summary.write(folder, settings)?;
    Ok(summary)
}

/// The study of a point, read.
enum PointStudy {
    Identify(Box<IdentifySettings>),
    Raceline(Box<RacelineSettings>),
}

impl PointStudy {
    fn size(&self) -> Size {
        match self {
            Self::Identify(s) => s.size(),
            Self::Raceline(s) => s.size(),
        }
    }
}

/// Reads the study of every point, and refuses what is wrong or too large.
fn read_points(
    settings: &SweepSettings,
    points: &[Point],
    path_of: impl Fn(usize) -> PathBuf,
    memory_limit_mib: u64,
) -> Result<Vec<PointStudy>> {
    let read = |(number, point): (usize, &Point)| {
        let path = path_of(number);
        let study = match settings.study {
            SweptStudy::Identify => {
                IdentifySettings::parse(&path, &point.study).map(|s| PointStudy::Identify(Box::new(s)))
            }
            SweptStudy::Raceline => {
                RacelineSettings::parse(&path, &point.study).map(|s| PointStudy::Raceline(Box::new(s)))
            }
        };
        study
            .and_then(|study| study.size().check(memory_limit_mib).map(|_| study))
            .map_err(|e| settings.of_point(e, number, point, &path))
    };
    points.iter().enumerate().map(read).collect()
}

/// What a sweep would do.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepPlan {
    /// Runs.
    pub runs: usize,
    /// Different problems among them, each of which has been set up.
    pub problems: usize,
    /// Cars driven by all swarms at the most; none where the studies find out how many.
    pub evaluations: Option<u64>,
    /// What the largest study keeps (MiB).
    pub memory_mib: u64,
    /// What evaluates.
    pub backend: BackendInfo,
}

impl std::fmt::Display for SweepPlan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let of = if self.problems == 1 {
            "one problem".to_owned()
        } else {
            format!("{} problems", self.problems)
        };
        write!(f, "{} runs of {of}", self.runs)
    }
}

/// Reads every point, sets up every problem among them, and runs none, none of which may take more than so much memory (MiB).
///
/// # Errors
/// Those that [`sweep`] would have before its runs begin, and those of the problems.
pub fn plan(settings: &SweepSettings, memory_limit_mib: u64) -> Result<SweepPlan> {
    let points = settings.points()?;
    let path_of = |number: usize| PathBuf::from(format!("{number:05}.toml"));
    let studies = read_points(settings, &points, path_of, memory_limit_mib)?;
    let mut identified: Vec<IdentifySettings> = Vec::new();
    let mut lined: Vec<RacelineSettings> = Vec::new();
    let mut chosen = Vec::new();
    for (number, study) in studies.iter().enumerate() {
        let set_up = match study {
            PointStudy::Identify(s) => {
                chosen.push((s.backend, s.adapter.clone()));
                let problem = problem_of((**s).clone());
                if identified.contains(&problem) {
                    continue;
                }
                identified.push(problem);
                identify::set_up(s).map(drop)
            }
            PointStudy::Raceline(s) => {
                chosen.push((s.backend, s.adapter.clone()));
                let problem = RacelineSettings {
                    track: s.track.clone(),
                    car: s.car.clone(),
                    envelope: s.envelope.clone(),
                    section: s.section.clone(),
                    sections: s.sections,
                    as_surveyed: s.as_surveyed,
                    car_width_m: s.car_width_m,
                    ..RacelineSettings::default()
                };
                if lined.contains(&problem) {
                    continue;
                }
                lined.push(problem);
                raceline::set_up(s).map(drop)
            }
        };
        set_up.map_err(|e| settings.of_point(e, number, &points[number], &path_of(number)))?;
    }
    chosen.dedup();
    let mut backends = chosen
        .iter()
        .map(|(backend, adapter)| backend.would_be(adapter.as_deref()))
        .collect::<Result<Vec<_>>>()?;
    let evaluations = studies.iter().map(|study| match study {
        PointStudy::Identify(s) => Some(s.evaluations()),
        PointStudy::Raceline(_) => None,
    });
    Ok(SweepPlan {
        runs: points.len(),
        problems: identified.len() + lined.len(),
        evaluations: evaluations.sum(),
        memory_mib: studies.iter().map(|s| s.size().needed_mib()).max().unwrap_or(0),
        backend: backends.swap_remove(0),
    })
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
    if !resume {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
        // First: with it, what was broken off can be gone on with.
        write_whole(folder.join(SWEEP_FILE), settings.text().as_bytes())?;
    }
    std::fs::create_dir_all(&studies).map_err(|e| Error::io(&studies, "create", e))?;
    for (number, point) in points.iter().enumerate() {
        write_whole(path_of(number), point.study.as_bytes())?;
    }
    Ok(())
}

/// What runs of a sweep work with.
struct Work<'a> {
    settings: &'a SweepSettings,
    folder: &'a Path,
    points: &'a [Point],
    /// Their studies.
    paths: Vec<PathBuf>,
    memory_limit_mib: u64,
}

impl Work<'_> {
    /// Runs the points that have no row yet, and keeps the rows as they come.
    fn run_points(
        &self,
        rows: &mut Vec<Row>,
        observe: &mut dyn FnMut(&SweepProgress<'_>) -> ControlFlow<()>,
    ) -> Result<()> {
        let (points, paths) = (self.points, &self.paths);
        let of_point = |error, number: usize| {
            self.settings
                .of_point(error, number, &points[number], &paths[number])
        };
        while rows.len() < points.len() {
            let number = rows.len();
            let progress = SweepProgress {
                done: number,
                planned: points.len(),
                point: &points[number],
            };
            if observe(&progress).is_break() {
                return Err(Error::Interrupted(self.folder.to_owned()));
            }
            let told = || observe(&progress);
            let found = match self.settings.study {
                SweptStudy::Identify => {
                    let together = alike(&paths[number..], self.memory_limit_mib);
                    identified(&paths[number..number + together], self.memory_limit_mib, told)
                }
                SweptStudy::Raceline => Ok(vec![lined(&paths[number], self.memory_limit_mib, told)]),
            };
            let found = found.map_err(|e| of_point(e, number))?;
            for (run, found) in (number..).zip(found) {
                // A run that was broken off is no row: it is done anew, as is what comes after it.
                let Some(found) = found.map_err(|e| of_point(e, run))? else {
                    return Err(Error::Interrupted(self.folder.to_owned()));
                };
                // What depends on the clock stands beside the study, and not in the row.
                write_json(&paths[run].with_extension("json"), &found.manifest())?;
                rows.push(Row {
                    run,
                    settings: points[run].settings.clone(),
                    figures: found.figures,
                    device_faults: found.device_faults,
                    front: found.front,
                });
                results::write_rows(&self.folder.join(ROWS), rows)?;
                // Only now: until its row is kept, its state is all there is of it.
                keeper_of(&paths[run]).done()?;
            }
        }
        Ok(())
    }
}

type Figures = BTreeMap<String, Option<f64>>;

/// What a run came to.
struct Found {
    figures: Figures,
    /// The objectives of a front, where there is one.
    front: Vec<Vec<f64>>,
    study: &'static str,
    seed: u64,
    car: String,
    backend: BackendInfo,
    device_faults: Vec<String>,
    longest_dispatch_ms: Option<f64>,
}

impl Found {
    fn manifest(&self) -> Manifest<'_> {
        Manifest {
            device_faults: &self.device_faults,
            longest_dispatch_ms: self.longest_dispatch_ms,
            // Its name is that of the manifest.
            settings: "",
            ..Manifest::new(self.study, self.seed, &self.backend, &self.car)
        }
    }
}

/// What keeps the state of the study at `path`, beside it.
fn keeper_of(path: &Path) -> Keeper {
    Keeper::at(path.with_extension("checkpoint"))
}

/// Whether a state is that of the study that goes on with it.
///
/// # Errors
/// [`Error::Input`] if not.
fn check_own(own: bool, keeper: &Keeper) -> Result<()> {
    if own {
        return Ok(());
    }
    let expected = "the state of this point of the grid";
    Err(Error::input(
        keeper.file(),
        "settings",
        "those of another study",
        expected,
    ))
}

fn lined(
    path: &Path,
    memory_limit_mib: u64,
    mut observe: impl FnMut() -> ControlFlow<()>,
) -> Result<Option<Found>> {
    let settings = RacelineSettings::read(path)?;
    let _allowed = settings.size().check(memory_limit_mib)?;
    let setup = raceline::set_up(&settings)?;
    let outcome = go_on(&mut keeper_of(path), |state: Option<LinesState>, keeper| {
        let own = state.as_ref().is_none_or(|state| state.settings == settings);
        check_own(own, keeper)?;
        raceline::find_lines_from(&settings, &setup, state, keeper, |_| observe())
    })?;
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
    Ok(Some(Found {
        figures,
        front,
        study: "raceline",
        seed: settings.seed,
        car: setup.car_name,
        backend: outcome.backend,
        device_faults: outcome.device_faults,
        longest_dispatch_ms: outcome.longest_dispatch_ms,
    }))
}
