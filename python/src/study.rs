//! Studies, each run in a thread of its own.

use crate::errors::{OrRaise, exception, refused};
use crate::evaluator::LOOK;
use lapswarm::config::settings::Flag;
use lapswarm::study::framework::{Answer, Progress, Request};
use lapswarm::study::registry::{self, Registered, STUDIES};
use lapswarm::{Error, Result};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

/// Every study: its name, what it does, and the declarations of its settings.
#[pyfunction]
pub fn studies(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let declared = |study: &&dyn Registered| {
        let settings = study.declared().into_iter().map(|d| {
            let told = PyDict::new(py);
            told.set_item("key", d.key)?;
            told.set_item("unit", d.unit)?;
            told.set_item("range", d.range)?;
            told.set_item("default", study.default_of(d.key))?;
            told.set_item("meaning", d.meaning)?;
            told.set_item("switch", matches!(d.flag, Flag::Switch(..)))?;
            Ok(told)
        });
        let told = PyDict::new(py);
        told.set_item("name", study.name())?;
        told.set_item("about", study.about())?;
        told.set_item("settings", settings.collect::<PyResult<Vec<_>>>()?)?;
        Ok(told)
    };
    STUDIES.iter().map(declared).collect()
}

/// How a study is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Asked {
    out: Option<PathBuf>,
    resume: bool,
    save_every_s: f64,
    time_limit_s: Option<f64>,
    memory_limit_mib: u64,
    dry_run: bool,
}

/// What the thread of a study tells.
enum Told {
    Progress(Progress),
    Ended(Result<Answer>),
}

fn solve(
    study: &dyn Registered,
    (text, name): (&str, &Path),
    asked: &Asked,
    stop: &Arc<AtomicBool>,
    tell: &SyncSender<Told>,
) -> Result<Answer> {
    let seconds = |s: f64, what: &str| {
        Duration::try_from_secs_f64(s)
            .map_err(|_| Error::input(name, what, s.to_string(), "a time in seconds, 0 or more"))
    };
    let limit = asked
        .time_limit_s
        .map(|s| seconds(s, "time_limit_s"))
        .transpose()?;
    study.run(Request {
        file: None,
        // A run that is resumed has its own settings, unless others are given.
        text: (!(asked.resume && text.is_empty())).then_some((text, name)),
        flags: &[],
        out: asked.out.as_deref(),
        resume: asked.resume,
        save_every: seconds(asked.save_every_s, "save_every_s")?,
        time_limit: limit,
        memory_limit_mib: asked.memory_limit_mib,
        dry_run: asked.dry_run,
        stop: Arc::clone(stop),
        observe: &mut |progress| {
            // Nobody listens any more once the caller is gone, who has raised the flag then.
            let _ = tell.send(Told::Progress(progress.clone()));
            match stop.load(Ordering::Relaxed) {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        },
    })
}

/// Tells the callback of a progress; whether the study is to go on.
fn call(py: Python<'_>, callback: Option<&Bound<'_, PyAny>>, progress: &Progress) -> PyResult<bool> {
    let Some(callback) = callback else { return Ok(true) };
    let told = PyDict::new(py);
    told.set_item("stage", &progress.stage)?;
    told.set_item("done", progress.done)?;
    told.set_item("planned", progress.planned)?;
    told.set_item("reached", &progress.reached)?;
    let said = callback.call1((told,))?;
    Ok(said.is_none() || said.is_truthy()?)
}

/// Runs a study with the settings in a text, and hands back its figures as JSON with the folder and what is said of them.
#[pyfunction]
pub fn run_study<'py>(
    py: Python<'py>,
    name: &str,
    text: String,
    asked: Asked,
    callback: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let known = || refused(py, "the studies", "name", name, &registry::names().join(", "));
    let study = registry::named(name).ok_or_else(known)?;
    let stop: Arc<AtomicBool> = Arc::default();
    // The study waits until it is heard: one that the callback ends is at most a progress ahead of it.
    let (tell, mut told) = sync_channel(0);
    let raised_there = Arc::clone(&stop);
    let called = PathBuf::from(name);
    std::thread::spawn(move || {
        let answer = solve(study, (&text, &called), &asked, &raised_there, &tell);
        let _ = tell.send(Told::Ended(answer));
    });
    let mut raised = None;
    let answer = listen(py, &mut told, |progress| {
        let proceed = match progress {
            Some(progress) if raised.is_none() => call(py, callback, &progress),
            _ => py.check_signals().map(|()| true),
        };
        let proceed = proceed.unwrap_or_else(|error| {
            raised.get_or_insert(error);
            false
        });
        if !proceed {
            stop.store(true, Ordering::Relaxed);
        }
    });
    // An interrupt has stopped the study, which says what it has reached.
    if let Some(error) = raised
        && !error.is_instance_of::<PyKeyboardInterrupt>(py)
    {
        return Err(error);
    }
    let ended = || exception(py, &Error::Study("the thread of the study has ended".to_owned()));
    let result = PyDict::new(py);
    match answer.ok_or_else(ended)?.or_raise(py)? {
        Answer::Planned(plan) => result.set_item("plan", plan.to_text())?,
        Answer::Finished(finished) => {
            result.set_item("folder", finished.folder.as_os_str())?;
            result.set_item("text", finished.text)?;
            result.set_item("json", finished.json)?;
            result.set_item("warnings", finished.warnings)?;
            let interrupted = matches!(finished.verdict, Err(Error::Interrupted(_)));
            result.set_item("interrupted", interrupted)?;
            let verdict = finished.verdict.err().map(|error| error.to_string());
            result.set_item("verdict", verdict.filter(|_| !interrupted))?;
        }
    }
    Ok(result)
}

/// Listens to a study until it ends; nothing if its thread has ended without an answer. `each` is called with every progress, and
/// now and then without one.
fn listen(
    py: Python<'_>,
    told: &mut Receiver<Told>,
    mut each: impl FnMut(Option<Progress>),
) -> Option<Result<Answer>> {
    loop {
        let receiver = &mut *told;
        let next = py.detach(move || receiver.recv_timeout(LOOK));
        match next {
            Ok(Told::Progress(progress)) => {
                each(Some(progress));
                each(None);
            }
            Ok(Told::Ended(answer)) => return Some(answer),
            Err(RecvTimeoutError::Timeout) => each(None),
            Err(RecvTimeoutError::Disconnected) => return None,
        }
    }
}
