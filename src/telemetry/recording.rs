//! A log file as it was logged, before roles are assigned to its channels.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::Result;
use crate::config::{check_memory, memory_limit};
use crate::error::Place;

/// The file formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// This crate's own CSV: SI, ISO 8855, units in the column names.
    Native,
    /// A CSV export of MoTeC i2, or one laid out like it (AiM Race Studio writes the same layout).
    MotecCsv,
    /// A table whose header has names with their units.
    Headed,
    /// MoTeC's binary `.ld`.
    MotecLd,
    /// Racelogic's `.vbo`.
    Vbox,
}

/// When the samples of a channel were taken.
#[derive(Clone, Debug, PartialEq)]
pub enum Clock {
    /// Evenly, from `start_s` (s) at `rate_hz` (Hz).
    Rate {
        /// Time of the first sample, s.
        start_s: f64,
        /// Samples per second, Hz.
        rate_hz: f64,
    },
    /// At these times, s; one array is shared by all columns of a table.
    Times(Arc<[f64]>),
}

/// A sample that is not a finite number.
#[derive(Clone, Debug, PartialEq)]
pub struct Unreadable {
    /// Its index among the channel's samples.
    pub sample: usize,
    /// What the file holds there.
    pub text: String,
}

impl Unreadable {
    /// Whether the file holds nothing there: an empty cell, or what a program writes for one.
    pub(super) fn is_missing(&self) -> bool {
        self.text.is_empty() || self.text.eq_ignore_ascii_case("nan")
    }

    /// Takes one that was found into what a channel keeps: the first that is not missing, or else the first.
    pub(super) fn keep(first: &mut Option<Self>, found: Self) {
        if first
            .as_ref()
            .is_none_or(|first| first.is_missing() && !found.is_missing())
        {
            *first = Some(found);
        }
    }
}

/// One logged quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name; unique in its recording.
    pub name: String,
    /// Its unit as the file spells it; empty where the file gives none.
    pub unit: String,
    /// When its samples were taken.
    pub clock: Clock,
    /// Its samples in `unit`; NaN where the file holds no finite number.
    pub values: Vec<f64>,
    /// The first sample that holds something other than a finite number; the first one that is missing where none does. This is an
    /// error only if the channel is used, and samples that are missing are joined by straight lines.
    pub unreadable: Option<Unreadable>,
    /// The file line of each sample, for text formats.
    pub lines: Option<Arc<[usize]>>,
}

impl Channel {
    /// Time of a sample, s. An index past the end gives the last time, and an empty clock 0.
    pub fn time_s(&self, sample: usize) -> f64 {
        match &self.clock {
            Clock::Rate { start_s, rate_hz } => start_s + sample as f64 / rate_hz,
            Clock::Times(times) => times.get(sample).or_else(|| times.last()).copied().unwrap_or(0.0),
        }
    }

    /// Whether it has samples, of which none is a number.
    pub(super) fn is_blank(&self) -> bool {
        !self.values.is_empty() && self.values.iter().all(|v| v.is_nan())
    }

    /// The channel without its missing samples, at the times of the others. None where nothing is missing, or everything, and
    /// where a sample holds something else.
    pub(super) fn without_gaps(&self) -> Option<Self> {
        let missing = self.unreadable.as_ref().is_some_and(Unreadable::is_missing);
        if !missing || self.is_blank() {
            return None;
        }
        let kept: Vec<usize> = (0..self.values.len())
            .filter(|i| !self.values[*i].is_nan())
            .collect();
        Some(Self {
            name: self.name.clone(),
            unit: self.unit.clone(),
            clock: Clock::Times(kept.iter().map(|i| self.time_s(*i)).collect()),
            values: kept.iter().map(|i| self.values[*i]).collect(),
            unreadable: None,
            lines: self
                .lines
                .as_ref()
                .map(|lines| kept.iter().map(|i| lines[*i]).collect()),
        })
    }

    /// Where a sample stands, for an error message: `line 12, channel X`, or its time in a binary file.
    pub fn place(&self, sample: usize) -> Place {
        match self.lines.as_ref().and_then(|lines| lines.get(sample)) {
            Some(&line) => Place::line(line).channel(&self.name),
            None => Place::time(self.time_s(sample)).channel(&self.name),
        }
    }
}

/// Details of a file beside its channels. Each may be missing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// The circuit.
    pub venue: Option<String>,
    /// The car.
    pub vehicle: Option<String>,
    /// Who drove.
    pub driver: Option<String>,
    /// The logger.
    pub device: Option<String>,
    /// The session.
    pub session: Option<String>,
    /// The comment of the engineer.
    pub comment: Option<String>,
    /// Date, as written in the file.
    pub log_date: Option<String>,
    /// Time of day, as written in the file.
    pub log_time: Option<String>,
    /// Which part of the outing was exported, as in `entire outing` or `Lap 3`.
    pub range: Option<String>,
}

/// Most channels of a log: more than any logger has, and so few that the memory for each besides its samples does not matter.
pub(super) const MOST_CHANNELS: usize = 1 << 16;

/// Which channels of a log are read, and the limit of memory.
pub(super) struct Reading<'a> {
    /// Chooses channels by their names and units.
    pub choose: &'a dyn Fn(&Recording) -> Result<Vec<bool>>,
    /// Bytes.
    pub limit: u64,
}

impl Reading<'_> {
    /// All channels, within the present limit of memory.
    pub fn whole() -> Self {
        Self {
            choose: &|recording| Ok(vec![true; recording.channels.len()]),
            limit: memory_limit(),
        }
    }

    /// Whether what is `needed` (bytes) to read a file of `size` bytes is allowed.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if it is not.
    pub fn fits(&self, path: &Path, size: u64, needed: u64) -> Result<()> {
        check_memory(path, &format!("{size} bytes"), needed, self.limit)
    }
}

/// A log file as it was logged.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The file.
    pub source: PathBuf,
    /// Its format.
    pub format: Format,
    /// Its channels, in file order, time left out.
    pub channels: Vec<Channel>,
    /// Times at which the car passed the beacon (the finish line), s, ascending.
    pub beacons_s: Vec<f64>,
    /// What the file says about itself.
    pub metadata: Metadata,
}

impl Recording {
    /// Whether the file runs from line to line where nothing in it tells of a line: it is one of this crate's, or the export of a
    /// lap.
    pub(super) fn is_one_lap(&self) -> bool {
        let range = self.metadata.range.as_deref().unwrap_or("");
        self.format == Format::Native || range.to_ascii_lowercase().starts_with("lap")
    }

    /// The channel called `name`, exactly or else without regard to case.
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels
            .iter()
            .find(|c| c.name == name)
            .or_else(|| self.channels.iter().find(|c| c.name.eq_ignore_ascii_case(name)))
    }
}
