//! The life of a study: from a request to files and figures.

use super::state_file::StateFile;
use super::study::{apply, moves};
use super::{Manifest, Plan, Progress, Solved, State, Study, Work, memory, write_json, write_study};
use crate::config::limit_memory;
use crate::config::settings::{Role, Settings};
use crate::error::{Error, Result};
use crate::files::run_folder::{self, MANIFEST, RunFolder, SETTINGS, STATE, SUMMARY};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What is asked of a study.
pub struct Request<'a> {
    /// A study file, if there is one.
    pub file: Option<&'a Path>,
    /// The text of one in its place, and its name in messages; paths in it are relative to the working folder.
    pub text: Option<(&'a str, &'a Path)>,
    /// Keys of settings and what flags say of them, over the file.
    pub flags: &'a [(String, String)],
    /// The run folder; the next free one where not given.
    pub out: Option<&'a Path>,
    /// Whether the interrupted run in that folder is resumed.
    pub resume: bool,
    /// Time between saves of the state.
    pub save_every: Duration,
    /// Time after which the study is to end with what it has.
    pub time_limit: Option<Duration>,
    /// Memory that the study may take (MiB).
    pub memory_limit_mib: u64,
    /// Whether the study is planned only.
    pub dry_run: bool,
    /// Raised when the study is to end.
    pub stop: Arc<AtomicBool>,
    /// Is told of the progress and may end the study.
    pub observe: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
}

/// What comes of a request.
pub enum Answer {
    /// What would be done.
    Planned(Plan),
    /// What was done.
    Finished(Finished),
}

/// A study that has ended.
pub struct Finished {
    /// Where its files are.
    pub folder: PathBuf,
    /// Its figures in words.
    pub text: String,
    /// Its figures as one JSON object.
    pub json: String,
    /// What the user must be told whatever is printed.
    pub warnings: Vec<String>,
    /// Whether it was interrupted, or missed what it was asked to reach.
    pub verdict: Result<()>,
}

/// What a record says of a study that its time limit has ended.
pub const TIME_LIMIT: &str = "time_limit";

/// The time that a study may take. Once it is over it raises the flag that ends the study, for work that tells nobody of its
/// progress.
pub(in crate::study) struct TimeLimit {
    limit: Option<Duration>,
    began: Instant,
    stop: Arc<AtomicBool>,
    over: Arc<AtomicBool>,
    ended: Arc<AtomicBool>,
    timer: Option<JoinHandle<()>>,
}

impl TimeLimit {
    /// From now on.
    pub fn begin(limit: Option<Duration>, stop: &Arc<AtomicBool>) -> Self {
        let mut begun = Self {
            limit,
            began: Instant::now(),
            stop: Arc::clone(stop),
            over: Arc::default(),
            ended: Arc::default(),
            timer: None,
        };
        let (over, ended, stop) = [&begun.over, &begun.ended, stop].map(Arc::clone).into();
        let began = begun.began;
        begun.timer = limit.map(|limit| {
            std::thread::spawn(move || {
                while !ended.load(Ordering::Relaxed) {
                    let left = limit.saturating_sub(began.elapsed());
                    if left.is_zero() {
                        return end(&over, &stop);
                    }
                    std::thread::park_timeout(left);
                }
            })
        });
        begun
    }

    /// Whether it is over; a study that the user has stopped before has ended by that.
    pub fn is_over(&self) -> bool {
        if self.limit.is_some_and(|limit| self.began.elapsed() >= limit) {
            end(&self.over, &self.stop);
        }
        self.has_ended_it()
    }

    /// Whether it, and not the user, has ended the study.
    pub fn has_ended_it(&self) -> bool {
        self.over.load(Ordering::Relaxed)
    }
}

impl Drop for TimeLimit {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        if let Some(timer) = self.timer.take() {
            timer.thread().unpark();
            // It has nothing to panic over.
            let _ = timer.join();
        }
    }
}

/// Says that the time is over, unless the study is stopped already.
fn end(over: &AtomicBool, stop: &AtomicBool) {
    if !stop.swap(true, Ordering::Relaxed) {
        over.store(true, Ordering::Relaxed);
    }
}

/// The run that is resumed.
struct Resumed<T> {
    folder: RunFolder,
    state: T,
}

/// A study's settings, and the run that is resumed, if one is.
type Begun<S> = (<S as Study>::Settings, Option<Resumed<<S as Study>::State>>);

/// Settings from study file and flags, over those that the run was begun with if it is resumed.
fn begin<S: Study>(request: &Request<'_>) -> Result<Begun<S>> {
    let asked = |base: S::Settings| -> Result<S::Settings> {
        let mut settings = match (request.file, request.text) {
            (Some(path), _) => S::Settings::read(path)?,
            (None, Some((text, name))) => S::Settings::parse(name, text, Path::new(""))?,
            (None, None) => base,
        };
        apply(&mut settings, request.flags)?;
        settings.validate()?;
        Ok(settings.absolute())
    };
    if !request.resume {
        return Ok((asked(S::Settings::default())?, None));
    }
    let Some(out) = request.out else {
        let expected = format!("the folder of the run of {} that is resumed", S::NAME);
        return Err(Error::input("the study", "out", "none", expected));
    };
    let folder = run_folder::reopen(out)?;
    let mut state = S::State::load(&folder.join(STATE))?;
    let mut begun = state.settings(S::NAME)?;
    let settings = asked(begun.clone())?;
    // Where candidates are evaluated may change if the flags say so; what is evaluated may not.
    if moves::<S::Settings>(request.flags) {
        begun = begun.with_role_of(Role::Place, &settings);
        state.set_settings(&begun)?;
    }
    if begun != settings {
        return Err(Error::input(
            folder.join(STATE),
            "settings",
            "other settings, asked for now",
            "those that the run was begun with (study.toml beside it), or none",
        ));
    }
    Ok((settings, Some(Resumed { folder, state })))
}

/// Runs a study as a request says.
///
/// # Errors
/// Those of the study. Input that is refused leaves nothing behind.
pub(in crate::study) fn run<S: Study>(request: Request<'_>) -> Result<Answer> {
    let time_limit = TimeLimit::begin(request.time_limit, &request.stop);
    let limit_mib = request.memory_limit_mib;
    limit_memory(limit_mib);
    let (settings, resumed) = begin::<S>(&request)?;
    // A folder that is taken is refused before any work.
    if resumed.is_none() {
        run_folder::would_be(S::NAME, request.out)?;
    }
    // What no input has room for is refused before any is read.
    drop(memory::check(&S::size(&settings, None), limit_mib)?);
    let prepared = S::prepare_until(&settings, &request.stop)?;
    let kept = S::size(&settings, Some(&prepared));
    let _allowed = memory::check(&kept, limit_mib)?;
    if request.dry_run {
        let plan = Plan::of(S::NAME, &settings).memory_mib(memory::needed_mib(&kept));
        let plan = S::plan(&settings, &prepared, plan)?;
        return Ok(Answer::Planned(plan.into_folder(request.out)?));
    }
    let (folder, state) = match resumed {
        Some(resumed) => (resumed.folder, Some(resumed.state)),
        None => (run_folder::create(S::NAME, request.out)?, None),
    };
    write_study(&folder, &settings.to_toml())?;
    let mut state_file = StateFile::new(&folder).every(request.save_every);
    if moves::<S::Settings>(request.flags) {
        state_file = state_file.may_move();
    }
    let observe = request.observe;
    let outcome = S::solve(Work {
        settings: &settings,
        prepared: &prepared,
        state,
        state_file: &mut state_file,
        observe: &mut |progress| match observe(progress) {
            ControlFlow::Continue(()) if time_limit.is_over() => ControlFlow::Break(()),
            flow => flow,
        },
        stop: request.stop,
    });
    let timed_out = time_limit.has_ended_it();
    drop(time_limit);
    // Input that is refused only now leaves no state in the way of the next run.
    let refused = matches!(
        outcome,
        Err(Error::Input { .. } | Error::Memory { .. } | Error::Io { .. } | Error::NoDevice(_))
    );
    let untouched = || {
        let saved = state_file.saved::<S::Settings, S::State>();
        saved.is_some_and(|state| state.is_untouched())
    };
    if refused && !request.resume && untouched() {
        state_file.done()?;
    }
    let nothing_yet = || {
        if timed_out {
            let at = folder.display();
            Error::Study(format!(
                "the time limit came before there was a result; what was reached is saved in {at}, for --resume"
            ))
        } else {
            Error::Interrupted(folder.to_path_buf())
        }
    };
    let outcome = match outcome {
        Err(Error::Interrupted(_)) if timed_out => None,
        outcome => outcome?,
    };
    let mut outcome = outcome.ok_or_else(nothing_yet)?;
    let interrupted = S::record(&outcome).interrupted;
    if interrupted && timed_out {
        S::record_mut(&mut outcome).ended_by = Some(TIME_LIMIT.to_owned());
    }
    let summary = write_results::<S>(&folder, &settings, &prepared, &outcome)?;
    if !interrupted {
        state_file.done()?;
    }
    let json = serde_json::to_string(&summary)
        .map_err(|e| Error::io("standard output", "write", std::io::Error::other(e)))?;
    Ok(Answer::Finished(Finished {
        text: S::text(&settings, &summary),
        json,
        warnings: S::warnings(&summary),
        verdict: match interrupted {
            true if timed_out => Ok(()),
            true => Err(Error::Interrupted(folder.to_path_buf())),
            false => S::verdict(&settings, &summary),
        },
        folder: folder.to_path_buf(),
    }))
}

/// Writes all files of a study into `folder`, the manifest last: it says that the run is whole.
///
/// # Errors
/// [`Error::Io`] if one cannot be written.
pub fn write_results<S: Study>(
    folder: &Path,
    settings: &S::Settings,
    prepared: &S::Prepared,
    outcome: &S::Outcome,
) -> Result<S::Summary> {
    let solved = Solved::<S> {
        settings,
        prepared,
        outcome,
    };
    let summary = S::summarise(&solved);
    write_study(folder, &settings.to_toml())?;
    write_json(&folder.join(SUMMARY), &summary)?;
    S::report(folder, &solved, &summary)?;
    write_json(&folder.join(MANIFEST), &Manifest::new(solved.head(), SETTINGS))?;
    Ok(summary)
}

/// Does what `work` does from the state that an earlier run has left, and from the start where there is none or it belongs to
/// something else. With `own` the state must be of the very same settings.
///
/// # Errors
/// Those of `work`.
pub(in crate::study) fn resumed_or_new<S: Study, T>(
    settings: &S::Settings,
    state_file: &mut StateFile,
    own: bool,
    mut work: impl FnMut(Option<S::State>, &mut StateFile) -> Result<T>,
) -> Result<T> {
    if let Some(state) = state_file.saved::<S::Settings, S::State>() {
        let begun = state.settings(S::NAME);
        if own && !begun.is_ok_and(|begun| begun == *settings) {
            let file = state_file.file();
            tracing::warn!("{}: a state of other settings is not used", file.display());
        } else {
            match work(Some(state), state_file) {
                Err(error @ (Error::Input { .. } | Error::Memory { .. })) => {
                    tracing::warn!("started anew: {error}")
                }
                outcome => return outcome,
            }
        }
    }
    work(None, state_file)
}

/// Solves a study that nobody watches, and saves nothing.
///
/// # Errors
/// Those of the study.
pub fn solve_unobserved<S: Study>(settings: &S::Settings, prepared: &S::Prepared) -> Result<S::Outcome> {
    let outcome = S::solve(Work {
        settings,
        prepared,
        state: None,
        state_file: &mut StateFile::idle(),
        observe: &mut |_| ControlFlow::Continue(()),
        stop: Arc::default(),
    })?;
    outcome.ok_or_else(|| Error::Study("the study ended without a result".to_owned()))
}
