//! The exact optima beside the swarm, and the local search by exact gradients.

use super::lines::Setup;
use super::settings::RacelineSettings;
use crate::error::Result;
use crate::evaluate::line::LineObjective;
use crate::optimum::{
    Bounds, DescentSettings, LineMap, LineProblem, Optimum, PointMassLimits, Start, Weights, descend,
    least_gamma, least_squared_length, polish_lines, shortest, spacing_m,
};

/// The solvers on one track.
pub struct ExactSolvers {
    map: LineMap,
    bounds: Bounds,
    limits: Option<PointMassLimits>,
    reference: Vec<f64>,
    entry_mps: f64,
}

/// Weights of one objective alone.
fn only(objective: LineObjective) -> Weights {
    weights([(objective, 1.0)])
}

/// Weights of several.
fn weights(terms: impl IntoIterator<Item = (LineObjective, f64)>) -> Weights {
    let mut weights = Weights::default();
    for (objective, weight) in terms {
        match objective {
            LineObjective::Length => weights.length = weight,
            LineObjective::LengthSquared => weights.squared_length = weight,
            LineObjective::Gamma => weights.gamma = weight,
            LineObjective::Kappa2 => weights.curvature = weight,
            LineObjective::LapTime => weights.time = weight,
        }
    }
    weights
}

impl ExactSolvers {
    /// The solvers of `setup`. Lap times are theirs only on a friction ellipse of exponent 2.
    ///
    /// # Errors
    /// [`crate::Error::Input`] for a car that cannot be.
    pub fn new(setup: &Setup, settings: &RacelineSettings) -> Result<Self> {
        let map = LineMap::at_every_cut(&setup.cuts);
        Ok(Self {
            bounds: Bounds::road(map.variables()),
            limits: if setup.car.ellipse_exponent == 2.0 {
                Some(PointMassLimits::new(&setup.car)?)
            } else {
                None
            },
            reference: setup.cuts.reference.clone(),
            entry_mps: settings.entry_mps,
            map,
        })
    }

    fn problem(&self) -> LineProblem<'_> {
        LineProblem {
            limits: self.limits.as_ref().map(|l| l as _),
            start_mps: self.entry_mps,
            ..LineProblem::of(&self.map)
        }
    }

    /// Whether there is a solver for this objective.
    pub fn solves(&self, objective: LineObjective) -> bool {
        objective != LineObjective::LapTime || self.limits.is_some()
    }

    /// The line that is best by one objective; nothing where there is no solver for it.
    ///
    /// Length and squared length are convex, so that theirs is the optimum. The others are led downhill: Gamma and
    /// curvature from the optimum of the convex second difference over the reference line's spacing, lap time from the
    /// least curved line.
    ///
    /// # Errors
    /// [`crate::Error::Study`] if a solver refuses.
    pub fn best(&self, objective: LineObjective) -> Result<Option<Optimum>> {
        if !self.solves(objective) {
            return Ok(None);
        }
        let solved = match objective {
            LineObjective::Length => shortest(&self.map, &self.bounds)?,
            LineObjective::LengthSquared => least_squared_length(&self.map, &self.bounds)?,
            LineObjective::Gamma | LineObjective::Kappa2 | LineObjective::LapTime => {
                let spacing = spacing_m(&self.map, &self.reference);
                let mut start = least_gamma(&self.map, &spacing, &self.bounds)?.x;
                if objective == LineObjective::LapTime {
                    start = self.descend(start, only(LineObjective::Kappa2))?.x;
                }
                self.descend(start, only(objective))?
            }
        };
        Ok(Some(solved))
    }

    fn descend(&self, x: Vec<f64>, weights: Weights) -> Result<Optimum> {
        let settings = DescentSettings::default();
        descend(&self.problem(), &self.bounds, &Start { x, weights }, &settings)
    }

    /// Leads lines to the nearest optimum, each by its own weights of the objectives. Lines that no solver can improve on
    /// come back as they are.
    ///
    /// # Errors
    /// [`crate::Error::Study`] if a solver refuses.
    pub fn polish(
        &self,
        lines: Vec<(Vec<f64>, Vec<(LineObjective, f64)>)>,
        programs: usize,
    ) -> Result<Vec<Vec<f64>>> {
        let starts: Vec<Start> = lines
            .into_iter()
            .map(|(x, terms)| Start {
                x,
                weights: weights(terms),
            })
            .collect();
        let settings = DescentSettings {
            programs,
            ..DescentSettings::default()
        };
        let polished = polish_lines(&self.problem(), &self.bounds, &starts, &settings)?;
        Ok(polished.into_iter().map(|p| p.x).collect())
    }
}
