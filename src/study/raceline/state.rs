//! The state of a racing-line study: all that it takes to go on.

use super::front::FrontState;
use super::plain::PlainState;
use super::search::{FoundLine, LineState};
use super::settings::RacelineSettings;
use super::{Setup, StudyProgress};
use crate::error::Result;
use crate::study::keeper::{Keeper, Origin};
use crate::study::run::Inputs;
use crate::swarm::checkpoint::Checkpoint;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// An objective that is done with.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct FinishedObjective {
    /// What the swarms found.
    pub found: FoundLine,
    /// `alpha` of the best line, of theirs and of what came after.
    pub best: Vec<f64>,
}

/// The state of a study. A checkpoint of it goes on bit for bit on the backend where it began.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LinesState {
    /// What the study was asked to do.
    pub settings: RacelineSettings,
    pub(super) origin: Origin,
    pub(super) elapsed_s: f64,
    /// Objectives that are done with, in their order.
    pub(super) finished: Vec<FinishedObjective>,
    /// Searches of the objective in hand that are done with.
    pub(super) steps: Vec<FoundLine>,
    /// The search in hand.
    pub(super) search: Option<Box<LineState>>,
    /// The plain swarm in hand.
    pub(super) plain: Option<Box<PlainState>>,
    /// The swarm that looks for the front.
    pub(super) front: Option<Box<FrontState>>,
}

impl LinesState {
    /// Whether nothing has been evaluated yet.
    pub fn is_untouched(&self) -> bool {
        let at_work = self.search.is_some() || self.plain.is_some() || self.front.is_some();
        self.finished.is_empty() && self.steps.is_empty() && !at_work
    }

    /// What has gone wrong with devices in all that is done with.
    pub(super) fn device_faults(&self) -> Vec<String> {
        let done = self.finished.iter().map(|objective| &objective.found);
        done.chain(&self.steps)
            .flat_map(|found| &found.device_faults)
            .cloned()
            .collect()
    }
}

impl Checkpoint for LinesState {
    const KIND: &'static str = concat!("study of raceline, lapswarm ", env!("CARGO_PKG_VERSION"));
}

/// What a study with this setup depends on, besides its settings.
pub(super) fn inputs_of(setup: &Setup) -> String {
    let mut inputs = Inputs::new("raceline");
    inputs.add(setup);
    inputs.key()
}

/// A study at work: its state, where that is kept, and who watches.
pub(super) struct Work<'a> {
    pub state: LinesState,
    pub keeper: &'a mut Keeper,
    pub observe: &'a mut dyn FnMut(&StudyProgress) -> ControlFlow<()>,
    pub interrupted: bool,
}

impl Work<'_> {
    /// Tells what is being done and saves the state if that is due, brought up to date by `update` before.
    pub fn told(
        &mut self,
        progress: &StudyProgress,
        update: impl FnOnce(&mut LinesState),
    ) -> Result<ControlFlow<()>> {
        // Once broken off, the state stays as it was then: what is reported after is of searches cut short.
        if self.interrupted {
            return Ok(ControlFlow::Break(()));
        }
        let flow = (self.observe)(progress);
        self.interrupted = flow.is_break();
        if self.interrupted {
            update(&mut self.state);
            self.keeper.keep(&self.state)?;
        } else if self.keeper.due() {
            update(&mut self.state);
            self.keeper.keep_or_warn(&self.state);
        }
        Ok(flow)
    }

    /// Whether to go on with what a solver is at.
    pub fn asked(&mut self, stage: &str) -> Result<ControlFlow<()>> {
        let progress = StudyProgress {
            stage: stage.to_owned(),
            evaluations: 0,
            best: "not known yet".to_owned(),
        };
        self.told(&progress, |_| ())
    }

    /// Takes a step that is done with into the state, and saves it.
    pub fn finished(&mut self, update: impl FnOnce(&mut LinesState)) {
        if !self.interrupted {
            update(&mut self.state);
            self.keeper.keep_or_warn(&self.state);
        }
    }
}
