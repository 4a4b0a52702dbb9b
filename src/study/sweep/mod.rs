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
use crate::evaluate::portions::Allowance;
use crate::report::write_whole;
use crate::study::framework::memory::{self, MemoryItem};
use crate::study::framework::state_file::StateFile;
use crate::study::framework::{Entry, InputFiles, Manifest, Plan, Progress, Solved, Study, write_json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Rows of a sweep as they are kept, one JSON object per line.
const ROWS: &str = "rows.jsonl";
/// The sweep that a folder holds.
pub const SWEEP_FILE: &str = "sweep.toml";
/// The files that its studies read, each with a sum over it, in the folder of its studies.
const INPUTS: &str = "inputs.json";
/// Most problems whose inputs are kept while a sweep is planned.
const MOST_PREPARED: usize = 16;

/// Is told of the progress of a sweep before each run and while it works, and may end it.
type Observer<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + 'a;

/// Runs what is left of a sweep in `folder`, which holds nothing yet or, to `resume`, a part of the same sweep. Runs that are
/// at work at the same time share the [memory that is allowed](memory::limit_mib), which changes no row.
///
/// # Errors
/// [`Error::Input`] if the folder holds another sweep, a file that its studies read has changed, or a point of the grid is no
/// study; [`Error::Interrupted`] if the observer broke the sweep off; those of the studies.
pub fn sweep(
    settings: &SweepSettings,
    folder: &Path,
    resume: bool,
    mut observe: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Summary> {
    let work = Work::new(settings, folder, folder.join("studies"))?;
    let mut inputs = InputFiles::new(work.studies.join(INPUTS));
    // Every point is read before anything is written: a mistake in the last shows at once, and leaves nothing behind.
    settings.study.check_points(&work)?;
    let mut rows = if resume {
        results::read_rows(
            &folder.join(ROWS),
            &folder.join(SWEEP_FILE),
            settings,
            &work.points,
        )?
    } else {
        Vec::new()
    };
    if resume {
        inputs.reopen()?;
    }
    let began_with = rows.len();
    let ran = work.create(resume);
    let ran = ran.and_then(|()| {
        let study = settings.study;
        study.run_points(&work, &mut inputs, &mut rows, &mut observe)
    });
    if let Err(error) = ran {
        // What has come to nothing does not stand in the way of the next; what was interrupted may be resumed.
        // So may what a full disk or a lost device has ended.
        let begun = || (0..work.points.len()).any(|number| work.state_file_of(number).file().exists());
        let mendable = match &error {
            Error::Interrupted(_) => true,
            Error::Io { .. } | Error::Device(_) | Error::NoDevice(_) => begun(),
            _ => false,
        };
        if !resume && rows.len() == began_with && !mendable {
            let _ = std::fs::remove_dir_all(&work.studies);
            let _ = std::fs::remove_file(folder.join(SWEEP_FILE));
        }
        return Err(error);
    }
    let summary = Summary::new(rows)?;
    summary.write(folder, settings)?;
    Ok(summary)
}

/// Reads every point, sets up every problem among them, and runs none.
///
/// # Errors
/// Those that [`sweep`] would have before its runs begin, and those of the problems.
pub fn plan(settings: &SweepSettings) -> Result<SweepPlan> {
    let work = Work::new(settings, Path::new(""), PathBuf::new())?;
    settings.study.plan_points(&work)
}

/// What runs of a sweep work with.
pub struct Work<'a> {
    sweep: &'a SweepSettings,
    folder: &'a Path,
    /// The folder of their studies.
    studies: PathBuf,
    points: Vec<Point>,
    memory_limit_mib: u64,
}

impl<'a> Work<'a> {
    fn new(sweep: &'a SweepSettings, folder: &'a Path, studies: PathBuf) -> Result<Self> {
        Ok(Self {
            points: sweep.points()?,
            sweep,
            folder,
            studies,
            memory_limit_mib: memory::limit_mib(),
        })
    }

    /// The study of a point.
    fn path_of(&self, number: usize) -> PathBuf {
        self.studies.join(format!("{number:05}.toml"))
    }

    /// What keeps the state of a study, beside it.
    fn state_file_of(&self, number: usize) -> StateFile {
        StateFile::at(self.path_of(number).with_extension("checkpoint"))
    }

    /// An error in the study of a point, said of the sweep.
    fn of_point(&self, error: Error, number: usize) -> Error {
        let point = &self.points[number];
        self.sweep.of_point(error, number, point, &self.path_of(number))
    }

    /// Refuses what needs more memory than is allowed.
    fn check(&self, kept: &[MemoryItem], number: usize) -> Result<Allowance> {
        memory::check(kept, self.memory_limit_mib).map_err(|e| self.of_point(e, number))
    }

    /// Reads the study of every point, and refuses what is wrong or too large.
    fn read<S: Study>(&self) -> Result<Vec<S::Settings>> {
        let read = |(number, point): (usize, &Point)| {
            let study = S::Settings::parse(&self.path_of(number), &point.study, self.sweep.folder());
            let study = study
                .map(Settings::absolute)
                .map_err(|e| self.of_point(e, number))?;
            self.check(&S::size(&study, None), number).map(|_| study)
        };
        self.points.iter().enumerate().map(read).collect()
    }

    /// Writes the sweep, and makes the folder of its studies.
    fn create(&self, resume: bool) -> Result<()> {
        let (folder, studies) = (self.folder, &self.studies);
        if !resume {
            std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
            // First: with it, an interrupted sweep can be resumed.
            write_whole(folder.join(SWEEP_FILE), self.sweep.text().as_bytes())?;
        }
        std::fs::create_dir_all(studies).map_err(|e| Error::io(studies, "create", e))
    }
}

/// A kind of study that can be swept: all of those in the registry.
pub trait Swept: Sync {
    /// Refuses points whose study is wrong or too large.
    ///
    /// # Errors
    /// [`Error::Input`] naming the point.
    fn check_points(&self, work: &Work<'_>) -> Result<()>;

    /// Says what a sweep over these points would do; see [`plan`].
    ///
    /// # Errors
    /// As [`plan`].
    fn plan_points(&self, work: &Work<'_>) -> Result<SweepPlan>;

    /// Runs the points that have no row yet, and keeps the rows as they come.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if the observer ended it; those of the studies.
    fn run_points(
        &self,
        work: &Work<'_>,
        inputs: &mut InputFiles,
        rows: &mut Vec<Row>,
        observe: &mut Observer<'_>,
    ) -> Result<()>;
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

/// Problems that have been set up, the last first.
struct Known<S: Study>(Vec<(S::Settings, S::Prepared)>);

impl<S: Study> Known<S> {
    /// The inputs of a study; no more than so many problems are kept.
    fn of(&mut self, settings: &S::Settings, most: usize) -> Result<&S::Prepared> {
        let problem = problem_of::<S>(settings);
        let known = self.0.iter().position(|(known, _)| *known == problem);
        let place = known.unwrap_or(0);
        if known.is_none() {
            self.0.truncate(most - 1);
            self.0.insert(0, (problem, S::prepare(settings)?));
        }
        Ok(&self.0[place].1)
    }
}

impl<S: Study> Swept for Entry<S> {
    fn check_points(&self, work: &Work<'_>) -> Result<()> {
        work.read::<S>().map(drop)
    }

    fn plan_points(&self, work: &Work<'_>) -> Result<SweepPlan> {
        let mut problems: Vec<S::Settings> = Vec::new();
        let mut known = Known::<S>(Vec::new());
        let mut first: Option<Plan> = None;
        let (mut evaluations, mut memory_mib) = (Some(0u64), 0);
        for (number, settings) in work.read::<S>()?.iter().enumerate() {
            let of_point = |e| work.of_point(e, number);
            let problem = problem_of::<S>(settings);
            if !problems.contains(&problem) {
                problems.push(problem);
            }
            let inputs = known.of(settings, MOST_PREPARED).map_err(of_point)?;
            let kept = S::size(settings, Some(inputs));
            drop(work.check(&kept, number)?);
            let plan = S::plan(settings, inputs, Plan::of(S::NAME, settings)).map_err(of_point)?;
            let both = evaluations.zip(plan.most_evaluations());
            evaluations = both.map(|(all, more)| all.saturating_add(more));
            memory_mib = memory_mib.max(memory::needed_mib(&kept));
            first.get_or_insert(plan);
        }
        let no_point = || Error::input("the sweep", "grid", "no point", "one point at least");
        Ok(SweepPlan {
            runs: work.points.len(),
            problems: problems.len(),
            evaluations,
            memory_mib,
            plan: first.ok_or_else(no_point)?,
        })
    }

    fn run_points(
        &self,
        work: &Work<'_>,
        files: &mut InputFiles,
        rows: &mut Vec<Row>,
        observe: &mut Observer<'_>,
    ) -> Result<()> {
        let points = &work.points;
        let studies = files.noted(|| work.read::<S>())?;
        for (number, study) in studies.iter().enumerate() {
            write_whole(work.path_of(number), study.to_toml().as_bytes())?;
        }
        let mut known = Known::<S>(Vec::new());
        while rows.len() < points.len() {
            let number = rows.len();
            let point = points[number].settings.iter();
            let point: Vec<String> = point.map(|(key, value)| format!("{key} {value}")).collect();
            let progress = Progress {
                stage: "runs".to_owned(),
                done: number as u64,
                planned: Some(points.len() as u64),
                reached: point.join(", "),
            };
            if observe(&progress).is_break() {
                return Err(Error::Interrupted(work.folder.to_owned()));
            }
            let inputs = files.noted(|| known.of(&studies[number], 1));
            let inputs = inputs.map_err(|e| work.of_point(e, number))?;
            let together = alike::<S>(&studies[number..], inputs, work.memory_limit_mib);
            let chosen = &studies[number..number + together];
            let mut kept: Vec<MemoryItem> = S::size(&chosen[0], Some(inputs));
            kept.extend(chosen[1..].iter().flat_map(|settings| S::size(settings, None)));
            let _allowed = work.check(&kept, number)?;
            let state_files = (number..number + together).map(|number| work.state_file_of(number));
            let mut state_files: Vec<StateFile> = state_files.collect();
            let mut told = |_: &Progress| observe(&progress);
            let found = S::solve_together(chosen, inputs, &mut state_files, &mut told);
            let found = found.map_err(|e| work.of_point(e, number))?;
            for ((run, settings), outcome) in (number..).zip(chosen).zip(found) {
                // An interrupted run is no row: it is resumed, as is what comes after it.
                let outcome = outcome.map_err(|e| work.of_point(e, run))?;
                let Some(outcome) = outcome.filter(|outcome| !S::record(outcome).interrupted) else {
                    return Err(Error::Interrupted(work.folder.to_owned()));
                };
                let solved = Solved::<S> {
                    settings,
                    prepared: inputs,
                    outcome: &outcome,
                };
                // What depends on the clock stands beside the study, and not in the row.
                let manifest = Manifest::new(solved.head(), "");
                write_json(&work.path_of(run).with_extension("json"), &manifest)?;
                let summary = S::summarise(&solved);
                rows.push(Row {
                    run,
                    settings: points[run].settings.clone(),
                    figures: S::figures(&outcome, &summary),
                    device_faults: S::record(&outcome).device_faults.clone(),
                    front: S::front(&outcome),
                });
                results::write_rows(&work.folder.join(ROWS), rows)?;
                // Only now: until its row is kept, its state is all there is of it.
                work.state_file_of(run).done()?;
            }
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
