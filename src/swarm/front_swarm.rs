//! What looks for a front in a study: a swarm, islands of swarms, or the genetic algorithm that they are compared with. A swarm for
//! one objective that lives on a device is one of these, too.

use super::trail::Trail;
use super::{
    Counters, Front, Islands, Migration, Mopso, MopsoSettings, Nsga2, Nsga2Settings, Optimiser, Reached,
    SwarmPlace,
};
use crate::error::{Error, Result};
use crate::evaluate::{BackendChoice, Evaluation, Problem};
use serde::{Deserialize, Serialize};

/// How solutions move between the islands of a study.
const MIGRATION: Migration = Migration { every: 10, count: 5 };

/// What is to look for a front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FrontSearch {
    /// Whether NSGA-II does, with the swarm's population, iterations and seed.
    pub genetic: bool,
    /// Swarms between which solutions move, each of the whole population.
    pub islands: usize,
}

impl FrontSearch {
    /// One swarm, as a search for one objective is.
    pub const ONE_SWARM: Self = Self {
        genetic: false,
        islands: 1,
    };

    /// Checks that there can be such a search for so many objectives.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting.
    pub fn check(self, objectives: usize, population: usize) -> Result<()> {
        let setting =
            |name: &str, found: String, expected: &str| Error::input("the study", name, found, expected);
        if self.genetic && objectives < 2 {
            let found = "nsga2, with one objective".to_owned();
            return Err(setting("algorithm", found, "nsga2 with two objectives or more"));
        }
        if self.genetic && !population.is_multiple_of(2) {
            let found = format!("{population}, with algorithm nsga2");
            return Err(setting("population", found, "an even number"));
        }
        let reason = match (self.islands, self.genetic, objectives) {
            (1, ..) => return Ok(()),
            (_, true, _) => "with algorithm nsga2",
            (_, _, 0 | 1) => "with one objective",
            _ => return Ok(()),
        };
        let found = format!("{}, {reason}", self.islands);
        Err(setting("islands", found, "1, or a swarm of several objectives"))
    }

    /// Whether the swarm of so many objectives lives on the device, if candidates are evaluated by that backend and adapter and
    /// there is room.
    ///
    /// # Errors
    /// [`Error::Input`] with the reason if the device is asked for and cannot be had.
    pub fn wants_device(
        self,
        place: SwarmPlace,
        objectives: usize,
        settings: &MopsoSettings,
        backend: (BackendChoice, Option<&str>),
    ) -> Result<bool> {
        let reason = if self.genetic {
            "algorithm nsga2"
        } else if self.islands > 1 {
            "islands"
        } else if settings.motion.mutation.tries() {
            "mutation whose trials are evaluated one by one"
        } else if objectives == 1 && settings.motion.difference_share > 0.0 {
            "one objective and another algorithm than thesis"
        } else {
            return place.on_device(backend, settings.motion.population, objectives);
        };
        if place == SwarmPlace::Device {
            let found = format!("device, with {reason}");
            return Err(Error::input("the study", "swarm", found, "host or auto"));
        }
        Ok(false)
    }

    /// The same for this problem, where the device has room for it.
    ///
    /// # Errors
    /// Those of [`FrontSearch::wants_device`]; [`Error::Input`] with what fits if the device is asked for and has no room; those of
    /// a device that does not open.
    pub fn on_device(
        self,
        place: SwarmPlace,
        problem: &Problem,
        settings: &MopsoSettings,
        backend: (BackendChoice, Option<&str>),
    ) -> Result<bool> {
        let population = settings.motion.population;
        Ok(
            self.wants_device(place, problem.objectives.len(), settings, backend)?
                && place.has_room(backend.1, population, problem.variables.len())?,
        )
    }

    /// The search, with seeds of islands that follow one another.
    ///
    /// # Errors
    /// Those of [`FrontSearch::check`] and of the swarm.
    pub fn begin(self, problem: &Problem, settings: MopsoSettings, place: SwarmPlace) -> Result<FrontSwarm> {
        let motion = &settings.motion;
        self.check(problem.objectives.len(), motion.population)?;
        if self.genetic {
            let settings = Nsga2Settings {
                population: motion.population,
                iterations: motion.iterations,
                seed: motion.seed,
                ..Nsga2Settings::default()
            };
            return Ok(Kind::Genetic(Box::new(Nsga2::new(problem, settings)?)).into());
        }
        if self.islands == 1 {
            return Ok(Kind::Swarm(Box::new(place.swarm(problem, settings)?)).into());
        }
        let swarms = (0..self.islands as u64)
            .map(|k| Mopso::new(problem, settings.clone().with_seed(motion.seed.wrapping_add(k))))
            .collect::<Result<_>>()?;
        let islands = Islands::new(problem, swarms, Some(MIGRATION))?;
        Ok(Kind::Islands(Box::new(islands)).into())
    }
}

/// What searches for a front.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Kind {
    /// One swarm.
    Swarm(Box<Mopso>),
    /// Swarms with migration.
    Islands(Box<Islands<Mopso>>),
    /// NSGA-II.
    Genetic(Box<Nsga2>),
}

/// A search for a front, with its whole state and what it had come to on its way.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct FrontSwarm {
    kind: Kind,
    trail: Trail,
}

impl From<Kind> for FrontSwarm {
    fn from(kind: Kind) -> Self {
        Self {
            kind,
            trail: Trail::default(),
        }
    }
}

impl FrontSwarm {
    /// Puts the first candidates at these, before the first population is asked for: those of every island.
    ///
    /// # Errors
    /// [`Error::Input`] naming a candidate that is no finite value for each variable.
    pub fn start_from(&mut self, candidates: &[Vec<f64>]) -> Result<()> {
        match &mut self.kind {
            Kind::Swarm(swarm) => swarm.start_from(candidates),
            Kind::Islands(islands) => {
                let mut swarms = islands.islands_mut().iter_mut();
                swarms.try_for_each(|swarm| swarm.start_from(candidates))
            }
            Kind::Genetic(genetic) => genetic.start_from(candidates),
        }
    }

    /// The one swarm, which may live on a device.
    #[cfg(feature = "gpu")]
    pub fn alone(&self) -> Option<&Mopso> {
        match &self.kind {
            Kind::Swarm(swarm) => Some(swarm),
            _ => None,
        }
    }

    /// Takes the one swarm back from a device.
    #[cfg(feature = "gpu")]
    pub fn take_back(&mut self, swarm: Mopso) {
        self.kind = Kind::Swarm(Box::new(swarm));
    }

    /// Lets go of its particles, once it is done: it is not asked again.
    pub fn let_particles_go(&mut self) {
        if let Kind::Swarm(swarm) = &mut self.kind {
            swarm.let_particles_go();
        }
    }

    /// What it had come to on its way.
    pub fn reached(&self) -> &[Reached] {
        self.trail.reached()
    }

    /// Its way, to note steps that are taken on a device.
    #[cfg(feature = "gpu")]
    pub fn trail_mut(&mut self) -> &mut Trail {
        &mut self.trail
    }

    fn present(&self) -> &dyn Optimiser {
        match &self.kind {
            Kind::Swarm(swarm) => swarm,
            Kind::Islands(islands) => islands,
            Kind::Genetic(genetic) => genetic,
        }
    }

    fn present_mut(&mut self) -> &mut dyn Optimiser {
        match &mut self.kind {
            Kind::Swarm(swarm) => swarm,
            Kind::Islands(islands) => islands,
            Kind::Genetic(genetic) => genetic,
        }
    }
}

impl Optimiser for FrontSwarm {
    fn ask(&mut self) -> Vec<f64> {
        self.trail.begin();
        self.present_mut().ask()
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        self.present_mut().tell(evaluation)?;
        let (now, planned) = (self.counters(), self.planned_iterations());
        let mut trail = std::mem::take(&mut self.trail);
        trail.note(now, planned, || self.front().objectives);
        self.trail = trail;
        Ok(())
    }

    fn counters(&self) -> Counters {
        self.present().counters()
    }

    fn planned_iterations(&self) -> usize {
        self.present().planned_iterations()
    }

    fn done(&self) -> bool {
        self.present().done()
    }

    fn best(&self) -> Vec<f64> {
        self.present().best()
    }

    fn violation(&self) -> f64 {
        self.present().violation()
    }

    fn front(&self) -> Front {
        self.present().front()
    }
}
