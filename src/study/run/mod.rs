//! The whole way from a log to a lap: the car that drove it, its limits, the line that suits it, that line driven by the
//! car itself, whose grip is fed back into the limits until both laps agree, and a hybrid's energy on it.

mod page;
mod stage;
mod story;

pub use stage::{Inputs, Stages};
pub use story::{EnergySummary, RoundSummary, Summary};

use crate::config::{Document, read_text};
use crate::error::{Error, Result};
use crate::evaluate::gpu::DispatchWatch;
use crate::line::PointMass;
use crate::line::energy::hybrid_parts;
use crate::study::envelope::{self, EnvelopeSettings, car_limits};
use crate::study::hybrid::{self, HybridStudySettings};
use crate::study::identify::{self, IdentifySettings};
use crate::study::journal::{Journal, Recorder};
use crate::study::memory::Size;
use crate::study::raceline::{self, RacelineSettings};
use crate::study::transient::{self, DriveState, TransientSettings};
use crate::vehicle::{Car, Envelope};
use serde::{Deserialize, Serialize};
pub(in crate::study) use stage::go_on;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Settings of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunSettings {
    /// How the car is identified.
    pub identify: IdentifySettings,
    /// How the line is found; car and envelope are those of the run.
    pub raceline: RacelineSettings,
    /// Room that the line leaves on either side of the car for the driver's errors (m).
    pub margin_m: f64,
    /// Most lines that are driven, each within the limits that the one before it left.
    pub rounds: usize,
    /// Where stages are kept for runs of the same inputs; nothing to keep them in the run's own folder until it is done.
    pub cache: Option<PathBuf>,
}

impl Default for RunSettings {
    fn default() -> Self {
        Self {
            identify: IdentifySettings {
                // The bundled car with all that the story tells of: an engine map and a hybrid drive.
                car: "gt_hybrid".to_owned(),
                ..IdentifySettings::default()
            },
            raceline: RacelineSettings::default(),
            margin_m: 0.5,
            rounds: 2,
            cache: None,
        }
    }
}

impl RunSettings {
    /// Reads a study file: `identify` and `raceline` name study files of these, `margin_m` and `rounds` are its own.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be read, [`Error::Input`] naming file, line and field if it says something wrong.
    pub fn read(path: &Path) -> Result<Self> {
        let text = read_text(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let document = Document::parse(path, &text)?;
        let root = document.root();
        let mut s = Self::default();
        if let Some(name) = root.string("identify")? {
            s.identify = IdentifySettings::read(&folder.join(name))?;
        }
        if let Some(name) = root.string("raceline")? {
            s.raceline = RacelineSettings::read(&folder.join(name))?;
        }
        s.margin_m = root.number("margin_m", 0.0, 5.0, "m")?.unwrap_or(s.margin_m);
        s.rounds = root.integer("rounds", 1, 20)?.map_or(s.rounds, |n| n as usize);
        root.finish()?;
        Ok(s)
    }
}

impl RunSettings {
    /// How a line of `car` is found, within limits from a file where there are any: with room for the driver's errors.
    pub fn line_of(&self, car: &str, envelope: Option<PathBuf>) -> RacelineSettings {
        RacelineSettings {
            car: car.to_owned(),
            envelope,
            car_width_m: self.raceline.car_width_m + 2.0 * self.margin_m,
            ..self.raceline.clone()
        }
    }

    /// The settings as TOML, with those of the stages in tables: to be read by people, the stages of a study file are files.
    pub fn to_toml(&self) -> String {
        let within = |stage: &str, toml: &str| toml.replace("\n[", &format!("\n[{stage}."));
        let cache = self.cache.as_ref().map_or(String::new(), |cache| {
            let path = toml::Value::String(cache.display().to_string());
            format!("cache = {path}\n")
        });
        format!(
            "margin_m = {:?}\nrounds = {}\n{cache}\n[identify]\n{}\n[raceline]\n{}",
            self.margin_m,
            self.rounds,
            within("identify", &self.identify.to_toml()),
            within("raceline", &self.raceline.to_toml())
        )
    }
}

/// Change of the grip's share from one line to the next below which another line would be the same.
const SETTLED: f64 = 0.015;

/// What a run begins with: all that it reads, and could refuse.
pub struct Prepared<'a> {
    settings: &'a RunSettings,
    /// Log and car.
    pub setup: identify::Setup,
    /// Track and limits, those of the car that the identification begins with.
    pub road: raceline::Setup,
}

/// Reads what the run's stages are to read.
///
/// # Errors
/// [`Error::Io`] and [`Error::Input`] for what cannot be read or used.
pub fn prepare(settings: &RunSettings) -> Result<Prepared<'_>> {
    let setup = identify::set_up(&settings.identify)?;
    identify::check_swarms(&settings.identify, &setup)?;
    let road = raceline::set_up(&settings.line_of(&settings.identify.car, None))?;
    let car = Car::load(&settings.identify.car)?;
    if car.hybrid.is_some() {
        // What the last stage is to need shows before the first.
        hybrid_parts(&car)?;
    }
    Ok(Prepared {
        settings,
        setup,
        road,
    })
}

impl Prepared<'_> {
    /// What the identification's memory goes with.
    pub fn identify_size(&self) -> Size {
        Size {
            samples: self.setup.log.samples(),
            ..self.settings.identify.size()
        }
    }
}

/// What a run works with; nothing of it changes a result.
#[derive(Clone, Copy, Debug)]
pub struct Means<'a> {
    /// Where results of stages are kept, if anywhere.
    pub cache: Option<&'a Path>,
    /// Time between two saves of the state of the stage at work.
    pub every: Duration,
    /// Memory that each stage may take (MiB).
    pub memory_limit_mib: u64,
}

/// Runs everything into `folder`. `observe` is told what is being done, and may break the run off.
///
/// # Errors
/// Those of the stages; [`Error::Interrupted`] if the run was broken off.
pub fn run(
    prepared: &Prepared<'_>,
    folder: &Path,
    means: &Means<'_>,
    mut observe: impl FnMut(&str) -> ControlFlow<()>,
) -> Result<Summary> {
    let Prepared { settings, setup, .. } = prepared;
    let dispatches = DispatchWatch::begin();
    let began = Instant::now();
    let stages = Stages::new(folder, means.cache, means.every);
    let mut reused = Vec::new();
    let mut keep = |name: &str, stage: (PathBuf, bool)| {
        if stage.1 {
            reused.push(name.to_owned());
        }
        stage.0
    };
    let broken_off = || Error::Interrupted(folder.to_owned());

    let mut inputs = Inputs::of_program("identify");
    inputs.add(&settings.identify);
    inputs.add(&(&setup.log, &setup.replay.free.car, &setup.truth));
    let stage = stages.run("1_identify", &inputs, |to, keeper| {
        let _allowed = prepared.identify_size().check(means.memory_limit_mib)?;
        let outcome = go_on(keeper, |state, keeper| {
            identify::search_from(&settings.identify, setup, state, keeper, |report| {
                let done = report.progress.map_or(String::new(), |p| {
                    format!(" {} of {}, best {:.2e}", p.iteration, report.planned, p.best[0])
                });
                observe(&format!("the car: {:?}{done}", report.stage).to_lowercase())
            })
        });
        // The run's folder is what is gone on with, wherever the stage's state is.
        let outcome = match outcome {
            Err(Error::Interrupted(_)) => return Err(broken_off()),
            outcome => outcome?,
        };
        if outcome.interrupted {
            return Err(broken_off());
        }
        let summary = identify::summarise(&settings.identify, setup, &outcome);
        identify::write_results(to, &settings.identify, setup, &outcome, &summary)
    })?;
    let identified = keep("identify", stage);
    let car_path = identified.join("car.toml");
    let car = Car::load(&car_path.display().to_string())?;

    if observe("the car's limits").is_break() {
        return Err(broken_off());
    }
    let mut inputs = Inputs::of_program("envelope");
    inputs.add(&car);
    let stage = stages.run("2_envelope", &inputs, |to, _| {
        let began = Instant::now();
        let limits = car_limits(&car, &EnvelopeSettings::default())?;
        let summary = envelope::summarise(&car.name, &limits, None, began.elapsed().as_secs_f64());
        envelope::write_results(to, &limits, None, &summary)
    })?;
    let whole = Envelope::load(keep("envelope", stage).join("envelope.csv"))?;

    let mut rounds: Vec<RoundSummary> = Vec::new();
    let mut driven_within: Option<PathBuf> = None;
    let mut last_line: Option<PathBuf> = None;
    for round in 1..=settings.rounds {
        let number = 1 + 2 * round;
        let line_settings = settings.line_of(&car_path.display().to_string(), driven_within.clone());
        let line_setup = raceline::set_up(&line_settings)?;
        let mut inputs = Inputs::of_program("raceline");
        // The car is in its limits; where its file lies does not matter.
        inputs.add(&RacelineSettings {
            car: String::new(),
            envelope: None,
            ..line_settings.clone()
        });
        inputs.add(&(&line_setup.cuts, line_setup.car.envelope.rows()));
        let stage = stages.run(&format!("{number}_raceline"), &inputs, |to, keeper| {
            let _allowed = line_settings.size().check(means.memory_limit_mib)?;
            let outcome = go_on(keeper, |state, keeper| {
                raceline::find_lines_from(&line_settings, &line_setup, state, keeper, |p| {
                    observe(&format!(
                        "line {round}: {}, {} lines, best {}",
                        p.stage, p.evaluations, p.best
                    ))
                })
            })?;
            if outcome.interrupted {
                return Err(broken_off());
            }
            let summary = raceline::summarise(&line_settings, &line_setup, &outcome);
            raceline::write_results(to, &line_settings, &line_setup, &outcome, &summary)
        })?;
        let line_folder = keep("raceline", stage);
        let line_path = line_folder.join("line_fastest.csv");

        if observe(&format!("line {round}: driven by the car")).is_break() {
            return Err(broken_off());
        }
        let points = transient::read_line(&line_path)?;
        let limits = PointMass {
            envelope: whole.clone(),
            ..line_setup.car.clone()
        };
        let edges = [line_setup.edges_m[0].as_slice(), line_setup.edges_m[1].as_slice()];
        let drive_settings = TransientSettings {
            car_width_m: settings.raceline.car_width_m,
            ..TransientSettings::default()
        };
        let mut inputs = Inputs::of_program("transient");
        inputs.add(&(&car, &drive_settings, whole.rows(), &line_setup.edges_m));
        inputs.add_file(&line_path)?;
        let stage = stages.run(&format!("{}_transient", number + 1), &inputs, |to, keeper| {
            let began = Instant::now();
            let outcome = go_on(keeper, |state: Option<DriveState>, keeper| {
                let begun = (state.unwrap_or_default(), keeper);
                transient::drive_line_from(&car, &limits, &points, edges, &drive_settings, begun, |_, _| {
                    observe(&format!("line {round}: driven by the car"))
                })
            })?;
            let outcome = outcome.ok_or_else(broken_off)?;
            let summary = transient::summarise(&car.name, &outcome, began.elapsed().as_secs_f64());
            transient::write_results(to, &outcome, &summary)
        })?;
        let driven = keep("transient", stage);
        driven_within = Some(driven.join("envelope_driven.csv"));
        last_line = Some(line_path);
        let found = RoundSummary::read(&line_folder, &driven)?;
        let settled = rounds
            .last()
            .is_some_and(|before| (before.grip_share - found.grip_share).abs() <= SETTLED);
        rounds.push(found);
        if settled {
            break;
        }
    }
    let mut energy = None;
    if car.hybrid.is_some() {
        let energy_settings = HybridStudySettings {
            track: settings.raceline.track.clone(),
            car: car_path.display().to_string(),
            envelope: driven_within,
            line: last_line,
            car_width_m: settings.raceline.car_width_m,
            seed: settings.raceline.seed,
            backend: settings.raceline.backend,
            adapter: settings.raceline.adapter.clone(),
            ..HybridStudySettings::default()
        };
        let energy_inputs = hybrid::read_inputs(&energy_settings)?;
        let energy_size = energy_inputs.size(&energy_settings);
        // The line is given, and found at once.
        let Some(energy_setup) = energy_inputs.with_line(&energy_settings, &Arc::default())? else {
            return Err(broken_off());
        };
        let mut inputs = Inputs::of_program("hybrid");
        for path in energy_settings.line.iter().chain(&energy_settings.envelope) {
            inputs.add_file(path)?;
        }
        inputs.add(&(
            &car,
            &energy_settings.backend,
            &energy_settings.adapter,
            energy_settings.seed,
        ));
        inputs.add(&(&energy_settings.track, energy_settings.car_width_m));
        let number = 3 + 2 * rounds.len();
        let stage = stages.run(&format!("{number}_hybrid"), &inputs, |to, keeper| {
            let _allowed = energy_size.check(means.memory_limit_mib)?;
            let outcome = go_on(keeper, |journal, keeper| {
                let journal = match journal {
                    Some(journal) => journal,
                    None => Journal::new("hybrid", &energy_settings)?,
                };
                let mut recorder = Recorder::new(journal, keeper);
                hybrid::run_recorded(&energy_settings, &energy_setup, &mut recorder, |p| {
                    observe(&format!(
                        "energy: {}, {} laps, {}",
                        p.stage, p.evaluations, p.best
                    ))
                })
            })?;
            if outcome.interrupted {
                return Err(broken_off());
            }
            let summary = hybrid::summarise(&energy_settings, &energy_setup, &outcome);
            hybrid::write_results(to, &energy_settings, &energy_setup, &outcome, &summary)
        })?;
        energy = Some(EnergySummary::read(&keep("hybrid", stage))?);
    }
    let mut summary = Summary::put_together(
        settings,
        setup,
        &identified,
        &car,
        &whole,
        rounds,
        reused,
        began.elapsed().as_secs_f64(),
    )?;
    summary.energy = energy;
    summary.write(folder, dispatches.longest_ms())?;
    Ok(summary)
}
