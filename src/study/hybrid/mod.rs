//! The hybrid: where every joule goes on a lap, and what it buys.
//!
//! Laps are driven on one line, the reference optimum of lap time or one that is given. Scenarios set the motor's gates by
//! hand ([`drive`]); a swarm ([`search_strategy`]) and the solver of reference optima ([`HybridSetup::exact`]) share an energy
//! out over the lap where it buys most time, and [`search_front`] looks for the front between several objectives with the
//! strategy, the line or both free.

mod energy_value;
mod results;
mod scenario;
mod settings;
mod setup;
mod sizing;
mod solve;
mod spending;
mod stint;
mod strategy;

pub use energy_value::{Worth, correlation, mean_worths, worth};
pub use results::{FrontFigures, HybridSummary, ScenarioFigures, SearchFigures, Site};
pub use scenario::{ReportedLap, Scenario, drive, published};
pub use settings::{FreeGate, FreePart, HybridAlgorithm, HybridStudySettings};
pub use setup::{HybridInputs, HybridSetup, read_inputs, set_up};
pub use sizing::{ENGINES, Sizing, engine_only, size};
pub use stint::{StintLap, stint};
pub use strategy::{FoundStrategy, StrategyFront, search_front, search_strategy};

use crate::config::settings::Settings;
use crate::error::{Error, Result};
use crate::evaluate::energy::HybridObjective;
use crate::optimum::Deployment;
use crate::report::with_unit;
use crate::study::framework::journal::Journal;
use crate::study::framework::memory::MemoryItem;
use crate::study::framework::{Plan, RunRecord, Searched, Solved, Study, Subject, Work};
use crate::study::raceline::road_read;
use std::path::Path;

/// The study.
pub struct Hybrid;

/// A scenario's lap in its own mode, and with the motor beside the engine.
#[derive(Clone, Debug)]
pub struct DrivenScenario {
    /// In its own mode.
    pub own: ReportedLap,
    /// By the same gates with the motor adding to the engine.
    pub additional: ReportedLap,
}

/// The deployment of the study's energy.
#[derive(Clone, Debug)]
pub struct Optimised {
    /// The energy that may leave the store (J).
    pub budget_j: f64,
    /// The reference optimum.
    pub exact: Deployment,
    /// Its lap.
    pub exact_lap: ReportedLap,
    /// The swarm's.
    pub swarm: FoundStrategy,
    /// The reference optima of several energies.
    pub front: Vec<FrontFigures>,
    /// What an endless store is used for (J): no greater budget binds.
    pub unbound_j: f64,
    /// What the motor is worth along the lap of the engine alone, and how much of it the swarm uses.
    pub worth: Vec<Worth>,
    /// The swarm's front between the study's objectives.
    pub swarm_front: Option<StrategyFront>,
    /// What the further searches of the settings found.
    pub further: Vec<FoundStrategy>,
}

/// The outcome of a study.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What laps were driven with.
    pub setup: HybridSetup,
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
    /// How it ran; its time is that of the whole study but for the line.
    pub record: RunRecord,
}

impl Study for Hybrid {
    const NAME: &'static str = "hybrid";
    const ABOUT: &'static str = "Find where a hybrid's energy goes on a lap and where it buys most: scenarios, swarm, \
        reference optimum.";
    const DETAILS: &'static str = "Examples:\n  lapswarm hybrid\n  lapswarm hybrid --scenarios-only --json\n  lapswarm hybrid \
        --energy-mj 2.1 --objectives lap_time_s,fuel_l --free both\n  lapswarm hybrid --line \
        runs/raceline-001/line_fastest.csv\n  lapswarm hybrid --stint-laps 10\n  lapswarm hybrid --match-lap-time-s \
        113.5\n\nA study file has the same names, and scenarios of its own:\n  [scenarios.own]\n  mode = \"additional\"     # or \
        offset: the motor takes the engine's place\n  steer_rad = 0.03        # greatest steering at the wheels\n  \
        speed_mps = 60          # greatest speed\n  soc = 0.5               # least state of charge\n  \
        start_soc = 0.5         # state of charge at the start; the car's own if left out\n  \
        energy_mj = 3           # energy out of the store in a lap";
    type Settings = HybridStudySettings;
    type State = Journal;
    type Prepared = HybridInputs;
    type Outcome = Outcome;
    type Summary = HybridSummary;

    fn prepare(settings: &HybridStudySettings) -> Result<HybridInputs> {
        settings.check_place()?;
        read_inputs(settings)
    }

    fn size(settings: &HybridStudySettings, prepared: Option<&HybridInputs>) -> Vec<MemoryItem> {
        let variables = prepared.map_or(1, HybridInputs::variables);
        settings.size_of(variables).memory_items()
    }

    fn plan(settings: &HybridStudySettings, inputs: &HybridInputs, plan: Plan) -> Result<Plan> {
        let line = match (&settings.line, &inputs.given) {
            (Some(path), Some(points)) => format!("{}, {} points", path.display(), points.len()),
            _ => "the fastest one, found first".to_owned(),
        };
        road_read(plan, &inputs.raceline)
            .reads(format!("hybrid drive of {}", inputs.car.name))
            .reads(format!("line: {line}"))
            .seed(settings.seed)
            .backend(settings.backend, settings.adapter.as_deref())
    }

    fn solve(work: Work<'_, Self>) -> Result<Option<Outcome>> {
        solve::deploy(work)
    }

    fn record(outcome: &Outcome) -> &RunRecord {
        &outcome.record
    }

    fn record_mut(outcome: &mut Outcome) -> &mut RunRecord {
        &mut outcome.record
    }

    fn summarise(solved: &Solved<'_, Self>) -> HybridSummary {
        results::summarise(solved)
    }

    fn subject(settings: &HybridStudySettings, inputs: &HybridInputs) -> Subject {
        Subject::on_track(settings.seed, &inputs.car.name, &inputs.raceline.track_name)
    }

    fn report(folder: &Path, solved: &Solved<'_, Self>, summary: &HybridSummary) -> Result<()> {
        results::write_files(folder, solved)?;
        results::write_page(folder, solved, summary)
    }

    fn text(_: &HybridStudySettings, summary: &HybridSummary) -> String {
        summary.to_text()
    }

    fn verdict(settings: &HybridStudySettings, summary: &HybridSummary) -> Result<()> {
        if summary.sizing.is_empty() || summary.sizing.iter().any(|s| s.energy_mj.is_some()) {
            return Ok(());
        }
        let time_s = settings.match_lap_time_s.unwrap_or_default();
        Err(Error::Study(format!(
            "no motor that was tried makes the car lap in {time_s} s, whatever the energy (see the sizes above)"
        )))
    }

    fn searched(solved: &Solved<'_, Self>) -> Searched {
        let Some(found) = &solved.outcome.optimised else {
            return Searched::default();
        };
        let named = |o: &HybridObjective| with_unit(o.words(), o.unit());
        match &found.swarm_front {
            Some(front) => Searched {
                objectives: solved.settings.objectives.iter().map(named).collect(),
                reached: front.reached.clone(),
                front: front.objectives.clone(),
            },
            None => Searched {
                objectives: vec![named(&HybridObjective::LapTime)],
                reached: found.swarm.reached.clone(),
                front: Vec::new(),
            },
        }
    }

    fn check(path: &Path) -> Result<String> {
        let settings = HybridStudySettings::read(path)?;
        Self::prepare(&settings)?;
        Ok(format!(
            "{}, {} scenarios",
            settings.track,
            settings.scenarios.len()
        ))
    }
}
