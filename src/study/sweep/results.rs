//! Rows of a sweep, and medians over its seeds.

use super::words::is_detail;
use super::{KeptRow, SweepSettings};
use crate::error::Result;
use crate::files::run_folder::SUMMARY;
use crate::files::write_whole_by;
use crate::report::{Rows, Table};
use crate::study::framework::write_json;
use crate::swarm::comparison::quartiles;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufWriter, Write};
use std::path::Path;

/// All rows, one JSON object per line.
const ROWS: &str = "rows.jsonl";

/// One run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Its number, from 0.
    pub run: usize,
    /// What it differed in.
    pub settings: BTreeMap<String, String>,
    /// What came of it.
    pub figures: BTreeMap<String, Option<f64>>,
    /// What went wrong with devices and was got over; runs that go together share their evaluator's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub device_faults: Vec<String>,
    /// Its front's objectives, row by row; kept until all fronts are compared.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub front: Vec<Vec<f64>>,
}

/// Median and quartiles of a figure over the seeds of one setting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// A quarter is below.
    pub lower_quartile: f64,
    /// Half is below.
    pub median: f64,
    /// A quarter is above.
    pub upper_quartile: f64,
}

/// Runs of the same settings but for the seed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Group {
    /// The settings.
    pub settings: BTreeMap<String, String>,
    /// Runs.
    pub runs: usize,
    /// Each figure over the runs that have it.
    pub figures: BTreeMap<String, Spread>,
}

/// The figures of a sweep; `--json` prints this.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// `sweep`.
    pub study: &'static str,
    /// Every run.
    pub rows: Vec<Row>,
    /// Medians over the seeds.
    pub groups: Vec<Group>,
    /// What went wrong with devices and was got over, each with the runs that it befell.
    pub device_faults: Vec<String>,
    /// Runs that came to no figures, each with the reason.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failed_runs: Vec<String>,
    /// Runs that are not done yet.
    #[serde(skip_serializing_if = "is_none_left")]
    pub missing_runs: usize,
    /// What ended the sweep before it was done: `time_limit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ended_by: Option<String>,
}

fn is_none_left(missing: &usize) -> bool {
    *missing == 0
}

/// Faults with the numbers of the runs that met them, as in the file names of their studies.
fn faults_by_run(rows: &[Row]) -> Vec<String> {
    let mut faults: Vec<(&String, Vec<String>)> = Vec::new();
    for row in rows {
        for fault in &row.device_faults {
            let number = format!("{:05}", row.run);
            match faults.iter_mut().find(|(known, _)| *known == fault) {
                // More than once in a run is listed once.
                Some((_, runs)) if runs.last() != Some(&number) => runs.push(number),
                Some(_) => {}
                None => faults.push((fault, vec![number])),
            }
        }
    }
    let told = faults.into_iter().map(|(fault, runs)| {
        let noun = if runs.len() == 1 { "run" } else { "runs" };
        format!("{noun} {}: {fault}", runs.join(", "))
    });
    told.collect()
}

/// Settings but for the seed, each with its rows, in the order in which they were run.
fn by_settings(rows: &[Row]) -> Vec<(BTreeMap<String, String>, Vec<usize>)> {
    let mut groups: Vec<(BTreeMap<String, String>, Vec<usize>)> = Vec::new();
    for (number, row) in rows.iter().enumerate() {
        let mut settings = row.settings.clone();
        settings.remove("seed");
        match groups.iter_mut().find(|(s, _)| *s == settings) {
            Some((_, members)) => members.push(number),
            None => groups.push((settings, vec![number])),
        }
    }
    groups
}

/// Medians over runs that differ in nothing but the seed, in the order in which they were run.
pub fn medians(rows: &[Row]) -> Vec<Group> {
    let group = |(settings, members): (BTreeMap<String, String>, Vec<usize>)| {
        let mut values: BTreeMap<&String, Vec<f64>> = BTreeMap::new();
        for (name, figure) in members.iter().flat_map(|row| &rows[*row].figures) {
            values.entry(name).or_default().extend(figure);
        }
        let spread = |(name, values): (&String, Vec<f64>)| {
            let [lower_quartile, median, upper_quartile] = quartiles(&values);
            let spread = Spread {
                lower_quartile,
                median,
                upper_quartile,
            };
            (!values.is_empty()).then(|| (name.clone(), spread))
        };
        Group {
            settings,
            runs: members.len(),
            figures: values.into_iter().filter_map(spread).collect(),
        }
    };
    by_settings(rows).into_iter().map(group).collect()
}

/// Writes all rows into one file, one JSON object per line.
pub(super) fn write_rows(folder: &Path, kept: &[KeptRow]) -> Result<()> {
    write_whole_by(folder.join(ROWS), |file| {
        let mut file = BufWriter::new(file);
        for KeptRow { row, .. } in kept {
            serde_json::to_writer(&mut file, row)?;
            file.write_all(b"\n")?;
        }
        file.flush()
    })
}

impl Summary {
    /// The figures of these rows, without their fronts.
    pub(super) fn new(kept: &[KeptRow], failed_runs: Vec<String>, missing_runs: usize) -> Self {
        let without_front = |kept: &KeptRow| Row {
            front: Vec::new(),
            ..kept.row.clone()
        };
        let rows: Vec<Row> = kept.iter().map(without_front).collect();
        Self {
            study: "sweep",
            groups: medians(&rows),
            device_faults: faults_by_run(&rows),
            failed_runs,
            missing_runs,
            ended_by: None,
            rows,
        }
    }

    /// The medians as a table.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        if !self.groups.is_empty() {
            let medians = self.median_table(&[("", |s| s.median)], |name| !is_detail(name), as_named);
            text += &format!("Medians over the seeds\n{}", medians.to_text());
        }
        if self.missing_runs > 0 {
            let (done, missing) = (self.rows.len(), self.missing_runs);
            text += &format!("{done} runs are finished, and {missing} are not done yet\n");
        }
        for failed in &self.failed_runs {
            text += &format!("{failed}\n");
        }
        for fault in &self.device_faults {
            text += &format!("{fault}\n");
        }
        text
    }

    /// Settings and figures of every run, the figures called by `head`.
    pub(super) fn row_table(&self, head: Head) -> Table<'static> {
        let table = with_settings(&self.rows, |r| &r.settings);
        // Rows of other objectives have other figures.
        let names: BTreeSet<&String> = self.rows.iter().flat_map(|r| r.figures.keys()).collect();
        let table = names.into_iter().fold(table, |table, name| {
            let (words, unit) = head(name);
            table.number(words, unit, |r| r.figures.get(name).copied().flatten())
        });
        table.table()
    }

    /// Settings of every group and these parts of each of the figures that are `wanted`, called by `head` with endings of their
    /// names.
    pub(super) fn median_table(
        &self,
        of: &[NamedPart],
        wanted: impl Fn(&str) -> bool,
        head: Head,
    ) -> Table<'static> {
        let mut table = with_settings(&self.groups, |g| &g.settings);
        let names: BTreeSet<&String> = self.groups.iter().flat_map(|g| g.figures.keys()).collect();
        for name in names.into_iter().filter(|name| wanted(name)) {
            for (ending, part) in of {
                let (words, unit) = head(name);
                table = table.number(format!("{words}{ending}"), unit, |g| {
                    g.figures.get(name).map(part)
                });
            }
        }
        table.table()
    }

    /// Writes `sweep` and `medians` as CSV and as Parquet, `convergence.csv` and `times.csv`, `summary.json`, pictures and
    /// `report.html`.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be written.
    pub(super) fn write(&self, folder: &Path, settings: &SweepSettings, kept: &[KeptRow]) -> Result<()> {
        write_json(&folder.join(SUMMARY), self)?;
        if self.rows.is_empty() {
            return Ok(());
        }
        let rows = self.row_table(as_named);
        rows.write_csv(folder.join("sweep.csv"))?;
        #[cfg(feature = "parquet")]
        rows.write_parquet(folder.join("sweep.parquet"))?;
        let parts: [NamedPart; 3] = [
            ("_lower_quartile", |s| s.lower_quartile),
            ("_median", |s| s.median),
            ("_upper_quartile", |s| s.upper_quartile),
        ];
        let medians = self.median_table(&parts, |_| true, as_named);
        medians.write_csv(folder.join("medians.csv"))?;
        #[cfg(feature = "parquet")]
        medians.write_parquet(folder.join("medians.parquet"))?;
        // What the clock says differs from run to run, and stands apart from the figures.
        super::ways::write(&folder.join("convergence.csv"), kept)?;
        super::ways::times(kept)
            .table()
            .write_csv(folder.join("times.csv"))?;
        super::page::write(folder, self, settings, kept)
    }
}

/// What a figure is called in a table, and its unit.
pub(super) type Head = fn(&str) -> (String, &'static str);

/// Figures as files call them, with the unit in the name.
fn as_named(figure: &str) -> (String, &'static str) {
    (figure.to_owned(), "")
}

/// A part of a spread, and how the names of its columns end.
pub(super) type NamedPart = (&'static str, fn(&Spread) -> f64);

/// A table of the settings of rows.
fn with_settings<T>(rows: &[T], settings: fn(&T) -> &BTreeMap<String, String>) -> Rows<&T> {
    let keys = rows.first().into_iter().flat_map(|row| settings(row).keys());
    keys.fold(Table::rows(rows), |table, key| {
        table.text(key, |row| &*settings(row)[key])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_over_the_seeds_of_one_setting() {
        let row = |run: usize, k: &str, seed: &str, x: f64| Row {
            run,
            settings: BTreeMap::from([
                ("k".to_owned(), k.to_owned()),
                ("seed".to_owned(), seed.to_owned()),
            ]),
            figures: BTreeMap::from([("x".to_owned(), Some(x)), ("none".to_owned(), None)]),
            device_faults: Vec::new(),
            front: Vec::new(),
        };
        let rows = [
            row(0, "a", "1", 3.0),
            row(1, "a", "2", 1.0),
            row(2, "a", "3", 2.0),
            row(3, "b", "1", 9.0),
        ];
        let groups = medians(&rows);
        assert_eq!(groups.len(), 2);
        let x = groups[0].figures["x"];
        assert_eq!((x.lower_quartile, x.median, x.upper_quartile), (1.5, 2.0, 2.5));
        assert_eq!((groups[0].runs, groups[1].runs), (3, 1));
        assert!(!groups[0].figures.contains_key("none"));
    }
}
