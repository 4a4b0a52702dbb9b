//! The work of the study: scenarios, stint and sizes, then the deployment by solver and swarms.

use super::{
    DrivenScenario, FrontPoint, Hybrid, HybridInputs, HybridSetup, HybridStudySettings, Optimised, Outcome,
    drive, search_front, search_strategy, size, stint, worth,
};
use crate::error::Result;
use crate::evaluate::energy::{HybridObjective, HybridProblem, Strategy, open_hybrid_evaluator};
use crate::evaluate::{BackendInfo, add_failures};
use crate::line::energy::{EnergyPlan, Gates, Mode};
use crate::study::framework::journal::{Journal, Recorder};
use crate::study::framework::{Inputs, Progress, RunRecord, Study, Watch, Work};
use std::time::Instant;

/// Runs the study, with the answers to the swarms noted in a journal, or known from one; nothing if it was interrupted before
/// the line was found.
///
/// # Errors
/// Those of laps, evaluators and solvers; [`crate::Error::Input`] if the journal belongs to other inputs or another backend.
pub(super) fn deploy(
    settings: &HybridStudySettings,
    inputs: &HybridInputs,
    work: Work<'_, Journal>,
) -> Result<Option<Outcome>> {
    let mut recorder = Recorder::of(Hybrid::NAME, settings, work.state, work.state_file)?;
    recorder.save()?;
    // The search for the line starts anew in a study that is resumed: it takes seconds, and ends where it would have ended.
    let Some(setup) = inputs.with_line(settings, &work.stop)? else {
        return Ok(None);
    };
    let observe = work.observe;
    let watch = Watch::begin();
    let backend = probe(&setup, settings)?;
    let mut read = Inputs::new(Hybrid::NAME);
    read.add(&setup);
    recorder.begin(read.key(), &backend)?;
    let mut record = RunRecord::of(&backend);
    let none = Gates {
        energy_mj: 0.0,
        ..Gates::OPEN
    };
    let engine = drive(&setup, "engine alone", Mode::Offset, none)?;
    let scenarios = settings
        .scenarios
        .iter()
        .map(|s| {
            Ok(DrivenScenario {
                own: drive(&setup, &s.name, s.mode, s.gates)?,
                additional: drive(&setup, &s.name, Mode::Additional, s.gates)?,
            })
        })
        .collect::<Result<Vec<_>>>()?;
    let stint_laps = stint(&setup, settings.stint_laps, settings.stint_fuel_kg)?;
    let mut interrupted = false;
    let (sizing, sized) = match settings.match_lap_time_s {
        Some(time) => size(&setup, settings, time, &mut recorder, |p| {
            let best = p.best.first().map_or(String::new(), |s| format!("{s:.4} s"));
            let told = observe(&Progress::reached("sizes", p.evaluations, best));
            interrupted |= told.is_break();
            told
        })?,
        None => (Vec::new(), 0),
    };
    if interrupted {
        recorder.save()?;
    }
    let mut evaluations = 1 + 2 * scenarios.len() as u64 + sized;
    let mut optimised = None;
    let mut search_s = 0.0;
    if settings.optimise && !interrupted {
        let budget_j = setup.budget_j(settings.energy_mj);
        let exact = setup.exact(budget_j, None)?;
        let best = format!("{:.4} s", exact.lap.time);
        interrupted = observe(&Progress::reached("reference optimum", 0, best)).is_break();
        let unbound = setup.exact(1e9, Some(&exact.shares))?;
        let mut front: Vec<FrontPoint> = Vec::new();
        for &mj in &settings.budgets_mj {
            if !interrupted {
                let before = front.last().map(|p| p.deployment.shares.as_slice());
                let deployment = setup.exact(1e6 * mj, before)?;
                let best = format!("{mj} MJ: {:.4} s", deployment.lap.time);
                interrupted = observe(&Progress::reached("front", 0, best)).is_break();
                front.push(FrontPoint {
                    budget_j: 1e6 * mj,
                    deployment,
                });
            }
        }
        let search = Instant::now();
        let swarm = search_strategy(&setup, settings, budget_j / 1e6, &mut recorder, |p| {
            add_failures(&mut record.failures, &p.failures);
            let told = observe(&Progress::reached(
                "swarm",
                p.evaluations,
                format!("{:.4} s", p.best[0]),
            ));
            interrupted |= told.is_break();
            told
        })?;
        evaluations += swarm.evaluations;
        let mut swarm_front = None;
        if settings.objectives.len() > 1 && !interrupted {
            let found = search_front(&setup, settings, budget_j / 1e6, &mut recorder, |p| {
                add_failures(&mut record.failures, &p.failures);
                let best: Vec<String> = p.best.iter().map(|b| format!("{b:.3}")).collect();
                let told = observe(&Progress::reached("swarm front", p.evaluations, best.join(" ")));
                interrupted |= told.is_break();
                told
            })?;
            evaluations += found.evaluations;
            swarm_front = Some(found);
        }
        search_s = search.elapsed().as_secs_f64();
        if interrupted {
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
        });
    }
    recorder.complete(&mut record);
    record.took(evaluations, watch.elapsed_s(), search_s);
    record.longest_dispatch_ms = watch.longest_dispatch_ms();
    record.interrupted = interrupted;
    Ok(Some(Outcome {
        setup,
        engine,
        scenarios,
        optimised,
        stint: stint_laps,
        sizing,
        record,
    }))
}

/// What evaluates.
fn probe(setup: &HybridSetup, settings: &HybridStudySettings) -> Result<BackendInfo> {
    let n = setup.points_m.len();
    let problem = HybridProblem::new(
        setup.fixed_line(),
        setup.car.clone(),
        EnergyPlan::whole(n, setup.run_in, Mode::Offset),
        Strategy::fixed(Gates::OPEN, 1),
        &[HybridObjective::LapTime],
        setup.entry_mps,
    )?;
    Ok(open_hybrid_evaluator(&problem, settings.backend, settings.adapter.as_deref())?.backend())
}
