//! Identifications of a sweep, those of one problem together: their swarms share an evaluator, and its calls.

use super::{Figures, Found, check_own, keeper_of};
use crate::error::{Error, Result};
use crate::evaluate::replay::open_evaluator;
use crate::evaluate::{PackedClient, run_packed};
use crate::study::identify::{self, IdentifySettings, SearchState};
use crate::study::keeper::Keeper;
use crate::study::memory::Size;
use crate::study::run::go_on;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

/// Swarms that run at a time: eight of fifty particles fill the lanes of a small device.
const TOGETHER: usize = 8;

/// Swarms of more particles than this fill a device by themselves.
const SMALL: usize = 4096;

/// How many of the studies, from the first on, are of the same problem and fit into the memory (MiB) together. A study that
/// cannot be read is one by itself, whose run says what is wrong with it.
pub(super) fn alike(paths: &[PathBuf], memory_limit_mib: u64) -> usize {
    let read = |path: &PathBuf| {
        let settings = IdentifySettings::read(path).ok()?;
        let size = settings.size();
        (size.population <= SMALL).then(|| (problem_of(settings), size))
    };
    let small: Vec<(IdentifySettings, Size)> = paths.iter().take(TOGETHER).map_while(read).collect();
    let alike = small.iter().take_while(|(problem, _)| *problem == small[0].0);
    let sizes: Vec<Size> = alike.map(|(_, size)| *size).collect();
    Size::together(&sizes, memory_limit_mib)
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
    memory_limit_mib: u64,
    mut observe: impl FnMut() -> ControlFlow<()>,
) -> Result<Vec<Result<Option<Found>>>> {
    let studies = paths
        .iter()
        .map(|path| IdentifySettings::read(path))
        .collect::<Result<Vec<_>>>()?;
    let Some(first) = studies.first() else {
        return Ok(Vec::new());
    };
    let mut sizes: Vec<Size> = studies.iter().map(IdentifySettings::size).collect();
    drop(Size::check_together(&sizes, memory_limit_mib)?);
    let setup = identify::set_up(first)?;
    // The log is one for all of them, and may leave room for fewer.
    sizes[0].samples = setup.log.samples();
    let together = Size::together(&sizes, memory_limit_mib).max(1);
    let (studies, paths) = (&studies[..together], &paths[..together]);
    let _allowed = Size::check_together(&sizes[..together], memory_limit_mib)?;
    let mut evaluator = open_evaluator(&setup.replay, first.backend, first.adapter.as_deref())?;
    let stop = AtomicBool::new(false);
    let (setup, stopped) = (&setup, &stop);
    let mut keepers: Vec<Keeper> = paths.iter().map(|path| keeper_of(path)).collect();
    let searches: Vec<_> = studies
        .iter()
        .zip(&mut keepers)
        .map(|(settings, keeper)| {
            move |mut evaluator: PackedClient| -> Result<Option<Found>> {
                let observe = |_: &identify::Report<'_>| {
                    if stopped.load(Ordering::Relaxed) {
                        ControlFlow::Break(())
                    } else {
                        ControlFlow::Continue(())
                    }
                };
                let found = go_on(keeper, |state: Option<SearchState>, keeper| {
                    let own = state.as_ref().is_none_or(|state| state.settings == *settings);
                    check_own(own, keeper)?;
                    identify::search_with(settings, setup, &mut evaluator, (state, keeper), observe)
                });
                let outcome = match found {
                    Err(Error::Interrupted(_)) => return Ok(None),
                    outcome => outcome?,
                };
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
    Found {
        figures,
        front: Vec::new(),
        study: "identify",
        seed: settings.seed,
        car: setup.replay.free.car.name.clone(),
        backend: outcome.backend.clone(),
        device_faults: outcome.device_faults.clone(),
        longest_dispatch_ms: outcome.longest_dispatch_ms,
    }
}
