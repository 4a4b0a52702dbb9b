//! Optimisers by name, with what most users set: how many particles, for how long, from which seed.

use super::{
    AcceptsMigrants, CooperativeSettings, CooperativeSwarm, CovarianceSettings, CovarianceSwarm,
    DifferenceSettings, DifferenceSwarm, HybridSettings, HybridSwarm, Islands, Migration, Moead,
    MoeadSettings, Mopso, MopsoSettings, Mutation, Nsga2, Nsga2Settings, Nsga3, Nsga3Settings, Optimiser,
    OutOfBounds, Pso, PsoSettings, Restarts, Truncation,
};
use crate::error::{Error, Result};
use crate::evaluate::Problem;

/// Names of the optimisers for several objectives; `default` is [`MopsoSettings::default`].
pub const MULTI_OBJECTIVE: [&str; 8] = [
    "default",
    "default_nearest",
    "moead",
    "smpso",
    "nsga2",
    "nsga3",
    "thesis",
    "thesis_random_mu",
];
/// Names of the optimisers for one objective; `default` is [`HybridSettings::default`].
pub const SINGLE_OBJECTIVE: [&str; 6] = [
    "default",
    "pso",
    "covariance",
    "difference",
    "cooperative",
    "thesis",
];

/// Those of [`MULTI_OBJECTIVE`] that are swarms.
const SWARMS: [&str; 5] = [
    "default",
    "default_nearest",
    "smpso",
    "thesis",
    "thesis_random_mu",
];

/// How large a run of an optimiser is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Candidates of a generation. The cooperative swarm has ten to a group instead, and as many more generations.
    pub population: usize,
    /// Generations; their product with the population is the budget of evaluations.
    pub iterations: usize,
    /// Most members of the archive of several objectives; the genetic algorithms' is their population.
    pub archive: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// The optimiser of that name for `problem`: one of [`SINGLE_OBJECTIVE`] or [`MULTI_OBJECTIVE`], by its number of objectives.
///
/// # Errors
/// [`Error::Input`] if no optimiser of that name exists for this number of objectives, and those of its settings.
pub fn by_name(name: &str, problem: &Problem, sizes: Sizes) -> Result<Box<dyn Optimiser + Send>> {
    if problem.objectives.len() > 1 {
        return several_by_name(name, problem, sizes, &[]);
    }
    let Sizes {
        population,
        iterations,
        seed,
        ..
    } = sizes;
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
        "pso" | "thesis" => Box::new(pso(name, problem, sizes)?),
        "covariance" => {
            let settings = CovarianceSettings {
                population,
                iterations,
                seed,
                spread: 0.3,
                active: true,
                beyond: OutOfBounds::AsDrawn,
                restarts: Restarts::Alternating,
            };
            let middle: Vec<f64> = problem
                .variables
                .iter()
                .map(|v| 0.5 * (v.lower + v.upper))
                .collect();
            Box::new(CovarianceSwarm::new(problem, &middle, settings)?)
        }
        "difference" => Box::new(difference(problem, sizes)?),
        "cooperative" => {
            let base = CooperativeSettings::default();
            let motion = PsoSettings {
                iterations: population.saturating_mul(iterations) / base.motion.population,
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

/// The swarm called `pso` or `thesis`.
fn pso(name: &str, problem: &Problem, sizes: Sizes) -> Result<Pso> {
    let settings = match name {
        "thesis" => PsoSettings::thesis(),
        _ => PsoSettings::default(),
    };
    let settings = PsoSettings {
        population: sizes.population,
        iterations: sizes.iterations,
        seed: sizes.seed,
        ..settings
    };
    Pso::new(problem, settings)
}

fn difference(problem: &Problem, sizes: Sizes) -> Result<DifferenceSwarm> {
    let settings = DifferenceSettings {
        population: sizes.population,
        iterations: sizes.iterations,
        seed: sizes.seed,
        ..DifferenceSettings::default()
    };
    DifferenceSwarm::new(problem, settings)
}

/// The swarm for several objectives of that name; `default` for one that is not its own.
fn mopso(name: &str, problem: &Problem, sizes: Sizes) -> Result<Mopso> {
    let settings = match name {
        "default_nearest" => MopsoSettings {
            truncation: Truncation::MutualNearest,
            ..MopsoSettings::default()
        },
        "smpso" => MopsoSettings::smpso(),
        "thesis" => MopsoSettings::thesis(),
        "thesis_random_mu" => {
            let mut thesis = MopsoSettings::thesis();
            thesis.motion.mutation = Mutation::Random;
            thesis
        }
        _ => MopsoSettings::default(),
    };
    let settings = MopsoSettings {
        archive: sizes.archive,
        ..settings
    };
    let settings = settings
        .with_size(sizes.population, sizes.iterations)
        .with_seed(sizes.seed);
    Mopso::new(problem, settings)
}

/// Islands of the optimiser of that name, each of these sizes, with seeds that follow one another. They are those that take
/// solutions in from others: `pso`, `thesis` and `difference` for one objective, the swarms among [`MULTI_OBJECTIVE`] for several.
///
/// # Errors
/// As [`by_name`] and [`Islands::new`].
pub fn islands_by_name(
    name: &str,
    problem: &Problem,
    sizes: Sizes,
    (count, migration): (usize, Option<Migration>),
) -> Result<Box<dyn Optimiser + Send>> {
    fn of<O: AcceptsMigrants + Send + 'static>(
        problem: &Problem,
        sizes: Sizes,
        (count, migration): (usize, Option<Migration>),
        one: impl Fn(Sizes) -> Result<O>,
    ) -> Result<Box<dyn Optimiser + Send>> {
        let seeds = (0..count).map(|k| Sizes {
            seed: sizes.seed.wrapping_add(k as u64),
            ..sizes
        });
        let islands = seeds.map(one).collect::<Result<Vec<_>>>()?;
        Ok(Box::new(Islands::new(problem, islands, migration)?))
    }
    let asked = (count, migration);
    match (problem.objectives.len() > 1, name) {
        (false, "pso" | "thesis") => of(problem, sizes, asked, |sizes| pso(name, problem, sizes)),
        (false, "difference") => of(problem, sizes, asked, |sizes| difference(problem, sizes)),
        (false, _) => Err(unknown(name, &["pso", "thesis", "difference"])),
        (true, _) if SWARMS.contains(&name) => of(problem, sizes, asked, |sizes| mopso(name, problem, sizes)),
        (true, _) => Err(unknown(name, &SWARMS)),
    }
}

fn unknown(name: &str, known: &[&str]) -> Error {
    Error::input("the optimisers", "name", name, known.join(", "))
}

/// The optimiser of that name for several objectives. Its first candidates are those of `start`.
///
/// # Errors
/// As [`by_name`], and [`Error::Input`] naming a candidate of `start` that is no finite value for each variable.
pub fn several_by_name(
    name: &str,
    problem: &Problem,
    sizes: Sizes,
    start: &[Vec<f64>],
) -> Result<Box<dyn Optimiser + Send>> {
    match name {
        _ if SWARMS.contains(&name) => {
            let mut swarm = mopso(name, problem, sizes)?;
            swarm.start_from(start)?;
            Ok(Box::new(swarm))
        }
        "moead" => {
            let settings = MoeadSettings {
                population: sizes.population,
                iterations: sizes.iterations,
                seed: sizes.seed,
                ..MoeadSettings::default()
            };
            let mut genetic = Moead::new(problem, settings)?;
            genetic.start_from(start)?;
            Ok(Box::new(genetic))
        }
        "nsga2" => {
            let settings = Nsga2Settings {
                population: sizes.population,
                iterations: sizes.iterations,
                seed: sizes.seed,
                ..Nsga2Settings::default()
            };
            let mut genetic = Nsga2::new(problem, settings)?;
            genetic.start_from(start)?;
            Ok(Box::new(genetic))
        }
        "nsga3" => {
            let settings = Nsga3Settings {
                population: sizes.population,
                iterations: sizes.iterations,
                seed: sizes.seed,
                ..Nsga3Settings::default()
            };
            let mut genetic = Nsga3::new(problem, settings)?;
            genetic.start_from(start)?;
            Ok(Box::new(genetic))
        }
        _ => Err(unknown(name, &MULTI_OBJECTIVE)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swarm::problems::TestProblem;

    #[test]
    fn all_names_are_known() {
        for (problem, names) in [
            ("zdt1", MULTI_OBJECTIVE.as_slice()),
            ("sphere", &SINGLE_OBJECTIVE),
        ] {
            let problem = TestProblem::by_name(problem).unwrap();
            let sizes = Sizes {
                population: 20,
                iterations: 5,
                archive: 10,
                seed: 1,
            };
            for name in names {
                by_name(name, problem.problem(), sizes).unwrap();
            }
            for name in names {
                let islands = islands_by_name(name, problem.problem(), sizes, (3, None));
                let takes_in = ["difference", "pso"].contains(name)
                    || SWARMS.contains(name) && (*name != "default" || names.contains(&"nsga2"));
                assert_eq!(islands.is_ok(), takes_in, "{name}");
                if let Ok(mut islands) = islands {
                    let variables = problem.problem().variables.len();
                    assert_eq!(islands.ask().len(), 3 * sizes.population * variables, "{name}");
                }
            }
            let said = by_name("best", problem.problem(), sizes)
                .err()
                .unwrap()
                .to_string();
            assert!(said.contains("best") && said.contains("default"), "{said}");
        }
    }
}
