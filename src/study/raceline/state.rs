//! The state of a racing-line study: all that it takes to resume it.

use super::settings::RacelineSettings;
use super::setups::SolvedSetup;
use super::whole_line_search::WholeLineState;
use super::window_search::{FoundLine, LineState};
use super::{Raceline, Setup};
use crate::error::Result;
use crate::study::framework::state_file::{Origin, StateFile};
use crate::study::framework::{Inputs, Progress, State, Work};
use crate::swarm::SwarmState;
use crate::swarm::checkpoint::Checkpoint;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::time::Instant;

/// An objective that is done with.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct FinishedObjective {
    /// What the swarms found.
    pub found: FoundLine,
    /// `alpha` of the best line, of theirs and of what came after.
    pub best: Vec<f64>,
    /// By what share of the way to the reference line it gave way, where nothing less brought it onto the road.
    pub gave_way: Option<f64>,
}

/// The state of a study. A checkpoint of it is resumed bit for bit on the backend where it began.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
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
    pub(super) front: Option<Box<SwarmState>>,
    /// Set-ups that are done with, and the time that they took (s).
    pub(super) setups: Vec<SolvedSetup>,
    pub(super) setups_s: f64,
}

impl LinesState {
    /// What has gone wrong with devices in all that is done with.
    pub(super) fn device_faults(&self) -> Vec<String> {
        let done = self.finished.iter().map(|objective| &objective.found);
        done.chain(&self.steps)
            .flat_map(|found| &found.losses.device_faults)
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
    /// Since when it is at work.
    pub began: Instant,
    /// Time that it took in earlier runs (s).
    before_s: f64,
    /// Of the time since it began, that of waiting for solvers of reference optima (s).
    pub waited_s: f64,
    /// Since when it waits for one.
    waiting: Option<Instant>,
}

impl<'a> Running<'a> {
    /// A study that begins, or is resumed if there is a state.
    pub fn begin(origin: Origin, work: Work<'a, Raceline>) -> Result<Self> {
        let state_file = work.state_file;
        let state = match work.state {
            Some(state) => {
                state_file.check(&state.origin, &origin)?;
                state
            }
            None => LinesState {
                settings: work.settings.clone(),
                origin,
                ..LinesState::default()
            },
        };
        state_file.save(&state)?;
        Ok(Self {
            before_s: state.elapsed_s,
            waited_s: 0.0,
            state,
            state_file,
            observe: work.observe,
            interrupted: false,
            began: Instant::now(),
            waiting: None,
        })
    }

    /// Time that the study has taken but for waiting (s), in earlier runs too.
    pub fn elapsed_s(&self) -> f64 {
        let waiting_s = self.waiting.map_or(0.0, |since| since.elapsed().as_secs_f64());
        self.before_s + self.began.elapsed().as_secs_f64() - self.waited_s - waiting_s
    }

    /// Waits for what `wait` waits for; returns what that comes to.
    pub fn waited<T>(&mut self, wait: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        let since = Instant::now();
        self.waiting = Some(since);
        let found = wait(self);
        self.waiting = None;
        self.waited_s += since.elapsed().as_secs_f64();
        found
    }

    /// Brings the state up to date.
    fn update(&mut self, update: impl FnOnce(&mut LinesState)) {
        update(&mut self.state);
        self.state.elapsed_s = self.elapsed_s();
    }

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
            self.update(update);
            self.state_file.save(&self.state)?;
        } else if self.state_file.due() {
            self.update(update);
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
            self.update(update);
            self.state_file.save_or_warn(&self.state);
        }
    }
}
