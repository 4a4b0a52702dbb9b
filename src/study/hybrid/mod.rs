//! The hybrid: where every joule goes on a lap, and what it buys.
//!
//! Laps are driven on one line, the fastest of the exact solver or one that is given. Scenarios set the motor's gates by
//! hand ([`drive`]); a swarm ([`search_strategy`]) and the exact optimum ([`HybridSetup::exact`]) share an energy out over
//! the lap where it buys most time, and [`search_front`] looks for the front between several objectives with the strategy,
//! the line or both free.

mod results;
mod scenario;
mod settings;
mod setup;
mod sizing;
mod stint;
mod strategy;
mod worth;

pub use results::{HybridSummary, ScenarioFigures, summarise, write_results};
pub use scenario::{ReportedLap, Scenario, drive, published};
pub use settings::{FreePart, HYBRID_OBJECTIVES, HybridStudySettings};
pub use setup::{HybridInputs, HybridSetup, read_inputs, read_line, set_up};
pub use sizing::{ENGINES, Sizing, engine_only, size};
pub use stint::{StintLap, stint};
pub use strategy::{FoundStrategy, StrategyFront, search_front, search_strategy, zone_gates, zone_starts};
pub use worth::{Worth, correlation, mean_worths, worth};

use crate::error::Result;
use crate::evaluate::gpu::DispatchWatch;
use crate::evaluate::{BackendInfo, FailureCounts, add_failures};
use crate::line::energy::{Gates, Mode};
use crate::optimum::Deployment;
use crate::study::journal::Recorder;
use crate::study::keeper::Keeper;
use crate::study::run::Inputs;
use std::ops::ControlFlow;
use std::time::Instant;

/// A scenario's lap in its own mode, and with the motor beside the engine.
#[derive(Clone, Debug)]
pub struct DrivenScenario {
    /// In its own mode.
    pub own: ReportedLap,
    /// By the same gates with the motor adding to the engine.
    pub additional: ReportedLap,
}

/// An energy, the time that the exact deployment of it gives (s), and the energy that it used (J).
#[derive(Clone, Debug)]
pub struct FrontPoint {
    /// The energy that may leave the store (J).
    pub budget_j: f64,
    /// The exact deployment.
    pub deployment: Deployment,
}

/// The deployment of the study's energy.
#[derive(Clone, Debug)]
pub struct Optimised {
    /// The energy that may leave the store (J).
    pub budget_j: f64,
    /// The exact optimum.
    pub exact: Deployment,
    /// Its lap.
    pub exact_lap: ReportedLap,
    /// The swarm's.
    pub swarm: FoundStrategy,
    /// The exact optima of several energies.
    pub front: Vec<FrontPoint>,
    /// What an endless store is used for (J): no greater budget binds.
    pub unbound_j: f64,
    /// What the motor is worth along the lap of the engine alone, and how much of it the swarm uses.
    pub worth: Vec<Worth>,
    /// The swarm's front between the study's objectives.
    pub swarm_front: Option<StrategyFront>,
}

/// The outcome of a study.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The lap of the engine alone.
    pub engine: ReportedLap,
    /// The scenarios, in their order.
    pub scenarios: Vec<DrivenScenario>,
    /// The deployment.
    pub optimised: Option<Optimised>,
    /// The laps of a stint.
    pub stint: Vec<StintLap>,
    /// Hybrids that lap like another car.
    pub sizing: Vec<Sizing>,
    /// What evaluated in the end.
    pub backend: BackendInfo,
    /// What went wrong with devices and was got over.
    pub device_faults: Vec<String>,
    /// Laps of the swarms that failed, by reason.
    pub failures: FailureCounts,
    /// The longest that a dispatch kept the device (ms); nothing where none was at work.
    pub longest_dispatch_ms: Option<f64>,
    /// Laps evaluated.
    pub evaluations: u64,
    /// Time of the swarms (s).
    pub search_s: f64,
    /// Time of the whole study but for the line (s).
    pub elapsed_s: f64,
    /// Whether the observer broke the study off.
    pub interrupted: bool,
}

/// What an observer is told.
#[derive(Clone, Debug, PartialEq)]
pub struct HybridProgress {
    /// What is going on.
    pub stage: &'static str,
    /// Laps evaluated in this stage.
    pub evaluations: u64,
    /// The best so far, as text.
    pub best: String,
}

/// Runs a study.
///
/// # Errors
/// Those of laps, evaluators and solvers.
pub fn run_study(
    settings: &HybridStudySettings,
    setup: &HybridSetup,
    observe: impl FnMut(&HybridProgress) -> ControlFlow<()>,
) -> Result<Outcome> {
    run_recorded(settings, setup, &mut Recorder::idle(&mut Keeper::idle()), observe)
}

/// As [`run_study`], with the answers to the swarms noted by `recorder`, or known to it.
///
/// # Errors
/// As [`run_study`], and those of the recorder.
pub fn run_recorded(
    settings: &HybridStudySettings,
    setup: &HybridSetup,
    recorder: &mut Recorder<'_>,
    mut observe: impl FnMut(&HybridProgress) -> ControlFlow<()>,
) -> Result<Outcome> {
    let dispatches = DispatchWatch::begin();
    let began = Instant::now();
    let backend = probe(setup, settings)?;
    let mut inputs = Inputs::new("hybrid");
    inputs.add(setup);
    recorder.begin(inputs.key(), &backend)?;
    let none = Gates {
        energy_mj: 0.0,
        ..Gates::OPEN
    };
    let engine = drive(setup, "engine alone", Mode::Offset, none)?;
    let scenarios = settings
        .scenarios
        .iter()
        .map(|s| {
            Ok(DrivenScenario {
                own: drive(setup, &s.name, s.mode, s.gates)?,
                additional: drive(setup, &s.name, Mode::Additional, s.gates)?,
            })
        })
        .collect::<Result<Vec<_>>>()?;
    let stint_laps = stint(setup, settings.stint_laps, settings.stint_fuel_kg)?;
    let mut interrupted = false;
    let (sizing, sized) = match settings.match_lap_time_s {
        Some(time) => size(setup, settings, time, recorder, |p| {
            let told = observe(&HybridProgress {
                stage: "sizes",
                evaluations: p.evaluations,
                best: p.best.first().map_or(String::new(), |s| format!("{s:.4} s")),
            });
            interrupted |= told.is_break();
            told
        })?,
        None => (Vec::new(), 0),
    };
    if interrupted {
        recorder.keep()?;
    }
    let mut failures = FailureCounts::new();
    let mut outcome = Outcome {
        failures: FailureCounts::new(),
        evaluations: 1 + 2 * scenarios.len() as u64 + sized,
        engine,
        scenarios,
        optimised: None,
        stint: stint_laps,
        sizing,
        backend,
        device_faults: Vec::new(),
        longest_dispatch_ms: None,
        search_s: 0.0,
        elapsed_s: 0.0,
        interrupted,
    };
    if settings.optimise && !interrupted {
        let told = |stage: &'static str, evaluations: u64, best: String| HybridProgress {
            stage,
            evaluations,
            best,
        };
        let budget_j = setup.budget_j(settings.energy_mj);
        let exact = setup.exact(budget_j, None)?;
        outcome.interrupted |= observe(&told("exact", 0, format!("{:.4} s", exact.lap.time))).is_break();
        let unbound = setup.exact(1e9, Some(&exact.shares))?;
        let mut front: Vec<FrontPoint> = Vec::new();
        for &mj in &settings.budgets_mj {
            if !outcome.interrupted {
                let before = front.last().map(|p| p.deployment.shares.as_slice());
                let deployment = setup.exact(1e6 * mj, before)?;
                outcome.interrupted |= observe(&told(
                    "front",
                    0,
                    format!("{mj} MJ: {:.4} s", deployment.lap.time),
                ))
                .is_break();
                front.push(FrontPoint {
                    budget_j: 1e6 * mj,
                    deployment,
                });
            }
        }
        let search = Instant::now();
        let mut interrupted = outcome.interrupted;
        let swarm = search_strategy(setup, settings, budget_j / 1e6, recorder, |p| {
            add_failures(&mut failures, &p.failures);
            let told = observe(&told("swarm", p.evaluations, format!("{:.4} s", p.best[0])));
            interrupted |= told.is_break();
            told
        })?;
        outcome.evaluations += swarm.evaluations;
        let mut swarm_front = None;
        if settings.objectives.len() > 1 && !interrupted {
            let found = search_front(setup, settings, budget_j / 1e6, recorder, |p| {
                add_failures(&mut failures, &p.failures);
                let best: Vec<String> = p.best.iter().map(|b| format!("{b:.3}")).collect();
                let told = observe(&told("swarm front", p.evaluations, best.join(" ")));
                interrupted |= told.is_break();
                told
            })?;
            outcome.evaluations += found.evaluations;
            swarm_front = Some(found);
        }
        outcome.search_s = search.elapsed().as_secs_f64();
        outcome.interrupted = interrupted;
        if interrupted {
            recorder.keep()?;
        }
        outcome.optimised = Some(Optimised {
            budget_j,
            exact_lap: setup.exact_lap("exact", &exact.shares, budget_j)?,
            exact,
            worth: worth(setup, &outcome.engine, &swarm.lap)?,
            swarm,
            front,
            unbound_j: unbound.lap.deployed,
            swarm_front,
        });
    }
    outcome.failures = failures;
    outcome.device_faults = recorder.device_faults().to_vec();
    outcome.longest_dispatch_ms = dispatches.longest_ms();
    if let Some(backend) = recorder.backend() {
        outcome.backend.clone_from(backend);
    }
    outcome.elapsed_s = began.elapsed().as_secs_f64();
    Ok(outcome)
}

/// What it is that evaluates.
fn probe(setup: &HybridSetup, settings: &HybridStudySettings) -> Result<BackendInfo> {
    use crate::evaluate::hybrid::{HybridObjective, HybridProblem, Strategy, open_hybrid_evaluator};
    let n = setup.points_m.len();
    let problem = HybridProblem::new(
        setup.fixed_line(),
        setup.car.clone(),
        crate::line::energy::EnergyPlan::whole(n, setup.run_in, Mode::Offset),
        Strategy::fixed(Gates::OPEN, 1),
        &[HybridObjective::LapTime],
        setup.entry_mps,
    )?;
    Ok(open_hybrid_evaluator(&problem, settings.backend, settings.adapter.as_deref())?.backend())
}
