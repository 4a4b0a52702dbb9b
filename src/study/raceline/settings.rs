//! What a racing-line study is asked to do.

use crate::config::{Document, read_text};
use crate::error::{Error, Result};
use crate::evaluate::BackendChoice;
use crate::evaluate::line::LineObjective;
use crate::study::identify::parse_backend;
use crate::study::memory::Size;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What looks for the best line by one objective.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LineAlgorithm {
    /// Swarms in windows over a spline's control points, from coarse to fine.
    #[default]
    Windows,
    /// CPSO-S_K over `alpha` at every cut: a swarm to each of the groups, by turns, in the others' context.
    Cooperative,
    /// One plain particle swarm over `alpha` at every cut, with the settings of the thesis.
    Thesis,
}

impl LineAlgorithm {
    /// Every algorithm.
    pub const ALL: [Self; 3] = [Self::Windows, Self::Cooperative, Self::Thesis];

    /// The name in studies.
    pub fn name(self) -> &'static str {
        match self {
            Self::Windows => "windows",
            Self::Cooperative => "cooperative",
            Self::Thesis => "thesis",
        }
    }

    /// The algorithm of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|a| a.name() == name)
    }
}

/// Settings of a racing-line study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RacelineSettings {
    /// A bundled circuit, a shape or a file: see [`crate::track::Track::load`].
    pub track: String,
    /// The car whose limits are swept: a bundled name or a file.
    pub car: String,
    /// A table of limits that takes the place of the car's own.
    pub envelope: Option<PathBuf>,
    /// The name of a stretch of the track, if not all of it is to be driven.
    pub section: Option<String>,
    /// Cuts across the track.
    pub sections: usize,
    /// Whether surveyed edges are taken as they are, not smoothed.
    pub as_surveyed: bool,
    /// Width of the car (m); nought lets its middle use the whole road.
    pub car_width_m: f64,
    /// Exponent of the friction ellipse.
    pub ellipse_exponent: f64,
    /// Greatest speed at the start of an open track (m/s).
    pub entry_mps: f64,
    /// What is to be small.
    pub objectives: Vec<LineObjective>,
    /// Whether the swarms start from the exact optima; else from the reference line, and the front from what they found.
    pub warm_start: bool,
    /// Whether what the swarms find is led to the nearest optimum by exact gradients.
    pub local_search: bool,
    /// What looks for the best line by one objective.
    pub algorithm: LineAlgorithm,
    /// Groups of neighbouring cuts of the cooperative algorithm.
    pub groups: usize,
    /// Particles of the swarm that looks for the front, and of each that an algorithm other than windows has.
    pub population: usize,
    /// Its iterations, and theirs.
    pub iterations: usize,
    /// Lines that the front keeps.
    pub archive: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Where lines are evaluated.
    pub backend: BackendChoice,
    /// Part of the name of the GPU to use.
    pub adapter: Option<String>,
}

impl Default for RacelineSettings {
    fn default() -> Self {
        Self {
            track: "silverstone_gp".to_owned(),
            car: "gt".to_owned(),
            envelope: None,
            section: None,
            sections: 960,
            as_surveyed: true,
            car_width_m: 2.0,
            ellipse_exponent: 2.0,
            entry_mps: 10.0,
            objectives: vec![
                LineObjective::Gamma,
                LineObjective::Length,
                LineObjective::LapTime,
            ],
            warm_start: true,
            local_search: true,
            algorithm: LineAlgorithm::Windows,
            groups: 12,
            population: 200,
            iterations: 200,
            archive: 100,
            seed: 1,
            backend: BackendChoice::Auto,
            adapter: None,
        }
    }
}

/// Objectives that a study file or a flag may name.
pub const OBJECTIVE_NAMES: &str = "length, length_squared, gamma, kappa2, lap_time";

impl RacelineSettings {
    /// Reads a study file; files that it names are relative to it.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read, [`Error::Input`] naming line and field if it says something wrong.
    pub fn read(path: &Path) -> Result<Self> {
        Self::parse(path, &read_text(path)?)
    }

    /// As [`RacelineSettings::read`], of a file's text; `path` is its name in messages, and paths are relative to it.
    ///
    /// # Errors
    /// As [`RacelineSettings::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        let document = Document::parse(path, text)?;
        let root = document.root();
        let mut s = Self::default();
        let folder = path.parent().unwrap_or(Path::new(""));
        let named_or_file = |name: &str| {
            if Path::new(name).extension().is_some() {
                folder.join(name).display().to_string()
            } else {
                name.to_owned()
            }
        };
        if let Some(name) = root.string("track")? {
            s.track = named_or_file(name);
        }
        if let Some(name) = root.string("car")? {
            s.car = named_or_file(name);
        }
        s.envelope = root.string("envelope")?.map(|name| folder.join(name));
        s.section = root.string("section")?.map(str::to_owned);
        if let Some(name) = root.string("algorithm")? {
            s.algorithm = LineAlgorithm::named(name)
                .ok_or_else(|| root.refuse("algorithm", "\"windows\", \"cooperative\" or \"thesis\""))?;
        }
        let count = |key: &str, least: u64, most: u64, value: usize| -> Result<usize> {
            Ok(root.integer(key, least, most)?.map_or(value, |n| n as usize))
        };
        s.sections = count("sections", 8, 1_000_000, s.sections)?;
        s.population = count("population", 8, 10_000_000, s.population)?;
        s.iterations = count("iterations", 1, 1_000_000, s.iterations)?;
        s.groups = count("groups", 1, 1_000_000, s.groups)?;
        s.archive = count("archive", 8, 10_000, s.archive)?;
        let number = |key: &str, least: f64, most: f64, unit: &str, value: f64| -> Result<f64> {
            Ok(root.number(key, least, most, unit)?.unwrap_or(value))
        };
        s.car_width_m = number("car_width_m", 0.0, 10.0, "m", s.car_width_m)?;
        s.ellipse_exponent = number("ellipse_exponent", 1.0, 4.0, "", s.ellipse_exponent)?;
        s.entry_mps = number("entry_mps", 0.5, 150.0, "m/s", s.entry_mps)?;
        let switch = |key: &str, value: bool| -> Result<bool> { Ok(root.boolean(key)?.unwrap_or(value)) };
        s.as_surveyed = switch("as_surveyed", s.as_surveyed)?;
        s.warm_start = switch("warm_start", s.warm_start)?;
        s.local_search = switch("local_search", s.local_search)?;
        if let Some(names) = root.strings("objectives")? {
            let parsed: Option<Vec<_>> = names.iter().map(|n| LineObjective::named(n)).collect();
            s.objectives = parsed
                .filter(|o| !o.is_empty())
                .ok_or_else(|| root.refuse("objectives", format!("a list of {OBJECTIVE_NAMES}")))?;
        }
        s.seed = root.integer("seed", 0, u64::MAX)?.unwrap_or(s.seed);
        if let Some(name) = root.string("backend")? {
            s.backend = parse_backend(name)
                .ok_or_else(|| root.refuse("backend", "\"auto\", \"cpu\", \"simd\" or \"gpu\""))?;
        }
        s.adapter = root.string("adapter")?.map(str::to_owned);
        root.finish()?;
        s.validate()?;
        Ok(s)
    }

    /// Checks what ranges alone do not tell.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        let wrong = |place: &str, found: String, expected: &str| {
            Err(Error::input("the study", place, found, expected))
        };
        let ranges = [
            ("car_width_m", self.car_width_m, 0.0, 10.0),
            ("ellipse_exponent", self.ellipse_exponent, 1.0, 4.0),
            ("entry_mps", self.entry_mps, 0.5, 150.0),
        ];
        for (name, value, least, most) in ranges {
            if !(least..=most).contains(&value) {
                return wrong(name, value.to_string(), &format!("{least} to {most}"));
            }
        }
        let counts = [
            ("sections", self.sections, 8, 1_000_000),
            ("population", self.population, 8, 10_000_000),
            ("iterations", self.iterations, 1, 1_000_000),
            ("groups", self.groups, 1, 1_000_000),
            ("archive", self.archive, 8, 10_000),
        ];
        for (name, value, least, most) in counts {
            if !(least..=most).contains(&value) {
                return wrong(name, value.to_string(), &format!("{least} to {most}"));
            }
        }
        let twice = (1..self.objectives.len()).find(|&i| self.objectives[..i].contains(&self.objectives[i]));
        match (self.objectives.len(), twice) {
            (0, _) => wrong("objectives", "none".to_owned(), OBJECTIVE_NAMES),
            (_, Some(i)) => wrong(
                "objectives",
                format!("{} twice", self.objectives[i].name()),
                "each once",
            ),
            _ => Ok(()),
        }
    }

    /// What the study's memory goes with.
    pub fn size(&self) -> Size {
        Size {
            population: self.population,
            // The swarm's control points are fewer than the cuts; the lines of the front are whole.
            variables: self.sections,
            iterations: self.iterations,
            sections: self.sections,
            archive: self.archive,
            ..Size::default()
        }
    }

    /// The same with the paths of files absolute, so that they mean the same from every folder.
    pub fn absolute(mut self) -> Self {
        self.track = absolute(&self.track);
        self.car = absolute(&self.car);
        self.envelope = self
            .envelope
            .map(|path| std::path::absolute(&path).unwrap_or(path));
        self
    }

    /// The study file that repeats this study.
    pub fn to_toml(&self) -> String {
        let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
        let objectives: Vec<String> = self.objectives.iter().map(|o| quoted(o.name())).collect();
        let mut text = format!(
            "track = {}\ncar = {}\nsections = {}\nas_surveyed = {}\ncar_width_m = {:?}\nellipse_exponent = {:?}\n\
             entry_mps = {:?}\nobjectives = [{}]\nwarm_start = {}\nlocal_search = {}\npopulation = {}\n\
             iterations = {}\narchive = {}\nseed = {}\nbackend = {}\n",
            quoted(&absolute(&self.track)),
            quoted(&absolute(&self.car)),
            self.sections,
            self.as_surveyed,
            self.car_width_m,
            self.ellipse_exponent,
            self.entry_mps,
            objectives.join(", "),
            self.warm_start,
            self.local_search,
            self.population,
            self.iterations,
            self.archive,
            self.seed,
            quoted(match self.backend {
                BackendChoice::Auto => "auto",
                BackendChoice::Cpu => "cpu",
                BackendChoice::Simd => "simd",
                BackendChoice::Gpu => "gpu",
            }),
        );
        if self.algorithm != LineAlgorithm::Windows {
            text += &format!(
                "algorithm = {}\ngroups = {}\n",
                quoted(self.algorithm.name()),
                self.groups
            );
        }
        if let Some(name) = &self.section {
            text += &format!("section = {}\n", quoted(name));
        }
        if let Some(path) = &self.envelope {
            text += &format!("envelope = {}\n", quoted(&absolute(&path.display().to_string())));
        }
        if let Some(adapter) = &self.adapter {
            text += &format!("adapter = {}\n", quoted(adapter));
        }
        text
    }
}

/// A file's path made absolute, so that a study file can be read from its run folder; names stay as they are.
fn absolute(name: &str) -> String {
    let path = Path::new(name);
    if path.extension().is_none() {
        return name.to_owned();
    }
    std::path::absolute(path).map_or_else(|_| name.to_owned(), |p| p.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_study_file_repeats_its_study() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("study.toml");
        let settings = RacelineSettings {
            objectives: vec![LineObjective::Kappa2, LineObjective::LapTime],
            warm_start: false,
            algorithm: LineAlgorithm::Cooperative,
            groups: 5,
            section: Some("Abbey".to_owned()),
            seed: 7,
            ..RacelineSettings::default()
        };
        std::fs::write(&path, settings.to_toml()).unwrap();
        assert_eq!(RacelineSettings::read(&path).unwrap(), settings);
    }

    #[test]
    fn mistakes_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("study.toml");
        for (text, wanted) in [
            ("sections = 3", "sections"),
            ("objectives = [\"speed\"]", "objectives"),
            ("objectives = [\"gamma\", \"gamma\"]", "gamma twice"),
            ("width = 2.0", "width"),
            ("algorithm = \"ants\"", "algorithm"),
            ("car_width_m = \"wide\"", "car_width_m"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = RacelineSettings::read(&path).unwrap_err().to_string();
            assert!(error.contains(wanted), "{error} should say {wanted}");
        }
    }
}
