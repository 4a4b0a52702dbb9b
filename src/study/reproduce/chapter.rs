//! What a chapter of the thesis shows, as files of this crate declare it.

use crate::config::Document;
use crate::config::kinds::Choice;
use crate::error::{Error, Result};
use crate::evaluate::BackendChoice;
use crate::study::registry::{self, Registered};
use crate::study::sweep::SweepSettings;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use toml::{Table, Value};

macro_rules! bundled {
    ($($number:literal),*) => {
        [$(($number, include_str!(concat!("../../../data/reproduce/chapter_", $number, ".toml")))),*]
    };
}

const BUNDLED: [(u8, &str); 6] = bundled!(2, 3, 4, 5, 6, 7);

/// The chapters that there is something to reproduce of.
pub fn numbers() -> Vec<u8> {
    BUNDLED.iter().map(|(number, _)| *number).collect()
}

/// A chapter of the thesis: its tables, and what of it is not here.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chapter {
    /// Its number.
    #[serde(skip)]
    pub number: u8,
    /// What it is about.
    pub title: String,
    /// Its tables.
    #[serde(rename = "table")]
    pub items: Vec<Item>,
    /// Its pictures without figures to compare.
    #[serde(default, rename = "drawing")]
    pub drawings: Vec<Drawing>,
    /// What it has that is not reproduced, and why, a sentence each.
    #[serde(default)]
    pub left_out: Vec<String>,
}

/// A table: a study, or a sweep over a grid of its settings, and the figures that are laid beside the published ones.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Item {
    /// The name of its folder: letters, digits and underscores.
    pub name: String,
    /// Its heading.
    pub title: String,
    /// What is done, and what to look at.
    pub about: String,
    /// The study.
    pub study: String,
    /// Its settings.
    #[serde(default)]
    settings: Table,
    /// What the runs differ in; without it, one run with its own page.
    #[serde(default)]
    grid: Table,
    /// Settings and axes of the quick subset, over the others.
    #[serde(default)]
    quick: Quick,
    /// The figures.
    pub figures: Vec<Asked>,
}

/// Pictures of a car or of its tyres.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drawing {
    /// The name of its folder, as an [`Item`] has it.
    pub name: String,
    /// Its heading.
    pub title: String,
    /// What it shows.
    pub about: String,
    /// A bundled car.
    pub car: String,
    /// Whether its tyres are drawn, in place of the car itself.
    #[serde(default)]
    pub tyres: bool,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Quick {
    #[serde(default)]
    settings: Table,
    #[serde(default)]
    grid: Table,
}

/// A figure of a table.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Asked {
    /// Its key in the study's summary, with dots through tables; in a sweep, that of a column, or `elapsed_s`. `*` stands for all
    /// members of a list, each with a row of its own: `sites.*.start_m`.
    pub figure: String,
    /// What it is called.
    pub name: String,
    /// Its unit.
    #[serde(default)]
    pub unit: String,
    /// What the key's figure is multiplied by to be in that unit.
    #[serde(default = "one")]
    pub scale: f64,
    /// What it is of, as a scenario.
    #[serde(default)]
    pub of: String,
    /// The settings of a sweep that it is of; without any, it is shown for all of them.
    #[serde(default)]
    pub at: BTreeMap<String, String>,
    /// Whether it is the sum over all settings of the sweep, as a lap is of its sectors.
    #[serde(default)]
    pub sum: bool,
    /// The published figure, where it is known.
    pub published: Option<f64>,
    /// Why the two differ.
    #[serde(default)]
    pub differs: String,
}

fn one() -> f64 {
    1.0
}

impl Asked {
    /// The figure itself; where it is one of each member of a list, those of the members that are there, numbered from 1.
    pub(super) fn each(&self, is_there: impl Fn(&str) -> bool) -> Vec<Self> {
        if !self.figure.contains('*') {
            return vec![self.clone()];
        }
        let member = |place: usize| Self {
            figure: self.figure.replace('*', &place.to_string()),
            of: format!("{} {}", self.of, place + 1),
            ..self.clone()
        };
        (0..)
            .map(member)
            .take_while(|asked| is_there(&asked.figure))
            .collect()
    }
}

/// How a table is filled.
#[derive(Clone, Debug)]
pub enum Task {
    /// By a study with the text of its file.
    Study(&'static dyn Registered, String),
    /// By a sweep.
    Sweep(SweepSettings),
}

/// Where candidates are evaluated, over the files.
#[derive(Clone, Debug, Default)]
pub struct EvaluatedOn {
    /// The backend.
    pub backend: Option<BackendChoice>,
    /// Part of the name of the GPU, or `all`.
    pub adapter: Option<String>,
}

impl Chapter {
    /// A chapter by its number.
    ///
    /// # Errors
    /// [`Error::Input`] if there is none of this number.
    pub fn load(number: u8) -> Result<Self> {
        let found = BUNDLED.iter().find(|(known, _)| *known == number);
        let (_, text) = found.ok_or_else(|| {
            let known: Vec<String> = numbers().iter().map(u8::to_string).collect();
            let expected = format!("one of {}", known.join(", "));
            Error::input("the command line", "chapter", number.to_string(), expected)
        })?;
        let name = format!("chapter_{number}.toml");
        let path = Path::new(&name);
        // Says what is wrong in text that is no TOML.
        Document::parse(path, text)?;
        let wrong = |e: toml::de::Error| Error::input(path, "contents", e.message(), "a chapter");
        let chapter: Self = toml::from_str(text).map_err(wrong)?;
        Ok(Self { number, ..chapter })
    }
}

impl Item {
    /// What is to be done for the table: all of it, or the quick subset.
    ///
    /// # Errors
    /// [`Error::Input`] if the file asks for what there is not.
    pub fn task(&self, quick: bool, on: &EvaluatedOn) -> Result<Task> {
        let study = registry::named(&self.study).ok_or_else(|| {
            let expected = format!("one of {}", registry::names().join(", "));
            Error::input(&self.name, "study", &*self.study, expected)
        })?;
        let (mut settings, mut grid) = (self.settings.clone(), self.grid.clone());
        if quick {
            extend(&mut settings, &self.quick.settings);
            extend(&mut grid, &self.quick.grid);
        }
        let has = |key: &str| study.declared().iter().any(|d| d.key == key);
        if let Some(backend) = on.backend.filter(|_| has("backend")) {
            settings.insert("backend".to_owned(), Value::String(backend.name().to_owned()));
        }
        if let Some(adapter) = on.adapter.as_ref().filter(|_| has("adapter")) {
            settings.insert("adapter".to_owned(), Value::String(adapter.clone()));
        }
        if grid.is_empty() {
            return Ok(Task::Study(study, settings.to_string()));
        }
        let sweep = Table::from_iter([
            ("study".to_owned(), Value::String(self.study.clone())),
            ("base".to_owned(), Value::Table(settings)),
            ("grid".to_owned(), Value::Table(grid)),
        ]);
        SweepSettings::parse(Path::new(&self.name), &sweep.to_string()).map(Task::Sweep)
    }
}

/// Adds keys to a table; tables within it are added to.
fn extend(table: &mut Table, more: &Table) {
    for (key, value) in more {
        match (table.get_mut(key), value) {
            (Some(Value::Table(there)), Value::Table(more)) => extend(there, more),
            _ => {
                table.insert(key.clone(), value.clone());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::sweep::plan;

    /// What the bundled chapters ask for can be done, in full and quickly.
    #[test]
    #[ignore = "full tier: all of the thesis's studies are prepared twice"]
    fn every_chapter_is_sound() {
        let mut names = std::collections::BTreeSet::new();
        for number in numbers() {
            let chapter = Chapter::load(number).expect("a chapter");
            for drawing in &chapter.drawings {
                assert!(names.insert(drawing.name.clone()), "{} twice", drawing.name);
                crate::vehicle::Car::load(&drawing.car).expect(&drawing.name);
            }
            for item in &chapter.items {
                assert!(item.name.starts_with(&format!("{number}_")), "{}", item.name);
                assert!(!item.figures.is_empty(), "{}", item.name);
                for quick in [false, true] {
                    match item.task(quick, &EvaluatedOn::default()).expect(&item.name) {
                        Task::Sweep(sweep) => drop(plan(&sweep).expect(&item.name)),
                        // Files of tables that come before it.
                        Task::Study(_, text) if text.contains("../") => {
                            let before = text.split("../").skip(1).filter_map(|t| t.split('/').next());
                            before.for_each(|table| {
                                assert!(names.contains(table), "{table} is no table before")
                            });
                        }
                        Task::Study(study, text) => {
                            let folder = tempfile::tempdir().expect("a folder");
                            let path = folder.path().join("study.toml");
                            std::fs::write(&path, text).expect("a file");
                            study.check(&path).expect(&item.name);
                        }
                    }
                }
                assert!(names.insert(item.name.clone()), "{} twice", item.name);
            }
        }
    }

    #[test]
    fn a_chapter_that_is_not_there_is_refused_with_those_that_are() {
        let said = Chapter::load(1).expect_err("no chapter 1").to_string();
        assert!(said.contains("2, 3, 4, 5, 6, 7"), "{said}");
    }
}
