//! Rows as a folder keeps them: each a file of its own, written once by the process that holds its claim.

use super::results::Row;
use super::{SweepSettings, Work};
use crate::config::{LARGEST_LOG, read_bytes};
use crate::error::{Error, Result};
use crate::evaluate::portions::Allowance;
use crate::files::lock::LockFile;
use crate::study::framework::state_file::StateFile;
use crate::study::framework::{Progress, Searched, write_json};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::{ControlFlow, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// The folder of the rows.
const ROWS: &str = "rows";

/// A row as it is kept, with how its run went.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KeptRow {
    /// What goes into the tables; without figures where the run came to none.
    #[serde(flatten)]
    pub row: Row,
    /// What the study by itself would have ended with.
    pub exit_code: u8,
    /// The machine that it ran on.
    pub machine: String,
    /// Time that it took (s); runs that go together have an equal share of theirs.
    pub elapsed_s: f64,
    /// Processor time of all threads (s), likewise.
    #[serde(default)]
    pub processor_elapsed_s: f64,
    /// Its search, but for the front, which is the row's.
    #[serde(default)]
    pub searched: Searched,
    /// What it had to tell, and why it failed if it did.
    pub log: Vec<String>,
}

impl KeptRow {
    /// Whether its run came to no figures. Its state is kept, and the next process tries it again.
    pub fn failed(&self) -> bool {
        self.row.figures.is_empty()
    }
}

/// What is asked of a process that works on rows.
pub struct RowsRequest<'a> {
    /// The rows.
    pub rows: Range<usize>,
    /// Whether it waits for rows that other processes are at, and does what these leave.
    pub to_the_end: bool,
    /// Time after which it ends in order.
    pub time_limit: Option<Duration>,
    /// Raised when it is to end.
    pub stop: Arc<AtomicBool>,
    /// Is told of the progress and may end it.
    pub observe: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
}

/// What a process has come to that worked on rows; `sweep --rows --json` prints this.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Part {
    /// `sweep`.
    pub study: &'static str,
    /// The first row, and the one behind the last.
    pub rows: Range<usize>,
    /// How many of them have figures now.
    pub finished: usize,
    /// Those that failed, each with the reason.
    pub failed_runs: Vec<String>,
    /// Those that other processes were at.
    pub elsewhere: Vec<usize>,
    /// What ended it before it had tried all: `time_limit`.
    pub ended_by: Option<String>,
}

impl Part {
    /// In words.
    pub fn to_text(&self) -> String {
        let (count, Range { start, end }) = (self.rows.len(), &self.rows);
        let mut text = format!("Rows {start}..{end}: {} of {count} finished", self.finished);
        if !self.elsewhere.is_empty() {
            text += &format!(", {} at work in other processes", self.elsewhere.len());
        }
        for failed in &self.failed_runs {
            text += &format!("\n{failed}");
        }
        if self.ended_by.is_some() {
            text += "\nThe time limit came before the end: the same command goes on";
        }
        text + "\n`--gather` makes the table of all rows that are there\n"
    }
}

impl<'a> Work<'a> {
    pub(super) fn new(sweep: &'a SweepSettings, folder: &'a Path, studies: PathBuf) -> Result<Self> {
        Ok(Self {
            points: sweep.points()?,
            sweep,
            folder,
            studies,
            memory_limit_mib: super::memory::limit_mib(),
        })
    }

    /// The study of a point.
    pub(super) fn path_of(&self, number: usize) -> PathBuf {
        self.studies.join(format!("{number:05}.toml"))
    }

    /// What keeps the state of a study, beside it.
    pub(super) fn state_file_of(&self, number: usize) -> StateFile {
        StateFile::at(self.path_of(number).with_extension("checkpoint"))
    }

    /// The folder of the rows.
    pub(super) fn rows(&self) -> PathBuf {
        self.folder.join(ROWS)
    }

    /// The file of a row.
    fn row_file(&self, number: usize) -> PathBuf {
        self.rows().join(format!("{number:05}.json"))
    }

    /// Takes a row for this process; nothing if another has it.
    pub(super) fn claim(&self, number: usize) -> Result<Option<LockFile>> {
        LockFile::try_take(&self.row_file(number).with_extension("lock")).map(Result::ok)
    }

    /// A row, if it is there.
    pub(super) fn row(&self, number: usize) -> Result<Option<KeptRow>> {
        let path = self.row_file(number);
        if !path.exists() {
            return Ok(None);
        }
        let text = String::from_utf8_lossy(&read_bytes(&path, LARGEST_LOG)?).into_owned();
        let kept: Option<KeptRow> = serde_json::from_str(&text).ok();
        let own = |kept: &KeptRow| {
            let row = &kept.row;
            row.run == number
                && self
                    .points
                    .get(number)
                    .is_some_and(|p| p.settings == row.settings)
                && has_whole_fronts(kept)
        };
        let found = || text.chars().take(60).collect::<String>();
        let kept = kept.filter(own);
        kept.map(Some)
            .ok_or_else(|| Error::input(&path, "contents", found(), "a row of this sweep"))
    }

    /// Those of these rows that are there.
    pub(super) fn rows_within(&self, rows: Range<usize>) -> Result<BTreeMap<usize, KeptRow>> {
        let there = |number| Ok(self.row(number)?.map(|row| (number, row)));
        rows.filter_map(|number| there(number).transpose()).collect()
    }

    /// Whether a row is done, or has been tried since `before` was read.
    pub(super) fn is_done(&self, number: usize, before: Option<&KeptRow>) -> Result<bool> {
        let now = self.row(number)?;
        Ok(now.is_some_and(|now| !now.failed() || before != Some(&now)))
    }

    /// A row that nothing is known of yet.
    pub(super) fn empty_row(&self, number: usize) -> KeptRow {
        KeptRow {
            row: Row {
                run: number,
                settings: self.points[number].settings.clone(),
                ..Row::default()
            },
            exit_code: 0,
            machine: machine(),
            elapsed_s: 0.0,
            processor_elapsed_s: 0.0,
            searched: Searched::default(),
            log: Vec::new(),
        }
    }

    /// The row of a run that has failed.
    pub(super) fn failed(&self, number: usize, error: &Error) -> KeptRow {
        KeptRow {
            exit_code: error.exit_code(),
            log: vec![error.to_string()],
            ..self.empty_row(number)
        }
    }

    /// Keeps a row, and gives up its state where there are figures.
    pub(super) fn keep(&self, kept: &KeptRow) -> Result<()> {
        let number = kept.row.run;
        write_json(&self.row_file(number), kept)?;
        // Only now: until its row is kept, its state is all there is of it.
        if kept.failed() {
            Ok(())
        } else {
            self.state_file_of(number).done()
        }
    }

    /// An error in the study of a point, said of the sweep.
    pub(super) fn of_point(&self, error: Error, number: usize) -> Error {
        let point = &self.points[number];
        self.sweep.of_point(error, number, point, &self.path_of(number))
    }

    /// Refuses what needs more memory than is allowed.
    pub(super) fn check(&self, kept: &[super::MemoryItem], number: usize) -> Result<Allowance> {
        super::memory::check(kept, self.memory_limit_mib).map_err(|e| self.of_point(e, number))
    }
}

/// Whether all members of a row's fronts, at its end and on its way, have as many costs as there are objectives.
fn has_whole_fronts(kept: &KeptRow) -> bool {
    let Some(first) = kept.row.front.first() else {
        return true;
    };
    let reached = kept.searched.reached.iter().map(|reached| &reached.front);
    let mut members = std::iter::once(&kept.row.front).chain(reached).flatten();
    let named = kept.searched.objectives.len();
    (named == 0 || named == first.len()) && members.all(|member| member.len() == first.len())
}

/// Failures as a summary tells them.
pub(super) fn failures<'a>(rows: impl IntoIterator<Item = &'a KeptRow>) -> Vec<String> {
    let failed = rows.into_iter().filter(|kept| kept.failed());
    failed
        .map(|kept| {
            let why = kept.log.last().map_or("no reason", String::as_str);
            format!("run {:05} failed: {why}", kept.row.run)
        })
        .collect()
}

/// The name of this machine.
fn machine() -> String {
    let linux = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let told = || {
        ["HOSTNAME", "COMPUTERNAME"]
            .iter()
            .find_map(|name| std::env::var(name).ok())
    };
    linux.or_else(told).unwrap_or_default().trim().to_owned()
}
