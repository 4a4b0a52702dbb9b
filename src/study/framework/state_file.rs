//! The file of a study's state in its run folder, written while it works: an interrupted run loses seconds at most.

use super::State;
use crate::error::{Error, Result};
use crate::evaluate::BackendInfo;
use crate::files::run_folder::STATE;
use crate::hold::{self, Point};
use crate::swarm::checkpoint::{self, Checkpoint};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long a study works between two saves of its state.
const INTERVAL: Duration = Duration::from_secs(5);
/// How many times as long as its last save took a study works at the least before the next: nine tenths of its time.
const PAUSE: u32 = 9;

/// Saves states at an interval.
#[derive(Debug)]
pub struct StateFile {
    path: Option<PathBuf>,
    interval: Duration,
    last: Instant,
    /// How long the last save took.
    took: Duration,
    may_move: bool,
}

impl StateFile {
    /// Saves into a run folder, every five seconds.
    pub fn new(folder: &Path) -> Self {
        Self::at(folder.join(STATE))
    }

    /// Saves into a file, every five seconds.
    pub fn at(file: PathBuf) -> Self {
        Self {
            path: Some(file),
            ..Self::idle()
        }
    }

    /// Saves nothing.
    pub fn idle() -> Self {
        Self {
            path: None,
            interval: INTERVAL,
            last: Instant::now(),
            took: Duration::ZERO,
            may_move: false,
        }
    }

    /// Whether it saves anything.
    pub fn saves(&self) -> bool {
        self.path.is_some()
    }

    /// The state's file, or its usual name where nothing is saved.
    pub fn file(&self) -> PathBuf {
        self.path.clone().unwrap_or_else(|| STATE.into())
    }

    /// Saves this often.
    pub fn every(self, interval: Duration) -> Self {
        Self { interval, ..self }
    }

    /// The folder that it saves into; no name where it saves nothing.
    pub fn folder(&self) -> &Path {
        let folder = self.path.as_deref().and_then(Path::parent);
        folder.unwrap_or(Path::new(""))
    }

    /// The time between saves.
    pub fn interval(&self) -> Duration {
        self.interval
    }

    /// Whether it is time to save. Where a save takes long, more is worked than saved all the same; an interval of nothing
    /// saves whenever it can be.
    pub fn due(&self) -> bool {
        let pause = if self.interval.is_zero() {
            Duration::ZERO
        } else {
            self.interval.max(self.took.saturating_mul(PAUSE))
        };
        self.path.is_some() && self.last.elapsed() >= pause
    }

    /// The state that an earlier run has left, if it can be read.
    pub fn saved<S, T: State<S>>(&self) -> Option<T> {
        let path = self.path.as_ref().filter(|p| p.is_file())?;
        T::load(path)
            .inspect_err(|error| tracing::warn!("a state is not resumed: {error}"))
            .ok()
    }

    /// Saves a state.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be written; the state that was saved before is still there then.
    pub fn save<T: Checkpoint>(&mut self, state: &T) -> Result<()> {
        let Some(path) = &self.path else {
            return Ok(());
        };
        let began = Instant::now();
        let saved = checkpoint::save(path, state);
        hold::pass(Point::Saved);
        #[cfg(test)]
        std::thread::sleep(tests::SLOW.get());
        // From the end of the save on, whether it was one or not: what takes longer than the interval would be due at once.
        self.last = Instant::now();
        self.took = self.last - began;
        saved
    }

    /// As [`StateFile::save`] for saves between: one that fails is told, and the study goes on.
    pub fn save_or_warn<T: Checkpoint>(&mut self, state: &T) {
        if let Err(error) = self.save(state) {
            tracing::warn!("the state of the study was not saved: {error}");
        }
    }

    /// A state may be resumed on another backend. Its end is then another one, and a warning says so.
    pub fn may_move(self) -> Self {
        Self {
            may_move: true,
            ..self
        }
    }

    /// Whether a state of origin `began` can be resumed by `now`.
    ///
    /// # Errors
    /// [`Error::Input`] naming what is not the same.
    pub fn check(&self, began: &Origin, now: &Origin) -> Result<()> {
        let file = self.file();
        if began.inputs != now.inputs {
            let expected = "the files that the study reads as they were when the run began";
            return Err(Error::input(file, "inputs of the study", "others", expected));
        }
        if began != now && self.may_move {
            tracing::warn!(
                "the run began on {began} and is resumed on {now}: its end will differ in the last digits"
            );
        } else if began != now {
            let expected = format!("{began}, where the run began; a backend that is asked for moves it");
            return Err(Error::input(file, "backend", now.to_string(), expected));
        }
        Ok(())
    }

    /// Removes the saved state when there is nothing left to resume.
    ///
    /// # Errors
    /// [`Error::Io`] if it stays.
    pub fn done(&self) -> Result<()> {
        match &self.path {
            Some(path) if path.exists() => {
                std::fs::remove_file(path).map_err(|e| Error::io(path, "remove", e))
            }
            _ => Ok(()),
        }
    }
}

/// What a state was reached with. Only the same may resume it, or the end would be another.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// A sum over what the study has read.
    pub inputs: String,
    /// `cpu`, `simd` or `gpu`.
    pub backend: String,
    /// The instruction set, or the adapter's name.
    pub device: String,
    /// The adapter's driver.
    pub driver: String,
}

impl Origin {
    /// From what was read and what evaluates.
    pub fn new(inputs: String, backend: &BackendInfo) -> Self {
        Self {
            inputs,
            backend: backend.backend.to_owned(),
            device: backend.device.clone(),
            driver: backend.driver.clone(),
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.backend, self.device)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::framework::journal::Journal;
    use std::cell::Cell;

    thread_local! {
        /// How long a save takes more than it does.
        pub(super) static SLOW: Cell<Duration> = const { Cell::new(Duration::ZERO) };
    }

    #[test]
    fn a_save_that_takes_longer_than_the_interval_is_not_due_again_at_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let interval = Duration::from_millis(20);
        let mut state_file = StateFile::new(folder.path()).every(interval);
        std::thread::sleep(interval);
        assert!(state_file.due());
        let state = Journal::new("study", &3u32).expect("a journal");
        SLOW.set(Duration::from_millis(100));
        state_file.save(&state).expect("kept");
        SLOW.set(Duration::ZERO);
        std::thread::sleep(2 * interval);
        // Nine tenths of a second from the end of the save; nothing that a loaded machine does makes it due before.
        assert!(state_file.last.elapsed() > Duration::from_millis(800) || !state_file.due());
        assert!(state_file.took >= Duration::from_millis(100));
        while !state_file.due() {
            std::thread::sleep(interval);
        }
        state_file.save(&state).expect("kept");
        assert!(state_file.took < Duration::from_secs(60), "of the last save only");
        assert!(state_file.every(Duration::ZERO).due(), "whenever it can be");
    }
}
