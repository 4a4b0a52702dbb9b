//! The reference optimum of each objective on one track, and the local search by exact gradients.

use super::{
    Bounds, DescentSettings, LineMap, Optimum, PointMassEnvelope, ReferenceProblem, SegmentBend, Start,
    Status, Weights, fastest, least_gamma, least_squared_length, minimum_curvature_of, polish_lines,
    shortest,
};
use crate::error::Result;
use crate::evaluate::line::LineObjective;
use crate::line::{
    CarPlan, FineLine, ON_ROAD_M, PointMass, RoadEdges, Spread, cross_sections_about, fine_m, shares_across,
};
use crate::track::CrossSections;
use glam::DVec2;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The solvers on one track.
///
/// Lines without a lap time have a variable at every cross-section. With one, cross-sections' worth of zigzag between them would
/// pay, so that lines are then a spline's distance from the minimum-curvature line, with three cross-sections for each control
/// point.
#[derive(Clone)]
pub struct ReferenceSolvers {
    cross_sections: CrossSections,
    spacing_m: Vec<f64>,
    every: (LineMap, Bounds),
    smooth: (LineMap, Bounds),
    /// The minimum-curvature line, from which the smooth lines are measured.
    base: Vec<f64>,
    /// How much closer its tightest bend asks [`STAGES`] to be: all lengths in them are this share of what they say.
    fineness: f64,
    envelope: Option<PointMassEnvelope>,
    car: PointMass,
    entry_mps: f64,
    room: Option<Room>,
    stop: Arc<AtomicBool>,
}

/// The road's edges on the right and the left (m), and the car that is to stay between them.
#[derive(Clone)]
struct Room {
    edges_m: [Vec<DVec2>; 2],
    car: CarPlan,
}

/// A line on its fine spline, with its lap and its room on the right and the left (m) at each point; no room where no edges are
/// known.
#[derive(Clone)]
struct Driven {
    fine: FineLine,
    clearances_m: Vec<[f64; 2]>,
}

/// A reference optimum.
#[derive(Clone, Debug)]
pub struct OptimumLine {
    /// Share of the usable width at every cross-section.
    pub alpha: Vec<f64>,
    /// How the solver ended.
    pub status: Status,
    /// [What may be left to gain](Optimum::left), as a share of the objective.
    pub left: f64,
    /// Time taken (s).
    pub seconds: f64,
}

/// A line to be led downhill (`alpha` at every cross-section), and the weight of each objective.
pub type WeightedLine = (Vec<f64>, Vec<(LineObjective, f64)>);

/// A line taken anew about itself: the distance between the cross-sections square to it in bends (m), how many of them there are
/// for each control point, and the most cone programs.
#[derive(Clone, Copy)]
struct About {
    spacing_m: f64,
    cross_sections_per_control: usize,
    programs: usize,
}

impl About {
    /// Distance between control points in bends (m).
    const fn control_m(&self) -> f64 {
        self.spacing_m * self.cross_sections_per_control as f64
    }

    /// One in `every` of the cross-sections.
    fn spread(&self, every: usize) -> Spread {
        let bends_m = self.spacing_m * every as f64;
        Spread::Steps {
            bends_m,
            straights_m: bends_m * STRAIGHTS,
        }
    }
}

/// How the fastest line is taken about another, ever more closely. On five made circuits it is then at most 0.03 % above the best that
/// any of forty such lists has found; without the second it is up to 0.4 % above it.
const STAGES: [About; 3] = [
    About {
        spacing_m: 4.0,
        cross_sections_per_control: 4,
        programs: 4,
    },
    About {
        spacing_m: 2.0,
        cross_sections_per_control: 3,
        programs: 3,
    },
    About {
        spacing_m: 1.25,
        cross_sections_per_control: 4,
        programs: 2,
    },
];
/// How many times farther apart cross-sections are on straights, where lines bend little.
const STRAIGHTS: f64 = 3.0;
/// On laps shorter than this (m), the stages after the first are closer in proportion, down to this share. An error of one bend is a
/// greater part of a short lap.
const SHORT_M: f64 = 1400.0;
const CLOSEST: f64 = 0.7;
/// The stages are as they stand where the tightest bend turns a line by a radian in this length (m) or a greater one. Where one is
/// tighter, as on tracks of karts and of Formula Student, they are closer in proportion, down to this share.
const TIGHT_M: f64 = 12.0;
const FINEST: f64 = 0.2;
/// A control takes as many of the track's own cross-sections at the least. A stage that would bring controls no closer than to this
/// share of their distance is as the one before it.
const CROSS_SECTIONS_TO_SAY_CONTROL: f64 = 1.25;
const CLOSER: f64 = 0.85;
/// How many times as many programs lines in hills take: the first ones lead less far there. On eight circuits with made-up hills laps are
/// up to 0.6 % faster for it, and up to 0.15 % slower.
const PROGRAMS_IN_HILLS: usize = 2;
/// Most programs of a line that is taken about another once.
const PROGRAMS_ONCE: usize = 8;
/// Times that a line is solved anew within narrower bounds where it leaves the road between its points, and the room (m) that the
/// bounds leave there.
const TIGHTENINGS: usize = 6;
const SPARE_M: f64 = 0.001;
/// Most programs of a line that is solved anew within narrower bounds.
const PROGRAMS_TIGHTENED: usize = 2;
/// Share of a lap by which stations of two lines of one road differ at the most.
const NEARBY: f64 = 0.02;
/// Share of a lap below which no cone program is worth its time. Programs that promise less gain a fraction of it: the envelope's
/// kinks between its rows are beyond their models.
const LEAST_GAIN_ABOUT: f64 = 4e-5;
/// Share of a lap that the last stage's programs may still promise. Where they promise more, the line is taken about itself once more
/// before it is brought onto the road.
const LEFT_TO_GAIN: f64 = 5e-4;
/// What a change of lateral acceleration of 1 g within 10 m counts (s). The fastest lines of ten made circuits lose a thousandth of a
/// percent by it.
const ROUGHNESS_S: f64 = 5e-4;

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
        let tightest_m = radian_m(&cross_sections.points(&base), cross_sections.closed);
        Ok(Self {
            fineness: (tightest_m / TIGHT_M).clamp(FINEST, 1.0),
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
            room: None,
            spacing_m,
            cross_sections: cross_sections.clone(),
            stop,
        })
    }

    /// The same for a car that is kept between the road's own edges (m), on the right and the left, at every point of the fastest
    /// lines' fine splines, not at the cross-sections alone.
    #[must_use]
    pub fn kept_between(mut self, edges_m: &[Vec<DVec2>; 2], car: CarPlan) -> Self {
        self.room = Some(Room {
            edges_m: edges_m.clone(),
            car,
        });
        self
    }

    /// The same for another car.
    ///
    /// # Errors
    /// [`crate::Error::Input`] for a car that cannot be.
    pub fn of_car(&self, car: &PointMass) -> Result<Self> {
        Ok(Self {
            envelope: Some(PointMassEnvelope::new(car)?),
            car: car.clone(),
            ..self.clone()
        })
    }

    /// The lap time (s) of a line on its fine spline, and its least clearance (m).
    ///
    /// # Errors
    /// [`crate::Error::Study`] if the line cannot be driven.
    pub fn lap(&self, alpha: &[f64]) -> Result<(f64, f64)> {
        let driven = self.driven(alpha)?;
        let time_s = driven.fine.lap_time_s();
        let time_s = time_s.ok_or_else(|| crate::Error::Study("there is no lap on this line".to_owned()))?;
        Ok((time_s, driven.clearance_m()))
    }

    /// The flag that ends them.
    pub(crate) fn flag(&self) -> &AtomicBool {
        &self.stop
    }

    /// The problem of lines of a map. Only those that have a cross-section for each variable could zigzag from one to the next, which
    /// the mean of both ends' bends would not see.
    fn problem<'a>(&'a self, map: &'a LineMap) -> ReferenceProblem<'a> {
        let bend = if map.variables() < map.points() {
            SegmentBend::Mean
        } else {
            SegmentBend::Tighter
        };
        ReferenceProblem {
            envelope: self.envelope.as_ref().map(|l| l as _),
            bend,
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

    /// The fastest line, `alpha` at every cross-section: about the minimum-curvature line, then ever more closely about itself.
    /// Where no cross-sections square to a line can be cut, as on open roads, across the road's own.
    fn fastest(&self) -> Result<Optimum> {
        if let Some(about) = self.about_itself(&self.base, &self.stages())? {
            return Ok(about);
        }
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
            left: solved.left(),
            alpha: within_road(solved.x),
            status: solved.status,
            seconds: solved.seconds,
        }))
    }

    /// The fastest line near one, as splines about it and across cross-sections square to it: they say more than splines as short
    /// about the minimum-curvature line. Nothing where the road cannot be cut so, or the line is not faster for it on a fine
    /// spline.
    ///
    /// # Errors
    /// [`crate::Error::Study`] if a solver refuses.
    pub fn fastest_about(&self, alpha: &[f64]) -> Result<Option<Optimum>> {
        let stages = self.stages();
        let closest = About {
            programs: PROGRAMS_ONCE,
            ..stages[stages.len() - 1]
        };
        let about = self.about_itself(alpha, &[closest])?;
        Ok(about.map(|solved| Optimum {
            x: within_road(solved.x),
            ..solved
        }))
    }

    /// [`STAGES`] as the track's cross-sections can say them: one that would not be closer is as its predecessor.
    fn stages(&self) -> [About; STAGES.len()] {
        let own_m = self.cross_sections.length_m / self.cross_sections.len() as f64;
        let mut stages = STAGES.map(|stage| About {
            spacing_m: self.fineness * stage.spacing_m,
            ..stage
        });
        let closer = (self.cross_sections.length_m / (self.fineness * SHORT_M)).clamp(CLOSEST, 1.0);
        for turn in 1..stages.len() {
            let (before, stage) = (stages[turn - 1], &mut stages[turn]);
            stage.spacing_m *= closer;
            let needed = (CROSS_SECTIONS_TO_SAY_CONTROL * own_m / stage.spacing_m).ceil() as usize;
            stage.cross_sections_per_control = stage.cross_sections_per_control.max(needed);
            if stage.control_m() > CLOSER * before.control_m() {
                let programs = stage.programs;
                *stage = About { programs, ..before };
            }
        }
        stages
    }

    /// The fastest line near one, stage by stage, the last once more where it [left more to gain](LEFT_TO_GAIN). Only what that finds
    /// has to be on the road.
    fn about_itself(&self, alpha: &[f64], stages: &[About]) -> Result<Option<Optimum>> {
        if self.envelope.is_none() {
            return Ok(None);
        }
        let mut found: Option<Optimum> = None;
        let last = stages.len() - 1;
        let open = stages[..last].iter().map(|how| (how, -1.0));
        let kept = [LEFT_TO_GAIN, f64::INFINITY].map(|most_left| (&stages[last], most_left));
        for (how, most_left) in open.chain(kept) {
            if self.stop.load(Ordering::Relaxed) {
                break;
            }
            let alpha = found.as_ref().map_or(alpha, |f| &f.x);
            let (closer, kept) = self.taken_about(alpha, how, most_left)?;
            if let Some(closer) = closer {
                let before_s = found.as_ref().map_or(0.0, |f| f.seconds);
                found = Some(Optimum {
                    seconds: before_s + closer.seconds,
                    ..closer
                });
            }
            if kept {
                break;
            }
        }
        Ok(found)
    }

    /// The fastest line about one, if it is faster, and whether it was to be kept on the road: where the programs promise at most
    /// `most_left` more, as a share of the lap. A line on the road is then better than any other.
    fn taken_about(&self, alpha: &[f64], how: &About, most_left: f64) -> Result<(Option<Optimum>, bool)> {
        let own = self.cross_sections.points(alpha);
        // A closed spline through as many points of the line as there are controls has no ripples that these could not take off. A
        // line that touches jagged edges has, and a lap on the fine spline suffers from every one.
        let road = &self.cross_sections;
        let few = cross_sections_about(road, &own, how.spread(how.cross_sections_per_control));
        let about =
            few.and_then(|few| cross_sections_about(road, &few.points(&few.reference), how.spread(1)));
        let Ok(about) = about else {
            return Ok((None, false));
        };
        let controls = (about.len() / how.cross_sections_per_control).max(4);
        let (map, mut bounds) = LineMap::spline_about(&about, &about.reference, controls);
        let problem = ReferenceProblem {
            spacing_m: None,
            ..self.problem(&map)
        };
        let start = vec![0.0; map.variables()];
        let hilly = road.relief.as_ref().is_some_and(|relief| !relief.is_level());
        // Where the cross-sections are so far apart that no such spline is on the road, the line stays as it is.
        let settings = DescentSettings {
            least_gain: LEAST_GAIN_ABOUT,
            programs: how.programs * if hilly { PROGRAMS_IN_HILLS } else { 1 },
            roughness_s: self.fineness.powf(1.5) * ROUGHNESS_S,
            ..DescentSettings::default()
        };
        let tightening = DescentSettings {
            programs: PROGRAMS_TIGHTENED,
            ..settings
        };
        let Ok(mut solved) = fastest(&problem, &bounds, &start, &settings) else {
            return Ok((None, false));
        };
        let kept = solved.left() <= most_left;
        let before = self.driven(alpha)?;
        let mut best: Option<(Vec<f64>, Driven)> = None;
        let rounds = if kept { TIGHTENINGS } else { 0 };
        for round in 0..=rounds {
            let points = map.line(&solved.x);
            let Ok(x) = shares_across(&self.cross_sections, &points) else {
                break;
            };
            let driven = self.driven(&x)?;
            if best
                .as_ref()
                .is_none_or(|(_, best)| driven.rank(kept) < best.rank(kept))
            {
                best = Some((x, driven.clone()));
            }
            if driven.clearance_m() >= 0.0 || round == rounds {
                break;
            }
            driven.tighten((&about, &points), &solved.x, &mut bounds);
            let Ok(tightened) = fastest(&problem, &bounds, &solved.x, &tightening) else {
                break;
            };
            solved = Optimum {
                programs: solved.programs + tightened.programs,
                iterations: solved.iterations + tightened.iterations,
                seconds: solved.seconds + tightened.seconds,
                ..tightened
            };
        }
        let better = best.filter(|(_, driven)| driven.rank(kept) < before.rank(kept));
        Ok((better.map(|(x, _)| Optimum { x, ..solved }), kept))
    }

    /// A line through the cross-sections, as it is driven.
    fn driven(&self, alpha: &[f64]) -> Result<Driven> {
        let points = self.cross_sections.points(alpha);
        let fine = FineLine::on(
            &points,
            self.cross_sections.relief_of(&points).as_deref(),
            self.cross_sections.closed,
            fine_m(self.cross_sections.length_m),
            Some((&self.car, &self.cross_sections.drs)),
            self.entry_mps,
        )?;
        let mut clearances_m = self.room.as_ref().map_or_else(Vec::new, |room| {
            RoadEdges::new(&room.edges_m[0], &room.edges_m[1], fine.closed).clearances(&fine, &room.car)
        });
        // A line beyond the end of a cross-section has no room there: held at the end, it would have a kink.
        let road = &self.cross_sections;
        for (room_m, &(section, share)) in clearances_m.iter_mut().zip(&fine.section) {
            let inside = [alpha[section], 1.0 - alpha[section]];
            for (room_m, inside) in room_m.iter_mut().zip(inside) {
                if share == 0.0 && inside < 0.0 {
                    *room_m = room_m.min(inside * road.left_m[section].distance(road.right_m[section]));
                }
            }
        }
        Ok(Driven { fine, clearances_m })
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

    /// Leads lines to the nearest optimum, each by its own weights of the objectives.
    ///
    /// # Errors
    /// [`crate::Error::Study`] if a solver refuses.
    pub fn polish(&self, lines: Vec<WeightedLine>, settings: &DescentSettings) -> Result<Vec<Vec<f64>>> {
        let timed = lines
            .iter()
            .flat_map(|(_, terms)| terms)
            .any(|(o, w)| *o == LineObjective::LapTime && *w > 0.0);
        let (map, bounds) = if timed { &self.smooth } else { &self.every };
        let starts: Vec<Start> = lines
            .into_iter()
            .map(|(alpha, terms)| Start {
                x: if timed { self.offsets(&alpha) } else { alpha },
                weights: self.weights(terms),
            })
            .collect();
        let polished = polish_lines(&self.problem(map), bounds, &starts, settings)?;
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

impl Driven {
    fn clearance_m(&self) -> f64 {
        let least = self.clearances_m.iter().flatten();
        least.copied().fold(f64::INFINITY, f64::min)
    }

    /// Fast lines come first; of those that are `kept`, lines on the road, then those that count as on it.
    fn rank(&self, kept: bool) -> (bool, bool, f64) {
        let (clearance_m, time_s) = (self.clearance_m(), self.fine.lap_time_s());
        (
            kept && clearance_m < -ON_ROAD_M,
            kept && clearance_m < 0.0,
            time_s.unwrap_or(f64::INFINITY),
        )
    }

    /// Narrows the bounds of a line's points (m) at `x` where the line is short of room: there it has to move by what it lacks.
    fn tighten(&self, (about, points_m): (&CrossSections, &[DVec2]), x: &[f64], bounds: &mut Bounds) {
        let n = points_m.len();
        let abreast = |i: usize| {
            let station_m = self.fine.station_m[i] / self.fine.length_m * about.length_m;
            let guess = about.station_m.partition_point(|s| *s < station_m);
            let reach = (NEARBY * n as f64).ceil() as usize;
            let near = (guess + n - reach.min(n / 2)..=guess + n + reach.min(n / 2)).map(|j| j % n);
            let distance = |j: &usize| points_m[*j].distance_squared(self.fine.points_m[i]);
            near.min_by(|a, b| distance(a).total_cmp(&distance(b)))
                .unwrap_or(guess)
        };
        let mut short = vec![[0.0f64; 2]; n];
        for (i, room_m) in self.clearances_m.iter().enumerate() {
            for side in [0, 1] {
                if room_m[side] < 0.0 {
                    let at = abreast(i);
                    for j in [at + n - 1, at, at + 1] {
                        let short = &mut short[j % n][side];
                        *short = short.max(SPARE_M - room_m[side]);
                    }
                }
            }
        }
        for (row, [right, left]) in bounds.rows.iter_mut().zip(short) {
            let (here, middle) = (row.at(x), 0.5 * (row.lower + row.upper));
            if right > 0.0 {
                row.lower = row.lower.max((here + right).min(middle));
            }
            if left > 0.0 {
                row.upper = row.upper.min((here - left).max(middle));
            }
        }
    }
}

/// The shortest stretch in which a line turns by a radian (m); infinite where it does so nowhere.
fn radian_m(points_m: &[DVec2], closed: bool) -> f64 {
    let n = points_m.len();
    let segments = n - usize::from(!closed);
    let step = |s: usize| points_m[(s + 1) % n] - points_m[s % n];
    let mut least_m = f64::INFINITY;
    for first in 0..segments {
        let (mut turned_rad, mut length_m) = (0.0f64, 0.5 * step(first).length());
        let last = if closed { first + segments } else { segments };
        for s in first + 1..last {
            turned_rad += step(s - 1).angle_to(step(s));
            length_m += 0.5 * (step(s - 1).length() + step(s).length());
            if length_m >= least_m || turned_rad.abs() >= 1.0 {
                break;
            }
        }
        if turned_rad.abs() >= 1.0 {
            least_m = least_m.min(length_m);
        }
    }
    least_m
}

/// Shares of the usable width, none beyond its ends.
pub(crate) fn within_road(shares: Vec<f64>) -> Vec<f64> {
    shares.into_iter().map(|share| share.clamp(0.0, 1.0)).collect()
}
