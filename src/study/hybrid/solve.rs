//! The work of the study: scenarios, stint and sizes, then the deployment by solver and swarms.

use super::scenario::drive_engine_alone;
use super::strategy::search;
use super::{
    DrivenScenario, FrontFigures, Hybrid, Optimised, Outcome, Scenario, search_front, search_strategy, size,
    stint, worth,
};
use crate::error::Result;
use crate::evaluate::add_failures;
use crate::evaluate::energy::open_hybrid_evaluator;
use crate::line::energy::{Gates, Mode};
use crate::study::framework::journal::Recorder;
use crate::study::framework::{Inputs, Progress, RunRecord, Study, Watch, Work};
use rayon::prelude::*;
use std::cell::Cell;
use std::time::Instant;

/// Runs the study, with the answers to the swarms noted in a journal, or known from one; nothing if it was interrupted before
/// the line was found.
///
/// # Errors
/// Those of laps, evaluators and solvers; [`crate::Error::Input`] if the journal belongs to other inputs or another backend.
pub(super) fn deploy(work: Work<'_, Hybrid>) -> Result<Option<Outcome>> {
    let settings = work.settings;
    let mut recorder = Recorder::of(Hybrid::NAME, settings, work.state, work.state_file)?;
    recorder.save()?;
    // The search for the line starts anew in a study that is resumed: it takes seconds, and ends where it would have ended.
    let Some(setup) = work.prepared.with_line(settings, &work.stop)? else {
        return Ok(None);
    };
    let watch = Watch::begin();
    let probe = setup.gated(Mode::Offset, Gates::OPEN)?;
    let backend = open_hybrid_evaluator(&probe, settings.backend, settings.adapter.as_deref())?.backend();
    let mut read = Inputs::new(Hybrid::NAME);
    read.add(&setup);
    recorder.begin(read.key(), &backend)?;
    let mut record = RunRecord::of(&backend);
    let interrupted = Cell::new(false);
    let mut tell = |stage: &str, evaluations: u64, reached: String| {
        let flow = (work.observe)(&Progress::reached(stage, evaluations, reached));
        interrupted.set(interrupted.get() || flow.is_break());
        flow
    };
    let engine = drive_engine_alone(&setup)?;
    let driven = |s: &Scenario| {
        Ok(DrivenScenario {
            own: s.drive(&setup, s.mode)?,
            additional: s.drive(&setup, Mode::Additional)?,
        })
    };
    let scenarios = settings
        .scenarios
        .iter()
        .map(driven)
        .collect::<Result<Vec<_>>>()?;
    let stint = stint(&setup, settings.stint_laps, settings.stint_fuel_kg)?;
    let (sizing, sized) = match settings.match_lap_time_s {
        Some(time) => size(&setup, settings, time, &mut recorder, |p| {
            let best = p.best.first().map_or(String::new(), |s| format!("{s:.4} s"));
            tell("sizes", p.evaluations, best)
        })?,
        None => (Vec::new(), 0),
    };
    if interrupted.get() {
        recorder.save()?;
    }
    let mut evaluations = 1 + 2 * scenarios.len() as u64 + sized;
    let mut optimised = None;
    let mut search_s = 0.0;
    if settings.optimise && !interrupted.get() {
        let budget_j = setup.budget_j(settings.energy_mj);
        let exact = setup.exact(budget_j, None)?;
        // Whether to go on is asked before each step.
        let _ = tell("reference optimum", 0, format!("{:.4} s", exact.lap.time));
        let unbound = setup.exact(1e9, Some(&exact.shares))?;
        let mut front = Vec::new();
        // Each from no deployment at all: from that of another energy, some end milliseconds slower.
        for budgets_mj in settings.budgets_mj.chunks(rayon::current_num_threads()) {
            if interrupted.get() {
                break;
            }
            let found = budgets_mj.par_iter().map(|mj| setup.exact(1e6 * mj, None));
            let found: Vec<_> = found.collect::<Result<_>>()?;
            for (mj, found) in budgets_mj.iter().zip(found) {
                let _ = tell("front", 0, format!("{mj} MJ: {:.4} s", found.lap.time));
                front.push(FrontFigures {
                    energy_mj: 1e6 * mj / 1e6,
                    deployed_mj: found.lap.deployed / 1e6,
                    lap_time_s: found.lap.time,
                });
            }
        }
        let began = Instant::now();
        let energy_mj = budget_j / 1e6;
        let swarm = search_strategy(&setup, settings, energy_mj, &mut recorder, |p| {
            add_failures(&mut record.failures, &p.failures);
            tell("swarm", p.evaluations, format!("{:.4} s", p.best[0]))
        })?;
        evaluations += swarm.evaluations;
        let mut swarm_front = None;
        if settings.objectives.len() > 1 && !interrupted.get() {
            let found = search_front(&setup, settings, energy_mj, &mut recorder, |p| {
                add_failures(&mut record.failures, &p.failures);
                let best: Vec<String> = p.best.iter().map(|b| format!("{b:.3}")).collect();
                tell("swarm front", p.evaluations, best.join(" "))
            })?;
            evaluations += found.evaluations;
            swarm_front = Some(found);
        }
        let mut further = Vec::new();
        for (name, problem, spending) in setup.further_searches(settings, energy_mj)? {
            if interrupted.get() {
                break;
            }
            let found = search((name, &problem), spending, settings, &mut recorder, |p| {
                add_failures(&mut record.failures, &p.failures);
                tell(name, p.evaluations, format!("{:.4}", p.best[0]))
            })?;
            evaluations += found.evaluations;
            further.push(found);
        }
        search_s = began.elapsed().as_secs_f64();
        if interrupted.get() {
            recorder.save()?;
        }
        optimised = Some(Optimised {
            budget_j,
            exact_lap: setup.exact_lap("exact", &exact.shares, budget_j)?,
            exact,
            worth: worth(&setup, &engine, &swarm.lap)?,
            swarm,
            front,
            unbound_j: unbound.lap.deployed,
            swarm_front,
            further,
        });
    }
    recorder.complete(&mut record);
    record.took(evaluations, watch.elapsed_s(), search_s);
    record.longest_dispatch_ms = watch.longest_dispatch_ms();
    record.interrupted = interrupted.get();
    Ok(Some(Outcome {
        setup,
        engine,
        scenarios,
        optimised,
        stint,
        sizing,
        record,
    }))
}
