//! The thesis's tables, chapter by chapter: each is a study or a sweep, whose figures stand beside the published ones.
//!
//! Each table has a folder of its own, with the page of its study or sweep. A study may read files of the tables before it. A table that
//! is finished is not done again, so a reproduction that was interrupted goes on where it stopped.

mod chapter;
mod results;

pub use chapter::{Chapter, Drawing, EvaluatedOn, Item, Task, numbers};
pub use results::{Compared, Summary, TableSummary};

use crate::config::kinds::Choice;
use crate::config::read_text;
use crate::error::{Error, Result};
use crate::files::run_folder::{MANIFEST, SETTINGS, STATE, SUMMARY};
use crate::report::write_whole;
use crate::study::framework::{Answer, Figures, Progress, Request, TIME_LIMIT, TimeLimit, write_json};
use crate::study::registry::Registered;
use crate::study::sweep::{self, KeptRow, Row, RowsRequest, SWEEP_FILE, SweepSettings};
use cpu_time::ProcessTime;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// What a folder of a reproduction holds from its beginning: what was asked for.
pub const REPRODUCE_FILE: &str = "reproduce.toml";
/// The page of a table, a drawing, and the whole.
pub const PAGE: &str = "report.html";
/// Times of the tables.
const TIMES: &str = "times.json";

/// What is to be reproduced.
#[derive(Clone, Debug)]
pub struct ReproduceSettings {
    /// The chapters.
    pub chapters: Vec<Chapter>,
    /// Whether the quick subset is enough.
    pub quick: bool,
    /// Where candidates are evaluated.
    pub on: EvaluatedOn,
}

/// How it is reproduced.
pub struct ReproduceRequest<'a> {
    /// Time between saves of the state of a study at work.
    pub save_every: Duration,
    /// Time after which it ends in order with what it has.
    pub time_limit: Option<Duration>,
    /// Memory that a study may take (MiB).
    pub memory_limit_mib: u64,
    /// Raised when it is to end.
    pub stop: Arc<AtomicBool>,
    /// Is told of the progress and may end it.
    pub observe: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
    /// Draws pictures into a folder, with a page [`PAGE`].
    pub draw: &'a dyn Fn(&Drawing, &Path) -> Result<()>,
}

/// What a table took, over all processes that worked on it, and what failed in the last of them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Took {
    elapsed_s: f64,
    processor_s: f64,
    failed: Vec<String>,
}

impl ReproduceSettings {
    /// These chapters, all of them if none is named.
    ///
    /// # Errors
    /// [`Error::Input`] if there is none of such a number.
    pub fn new(chapters: &[u8], quick: bool, on: EvaluatedOn) -> Result<Self> {
        let mut asked = if chapters.is_empty() {
            numbers()
        } else {
            chapters.to_vec()
        };
        asked.sort_unstable();
        asked.dedup();
        Ok(Self {
            chapters: asked.into_iter().map(Chapter::load).collect::<Result<_>>()?,
            quick,
            on,
        })
    }

    /// As the folder keeps it: what was asked for, to resume nothing else.
    pub fn to_toml(&self) -> String {
        let numbers: Vec<String> = self.chapters.iter().map(|c| c.number.to_string()).collect();
        let mut text = format!("chapters = [{}]\nquick = {}\n", numbers.join(", "), self.quick);
        if let Some(backend) = self.on.backend {
            text += &format!("backend = \"{}\"\n", backend.name());
        }
        if let Some(adapter) = &self.on.adapter {
            text += &format!("adapter = {}\n", toml::Value::String(adapter.clone()));
        }
        text
    }

    /// Its tables, each with its chapter.
    fn items(&self) -> impl Iterator<Item = (&Chapter, &Item)> {
        self.chapters
            .iter()
            .flat_map(|chapter| chapter.items.iter().map(move |item| (chapter, item)))
    }

    /// What would be done, a line for each table.
    ///
    /// # Errors
    /// Those of [`Item::task`] and of the sweeps.
    pub fn plan(&self) -> Result<Vec<String>> {
        let line = |(chapter, item): (&Chapter, &Item)| {
            let what = match item.task(self.quick, &self.on)? {
                Task::Study(study, _) => format!("one run of {}", study.name()),
                Task::Sweep(sweep) => format!("{} runs of {}", sweep.runs(), sweep.study.name()),
            };
            Ok(format!("chapter {}: {}, {what}", chapter.number, item.title))
        };
        self.items().map(line).collect()
    }
}

/// Writes what is asked for into a folder that holds nothing yet.
///
/// # Errors
/// [`Error::Io`] if it cannot be written.
pub fn begin(settings: &ReproduceSettings, folder: &Path) -> Result<()> {
    write_whole(folder.join(REPRODUCE_FILE), settings.to_toml().as_bytes())
}

/// Does what is left of a reproduction that is begun in `folder`, and lays its figures beside the published ones.
///
/// # Errors
/// [`Error::Input`] if the folder holds another one; [`Error::Interrupted`] if it was interrupted; those of studies and sweeps.
pub fn reproduce(
    settings: &ReproduceSettings,
    folder: &Path,
    request: ReproduceRequest<'_>,
) -> Result<Summary> {
    let file = folder.join(REPRODUCE_FILE);
    if read_text(&file)? != settings.to_toml() {
        let expected = "the chapters that the folder was begun with";
        return Err(Error::input(file, "resume", "others, asked for now", expected));
    }
    let time_limit = TimeLimit::begin(request.time_limit, &request.stop);
    let mut times = read_times(folder);
    let mut tables = Vec::new();
    let mut ended_by = None;
    for (chapter, item) in settings.items() {
        let (began, processor) = (Instant::now(), ProcessTime::now());
        let done = {
            let observe = &mut *request.observe;
            let mut told = |progress: &Progress| {
                let mut progress = progress.clone();
                progress.stage = format!("{}: {}", item.name, progress.stage);
                match observe(&progress) {
                    ControlFlow::Continue(()) if time_limit.is_over() => ControlFlow::Break(()),
                    flow => flow,
                }
            };
            let mut at_work = AtWork {
                folder: &folder.join(&item.name),
                save_every: request.save_every,
                memory_limit_mib: request.memory_limit_mib,
                stop: &request.stop,
                observe: &mut told,
            };
            match item.task(settings.quick, &settings.on)? {
                Task::Study(study, text) => at_work.study(study, &text, &item.figures),
                Task::Sweep(sweep) => at_work.sweep(&sweep),
            }
        };
        let took = times.entry(item.name.clone()).or_default();
        if !matches!(done, Ok(Done { found: true, .. })) {
            took.elapsed_s += began.elapsed().as_secs_f64();
            took.processor_s += processor.elapsed().as_secs_f64();
            if let Ok(done) = &done {
                took.failed.clone_from(&done.failed);
            }
        }
        let took = took.clone();
        write_json(&folder.join(TIMES), &times)?;
        match done {
            Ok(done) => tables.push(TableSummary::new(chapter, item, done.rows, took)),
            Err(Error::Interrupted(_)) if time_limit.has_ended_it() => {
                ended_by = Some(TIME_LIMIT.to_owned());
                break;
            }
            Err(Error::Interrupted(_)) => return Err(Error::Interrupted(folder.to_owned())),
            Err(error) => return Err(error),
        }
    }
    for drawing in settings.chapters.iter().flat_map(|chapter| &chapter.drawings) {
        let folder = folder.join(&drawing.name);
        if ended_by.is_none() && !folder.join(PAGE).is_file() {
            (request.draw)(drawing, &folder)?;
        }
    }
    let summary = Summary::new(settings, tables, ended_by);
    summary.write(folder, settings)?;
    Ok(summary)
}

/// Times of earlier processes; none where they cannot be read, since no result depends on them.
fn read_times(folder: &Path) -> BTreeMap<String, Took> {
    let text = read_text(&folder.join(TIMES)).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

/// What there is of a table.
struct Done {
    rows: Vec<Row>,
    /// What failed, and why.
    failed: Vec<String>,
    /// Whether an earlier process had finished it.
    found: bool,
}

/// A table at work.
struct AtWork<'a> {
    folder: &'a Path,
    save_every: Duration,
    memory_limit_mib: u64,
    stop: &'a Arc<AtomicBool>,
    observe: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
}

impl AtWork<'_> {
    /// One run with its own page, unless it is there.
    fn study(
        &mut self,
        study: &'static dyn Registered,
        text: &str,
        asked: &[chapter::Asked],
    ) -> Result<Done> {
        let found = self.folder.join(MANIFEST).is_file() && !self.folder.join(STATE).is_file();
        let mut failed = Vec::new();
        if !found {
            let resume = self.folder.join(STATE).is_file();
            let file = self.folder.join(SETTINGS);
            // Files are those of the tables before it: `../7_1_scenarios/line.csv`.
            let chapter = self.folder.parent().unwrap_or(Path::new(""));
            let text = &text.replace("../", &format!("{}/", chapter.display()));
            let answer = study.run(Request {
                file: None,
                text: (!resume).then_some((text, &*file)),
                flags: &[],
                out: Some(self.folder),
                resume,
                save_every: self.save_every,
                // The whole has one.
                time_limit: None,
                memory_limit_mib: self.memory_limit_mib,
                dry_run: false,
                stop: Arc::clone(self.stop),
                observe: &mut *self.observe,
            })?;
            if let Answer::Finished(finished) = answer {
                match finished.verdict {
                    // Its figures are there all the same.
                    Err(Error::Study(missed)) => failed.push(missed),
                    verdict => verdict?,
                }
            }
        }
        let path = self.folder.join(SUMMARY);
        let summary: serde_json::Value = serde_json::from_str(&read_text(&path)?)
            .map_err(|e| Error::input(&path, "contents", e.to_string(), "the summary of a study"))?;
        let at = |key: &str| summary.pointer(&format!("/{}", key.replace('.', "/")))?.as_f64();
        let each = asked.iter().flat_map(|asked| asked.each(|key| at(key).is_some()));
        let keys = each.map(|asked| asked.figure).chain(["evaluations".to_owned()]);
        let figures: Figures = keys
            .filter_map(|key| Some((key.clone(), Some(at(&key)?))))
            .collect();
        let row = Row {
            figures,
            ..Row::default()
        };
        Ok(Done {
            rows: vec![row],
            failed,
            found,
        })
    }

    /// All rows of a sweep that are not there, and its page.
    fn sweep(&mut self, settings: &SweepSettings) -> Result<Done> {
        if !self.folder.join(SWEEP_FILE).is_file() {
            sweep::begin(settings, self.folder)?;
        }
        let rows = sweep::kept_rows(settings, self.folder)?;
        let found = rows.len() == settings.runs() && !rows.values().any(KeptRow::failed);
        if !found {
            sweep::run_rows(
                settings,
                self.folder,
                RowsRequest {
                    rows: 0..settings.runs(),
                    to_the_end: true,
                    time_limit: None,
                    stop: Arc::clone(self.stop),
                    observe: &mut *self.observe,
                },
            )?;
        }
        let summary = sweep::gather(settings, self.folder)?;
        let kept = sweep::kept_rows(settings, self.folder)?;
        let mut rows = summary.rows;
        for row in &mut rows {
            let took = kept.get(&row.run).map(|kept| kept.elapsed_s);
            row.figures.insert("elapsed_s".to_owned(), took);
        }
        Ok(Done {
            rows,
            failed: summary.failed_runs,
            found,
        })
    }
}
