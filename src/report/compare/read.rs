//! A run's folder, read back.

use crate::config::read_bytes;
use crate::error::{Error, Place, Result};
use crate::files::run_folder::{MANIFEST, SETTINGS, SUMMARY};
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// Greatest size of a file that is read (bytes): what studies write is far smaller, and a foreign file shall not fill the
/// memory.
const MOST_BYTES: u64 = 256 << 20;
/// Figures of one run that are taken in.
const MOST_FIGURES: usize = 20_000;

/// The log of a simulated lap.
const LOGGED: &str = "lap.csv";
/// How the names of a log's columns end.
const LOG_UNITS: [&str; 6] = ["_mps2", "_mps", "_radps", "_rad", "_m", "_s"];

/// One number of a run's summary.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Its place in the summary, as in `best / lap_time / lap_time_fine_s`.
    pub name: String,
    /// The number.
    pub value: f64,
}

/// A lap of a run: columns over the distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// The file that it stands in, without its ending.
    pub name: String,
    /// Names and values of its columns, without units.
    pub columns: Vec<(String, Vec<f64>)>,
}

impl Trace {
    /// The first of these columns that is there.
    pub fn column(&self, names: &[&str]) -> Option<&[f64]> {
        let found = |name: &&str| self.columns.iter().find(|(n, _)| n == name);
        names.iter().find_map(found).map(|(_, values)| values.as_slice())
    }
}

/// A run, as its folder tells of it.
#[derive(Clone, Debug)]
pub struct Run {
    /// The folder.
    pub folder: PathBuf,
    /// Its name in tables and legends.
    pub name: String,
    /// The study.
    pub study: String,
    /// Texts of the manifest, as in `track` and `Silverstone`.
    pub manifest: Vec<(String, String)>,
    /// Numbers of the summary.
    pub figures: Vec<Figure>,
    /// The settings that repeat the run, where there are any.
    pub settings: Option<String>,
    /// Its laps, the best first.
    pub traces: Vec<Trace>,
    /// The reference line of its road with the widths beside it, where it has one.
    pub road: Option<Trace>,
    /// Limits over speed, where it has any.
    pub envelope: Option<Trace>,
    /// Best cost over evaluations, where it kept them.
    pub convergence: Option<Trace>,
}

impl Run {
    /// Reads a folder that a study wrote.
    ///
    /// # Errors
    /// [`Error::Input`] naming the file if this is no run's folder, or a file in it cannot be what the study wrote;
    /// [`Error::Io`] if one cannot be read.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(MANIFEST);
        let Some(text) = read_text(&path)? else {
            let expected = "the folder of a run, which has one";
            return Err(Error::input(&path, "file", "none", expected));
        };
        let manifest = object(&path, &text)?;
        let said = |key: &str| manifest.get(key).and_then(Value::as_str);
        if said("program") != Some("lapswarm") {
            let found = said("program").unwrap_or("none");
            return Err(Error::input(&path, "program", shortened(found), "lapswarm"));
        }
        let Some(study) = said("study") else {
            return Err(Error::input(&path, "study", "none", "the name of a study"));
        };
        let path = folder.join(SUMMARY);
        let Some(text) = read_text(&path)? else {
            let expected = "the figures of a run that has ended";
            return Err(Error::input(&path, "file", "none", expected));
        };
        let mut figures = Vec::new();
        gather(&mut figures, "", &Value::Object(object(&path, &text)?));
        let word = |v: &Value| match v {
            Value::String(s) => Some(s.clone()),
            Value::Number(_) | Value::Bool(_) => Some(v.to_string()),
            _ => None,
        };
        let name = folder
            .canonicalize()
            .ok()
            .and_then(|f| Some(f.file_name()?.to_string_lossy().into_owned()))
            .unwrap_or_else(|| folder.display().to_string());
        let table = |file: &str| -> Result<Option<Trace>> { read_table(&folder.join(file)) };
        Ok(Self {
            folder: folder.to_owned(),
            name,
            study: study.to_owned(),
            manifest: manifest
                .iter()
                .filter_map(|(key, v)| Some((key.clone(), word(v)?)))
                .collect(),
            figures,
            settings: read_text(&folder.join(SETTINGS))?,
            traces: read_traces(folder)?,
            road: table("racetrack_reference.csv")?,
            envelope: table("envelope.csv")?,
            convergence: table("convergence.csv")?,
        })
    }

    /// A text of the manifest.
    pub fn manifest_text(&self, key: &str) -> Option<&str> {
        self.manifest
            .iter()
            .find(|(k, _)| k == key)
            .map(|(_, v)| v.as_str())
    }

    /// A number of the summary.
    pub fn figure(&self, name: &str) -> Option<f64> {
        self.figures.iter().find(|f| f.name == name).map(|f| f.value)
    }
}

/// The file's text; nothing if there is no such file.
fn read_text(path: &Path) -> Result<Option<String>> {
    if !path.exists() {
        return Ok(None);
    }
    String::from_utf8(read_bytes(path, MOST_BYTES)?)
        .map(Some)
        .map_err(|_| Error::input(path, "file", "bytes that are no UTF-8", "text"))
}

fn shortened(text: &str) -> String {
    text.chars().take(60).collect()
}

fn object(path: &Path, text: &str) -> Result<Map<String, Value>> {
    match serde_json::from_str(text) {
        Ok(Value::Object(map)) => Ok(map),
        Ok(_) => Err(Error::input(path, "file", "another value", "a JSON object")),
        Err(e) => Err(Error::input(
            path,
            Place::line(e.line()),
            shortened(&e.to_string()),
            "JSON",
        )),
    }
}

/// Numbers by their places; entries of lists go by their names, and lists of anything else are left out.
fn gather(figures: &mut Vec<Figure>, place: &str, value: &Value) {
    let within = |name: &str| match place {
        "" => name.to_owned(),
        place => format!("{place} / {name}"),
    };
    match value {
        _ if figures.len() >= MOST_FIGURES => {}
        Value::Number(n) => figures.extend(n.as_f64().map(|value| Figure {
            name: place.to_owned(),
            value,
        })),
        Value::Object(map) => map.iter().for_each(|(key, v)| gather(figures, &within(key), v)),
        Value::Array(list) => {
            for entry in list {
                if let Some(name) = entry.get("name").and_then(Value::as_str) {
                    gather(figures, &within(name), entry);
                }
            }
        }
        _ => {}
    }
}

/// A table of numbers with a header; empty cells are gaps.
pub(crate) fn read_table(path: &Path) -> Result<Option<Trace>> {
    let Some(text) = read_text(path)? else {
        return Ok(None);
    };
    // A racetrack's header begins with the mark of a comment, a log's comments come before its header.
    let log = path.file_name().is_some_and(|name| name == LOGGED);
    let mut reader = csv::ReaderBuilder::new()
        .comment(log.then_some(b'#'))
        .from_reader(text.as_bytes());
    let refuse = |e: csv::Error| {
        let line = e.position().map_or(1, csv::Position::line);
        Error::input(
            path,
            Place::line(line as usize),
            shortened(&e.to_string()),
            "a table with a header",
        )
    };
    let names: Vec<String> = reader
        .headers()
        .map_err(refuse)?
        .iter()
        // Without units, and without the mark of a comment that the racetrack format begins with.
        .map(|head| head.split_once(" (").map_or(head, |(name, _)| name))
        .map(|name| name.trim_start_matches('#').trim())
        .map(|name| {
            let unit = LOG_UNITS.iter().find_map(|unit| name.strip_suffix(unit));
            unit.filter(|_| log).unwrap_or(name).to_owned()
        })
        .collect();
    let mut columns: Vec<(String, Vec<f64>)> = names.into_iter().map(|n| (n, Vec::new())).collect();
    for record in reader.records() {
        let record = record.map_err(refuse)?;
        for ((_, values), cell) in columns.iter_mut().zip(record.iter()) {
            // Words are gaps in a table of numbers.
            values.push(cell.trim().parse().unwrap_or(f64::NAN));
        }
    }
    Ok(Some(Trace {
        name: path
            .file_stem()
            .map_or_else(String::new, |s| s.to_string_lossy().into_owned()),
        columns,
    }))
}

/// Laps that the folder holds: lines by their lap time, then what was fitted to a log.
fn read_traces(folder: &Path) -> Result<Vec<Trace>> {
    let entries = folder.read_dir().map_err(|e| Error::io(folder, "read", e))?;
    let mut files: Vec<String> = entries
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| {
            (name.starts_with("line_") && name.ends_with(".csv"))
                || matches!(name.as_str(), "traces.csv" | "drive.csv" | LOGGED)
        })
        .collect();
    files.sort();
    let mut traces = Vec::new();
    for file in &files {
        let table = read_table(&folder.join(file))?;
        let rows = |t: &Trace| t.column(&["station", "distance"]).map_or(0, <[f64]>::len);
        traces.extend(table.filter(|t| rows(t) > 1));
    }
    let time = |t: &Trace| {
        let last = t.column(&["time"]).and_then(|time| time.last().copied());
        last.filter(|v| v.is_finite()).unwrap_or(f64::INFINITY)
    };
    traces.sort_by(|a, b| time(a).total_cmp(&time(b)));
    Ok(traces)
}
