//! Settings of an identification, from a study file.

use super::search::{EXPLORE, FRONT, GATHER};
use crate::config::{Document, Table, read_text};
use crate::error::{Error, Result};
use crate::evaluate::replay::{BackendChoice, CHANNEL_NAMES, Norm};
use crate::study::memory::Size;
use crate::swarm::{Mutation, Schedule};
use crate::telemetry::{CalibrationOptions, Switch};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

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

/// What the swarm minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ObjectiveChoice {
    /// The norm over all channels together, each relative to its own spread: the root of the mean square of the channels' costs
    /// in the 2-norm, their mean in the 1-norm and of mean squares, the greatest in the infinity norm.
    All,
    /// The cost of one channel, by its place in [`CHANNEL_NAMES`].
    Channel(usize),
}

/// Which swarm searches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Algorithm {
    /// An exploring swarm, then one that learns the shape of the valley.
    Adaptive,
    /// The exploring swarm alone.
    Pso,
    /// The swarm of the thesis, exactly.
    Thesis,
}

/// Settings of an identification.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IdentifySettings {
    /// The car that fixed parameters come from: a bundled name or a file.
    pub car: String,
    /// The log; the bundled lap where none is given.
    pub log: Option<PathBuf>,
    /// Channel names, units and delays of the log.
    pub channel_map: Option<PathBuf>,
    /// The circuit that sections are named on, and that the map shows.
    pub track: Option<String>,
    /// The car that drove the log, where known.
    pub truth: Option<String>,
    /// Parameters to find.
    pub free: Vec<FreeParameter>,
    /// Objectives; more than one makes the search multi-objective.
    pub objectives: Vec<ObjectiveChoice>,
    /// Norm of the costs.
    pub norm: Norm,
    /// Length of the windows, s; whole laps where not given.
    pub window_s: Option<f64>,
    /// Time at the start of each window that is driven but not scored, s.
    pub settle_s: f64,
    /// Only this section of the track is scored.
    pub section: Option<String>,
    /// Laps to fit; the complete ones but those held out where empty.
    pub laps: Vec<u32>,
    /// Laps that are not fitted but judged on.
    pub holdout: Vec<u32>,
    /// Slowest speed of a window, m/s: slower ones are left out.
    pub least_speed_mps: f64,
    /// Sample rate to which the log is brought, Hz; its own where not given.
    pub rate_hz: Option<f64>,
    /// Runge-Kutta steps per sample; chosen for stability where not given.
    pub substeps: Option<usize>,
    /// Corrections estimated from the log.
    pub calibration: CalibrationOptions,
    /// The swarm.
    pub algorithm: Algorithm,
    /// Particles; the algorithm's own where not given.
    pub population: Option<usize>,
    /// Iterations; the algorithm's own where not given.
    pub iterations: Option<usize>,
    /// Inertia weight; the algorithm's own where not given.
    pub inertia: Option<Schedule>,
    /// Pull towards the own best.
    pub cognitive: Option<Schedule>,
    /// Pull towards the leader.
    pub social: Option<Schedule>,
    /// Mutation of the multi-objective swarm.
    pub mutation: Option<Mutation>,
    /// Members of the multi-objective archive.
    pub archive: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Whether the swarm's best is polished by least squares.
    pub polish: bool,
    /// Hops from the polished minimum to others that are tried, where what is left over does not look like noise.
    pub hops: usize,
    /// Backend.
    pub backend: BackendChoice,
    /// Part of the name of the adapter to use.
    pub adapter: Option<String>,
}

/// The 22 unknowns of the thesis (5.11) within wide bounds.
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

impl Default for IdentifySettings {
    fn default() -> Self {
        let free = |(name, lower, upper): (&str, f64, f64)| FreeParameter {
            name: name.to_owned(),
            lower,
            upper,
        };
        Self {
            car: "gt".to_owned(),
            log: None,
            channel_map: None,
            track: None,
            truth: None,
            free: USUAL_UNKNOWNS.map(free).to_vec(),
            objectives: vec![ObjectiveChoice::All],
            norm: Norm::Two,
            window_s: None,
            settle_s: 0.5,
            section: None,
            laps: Vec::new(),
            holdout: Vec::new(),
            least_speed_mps: 8.0,
            rate_hz: None,
            substeps: None,
            calibration: CalibrationOptions::default(),
            algorithm: Algorithm::Adaptive,
            population: None,
            iterations: None,
            inertia: None,
            cognitive: None,
            social: None,
            mutation: None,
            archive: 100,
            seed: 1,
            polish: true,
            hops: 2,
            backend: BackendChoice::Auto,
            adapter: None,
        }
    }
}

/// Parses a backend's name.
pub fn parse_backend(name: &str) -> Option<BackendChoice> {
    Some(match name {
        "auto" => BackendChoice::Auto,
        "cpu" => BackendChoice::Cpu,
        "simd" => BackendChoice::Simd,
        "gpu" => BackendChoice::Gpu,
        _ => return None,
    })
}

/// Parses an objective's name: `all`, or a channel.
pub fn parse_objective(name: &str) -> Option<ObjectiveChoice> {
    if name == "all" {
        return Some(ObjectiveChoice::All);
    }
    CHANNEL_NAMES
        .iter()
        .position(|c| *c == name)
        .map(ObjectiveChoice::Channel)
}

/// Parses a norm's name: `1`, `2`, `infinity` or `mse`.
pub fn parse_norm(name: &str) -> Option<Norm> {
    Some(match name {
        "1" => Norm::One,
        "2" => Norm::Two,
        "infinity" => Norm::Infinity,
        "mse" => Norm::MeanSquare,
        _ => return None,
    })
}

/// Parses an algorithm's name: `adaptive`, `pso` or `thesis`.
pub fn parse_algorithm(name: &str) -> Option<Algorithm> {
    Some(match name {
        "adaptive" => Algorithm::Adaptive,
        "pso" => Algorithm::Pso,
        "thesis" => Algorithm::Thesis,
        _ => return None,
    })
}

impl IdentifySettings {
    /// Reads a study file. Paths in it are relative to the file.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field for anything unknown or out of range.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_beside(path, Self::default(), |_| Ok(()))
    }

    /// As [`IdentifySettings::read`], of a file's text; `path` is its name in messages, and paths are relative to it.
    ///
    /// # Errors
    /// As [`IdentifySettings::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        Self::parse_beside(path, text, Self::default(), |_| Ok(()))
    }

    /// As [`IdentifySettings::read`] from other defaults, for studies of a replay that have settings of their own:
    /// `own` reads these from the same file.
    ///
    /// # Errors
    /// As [`IdentifySettings::read`], and those of `own`.
    pub(crate) fn read_beside(
        path: &Path,
        defaults: Self,
        own: impl FnOnce(&Table<'_>) -> Result<()>,
    ) -> Result<Self> {
        Self::parse_beside(path, &read_text(path)?, defaults, own)
    }

    fn parse_beside(
        path: &Path,
        text: &str,
        defaults: Self,
        own: impl FnOnce(&Table<'_>) -> Result<()>,
    ) -> Result<Self> {
        let folder = path.parent().unwrap_or(Path::new("."));
        let document = Document::parse(path, text)?;
        let root = document.root();
        let mut s = defaults;
        own(&root)?;
        let file = |name: &str| folder.join(name);
        let named_or_file = |name: &str| {
            if Path::new(name).extension().is_some() {
                file(name).display().to_string()
            } else {
                name.to_owned()
            }
        };
        if let Some(name) = root.string("car")? {
            s.car = named_or_file(name);
        }
        s.log = root.string("log")?.map(file);
        s.channel_map = root.string("channel_map")?.map(file);
        s.track = root.string("track")?.map(named_or_file);
        s.truth = root.string("truth")?.map(named_or_file);
        s.section = root.string("section")?.map(str::to_owned);
        if let Some(names) = root.strings("objectives")? {
            let parsed: Option<Vec<_>> = names.iter().map(|n| parse_objective(n)).collect();
            s.objectives = parsed.filter(|o| !o.is_empty()).ok_or_else(|| {
                root.refuse(
                    "objectives",
                    "a list of \"all\", \"vx\", \"ax\", \"ay\", \"yaw_rate\"",
                )
            })?;
        }
        s.norm = choice(
            &root,
            "norm",
            s.norm,
            parse_norm,
            "\"1\", \"2\", \"infinity\" or \"mse\"",
        )?;
        s.window_s = root.number("window_s", 0.2, 1e5, "s")?.or(s.window_s);
        s.settle_s = root.number("settle_s", 0.0, 60.0, "s")?.unwrap_or(s.settle_s);
        s.least_speed_mps = root
            .number("least_speed_mps", 1.0, 60.0, "m/s")?
            .unwrap_or(s.least_speed_mps);
        s.rate_hz = root.number("rate_hz", 5.0, 1000.0, "Hz")?;
        s.substeps = root.integer("substeps", 1, 1000)?.map(|n| n as usize);
        s.laps = lap_numbers(&root, "laps")?;
        s.holdout = lap_numbers(&root, "holdout")?;
        s.seed = root.integer("seed", 0, u64::MAX)?.unwrap_or(s.seed);
        s.polish = root.boolean("polish")?.unwrap_or(s.polish);
        s.hops = root.integer("hops", 0, 1000)?.map_or(s.hops, |n| n as usize);
        s.backend = choice(
            &root,
            "backend",
            s.backend,
            parse_backend,
            "\"auto\", \"cpu\", \"simd\" or \"gpu\"",
        )?;
        s.adapter = root.string("adapter")?.map(str::to_owned);
        if let Some(table) = root.table("swarm")? {
            s.read_swarm(&table)?;
            table.finish()?;
        }
        if let Some(table) = root.table("calibration")? {
            s.calibration = read_calibration(&table)?;
            table.finish()?;
        }
        if let Some(table) = root.table("free")? {
            s.free = table
                .keys()
                .map(|name| {
                    let expected = "[lower, upper], two numbers in ascending order";
                    match table.numbers(name)?.as_deref() {
                        Some(&[lower, upper]) if lower < upper => Ok(FreeParameter {
                            name: name.to_owned(),
                            lower,
                            upper,
                        }),
                        _ => Err(table.refuse(name, expected)),
                    }
                })
                .collect::<Result<_>>()?;
            table.finish()?;
        }
        root.finish()?;
        if s.free.is_empty() {
            return Err(Error::input(
                path,
                "table [free]",
                "no parameter",
                "at least one parameter = [lower, upper]",
            ));
        }
        Ok(s)
    }

    /// What the study's memory goes with.
    pub fn size(&self) -> Size {
        let several = self.objectives.len() > 1;
        let population = self.population.unwrap_or(if several { FRONT.0 } else { 0 });
        Size {
            population: population.max(EXPLORE.0),
            variables: self.free.len(),
            iterations: self.iterations.unwrap_or(GATHER.1),
            archive: if several { self.archive } else { 0 },
            ..Size::default()
        }
    }

    /// The same with the paths of files absolute, so that they mean the same from every folder.
    ///
    /// # Errors
    /// [`Error::Io`] if the present folder cannot be told.
    pub fn absolute(mut self) -> Result<Self> {
        let whole = |path: &mut PathBuf| -> Result<()> {
            *path = std::path::absolute(&path).map_err(|e| Error::io(&path, "find", e))?;
            Ok(())
        };
        for path in [&mut self.log, &mut self.channel_map].into_iter().flatten() {
            whole(path)?;
        }
        for name in [Some(&mut self.car), self.track.as_mut(), self.truth.as_mut()]
            .into_iter()
            .flatten()
            .filter(|name| Path::new(name).is_file())
        {
            let mut path = PathBuf::from(&name);
            whole(&mut path)?;
            *name = path.display().to_string();
        }
        Ok(self)
    }

    fn read_swarm(&mut self, table: &Table<'_>) -> Result<()> {
        self.algorithm = choice(
            table,
            "algorithm",
            self.algorithm,
            parse_algorithm,
            "\"adaptive\", \"pso\" or \"thesis\"",
        )?;
        self.population = table.integer("population", 2, 100_000_000)?.map(|n| n as usize);
        self.iterations = table.integer("iterations", 1, 100_000_000)?.map(|n| n as usize);
        self.archive = table
            .integer("archive", 2, 100_000)?
            .map_or(self.archive, |n| n as usize);
        let schedule = |key: &str| -> Result<Option<Schedule>> {
            if let Ok(fixed) = table.number(key, 0.0, 10.0, "") {
                return Ok(fixed.map(Schedule::Fixed));
            }
            match table.numbers(key)?.as_deref() {
                Some(&[from, to]) => Ok(Some(Schedule::Linear { from, to })),
                _ => Err(table.refuse(key, "a number, or [first, last] for a linear schedule")),
            }
        };
        self.inertia = schedule("inertia")?;
        self.cognitive = schedule("cognitive")?;
        self.social = schedule("social")?;
        self.mutation = match (table.number("mutation", 0.0, 10.0, ""), table.string("mutation")) {
            (Ok(None), _) => self.mutation,
            (Ok(Some(mu)), _) => Some(if mu > 0.0 {
                Mutation::Fixed(mu)
            } else {
                Mutation::None
            }),
            (_, Ok(Some("random"))) => Some(Mutation::Random),
            (_, Ok(Some("polynomial"))) => Some(Mutation::SMPSO),
            _ => return Err(table.refuse("mutation", "a number from 0 to 10, \"random\" or \"polynomial\"")),
        };
        Ok(())
    }
}

fn choice<T>(
    table: &Table<'_>,
    key: &str,
    default: T,
    parse: impl Fn(&str) -> Option<T>,
    expected: &str,
) -> Result<T> {
    match table.string(key)? {
        Some(name) => parse(name).ok_or_else(|| table.refuse(key, expected)),
        None => Ok(default),
    }
}

fn lap_numbers(table: &Table<'_>, key: &str) -> Result<Vec<u32>> {
    let numbers = table.numbers(key)?.unwrap_or_default();
    numbers
        .iter()
        .map(|&x| {
            if (0.0..=1e6).contains(&x) && x.fract() == 0.0 {
                Ok(x as u32)
            } else {
                Err(table.refuse(key, "a list of lap numbers"))
            }
        })
        .collect()
}

fn read_calibration(table: &Table<'_>) -> Result<CalibrationOptions> {
    let switch = |key: &str| -> Result<Switch> {
        Ok(match table.boolean(key)? {
            None => Switch::Auto,
            Some(true) => Switch::On,
            Some(false) => Switch::Off,
        })
    };
    Ok(CalibrationOptions {
        signs: switch("signs")?,
        delays: switch("delays")?,
        offsets: switch("offsets")?,
        rolling_radius: switch("rolling_radius")?,
    })
}
