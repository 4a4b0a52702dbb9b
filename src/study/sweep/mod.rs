//! The same study over a grid of settings and seeds: one row for each run, medians over the seeds.
//!
//! A run is a study file of its own, made of the base's keys and those of one point of the grid. Each row is a file of its own
//! too, and the states of the runs that are at work are beside their study files. So rows come in any order, several processes
//! share them, and a sweep that was interrupted goes on where it stopped.

mod grid;
mod joint;
mod page;
mod results;
mod rows;
mod ways;
mod words;

pub use grid::{Point, SweepSettings};
pub use results::{Group, Row, Summary, medians};
pub use rows::{KeptRow, Part, RowsRequest};

use crate::config::read_text;
use crate::config::settings::{Role, Settings};
use crate::error::{Error, Result};
use crate::files::lock::LockFile;
use crate::report::write_whole;
use crate::study::framework::memory::{self, MemoryItem};
use crate::study::framework::state_file::StateFile;
use crate::study::framework::{
    Entry, InputFiles, Manifest, Plan, Progress, Solved, Study, TIME_LIMIT, TimeLimit, write_json,
};
use cpu_time::ProcessTime;
use std::collections::BTreeMap;
use std::ops::{ControlFlow, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// The sweep that a folder holds.
pub const SWEEP_FILE: &str = "sweep.toml";
/// The files that its studies read, each with a sum over it, in the folder of its studies.
const INPUTS: &str = "inputs.json";
/// Most problems whose inputs are kept while a sweep is planned.
const MOST_PREPARED: usize = 16;
/// Time between two looks at rows that other processes are at.
const LOOK: Duration = Duration::from_millis(100);

/// Runs what is left of a sweep in `folder`, which holds nothing yet or, to `resume`, a part of the same sweep; then makes its
/// tables and its page. Runs that are at work at the same time share the [memory that is allowed](memory::limit_mib), which
/// changes no row.
///
/// # Errors
/// Those of [`begin`], [`run_rows`] and [`gather`].
pub fn sweep(
    settings: &SweepSettings,
    folder: &Path,
    resume: bool,
    mut observe: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Summary> {
    if !resume {
        begin(settings, folder)?;
    }
    let all = RowsRequest {
        rows: 0..settings.runs(),
        to_the_end: true,
        time_limit: None,
        stop: Arc::default(),
        observe: &mut observe,
    };
    run_rows(settings, folder, all)?;
    gather(settings, folder)
}

/// Writes a sweep into a folder that holds nothing yet. Every point is read before: a mistake in the last shows at once, and
/// leaves nothing behind.
///
/// # Errors
/// [`Error::Input`] if a point of the grid is no study; [`Error::Io`] if the folder cannot be written.
pub fn begin(settings: &SweepSettings, folder: &Path) -> Result<()> {
    let work = Work::new(settings, folder, folder.join("studies"))?;
    settings.study.check_points(&work)?;
    for made in [&work.studies, &work.rows()] {
        std::fs::create_dir_all(made).map_err(|e| Error::io(made, "create", e))?;
    }
    // With it, others may join, and an interrupted sweep can be resumed.
    write_whole(folder.join(SWEEP_FILE), settings.text().as_bytes())
}

/// Does those of the rows that have no figures yet. Other processes may work on rows in the same folder: no row is done twice.
///
/// # Errors
/// [`Error::Input`] if the folder holds another sweep, there is no such row, or a file that the studies read has changed;
/// [`Error::Interrupted`] if the observer or the flag ended it; those of studies, except for [`Error::Study`], which is the end
/// of one row.
pub fn run_rows(settings: &SweepSettings, folder: &Path, mut asked: RowsRequest<'_>) -> Result<Part> {
    let work = Work::new(settings, folder, folder.join("studies"))?;
    check_same(settings, folder)?;
    let runs = work.points.len();
    asked.rows.end = asked.rows.end.min(runs);
    if asked.rows.is_empty() {
        let found = format!("{}..{}", asked.rows.start, asked.rows.end);
        return Err(Error::input(
            settings.file(),
            "rows",
            found,
            format!("rows of 0..{runs}"),
        ));
    }
    let mut inputs = InputFiles::new(work.studies.join(INPUTS));
    inputs.reopen()?;
    let time_limit = TimeLimit::begin(asked.time_limit, &asked.stop);
    let mut told = |progress: &Progress| match (asked.observe)(progress) {
        ControlFlow::Continue(()) if time_limit.is_over() => ControlFlow::Break(()),
        flow => flow,
    };
    let rows = asked.rows.clone();
    let request = RowsRequest {
        observe: &mut told,
        ..asked
    };
    let ran = settings.study.run_points(&work, &mut inputs, request);
    let (elsewhere, ended_by) = match ran {
        Ok(elsewhere) => (elsewhere, None),
        Err(Error::Interrupted(_)) if time_limit.has_ended_it() => (Vec::new(), Some(TIME_LIMIT.to_owned())),
        Err(error) => {
            work.clear_away(&error);
            return Err(error);
        }
    };
    let there = work.rows_within(rows.clone())?;
    Ok(Part {
        study: "sweep",
        rows,
        finished: there.values().filter(|kept| !kept.failed()).count(),
        failed_runs: rows::failures(there.values()),
        elsewhere,
        ended_by,
    })
}

/// Makes the tables and the page of all rows that are there.
///
/// # Errors
/// [`Error::Input`] if the folder holds another sweep, or a row in it is none; [`Error::Io`] if a file cannot be written.
pub fn gather(settings: &SweepSettings, folder: &Path) -> Result<Summary> {
    check_same(settings, folder)?;
    let work = Work::new(settings, folder, folder.join("studies"))?;
    let kept = work.rows_within(0..work.points.len())?;
    let failed_runs = rows::failures(kept.values());
    let finished = kept.into_values().filter(|kept| !kept.failed());
    let mut finished: Vec<KeptRow> = finished.collect();
    results::write_rows(folder, &finished)?;
    let missing = work.points.len() - finished.len() - failed_runs.len();
    joint::compare(&mut finished, &settings.study.problems(&work)?)?;
    let summary = Summary::new(&finished, failed_runs, missing);
    summary.write(folder, settings, &finished)?;
    Ok(summary)
}

/// The rows that a folder has of a sweep, by their numbers.
///
/// # Errors
/// [`Error::Input`] if the folder holds another sweep, or a row in it is none.
pub fn kept_rows(settings: &SweepSettings, folder: &Path) -> Result<BTreeMap<usize, KeptRow>> {
    check_same(settings, folder)?;
    let work = Work::new(settings, folder, folder.join("studies"))?;
    work.rows_within(0..work.points.len())
}

/// Refuses a folder that holds another sweep.
fn check_same(settings: &SweepSettings, folder: &Path) -> Result<()> {
    let file = folder.join(SWEEP_FILE);
    if read_text(&file)? == settings.text() {
        return Ok(());
    }
    let expected = "the sweep that the folder holds";
    Err(Error::input(file, "resume", "another sweep", expected))
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

impl Work<'_> {
    /// Reads the studies of these points, and refuses what is wrong or too large.
    fn read<S: Study>(&self, rows: Range<usize>) -> Result<Vec<S::Settings>> {
        let read = |number: usize| {
            let text = &self.points[number].study;
            let study = S::Settings::parse(&self.path_of(number), text, self.sweep.folder());
            let study = study
                .map(Settings::absolute)
                .map_err(|e| self.of_point(e, number))?;
            self.check(&S::size(&study, None), number).map(|_| study)
        };
        rows.map(read).collect()
    }

    /// Whether any run has left a state.
    fn has_states(&self) -> bool {
        (0..self.points.len()).any(|number| self.state_file_of(number).file().exists())
    }

    /// What has come to nothing does not stand in the way of the next sweep; what was interrupted may be resumed, and so may
    /// what a full disk or a lost device has ended.
    fn clear_away(&self, error: &Error) {
        let mendable = match error {
            Error::Interrupted(_) => true,
            Error::Io { .. } | Error::Device(_) | Error::NoDevice(_) => self.has_states(),
            _ => false,
        };
        // A folder goes only if it is empty: not with rows, nor with claims of other processes.
        if !mendable && std::fs::remove_dir(self.rows()).is_ok() {
            let _ = std::fs::remove_dir_all(&self.studies);
            let _ = std::fs::remove_file(self.folder.join(SWEEP_FILE));
        }
    }
}

/// A kind of study that can be swept: all of those in the registry.
pub trait Swept: Sync {
    /// Refuses points whose study is wrong or too large.
    ///
    /// # Errors
    /// [`Error::Input`] naming the point.
    fn check_points(&self, work: &Work<'_>) -> Result<()>;

    /// Which problem each point is of: points that only search in another way, or elsewhere, share a number.
    ///
    /// # Errors
    /// [`Error::Input`] naming a point that is wrong.
    fn problems(&self, work: &Work<'_>) -> Result<Vec<usize>>;

    /// Says what a sweep over these points would do; see [`plan`].
    ///
    /// # Errors
    /// As [`plan`].
    fn plan_points(&self, work: &Work<'_>) -> Result<SweepPlan>;

    /// Does what [`run_rows`] says, and tells which rows other processes were at.
    ///
    /// # Errors
    /// As [`run_rows`].
    fn run_points(
        &self,
        work: &Work<'_>,
        inputs: &mut InputFiles,
        asked: RowsRequest<'_>,
    ) -> Result<Vec<usize>>;
}

/// The problem that a study solves: what only the search goes by is left out.
fn problem_of<S: Study>(settings: &S::Settings) -> S::Settings {
    settings
        .clone()
        .with_role_of(Role::Search, &S::Settings::default())
}

/// How many of the `next` studies, from the first on, are of one problem with `first` and may be solved together with it within
/// the memory (MiB).
fn alike<S: Study>(
    first: &S::Settings,
    next: &[S::Settings],
    prepared: &S::Prepared,
    memory_limit_mib: u64,
) -> usize {
    let problem = problem_of::<S>(first);
    let like = |settings: &&S::Settings| S::together(settings) > 1 && problem_of::<S>(settings) == problem;
    let mut kept = S::size(first, Some(prepared));
    let fits = |settings: &&S::Settings| {
        // What was prepared is one for all of them.
        kept.extend(S::size(settings, None));
        memory::fits(&kept, memory_limit_mib)
    };
    next.iter().take_while(like).take_while(fits).count()
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
        work.read::<S>(0..work.points.len()).map(drop)
    }

    fn problems(&self, work: &Work<'_>) -> Result<Vec<usize>> {
        let mut known: Vec<S::Settings> = Vec::new();
        let number = |settings: &S::Settings| {
            let problem = problem_of::<S>(settings).with_role_of(Role::Place, &S::Settings::default());
            known.iter().position(|k| *k == problem).unwrap_or_else(|| {
                known.push(problem);
                known.len() - 1
            })
        };
        let studies = work.read::<S>(0..work.points.len())?;
        Ok(studies.iter().map(number).collect())
    }

    fn plan_points(&self, work: &Work<'_>) -> Result<SweepPlan> {
        let mut problems: Vec<S::Settings> = Vec::new();
        let mut known = Known::<S>(Vec::new());
        let mut first: Option<Plan> = None;
        let (mut evaluations, mut polish_drives, mut memory_mib) = (Some(0u64), 0u64, 0);
        for (number, settings) in work.read::<S>(0..work.points.len())?.iter().enumerate() {
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
            polish_drives = polish_drives.saturating_add(plan.most_polish_drives());
            memory_mib = memory_mib.max(memory::needed_mib(&kept));
            first.get_or_insert(plan);
        }
        let no_point = || Error::input("the sweep", "grid", "no point", "one point at least");
        Ok(SweepPlan {
            runs: work.points.len(),
            problems: problems.len(),
            evaluations,
            polish_drives,
            memory_mib,
            plan: first.ok_or_else(no_point)?,
        })
    }

    fn run_points(
        &self,
        work: &Work<'_>,
        files: &mut InputFiles,
        asked: RowsRequest<'_>,
    ) -> Result<Vec<usize>> {
        let rows = asked.rows.clone();
        let studies = files.noted(|| work.read::<S>(rows.clone()))?;
        let study_of = |number: usize| &studies[number - rows.start];
        // One that failed before is tried again, once.
        let before = work.rows_within(rows.clone())?;
        let is_left = |number: &usize| before.get(number).is_none_or(KeptRow::failed);
        let mut left: Vec<usize> = rows.clone().filter(is_left).collect();
        let mut done = rows.len() - left.len();
        let mut known = Known::<S>(Vec::new());
        loop {
            let mut elsewhere = Vec::new();
            let mut at = 0;
            while let Some(&number) = left.get(at) {
                let point = work.points[number].settings.iter();
                let point: Vec<String> = point.map(|(key, value)| format!("{key} {value}")).collect();
                let progress = Progress {
                    stage: "runs".to_owned(),
                    done: done as u64,
                    planned: Some(rows.len() as u64),
                    reached: point.join(", "),
                };
                if (asked.observe)(&progress).is_break() {
                    return Err(Error::Interrupted(work.folder.to_owned()));
                }
                at += 1;
                let Some(claim) = work.claim(number)? else {
                    elsewhere.push(number);
                    continue;
                };
                if work.is_done(number, before.get(&number))? {
                    done += 1;
                    continue;
                }
                let inputs = match files.noted(|| known.of(study_of(number), 1)) {
                    Err(error @ Error::Study(_)) => {
                        work.keep(&work.failed(number, &error))?;
                        done += 1;
                        continue;
                    }
                    inputs => inputs.map_err(|e| work.of_point(e, number))?,
                };
                let next = left[at..].iter().take(S::together(study_of(number)) - 1);
                let next: Vec<S::Settings> = next.map(|n| study_of(*n).clone()).collect();
                let mut group = Together::<S> {
                    claims: vec![claim],
                    numbers: vec![number],
                    studies: vec![study_of(number).clone()],
                };
                let mates = alike::<S>(study_of(number), &next, inputs, work.memory_limit_mib);
                for (mate, study) in left[at..].iter().zip(next).take(mates) {
                    match work.claim(*mate)? {
                        Some(claim) if !work.is_done(*mate, before.get(mate))? => {
                            group.claims.push(claim);
                            group.numbers.push(*mate);
                            group.studies.push(study);
                        }
                        _ => break,
                    }
                }
                let count = group.numbers.len();
                group.run(work, inputs, &asked.stop, &mut |_| (asked.observe)(&progress))?;
                done += count;
                at += count - 1;
            }
            if elsewhere.is_empty() || !asked.to_the_end {
                return Ok(elsewhere);
            }
            std::thread::sleep(LOOK);
            left = elsewhere;
        }
    }
}

/// Runs that are solved together.
struct Together<S: Study> {
    /// Held until their rows are kept.
    claims: Vec<LockFile>,
    numbers: Vec<usize>,
    studies: Vec<S::Settings>,
}

impl<S: Study> Together<S> {
    /// Solves them, and keeps their rows.
    fn run(
        self,
        work: &Work<'_>,
        prepared: &S::Prepared,
        stop: &Arc<AtomicBool>,
        observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<()> {
        let (numbers, studies) = (&self.numbers, &self.studies);
        for (number, study) in numbers.iter().zip(studies) {
            write_whole(work.path_of(*number), study.to_toml().as_bytes())?;
        }
        let mut kept: Vec<MemoryItem> = S::size(&studies[0], Some(prepared));
        kept.extend(studies[1..].iter().flat_map(|settings| S::size(settings, None)));
        let _allowed = work.check(&kept, numbers[0])?;
        let state_files = numbers.iter().map(|number| work.state_file_of(*number));
        let mut state_files: Vec<StateFile> = state_files.collect();
        let (began, processor) = (Instant::now(), ProcessTime::now());
        let found = S::solve_together(studies, prepared, &mut state_files, observe, stop);
        let found = found.map_err(|e| work.of_point(e, numbers[0]))?;
        let processor_s = processor.elapsed().as_secs_f64();
        let mut ended = Ok(());
        for ((number, settings), outcome) in numbers.iter().zip(studies).zip(found) {
            let mut kept = work.empty_row(*number);
            match outcome {
                Ok(Some(outcome)) if !S::record(&outcome).interrupted => {
                    let solved = Solved::<S> {
                        settings,
                        prepared,
                        outcome: &outcome,
                    };
                    let manifest = Manifest::new(solved.head(), "");
                    write_json(&work.path_of(*number).with_extension("json"), &manifest)?;
                    let summary = S::summarise(&solved);
                    kept.row.figures = S::figures(&outcome, &summary);
                    kept.row
                        .device_faults
                        .clone_from(&S::record(&outcome).device_faults);
                    kept.searched = S::searched(&solved);
                    kept.row.front = std::mem::take(&mut kept.searched.front);
                    // Runs that go together end together.
                    kept.elapsed_s = S::record(&outcome).elapsed_s / numbers.len() as f64;
                    kept.processor_elapsed_s = processor_s / numbers.len() as f64;
                    kept.log.clone_from(&kept.row.device_faults);
                    kept.log.extend(S::warnings(&summary));
                    if let Err(missed) = S::verdict(settings, &summary) {
                        kept.exit_code = missed.exit_code();
                        kept.log.push(missed.to_string());
                    }
                    work.keep(&kept)?;
                }
                // An interrupted run is no row: it is resumed.
                Ok(_) | Err(Error::Interrupted(_)) => {
                    ended = ended.and(Err(Error::Interrupted(work.folder.to_owned())));
                }
                Err(error @ Error::Study(_)) => {
                    let elapsed_s = began.elapsed().as_secs_f64();
                    work.keep(&KeptRow {
                        elapsed_s,
                        ..work.failed(*number, &error)
                    })?;
                }
                Err(error) => ended = ended.and(Err(work.of_point(error, *number))),
            }
        }
        ended
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
    /// Cars driven after them at the most, to polish what they found.
    pub polish_drives: u64,
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
