//! The racing line: shortest, of minimum curvature, fastest, and the front between them, beside the reference optima.
//!
//! Every objective has a swarm of its own ([`search_line`]), all together have one that looks for their front
//! ([`LineFront`]), and solvers of reference optima ([`crate::optimum::ReferenceSolvers`]) say how far from the optimum each is. Whatever
//! is reported is worked out anew on a fine spline and checked against the edges ([`Setup::report`]).

mod front;
mod objective_search;
mod results;
mod settings;
mod setup;
mod setups;
mod solve;
mod state;
mod whole_line_search;
mod window_search;

pub use front::{LineFront, front_problem, starting_lines};
pub use results::{LineFigures, ParameterWorth, SectorFigures, SetupFigures, SetupsSummary, Summary};
pub use settings::{LineAlgorithm, RacelineSettings};
pub(in crate::study) use setup::best_gears;
pub use setup::{ReportedLine, Setup, road_read, set_up};
pub use setups::{SetupLap, SetupsOutcome, SolvedSetup};
pub use state::LinesState;
pub use window_search::{FoundLine, LevelRow, LineSearch, LineSearchSettings, LineState, search_line};

use crate::config::settings::Settings;
use crate::error::{Error, Result};
use crate::evaluate::line::LineObjective;
use crate::report::with_unit;
use crate::study::framework::memory::MemoryItem;
use crate::study::framework::{Figures, Plan, RunRecord, Searched, Solved, Study, Subject, Work};
use crate::swarm::{Reached, SwarmPlace};
use std::path::Path;

/// The study.
pub struct Raceline;

/// What one objective came to.
#[derive(Clone, Debug)]
pub struct ObjectiveOutcome {
    /// The objective.
    pub objective: LineObjective,
    /// The best of the swarm's line, what the local search made of it and, with a warm start, the reference optimum that
    /// the swarm started from.
    pub best: ReportedLine,
    /// What the swarm alone reached through the cross-sections, in the objective's unit.
    pub swarm_cost: f64,
    /// The reference optimum, where there is a solver for it.
    pub exact: Option<ReportedLine>,
    /// How its solver ended, in plain words.
    pub exact_status: Option<String>,
    /// What it says may be left to gain, as a share of the objective.
    pub exact_left: Option<f64>,
    /// Best cost on the way of its swarm.
    pub history: Vec<Reached>,
}

/// The outcome of a study.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// One for each objective.
    pub objectives: Vec<ObjectiveOutcome>,
    /// The front between them, where there are several.
    pub front: Option<LineFront>,
    /// The compromise nearest to the ideal, each objective as a share of its range.
    pub compromise: Option<ReportedLine>,
    /// Set-ups of the car with their own fastest lines, where they are asked for.
    pub setups: Option<SetupsOutcome>,
    /// The reference line.
    pub reference: ReportedLine,
    /// Time of the swarms and the local search (s).
    pub search_s: f64,
    /// Time of the longest of the solvers of reference optima (s), which work beside each other and beside the swarms.
    pub exact_s: f64,
    /// How it ran; its lines are those of the swarms, and its time that of the swarms and of their waiting for the solvers.
    pub record: RunRecord,
}

impl Study for Raceline {
    const NAME: &'static str = "raceline";
    const ABOUT: &'static str =
        "Find the line round a circuit: shortest, of minimum curvature, fastest, and the front between them.";
    const DETAILS: &'static str = "Examples:\n  lapswarm raceline\n  lapswarm raceline --track my_circuit.csv --car \
        runs/identify-001/car.toml\n  lapswarm raceline --section Abbey --objectives lap_time\n\nLines are looked for through \
        the cross-sections. Where the car leaves the road between them, by a centimetre or more, the line is moved in. Where \
        that does not help, it gives way towards the reference line, and a warning says so. Where nothing helps, there is no \
        best line: the study says where, and ends with exit code 1.";
    type Settings = RacelineSettings;
    type State = LinesState;
    type Prepared = Setup;
    type Outcome = Outcome;
    type Summary = Summary;

    fn prepare(settings: &RacelineSettings) -> Result<Setup> {
        let setup = set_up(settings)?;
        let sections = setup.cross_sections.len();
        if let Some(beyond) = settings
            .surface_sections
            .iter()
            .find(|i| **i as usize >= sections)
        {
            let expected = format!("a cross-section from 0 to {}", sections - 1);
            return Err(Error::input(
                "the study",
                "surface_sections",
                beyond.to_string(),
                expected,
            ));
        }
        if settings.objectives.len() > 1 || settings.swarm == SwarmPlace::Device {
            settings.on_device(&front::front_problem(&setup, settings)?.problem)?;
        }
        Ok(setup)
    }

    fn size(settings: &RacelineSettings, setup: Option<&Setup>) -> Vec<MemoryItem> {
        settings.size(setup.map(|setup| setup.road.len())).memory_items()
    }

    fn plan(settings: &RacelineSettings, setup: &Setup, plan: Plan) -> Result<Plan> {
        road_read(plan, setup)
            .seed(settings.seed)
            .backend(settings.backend, settings.adapter.as_deref())
    }

    fn solve(work: Work<'_, Self>) -> Result<Option<Outcome>> {
        solve::find_lines(work).map(Some)
    }

    fn record(outcome: &Outcome) -> &RunRecord {
        &outcome.record
    }

    fn record_mut(outcome: &mut Outcome) -> &mut RunRecord {
        &mut outcome.record
    }

    fn summarise(solved: &Solved<'_, Self>) -> Summary {
        results::summarise(solved)
    }

    fn subject(settings: &RacelineSettings, setup: &Setup) -> Subject {
        Subject::on_track(settings.seed, &setup.car_name, &setup.track_name)
    }

    fn report(folder: &Path, solved: &Solved<'_, Self>, summary: &Summary) -> Result<()> {
        results::write_files(folder, solved.prepared, solved.outcome)?;
        results::write_page(folder, solved, summary)
    }

    fn text(_: &RacelineSettings, summary: &Summary) -> String {
        summary.to_text()
    }

    fn check(path: &Path) -> Result<String> {
        let settings = RacelineSettings::read(path)?;
        let setup = Self::prepare(&settings)?;
        Ok(format!("{}, {} sections", settings.track, setup.road.len()))
    }

    /// What was reached of each objective, and the quality of the front.
    fn figures(outcome: &Outcome, summary: &Summary) -> Figures {
        let evaluations = outcome.record.evaluations as f64;
        let mut figures = Figures::from([("evaluations".to_owned(), Some(evaluations))]);
        for o in &outcome.objectives {
            let name = o.objective.name();
            let unit = o.objective.unit().replace('/', "p").replace('^', "");
            let exact = o.exact.as_ref().map(|line| line.worth(o.objective));
            figures.insert(format!("swarm_{name}_{unit}"), Some(o.swarm_cost));
            figures.insert(format!("best_{name}_{unit}"), Some(o.best.worth(o.objective)));
            figures.insert(format!("exact_{name}_{unit}"), exact);
        }
        if let Some(front) = &outcome.front {
            figures.insert("hypervolume".to_owned(), Some(front.hypervolume));
            figures.insert("front_size".to_owned(), Some(front.alpha.len() as f64));
        }
        if let Some([within_m, links_m]) = results::sectors::lengths_m(&summary.sectors) {
            figures.insert("within_sectors_m".to_owned(), Some(within_m));
            figures.insert("between_sectors_m".to_owned(), Some(links_m));
        }
        figures
    }

    fn searched(solved: &Solved<'_, Self>) -> Searched {
        let outcome = solved.outcome;
        let objectives = outcome.objectives.iter();
        let objectives = objectives.map(|o| with_unit(o.objective.words(), o.objective.unit()));
        let (reached, front) = match (&outcome.front, &outcome.objectives[..]) {
            (Some(front), _) => (front.reached.clone(), front.objectives.clone()),
            (None, [only]) => (only.history.clone(), Vec::new()),
            (None, _) => Default::default(),
        };
        Searched {
            objectives: objectives.collect(),
            reached,
            front,
        }
    }
}
