//! Every algorithm on every test problem at the same budget.
//!
//! Conventions: 25,000 evaluations, swarm and archive of 100, hypervolume with reference 1.1 per objective and IGD+
//! on the scale of the true front; for one objective 100,000 evaluations, 40 particles, and the distance of the
//! best cost from the optimum's.

use super::metrics::{hypervolume, igd_plus};
use super::problems::SuiteProblem;
use super::{
    Beyond, CooperativeSettings, CooperativeSwarm, CovarianceSettings, CovarianceSwarm, DifferenceSettings,
    DifferenceSwarm, HybridSettings, HybridSwarm, Mopso, MopsoSettings, Mutation, Nsga2, Nsga2Settings,
    Optimiser, Pso, PsoSettings, Restarts, Truncation, run,
};
use crate::error::{Error, Result};
use crate::evaluate::Problem;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Names of the algorithms for several objectives; `default` is [`MopsoSettings::default`].
pub const MULTI_OBJECTIVE: [&str; 6] = [
    "default",
    "default_nearest",
    "smpso",
    "nsga2",
    "thesis",
    "thesis_random_mu",
];
/// Names of the algorithms for one objective; `default` is [`HybridSettings::default`].
pub const SINGLE_OBJECTIVE: [&str; 6] = [
    "default",
    "pso",
    "covariance",
    "difference",
    "cooperative",
    "thesis",
];

/// Particles and evaluations of a comparison: 100 and 25,000 for several objectives, 40 and 100,000 for one.
pub fn budget(problem: &Problem) -> (usize, usize) {
    if problem.objectives.len() > 1 {
        (100, 25_000)
    } else {
        (40, 100_000)
    }
}

/// Reference point of the hypervolume on the true front's scale, in every objective.
pub const REFERENCE: f64 = 1.1;
/// Points of the true front that IGD+ is taken over, about.
const FRONT_POINTS: usize = 2000;

/// The optimiser of that name for `problem` at the budget of the comparison.
///
/// # Errors
/// [`Error::Input`] if no optimiser of that name exists for this number of objectives.
pub fn optimiser(name: &str, problem: &Problem, seed: u64) -> Result<Box<dyn Optimiser + Send>> {
    optimiser_within(name, problem, budget(problem).1, seed)
}

/// The same at another budget of evaluations.
///
/// # Errors
/// Those of [`optimiser`].
pub fn optimiser_within(
    name: &str,
    problem: &Problem,
    evaluations: usize,
    seed: u64,
) -> Result<Box<dyn Optimiser + Send>> {
    let (population, _) = budget(problem);
    let iterations = evaluations / population;
    let pso = |settings: PsoSettings| -> Result<Box<dyn Optimiser + Send>> {
        let settings = PsoSettings {
            population,
            iterations,
            seed,
            ..settings
        };
        Ok(Box::new(Pso::new(problem, settings)?))
    };
    if problem.objectives.len() > 1 {
        let sizes = Sizes {
            population,
            iterations,
            archive: population,
            seed,
        };
        return several(name, problem, sizes, &[]);
    }
    Ok(match name {
        "default" => {
            let settings = HybridSettings {
                population,
                iterations,
                seed,
                ..HybridSettings::default()
            };
            Box::new(HybridSwarm::new(problem, settings)?)
        }
        "pso" => pso(PsoSettings::default())?,
        "thesis" => pso(PsoSettings::thesis())?,
        "covariance" => {
            let settings = CovarianceSettings {
                population,
                iterations,
                seed,
                spread: 0.3,
                active: true,
                beyond: Beyond::Drawn,
                restarts: Restarts::Alternating,
            };
            let middle: Vec<f64> = problem
                .variables
                .iter()
                .map(|v| 0.5 * (v.lower + v.upper))
                .collect();
            Box::new(CovarianceSwarm::new(problem, &middle, settings)?)
        }
        "difference" => {
            let settings = DifferenceSettings {
                population,
                iterations,
                seed,
                ..DifferenceSettings::default()
            };
            Box::new(DifferenceSwarm::new(problem, settings)?)
        }
        "cooperative" => {
            let base = CooperativeSettings::default();
            let motion = PsoSettings {
                iterations: evaluations / base.motion.population,
                seed,
                ..base.motion
            };
            Box::new(CooperativeSwarm::new(
                problem,
                CooperativeSettings { motion, ..base },
            )?)
        }
        _ => return Err(unknown(name, &SINGLE_OBJECTIVE)),
    })
}

fn unknown(name: &str, known: &[&str]) -> Error {
    Error::input("the comparison", "algorithm", name, known.join(", "))
}

/// How large a run of an optimiser of several objectives is.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Candidates of a generation.
    pub population: usize,
    /// Generations.
    pub iterations: usize,
    /// Most members of the archive; the genetic algorithm's is its population.
    pub archive: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// The optimiser of that name for several objectives. Its first candidates are those of `start`.
///
/// # Errors
/// [`Error::Input`] if no optimiser of that name exists, and those of its settings.
pub fn several(
    name: &str,
    problem: &Problem,
    sizes: Sizes,
    start: &[Vec<f64>],
) -> Result<Box<dyn Optimiser + Send>> {
    let mopso = |settings: MopsoSettings| -> Result<Box<dyn Optimiser + Send>> {
        let motion = PsoSettings {
            population: sizes.population,
            iterations: sizes.iterations,
            seed: sizes.seed,
            ..settings.motion
        };
        let settings = MopsoSettings {
            motion,
            archive: sizes.archive,
            ..settings
        };
        let mut swarm = Mopso::new(problem, settings)?;
        swarm.start_from(start);
        Ok(Box::new(swarm))
    };
    match name {
        "default" => mopso(MopsoSettings::default()),
        "default_nearest" => mopso(MopsoSettings {
            truncation: Truncation::MutualNearest,
            ..MopsoSettings::default()
        }),
        "smpso" => mopso(MopsoSettings::smpso()),
        "thesis" => mopso(MopsoSettings::thesis()),
        "thesis_random_mu" => mopso(MopsoSettings {
            mutation: Mutation::Random,
            ..MopsoSettings::thesis()
        }),
        "nsga2" => {
            let settings = Nsga2Settings {
                population: sizes.population,
                iterations: sizes.iterations,
                seed: sizes.seed,
                ..Nsga2Settings::default()
            };
            let mut genetic = Nsga2::new(problem, settings)?;
            genetic.start_from(start);
            Ok(Box::new(genetic))
        }
        _ => Err(unknown(name, &MULTI_OBJECTIVE)),
    }
}

/// What one run reached.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// Hypervolume of what was found; for one objective how far the best cost is from the optimum's.
    pub quality: f64,
    /// IGD+; `None` for one objective, and where the true front is not known or nothing was found.
    pub igd_plus: Option<f64>,
    /// Rows of objectives that were found. What violates constraints is left out.
    pub front: Vec<Vec<f64>>,
}

/// Runs an algorithm on a problem once for each seed from one to `seeds`, each run in a thread, at the budget of the
/// comparison or at another number of evaluations.
///
/// # Errors
/// Those of [`optimiser`].
pub fn compare(
    name: &str,
    problem: &SuiteProblem,
    seeds: u64,
    evaluations: Option<usize>,
) -> Result<Vec<Score>> {
    let truth = problem.scale().apply(&problem.front(FRONT_POINTS));
    let width = problem.problem().objectives.len();
    let evaluations = evaluations.unwrap_or(budget(problem.problem()).1);
    (1..=seeds)
        .into_par_iter()
        .map(|seed| {
            let mut optimiser = optimiser_within(name, problem.problem(), evaluations, seed)?;
            run(optimiser.as_mut(), &mut problem.evaluator(), |_| {
                ControlFlow::Continue(())
            })?;
            let found = optimiser.front();
            let members = found.candidates.iter().zip(found.objectives);
            let front: Vec<Vec<f64>> = members
                .filter(|(candidate, _)| problem.is_feasible(candidate))
                .map(|(_, objectives)| objectives)
                .collect();
            let scaled = problem.scale().apply(&front);
            if width == 1 {
                let quality = scaled.first().map_or(f64::INFINITY, |row| row[0]);
                return Ok(Score {
                    quality,
                    igd_plus: None,
                    front,
                });
            }
            let judged = !truth.is_empty() && !scaled.is_empty();
            Ok(Score {
                quality: hypervolume(&scaled, &vec![REFERENCE; width])?,
                igd_plus: judged.then(|| igd_plus(&scaled, &truth)).transpose()?,
                front,
            })
        })
        .collect()
}

/// First quartile, median and third quartile, by linear interpolation; not a number where there is no value.
pub fn quartiles(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    let at = |share: f64| {
        let place = share * last as f64;
        let (below, above) = (
            sorted.get(place.floor() as usize),
            sorted.get(place.ceil() as usize),
        );
        match (below, above) {
            (Some(a), Some(b)) => a + (b - a) * place.fract(),
            _ => f64::NAN,
        }
    };
    [0.25, 0.5, 0.75].map(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_by_hand() {
        assert_eq!(quartiles(&[4.0, 1.0, 3.0, 2.0, 5.0]), [2.0, 3.0, 4.0]);
        assert_eq!(quartiles(&[1.0, 2.0]), [1.25, 1.5, 1.75]);
        assert!(quartiles(&[])[1].is_nan());
    }

    #[test]
    fn all_names_are_known() {
        for (problem, names) in [
            ("zdt1", MULTI_OBJECTIVE.as_slice()),
            ("sphere", &SINGLE_OBJECTIVE),
        ] {
            let problem = SuiteProblem::by_name(problem).unwrap();
            for name in names {
                optimiser(name, problem.problem(), 1).unwrap();
            }
            assert!(optimiser("best", problem.problem(), 1).is_err());
        }
    }
}
