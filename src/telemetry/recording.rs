//! A log file as it was logged, before anybody decided what its channels mean.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{csv_native, motec_csv, motec_ld, text};
use crate::config::{LARGEST_LOG, check_memory, memory_limit, read_bytes};
use crate::{Error, Result};

/// The file formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// This crate's own CSV: SI, ISO 8855, units in the column names.
    Native,
    /// A CSV export of MoTeC i2, or one laid out like it (AiM Race Studio writes the same layout).
    MotecCsv,
    /// MoTeC's binary `.ld`.
    MotecLd,
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
    /// The first sample that is not a finite number. A channel nobody needs may have gaps, so this becomes an error
    /// only when the channel is used.
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

    /// Where a sample stands, for an error message: `line 12, channel X`, or its time in a binary file.
    pub fn place(&self, sample: usize) -> String {
        match self.lines.as_ref().and_then(|lines| lines.get(sample)) {
            Some(line) => format!("line {line}, channel {}", self.name),
            None => format!("channel {}, t = {:.3} s", self.name, self.time_s(sample)),
        }
    }
}

/// What a file says about itself beside its channels. Everything may be missing.
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
    /// The comment the engineer left.
    pub comment: Option<String>,
    /// Date, as written in the file.
    pub log_date: Option<String>,
    /// Time of day, as written in the file.
    pub log_time: Option<String>,
    /// Which part of the outing was exported, as in `entire outing` or `Lap 3`.
    pub range: Option<String>,
}

/// The most channels of a log: more than any logger has, and few enough that what is kept of each besides its samples does not
/// count.
pub(super) const MOST_CHANNELS: usize = 1 << 16;

/// What of a log is read, and into how much memory that has to fit.
pub(super) struct Reading<'a> {
    /// Which of the channels, of which names and units are known and nothing else.
    pub choose: &'a dyn Fn(&Recording) -> Result<Vec<bool>>,
    /// Bytes.
    pub limit: u64,
}

impl Reading<'_> {
    /// All channels, into what is allowed at present.
    fn whole() -> Self {
        Self {
            choose: &|recording| Ok(vec![true; recording.channels.len()]),
            limit: memory_limit(),
        }
    }

    /// Whether what is `needed` (bytes) to read a file of `size` bytes is allowed.
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
    /// Reads a log file; content decides the format, and the extension where content does not.
    ///
    /// # Errors
    /// [`Error::Io`] when the file cannot be read; [`Error::Input`], naming the line or channel, when it holds
    /// something it must not.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::read_some(path.as_ref(), &Reading::whole())
    }

    /// As [`Recording::read`], of the channels that are chosen; the others have no samples.
    pub(super) fn read_some(path: &Path, reading: &Reading<'_>) -> Result<Self> {
        if let Ok(told) = std::fs::metadata(path) {
            // It is in memory as it is while it is read.
            reading.fits(path, told.len(), told.len())?;
        }
        let bytes = read_bytes(path, LARGEST_LOG.min(reading.limit))?;
        let mut recording = Self::parse_some(Cow::Owned(bytes), path, reading)?;
        if recording.format == Format::MotecLd {
            recording.beacons_s = motec_ld::beacons_beside(path)?;
        }
        Ok(recording)
    }

    /// Reads a log from memory; `path` is its name in error messages, and its extension counts where the content
    /// does not decide the format. The `.ldx` file that may lie beside a `.ld` is not looked for.
    ///
    /// # Errors
    /// As for [`Recording::read`].
    pub fn parse(bytes: &[u8], path: impl AsRef<Path>) -> Result<Self> {
        Self::parse_some(Cow::Borrowed(bytes), path.as_ref(), &Reading::whole())
    }

    fn parse_some(bytes: Cow<'_, [u8]>, path: &Path, reading: &Reading<'_>) -> Result<Self> {
        let is_ld = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ld"));
        if is_ld || motec_ld::is_ld(&bytes) {
            return motec_ld::parse(bytes, path, reading);
        }
        let size = bytes.len() as u64;
        // What is no UTF-8 is written anew, at most twice as long.
        reading.fits(path, size, text::decoded_size(&bytes))?;
        let text = text::decode(&bytes);
        let mut rows = text::Rows::new(&text, path, true);
        let Some(first) = rows.next().transpose()? else {
            return Err(Error::input(path, "line 1", "no rows", "a log"));
        };
        if first.cells.iter().any(|c| c == csv_native::TIME) {
            csv_native::parse(&text, path, reading)
        } else if first.cell(0).eq_ignore_ascii_case("Format") {
            motec_csv::parse(&text, path, reading)
        } else {
            Err(Error::input(
                path,
                format!("line {}", first.line),
                text::shown(first.cell(0)),
                "a header row with a time_s column, a MoTeC CSV export (first cell \"Format\"), or a .ld file",
            ))
        }
    }

    /// The channel called `name`, exactly or else without regard to case.
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels
            .iter()
            .find(|c| c.name == name)
            .or_else(|| self.channels.iter().find(|c| c.name.eq_ignore_ascii_case(name)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides_the_format() {
        let native = Recording::parse(b"# x\ntime_s,vx_mps\n0,1\n1,2\n", "a.txt").unwrap();
        assert_eq!(native.format, Format::Native);
        let motec = b"\"Format\",\"MoTeC CSV File\"\n\nTime,V\ns,km/h\n0,1\n1,2\n";
        assert_eq!(Recording::parse(motec, "a.csv").unwrap().format, Format::MotecCsv);
    }

    #[test]
    fn what_is_no_log_is_refused_with_what_was_found() {
        for (bytes, found) in [(&b""[..], "no rows"), (b"hello;there", "hello;there")] {
            let error = Recording::parse(bytes, "a.csv").unwrap_err().to_string();
            assert!(
                error.contains("a.csv: line 1") && error.contains(found),
                "{error}"
            );
        }
        let missing = Recording::read("no/such/file.csv").unwrap_err();
        assert!(matches!(missing, Error::Io { action: "read", .. }));
    }
}
