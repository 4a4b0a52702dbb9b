//! The state of a search: all that it takes to resume it.

use super::settings::IdentifySettings;
use super::setup::Setup;
use crate::error::Result;
use crate::evaluate::{Evaluator, FailureCounts, Logarithmic, Worth};
use crate::study::framework::state_file::Origin;
use crate::study::framework::{Inputs, State};
use crate::swarm::checkpoint::Checkpoint;
use crate::swarm::{CovarianceSwarm, FrontSwarm, Optimiser, Progress, Pso, Reached, step};
use serde::{Deserialize, Serialize};

/// One line of the convergence history.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HistoryRow {
    /// Iterations over both stages.
    pub iteration: usize,
    /// Evaluations over both stages.
    pub evaluations: u64,
    /// Best value of each objective.
    pub best: Vec<f64>,
    /// Median of the first objective over the iteration's candidates that did not fail.
    pub median: Option<f64>,
    /// Candidates of the iteration that failed.
    pub failed: usize,
    /// Seconds since the search began.
    pub elapsed_s: f64,
}

/// Non-dominated candidates and their objectives.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Front {
    /// One row per member.
    pub candidates: Vec<Vec<f64>>,
    /// One row per member.
    pub objectives: Vec<Vec<f64>>,
    /// What the search had come to on its way.
    pub reached: Vec<Reached>,
    /// The member nearest to the ideal point, each objective as a share of its range.
    pub chosen: usize,
}

/// Where a search is.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum Place {
    /// The exploring swarm.
    Explore(Box<Pso>),
    /// The swarm that looks for a front, or for one objective on a device.
    Front(FrontSwarm),
    /// The swarm that learns the valley, and the best before it.
    Gather {
        best: Vec<f64>,
        worth: Worth,
        swarm: Box<CovarianceSwarm>,
    },
    /// The swarms are done.
    Searched { best: Vec<f64>, front: Option<Front> },
}

/// The state of a search. A search that is resumed from its checkpoint on the same backend gives the same bits.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SearchState {
    /// What the search was asked to do.
    pub settings: IdentifySettings,
    pub(super) origin: Origin,
    pub(super) history: Vec<HistoryRow>,
    pub(super) elapsed_s: f64,
    pub(super) failures: FailureCounts,
    pub(super) device_faults: Vec<String>,
    pub(super) place: Place,
}

impl State<IdentifySettings> for SearchState {
    fn settings(&self, _: &str) -> Result<IdentifySettings> {
        Ok(self.settings.clone())
    }

    fn set_settings(&mut self, settings: &IdentifySettings) -> Result<()> {
        self.settings = settings.clone();
        Ok(())
    }

    fn is_untouched(&self) -> bool {
        self.history.is_empty()
    }
}

impl Checkpoint for SearchState {
    const KIND: &'static str = concat!("search of identify, lapswarm ", env!("CARGO_PKG_VERSION"));
}

/// What a search with this setup depends on, besides its settings.
pub(super) fn inputs_of(setup: &Setup) -> String {
    let replay = &setup.replay;
    let mut inputs = Inputs::new("identify");
    inputs.add(&(&replay.plan, &replay.problem, &replay.free.car, &setup.truth));
    inputs.add(&setup.holdout.as_ref().map(|h| &h.plan.windows));
    inputs.key()
}

impl Place {
    /// One iteration of the present stage, with what it does and how many it plans; nothing once it is done.
    pub(super) fn advance(
        &mut self,
        evaluator: &mut dyn Evaluator,
    ) -> Result<Option<(&'static str, usize, Progress)>> {
        fn go(
            doing: &'static str,
            swarm: &mut dyn Optimiser,
            evaluator: &mut dyn Evaluator,
        ) -> Result<Option<(&'static str, usize, Progress)>> {
            if swarm.done() {
                return Ok(None);
            }
            let progress = step(swarm, evaluator)?;
            Ok(Some((doing, swarm.planned_iterations(), progress)))
        }
        match self {
            Self::Explore(swarm) => go("exploring", swarm.as_mut(), evaluator),
            Self::Front(swarm) => go("exploring", swarm, evaluator),
            Self::Gather { swarm, .. } => go("gathering", swarm.as_mut(), &mut Logarithmic::new(evaluator)),
            Self::Searched { .. } => Ok(None),
        }
    }
}
