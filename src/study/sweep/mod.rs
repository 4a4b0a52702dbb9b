//! The same study over a grid of settings and seeds: one row for each run, medians over the seeds.
//!
//! A run is a study file of its own, made of the base's keys and those of one point of the grid. Rows are kept as they
//! come, and the states of the runs that are at work beside their study files, so that a sweep that was interrupted goes on where
//! it stopped; rows hold nothing that depends on the clock.

mod grid;
mod joint;
mod page;
mod results;

pub use grid::{Point, SweepSettings};
pub use results::{Row, Summary, medians};

use crate::config::settings::{Role, Settings};
use crate::error::{Error, Result};
use crate::report::write_whole;
use crate::study::framework::memory::{self, Kept, USUAL_MIB};
use crate::study::framework::run_folder::{Manifest, write_json};
use crate::study::framework::state_file::StateFile;
use crate::study::framework::{Entry, Plan, Progress, Study};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Rows of a sweep as they are kept, one JSON object per line.
const ROWS: &str = "rows.jsonl";
/// The sweep that a folder holds.
pub const SWEEP_FILE: &str = "sweep.toml";
/// Most problems whose inputs are kept while a sweep is planned.
const MOST_PREPARED: usize = 16;

/// What an observer is told before each run.
pub struct SweepProgress<'a> {
    /// Runs done.
    pub done: usize,
    /// Runs in all.
    pub planned: usize,
    /// The point of the grid.
    pub point: &'a Point,
}

/// Is told of the progress of a sweep and may end it.
type Observer<'a> = dyn FnMut(&SweepProgress<'_>) -> ControlFlow<()> + 'a;

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
    settings
        .study
        .check_points(settings, &points, &path_of, memory_limit_mib)?;
    let mut rows = if resume {
        results::read_rows(&folder.join(ROWS), &folder.join(SWEEP_FILE), settings, &points)?
    } else {
        Vec::new()
    };
    let began_with = rows.len();
    let ran = write_studies(settings, folder, &points, path_of, resume).and_then(|()| {
        let work = Work {
            sweep: settings,
            folder,
            points: &points,
            paths: (0..points.len()).map(path_of).collect(),
            memory_limit_mib,
        };
        settings.study.run_points(&work, &mut rows, &mut observe)
    });
    if let Err(error) = ran {
        // What has come to nothing does not stand in the way of the next; what was interrupted may be resumed.
        // So may what a full disk or a lost device has ended.
        let begun = || (0..points.len()).any(|number| state_file_of(&path_of(number)).file().exists());
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

/// A kind of study that can be swept: all of those in the registry.
pub trait Swept: Sync {
    /// Refuses points whose study is wrong or too large.
    ///
    /// # Errors
    /// [`Error::Input`] naming the point.
    fn check_points(
        &self,
        sweep: &SweepSettings,
        points: &[Point],
        path_of: &dyn Fn(usize) -> PathBuf,
        memory_limit_mib: u64,
    ) -> Result<()>;

    /// Says what a sweep over these points would do; see [`plan`].
    ///
    /// # Errors
    /// As [`plan`].
    fn plan_points(
        &self,
        sweep: &SweepSettings,
        points: &[Point],
        path_of: &dyn Fn(usize) -> PathBuf,
        memory_limit_mib: u64,
    ) -> Result<SweepPlan>;

    /// Runs the points that have no row yet, and keeps the rows as they come.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if the observer ended it; those of the studies.
    fn run_points(&self, work: &Work<'_>, rows: &mut Vec<Row>, observe: &mut Observer<'_>) -> Result<()>;
}

/// Reads the study of every point, and refuses what is wrong or too large.
fn read_points<S: Study>(
    sweep: &SweepSettings,
    points: &[Point],
    path_of: &dyn Fn(usize) -> PathBuf,
    memory_limit_mib: u64,
) -> Result<Vec<S::Settings>> {
    let read = |(number, point): (usize, &Point)| {
        let path = path_of(number);
        let study = S::Settings::parse(&path, &point.study).map(Settings::absolute);
        study
            .and_then(|study| memory::check(&S::size(&study, None), memory_limit_mib).map(|_| study))
            .map_err(|e| sweep.of_point(e, number, point, &path))
    };
    points.iter().enumerate().map(read).collect()
}

/// The problem that a study solves: what only the search goes by is left out.
fn problem_of<S: Study>(settings: &S::Settings) -> S::Settings {
    settings
        .clone()
        .with_role_of(Role::Search, &S::Settings::default())
}

/// How many studies, from the first on, are of one problem and may be solved together within the memory (MiB); the first in any
/// case.
fn alike<S: Study>(studies: &[S::Settings], prepared: &S::Prepared, memory_limit_mib: u64) -> usize {
    let Some(first) = studies.first() else {
        return 0;
    };
    let problem = problem_of::<S>(first);
    let like = |settings: &&S::Settings| S::together(settings) > 1 && problem_of::<S>(settings) == problem;
    let together = studies[1..].iter().take(S::together(first) - 1).take_while(like);
    let mut kept = S::size(first, Some(prepared));
    let fits = |settings: &&S::Settings| {
        // What was prepared is one for all of them.
        kept.extend(S::size(settings, None));
        memory::fits(&kept, memory_limit_mib)
    };
    1 + together.take_while(fits).count()
}

impl<S: Study> Swept for Entry<S> {
    fn check_points(
        &self,
        sweep: &SweepSettings,
        points: &[Point],
        path_of: &dyn Fn(usize) -> PathBuf,
        memory_limit_mib: u64,
    ) -> Result<()> {
        read_points::<S>(sweep, points, path_of, memory_limit_mib).map(drop)
    }

    fn plan_points(
        &self,
        sweep: &SweepSettings,
        points: &[Point],
        path_of: &dyn Fn(usize) -> PathBuf,
        memory_limit_mib: u64,
    ) -> Result<SweepPlan> {
        let studies = read_points::<S>(sweep, points, path_of, memory_limit_mib)?;
        let mut problems: Vec<S::Settings> = Vec::new();
        let mut prepared: Vec<(S::Settings, S::Prepared)> = Vec::new();
        let mut planned: Option<SweepPlan> = None;
        for (number, settings) in studies.iter().enumerate() {
            let of_point = |e| sweep.of_point(e, number, &points[number], &path_of(number));
            let problem = problem_of::<S>(settings);
            if !problems.contains(&problem) {
                problems.push(problem.clone());
            }
            let place = match prepared.iter().position(|(known, _)| *known == problem) {
                Some(place) => place,
                None => {
                    prepared.truncate(MOST_PREPARED - 1);
                    prepared.insert(0, (problem, S::prepare(settings).map_err(of_point)?));
                    0
                }
            };
            let inputs = &prepared[place].1;
            let kept = S::size(settings, Some(inputs));
            drop(memory::check(&kept, memory_limit_mib).map_err(of_point)?);
            let plan = S::plan(settings, inputs, Plan::of(S::NAME, settings)).map_err(of_point)?;
            let memory_mib = memory::needed_mib(&kept);
            planned = Some(match planned {
                None => SweepPlan {
                    runs: points.len(),
                    problems: 0,
                    evaluations: plan.most_evaluations(),
                    memory_mib,
                    plan,
                },
                Some(before) => SweepPlan {
                    evaluations: before
                        .evaluations
                        .zip(plan.most_evaluations())
                        .map(|(all, more)| all.saturating_add(more)),
                    memory_mib: before.memory_mib.max(memory_mib),
                    ..before
                },
            });
        }
        let problems = problems.len();
        let planned = planned.map(|plan| SweepPlan { problems, ..plan });
        planned.ok_or_else(|| Error::input("the sweep", "grid", "no point", "one point at least"))
    }

    fn run_points(&self, work: &Work<'_>, rows: &mut Vec<Row>, observe: &mut Observer<'_>) -> Result<()> {
        let (points, paths) = (work.points, &work.paths);
        let of_point = |e, number: usize| work.sweep.of_point(e, number, &points[number], &paths[number]);
        let path_of = |number: usize| paths[number].clone();
        let studies = read_points::<S>(work.sweep, points, &path_of, work.memory_limit_mib)?;
        let mut prepared: Option<(S::Settings, S::Prepared)> = None;
        while rows.len() < points.len() {
            let number = rows.len();
            let progress = SweepProgress {
                done: number,
                planned: points.len(),
                point: &points[number],
            };
            if observe(&progress).is_break() {
                return Err(Error::Interrupted(work.folder.to_owned()));
            }
            let problem = problem_of::<S>(&studies[number]);
            let known = prepared.take().filter(|(known, _)| *known == problem);
            let (problem, inputs) = match known {
                Some(known) => known,
                None => {
                    let inputs = S::prepare(&studies[number]).map_err(|e| of_point(e, number))?;
                    (problem, inputs)
                }
            };
            let together = alike::<S>(&studies[number..], &inputs, work.memory_limit_mib);
            let chosen = &studies[number..number + together];
            let mut kept: Vec<Kept> = S::size(&chosen[0], Some(&inputs));
            kept.extend(chosen[1..].iter().flat_map(|settings| S::size(settings, None)));
            let _allowed = memory::check(&kept, work.memory_limit_mib).map_err(|e| of_point(e, number))?;
            let mut state_files: Vec<StateFile> = (number..number + together)
                .map(|number| state_file_of(&paths[number]))
                .collect();
            let mut told = |_: &Progress| observe(&progress);
            let found = S::solve_together(chosen, &inputs, &mut state_files, &mut told);
            let found = found.map_err(|e| of_point(e, number))?;
            for ((run, settings), outcome) in (number..).zip(chosen).zip(found) {
                // An interrupted run is no row: it is resumed, as is what comes after it.
                let outcome = outcome.map_err(|e| of_point(e, run))?;
                let Some(outcome) = outcome.filter(|outcome| !S::record(outcome).interrupted) else {
                    return Err(Error::Interrupted(work.folder.to_owned()));
                };
                let record = S::record(&outcome);
                // What depends on the clock stands beside the study, and not in the row.
                let subject = S::subject(settings, &inputs);
                let manifest = Manifest::new(S::NAME, &subject, record, "");
                write_json(&paths[run].with_extension("json"), &manifest)?;
                let summary = S::summarise(settings, &inputs, &outcome);
                rows.push(Row {
                    run,
                    settings: points[run].settings.clone(),
                    figures: S::figures(&outcome, &summary),
                    device_faults: record.device_faults.clone(),
                    front: S::front(&outcome),
                });
                results::write_rows(&work.folder.join(ROWS), rows)?;
                // Only now: until its row is kept, its state is all there is of it.
                state_file_of(&paths[run]).done()?;
            }
            prepared = Some((problem, inputs));
        }
        Ok(())
    }
}

/// What a sweep would do.
#[derive(Clone)]
pub struct SweepPlan {
    /// Runs.
    pub runs: usize,
    /// Different problems among them, each of which has been set up.
    pub problems: usize,
    /// Cars driven by all swarms at the most; none where the studies find out how many.
    pub evaluations: Option<u64>,
    /// What the largest study keeps (MiB).
    pub memory_mib: u64,
    /// The plan of the first study.
    pub plan: Plan,
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
    settings
        .study
        .plan_points(settings, &points, &path_of, memory_limit_mib)
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
        // First: with it, an interrupted sweep can be resumed.
        write_whole(folder.join(SWEEP_FILE), settings.text().as_bytes())?;
    }
    std::fs::create_dir_all(&studies).map_err(|e| Error::io(&studies, "create", e))?;
    for (number, point) in points.iter().enumerate() {
        write_whole(path_of(number), point.study.as_bytes())?;
    }
    Ok(())
}

/// What runs of a sweep work with.
pub struct Work<'a> {
    sweep: &'a SweepSettings,
    folder: &'a Path,
    points: &'a [Point],
    /// Their studies.
    paths: Vec<PathBuf>,
    memory_limit_mib: u64,
}

/// What keeps the state of the study at `path`, beside it.
fn state_file_of(path: &Path) -> StateFile {
    StateFile::at(path.with_extension("checkpoint"))
}
