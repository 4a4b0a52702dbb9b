//! How far a drive has come: all that it takes to resume it.

use super::TransientSettings;
use crate::error::{Error, Result};
use crate::files::run_folder::STATE;
use crate::study::framework::State;
use crate::study::framework::journal::Journal;
use crate::swarm::checkpoint::{self, Checkpoint};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How far the search for the share of the grip that is held has come. Every share is driven by itself, so that a resumed search
/// ends with the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveState {
    pub(super) settings: TransientSettings,
    /// A sum over what is read; nothing before the first drive.
    pub(super) inputs: Option<String>,
    /// Shares that were tried, from the greatest on.
    pub(super) tried: usize,
    /// What became of those that failed.
    pub(super) failures: Vec<(f64, String)>,
    /// The share with which the laps agreed best so far.
    pub(super) best: Option<f64>,
    /// How far the shares of corners have come, once the whole lap's is found.
    pub(super) corners: Option<CornerState>,
}

/// How far the shares of the grip have come that corners hold. They are numbers among the shares from that of the whole lap on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct CornerState {
    /// The shares to drive with next.
    pub levels: Vec<usize>,
    /// Corners that go no higher.
    pub frozen: Vec<bool>,
    /// The shares of the fastest lap, and its time (s).
    pub best: Vec<usize>,
    pub best_s: f64,
    /// Whether the car held the shares that it was driven with last.
    pub accepted: bool,
    /// Trials of one corner alone that have ended.
    pub trial: usize,
    /// Laps driven.
    pub drives: usize,
}

impl DriveState {
    /// Of a drive that is to begin.
    pub fn new(settings: TransientSettings) -> Self {
        Self {
            settings,
            inputs: None,
            tried: 0,
            failures: Vec::new(),
            best: None,
            corners: None,
        }
    }
}

impl Checkpoint for DriveState {
    const KIND: &'static str = concat!("drive of a line, lapswarm ", env!("CARGO_PKG_VERSION"));
}

/// The state of one line alone, or of a population. Files hold the one or the other, never this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum TransientState {
    /// Of one line alone.
    Line(Box<DriveState>),
    /// Of a population.
    Population(Journal),
}

impl Checkpoint for TransientState {
    const KIND: &'static str = "drive";
}

impl TransientState {
    fn foreign<T>() -> Result<T> {
        let (found, expected) = ("that of another kind of drive", "that of this drive");
        Err(Error::input(STATE, "state", found, expected))
    }

    pub(super) fn line(self) -> Result<DriveState> {
        match self {
            Self::Line(state) => Ok(*state),
            Self::Population(_) => Self::foreign(),
        }
    }

    pub(super) fn population(self) -> Result<Journal> {
        match self {
            Self::Population(journal) => Ok(journal),
            Self::Line(_) => Self::foreign(),
        }
    }
}

impl State<TransientSettings> for TransientState {
    const KINDS: &'static [&'static str] = &[DriveState::KIND, Journal::KIND];

    fn load(file: &Path) -> Result<Self> {
        match checkpoint::load(file) {
            Ok(state) => Ok(Self::Line(Box::new(state))),
            Err(_) => checkpoint::load(file).map(Self::Population),
        }
    }

    fn settings(&self, study: &str) -> Result<TransientSettings> {
        match self {
            Self::Line(state) => Ok(state.settings.clone()),
            Self::Population(journal) => journal.settings(study),
        }
    }

    fn set_settings(&mut self, settings: &TransientSettings) -> Result<()> {
        match self {
            Self::Line(state) => {
                state.settings.clone_from(settings);
                Ok(())
            }
            Self::Population(journal) => journal.set_settings(settings),
        }
    }

    fn is_untouched(&self) -> bool {
        match self {
            Self::Line(state) => state.tried == 0,
            Self::Population(journal) => State::<TransientSettings>::is_untouched(journal),
        }
    }
}
