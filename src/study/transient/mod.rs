//! Racing lines driven by the 4DOF car and a driver, a closed-loop lap simulation: what of the g-g-v envelope can be held, and
//! what lap comes of it.
//!
//! The driver is given the speeds of a quasi-steady-state lap within a share of the envelope's grip. One line alone is driven with
//! the greatest share at which the car gets round within the edges and half a percent behind that lap at most; the envelope with
//! this share is fed back, and both laps are set side by side. Several lines, or set-ups of the car, are driven all at once.

mod corners;
mod drive;
mod energy;
mod population;
mod population_results;
mod results;
mod settings;
mod state;

pub use corners::CornerGrip;
pub use drive::{AGREEMENT, DrivenLine, HEADING_GAINS, INTERVAL_S, keeps_up};
pub use energy::{Accounts, EnergyFigures, Ideal, Motor};
pub use population::{Driven, DrivenBest, PopulationOutcome, drive_problem};
pub use population_results::{Entry, PopulationSummary};
pub use results::LineSummary;
pub use settings::TransientSettings;
pub use state::{DriveState, TransientState};

use crate::config::settings::Settings;
use crate::drive::SpeedPlan;
use crate::error::{Error, Result};
use crate::evaluate::BackendInfo;
use crate::files::names_of;
use crate::line::{FineLine, PointMass, read_line};
use crate::study::framework::memory::MemoryItem;
use crate::study::framework::{Plan, RunRecord, Solved, Study, Subject, Work};
use crate::study::raceline;
use crate::track::{Circuit, Surface};
use crate::vehicle::{Car, Envelope, Traction};
use glam::DVec2;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The study.
pub struct Transient;

/// A line to drive.
#[derive(Clone, Debug)]
pub struct NamedLine {
    /// What reports call it.
    pub name: String,
    /// Its points (m).
    pub points_m: Vec<DVec2>,
    /// Whether the DRS may be open from each point to the next; nowhere if empty.
    pub drs: Vec<bool>,
    /// The surface at each point, on a road that is not level and dry.
    pub relief: Option<Vec<Surface>>,
    /// The line as a circuit of its own, its widths the room that the car's side has to the edges. Its DRS zones are where the
    /// quasi-steady-state lap has the flap open.
    pub circuit: Circuit,
}

impl NamedLine {
    /// A line between edges (m, right and left) for a car of a width (m).
    ///
    /// # Errors
    /// [`Error::Input`] for a line that is no lap, or leaves no room for the car.
    pub fn new(name: String, points_m: Vec<DVec2>, road: &raceline::Setup, car_width_m: f64) -> Result<Self> {
        let drs = road.cross_sections.drs_along(&points_m);
        let car = (!drs.is_empty()).then_some((&road.car, drs.as_slice()));
        let relief = road.cross_sections.relief_along(&points_m);
        let fine = FineLine::on(&points_m, relief.as_deref(), true, 1.0, car, 0.0)?;
        let circuit = fine.circuit(&name, &road.edges_m, car_width_m)?;
        Ok(Self {
            name,
            points_m,
            drs,
            relief,
            circuit,
        })
    }
}

/// All that the study reads.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The car that drives.
    pub car: Car,
    /// Track and limits; the limits are those of its point mass.
    pub road: raceline::Setup,
    /// The lines.
    pub lines: Vec<NamedLine>,
    /// Where a hybrid's motor works.
    pub motor: Option<Motor>,
}

/// What the study finds.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// Of one line alone.
    Line(Box<DrivenLine>),
    /// Of a population.
    Population(Box<PopulationOutcome>),
}

/// The figures; `--json` prints the inner ones.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Summary {
    /// Of one line alone.
    Line(Box<LineSummary>),
    /// Of a population.
    Population(Box<PopulationSummary>),
}

impl Study for Transient {
    const NAME: &'static str = "transient";
    const ABOUT: &'static str =
        "Drive a line with the 4DOF car and a driver, and set its lap beside the quasi-steady-state lap.";
    const DETAILS: &'static str = "A driver needs room: half a metre on either side of the car, which a line found for a car one \
        metre wider leaves. The circuit is that of the run in whose folder the line lies, unless --track names one.\n\n\
        Example:\n  lapswarm raceline --car-width-m 3 --out fast\n  \
        lapswarm transient --line fast/line_fastest.csv\n\nSeveral lines, or set-ups, are driven all at once, each with several \
        shares of the grip; the fastest within the edges are listed:\n  lapswarm transient --line fast/line_fastest.csv \
        --line fast/line_shortest.csv --setups 63 --parameters aero_balance_front,front_roll_moment_share\n\nA hybrid's lap, with \
        accounts of its energy:\n  lapswarm hybrid --car-width-m 3 --out hy\n  lapswarm transient --car gt_hybrid --line hy/line.csv \
        --deployment hy/lap_swarm.csv";
    type Settings = TransientSettings;
    type State = TransientState;
    type Prepared = Prepared;
    type Outcome = Outcome;
    type Summary = Summary;

    fn prepare(settings: &TransientSettings) -> Result<Prepared> {
        settings.validate()?;
        settings.complete()?;
        read(settings)
    }

    fn size(settings: &TransientSettings, _: Option<&Prepared>) -> Vec<MemoryItem> {
        settings.memory_items()
    }

    fn plan(settings: &TransientSettings, prepared: &Prepared, plan: Plan) -> Result<Plan> {
        let plan = raceline::road_read(plan, &prepared.road);
        let read = |plan: Plan, line: &NamedLine| {
            plan.reads(format!("line {}, {:.1} m", line.name, line.circuit.length_m))
        };
        let plan = prepared.lines.iter().fold(plan, read);
        let plan = plan.evaluations(settings.laps() as u64);
        if settings.is_population() {
            plan.seed(settings.seed)
                .backend(settings.backend, settings.adapter.as_deref())
        } else {
            Ok(plan.evaluated_by(BackendInfo::reference()))
        }
    }

    fn solve(work: Work<'_, Self>) -> Result<Option<Outcome>> {
        if work.settings.is_population() {
            let found = population::drive(work)?;
            Ok(found.map(|population| Outcome::Population(Box::new(population))))
        } else {
            let found = drive::drive(work)?;
            Ok(found.map(|line| Outcome::Line(Box::new(line))))
        }
    }

    fn record(outcome: &Outcome) -> &RunRecord {
        match outcome {
            Outcome::Line(line) => &line.record,
            Outcome::Population(population) => &population.record,
        }
    }

    fn record_mut(outcome: &mut Outcome) -> &mut RunRecord {
        match outcome {
            Outcome::Line(line) => &mut line.record,
            Outcome::Population(population) => &mut population.record,
        }
    }

    fn summarise(solved: &Solved<'_, Self>) -> Summary {
        let mut head = solved.head();
        // Figures name the lines; the track gives no more than their edges.
        head.subject.track = None;
        match solved.outcome {
            Outcome::Line(line) => {
                let mode = solved.settings.deployment_mode;
                let energy = results::energy_of(&solved.prepared.car, mode, line);
                Summary::Line(Box::new(LineSummary::of(head, line, energy)))
            }
            Outcome::Population(population) => {
                let summary = population_results::summarise(head, solved, population);
                Summary::Population(Box::new(summary))
            }
        }
    }

    fn subject(settings: &TransientSettings, prepared: &Prepared) -> Subject {
        Subject::on_track(settings.seed, &prepared.car.name, &prepared.road.track_name)
    }

    fn report(folder: &Path, solved: &Solved<'_, Self>, summary: &Summary) -> Result<()> {
        match (solved.outcome, summary) {
            (Outcome::Line(line), Summary::Line(summary)) => {
                let prepared = solved.prepared;
                results::report(folder, (&prepared.car, &prepared.road.car), line, summary)
            }
            (Outcome::Population(population), Summary::Population(summary)) => {
                population_results::report(folder, solved.prepared, population, summary)
            }
            _ => Err(Error::Study("figures of another kind of drive".to_owned())),
        }
    }

    fn text(_: &TransientSettings, summary: &Summary) -> String {
        match summary {
            Summary::Line(summary) => summary.to_text(),
            Summary::Population(summary) => summary.table() + &summary.to_text(),
        }
    }

    fn verdict(_: &TransientSettings, summary: &Summary) -> Result<()> {
        match summary {
            Summary::Line(summary) if !summary.agrees => Err(Error::Study(format!(
                "the driven lap is {:+.2}% behind the quasi-steady-state lap, more than half a percent",
                summary.disagreement_percent
            ))),
            Summary::Population(summary) if summary.best.is_none() => Err(Error::Study(
                "no set-up stays within the edges of any line with any share of the grip that was tried; a line with more room to \
                 the edges (found for a wider car) is easier to drive, and so are smaller shares"
                    .to_owned(),
            )),
            _ => Ok(()),
        }
    }

    /// Lines may be given by flags.
    fn check(path: &Path) -> Result<String> {
        let settings = TransientSettings::read(path)?;
        if settings.line.is_empty() && settings.track.is_none() {
            settings.free(&Car::load(&settings.car)?)?;
            let setups = settings.setups.unwrap_or(0);
            return Ok(format!("no line and no track yet, {setups} set-ups"));
        }
        let prepared = read(&settings)?;
        Ok(format!(
            "{} lines, {} set-ups, {}",
            prepared.lines.len(),
            settings.setups.unwrap_or(0),
            prepared.road.track_name
        ))
    }
}

/// Reads car, lines and track. What is least work comes first, so that a mistake shows at once.
fn read(settings: &TransientSettings) -> Result<Prepared> {
    let car = settings.read_car()?;
    settings.free(&car)?;
    let files = &settings.line;
    let points = files
        .iter()
        .map(|file| read_line(file))
        .collect::<Result<Vec<_>>>()?;
    let of_road = settings.raceline()?;
    let road = raceline::set_up(&of_road)?;
    let named = names_of(files).into_iter().zip(points);
    let lines = named
        .map(|(name, points)| NamedLine::new(name, points, &road, of_road.car_width_m))
        .collect::<Result<Vec<_>>>()?;
    let motor = Motor::read(settings, &car, &road.car, &lines)?;
    Ok(Prepared {
        car,
        road,
        lines,
        motor,
    })
}

/// The quasi-steady-state lap within a share of the envelope's grip on a line of points (m): the envelope, the lap, and its speeds
/// as a plan.
fn planned(
    limits: &PointMass,
    traction: &Traction,
    line: &NamedLine,
    share: f64,
) -> Result<(Envelope, FineLine, SpeedPlan)> {
    let envelope = limits.envelope.with_grip_share(share, traction)?;
    let point_mass = PointMass {
        envelope: envelope.clone(),
        ..limits.clone()
    };
    let driven = Some((&point_mass, line.drs.as_slice()));
    let fine = FineLine::on(&line.points_m, line.relief.as_deref(), true, 1.0, driven, 0.0)?;
    let Some(lap) = &fine.lap else {
        return Err(Error::Study(
            "there is no quasi-steady-state lap on this line".to_owned(),
        ));
    };
    let plan = SpeedPlan::of_speeds(&lap.station_m, &lap.v_mps, fine.length_m);
    Ok((envelope, fine, plan))
}
