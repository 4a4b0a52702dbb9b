//! The state of a search: all that it takes to go on.

use super::coordinates::Logarithmic;
use super::search::{Front, HistoryRow, Stage};
use super::settings::IdentifySettings;
use super::setup::Setup;
use crate::error::Result;
use crate::evaluate::{Evaluator, FailureCounts};
use crate::study::keeper::Origin;
use crate::study::run::Inputs;
use crate::swarm::checkpoint::Checkpoint;
use crate::swarm::{CovarianceSwarm, Mopso, Optimiser, Progress, Pso, step};
use serde::{Deserialize, Serialize};

/// Where a search is.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum Place {
    /// The exploring swarm.
    Explore(Box<Pso>),
    /// The swarm that looks for a front.
    Front(Box<Mopso>),
    /// The swarm that learns the valley, and the best before it.
    Gather {
        best: Vec<f64>,
        cost: f64,
        swarm: Box<CovarianceSwarm>,
    },
    /// The swarms are done.
    Searched { best: Vec<f64>, front: Option<Front> },
}

/// The state of a search. A checkpoint of it goes on bit for bit on the backend where it began.
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

impl SearchState {
    /// Whether nothing has been evaluated yet.
    pub fn is_untouched(&self) -> bool {
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
    /// One iteration of the present stage, with the stage and what it plans; nothing once it is done.
    pub(super) fn advance(
        &mut self,
        evaluator: &mut dyn Evaluator,
    ) -> Result<Option<(Stage, usize, Progress)>> {
        fn go(
            stage: Stage,
            swarm: &mut dyn Optimiser,
            evaluator: &mut dyn Evaluator,
        ) -> Result<Option<(Stage, usize, Progress)>> {
            if swarm.done() {
                return Ok(None);
            }
            let progress = step(swarm, evaluator)?;
            Ok(Some((stage, swarm.planned_iterations(), progress)))
        }
        match self {
            Self::Explore(swarm) => go(Stage::Explore, swarm.as_mut(), evaluator),
            Self::Front(swarm) => go(Stage::Explore, swarm.as_mut(), evaluator),
            Self::Gather { swarm, .. } => go(Stage::Gather, swarm.as_mut(), &mut Logarithmic::new(evaluator)),
            Self::Searched { .. } => Ok(None),
        }
    }
}
