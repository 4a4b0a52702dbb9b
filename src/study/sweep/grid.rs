//! The grid of settings of a sweep.

use crate::config::{Document, folder_of, read_text};
use crate::error::{Error, Result};
use crate::study::registry::{self, Registered};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// A sweep: which study, what all of its runs share, and what they differ in.
#[derive(Clone, Debug)]
pub struct SweepSettings {
    /// The study.
    pub study: &'static dyn Registered,
    /// Keys that all runs share.
    base: Table,
    /// Values of each key of the grid, in the order of the file's keys; the last key changes fastest.
    axes: Vec<(String, Vec<Value>)>,
    /// The sweep file, as it was read.
    text: String,
    file: PathBuf,
}

/// One run of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// What it differs in, key by key, as text.
    pub settings: BTreeMap<String, String>,
    /// Its study file, in which files are relative to the sweep's.
    pub study: String,
}

macro_rules! bundled {
    ($($name:literal),*) => {
        [$(($name, include_str!(concat!("../../../data/sweeps/", $name, ".toml")))),*]
    };
}

/// Sweep files that come with the crate, by name.
const BUNDLED: [(&str, &str); 6] = bundled!(
    "thesis_inertia",
    "thesis_population",
    "thesis_lines",
    "front",
    "norms",
    "sections"
);

/// Most runs of a sweep.
const MOST_RUNS: usize = 100_000;
/// Most bytes of all studies together.
const MOST_TEXT: usize = 256 << 20;
/// The axis whose values are tables of keys that change together.
const TOGETHER: &str = "together";
/// Most tables within tables that a key of the grid goes through.
const MOST_DOTS: usize = 8;
impl SweepSettings {
    /// A bundled sweep by name, or a sweep file.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read, [`Error::Input`] naming what is wrong in it.
    pub fn load(name_or_path: &str) -> Result<Self> {
        if let Some((name, text)) = BUNDLED.iter().find(|(name, _)| *name == name_or_path) {
            return Self::parse(Path::new(name), text);
        }
        let path = Path::new(name_or_path);
        if path.extension().is_none() {
            let known: Vec<&str> = BUNDLED.iter().map(|(name, _)| *name).collect();
            let expected = format!("a TOML file, or one of {}", known.join(", "));
            return Err(Error::input(path, "the sweep", name_or_path, expected));
        }
        Self::parse(path, &read_text(path)?)
    }

    /// Reads a sweep file's text.
    ///
    /// # Errors
    /// [`Error::Input`] naming what is wrong in it.
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        // Says what is wrong in text that is no TOML.
        Document::parse(path, text)?;
        let mut root: Table = text.parse().unwrap_or_default();
        let refuse = |place: &str, found: String, expected: &str| Error::input(path, place, found, expected);
        let asked = root.remove("study");
        let study = asked.as_ref().and_then(|name| registry::named(name.as_str()?));
        let study = study.ok_or_else(|| {
            let found = asked.map_or("nothing".to_owned(), |v| v.to_string());
            refuse(
                "study",
                found,
                &format!("one of {}", registry::names().join(", ")),
            )
        })?;
        let base = match root.remove("base") {
            None => Table::new(),
            Some(Value::Table(base)) => base,
            Some(other) => return Err(refuse("base", other.to_string(), "a table of the study's keys")),
        };
        let Some(Value::Table(grid)) = root.remove("grid") else {
            let expected = "a table of the study's keys, each with a list of values";
            return Err(refuse("grid", "no such table".to_owned(), expected));
        };
        if let Some((key, value)) = root.iter().next() {
            let expected = "no other keys than study, base and grid";
            return Err(refuse(key, value.to_string(), expected));
        }
        let axis = |(key, value): (String, Value)| match value {
            _ if key.matches('.').count() > MOST_DOTS => {
                let key: String = key.chars().take(60).collect();
                Err(refuse("grid", key, "keys that go through a few tables at most"))
            }
            Value::Array(values) if key == TOGETHER && values.iter().any(|v| !v.is_table()) => {
                let found = values
                    .iter()
                    .find(|v| !v.is_table())
                    .map_or(String::new(), Value::to_string);
                Err(refuse(
                    "grid, together",
                    found,
                    "tables of the study's keys, as { a = 1, b = 2 }",
                ))
            }
            Value::Array(values) if !values.is_empty() => Ok((key, values)),
            other => {
                let place = format!("grid, {key}");
                Err(refuse(
                    &place,
                    other.to_string(),
                    "a list of values, at least one",
                ))
            }
        };
        let mut axes: Vec<(String, Vec<Value>)> = grid.into_iter().map(axis).collect::<Result<_>>()?;
        // Seeds change fastest, so that the runs that a median is taken over lie beside each other.
        axes.sort_by_key(|(key, _)| key == "seed");
        let runs = axes.iter().try_fold(1usize, |n, (_, v)| n.checked_mul(v.len()));
        let Some(runs) = runs.filter(|n| *n <= MOST_RUNS) else {
            let found = runs.map_or("more runs than can be counted".to_owned(), |n| {
                format!("{n} runs")
            });
            return Err(refuse("grid", found, "at most 100000 runs"));
        };
        // Every run has a study of its own, with all of the base in it.
        if runs.saturating_mul(text.len()) > MOST_TEXT {
            let found = format!("{runs} runs of {} bytes", text.len());
            let expected = format!("studies of {MOST_TEXT} bytes together at most");
            return Err(refuse("grid", found, &expected));
        }
        Ok(Self {
            study,
            base,
            axes,
            text: text.to_owned(),
            file: path.to_owned(),
        })
    }

    /// The sweep file, as it was read.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The sweep file.
    pub(super) fn file(&self) -> &Path {
        &self.file
    }

    /// How many runs there are.
    pub fn runs(&self) -> usize {
        self.axes.iter().map(|(_, values)| values.len()).product()
    }

    /// The folder that files named in it are relative to.
    pub(super) fn folder(&self) -> &Path {
        folder_of(&self.file)
    }

    /// The keys of the grid, the seed last.
    pub fn keys(&self) -> Vec<&str> {
        self.axes.iter().map(|(key, _)| key.as_str()).collect()
    }

    /// Every point of the grid.
    ///
    /// # Errors
    /// [`Error::Input`] if a dotted key goes through something that is no table.
    pub fn points(&self) -> Result<Vec<Point>> {
        (0..self.runs())
            .map(|number| {
                let mut left = number;
                let mut chosen: Vec<(&str, &Value)> = Vec::with_capacity(self.axes.len());
                for (key, values) in self.axes.iter().rev() {
                    chosen.push((key, &values[left % values.len()]));
                    left /= values.len();
                }
                let mut study = self.base.clone();
                for (key, value) in chosen.iter().rev() {
                    match value {
                        Value::Table(keys) if *key == TOGETHER => keys
                            .iter()
                            .try_for_each(|(key, value)| self.set(&mut study, key, value))?,
                        _ => self.set(&mut study, key, value)?,
                    }
                }
                Ok(Point {
                    settings: chosen
                        .iter()
                        .map(|(key, value)| ((*key).to_owned(), unquoted(value)))
                        .collect(),
                    study: study.to_string(),
                })
            })
            .collect()
    }

    /// An error in the study of a point, said of the sweep: that study's file is made by the program.
    pub(super) fn of_point(&self, error: Error, number: usize, point: &Point, study: &Path) -> Error {
        match error {
            Error::Input {
                file,
                place,
                found,
                expected,
            } if Path::new(&file) == study || file == "the study" => {
                // Lines are those of the made file.
                let place = place.field.map_or_else(String::new, |field| format!(", {field}"));
                let at: Vec<String> = point.settings.iter().map(|(k, v)| format!("{k} {v}")).collect();
                let place = format!("run {} ({}){place}", number + 1, at.join(", "));
                Error::input(&self.file, place, found, expected)
            }
            other => other,
        }
    }

    /// Sets `a.b` of nested tables; a table's keys are added to what is there.
    fn set(&self, table: &mut Table, key: &str, value: &Value) -> Result<()> {
        if let Some((first, rest)) = key.split_once('.') {
            let inner = table.entry(first).or_insert_with(|| Value::Table(Table::new()));
            return match inner {
                Value::Table(inner) => self.set(inner, rest, value),
                _ => {
                    let place = format!("grid, {key}");
                    Err(Error::input(
                        &self.file,
                        place,
                        "a key through no table",
                        "a key of the study",
                    ))
                }
            };
        }
        if let (Some(Value::Table(there)), Value::Table(more)) = (table.get_mut(key), value) {
            there.extend(more.clone());
        } else {
            table.insert(key.to_owned(), value.clone());
        }
        Ok(())
    }
}

/// A value as a cell of a table.
fn unquoted(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Table(table) => {
            let cells: Vec<String> = table
                .iter()
                .map(|(key, value)| format!("{key} {}", unquoted(value)))
                .collect();
            cells.join(", ")
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Work;
    use super::*;

    #[test]
    fn bundled_sweeps_are_grids_of_sound_studies() {
        for (name, _) in BUNDLED {
            let sweep = SweepSettings::load(name).expect(name);
            let points = sweep.points().expect(name);
            assert!(points.len() >= 9, "{name}");
            let work = Work::new(&sweep, Path::new(""), PathBuf::new()).expect(name);
            sweep.study.check_points(&work).expect(name);
        }
    }

    #[test]
    fn seeds_change_fastest_and_tables_are_joined() {
        let text = "study = \"identify\"\n[base.swarm]\npopulation = 9\n[grid]\nseed = [1, 2]\n\"swarm.iterations\" = [3, 4]\n";
        let sweep = SweepSettings::parse(Path::new("s.toml"), text).expect("a sweep");
        let points = sweep.points().expect("points");
        let seeds: Vec<&str> = points.iter().map(|p| p.settings["seed"].as_str()).collect();
        assert_eq!(seeds, ["1", "2", "1", "2"]);
        assert!(points[3].study.contains("population = 9") && points[3].study.contains("iterations = 4"));
    }

    #[test]
    fn keys_change_together() {
        let text = "study = \"raceline\"\n[grid]\ntogether = [{ cognitive = 1, social = 3 }, { cognitive = 3, social = 1 }]\n";
        let sweep = SweepSettings::parse(Path::new("s.toml"), text).expect("a sweep");
        let points = sweep.points().expect("points");
        assert_eq!(points[1].settings["together"], "cognitive 3, social 1");
        assert_eq!(points[1].study, "cognitive = 3\nsocial = 1\n");
    }

    #[test]
    fn what_is_no_sweep_is_refused_by_place() {
        for (text, place) in [
            ("study = \"cook\"\n", "study"),
            ("study = \"identify\"\n", "grid"),
            ("study = \"identify\"\n[grid]\nseed = 1\n", "grid, seed"),
            ("study = \"identify\"\n[grid]\ntogether = [1]\n", "grid, together"),
            ("study = \"identify\"\nmore = 1\n[grid]\nseed = [1]\n", "more"),
            ("study = \n", "line 1"),
        ] {
            let error = SweepSettings::parse(Path::new("s.toml"), text)
                .expect_err(text)
                .to_string();
            assert!(error.contains(place), "{error}");
        }
    }
}
