//! NSGA-III: a genetic algorithm for three objectives and more, whose members spread along directions given before.
//!
//! Deb, Jain, *An evolutionary many-objective optimization algorithm using reference-point-based nondominated sorting
//! approach, part I*, and Jain, Deb, *part II: handling constraints*, IEEE TEC 18 (2014). Directions as in Das, Dennis,
//! *Normal-boundary intersection*, SIAM J. Optimization 8 (1998). Ranges where no plane goes through the extremes as in
//! Blank, Deb, Roy, *Investigating the normalization procedure of NSGA-III*, EMO 2019.

use super::checkpoint::to_bytes;
use super::genetic::{Breeding, Generation, Member, fronts};
use super::lattice::lattice;
use super::motion::Purpose;
use super::{Counters, Front, Optimiser};
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Settings of [`Nsga3`]; the defaults are those of the paper for three objectives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Nsga3Settings {
    /// Members of the population, an even number. There are at most as many directions: see [`Nsga3::new`].
    pub population: usize,
    /// Generations, the first random one counted.
    pub iterations: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Distribution index of the crossover: the greater, the nearer children are to their parents.
    pub crossover_index: f64,
    /// Distribution index of the polynomial mutation, which changes a variable with probability one over their
    /// number.
    pub mutation_index: f64,
}

impl Default for Nsga3Settings {
    fn default() -> Self {
        Self {
            population: 92,
            iterations: 250,
            seed: 1,
            crossover_index: 30.0,
            mutation_index: 20.0,
        }
    }
}

impl Nsga3Settings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        self.breeding().check(self.population, self.iterations)
    }

    fn breeding(&self) -> Breeding {
        Breeding {
            crossover: 1.0,
            crossover_index: self.crossover_index,
            mutation_index: self.mutation_index,
        }
    }
}

/// The population, the children it has been asked for, and the scale of the front so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Nsga3 {
    settings: Nsga3Settings,
    generation: Generation,
    scale: FrontScale,
}

impl Nsga3 {
    /// A population over the variables of `problem`. Its directions are all those whose parts are multiples of one over a
    /// whole number, as fine as the population has room for. Where none of them would have a part in every objective, a
    /// second layer of directions lies half-way to the middle.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range.
    pub fn new(problem: &Problem, settings: Nsga3Settings) -> Result<Self> {
        settings.validate()?;
        Ok(Self {
            generation: Generation::first(problem, settings.population, settings.seed)?,
            scale: FrontScale::default(),
            settings,
        })
    }

    /// Puts the first members at these candidates (in the variables' units), before the first population is asked for.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming a candidate that is no finite value for each variable.
    pub fn start_from(&mut self, candidates: &[Vec<f64>]) -> Result<()> {
        self.generation.start_from(candidates)
    }

    /// The members of the next generation; `fronts` are whole fronts, of which the last may not fit.
    fn survivors(&mut self, all: &[Member], mut fronts: Vec<Vec<usize>>) -> Vec<usize> {
        let violation = all[fronts[0][0]].violation;
        let alike = |front: &&Vec<usize>| all[front[0]].violation == violation;
        let rows = |fronts: &[Vec<usize>]| -> Vec<&[f64]> {
            let members = fronts.iter().filter(alike).flatten();
            members.map(|&i| all[i].objectives.as_slice()).collect()
        };
        let (whole, first) = (rows(&fronts), rows(&fronts[..1]));
        if violation.is_finite() {
            self.scale.update(violation, &whole);
        }
        let last = fronts.pop().unwrap_or_default();
        let mut kept: Vec<usize> = fronts.concat();
        let room = self.settings.population - kept.len();
        // What violates more, or failed, has no place on the front's scale.
        if last.len() <= room || !violation.is_finite() || !alike(&&last) {
            kept.extend(last.into_iter().take(room));
            return kept;
        }
        let directions = directions(self.generation.objectives, self.settings.population);
        let ranges = self.scale.ranges(&first, &whole);
        let nearest = |i: usize| {
            let place = self.scale.place(&all[i].objectives, &ranges);
            nearest(&directions, &place)
        };
        let mut crowd = vec![0_usize; directions.len()];
        for &i in &kept {
            crowd[nearest(i).0] += 1;
        }
        let mut waiting: Vec<Vec<(usize, f64)>> = vec![Vec::new(); directions.len()];
        for i in last {
            let (direction, distance) = nearest(i);
            waiting[direction].push((i, distance));
        }
        let when = self.generation.counters.iteration as u32;
        for pick in 0..room as u32 {
            let draw = |bound: usize, index| {
                let random = self.generation.random;
                random.below(bound, Purpose::Niche as u32, when, pick, index)
            };
            let mut open: Vec<usize> = (0..directions.len())
                .filter(|&k| !waiting[k].is_empty())
                .collect();
            let Some(least) = open.iter().map(|&k| crowd[k]).min() else {
                break;
            };
            open.retain(|&k| crowd[k] == least);
            let niche = open[draw(open.len(), 0)];
            let candidates = &mut waiting[niche];
            let by_distance = |a: &usize, b: &usize| candidates[*a].1.total_cmp(&candidates[*b].1);
            let chosen = match least {
                0 => (0..candidates.len()).min_by(by_distance).unwrap_or(0),
                _ => draw(candidates.len(), 1),
            };
            kept.push(candidates.swap_remove(chosen).0);
            crowd[niche] += 1;
        }
        kept
    }
}

/// From where and how far the front reaches in each objective, as far as it is known.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct FrontScale {
    /// By how much those violate the constraints that it is made of.
    violation: f64,
    /// The least value of each objective.
    ideal: Vec<f64>,
    /// For each objective, the point that is worst in it and good in all others.
    extremes: Vec<Vec<f64>>,
}

impl Default for FrontScale {
    fn default() -> Self {
        Self {
            violation: f64::INFINITY,
            ideal: Vec::new(),
            extremes: Vec::new(),
        }
    }
}

/// Share of the front's range up to which a point counts as on an axis.
const ON_AXIS: f64 = 1e-3;

impl FrontScale {
    /// Learns from points that violate the constraints by so much.
    fn update(&mut self, violation: f64, points: &[&[f64]]) {
        if violation < self.violation {
            *self = Self {
                violation,
                ..Self::default()
            };
        }
        let width = points[0].len();
        self.ideal.resize(width, f64::INFINITY);
        for point in points {
            for (least, x) in self.ideal.iter_mut().zip(*point) {
                *least = least.min(*x);
            }
        }
        let known = self
            .extremes
            .iter()
            .map(Vec::as_slice)
            .chain(points.iter().copied());
        let known: Vec<&[f64]> = known.collect();
        let span = |k: usize| known.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) - self.ideal[k];
        let spans: Vec<f64> = (0..width).map(span).collect();
        // How far a point is off the axis of an objective counts for much more than how far along. Objectives count alike,
        // whatever their units. Very little counts as none, as in pymoo: else a point of the first
        // generations that is closest to the axis and far from the front would stay for good.
        let off = |point: &[f64], axis: usize| {
            let share = |k: usize| match (point[k] - self.ideal[k]) / spans[k] {
                share if share >= ON_AXIS => share,
                _ => 0.0,
            };
            let weight = |k: usize| if k == axis { 1.0 } else { 1e6 };
            (0..width).map(|k| weight(k) * share(k)).fold(0.0, f64::max)
        };
        self.extremes = (0..width)
            .filter_map(|k| known.iter().min_by(|a, b| off(a, k).total_cmp(&off(b, k))))
            .map(|point| point.to_vec())
            .collect();
    }

    /// How far the front reaches in each objective: to where the plane through the extremes meets its axis, but no further
    /// than `all` do; where there is no such plane, as far as the first front. An objective that does not vary counts as it
    /// is.
    fn ranges(&self, first: &[&[f64]], all: &[&[f64]]) -> Vec<f64> {
        let reach = |points: &[&[f64]], k: usize| {
            let most = points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
            most - self.ideal[k]
        };
        let width = self.ideal.len();
        let whole: Vec<f64> = (0..width).map(|k| reach(all, k)).collect();
        let rows = self.extremes.iter().map(|point| {
            let shares = point.iter().zip(&self.ideal).zip(&whole);
            shares.map(|((x, least), whole)| (x - least) / whole).collect()
        });
        let range = |(k, share): (usize, Option<f64>)| {
            let range = match share {
                Some(share) => share.min(1.0) * whole[k],
                None => reach(first, k),
            };
            [range, whole[k]]
                .into_iter()
                .find(|r| *r > 0.0 && r.is_finite())
                .unwrap_or(1.0)
        };
        match intercepts(&rows.collect::<Vec<Vec<f64>>>()) {
            Some(shares) => shares.into_iter().map(Some).enumerate().map(range).collect(),
            None => (0..width).map(|k| range((k, None))).collect(),
        }
    }

    /// A point on the scale.
    fn place(&self, point: &[f64], ranges: &[f64]) -> Vec<f64> {
        let figures = point.iter().zip(&self.ideal).zip(ranges);
        figures.map(|((x, least), range)| (x - least) / range).collect()
    }
}

/// Where the plane through as many points as there are coordinates meets the axes; `None` unless it meets all of them above
/// zero.
fn intercepts(rows: &[Vec<f64>]) -> Option<Vec<f64>> {
    let n = rows.len();
    let points = DMatrix::from_fn(n, n, |i, k| rows[i][k]);
    let normal = points.lu().solve(&DVector::from_element(n, 1.0))?;
    let meets: Vec<f64> = normal.iter().map(|x| 1.0 / x).collect();
    meets.iter().all(|x| *x > 0.0 && x.is_finite()).then_some(meets)
}

/// The direction nearest to a point, and the square of their distance.
fn nearest(directions: &[Vec<f64>], point: &[f64]) -> (usize, f64) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let square = dot(point, point);
    let away = |direction: &Vec<f64>| square - dot(direction, point).powi(2);
    let distances = directions.iter().map(away).enumerate();
    distances
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, square))
}

/// Directions of length one in so many objectives: at most `most` of them, but one for each objective at least.
fn directions(objectives: usize, most: usize) -> Vec<Vec<f64>> {
    let finest = |room: usize| {
        (1..=room)
            .take_while(move |&parts| count(objectives, parts) <= room)
            .last()
    };
    if objectives == 1 {
        return vec![vec![1.0]];
    }
    let outer = finest(most).unwrap_or(1);
    let mut all = lattice(objectives, outer as u32);
    if outer < objectives
        && let Some(inner) = finest(most.saturating_sub(all.len()))
    {
        let middle = 1.0 / objectives as f64;
        let nearer = |row: Vec<f64>| -> Vec<f64> { row.into_iter().map(|x| 0.5 * (x + middle)).collect() };
        all.extend(
            lattice(objectives, inner.min(outer) as u32)
                .into_iter()
                .map(nearer),
        );
    }
    for row in &mut all {
        let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        row.iter_mut().for_each(|x| *x /= length);
    }
    all
}

/// How many points [`lattice`] has.
fn count(objectives: usize, parts: usize) -> usize {
    (1..objectives).fold(1_usize, |found, k| found.saturating_mul(parts + k) / k)
}

/// Whether `b` is better than `a`. All that are left are equally good by their fronts; only constraints tell.
fn better(a: &Member, b: &Member) -> bool {
    b.violation < a.violation
}

impl Optimiser for Nsga3 {
    fn ask(&mut self) -> Vec<f64> {
        self.generation.candidates()
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        let mut all = self.generation.everyone(evaluation)?;
        let mut whole = fronts(&all);
        let mut members = 0;
        let before = |front: &Vec<usize>| {
            let starts = members;
            members += front.len();
            starts < self.settings.population
        };
        let count = whole.iter().map(before).take_while(|fits| *fits).count();
        whole.truncate(count);
        for (rank, front) in whole.iter().enumerate() {
            front.iter().for_each(|&i| all[i].rank = rank);
        }
        let kept = self.survivors(&all, whole);
        self.generation
            .succeed(all, kept, self.settings.breeding(), |g| g.in_turn(better));
        Ok(())
    }

    fn counters(&self) -> Counters {
        self.generation.counters
    }

    fn to_checkpoint(&self) -> Result<Vec<u8>> {
        to_bytes(self)
    }

    fn planned_iterations(&self) -> usize {
        self.settings.iterations
    }

    fn best(&self) -> Vec<f64> {
        self.generation.best()
    }

    fn violation(&self) -> f64 {
        self.generation.violation()
    }

    fn front(&self) -> Front {
        self.generation.front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The paper's table of populations: 3, 5, 8, 10 and 15 objectives.
    #[test]
    fn directions_of_the_paper() {
        for (objectives, population, found) in [
            (3, 92, 91),
            (5, 212, 210),
            (8, 156, 156),
            (10, 276, 275),
            (15, 136, 135),
            (2, 100, 100),
            (1, 10, 1),
            (6, 4, 6),
        ] {
            let all = directions(objectives, population);
            assert_eq!(all.len(), found, "{objectives} objectives");
            for (i, row) in all.iter().enumerate() {
                let square: f64 = row.iter().map(|x| x * x).sum();
                assert!((square - 1.0).abs() < 1e-14 && row.iter().all(|x| *x >= 0.0));
                let apart = |other: &Vec<f64>| other.iter().zip(row).any(|(a, b)| (a - b).abs() > 1e-6);
                assert!(all[..i].iter().all(apart), "{row:?}");
            }
        }
    }

    #[test]
    fn planes_meet_the_axes() {
        let found = intercepts(&[vec![0.0, 2.0, 0.0], vec![4.0, 0.0, 0.0], vec![2.0, 0.0, 0.25]]).unwrap();
        for (found, expected) in found.iter().zip([4.0, 2.0, 0.5]) {
            assert!((found - expected).abs() < 1e-14, "{found}");
        }
        // Twice the same point, and a plane that meets an axis below zero.
        assert!(intercepts(&[vec![1.0, 1.0], vec![1.0, 1.0]]).is_none());
        assert!(intercepts(&[vec![1.0, 1.0], vec![2.0, 3.0]]).is_none());
    }

    /// Points on a plane of unlike ranges, far from zero: the scale takes them to the simplex.
    #[test]
    fn the_scale_is_that_of_the_front() {
        let (ideal, range) = ([1e9, -5.0, 0.0], [1e6, 1e-3, 7.0]);
        let points: Vec<Vec<f64>> = lattice(3, 4)
            .iter()
            .map(|row| (0..3).map(|k| ideal[k] + range[k] * row[k]).collect())
            .collect();
        let rows: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let mut scale = FrontScale::default();
        scale.update(0.0, &rows);
        let ranges = scale.ranges(&rows, &rows);
        for (k, found) in ranges.iter().enumerate() {
            assert!((found / range[k] - 1.0).abs() < 1e-9, "{found}");
        }
        for (point, row) in points.iter().zip(lattice(3, 4)) {
            let place = scale.place(point, &ranges);
            assert!(
                place.iter().zip(&row).all(|(a, b)| (a - b).abs() < 1e-9),
                "{place:?}"
            );
        }
        // A front of one point: nothing varies.
        let mut scale = FrontScale::default();
        scale.update(0.0, &rows[..1]);
        assert_eq!(scale.ranges(&rows[..1], &rows[..1]), [1.0; 3]);
        // What violates less makes it anew.
        let before = scale.clone();
        scale.update(0.0, &rows[..1]);
        assert_eq!(scale.ideal, before.ideal);
        let mut scale = FrontScale::default();
        scale.update(2.0, &[&[0.0; 3]]);
        scale.update(1.0, &[&[1.0; 3]]);
        assert_eq!(scale.ideal, [1.0; 3]);
    }
}
