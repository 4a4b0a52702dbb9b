//! Coefficients of a swarm as settings of a study.

use crate::config::Table;
use crate::config::kinds::{Kind, quoted};
use crate::config::settings::Written;
use crate::error::{Error, Result};
use crate::swarm::{Mutation, PsoSettings, Schedule};
use std::path::Path;

/// What a study's settings say of a swarm's motion; what they leave out is the swarm's own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coefficients {
    /// Inertia weight.
    pub inertia: Option<Schedule>,
    /// Pull towards a particle's own best.
    pub cognitive: Option<Schedule>,
    /// Pull towards the leader.
    pub social: Option<Schedule>,
    /// Mutation.
    pub mutation: Option<Mutation>,
}

impl Coefficients {
    /// The motion with these coefficients.
    pub fn apply(&self, motion: PsoSettings) -> PsoSettings {
        PsoSettings {
            inertia: self.inertia.unwrap_or(motion.inertia),
            cognitive: self.cognitive.unwrap_or(motion.cognitive),
            social: self.social.unwrap_or(motion.social),
            mutation: self.mutation.unwrap_or(motion.mutation),
            ..motion
        }
    }

    /// Whether a pull or the inertia is named.
    pub fn names_motion(&self) -> bool {
        [self.inertia, self.cognitive, self.social]
            .iter()
            .any(Option::is_some)
    }

    /// Refuses any of them, which an algorithm of that name does not have.
    ///
    /// # Errors
    /// [`Error::Input`] naming the first that is set.
    pub fn refuse_with(&self, algorithm: &str) -> Result<()> {
        let Some((key, found)) = self.first_named() else {
            return Ok(());
        };
        let found = format!("{found}, with algorithm {algorithm}");
        let expected = "no such coefficient, or algorithm thesis";
        Err(Error::input("the study", key, found, expected))
    }

    /// The key of the first that is named, and what it is.
    fn first_named(&self) -> Option<(&'static str, String)> {
        let schedules = [
            ("inertia", self.inertia),
            ("cognitive", self.cognitive),
            ("social", self.social),
        ];
        let written = |(key, schedule)| Some((key, Scheduled.write(&schedule)?));
        let mutation = || Some(("mutation", Mutated.write(&self.mutation)?));
        let (key, Written::Value(found)) = schedules.into_iter().find_map(written).or_else(mutation)? else {
            return None;
        };
        Some((key, found))
    }
}

/// A [`Schedule`]: a number, or two.
pub struct Scheduled;

impl Kind<Option<Schedule>> for Scheduled {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Option<Schedule>>> {
        if let Ok(fixed) = table.number(key, 0.0, 10.0, "") {
            return Ok(Some(fixed.map(Schedule::Fixed)));
        }
        match table.numbers(key)?.as_deref() {
            Some(&[from, to]) => Ok(Some(Some(Schedule::Linear { from, to }))),
            _ => Err(table.refuse(key, "a number, or [first, last] for a linear schedule")),
        }
    }

    fn write(&self, schedule: &Option<Schedule>) -> Option<Written> {
        schedule.map(|schedule| {
            Written::Value(match schedule {
                Schedule::Fixed(v) => format!("{v:?}"),
                Schedule::Linear { from, to } => format!("[{from:?}, {to:?}]"),
            })
        })
    }

    fn parse(&self, text: &str, _: &Option<Schedule>) -> Result<Option<Schedule>, String> {
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
        match numbers.as_deref() {
            Ok([v]) if (0.0..=10.0).contains(v) => Ok(Some(Schedule::Fixed(*v))),
            Ok([from, to]) if from.is_finite() && to.is_finite() => {
                Ok(Some(Schedule::Linear { from: *from, to: *to }))
            }
            _ => Err("expected a number from 0 to 10, or FIRST,LAST".to_owned()),
        }
    }

    fn range(&self) -> String {
        "0 to 10".to_owned()
    }

    fn value_name(&self) -> &'static str {
        "X|FIRST,LAST"
    }
}

/// A [`Mutation`]: an exponent, or a name.
pub struct Mutated;

impl Kind<Option<Mutation>> for Mutated {
    fn read(&self, table: &Table<'_>, key: &str, _: &str, _: &Path) -> Result<Option<Option<Mutation>>> {
        let fixed = |mu: f64| {
            if mu > 0.0 {
                Mutation::Fixed(mu)
            } else {
                Mutation::None
            }
        };
        match (table.number(key, 0.0, 10.0, ""), table.string(key)) {
            (Ok(None), _) => Ok(None),
            (Ok(Some(mu)), _) => Ok(Some(Some(fixed(mu)))),
            (_, Ok(Some("random"))) => Ok(Some(Some(Mutation::Random))),
            (_, Ok(Some("polynomial"))) => Ok(Some(Some(Mutation::SMPSO))),
            _ => Err(table.refuse(key, "a number from 0 to 10, \"random\" or \"polynomial\"")),
        }
    }

    fn write(&self, mutation: &Option<Mutation>) -> Option<Written> {
        mutation.map(|mutation| {
            Written::Value(match mutation {
                Mutation::None => "0".to_owned(),
                Mutation::Fixed(mu) => format!("{mu:?}"),
                Mutation::Random => quoted("random"),
                Mutation::Polynomial { .. } => quoted("polynomial"),
            })
        })
    }

    fn parse(&self, text: &str, _: &Option<Mutation>) -> Result<Option<Mutation>, String> {
        match (text, text.parse::<f64>()) {
            ("random", _) => Ok(Some(Mutation::Random)),
            ("polynomial", _) => Ok(Some(Mutation::SMPSO)),
            (_, Ok(0.0)) => Ok(Some(Mutation::None)),
            (_, Ok(mu)) if (0.0..=10.0).contains(&mu) => Ok(Some(Mutation::Fixed(mu))),
            _ => Err("expected a number from 0 to 10, random or polynomial".to_owned()),
        }
    }

    fn value_name(&self) -> &'static str {
        "MU|NAME"
    }
}
