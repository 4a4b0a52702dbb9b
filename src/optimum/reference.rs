//! The reference optimum of each objective on one track, and the local search by exact gradients.

use super::{
    Bounds, DescentSettings, LineMap, Optimum, PointMassEnvelope, ReferenceProblem, Start, Status, Weights,
    fastest, least_gamma, least_squared_length, minimum_curvature_of, polish_lines, shortest,
};
use crate::error::Result;
use crate::evaluate::line::LineObjective;
use crate::line::{FINE_M, FineLine, PointMass, cross_sections_about, shares_across};
use crate::track::CrossSections;
use glam::DVec2;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The solvers on one track.
///
/// Lines without a lap time have a variable at every cross-section. With one, cross-sections' worth of zigzag between them would
/// pay, so that lines are then a spline's distance from the minimum-curvature line, with three cross-sections for each control
/// point.
pub struct ReferenceSolvers {
    cross_sections: CrossSections,
    spacing_m: Vec<f64>,
    every: (LineMap, Bounds),
    smooth: (LineMap, Bounds),
    /// The minimum-curvature line, from which the smooth lines are measured.
    base: Vec<f64>,
    envelope: Option<PointMassEnvelope>,
    car: PointMass,
    entry_mps: f64,
    stop: Arc<AtomicBool>,
}

/// A reference optimum.
#[derive(Clone, Debug)]
pub struct OptimumLine {
    /// Share of the usable width at every cross-section.
    pub alpha: Vec<f64>,
    /// How the solver ended.
    pub status: Status,
    /// Time taken (s).
    pub seconds: f64,
}

/// A line to be led downhill (`alpha` at every cross-section), and the weight of each objective.
pub type WeightedLine = (Vec<f64>, Vec<(LineObjective, f64)>);

/// A line taken anew about itself: the distance between the cross-sections square to it (m), and how many of them there are for
/// each control point.
struct About {
    spacing_m: f64,
    cross_sections_per_control: usize,
}

impl About {
    /// Distance between control points (m).
    const fn control_m(&self) -> f64 {
        self.spacing_m * self.cross_sections_per_control as f64
    }
}

/// At 4 m a lap's time is that on a fine spline to a few parts in ten thousand.
const ABOUT: About = About {
    spacing_m: 4.0,
    cross_sections_per_control: 4,
};
/// A thousandth of a lap better, at several times the cost: cross-sections ever closer together (m), with a control for as many
/// of them as the track's own cross-sections can say, [`CROSS_SECTIONS_TO_SAY_CONTROL`] each; where controls come closer by a
/// quarter at least.
const CLOSELY_M: [f64; 2] = [2.0, 1.0];
const CLOSER: f64 = 0.75;
const CROSS_SECTIONS_TO_SAY_CONTROL: f64 = 1.4;
/// Share of a lap below which no cone program is worth its second: a hundredth of what lies between two cross-sections.
const LEAST_GAIN_ABOUT: f64 = 1e-5;
/// Times that the fastest line is taken anew about itself.
const ABOUTS: usize = 2;

/// With two, ripples are left between the cross-sections that their lap time does not feel and a fine spline does.
const CROSS_SECTIONS_PER_CONTROL: usize = 3;

/// What the solvers know of an objective: its weight where lines are led downhill, and its optimum.
type Solver = (
    fn(&mut Weights) -> &mut f64,
    fn(&ReferenceSolvers) -> Result<Optimum>,
);

impl ReferenceSolvers {
    /// The solvers of lines through these cross-sections by `car`, which enters an open road at `entry_mps` (m/s) at the most. Lap
    /// times are theirs only on a friction ellipse of exponent 2.
    ///
    /// # Errors
    /// [`crate::Error::Input`] for a car that cannot be; [`crate::Error::Study`] if the minimum-curvature line is refused.
    pub fn new(cross_sections: &CrossSections, car: &PointMass, entry_mps: f64) -> Result<Self> {
        Self::stopped_by(cross_sections, car, entry_mps, Arc::default())
    }

    /// As [`ReferenceSolvers::new`], ended by the flag: what they say once it is raised is no optimum.
    ///
    /// # Errors
    /// As [`ReferenceSolvers::new`].
    pub fn stopped_by(
        cross_sections: &CrossSections,
        car: &PointMass,
        entry_mps: f64,
        stop: Arc<AtomicBool>,
    ) -> Result<Self> {
        let map = LineMap::at_every_cross_section(cross_sections);
        let bounds = Bounds::road(cross_sections.len());
        let spacing_m = cross_sections.spacing_m();
        let start = least_gamma(&map, &spacing_m, &bounds)?.x;
        let curvature = ReferenceProblem {
            stop: Some(&stop),
            ..ReferenceProblem::of(&map)
        };
        let base = minimum_curvature_of(&curvature, &bounds, &start)?.x;
        let controls = (cross_sections.len() / CROSS_SECTIONS_PER_CONTROL).max(4);
        Ok(Self {
            smooth: LineMap::spline_about(cross_sections, &base, controls),
            every: (map, bounds),
            base,
            envelope: if car.ellipse_exponent == 2.0 {
                Some(PointMassEnvelope::new(car)?)
            } else {
                None
            },
            car: car.clone(),
            entry_mps,
            spacing_m,
            cross_sections: cross_sections.clone(),
            stop,
        })
    }

    /// The flag that ends them.
    pub(crate) fn flag(&self) -> &AtomicBool {
        &self.stop
    }

    fn problem<'a>(&'a self, map: &'a LineMap) -> ReferenceProblem<'a> {
        ReferenceProblem {
            envelope: self.envelope.as_ref().map(|l| l as _),
            start_mps: self.entry_mps,
            spacing_m: Some(&self.spacing_m),
            stop: Some(&self.stop),
            ..ReferenceProblem::of(map)
        }
    }

    /// The solver of an objective; nothing where there is none for it.
    ///
    /// Length, squared length and Gamma are convex, so that theirs is the optimum. Curvature and lap time are led
    /// downhill, the latter from the minimum-curvature line; starts all over the road lead to the same.
    fn solver(&self, objective: LineObjective) -> Option<Solver> {
        let solver: Solver = match objective {
            LineObjective::Length => (|w| &mut w.length, |s| shortest(&s.every.0, &s.every.1)),
            LineObjective::LengthSquared => (
                |w| &mut w.squared_length,
                |s| least_squared_length(&s.every.0, &s.every.1),
            ),
            LineObjective::Gamma => (
                |w| &mut w.gamma,
                |s| least_gamma(&s.every.0, &s.spacing_m, &s.every.1),
            ),
            LineObjective::Kappa2 => (
                |w| &mut w.curvature,
                |s| minimum_curvature_of(&s.problem(&s.every.0), &s.every.1, &s.base),
            ),
            LineObjective::LapTime if self.envelope.is_none() => return None,
            LineObjective::LapTime => (|w| &mut w.time, Self::fastest),
        };
        Some(solver)
    }

    /// The fastest line, `alpha` at every cross-section.
    fn fastest(&self) -> Result<Optimum> {
        let (map, bounds) = &self.smooth;
        let start = vec![0.0; map.variables()];
        let solved = fastest(&self.problem(map), bounds, &start, &DescentSettings::default())?;
        Ok(Optimum {
            x: self.shares(map, &solved.x),
            ..solved
        })
    }

    /// Whether there is a solver for this objective.
    pub fn solves(&self, objective: LineObjective) -> bool {
        self.solver(objective).is_some()
    }

    /// The line that is best by one objective; nothing where there is no solver for it.
    ///
    /// # Errors
    /// [`crate::Error::Study`] if a solver refuses.
    pub fn best(&self, objective: LineObjective) -> Result<Option<OptimumLine>> {
        let Some((_, solve)) = self.solver(objective) else {
            return Ok(None);
        };
        let solved = solve(self)?;
        Ok(Some(OptimumLine {
            alpha: within_road(solved.x),
            status: solved.status,
            seconds: solved.seconds,
        }))
    }

    /// As [`ReferenceSolvers::best`], and the fastest line taken anew about itself while it gains by that, which is the reference
    /// that swarms are held against.
    ///
    /// # Errors
    /// As [`ReferenceSolvers::best`].
    pub fn reference(&self, objective: LineObjective) -> Result<Option<OptimumLine>> {
        let mut best = self.best(objective)?;
        if objective == LineObjective::LapTime
            && let Some(line) = &mut best
            && let Some(about) = self.about_itself(&line.alpha, ABOUTS)?
        {
            line.seconds += about.seconds;
            (line.alpha, line.status) = (about.x, about.status);
        }
        Ok(best)
    }

    /// The fastest line near one, as splines about it and across cross-sections square to it: they say more than splines as short
    /// about the minimum-curvature line. Nothing where the road cannot be cut so, or the line is not faster for it on a fine
    /// spline.
    ///
    /// # Errors
    /// [`crate::Error::Study`] if a solver refuses.
    pub fn fastest_about(&self, alpha: &[f64]) -> Result<Option<Optimum>> {
        self.about_itself(alpha, 1)
    }

    /// The same, at first `abouts` times.
    fn about_itself(&self, alpha: &[f64], abouts: usize) -> Result<Option<Optimum>> {
        let Some(envelope) = &self.envelope else {
            return Ok(None);
        };
        let own_m = self.cross_sections.length_m / self.cross_sections.len() as f64;
        let mut control_m = CLOSER * ABOUT.control_m();
        let closely = CLOSELY_M.into_iter().filter_map(|spacing_m| {
            let needed = (CROSS_SECTIONS_TO_SAY_CONTROL * own_m / spacing_m).ceil() as usize;
            let how = About {
                spacing_m,
                cross_sections_per_control: needed.max(CROSS_SECTIONS_PER_CONTROL),
            };
            let closer = how.control_m() <= control_m;
            if closer {
                control_m = CLOSER * how.control_m();
            }
            closer.then_some(how)
        });
        let mut found: Option<Optimum> = None;
        let mut closer = |how: &About| -> Result<bool> {
            if self.stop.load(Ordering::Relaxed) {
                return Ok(false);
            }
            let alpha = found.as_ref().map_or(alpha, |f| &f.x);
            let Some(closer) = self.taken_about(envelope, alpha, how)? else {
                return Ok(false);
            };
            let before_s = found.as_ref().map_or(0.0, |f| f.seconds);
            found = Some(Optimum {
                seconds: before_s + closer.seconds,
                ..closer
            });
            Ok(true)
        };
        // The same again, from the same line, would come to the same.
        for _ in 0..abouts {
            if !closer(&ABOUT)? {
                break;
            }
        }
        for how in closely {
            closer(&how)?;
        }
        Ok(found)
    }

    fn taken_about(
        &self,
        envelope: &PointMassEnvelope,
        alpha: &[f64],
        how: &About,
    ) -> Result<Option<Optimum>> {
        let own = self.cross_sections.points(alpha);
        let count =
            ((self.cross_sections.length_m / how.spacing_m).ceil() as usize).max(self.cross_sections.len());
        let Ok(about) = cross_sections_about(&self.cross_sections, &own, count) else {
            return Ok(None);
        };
        let controls = (about.len() / how.cross_sections_per_control).max(4);
        let (map, bounds) = LineMap::spline_about(&about, &about.reference, controls);
        let problem = ReferenceProblem {
            envelope: Some(envelope),
            start_mps: self.entry_mps,
            stop: Some(&self.stop),
            ..ReferenceProblem::of(&map)
        };
        let start = vec![0.0; map.variables()];
        // Where the cross-sections are so far apart that no such spline is on the road, the line stays as it is.
        let settings = DescentSettings {
            least_gain: LEAST_GAIN_ABOUT,
            ..DescentSettings::default()
        };
        let Ok(solved) = fastest(&problem, &bounds, &start, &settings) else {
            return Ok(None);
        };
        let Ok(shares) = shares_across(&self.cross_sections, &map.line(&solved.x)) else {
            return Ok(None);
        };
        let x = within_road(shares);
        let time = |points: &[DVec2]| -> Result<Option<f64>> {
            let fine = FineLine::new(points, true, FINE_M, Some(&self.car), self.entry_mps)?;
            Ok(fine.lap_time_s())
        };
        let faster = time(&self.cross_sections.points(&x))? < time(&own)?;
        Ok(faster.then_some(Optimum { x, ..solved }))
    }

    /// `alpha` at every cross-section of a line of `map`.
    fn shares(&self, map: &LineMap, x: &[f64]) -> Vec<f64> {
        let points = map.line(x);
        let ends = self
            .cross_sections
            .right_m
            .iter()
            .zip(&self.cross_sections.left_m);
        points
            .iter()
            .zip(ends)
            .map(|(point, (right, left))| {
                let across = *left - *right;
                (*point - *right).dot(across) / across.length_squared()
            })
            .collect()
    }

    /// Leads lines to the nearest optimum, each by its own weights of the objectives, in `programs` cone programs at most.
    ///
    /// # Errors
    /// [`crate::Error::Study`] if a solver refuses.
    pub fn polish(&self, lines: Vec<WeightedLine>, programs: usize) -> Result<Vec<Vec<f64>>> {
        let timed = lines
            .iter()
            .flat_map(|(_, terms)| terms)
            .any(|(o, w)| *o == LineObjective::LapTime && *w > 0.0);
        let (map, bounds) = if timed { &self.smooth } else { &self.every };
        let settings = DescentSettings {
            programs,
            ..DescentSettings::default()
        };
        let starts: Vec<Start> = lines
            .into_iter()
            .map(|(alpha, terms)| Start {
                x: if timed { self.offsets(&alpha) } else { alpha },
                weights: self.weights(terms),
            })
            .collect();
        let polished = polish_lines(&self.problem(map), bounds, &starts, &settings)?;
        let alpha = |p: Optimum| within_road(self.shares(map, &p.x));
        Ok(polished.into_iter().map(alpha).collect())
    }

    fn weights(&self, terms: Vec<(LineObjective, f64)>) -> Weights {
        let mut weights = Weights::default();
        for (objective, share) in terms {
            if let Some((weight, _)) = self.solver(objective) {
                *weight(&mut weights) = share;
            }
        }
        weights
    }

    /// Control points (m) of a smooth line near `alpha`: its distances from the base where they stand.
    fn offsets(&self, alpha: &[f64]) -> Vec<f64> {
        let (n, controls) = (self.cross_sections.len(), self.smooth.0.variables());
        (0..controls)
            .map(|k| {
                let i = (k * n / controls).min(n - 1);
                (alpha[i] - self.base[i])
                    * self.cross_sections.left_m[i].distance(self.cross_sections.right_m[i])
            })
            .collect()
    }
}

/// Shares of the usable width, none beyond its ends.
pub(crate) fn within_road(shares: Vec<f64>) -> Vec<f64> {
    shares.into_iter().map(|share| share.clamp(0.0, 1.0)).collect()
}
