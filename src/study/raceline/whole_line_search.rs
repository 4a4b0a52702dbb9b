//! Swarms over `alpha` at every cross-section, to set beside the study's own search in windows.

use super::settings::{LineAlgorithm, RacelineSettings};
use super::setup::Setup;
use super::state::{LinesState, Running};
use super::window_search::{FoundLine, LevelRow};
use crate::error::{Error, Result};
use crate::evaluate::line::{CpuLineEvaluator, LineObjective, LineProblem, open_line_evaluator};
use crate::evaluate::{BackendInfo, DeviceFaults, Evaluator, Losses};
use crate::line::Parametrisation;
use crate::study::framework::Progress;
use crate::swarm::{
    CooperativeSettings, CooperativeSwarm, FrontSearch, FrontSwarm, MopsoSettings, Optimiser, Pso,
    PsoSettings, SwarmAtWork, SwarmPlace, SwarmState, step,
};
use crate::track::CrossSections;
use serde::{Deserialize, Serialize};

/// A swarm of whole lines.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum WholeLineSwarm {
    Cooperative(Box<CooperativeSwarm>),
    Thesis(Box<Pso>),
    /// The same on a device.
    Resident(Box<FrontSwarm>),
}

/// What evaluates a swarm.
enum AtWork<'a> {
    Host(Box<dyn Evaluator + 'a>, DeviceFaults),
    Device(SwarmAtWork<'a>),
}

/// Where such a search is: all that it takes to resume it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct WholeLineState {
    swarm: WholeLineSwarm,
    /// `alpha` of the sectors that are done with.
    before: Vec<f64>,
    /// Lines that were evaluated in them.
    spent: u64,
    history: Vec<LevelRow>,
    losses: Losses,
}

impl WholeLineState {
    fn new(settings: &RacelineSettings, problem: &LineProblem) -> Result<Self> {
        let (motion, problem) = (settings.line_swarm(), &problem.problem);
        let swarm = if settings.algorithm == LineAlgorithm::Cooperative {
            // The groups take turns, and each has the iterations that are asked for.
            let groups = settings.groups.min(problem.variables.len());
            let motion = PsoSettings {
                iterations: settings.iterations.saturating_mul(groups),
                ..motion
            };
            let settings = CooperativeSettings { motion, groups };
            WholeLineSwarm::Cooperative(Box::new(CooperativeSwarm::new(problem, settings)?))
        } else if settings.on_device(problem)? {
            let pulls = MopsoSettings::of_one_objective(motion);
            let swarm = FrontSearch::ONE_SWARM.begin(problem, pulls, SwarmPlace::Device)?;
            WholeLineSwarm::Resident(Box::new(swarm))
        } else {
            WholeLineSwarm::Thesis(Box::new(Pso::new(problem, motion)?))
        };
        Ok(Self {
            swarm,
            before: Vec::new(),
            spent: 0,
            history: Vec::new(),
            losses: Losses::default(),
        })
    }
}

impl WholeLineSwarm {
    fn swarm(&mut self) -> &mut dyn Optimiser {
        match self {
            Self::Cooperative(swarm) => swarm.as_mut(),
            Self::Thesis(swarm) => swarm.as_mut(),
            Self::Resident(swarm) => swarm.as_mut(),
        }
    }
}

/// The cross-sections of the sector after those whose line is found, with `alpha` `before`. It begins with the last cross-section
/// before, where the line is held.
fn next_sector(settings: &RacelineSettings, setup: &Setup, before: &[f64]) -> Result<CrossSections> {
    let all = &setup.cross_sections;
    if settings.sectors == 1 {
        return Ok(all.clone());
    }
    let sectors = (0..settings.sectors).map(|number| all.sector(number, settings.sectors));
    let first = before.len();
    let end = sectors.map(|sector| sector.end).find(|end| *end > first);
    let end = end.unwrap_or(all.len());
    let Some(last) = before.last() else {
        return all.stretch(0, end);
    };
    let held = all.right_m[first - 1].lerp(all.left_m[first - 1], *last);
    let mut sector = all.stretch(first - 1, end - first + 1)?;
    (sector.right_m[0], sector.left_m[0]) = (held, held);
    Ok(sector)
}

/// The line that the settings' algorithm finds from a start at random.
pub(super) fn search_whole_lines(
    settings: &RacelineSettings,
    setup: &Setup,
    objective: LineObjective,
    work: &mut Running<'_>,
) -> Result<FoundLine> {
    let way = Parametrisation::sections();
    let problem_after = |before: &[f64]| -> Result<LineProblem> {
        let sector = next_sector(settings, setup, before)?;
        setup.problem_on(sector, way.clone(), &[objective], settings)
    };
    let (mut state, mut problem) = match work.state.whole_lines.take() {
        Some(state) => {
            let problem = problem_after(&state.before)?;
            (*state, problem)
        }
        None => {
            let problem = problem_after(&[])?;
            (WholeLineState::new(settings, &problem)?, problem)
        }
    };
    loop {
        let (interrupted, backend) = state.search(&problem, settings, setup, objective, work)?;
        let swarm = state.swarm.swarm();
        let front = swarm.front();
        let Some(best) = front.candidates.first() else {
            return Err(Error::Study(
                "none of the lines that were tried could be evaluated".to_owned(),
            ));
        };
        // A sector begins with the last cross-section of the one before.
        let held = usize::from(!state.before.is_empty());
        state.spent += swarm.evaluations();
        state.before.extend_from_slice(&problem.alpha(best)[held..]);
        let missing = setup.cross_sections.len() - state.before.len();
        if interrupted || missing == 0 {
            // An interrupted search reports a line all the same.
            state.before.extend(std::iter::repeat_n(0.5, missing));
            let whole = setup.problem(way.clone(), &[objective], settings)?;
            let judged = CpuLineEvaluator::new(&whole).evaluate(&state.before)?;
            return Ok(FoundLine {
                alpha: state.before,
                cost: judged.objectives[0],
                evaluations: state.spent,
                history: state.history,
                losses: state.losses,
                backend: Some(backend),
            });
        }
        problem = problem_after(&state.before)?;
        state.swarm = WholeLineState::new(settings, &problem)?.swarm;
    }
}

impl WholeLineState {
    /// Searches one sector to its end, or until it is interrupted; says which, and what evaluated.
    fn search(
        &mut self,
        problem: &LineProblem,
        settings: &RacelineSettings,
        setup: &Setup,
        objective: LineObjective,
        work: &mut Running<'_>,
    ) -> Result<(bool, BackendInfo)> {
        let place = (settings.backend, settings.adapter.as_deref());
        let known = work.state.device_faults();
        let mut at_work = match &self.swarm {
            WholeLineSwarm::Resident(swarm) => {
                let begun = SwarmState {
                    swarm: (**swarm).clone(),
                    losses: self.losses.clone(),
                };
                AtWork::Device(SwarmAtWork::open(problem, begun, true, place, &known)?)
            }
            _ => {
                let evaluator = open_line_evaluator(problem, place.0, place.1)?;
                let faults = DeviceFaults::beyond(&known, evaluator.as_ref());
                AtWork::Host(evaluator, faults)
            }
        };
        let mut interrupted = false;
        while !interrupted {
            let progress = match &mut at_work {
                AtWork::Device(swarm) if swarm.done() => break,
                AtWork::Device(swarm) => swarm.step()?,
                AtWork::Host(..) if self.swarm.swarm().done() => break,
                AtWork::Host(evaluator, faults) => {
                    let progress = step(self.swarm.swarm(), evaluator.as_mut())?;
                    self.losses.note(&progress.failures, faults, evaluator.as_ref());
                    progress
                }
            };
            let evaluations = self.spent + progress.evaluations;
            // What sectors cost by themselves makes no curve.
            if settings.sectors == 1 {
                self.history.push(LevelRow {
                    controls: problem.dimensions(),
                    sections: setup.cross_sections.len(),
                    evaluations,
                    best: progress.best[0],
                    elapsed_s: work.elapsed_s(),
                });
            }
            let best = format!("best {:.4} {}", progress.best[0], objective.unit());
            let told = Progress::reached(objective.line_name(), evaluations, best);
            let kept = &*self;
            let update = |state: &mut LinesState| {
                let mut kept = kept.clone();
                if let AtWork::Device(swarm) = &mut at_work {
                    kept.take_back(swarm.state());
                }
                state.whole_lines = Some(Box::new(kept));
            };
            interrupted = work.told(&told, update)?.is_break();
        }
        let backend = match at_work {
            AtWork::Device(swarm) => {
                let backend = swarm.backend();
                self.take_back(&swarm.finish()?);
                backend
            }
            AtWork::Host(evaluator, _) => evaluator.backend(),
        };
        Ok((interrupted, backend))
    }

    /// Takes a swarm as it was on its device, with what is noted of its iterations.
    fn take_back(&mut self, now: &SwarmState) {
        self.history.truncate(now.swarm.iteration());
        self.losses = now.losses.clone();
        self.swarm = WholeLineSwarm::Resident(Box::new(now.swarm.clone()));
    }
}
