//! What a hybrid study is asked to do.

use super::scenario::{Scenario, published};
use crate::config::kinds::{
    Choice, Kind, SomeOf, choice, choices, count, file, name_or_file, named, number, numbers, of, optional,
    quoted, switch, text,
};
use crate::config::settings::{Flag, Written, settings};
use crate::config::{LONGEST_NAME, Table};
use crate::error::{Error, Result};
use crate::evaluate::BackendChoice;
use crate::evaluate::energy::{Free, HybridObjective, MOST_MOTOR};
use crate::files::stem;
use crate::line::energy::{Gates, Mode};
use crate::study::framework::memory::Size;
use crate::study::framework::shared_settings::{
    adapter, cognitive, entry_mps, envelope, inertia, islands, mutation, seed, social, steering_rate_deg_s,
    swarm,
};
use crate::study::framework::{Coefficients, Mutated, Scheduled};
use crate::study::raceline::RacelineSettings;
use crate::swarm::{FrontSearch, MopsoSettings, Mutation, PsoSettings, Schedule, SwarmPlace};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Laps that a study has beside those of its scenarios.
const OWN_LAPS: [&str; 6] = [
    "engine alone",
    "exact",
    "swarm",
    OFFSET_ZONES,
    ADDITIONAL_GATES,
    OFFSET_GATES,
];

/// The lap of a swarm that shares the energy out in the engine's place.
pub(super) const OFFSET_ZONES: &str = "offset zones";
/// The lap of a swarm that sets gates, beside the engine,
pub(super) const ADDITIONAL_GATES: &str = "additional gates";
/// and in its place.
pub(super) const OFFSET_GATES: &str = "offset gates";

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

named!(FreePart {
    Strategy = "strategy",
    Line = "line",
    Both = "both",
});

/// Which swarms share the energy out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum HybridAlgorithm {
    /// The best there are.
    Default,
    /// Those of the thesis.
    Thesis,
    /// The best there is for one objective, and NSGA-II for the front.
    Nsga2,
}

/// A gate that a swarm may set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FreeGate {
    /// Greatest steering.
    Steer,
    /// Greatest speed.
    Speed,
    /// Least acceleration.
    Acceleration,
    /// Least state of charge.
    Charge,
}

named!(FreeGate {
    Steer = "steer",
    Speed = "speed",
    Acceleration = "ax",
    Charge = "soc",
});

impl FreeGate {
    /// As a part of the strategy.
    pub(super) fn free(self) -> Free {
        match self {
            Self::Steer => Free::Steer,
            Self::Speed => Free::Speed,
            Self::Acceleration => Free::Acceleration,
            Self::Charge => Free::Soc,
        }
    }
}

named!(HybridAlgorithm {
    Default = "default",
    Thesis = "thesis",
    Nsga2 = "nsga2",
});

settings! {
    /// Settings of a hybrid study.
    pub struct HybridStudySettings {
        track: String ["-"] = "silverstone_gp".to_owned(), name_or_file(),
            "The circuit: a bundled name, a shape such as stadium:500:100:12, or a file";
        car: String ["-"] = "gt_hybrid".to_owned(), name_or_file(),
            "The car, with an engine map and a hybrid drive: a bundled name (gt_hybrid) or a TOML file";
        envelope: Option<PathBuf> = envelope;
        line: Option<PathBuf> ["-"] = None, optional(file()).example("\"line_fastest.csv\""),
            "A line (CSV with columns x and y in m) instead of the fastest one";
        sections: Option<usize> ["-"] = None, optional(count(8, 1_000_000)).example("960"),
            "Cross-sections of the track that the fastest line is found through; without it one for every 4 m, and 960 at least";
        spacing_m: f64 ["m"] = 4.0, number(0.5, 50.0),
            "Greatest distance between the points at which energy is accounted";
        car_width_m: f64 ["m"] = 2.0, number(0.0, 10.0),
            "Width of the car";
        steering_rate_deg_s: Option<f64> = steering_rate_deg_s;
        entry_mps: f64 = entry_mps;
        scenarios: Vec<Scenario> ["-"] = published(), of(Scenarios),
            "Strategies set by hand, each a table of its mode (offset or additional) and its gates";
        optimise: bool ["-"] = true, switch(true).flag(Flag::Switch("scenarios_only", false)),
            "Whether deployment is optimised too; else only the scenarios are driven";
        free: FreePart ["-"] = FreePart::Strategy, choice(),
            "What the front's swarm may change";
        objectives: Vec<HybridObjective> ["-"] = usual_objectives(), choices(),
            "What the swarm minimises; more than one for a front";
        gates: Vec<FreeGate> ["-"] = Vec::new(), of(FreeGates).example("[\"steer\", \"speed\"]"),
            "Gates that a swarm sets for the whole lap in place of zones: for the least lap time beside the engine, and for the least fuel in its place";
        offset: bool ["-"] = false, switch(false).flag(Flag::Switch("offset", true)),
            "Whether a swarm shares the energy out in the engine's place too, for the least fuel";
        energy_mj: Option<f64> ["MJ"] = None, optional(number(0.0, 1000.0)).example("2.1"),
            "Energy that may be deployed in a lap; without it what rules and store allow";
        store_overflow: bool ["-"] = false, switch(false).flag(Flag::Switch("store_overflow", true)),
            "Whether accounts let the charge pass one, as published ones do; else a full store takes no more";
        budgets_mj: Vec<f64> ["MJ"] = usual_budgets_mj(), numbers(0.0, 1000.0),
            "Energies of the front of time against energy";
        stint_laps: usize ["-"] = 0, count(0, 1000),
            "Laps of a stint that sustains its charge; zero for none";
        stint_fuel_kg: f64 ["kg"] = 60.0, number(0.0, 500.0),
            "Fuel on board at the start of the stint";
        match_lap_time_s: Option<f64> ["s"] = None, optional(number(1.0, 1e5)).example("113.5"),
            "Motor and store are sized so that the car laps in this time";
        algorithm: HybridAlgorithm ["-"] = HybridAlgorithm::Default, choice().search(),
            "Which swarms share the energy out; nsga2 is NSGA-II for the front";
        warm_start: Option<bool> ["-"] = None, optional(switch(true)).flag(Flag::Switch("no_warm_start", false)).search().example("true"),
            "Whether the front's swarm starts from the line and even shares; by default it does, except with algorithm thesis";
        inertia: Option<Schedule> = inertia;
        cognitive: Option<Schedule> = cognitive;
        social: Option<Schedule> = social;
        mutation: Option<Mutation> = mutation;
        islands: usize = islands;
        population: usize ["-"] = 64, count(8, 10_000_000).search(),
            "Particles of the swarms";
        iterations: usize ["-"] = 300, count(1, 1_000_000).search(),
            "Iterations of the swarms";
        seed: u64 = seed;
        swarm: SwarmPlace = swarm;
        backend: BackendChoice ["-"] = BackendChoice::Auto, choice().place(),
            "Where laps are evaluated";
        adapter: Option<String> = adapter;
    }

    fn consistent(&self) -> Result<()> {
        if self.scenarios.is_empty() && !self.optimise {
            let found = "none, and no optimisation";
            return Err(Error::input("the study", "scenarios", found, "something to do"));
        }
        let of_lines = |o: &&HybridObjective| matches!(o, HybridObjective::Length | HybridObjective::Gamma);
        if let Some(objective) = self.objectives.iter().find(of_lines)
            && (self.free == FreePart::Strategy || self.line.is_some())
        {
            let expected = "free = \"line\" or \"both\", and no line of a file: one line has one length";
            return Err(Error::input("the study", "objectives", objective.name(), expected));
        }
        let twice = (1..self.gates.len()).any(|i| self.gates[..i].contains(&self.gates[i]));
        if twice {
            return Err(Error::input("the study", "gates", "one twice", "each at most once"));
        }
        if self.algorithm != HybridAlgorithm::Thesis {
            self.coefficients().refuse_with(self.algorithm.name())?;
        }
        self.front_search().check(self.objectives.len(), self.population)
    }
}

fn usual_objectives() -> Vec<HybridObjective> {
    vec![HybridObjective::LapTime, HybridObjective::EnergyUsed]
}

fn usual_budgets_mj() -> Vec<f64> {
    vec![0.0, 0.5, 1.0, 1.5, 2.1, 3.0, 4.0, 5.3]
}

/// Searches that a sizing comes to at most: in each of eight ranges a whole one and seven of a quarter.
const SIZING: usize = 22;

impl HybridStudySettings {
    /// What looks for the front.
    pub(super) fn front_search(&self) -> FrontSearch {
        FrontSearch {
            genetic: self.algorithm == HybridAlgorithm::Nsga2,
            islands: self.islands,
        }
    }

    /// The swarm that looks for the front.
    pub(super) fn front_swarm(&self) -> MopsoSettings {
        let mopso = if self.algorithm == HybridAlgorithm::Thesis {
            let thesis = MopsoSettings::thesis();
            MopsoSettings {
                motion: self.coefficients().apply(thesis.motion),
                ..thesis
            }
        } else {
            MopsoSettings::default()
        };
        mopso
            .with_size(self.population, self.iterations)
            .with_seed(self.seed)
    }

    /// The swarm that looks for the best strategy by one objective with algorithm thesis.
    pub(super) fn strategy_swarm(&self) -> PsoSettings {
        self.coefficients().apply(PsoSettings {
            population: self.population,
            iterations: self.iterations,
            seed: self.seed,
            ..PsoSettings::thesis()
        })
    }

    /// Checks that the front's swarm can live where it is asked to.
    ///
    /// # Errors
    /// [`Error::Input`] with the reason if it cannot.
    pub(super) fn check_place(&self) -> Result<()> {
        let backend = (self.backend, self.adapter.as_deref());
        let objectives = self.objectives.len();
        let swarm = match objectives {
            1 if self.algorithm == HybridAlgorithm::Thesis => {
                MopsoSettings::of_one_objective(self.strategy_swarm())
            }
            _ => self.front_swarm(),
        };
        self.front_search()
            .wants_device(self.swarm, objectives, &swarm, backend)
            .map(drop)
    }

    /// Whether the front's swarm starts from what is known.
    pub(super) fn starts_warm(&self) -> bool {
        self.warm_start
            .unwrap_or(self.algorithm != HybridAlgorithm::Thesis)
    }

    /// What they say of the motion of the thesis's swarms.
    pub(super) fn coefficients(&self) -> Coefficients {
        Coefficients {
            inertia: self.inertia,
            cognitive: self.cognitive,
            social: self.social,
            mutation: self.mutation,
        }
    }

    /// What the study's memory goes with, with so many variables of a strategy and a line.
    pub(super) fn size_of(&self, variables: usize) -> Size {
        let front = usize::from(self.objectives.len() > 1);
        let sizing = self.match_lap_time_s.map_or(0, |_| SIZING);
        let more = usize::from(self.offset) + 2 * usize::from(!self.gates.is_empty());
        let searches = if self.optimise { 1 + front + more } else { 0 } + sizing;
        Size {
            population: self.population.saturating_mul(self.islands),
            variables,
            // The journal holds those of all searches.
            iterations: self.iterations.saturating_mul(searches),
            sections: self.raceline().size(None).sections,
            journal: true,
            ..Size::default()
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
            steering_rate_deg_s: self.steering_rate_deg_s,
            seed: self.seed,
            backend: self.backend,
            adapter: self.adapter.clone(),
            ..RacelineSettings::default()
        }
    }
}

/// Some of the gates, or none.
struct FreeGates;

impl Kind<Vec<FreeGate>> for FreeGates {
    fn read(&self, table: &Table<'_>, key: &str, unit: &str, folder: &Path) -> Result<Option<Vec<FreeGate>>> {
        SomeOf.read(table, key, unit, folder)
    }

    fn write(&self, gates: &Vec<FreeGate>) -> Option<Written> {
        if gates.is_empty() {
            return None;
        }
        SomeOf.write(gates)
    }

    fn parse(&self, text: &str, present: &Vec<FreeGate>) -> Result<Vec<FreeGate>, String> {
        SomeOf.parse(text, present)
    }

    fn range(&self) -> String {
        Kind::<Vec<FreeGate>>::range(&SomeOf)
    }

    fn value_name(&self) -> &'static str {
        "LIST"
    }

    fn flag(&self, name: &'static str) -> Flag {
        Flag::List(name)
    }
}

/// Strategies set by hand: the tables `[scenarios.*]`.
struct Scenarios;

impl Kind<Vec<Scenario>> for Scenarios {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Vec<Scenario>>> {
        let Some(table) = table.table(key)? else {
            return Ok(None);
        };
        let scenarios = table
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
        // Laps are files named after their scenarios.
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
        Ok(Some(scenarios))
    }

    fn write(&self, scenarios: &Vec<Scenario>) -> Option<Written> {
        let rows: Vec<String> = scenarios.iter().map(scenario_table).collect();
        Some(Written::Table(if rows.is_empty() {
            "[scenarios]\n".to_owned()
        } else {
            rows.join("\n")
        }))
    }

    fn parse(&self, _: &str, _: &Vec<Scenario>) -> Result<Vec<Scenario>, String> {
        Err("expected tables [scenarios.NAME] in a study file".to_owned())
    }

    fn flag(&self, _: &'static str) -> Flag {
        Flag::None
    }
}

/// A gate: its key, its range, and its place.
type Gate = (&'static str, [f64; 2], fn(&mut Gates) -> &mut f64);

const GATES: [Gate; 6] = [
    ("steer_rad", [0.0, 2.0], |g| &mut g.steer_rad),
    ("speed_mps", [0.0, 200.0], |g| &mut g.speed_mps),
    ("ax_mps2", [-100.0, 100.0], |g| &mut g.ax_mps2),
    ("soc", [-100.0, 2.0], |g| &mut g.soc),
    ("energy_mj", [0.0, 1000.0], |g| &mut g.energy_mj),
    ("motor_share", [0.0, MOST_MOTOR], |g| &mut g.motor_share),
];

fn scenario_table(scenario: &Scenario) -> String {
    let (name, mode) = (quoted(&scenario.name), quoted(scenario.mode.name()));
    let mut gates = scenario.gates;
    let rows = GATES.map(|(key, _, of)| format!("{key} = {:?}\n", of(&mut gates)));
    let start = scenario.start_soc.map(|soc| format!("start_soc = {soc:?}\n"));
    format!(
        "[scenarios.{name}]\nmode = {mode}\n{}{}",
        rows.concat(),
        start.unwrap_or_default()
    )
}

fn read_scenario(name: &str, row: &Table<'_>) -> Result<Scenario> {
    let mode = match row.string("mode")? {
        Some(mode) => Mode::named(mode).ok_or_else(|| row.refuse("mode", "\"offset\" or \"additional\""))?,
        None => Mode::Offset,
    };
    let mut gates = Gates::OPEN;
    for (key, [least, most], of) in GATES {
        if let Some(value) = row.number(key, least, most, "")? {
            *of(&mut gates) = value;
        }
    }
    Ok(Scenario {
        name: name.to_owned(),
        mode,
        gates,
        start_soc: row.number("start_soc", 0.0, 1.0, "")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::settings::testing::{assert_refused, assert_repeated};

    #[test]
    fn a_study_file_repeats_its_study() {
        let own = Scenario {
            name: "own one".to_owned(),
            mode: Mode::Additional,
            gates: Gates {
                steer_rad: 0.07,
                ..Gates::OPEN
            },
            start_soc: Some(0.4),
        };
        assert_repeated(&HybridStudySettings {
            scenarios: vec![own],
            objectives: vec![HybridObjective::Fuel, HybridObjective::SocSwing],
            free: FreePart::Both,
            energy_mj: Some(2.5),
            stint_laps: 3,
            ..HybridStudySettings::default()
        });
    }

    #[test]
    fn mistakes_are_named() {
        assert_refused::<HybridStudySettings>(&[
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
        ]);
    }
}
