//! Published figures beside ours: the summary, the table and the page.

use super::chapter::{Asked, Chapter, Drawing, Item};
use super::{PAGE, ReproduceSettings, Took};
use crate::error::Result;
use crate::files::run_folder::SUMMARY;
use crate::report::{BarPanel, Bars, HtmlReport, Table, significant};
use crate::study::framework::write_json;
use crate::study::sweep::{Group, Row, medians};
use serde::Serialize;
use std::path::Path;

/// A figure of the thesis beside ours.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Compared {
    /// What it is of: settings of a sweep, or a scenario.
    pub of: String,
    /// What it is called.
    pub figure: String,
    /// Its unit.
    pub unit: String,
    /// The published figure, where it is known.
    pub published: Option<f64>,
    /// A quarter of our runs is below.
    pub lower_quartile: Option<f64>,
    /// Half of our runs are below.
    pub median: Option<f64>,
    /// A quarter of our runs is above.
    pub upper_quartile: Option<f64>,
    /// Our runs.
    pub runs: usize,
    /// Our median above the published figure (%).
    pub difference_percent: Option<f64>,
    /// Why the two differ.
    pub differs: String,
}

/// A table of the thesis.
#[derive(Clone, Debug, Serialize)]
pub struct TableSummary {
    /// Its chapter.
    pub chapter: u8,
    /// Its folder.
    pub name: String,
    /// Its heading.
    pub title: String,
    /// The study that fills it.
    pub study: String,
    /// Its figures.
    pub rows: Vec<Compared>,
    /// Runs.
    pub runs: usize,
    /// Evaluations of all runs, where the study counts them.
    pub evaluations: Option<f64>,
    /// What failed, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failed_runs: Vec<String>,
    /// Time that it took (s).
    pub elapsed_s: f64,
    /// Processor time of all threads (s).
    pub processor_elapsed_s: f64,
}

/// What was reproduced; `--json` prints this.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// `reproduce`.
    pub study: &'static str,
    /// Whether it is the quick subset.
    pub quick: bool,
    /// The tables.
    pub tables: Vec<TableSummary>,
    /// Time that they took (s).
    pub elapsed_s: f64,
    /// What ended it before it was done: `time_limit`.
    pub ended_by: Option<String>,
}

/// Settings in words. Keys that change together say their own names, and a key of a table that of the key.
fn words(group: &Group) -> String {
    let told = group.settings.iter().map(|(key, value)| match key.as_str() {
        "together" | "swarm" => value.clone(),
        key => format!("{} {value}", key.rsplit('.').next().unwrap_or(key)),
    });
    told.collect::<Vec<_>>().join(", ")
}

/// How far a figure is above another (%); rounding is no difference.
fn percent_above(published: f64, ours: f64) -> f64 {
    let percent = 100.0 * (ours / published - 1.0);
    if percent.abs() < 1e-9 { 0.0 } else { percent }
}

/// The rows that a figure makes: one, or one for each setting of a sweep.
fn compared(asked: &Asked, groups: &[Group]) -> Vec<Compared> {
    let row = |of: String, runs: usize, quartiles: Option<[f64; 3]>| {
        let part = |k: usize| quartiles.map(|all| all[k] * asked.scale);
        let (published, median) = (asked.published, part(1));
        Compared {
            of,
            figure: asked.name.clone(),
            unit: asked.unit.clone(),
            published,
            lower_quartile: part(0),
            median,
            upper_quartile: part(2),
            runs,
            difference_percent: published
                .zip(median)
                .map(|(published, median)| percent_above(published, median)),
            differs: asked.differs.clone(),
        }
    };
    let of_group = |group: &Group| {
        let spread = group.figures.get(&asked.figure);
        spread.map(|s| [s.lower_quartile, s.median, s.upper_quartile])
    };
    if asked.sum {
        // Quartiles of a sum are not the sums of quartiles: the sum of the medians stands alone.
        let sum = groups
            .iter()
            .map(|group| of_group(group).map(|all| all[1]))
            .sum::<Option<f64>>();
        let runs = groups.iter().map(|group| group.runs).sum();
        return vec![row(asked.of.clone(), runs, sum.map(|sum| [sum; 3]))];
    }
    let asked_of = |group: &&Group| asked.at.iter().all(|(k, v)| group.settings.get(k) == Some(v));
    let shown = groups.iter().filter(asked_of);
    // Settings that do not have the figure, as other objectives, are no rows, unless it was published.
    let shown = shown.filter(|group| asked.published.is_some() || of_group(group).is_some());
    shown
        .map(|group| {
            let of = if asked.of.is_empty() {
                words(group)
            } else {
                asked.of.clone()
            };
            row(of, group.runs, of_group(group))
        })
        .collect()
}

impl TableSummary {
    pub(super) fn new(chapter: &Chapter, item: &Item, rows: Vec<Row>, took: Took) -> Self {
        let groups = medians(&rows);
        let is_there = |key: &str| groups.iter().any(|group| group.figures.contains_key(key));
        let evaluations: Option<f64> = rows.iter().map(|row| *row.figures.get("evaluations")?).sum();
        Self {
            chapter: chapter.number,
            name: item.name.clone(),
            title: item.title.clone(),
            study: item.study.clone(),
            rows: item
                .figures
                .iter()
                .flat_map(|asked| asked.each(is_there))
                .flat_map(|asked| compared(&asked, &groups))
                .collect(),
            runs: rows.len(),
            evaluations,
            failed_runs: took.failed,
            elapsed_s: took.elapsed_s,
            processor_elapsed_s: took.processor_s,
        }
    }

    /// What it took, in words.
    fn took(&self) -> String {
        let runs = if self.runs == 1 {
            "One run".to_owned()
        } else {
            format!("{} runs", self.runs)
        };
        let evaluations = self
            .evaluations
            .map_or(String::new(), |n| format!(", {n:.0} evaluations"));
        format!(
            "{runs} of {}{evaluations}, {:.1} s, {:.1} s of processor time.",
            self.study, self.elapsed_s, self.processor_elapsed_s
        )
    }

    /// Its figures as columns: each has its own where all are of the same things, of one run each, and none is published.
    fn columns(&self) -> Table<'static> {
        let figures = self.figures();
        let of = |(figure, _): &(&str, &str)| -> Vec<&Compared> {
            self.rows.iter().filter(|r| r.figure == *figure).collect()
        };
        let things =
            |figure: &(&str, &str)| -> Vec<String> { of(figure).iter().map(|r| r.of.clone()).collect() };
        let alone = self
            .rows
            .iter()
            .all(|r| r.published.is_none() && spread(r).is_none());
        if let [first, others @ ..] = &figures[..]
            && alone
            && of(first).len() > 1
            && !others.is_empty()
            && others.iter().all(|figure| things(figure) == things(first))
        {
            let table = Table::new().texts("of", things(first));
            return figures.iter().fold(table, |table, figure| {
                let ours: Vec<f64> = of(figure).iter().map(|r| r.median.unwrap_or(f64::NAN)).collect();
                table.numbers(figure.0, figure.1, ours)
            });
        }
        Table::rows(&self.rows)
            .text("of", |r| r.of.clone())
            .text("figure", |r| r.figure.clone())
            .text("unit", |r| r.unit.clone())
            .number("published", "", |r| r.published)
            .number("ours", "", |r| r.median)
            .number("quartile below", "", |r| spread(r).map(|s| s[0]))
            .number("quartile above", "", |r| spread(r).map(|s| s[1]))
            .number("difference", "%", |r| r.difference_percent)
            .table()
            .without_empty()
    }

    /// Its figures with their units, in their order.
    fn figures(&self) -> Vec<(&str, &str)> {
        let mut names: Vec<(&str, &str)> = Vec::new();
        for row in &self.rows {
            let name = (row.figure.as_str(), row.unit.as_str());
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// A panel for each figure of several settings.
    fn panels(&self) -> Vec<BarPanel> {
        let panel = |(figure, unit): (&str, &str)| {
            let rows: Vec<&Compared> = self.rows.iter().filter(|r| r.figure == figure).collect();
            let label = if unit.is_empty() {
                figure.to_owned()
            } else {
                format!("{figure} ({unit})")
            };
            let of = |value: fn(&Compared) -> Option<f64>| {
                let values = rows.iter().map(|r| value(r).unwrap_or(f64::NAN));
                values.collect::<Vec<f64>>()
            };
            let quartiles = of(|r| r.lower_quartile).into_iter().zip(of(|r| r.upper_quartile));
            let ours = BarPanel::new(figure, label, rows.iter().map(|r| r.of.clone())).with_intervals(
                "ours",
                of(|r| r.median),
                quartiles.map(|(below, above)| [below, above]),
            );
            let panel = if rows.iter().any(|r| r.published.is_some()) {
                ours.bars("published", of(|r| r.published))
            } else {
                ours
            };
            (rows.len() > 1).then_some(panel)
        };
        self.figures().into_iter().filter_map(panel).collect()
    }
}

/// Quartiles that are not the median itself.
fn spread(row: &Compared) -> Option<[f64; 2]> {
    let (below, above) = row.lower_quartile.zip(row.upper_quartile)?;
    (row.runs > 1 && below < above).then_some([below, above])
}

impl Summary {
    pub(super) fn new(
        settings: &ReproduceSettings,
        tables: Vec<TableSummary>,
        ended_by: Option<String>,
    ) -> Self {
        Self {
            study: "reproduce",
            quick: settings.quick,
            elapsed_s: tables.iter().map(|table| table.elapsed_s).sum(),
            tables,
            ended_by,
        }
    }

    /// The tables in words.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for table in &self.tables {
            text += &format!(
                "Chapter {}: {}\n{}",
                table.chapter,
                table.title,
                table.columns().to_text()
            );
            text += &format!("{}\n", table.took());
            for failed in &table.failed_runs {
                text += &format!("{failed}\n");
            }
            text.push('\n');
        }
        if self.ended_by.is_some() {
            text += "The time limit came before the end: --resume continues\n";
        }
        text
    }

    /// Writes `summary.json`, `published.csv` and the page.
    ///
    /// # Errors
    /// [`crate::Error::Io`] if a file cannot be written.
    pub(super) fn write(&self, folder: &Path, settings: &ReproduceSettings) -> Result<()> {
        write_json(&folder.join(SUMMARY), self)?;
        let all = self
            .tables
            .iter()
            .flat_map(|table| table.rows.iter().map(move |row| (table, row)));
        Table::rows(all)
            .number("chapter", "", |(t, _)| f64::from(t.chapter))
            .text("table", |(t, _)| t.name.clone())
            .text("of", |(_, r)| r.of.clone())
            .text("figure", |(_, r)| r.figure.clone())
            .text("unit", |(_, r)| r.unit.clone())
            .number("published", "", |(_, r)| r.published)
            .number("lower_quartile", "", |(_, r)| r.lower_quartile)
            .number("median", "", |(_, r)| r.median)
            .number("upper_quartile", "", |(_, r)| r.upper_quartile)
            .number("difference", "%", |(_, r)| r.difference_percent)
            .number("runs", "", |(_, r)| r.runs as f64)
            .text("differs", |(_, r)| r.differs.clone())
            .table()
            .write_csv(folder.join("published.csv"))?;
        self.write_page(folder, settings)
    }

    fn write_page(&self, folder: &Path, settings: &ReproduceSettings) -> Result<()> {
        let mut page = HtmlReport::new("reproduce", "The thesis's tables");
        let beside = self
            .tables
            .iter()
            .flat_map(|t| &t.rows)
            .filter(|r| r.published.is_some());
        page.sentence(format!(
            "{} tables, with {} published figures beside ours. Medians and quartiles are over the seeds.",
            self.tables.len(),
            beside.count()
        ));
        if self.quick {
            page.sentence("This is the quick subset: fewer settings, fewer seeds, smaller swarms.");
        }
        if self.ended_by.is_some() {
            page.warning("The time limit came before the end. These are the tables that were finished.");
        }
        page.tile("Tables", self.tables.len().to_string(), "");
        page.tile("Time", significant(self.elapsed_s, 4), "s");
        let processor_s: f64 = self.tables.iter().map(|t| t.processor_elapsed_s).sum();
        page.tile("Processor time", significant(processor_s, 4), "s");
        for chapter in &settings.chapters {
            for item in &chapter.items {
                let Some(table) = self.tables.iter().find(|table| table.name == item.name) else {
                    continue;
                };
                page.section(
                    &format!("Chapter {}: {}", chapter.number, item.title),
                    &item.about,
                );
                let published = table.rows.iter().any(|r| r.published.is_some());
                let heading = if published {
                    "Published and ours"
                } else {
                    "Ours; no published figures are at hand"
                };
                page.table(heading, &table.took(), &table.columns())?;
                // Rows of one figure have one sentence.
                let differing = table.rows.iter().filter(|row| !row.differs.is_empty());
                let sentences = differing.map(|row| format!("{}: {}", row.figure, row.differs));
                let mut sentences: Vec<String> = sentences.collect();
                sentences.dedup();
                for sentence in &sentences {
                    page.paragraph(sentence);
                }
                for failed in &table.failed_runs {
                    page.warning(format!("{}: {failed}", item.title));
                }
                let bars = Bars::new(item.title.clone(), table.panels());
                if !bars.is_empty() {
                    page.figure(folder.join(format!("{}.svg", item.name)), &bars)?;
                }
                page.reports_within(std::slice::from_ref(&item.name));
            }
            let drawn = |drawing: &&Drawing| folder.join(&drawing.name).join(PAGE).is_file();
            for drawing in chapter.drawings.iter().filter(drawn) {
                page.section(
                    &format!("Chapter {}: {}", chapter.number, drawing.title),
                    &drawing.about,
                );
                page.reports_within(std::slice::from_ref(&drawing.name));
            }
            if !chapter.left_out.is_empty() {
                page.section(&format!("Chapter {}: what is not here", chapter.number), "");
                for left_out in &chapter.left_out {
                    page.paragraph(left_out);
                }
            }
        }
        page.settings("reproduce.toml", settings.to_toml());
        page.write(folder.join(PAGE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn asked(more: &str) -> Asked {
        toml::from_str(&format!("figure = \"length_m\"\nname = \"length\"\n{more}")).expect("a figure")
    }

    fn row(sector: &str, seed: &str, length_m: f64) -> Row {
        let settings = [("section", sector), ("seed", seed)];
        Row {
            settings: BTreeMap::from(settings.map(|(k, v)| (k.to_owned(), v.to_owned()))),
            figures: BTreeMap::from([("length_m".to_owned(), Some(length_m))]),
            ..Row::default()
        }
    }

    #[test]
    fn figures_are_medians_beside_what_was_published() {
        let rows = [
            row("1/2", "1", 10.0),
            row("1/2", "2", 14.0),
            row("2/2", "1", 20.0),
            row("2/2", "2", 20.0),
        ];
        let groups = medians(&rows);
        let all = compared(&asked(""), &groups);
        assert_eq!(all.len(), 2);
        assert_eq!((all[0].median, all[0].of.as_str()), (Some(12.0), "section 1/2"));
        let one = compared(&asked("published = 16\nat = { section = \"2/2\" }"), &groups);
        assert_eq!(one.len(), 1);
        assert_eq!(one[0].difference_percent, Some(25.0));
        let sum = compared(&asked("sum = true\nscale = 0.5"), &groups);
        assert_eq!((sum.len(), sum[0].median, sum[0].runs), (1, Some(16.0), 4));
        // A list has a row for each of its members.
        let sites = Asked {
            figure: "sites.*.start_m".to_owned(),
            of: "site".to_owned(),
            ..asked("")
        };
        let of_each = sites.each(|key| ["sites.0.start_m", "sites.1.start_m"].contains(&key));
        let of_each: Vec<_> = of_each
            .iter()
            .map(|a| (a.of.as_str(), a.figure.as_str()))
            .collect();
        assert_eq!(
            of_each,
            [("site 1", "sites.0.start_m"), ("site 2", "sites.1.start_m")]
        );
        // A figure that no run has is an empty cell, and no zero.
        let none = Asked {
            figure: "speed".to_owned(),
            ..asked("published = 3")
        };
        assert_eq!(compared(&none, &groups)[0].median, None);
    }

    /// Sites of one run have a row each, as the thesis has them, and settings of sweeps say their own names.
    #[test]
    fn figures_of_the_same_things_stand_beside_one_another() {
        let compared = |of: &str, figure: &str, median: f64| Compared {
            of: of.to_owned(),
            figure: figure.to_owned(),
            unit: "m".to_owned(),
            published: None,
            lower_quartile: Some(median),
            median: Some(median),
            upper_quartile: Some(median),
            runs: 1,
            difference_percent: None,
            differs: String::new(),
        };
        let mut table = TableSummary {
            chapter: 4,
            name: "sites".to_owned(),
            title: "Sites".to_owned(),
            study: "hybrid".to_owned(),
            rows: vec![
                compared("site 1", "from", 10.0),
                compared("site 2", "from", 30.0),
                compared("site 1", "to", 20.0),
                compared("site 2", "to", 40.0),
            ],
            runs: 1,
            evaluations: None,
            failed_runs: Vec::new(),
            elapsed_s: 1.0,
            processor_elapsed_s: 1.0,
        };
        let text = table.columns().to_text();
        let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
        assert!(lines[0].contains("from") && lines[0].contains("to"), "{text}");
        assert!(lines[2].contains("10") && lines[2].contains("20"), "{text}");
        table.rows[3].published = Some(41.0);
        assert!(table.columns().to_text().contains("published"));
        let keys = [("swarm.inertia", "0.4"), ("together", "cognitive 1, social 3")];
        let group = Group {
            settings: BTreeMap::from(keys.map(|(k, v)| (k.to_owned(), v.to_owned()))),
            runs: 1,
            figures: BTreeMap::new(),
        };
        assert_eq!(words(&group), "inertia 0.4, cognitive 1, social 3");
    }
}
