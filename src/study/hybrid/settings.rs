//! What a hybrid study is asked to do.

use super::scenario::{Scenario, published};
use crate::config::{Document, LONGEST_NAME, Table, read_text};
use crate::error::{Error, Result};
use crate::evaluate::BackendChoice;
use crate::evaluate::hybrid::{HybridObjective, MOST_MOTOR};
use crate::files::stem;
use crate::line::energy::{Gates, Mode};
use crate::study::identify::parse_backend;
use crate::study::memory::Size;
use crate::study::raceline::RacelineSettings;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Laps that a study has beside those of its scenarios.
const OWN_LAPS: [&str; 3] = ["engine alone", "exact", "swarm"];

/// What the swarm may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FreePart {
    /// Where the motor works.
    Strategy,
    /// The line.
    Line,
    /// Both.
    Both,
}

impl FreePart {
    /// The name in studies.
    pub fn name(self) -> &'static str {
        match self {
            Self::Strategy => "strategy",
            Self::Line => "line",
            Self::Both => "both",
        }
    }

    /// The part of this name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Strategy, Self::Line, Self::Both]
            .into_iter()
            .find(|p| p.name() == name)
    }
}

/// Settings of a hybrid study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HybridStudySettings {
    /// A bundled circuit, a shape or a file.
    pub track: String,
    /// A bundled car or a file, with an engine map and a hybrid drive.
    pub car: String,
    /// A table of limits that takes the place of the car's own.
    pub envelope: Option<PathBuf>,
    /// A line (CSV with columns `x` and `y` in m) that takes the place of the fastest one.
    pub line: Option<PathBuf>,
    /// Cuts across the track that the fastest line is found through.
    pub sections: usize,
    /// Greatest distance between the points that energy is accounted at (m).
    pub spacing_m: f64,
    /// Width of the car (m).
    pub car_width_m: f64,
    /// Greatest speed at the start of an open track (m/s).
    pub entry_mps: f64,
    /// The scenarios.
    pub scenarios: Vec<Scenario>,
    /// Whether deployment is optimised too.
    pub optimise: bool,
    /// What the swarm for several objectives may change.
    pub free: FreePart,
    /// Its objectives; with one alone there is no front.
    pub objectives: Vec<HybridObjective>,
    /// Energy that may be deployed in a lap (MJ); without it what rules and store allow.
    pub energy_mj: Option<f64>,
    /// Energies of the front of time against energy (MJ).
    pub budgets_mj: Vec<f64>,
    /// Laps of a stint, nought for none.
    pub stint_laps: usize,
    /// Fuel on board at the start of a stint (kg).
    pub stint_fuel_kg: f64,
    /// Lap time of another car that a hybrid is sized to (s).
    pub match_lap_time_s: Option<f64>,
    /// Particles of the swarms.
    pub population: usize,
    /// Their iterations.
    pub iterations: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Where laps are evaluated.
    pub backend: BackendChoice,
    /// Part of the name of the GPU to use.
    pub adapter: Option<String>,
}

impl Default for HybridStudySettings {
    fn default() -> Self {
        Self {
            track: "silverstone_gp".to_owned(),
            car: "gt_hybrid".to_owned(),
            envelope: None,
            line: None,
            sections: 960,
            spacing_m: 4.0,
            car_width_m: 2.0,
            entry_mps: 10.0,
            scenarios: published(),
            optimise: true,
            free: FreePart::Strategy,
            objectives: vec![HybridObjective::LapTime, HybridObjective::EnergyUsed],
            energy_mj: None,
            budgets_mj: vec![0.0, 0.5, 1.0, 1.5, 2.1, 3.0, 4.0, 5.3],
            stint_laps: 0,
            stint_fuel_kg: 60.0,
            match_lap_time_s: None,
            population: 64,
            iterations: 300,
            seed: 1,
            backend: BackendChoice::Auto,
            adapter: None,
        }
    }
}

/// Searches that a sizing comes to at most: in each of eight ranges a whole one and seven of a quarter.
const SIZING: usize = 22;

/// Objectives that a study may name.
pub const HYBRID_OBJECTIVES: &str = "lap_time_s, fuel_l, energy_used_mj, soc_swing";

impl HybridStudySettings {
    /// The same with the paths of files absolute, so that they mean the same from every folder.
    pub fn absolute(mut self) -> Self {
        let placed = RacelineSettings {
            track: self.track,
            car: self.car,
            envelope: self.envelope,
            ..RacelineSettings::default()
        }
        .absolute();
        (self.track, self.car, self.envelope) = (placed.track, placed.car, placed.envelope);
        self.line = self.line.map(|path| std::path::absolute(&path).unwrap_or(path));
        self
    }

    /// Reads a study file; files that it names are relative to it.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read, [`Error::Input`] naming line and field if it says something wrong.
    pub fn read(path: &Path) -> Result<Self> {
        let text = read_text(path)?;
        let document = Document::parse(path, &text)?;
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
        s.line = root.string("line")?.map(|name| folder.join(name));
        let count = |key: &str, least: u64, most: u64, value: usize| -> Result<usize> {
            Ok(root.integer(key, least, most)?.map_or(value, |n| n as usize))
        };
        s.sections = count("sections", 8, 1_000_000, s.sections)?;
        s.population = count("population", 8, 10_000_000, s.population)?;
        s.iterations = count("iterations", 1, 1_000_000, s.iterations)?;
        s.stint_laps = count("stint_laps", 0, 1000, s.stint_laps)?;
        let number = |key: &str, least: f64, most: f64, unit: &str, value: f64| -> Result<f64> {
            Ok(root.number(key, least, most, unit)?.unwrap_or(value))
        };
        s.spacing_m = number("spacing_m", 0.5, 50.0, "m", s.spacing_m)?;
        s.car_width_m = number("car_width_m", 0.0, 10.0, "m", s.car_width_m)?;
        s.entry_mps = number("entry_mps", 0.5, 150.0, "m/s", s.entry_mps)?;
        s.stint_fuel_kg = number("stint_fuel_kg", 0.0, 500.0, "kg", s.stint_fuel_kg)?;
        s.optimise = root.boolean("optimise")?.unwrap_or(s.optimise);
        s.energy_mj = root.number("energy_mj", 0.0, 1000.0, "MJ")?;
        s.match_lap_time_s = root.number("match_lap_time_s", 1.0, 1e5, "s")?;
        if let Some(budgets) = root.numbers("budgets_mj")? {
            if budgets.iter().any(|b| !(0.0..=1000.0).contains(b)) {
                return Err(root.refuse("budgets_mj", "energies of 0 to 1000 MJ"));
            }
            s.budgets_mj = budgets;
        }
        if let Some(name) = root.string("free")? {
            s.free = FreePart::named(name)
                .ok_or_else(|| root.refuse("free", "\"strategy\", \"line\" or \"both\""))?;
        }
        if let Some(names) = root.strings("objectives")? {
            let parsed: Option<Vec<_>> = names.iter().map(|n| HybridObjective::named(n)).collect();
            s.objectives = parsed
                .filter(|o| !o.is_empty())
                .ok_or_else(|| root.refuse("objectives", format!("a list of {HYBRID_OBJECTIVES}")))?;
        }
        if let Some(table) = root.table("scenarios")? {
            s.scenarios = table
                .keys()
                .map(|name| {
                    let row = table.required_table(name)?;
                    if name.len() > LONGEST_NAME {
                        let expected = format!("a scenario whose name has at most {LONGEST_NAME} bytes");
                        return Err(table.refuse(name, expected));
                    }
                    let scenario = read_scenario(name, &row)?;
                    row.finish()?;
                    Ok(scenario)
                })
                .collect::<Result<_>>()?;
            let mut stems: Vec<(String, &str)> = OWN_LAPS.map(|own| (stem(own).to_lowercase(), own)).into();
            for name in table.keys() {
                let stem = stem(name).to_lowercase();
                if let Some((_, other)) = stems.iter().find(|(taken, _)| *taken == stem) {
                    let expected = format!("a name that differs from `{other}` in its letters and digits");
                    return Err(table.refuse(name, expected));
                }
                stems.push((stem, name));
            }
            table.finish()?;
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

    /// What the study's memory goes with at the least, whatever the track; see
    /// [`HybridInputs::size`](super::HybridInputs::size).
    pub fn size(&self) -> Size {
        self.size_of(1)
    }

    /// What the study's memory goes with, with so many variables of a strategy and a line.
    pub(super) fn size_of(&self, variables: usize) -> Size {
        let front = usize::from(self.objectives.len() > 1);
        let sizing = if self.match_lap_time_s.is_some() {
            SIZING
        } else {
            0
        };
        let searches = if self.optimise { 1 + front } else { 0 } + sizing;
        Size {
            population: self.population,
            variables,
            // The journal holds those of all searches.
            iterations: self.iterations.saturating_mul(searches),
            sections: self.sections,
            journal: true,
            ..Size::default()
        }
    }

    /// Checks what ranges alone do not tell.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        let wrong = |place: &str, found: String, expected: &str| {
            Err(Error::input("the study", place, found, expected))
        };
        if self.scenarios.is_empty() && !self.optimise {
            return wrong(
                "scenarios",
                "none, and no optimisation".to_owned(),
                "something to do",
            );
        }
        let counts = [
            ("sections", self.sections, 8, 1_000_000),
            ("population", self.population, 8, 10_000_000),
            ("iterations", self.iterations, 1, 1_000_000),
            ("stint_laps", self.stint_laps, 0, 1000),
        ];
        for (name, value, least, most) in counts {
            if !(least..=most).contains(&value) {
                return wrong(name, value.to_string(), &format!("{least} to {most}"));
            }
        }
        let ranges = [
            ("spacing_m", self.spacing_m, 0.5, 50.0),
            ("car_width_m", self.car_width_m, 0.0, 10.0),
            ("entry_mps", self.entry_mps, 0.5, 150.0),
            ("energy_mj", self.energy_mj.unwrap_or(0.0), 0.0, 1000.0),
            ("stint_fuel_kg", self.stint_fuel_kg, 0.0, 500.0),
            ("match_lap_time_s", self.match_lap_time_s.unwrap_or(1.0), 1.0, 1e5),
        ];
        for (name, value, least, most) in ranges {
            if !(least..=most).contains(&value) {
                return wrong(name, value.to_string(), &format!("{least} to {most}"));
            }
        }
        let twice = (1..self.objectives.len()).find(|&i| self.objectives[..i].contains(&self.objectives[i]));
        match (self.objectives.len(), twice) {
            (0, _) => wrong("objectives", "none".to_owned(), HYBRID_OBJECTIVES),
            (_, Some(i)) => wrong(
                "objectives",
                format!("{} twice", self.objectives[i].name()),
                "each once",
            ),
            _ => Ok(()),
        }
    }

    /// Settings of the racing line that laps are driven on.
    pub(super) fn raceline(&self) -> RacelineSettings {
        RacelineSettings {
            track: self.track.clone(),
            car: self.car.clone(),
            envelope: self.envelope.clone(),
            sections: self.sections,
            car_width_m: self.car_width_m,
            entry_mps: self.entry_mps,
            seed: self.seed,
            backend: self.backend,
            adapter: self.adapter.clone(),
            ..RacelineSettings::default()
        }
    }

    /// The study file that repeats this study.
    pub fn to_toml(&self) -> String {
        let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
        let objectives: Vec<String> = self.objectives.iter().map(|o| quoted(o.name())).collect();
        let mut text = format!(
            "track = {}\ncar = {}\nsections = {}\nspacing_m = {:?}\ncar_width_m = {:?}\nentry_mps = {:?}\noptimise = {}\n\
             free = {}\nobjectives = [{}]\nbudgets_mj = {:?}\nstint_laps = {}\nstint_fuel_kg = {:?}\npopulation = {}\n\
             iterations = {}\nseed = {}\nbackend = {}\n",
            quoted(&absolute(&self.track)),
            quoted(&absolute(&self.car)),
            self.sections,
            self.spacing_m,
            self.car_width_m,
            self.entry_mps,
            self.optimise,
            quoted(self.free.name()),
            objectives.join(", "),
            self.budgets_mj,
            self.stint_laps,
            self.stint_fuel_kg,
            self.population,
            self.iterations,
            self.seed,
            quoted(match self.backend {
                BackendChoice::Auto => "auto",
                BackendChoice::Cpu => "cpu",
                BackendChoice::Simd => "simd",
                BackendChoice::Gpu => "gpu",
            }),
        );
        for (key, path) in [("envelope", &self.envelope), ("line", &self.line)] {
            if let Some(path) = path {
                text += &format!("{key} = {}\n", quoted(&absolute(&path.display().to_string())));
            }
        }
        if let Some(mj) = self.energy_mj {
            text += &format!("energy_mj = {mj:?}\n");
        }
        if let Some(s) = self.match_lap_time_s {
            text += &format!("match_lap_time_s = {s:?}\n");
        }
        if let Some(adapter) = &self.adapter {
            text += &format!("adapter = {}\n", quoted(adapter));
        }
        for scenario in &self.scenarios {
            let g = &scenario.gates;
            text += &format!(
                "\n[scenarios.{}]\nmode = {}\nsteer_rad = {:?}\nspeed_mps = {:?}\nax_mps2 = {:?}\nsoc = {:?}\nenergy_mj = {:?}\n\
                 motor_share = {:?}\n",
                quoted(&scenario.name),
                quoted(scenario.mode.name()),
                g.steer_rad,
                g.speed_mps,
                g.ax_mps2,
                g.soc,
                g.energy_mj,
                g.motor_share
            );
        }
        if self.scenarios.is_empty() {
            text += "\n[scenarios]\n";
        }
        text
    }
}

fn read_scenario(name: &str, row: &Table<'_>) -> Result<Scenario> {
    let open = Gates::OPEN;
    let number = |key: &str, least: f64, most: f64, value: f64| -> Result<f64> {
        Ok(row.number(key, least, most, "")?.unwrap_or(value))
    };
    let mode = match row.string("mode")? {
        Some(mode) => Mode::named(mode).ok_or_else(|| row.refuse("mode", "\"offset\" or \"additional\""))?,
        None => Mode::Offset,
    };
    Ok(Scenario {
        name: name.to_owned(),
        mode,
        gates: Gates {
            steer_rad: number("steer_rad", 0.0, 2.0, open.steer_rad)?,
            speed_mps: number("speed_mps", 0.0, 200.0, open.speed_mps)?,
            ax_mps2: number("ax_mps2", -100.0, 100.0, open.ax_mps2)?,
            soc: number("soc", -100.0, 2.0, open.soc)?,
            energy_mj: number("energy_mj", 0.0, 1000.0, open.energy_mj)?,
            motor_share: number("motor_share", 0.0, MOST_MOTOR, open.motor_share)?,
        },
    })
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
        let own = Scenario {
            name: "own one".to_owned(),
            mode: Mode::Additional,
            gates: Gates {
                steer_rad: 0.07,
                ..Gates::OPEN
            },
        };
        let settings = HybridStudySettings {
            scenarios: vec![own],
            objectives: vec![HybridObjective::Fuel, HybridObjective::SocSwing],
            free: FreePart::Both,
            energy_mj: Some(2.5),
            stint_laps: 3,
            ..HybridStudySettings::default()
        };
        std::fs::write(&path, settings.to_toml()).unwrap();
        assert_eq!(HybridStudySettings::read(&path).unwrap(), settings);
    }

    #[test]
    fn mistakes_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("study.toml");
        for (text, wanted) in [
            ("sections = 3", "sections"),
            ("objectives = [\"speed\"]", "objectives"),
            ("free = \"car\"", "free"),
            ("budgets_mj = [-1]", "budgets_mj"),
            ("[scenarios.own]\nsteer = 0.1", "scenarios.own.steer"),
            ("[scenarios.own]\nmode = \"both\"", "scenarios.own.mode"),
            ("[scenarios.own]\nsoc = 3", "scenarios.own.soc"),
            // Their laps would be of one file.
            (
                "[scenarios.\"a b\"]\n[scenarios.\"a/b\"]\n",
                "line 2, field scenarios.a/b",
            ),
            ("[scenarios.\"A b\"]\n[scenarios.a_b]\n", "differs from `A b`"),
            ("[scenarios.swarm]\n", "differs from `swarm`"),
            ("[scenarios.\"engine-alone\"]\n", "differs from `engine alone`"),
            (&format!("[scenarios.{}]\n", "n".repeat(300)), "at most 120 bytes"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = HybridStudySettings::read(&path).unwrap_err().to_string();
            assert!(error.contains(wanted), "{error} should say {wanted}");
        }
    }
}
