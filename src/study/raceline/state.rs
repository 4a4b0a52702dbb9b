//! The state of a racing-line study: all that it takes to resume it.

use super::Setup;
use super::front::FrontState;
use super::settings::RacelineSettings;
use super::whole_line_search::WholeLineState;
use super::window_search::{FoundLine, LineState};
use crate::error::Result;
use crate::study::framework::state_file::{Origin, StateFile};
use crate::study::framework::{Inputs, Progress, State};
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

/// The state of a study. A checkpoint of it is resumed bit for bit on the backend where it began.
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
    /// The swarm of whole lines in hand.
    pub(super) whole_lines: Option<Box<WholeLineState>>,
    /// The swarm that looks for the front.
    pub(super) front: Option<Box<FrontState>>,
}

impl LinesState {
    /// What has gone wrong with devices in all that is done with.
    pub(super) fn device_faults(&self) -> Vec<String> {
        let done = self.finished.iter().map(|objective| &objective.found);
        done.chain(&self.steps)
            .flat_map(|found| &found.device_faults)
            .cloned()
            .collect()
    }
}

impl State<RacelineSettings> for LinesState {
    fn settings(&self, _: &str) -> Result<RacelineSettings> {
        Ok(self.settings.clone())
    }

    fn set_settings(&mut self, settings: &RacelineSettings) -> Result<()> {
        self.settings.clone_from(settings);
        Ok(())
    }

    fn is_untouched(&self) -> bool {
        let at_work = self.search.is_some() || self.whole_lines.is_some() || self.front.is_some();
        self.finished.is_empty() && self.steps.is_empty() && !at_work
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
pub(super) struct Running<'a> {
    pub state: LinesState,
    pub state_file: &'a mut StateFile,
    pub observe: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
    pub interrupted: bool,
}

impl Running<'_> {
    /// Tells what is being done and saves the state if that is due, brought up to date by `update` before.
    pub fn told(
        &mut self,
        progress: &Progress,
        update: impl FnOnce(&mut LinesState),
    ) -> Result<ControlFlow<()>> {
        // Once interrupted, the state stays as it was then: what is reported after is of searches cut short.
        if self.interrupted {
            return Ok(ControlFlow::Break(()));
        }
        let flow = (self.observe)(progress);
        self.interrupted = flow.is_break();
        if self.interrupted {
            update(&mut self.state);
            self.state_file.save(&self.state)?;
        } else if self.state_file.due() {
            update(&mut self.state);
            self.state_file.save_or_warn(&self.state);
        }
        Ok(flow)
    }

    /// Whether a solver is to continue.
    pub fn asked(&mut self, stage: &str) -> Result<ControlFlow<()>> {
        self.told(&Progress::reached(stage, 0, "not known yet"), |_| ())
    }

    /// Takes a step that is done with into the state, and saves it.
    pub fn finished(&mut self, update: impl FnOnce(&mut LinesState)) {
        if !self.interrupted {
            update(&mut self.state);
            self.state_file.save_or_warn(&self.state);
        }
    }
}
