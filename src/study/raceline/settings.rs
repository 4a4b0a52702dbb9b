//! What a racing-line study is asked to do.

use crate::config::kinds::{
    Choice, choice, choices, count, counts, file, name_or_file, named, number, of, optional, switch, text,
    texts,
};
use crate::config::settings::{Flag, settings};
use crate::error::{Error, Result};
use crate::evaluate::line::LineObjective;
use crate::evaluate::{BackendChoice, Problem};
use crate::line::{CarPlan, TERMS};
use crate::study::framework::memory::Size;
use crate::study::framework::setups::{MOST_SETUPS, check_parameters};
use crate::study::framework::shared_settings::{
    adapter, cognitive, entry_mps, envelope, inertia, islands, mutation, seed, share, social,
    steering_rate_deg_s, swarm,
};
use crate::study::framework::{Coefficients, Mutated, Scheduled};
use crate::swarm::{
    CooperativeSettings, FrontSearch, MopsoSettings, Mutation, PsoSettings, Schedule, SwarmPlace,
};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What looks for the best line by one objective.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LineAlgorithm {
    /// Swarms in windows over a spline's control points, from coarse to fine.
    #[default]
    Windows,
    /// CPSO-S_K over `alpha` at every cross-section: a swarm to each of the groups, by turns, in the others' context.
    Cooperative,
    /// One plain particle swarm over `alpha` at every cross-section, with the settings of the thesis; so for the front.
    Thesis,
    /// As windows, and NSGA-II for the front.
    Nsga2,
}

named!(LineAlgorithm {
    Windows = "windows",
    Cooperative = "cooperative",
    Thesis = "thesis",
    Nsga2 = "nsga2",
});

settings! {
    /// Settings of a racing-line study.
    pub struct RacelineSettings {
        track: String ["-"] = "silverstone_gp".to_owned(), name_or_file(),
            "The circuit: a bundled name, a shape such as circle:590:600, or a file (TOML, CSV, GPX, KML, a log with GPS)";
        car: String ["-"] = "gt".to_owned(), name_or_file(),
            "The car whose g-g-v envelope is swept: a bundled name (gt) or a TOML file";
        envelope: Option<PathBuf> = envelope;
        section: Option<String> ["-"] = None, optional(text()).example("\"Abbey\""),
            "Only this named stretch of the track, or a sector such as 3/12 of its cross-sections, as an open road";
        sections: Option<usize> ["-"] = None, optional(count(8, 1_000_000)).example("960"),
            "Cross-sections of the track; without it one for every 4 m, and 960 at least";
        as_surveyed: bool ["-"] = true, switch(true).flag(Flag::Switch("smoothed", false)),
            "Whether a surveyed track's line and edges are taken as they are; else they are smoothed, within 0.25 m";
        car_width_m: f64 ["m"] = 2.0, number(0.0, 10.0),
            "Width of the car; zero lets its middle use the whole road";
        car_length_m: f64 ["m"] = 4.5, number(0.0, 20.0),
            "Length of the car, whose corners swing out in tight bends; zero leaves them out";
        margin_m: f64 ["m"] = 0.0, number(0.0, 10.0),
            "Room that is left between the car and either edge";
        ellipse_exponent: f64 ["-"] = 2.0, number(1.0, 4.0),
            "Exponent of the friction ellipse";
        steering_rate_deg_s: Option<f64> = steering_rate_deg_s;
        entry_mps: f64 = entry_mps;
        objectives: Vec<LineObjective> ["-"] = usual_objectives(), choices(),
            "What is minimised; more than one for a front";
        surface_sections: Vec<u32> ["-"] = Vec::new(), counts().example("[120, 180]"),
            "Two cross-sections, counted from 0, over whose alpha each objective is drawn; without them the sharpest bend's and the next";
        warm_start: Option<bool> ["-"] = None, optional(switch(true)).flag(Flag::Switch("no_warm_start", false)).search().example("true"),
            "Whether the swarms start from the reference optima; without it they do, but with algorithm thesis start from no known line";
        local_search: Option<bool> ["-"] = None, optional(switch(true)).flag(Flag::Switch("no_local_search", false)).search().example("true"),
            "Whether exact gradients lead what the swarms find to the nearest optimum; without it they do, but not with algorithm thesis";
        setups: Option<usize> ["-"] = None, optional(count(0, MOST_SETUPS as u64)).example("63"),
            "Set-ups of the car that each get a fastest line of their own, beside the car as it is";
        parameters: Vec<String> ["-"] = ["mass_kg", "downforce_area_m2"].map(str::to_owned).to_vec(), texts(),
            "Parameters that set-ups move";
        share: f64 = share;
        algorithm: LineAlgorithm ["-"] = LineAlgorithm::Windows, choice().search(),
            "What looks for the best line by one objective; cooperative (CPSO-S_K) and thesis start at random; nsga2 is windows, and NSGA-II for the front";
        inertia: Option<Schedule> = inertia;
        cognitive: Option<Schedule> = cognitive;
        social: Option<Schedule> = social;
        mutation: Option<Mutation> = mutation;
        sectors: usize ["-"] = 1, count(1, 1000).search(),
            "Sectors in which thesis looks for the line, one after another, each from where the one before ends; 1 is the whole line";
        groups: usize ["-"] = 12, count(1, 1_000_000).search(),
            "Groups of neighbouring cross-sections of the cooperative algorithm";
        population: usize ["-"] = 200, count(8, 10_000_000).search(),
            "Particles of the swarm for the front, and of each objective's with cooperative or thesis; windows have their own";
        iterations: usize ["-"] = 200, count(1, 1_000_000).search(),
            "Iterations of these swarms; without effect for one objective searched by windows";
        islands: usize = islands;
        archive: usize ["-"] = 100, count(8, 10_000).search(),
            "Lines that the front keeps";
        seed: u64 = seed;
        swarm: SwarmPlace = swarm;
        backend: BackendChoice ["-"] = BackendChoice::Auto, choice().place(),
            "Where lines are evaluated";
        adapter: Option<String> = adapter;
    }

    /// Coefficients are those of the algorithm.
    fn consistent(&self) -> Result<()> {
        check_parameters(self.setups, &self.parameters)?;
        self.check_setups()?;
        let two = matches!(self.surface_sections[..], [a, b] if a != b);
        if !two && !self.surface_sections.is_empty() {
            let found = format!("{:?}", self.surface_sections);
            return Err(Error::input("the study", "surface_sections", found, "two different ones"));
        }
        self.check_sectors()?;
        self.front_search().check(self.objectives.len(), self.population)?;
        let refused = match self.algorithm {
            LineAlgorithm::Thesis => Coefficients::default(),
            LineAlgorithm::Cooperative => Coefficients {
                mutation: self.mutation,
                ..Coefficients::default()
            },
            LineAlgorithm::Windows | LineAlgorithm::Nsga2 => self.coefficients(),
        };
        refused.refuse_with(self.algorithm.name())
    }
}

/// Distance between cross-sections (m) where their number is not given, and how few there are at the least.
const SECTION_M: f64 = 4.0;
const LEAST_SECTIONS: usize = 960;
/// As long as tracks are (m) whose memory is thought of before they are read.
const LONG_TRACK_M: f64 = 7500.0;

fn usual_objectives() -> Vec<LineObjective> {
    vec![
        LineObjective::Gamma,
        LineObjective::Length,
        LineObjective::LapTime,
    ]
}

impl RacelineSettings {
    /// Refuses set-ups where there is no fastest line of theirs.
    fn check_setups(&self) -> Result<()> {
        let refuse = |found: &str, expected: &str| Err(Error::input("the study", "setups", found, expected));
        if self.setups.is_none() {
            return Ok(());
        }
        if !self.objectives.contains(&LineObjective::LapTime) {
            return refuse("set-ups without lap times", "lap_time among the objectives");
        }
        if self.envelope.is_some() {
            return refuse("set-ups and an envelope from a file", "the car's own envelope");
        }
        if self.ellipse_exponent != 2.0 {
            return refuse("set-ups and another exponent", "an ellipse exponent of 2");
        }
        Ok(())
    }

    /// Refuses sectors where no line is looked for in them.
    fn check_sectors(&self) -> Result<()> {
        let refuse = |found: &str, expected: &str| {
            let found = format!("{}, with {found}", self.sectors);
            Err(Error::input("the study", "sectors", found, expected))
        };
        if self.sectors == 1 {
            return Ok(());
        }
        if self.algorithm != LineAlgorithm::Thesis {
            let found = format!("algorithm {}", self.algorithm.name());
            return refuse(&found, "1, or algorithm thesis");
        }
        if self.section.is_some() {
            return refuse("a section of the track", "1, or the whole track");
        }
        // A lap time would need the speed at which the sector before ends.
        match self.objectives[..] {
            [LineObjective::Length | LineObjective::Gamma | LineObjective::Kappa2] => Ok(()),
            _ => refuse(
                "other objectives",
                "1, or one of the objectives length, gamma and kappa2",
            ),
        }
    }

    /// Refuses sectors of too few cross-sections for a line.
    pub(super) fn check_sectors_of(&self, sections: usize) -> Result<()> {
        if self.sectors == 1 || sections / self.sectors >= TERMS {
            return Ok(());
        }
        let found = format!("{} of {sections} cross-sections", self.sectors);
        let expected = format!("sectors of {TERMS} cross-sections at least");
        Err(Error::input("the study", "sectors", found, expected))
    }

    /// Whether the swarms start from the reference optima.
    pub fn starts_warm(&self) -> bool {
        self.warm_start.unwrap_or(self.algorithm != LineAlgorithm::Thesis)
    }

    /// Cross-sections of a track of a length (m).
    pub(super) fn sections_on(&self, length_m: f64) -> usize {
        let by_length = (length_m / SECTION_M).ceil() as usize;
        self.sections.unwrap_or(by_length.max(LEAST_SECTIONS))
    }

    /// Whether exact gradients lead what the swarms find.
    pub fn searches_locally(&self) -> bool {
        self.local_search
            .unwrap_or(self.algorithm != LineAlgorithm::Thesis)
    }

    /// What they say of the motion of cooperative and published swarms.
    pub(super) fn coefficients(&self) -> Coefficients {
        Coefficients {
            inertia: self.inertia,
            cognitive: self.cognitive,
            social: self.social,
            mutation: self.mutation,
        }
    }

    /// What looks for the front.
    pub(super) fn front_search(&self) -> FrontSearch {
        FrontSearch {
            genetic: self.algorithm == LineAlgorithm::Nsga2,
            islands: self.islands,
        }
    }

    /// The swarm that looks for the front.
    pub(super) fn front_swarm(&self) -> MopsoSettings {
        let mut mopso = if self.algorithm == LineAlgorithm::Thesis {
            MopsoSettings::thesis()
        } else {
            MopsoSettings::default()
        };
        if self.algorithm == LineAlgorithm::Thesis {
            mopso.motion = self.coefficients().apply(mopso.motion);
        }
        mopso.archive = self.archive;
        mopso
            .with_size(self.population, self.iterations)
            .with_seed(self.seed)
    }

    /// The swarm that looks for the best line by one objective with algorithms cooperative and thesis.
    pub(super) fn line_swarm(&self) -> PsoSettings {
        let motion = match self.algorithm {
            LineAlgorithm::Cooperative => CooperativeSettings::default().motion,
            _ => PsoSettings::thesis_lines(),
        };
        self.coefficients().apply(PsoSettings {
            population: self.population,
            iterations: self.iterations,
            seed: self.seed,
            ..motion
        })
    }

    /// Whether the swarm for the objectives of `problem` lives on the device.
    ///
    /// # Errors
    /// [`Error::Input`] with the reason if it is asked to and cannot.
    pub(super) fn on_device(&self, problem: &Problem) -> Result<bool> {
        let backend = (self.backend, self.adapter.as_deref());
        if problem.objectives.len() == 1 {
            let motion = match self.algorithm {
                LineAlgorithm::Thesis => self.line_swarm(),
                _ => PsoSettings::default(),
            };
            let pulls = MopsoSettings::of_one_objective(motion);
            return FrontSearch::ONE_SWARM.on_device(self.swarm, problem, &pulls, backend);
        }
        self.front_search()
            .on_device(self.swarm, problem, &self.front_swarm(), backend)
    }

    /// The car from above, with the margin on every side of it.
    pub(super) fn plan_with_margin(&self) -> CarPlan {
        let length_m = if self.car_length_m > 0.0 {
            self.car_length_m + 2.0 * self.margin_m
        } else {
            0.0
        };
        CarPlan {
            width_m: self.car_width_m + 2.0 * self.margin_m,
            length_m,
        }
    }

    /// What the study's memory goes with.
    pub fn size(&self, known: Option<usize>) -> Size {
        let sections = known.unwrap_or_else(|| self.sections_on(LONG_TRACK_M));
        Size {
            population: self.population.saturating_mul(self.islands),
            // The swarm's control points are fewer than the cross-sections; the lines of the front are whole.
            variables: sections,
            iterations: self.iterations,
            sections,
            archive: self.archive,
            ..Size::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::settings::testing::{assert_refused, assert_repeated};

    #[test]
    fn a_study_file_repeats_its_study() {
        assert_repeated(&RacelineSettings {
            objectives: vec![LineObjective::Kappa2, LineObjective::LapTime],
            warm_start: Some(false),
            algorithm: LineAlgorithm::Cooperative,
            inertia: Some(Schedule::Fixed(0.5)),
            groups: 5,
            section: Some("Abbey".to_owned()),
            seed: 7,
            ..RacelineSettings::default()
        });
    }

    #[test]
    fn mistakes_are_named() {
        assert_refused::<RacelineSettings>(&[
            ("sections = 3", "sections"),
            ("objectives = [\"speed\"]", "objectives"),
            ("objectives = [\"gamma\", \"gamma\"]", "gamma twice"),
            ("width = 2.0", "width"),
            ("algorithm = \"ants\"", "algorithm"),
            ("car_width_m = \"wide\"", "car_width_m"),
            ("surface_sections = [3]", "surface_sections"),
            ("surface_sections = [3, 3]", "surface_sections"),
            ("inertia = 0.5", "inertia"),
            ("algorithm = \"cooperative\"\nmutation = 0.5", "mutation"),
            ("algorithm = \"thesis\"\nsocial = \"much\"", "social"),
            ("algorithm = \"nsga2\"\ninertia = 0.5", "inertia"),
            ("algorithm = \"nsga2\"\npopulation = 33", "population"),
            ("algorithm = \"nsga2\"\nobjectives = [\"length\"]", "algorithm"),
            ("algorithm = \"nsga2\"\nislands = 2", "islands"),
            ("objectives = [\"length\"]\nislands = 2", "islands"),
        ]);
    }
}
