//! Settings of an identification.

use super::pool;
use crate::config::kinds::{
    Choice, Kind, choice, choices, count, counts, file, name_or_file, number, of, optional, quoted, shared,
    switch, text,
};
use crate::config::settings::{Flag, Written, settings};
use crate::config::{Table, read_text};
use crate::error::{Error, Result};
use crate::evaluate::BackendChoice;
use crate::evaluate::replay::{CHANNEL_NAMES, Norm};
use crate::files::run_folder::SUMMARY;
use crate::study::framework::memory::Size;
use crate::study::framework::shared_settings::{
    adapter, channel_map, cognitive, inertia, islands, seed, social,
};
use crate::study::framework::{Coefficients, Mutated, Scheduled};
use crate::swarm::{FrontSearch, Mutation, Schedule, SwarmPlace};
use crate::telemetry::CalibrationOptions;
use crate::vehicle::Car;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Exploring swarm of the adaptive search: many particles for a short while. Twice as many as a study's own number at most,
/// and for no more iterations than that has.
pub(super) const EXPLORE: (usize, usize) = (128, 50);
/// Gathering swarm of the adaptive search. The polish follows it, so it may be short.
pub(super) const GATHER: (usize, usize) = (64, 150);
/// Its iterations where nothing is polished.
const GATHER_ALONE: usize = 1500;

/// Swarm of a search for several costs: of 64 to 1024 particles with as many cars in all, those that came furthest
/// (`lapswarm bench studies`).
pub(super) const FRONT: (usize, usize) = (512, 75);

/// A parameter to find, and where to look for it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeParameter {
    /// Its name, as [`crate::vehicle::Car::parameter`] knows it.
    pub name: String,
    /// Least value.
    pub lower: f64,
    /// Greatest value.
    pub upper: f64,
}

/// The parameters to find.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unknowns {
    /// The parameters; with `auto` none, where they are those that are usually not known of a car.
    pub among: Vec<FreeParameter>,
    /// Whether those of them are found that the log can tell, and not all.
    pub auto: bool,
    /// Whether nothing was said: on the bundled lap all of them are found, on a log of one's own those that it can tell of what is usually
    /// not known of a car.
    #[serde(default)]
    pub unsaid: bool,
}

impl From<Vec<FreeParameter>> for Unknowns {
    fn from(among: Vec<FreeParameter>) -> Self {
        Self {
            among,
            auto: false,
            unsaid: false,
        }
    }
}

impl FromIterator<FreeParameter> for Unknowns {
    fn from_iter<I: IntoIterator<Item = FreeParameter>>(iter: I) -> Self {
        iter.into_iter().collect::<Vec<_>>().into()
    }
}

impl std::ops::Deref for Unknowns {
    type Target = [FreeParameter];

    fn deref(&self) -> &[FreeParameter] {
        &self.among
    }
}

/// What the swarm minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ObjectiveChoice {
    /// The norm over all channels together, each relative to its own spread: the root of the mean square of the channels' costs
    /// in the 2-norm, their mean in the 1-norm and of mean squares, the greatest in the infinity norm.
    All,
    /// The cost of one channel, by its place in [`CHANNEL_NAMES`].
    Channel(usize),
}

impl Choice for ObjectiveChoice {
    const ALL: &'static [Self] = &[
        Self::All,
        Self::Channel(0),
        Self::Channel(1),
        Self::Channel(2),
        Self::Channel(3),
    ];

    fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Channel(k) => CHANNEL_NAMES[k],
        }
    }
}

/// How much of a car there is in its model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ModelChoice {
    /// Four degrees of freedom, with roll.
    Roll,
    /// Three: the centre of gravity is on the ground, so that the car neither rolls nor shifts its load.
    NoRoll,
    /// As before, with both wheels of an axle at one place.
    Bicycle,
}

crate::config::kinds::named!(ModelChoice {
    Roll = "roll",
    NoRoll = "no-roll",
    Bicycle = "bicycle",
});

impl ModelChoice {
    /// The car as this model has it. Heights and tracks are the least that a car may have.
    pub(in crate::study) fn of(self, mut car: Car) -> Car {
        let c = &mut car.chassis;
        if self != Self::Roll {
            (c.cg_height, c.drag_height, c.pitch_transfer) = (LEAST_HEIGHT_M, 0.0, 0.0);
        }
        if self == Self::Bicycle {
            (c.half_track_front, c.half_track_rear) = (LEAST_HALF_TRACK_M, LEAST_HALF_TRACK_M);
        }
        car
    }
}

/// The least height of a centre of gravity (m),
const LEAST_HEIGHT_M: f64 = 0.01;
/// and the least half of a track (m).
const LEAST_HALF_TRACK_M: f64 = 0.1;

/// Which swarm searches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Algorithm {
    /// An exploring swarm, then one that learns the shape of the valley.
    Adaptive,
    /// The exploring swarm alone.
    Pso,
    /// The swarm of the thesis, exactly.
    Thesis,
    /// NSGA-II, for several objectives.
    Nsga2,
}

crate::config::kinds::named!(Algorithm {
    Adaptive = "adaptive",
    Pso = "pso",
    Thesis = "thesis",
    Nsga2 = "nsga2",
});

settings! {
    /// Settings of an identification.
    pub struct IdentifySettings {
        car: String ["-"] = "gt".to_owned(), name_or_file(),
            "The car that fixed parameters come from: a bundled name (gt, gt_hybrid) or a TOML file";
        model: ModelChoice ["-"] = ModelChoice::Roll, choice(),
            "How much of the car there is: with roll, four wheels without roll and load transfer, or a bicycle, which has no track either";
        log: Option<PathBuf> ["-"] = None, optional(file()).example("\"lap.csv\""),
            "The log: CSV (ours, MoTeC i2, RaceChrono, others), MoTeC .ld or VBOX .vbo; without it the bundled lap";
        channel_map: Option<PathBuf> = channel_map;
        track: Option<String> ["-"] = None, optional(name_or_file()).example("\"silverstone_gp\""),
            "The circuit that sections are named on: a bundled name, a TOML file, a survey (CSV, GPX, KML, log) or a shape";
        truth: Option<String> ["-"] = None, optional(name_or_file()).example("\"gt\""),
            "The car that drove the log, where it is known: the parameters' errors are stated against it";
        free: Unknowns ["-"] = usual_unknowns(), of(Bounds).example("\"auto\""),
            "Parameters to find, each with its least and greatest value; auto finds those that the log can tell, of these or of what is usually not known of a car; unset, it is auto on a log of your own and the thesis's 22 on the bundled lap";
        free_from: Option<PathBuf> ["-"] = None, optional(file()).example("\"runs/sensitivity-001\""),
            "A run of sensitivity: its parameters that matter most are found, within the bounds of free or else over the range that it moved them";
        most: usize ["-"] = 12, count(1, 1000),
            "Parameters that are found with free_from";
        objectives: Vec<ObjectiveChoice> ["-"] = vec![ObjectiveChoice::All], choices(),
            "What is fitted: all channels together, or channels at once; more than one searches a Pareto front";
        norm: Norm ["-"] = Norm::Two, choice(),
            "Norm of the costs; the polish of identify is least squares whatever the norm";
        window_s: Option<f64> ["s"] = None, optional(number(0.2, 1e5)).example("3.0"),
            "Length of the windows that restart from the log; without it whole laps are driven, or 5 s where the starting car does not drive them";
        settle_s: Option<f64> ["s"] = None, optional(number(0.0, 60.0)).example("2.0"),
            "Time that each window is driven before it is scored, over samples ahead of it; without it as long as the car takes to settle";
        section: Option<String> ["-"] = None, optional(text()).example("\"Abbey\""),
            "Only this section of the track is scored";
        laps: Vec<u32> ["-"] = Vec::new(), counts().example("[1, 2]"),
            "Laps to drive; without it all complete ones but those held out";
        holdout: Vec<u32> ["-"] = Vec::new(), counts().example("[3]"),
            "Laps to judge on, not to fit";
        least_speed_mps: f64 ["m/s"] = 8.0, number(1.0, 60.0),
            "Windows that are slower than this somewhere are left out";
        rate_hz: Option<f64> ["Hz"] = None, optional(number(5.0, 1000.0)).example("100.0"),
            "Sample rate to which the log is brought; without it its own";
        substeps: Option<usize> ["-"] = None, optional(count(1, 1000)).example("4"),
            "Runge-Kutta steps per sample; without it as many as stability needs";
        calibration: CalibrationOptions ["-"] = CalibrationOptions::default(), shared(),
            "Corrections that are estimated from the log";
        algorithm: Algorithm as "swarm.algorithm" ["-"] = Algorithm::Adaptive, choice().search(),
            "The search; nsga2 (NSGA-II) for several objectives";
        population: Option<usize> as "swarm.population" ["-"] = None, optional(count(2, 100_000_000)).search().example("64"),
            "Particles; without it the algorithm's own number";
        iterations: Option<usize> as "swarm.iterations" ["-"] = None, optional(count(1, 100_000_000)).search().example("1500"),
            "Iterations; without it the algorithm's own number";
        inertia: Option<Schedule> as "swarm.inertia" = inertia;
        cognitive: Option<Schedule> as "swarm.cognitive" = cognitive;
        social: Option<Schedule> as "swarm.social" = social;
        mutation: Option<Mutation> as "swarm.mutation" ["-"] = None, of(Mutated).search().example("\"polynomial\""),
            "Mutation of the swarm: an exponent from 0 (none) to 10, random or polynomial";
        islands: usize as "swarm.islands" = islands;
        archive: usize as "swarm.archive" ["-"] = 100, count(2, 100_000).search(),
            "Members of the archive of the multi-objective swarm";
        place: SwarmPlace as "swarm.place" ["-"] = SwarmPlace::Auto, choice().flag(Flag::Value("swarm")).search(),
            "Where the particles of a front and of algorithm thesis live; auto: on the device from 4096 particles on, where a graphics processor evaluates";
        seed: u64 = seed;
        polish: bool ["-"] = true, switch(true).flag(Flag::Switch("no_polish", false)).search(),
            "Whether the swarm's best is polished by least squares";
        hops: usize ["-"] = 4, count(0, 1000).search(),
            "Further polishes, each from the best of 1024 draws, while the errors that remain do not look like noise";
        backend: BackendChoice ["-"] = BackendChoice::Auto, choice().place(),
            "Where candidates are evaluated";
        adapter: Option<String> = adapter;
    }

    fn consistent(&self) -> Result<()> {
        if self.free.is_empty() && !self.free.auto {
            let expected = "at least one parameter = [lower, upper]";
            return Err(Error::input("the study", "table [free]", "no parameter", expected));
        }
        if self.algorithm == Algorithm::Nsga2 {
            self.coefficients().refuse_with(self.algorithm.name())?;
        }
        let population = self.population.unwrap_or(FRONT.0);
        self.front_search().check(self.objectives.len(), population)
    }
}

/// The 22 unknowns of the thesis (5.11) within wide bounds.
fn usual_unknowns() -> Unknowns {
    let free = |(name, lower, upper): (&str, f64, f64)| FreeParameter {
        name: name.to_owned(),
        lower,
        upper,
    };
    Unknowns {
        unsaid: true,
        ..USUAL_UNKNOWNS.map(free).to_vec().into()
    }
}

/// Names and bounds of [`usual_unknowns`].
const USUAL_UNKNOWNS: [(&str, f64, f64); 22] = [
    ("rBx1", 5.0, 25.0),
    ("rBx2", 2.0, 25.0),
    ("rCx1", 0.8, 1.5),
    ("rEx1", -2.0, 1.0),
    ("rEx2", -1.0, 1.0),
    ("rHx1", -0.05, 0.05),
    ("rBy1", 5.0, 25.0),
    ("rBy2", 2.0, 25.0),
    ("rBy3", -0.1, 0.1),
    ("rCy1", 0.8, 1.5),
    ("rEy1", -2.0, 1.0),
    ("rEy2", -1.0, 1.0),
    ("rHy1", -0.05, 0.05),
    ("rHy2", -0.05, 0.05),
    ("rVy1", -0.2, 0.2),
    ("rVy2", -0.2, 0.2),
    ("rVy3", -2.0, 2.0),
    ("rVy4", 2.0, 30.0),
    ("rVy5", 0.5, 3.0),
    ("rVy6", 2.0, 30.0),
    ("K", 3e4, 3e5),
    ("C", 3e3, 5e4),
];

/// What is read of the summary of a sensitivity study: its parameters, those that matter most first.
#[derive(Deserialize)]
struct Ranking {
    study: String,
    #[serde(default)]
    parameters: Vec<Ranked>,
}

#[derive(Deserialize)]
struct Ranked {
    name: String,
    range: [f64; 2],
}

impl IdentifySettings {
    /// The parameters to find: those of the settings, those that are usually not known of `car`, or those that matter most by a
    /// sensitivity study.
    ///
    /// # Errors
    /// [`Error::Io`] if the study's summary cannot be read, [`Error::Input`] if it is another study's.
    pub(super) fn freed(&self, car: &Car) -> Result<Vec<FreeParameter>> {
        let Some(run) = &self.free_from else {
            if self.free.is_empty() || self.free.unsaid && self.chooses() {
                return Ok(pool::unsure_of(car));
            }
            return Ok(self.free.to_vec());
        };
        let path = if run.is_dir() {
            run.join(SUMMARY)
        } else {
            run.clone()
        };
        let refused = |found: String| {
            let expected = "the summary of a sensitivity study";
            Error::input(path.display().to_string(), "study", found, expected)
        };
        let ranking: Ranking =
            serde_json::from_str(&read_text(&path)?).map_err(|e| refused(format!("no summary ({e})")))?;
        if ranking.study != "sensitivity" || ranking.parameters.is_empty() {
            return Err(refused(ranking.study));
        }
        let with_bounds = |ranked: &Ranked| {
            let known = self.free.iter().find(|free| free.name == ranked.name);
            known.cloned().unwrap_or(FreeParameter {
                name: ranked.name.clone(),
                lower: ranked.range[0],
                upper: ranked.range[1],
            })
        };
        Ok(ranking
            .parameters
            .iter()
            .take(self.most)
            .map(with_bounds)
            .collect())
    }

    /// Whether the log chooses what is found.
    pub(super) fn chooses(&self) -> bool {
        self.free.auto || self.free.unsaid && self.log.is_some() && self.free_from.is_none()
    }

    /// What looks for a front.
    pub(super) fn front_search(&self) -> FrontSearch {
        FrontSearch {
            genetic: self.algorithm == Algorithm::Nsga2,
            islands: self.islands,
        }
    }

    /// What they say of the swarm's motion.
    pub(super) fn coefficients(&self) -> Coefficients {
        Coefficients {
            inertia: self.inertia,
            cognitive: self.cognitive,
            social: self.social,
            mutation: self.mutation,
        }
    }

    /// Iterations of the gathering swarm of the adaptive search.
    pub(super) fn gathering(&self) -> usize {
        let usual = if self.polish { GATHER.1 } else { GATHER_ALONE };
        self.iterations.unwrap_or(usual)
    }

    /// What the study's memory goes with.
    pub fn size(&self) -> Size {
        let several = self.objectives.len() > 1;
        let population = self.population.unwrap_or(if several { FRONT.0 } else { 0 });
        Size {
            population: population.saturating_mul(self.islands).max(EXPLORE.0),
            variables: match &self.free_from {
                Some(_) => self.most,
                None if self.free.is_empty() => pool::MOST,
                None => self.free.len(),
            },
            iterations: self.gathering(),
            archive: if several { self.archive } else { 0 },
            ..Size::default()
        }
    }
}

/// The word for parameters that the log chooses.
const AUTO: &str = "auto";

/// Names of parameters with their bounds: the table `[free]`.
struct Bounds;

impl Kind<Unknowns> for Bounds {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Unknowns>> {
        let auto = |among: Vec<FreeParameter>| Unknowns {
            auto: true,
            ..among.into()
        };
        if !table.is_table(key) {
            return match table.string(key)? {
                None => Ok(None),
                Some(word) if word == AUTO => Ok(Some(auto(Vec::new()))),
                Some(_) => Err(table.refuse(key, "\"auto\", or a table of parameters = [lower, upper]")),
            };
        }
        let Some(table) = table.table(key)? else {
            return Ok(None);
        };
        let bounds = |name: &str| match table.numbers(name)?.as_deref() {
            Some(&[lower, upper]) if lower < upper => Ok(FreeParameter {
                name: name.to_owned(),
                lower,
                upper,
            }),
            _ => Err(table.refuse(name, "[lower, upper], two numbers in ascending order")),
        };
        let is_auto = table.boolean(AUTO)?.unwrap_or(false);
        let named = table.keys().filter(|name| *name != AUTO);
        let found = named.map(bounds).collect::<Result<Vec<_>>>()?;
        table.finish()?;
        Ok(Some(if is_auto { auto(found) } else { found.into() }))
    }

    fn write(&self, free: &Unknowns) -> Option<Written> {
        if free.unsaid {
            return None;
        }
        let auto = if free.auto { "auto = true\n" } else { "" };
        let row = |free: &FreeParameter| {
            let dotted = free.name.contains('.');
            let key = if dotted {
                quoted(&free.name)
            } else {
                free.name.clone()
            };
            format!("{key} = [{:?}, {:?}]\n", free.lower, free.upper)
        };
        let rows: String = free.iter().map(row).collect();
        Some(Written::Table(format!("[free]\n{auto}{rows}")))
    }

    /// Names whose bounds are those of the present list, or from zero to one, or `name=lower:upper`; `auto` chooses among them, or
    /// else among the study file's list, or else among what is usually not known of a car.
    fn parse(&self, text: &str, present: &Unknowns) -> Result<Unknowns, String> {
        let named = |part: &str| {
            if let Some((name, bounds)) = part.split_once('=') {
                let parsed = bounds
                    .split_once(':')
                    .and_then(|(lower, upper)| Some((lower.parse().ok()?, upper.parse().ok()?)));
                return match parsed {
                    Some((lower, upper)) if lower < upper => Ok(FreeParameter {
                        name: name.to_owned(),
                        lower,
                        upper,
                    }),
                    _ => Err("expected NAME=LOWER:UPPER, two numbers in ascending order".to_owned()),
                };
            }
            let known = present.iter().find(|free| free.name == part);
            Ok(known.cloned().unwrap_or(FreeParameter {
                name: part.to_owned(),
                lower: 0.0,
                upper: 1.0,
            }))
        };
        let parts = || text.split(',').map(str::trim);
        let auto = parts().any(|part| part == AUTO);
        let among: Vec<FreeParameter> = parts()
            .filter(|part| *part != AUTO)
            .map(named)
            .collect::<Result<_, String>>()?;
        let among = if auto && among.is_empty() && *present != usual_unknowns() {
            present.among.clone()
        } else {
            among
        };
        Ok(Unknowns { auto, ..among.into() })
    }

    fn value_name(&self) -> &'static str {
        "LIST"
    }

    fn flag(&self, name: &'static str) -> Flag {
        Flag::List(name)
    }
}
