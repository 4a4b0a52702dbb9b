//! Where the motor works: by the reference optimum, by a swarm, and along the fronts between objectives.

use super::scenario::{ReportedLap, drive};
use super::settings::{
    ADDITIONAL_GATES, FreePart, HybridAlgorithm, HybridStudySettings, OFFSET_GATES, OFFSET_ZONES,
};
use super::setup::{HybridSetup, control_points};
use super::spending::{Sharing, Spending};
use crate::error::Result;
use crate::evaluate::energy::{
    Free, HybridLine, HybridObjective, HybridProblem, Strategy, open_hybrid_evaluator,
};
use crate::line::energy::{EnergyPlan, Gates, Mode, late_bend, zone_starts};
use crate::line::{Parametrisation, geometry};
use crate::optimum::{Deployment, DeploymentSearch};
use crate::random::Random;
use crate::scalar::try_bisected;
use crate::study::framework::journal::Recorder;
use crate::swarm::{
    FrontSearch, HybridSettings, HybridSwarm, MopsoSettings, Optimiser, Progress, Pso, Reached, SwarmPlace,
    run,
};
use std::ops::ControlFlow;
use std::time::Instant;

/// What the swarm found for one budget.
#[derive(Clone, Debug)]
pub struct FoundStrategy {
    /// The share of each zone in which the motor works, or the gates, in the order of their names.
    pub shares: Vec<f64>,
    /// Names of the variables.
    pub names: Vec<String>,
    /// The lap, in `f64`.
    pub lap: ReportedLap,
    /// Laps evaluated.
    pub evaluations: u64,
    /// What the swarm had come to on its way.
    pub reached: Vec<Reached>,
}

impl HybridSetup {
    /// The exact deployment of an energy (J) on the study's line, started from known shares of segments.
    ///
    /// # Errors
    /// Those of [`DeploymentSearch::best`].
    pub fn exact(&self, energy_j: f64, start: Option<&[f64]>) -> Result<Deployment> {
        let search = DeploymentSearch {
            car: &self.car,
            points_m: &self.points_m,
            closed: self.closed,
            drs: &self.drs,
            surface: &self.surface,
            run_in: self.run_in,
            entry_mps: self.entry_mps,
        };
        search.best(energy_j, start)
    }

    /// The lap of an exact deployment with everything that is told of it.
    ///
    /// # Errors
    /// Those of [`HybridProblem::new`].
    pub fn exact_lap(&self, name: &str, shares: &[f64], energy_j: f64) -> Result<ReportedLap> {
        let problem = self.by_segment(Strategy {
            shares: shares.to_vec(),
            ..Strategy::fixed(Gates::of_zones(energy_j / 1e6), self.points_m.len())
        })?;
        Ok(ReportedLap::of(name, &problem, &[]))
    }

    /// The problem of sharing an energy (MJ) out over the stretches that the motor is of use on. Variables of other parts of the
    /// strategy that are free come before those of the zones.
    ///
    /// # Errors
    /// Those of [`HybridProblem::new`].
    pub fn zone_problem(
        &self,
        free: &[Free],
        energy_mj: f64,
        objectives: &[HybridObjective],
    ) -> Result<HybridProblem> {
        self.zones_of(Mode::Additional, free, energy_mj, objectives)
    }

    fn zones_of(
        &self,
        mode: Mode,
        free: &[Free],
        energy_mj: f64,
        objectives: &[HybridObjective],
    ) -> Result<HybridProblem> {
        let open = drive(self, "open", mode, Gates::of_zones(1e6))?;
        let given: Vec<f64> = open.segments.iter().map(|s| s.deployed).collect();
        let starts = zone_starts(&given, &open.length_m);
        let mut length = open.length_m;
        length.resize(self.points_m.len(), 0.0);
        let plan = EnergyPlan::zoned(&length, &starts, self.closed, self.run_in, mode);
        let zones = plan.count();
        let strategy = Strategy {
            free: free.iter().copied().chain((0..zones).map(Free::Zone)).collect(),
            ..Strategy::fixed(Gates::of_zones(energy_mj), zones)
        };
        self.problem(plan, strategy, objectives)
    }
}

impl HybridSetup {
    /// The searches that the settings ask for beside the one of zones beside the engine, by the names of their laps: of zones in the
    /// engine's place, and of gates both ways. In the engine's place the lap takes the same time, and the least fuel is sought.
    pub(super) fn further_searches(
        &self,
        settings: &HybridStudySettings,
        energy_mj: f64,
    ) -> Result<Vec<(&'static str, HybridProblem, Option<Spending>)>> {
        let mut problems = Vec::new();
        if settings.offset {
            let problem = self.zones_of(Mode::Offset, &[], energy_mj, &[HybridObjective::Fuel])?;
            let spending = Spending::of(self, &problem, energy_mj, None)?;
            problems.push((OFFSET_ZONES, problem, Some(spending)));
        }
        if settings.gates.is_empty() {
            return Ok(problems);
        }
        for (name, mode, objective) in [
            (ADDITIONAL_GATES, Mode::Additional, HybridObjective::LapTime),
            (OFFSET_GATES, Mode::Offset, HybridObjective::Fuel),
        ] {
            let gates = Gates {
                energy_mj,
                ..Gates::OPEN
            };
            let strategy = Strategy {
                free: settings.gates.iter().map(|gate| gate.free()).collect(),
                ..Strategy::fixed(gates, 1)
            };
            let plan = EnergyPlan::whole(self.points_m.len(), self.run_in, mode);
            problems.push((name, self.problem(plan, strategy, &[objective])?, None));
        }
        Ok(problems)
    }
}

/// The swarm's strategy for an energy (MJ).
///
/// # Errors
/// Those of the problem and the evaluator.
pub fn search_strategy(
    setup: &HybridSetup,
    settings: &HybridStudySettings,
    energy_mj: f64,
    recorder: &mut Recorder<'_>,
    observe: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<FoundStrategy> {
    let problem = setup.zone_problem(&[], energy_mj, &[HybridObjective::LapTime])?;
    let spending = Spending::of(setup, &problem, energy_mj, None)?;
    search(("swarm", &problem), Some(spending), settings, recorder, observe)
}

/// The swarm's strategy for a problem with one objective, and the name of its lap; by weights of zones, if it is known what these spend.
///
/// # Errors
/// Those of the evaluator.
pub(super) fn search(
    (name, problem): (&str, &HybridProblem),
    spending: Option<Spending>,
    settings: &HybridStudySettings,
    recorder: &mut Recorder<'_>,
    mut observe: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<FoundStrategy> {
    let place = (settings.backend, settings.adapter.as_deref());
    let published = settings.algorithm == HybridAlgorithm::Thesis;
    let pulls = MopsoSettings::of_one_objective(settings.strategy_swarm());
    let alone = FrontSearch::ONE_SWARM;
    if published && alone.on_device(settings.swarm, &problem.problem, &pulls, place)? {
        let swarm = alone.begin(&problem.problem, pulls, SwarmPlace::Device)?;
        let swarm = recorder.run_on_device(problem, swarm, place, observe)?;
        let reached = swarm.reached().to_vec();
        return Ok(FoundStrategy::of((name, problem), &swarm, reached));
    }
    let mut swarm: Box<dyn Optimiser> = if published {
        Box::new(Pso::new(&problem.problem, settings.strategy_swarm())?)
    } else {
        let best = HybridSettings {
            population: settings.population,
            iterations: settings.iterations,
            seed: settings.seed,
            ..HybridSettings::default()
        };
        let swarm = HybridSwarm::new(&problem.problem, best)?;
        match spending {
            Some(spending) => Box::new(Sharing { swarm, spending }),
            None => Box::new(swarm),
        }
    };
    let mut evaluator = open_hybrid_evaluator(problem, place.0, place.1)?;
    let (began, mut reached) = (Instant::now(), Vec::new());
    run(&mut swarm, &mut recorder.over(evaluator.as_mut()), |progress| {
        let best = progress.best.first().copied().unwrap_or(f64::NAN);
        let elapsed_s = began.elapsed().as_secs_f64();
        reached.push(Reached::best(progress.evaluations, elapsed_s, best));
        observe(progress)
    })?;
    Ok(FoundStrategy::of((name, problem), &swarm, reached))
}

impl FoundStrategy {
    /// What a swarm has come to.
    fn of((name, problem): (&str, &HybridProblem), swarm: &impl Optimiser, reached: Vec<Reached>) -> Self {
        // A lap that cannot be driven is no answer: the shares are then none.
        let best = swarm.front().candidates.into_iter().next();
        let shares = best.unwrap_or_else(|| vec![0.0; problem.dimensions()]);
        Self {
            lap: ReportedLap::of(name, problem, &shares),
            names: problem.problem.variables.iter().map(|v| v.name.clone()).collect(),
            shares,
            evaluations: swarm.evaluations(),
            reached,
        }
    }
}

/// Laps none of which another betters in every objective.
#[derive(Clone, Debug, Default)]
pub struct StrategyFront {
    /// Variables, in their order.
    pub names: Vec<String>,
    /// Candidates.
    pub candidates: Vec<Vec<f64>>,
    /// Their objectives.
    pub objectives: Vec<Vec<f64>>,
    /// Laps evaluated.
    pub evaluations: u64,
    /// What the search had come to on its way.
    pub reached: Vec<Reached>,
}

/// Looks for the front between the study's objectives, with strategy, line or both free.
///
/// # Errors
/// Those of the problem and the evaluator.
pub fn search_front(
    setup: &HybridSetup,
    settings: &HybridStudySettings,
    energy_mj: f64,
    recorder: &mut Recorder<'_>,
    observe: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<StrategyFront> {
    let fixed = setup.zone_problem(&[], energy_mj, &settings.objectives)?;
    let (problem, line) = match (settings.free, &setup.alpha) {
        (FreePart::Strategy, _) | (_, None) => (fixed, Vec::new()),
        (free, Some(alpha)) => {
            // Control points move the line about the fastest one, which a few of them alone could not say.
            let mut cross_sections = setup.raceline.cross_sections.clone();
            cross_sections.reference.clone_from(alpha);
            let parametrisation = Parametrisation::control_points(control_points(&cross_sections));
            let coefficients = parametrisation.fit(&cross_sections, alpha)?;
            let line = parametrisation.variables_of(&coefficients);
            // Zones lie where they do on the fixed line, by distance.
            let shape = geometry(&cross_sections.points(alpha), cross_sections.closed);
            let mut length = shape.segment_m.clone();
            length.resize(cross_sections.len(), 0.0);
            let zone_sections = fixed.energy().starts_along(&length);
            let run_in = late_bend(&shape.curvature_1pm);
            let plan = EnergyPlan::zoned(
                &length,
                &zone_sections,
                cross_sections.closed,
                run_in,
                Mode::Additional,
            );
            let zones = plan.count();
            let free_zones = if free == FreePart::Line { 0 } else { zones };
            let problem = HybridProblem::new(
                HybridLine::Free {
                    cross_sections: Box::new(cross_sections),
                    parametrisation,
                },
                setup.car.clone(),
                plan,
                Strategy {
                    free: (0..free_zones).map(Free::Zone).collect(),
                    ..Strategy::fixed(Gates::of_zones(energy_mj), zones)
                },
                &settings.objectives,
                settings.entry_mps,
            )?;
            (problem, line)
        }
    };
    let search = settings.front_search();
    let mopso = settings.front_swarm();
    let place = (settings.backend, settings.adapter.as_deref());
    let on_device = search.on_device(settings.swarm, &problem.problem, &mopso, place)?;
    let mut swarm = search.begin(&problem.problem, mopso, settings.swarm)?;
    if settings.starts_warm() {
        swarm.start_from(&starting_candidates(&problem, settings, &line))?;
    }
    if on_device {
        swarm = recorder.run_on_device(&problem, swarm, place, observe)?;
    } else {
        let mut evaluator = open_hybrid_evaluator(&problem, place.0, place.1)?;
        run(&mut swarm, &mut recorder.over(evaluator.as_mut()), observe)?;
    }
    let front = swarm.front();
    Ok(StrategyFront {
        names: problem.problem.variables.iter().map(|v| v.name.clone()).collect(),
        candidates: front.candidates,
        objectives: front.objectives,
        evaluations: swarm.evaluations(),
        reached: swarm.reached().to_vec(),
    })
}

/// The known line, where lines are free, with shares of all zones from none to all.
fn starting_candidates(
    problem: &HybridProblem,
    settings: &HybridStudySettings,
    line: &[f64],
) -> Vec<Vec<f64>> {
    /// Purpose of the draws in the counter.
    const SPREAD: u32 = 0x11e9;
    let random = Random::new(settings.seed);
    let shares = problem.dimensions() - problem.line_variables();
    (0..settings.population)
        .map(|i| {
            let level = i as f64 / (settings.population - 1) as f64;
            let noise = |k: usize| random.uniform(SPREAD, 0, i as u32, k as u32) - 0.5;
            let mut candidate = line.to_vec();
            if i > 0 {
                for (k, x) in candidate.iter_mut().enumerate() {
                    let v = &problem.problem.variables[k];
                    *x = (*x + 0.002 * noise(shares + k) * (v.upper - v.lower)).clamp(v.lower, v.upper);
                }
            }
            candidate.extend((0..shares).map(|k| (level + 0.2 * noise(k)).clamp(0.0, 1.0)));
            candidate
        })
        .collect()
}

/// Gates of speed (m/s) that a lap with a budget is tried with: the lowest spends it where it is worth most.
pub fn gate_speeds() -> impl Iterator<Item = f64> {
    (8..=36).map(|i| 2.0 * f64::from(i))
}

/// Budgets are looked for up to this (MJ).
pub const MOST_MJ: f64 = 30.0;

/// The budget (MJ) at which `excess`, which falls with it, comes to zero; the greatest if it never does, zero if it
/// always has.
///
/// # Errors
/// Those of `excess`.
pub fn budget_at(mut excess: impl FnMut(f64) -> Result<f64>) -> Result<f64> {
    if excess(0.0)? <= 0.0 {
        return Ok(0.0);
    }
    if excess(MOST_MJ)? > 0.0 {
        return Ok(MOST_MJ);
    }
    // To a tenth of a joule.
    let [_, enough] = try_bisected([0.0, MOST_MJ], 1e-7, |budget| Ok(excess(budget)? > 0.0))?;
    Ok(enough)
}
