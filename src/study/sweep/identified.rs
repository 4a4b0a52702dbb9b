//! Identifications of a sweep, those of one problem together: their swarms share an evaluator, and its calls.

use super::{Figures, Found};
use crate::error::Result;
use crate::evaluate::replay::open_evaluator;
use crate::evaluate::{PackedClient, run_packed};
use crate::study::identify::{self, IdentifySettings};
use crate::study::keeper::Keeper;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Swarms that run at a time: eight of fifty particles fill the lanes of a small device.
const TOGETHER: usize = 8;

/// Swarms of more particles than this fill a device by themselves, and count by themselves against the memory.
const SMALL: usize = 4096;

/// How many of the studies, from the first on, are of the same problem and fit together. A study that cannot be read is one by
/// itself, whose run says what is wrong with it.
pub(super) fn alike(paths: &[PathBuf]) -> usize {
    let problem = |path: &Path| {
        let settings = IdentifySettings::read(path).ok()?;
        (settings.size().population <= SMALL).then(|| problem_of(settings))
    };
    let Some(first) = paths.first().and_then(|path| problem(path)) else {
        return 1;
    };
    let rest = paths.iter().take(TOGETHER).skip(1);
    1 + rest
        .take_while(|path| problem(path).as_ref() == Some(&first))
        .count()
}

/// The settings without what only swarm and polish go by.
pub(super) fn problem_of(settings: IdentifySettings) -> IdentifySettings {
    let usual = IdentifySettings::default();
    IdentifySettings {
        algorithm: usual.algorithm,
        population: usual.population,
        iterations: usual.iterations,
        inertia: usual.inertia,
        cognitive: usual.cognitive,
        social: usual.social,
        mutation: usual.mutation,
        archive: usual.archive,
        seed: usual.seed,
        polish: usual.polish,
        hops: usual.hops,
        ..settings
    }
}

/// Runs studies of one problem at the same time; nothing for each that was broken off.
///
/// # Errors
/// Those of the problem; those of a search are in its place.
pub(super) fn identified(
    paths: &[PathBuf],
    mut observe: impl FnMut() -> ControlFlow<()>,
) -> Result<Vec<Result<Option<Found>>>> {
    let studies = paths
        .iter()
        .map(|path| IdentifySettings::read(path))
        .collect::<Result<Vec<_>>>()?;
    let Some(first) = studies.first() else {
        return Ok(Vec::new());
    };
    let setup = identify::set_up(first)?;
    let mut evaluator = open_evaluator(&setup.replay, first.backend, first.adapter.as_deref())?;
    let stop = AtomicBool::new(false);
    let (setup, stopped) = (&setup, &stop);
    let searches: Vec<_> = studies
        .iter()
        .map(|settings| {
            move |mut evaluator: PackedClient| -> Result<Option<Found>> {
                let observe = |_: &identify::Report<'_>| {
                    if stopped.load(Ordering::Relaxed) {
                        ControlFlow::Break(())
                    } else {
                        ControlFlow::Continue(())
                    }
                };
                let state = (None, &mut Keeper::idle());
                let outcome = identify::search_with(settings, setup, &mut evaluator, state, observe)?;
                Ok((!outcome.interrupted).then(|| figures_of(settings, setup, &outcome)))
            }
        })
        .collect();
    Ok(run_packed(evaluator.as_mut(), searches, || {
        if observe().is_break() {
            stop.store(true, Ordering::Relaxed);
        }
    }))
}

fn figures_of(settings: &IdentifySettings, setup: &identify::Setup, outcome: &identify::Outcome) -> Found {
    let summary = identify::summarise(settings, setup, outcome);
    let mut figures = Figures::from([
        ("evaluations".to_owned(), Some(outcome.evaluations as f64)),
        (
            "best_cost".to_owned(),
            outcome.history.last().and_then(|row| row.best.first().copied()),
        ),
        (
            "swarm_total_parameter_error".to_owned(),
            summary.swarm_total_parameter_error,
        ),
        ("total_parameter_error".to_owned(), summary.total_parameter_error),
    ]);
    figures.extend(
        summary
            .costs
            .iter()
            .map(|(channel, cost)| (format!("cost_{channel}"), Some(*cost))),
    );
    (figures, Vec::new())
}
