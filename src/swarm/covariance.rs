//! A swarm that learns the shape of the valley it is in: covariance matrix adaptation.
//!
//! A plain swarm stalls where the cost is a long, narrow valley across the axes, as in any fit whose parameters
//! stand in for one another. Here the particles are drawn about a common centre from a normal distribution whose
//! covariance follows the steps that paid and shuns those that did not (Hansen, *The CMA evolution strategy: a tutorial*, arXiv:1604.00772,
//! 2016, with the default constants of its table 1). It starts from where an exploring swarm got to, as in Müller,
//! Baumgartner, Sbalzarini, *Particle swarm CMA evolution strategy*, CEC 2009.

use super::Optimiser;
use crate::error::{Error, Result};
use crate::evaluate::{Evaluation, FAILED_COST, Problem, Variable};
use crate::random::Random;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Settings of [`CovarianceSwarm`].
#[derive(Clone, Debug, PartialEq)]
pub struct CovarianceSettings {
    /// Particles.
    pub population: usize,
    /// Iterations.
    pub iterations: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Standard deviation at the start, as a share of the ranges.
    pub spread: f64,
}

impl Default for CovarianceSettings {
    fn default() -> Self {
        Self {
            population: 64,
            iterations: 800,
            seed: 1,
            spread: 0.1,
        }
    }
}

/// A swarm drawn from an adapted normal distribution; minimises the first objective.
#[derive(Clone, Debug)]
pub struct CovarianceSwarm {
    settings: CovarianceSettings,
    variables: Vec<Variable>,
    objectives: usize,
    random: Random,
    mean: DVector<f64>,
    step: f64,
    covariance: DMatrix<f64>,
    basis: DMatrix<f64>,
    scales: DVector<f64>,
    covariance_path: DVector<f64>,
    step_path: DVector<f64>,
    /// Positions of the present population in the unit cube, one per column.
    positions: Vec<DVector<f64>>,
    best: (DVector<f64>, f64),
    iteration: usize,
    evaluations: u64,
}

/// What the draws are for, in the counter.
const SAMPLE: u32 = 0xc0a;

impl CovarianceSwarm {
    /// A swarm over the variables of `problem` about `start` (in the variables' units).
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting that is out of its range.
    pub fn new(problem: &Problem, start: &[f64], settings: CovarianceSettings) -> Result<Self> {
        let d = problem.variables.len();
        if settings.population < 4 || d == 0 || start.len() != d {
            let found = format!(
                "{} particles, {d} variables, a start of {}",
                settings.population,
                start.len()
            );
            let expected = "4 or more particles, and a start with a value for each of one or more variables";
            return Err(Error::input(
                "the swarm's settings",
                "population, start",
                found,
                expected,
            ));
        }
        if !(settings.spread > 0.0 && settings.spread <= 1.0) {
            let found = settings.spread.to_string();
            return Err(Error::input(
                "the swarm's settings",
                "spread",
                found,
                "a share above 0 up to 1",
            ));
        }
        let shares = start.iter().zip(&problem.variables).map(|(x, v)| {
            let range = v.upper - v.lower;
            if range > 0.0 {
                ((x - v.lower) / range).clamp(0.0, 1.0)
            } else {
                0.5
            }
        });
        let mean = DVector::from_iterator(d, shares);
        let mut swarm = Self {
            variables: problem.variables.clone(),
            objectives: problem.objectives.len(),
            random: Random::new(settings.seed),
            best: (mean.clone(), f64::INFINITY),
            mean,
            step: settings.spread,
            covariance: DMatrix::identity(d, d),
            basis: DMatrix::identity(d, d),
            scales: DVector::from_element(d, 1.0),
            covariance_path: DVector::zeros(d),
            step_path: DVector::zeros(d),
            positions: Vec::new(),
            settings,
            iteration: 0,
            evaluations: 0,
        };
        swarm.sample();
        Ok(swarm)
    }

    /// The best candidate so far, in the variables' units, and its cost.
    pub fn best_candidate(&self) -> (Vec<f64>, f64) {
        (self.scaled(&self.best.0), self.best.1)
    }

    fn scaled(&self, position: &DVector<f64>) -> Vec<f64> {
        let value = |(v, x): (&Variable, &f64)| (v.lower + x * (v.upper - v.lower)).clamp(v.lower, v.upper);
        self.variables.iter().zip(position.iter()).map(value).collect()
    }

    fn sample(&mut self) {
        let d = self.mean.len();
        self.positions = (0..self.settings.population)
            .map(|particle| {
                let normal = |k: usize| {
                    self.random
                        .normal(SAMPLE, self.iteration as u32, particle as u32, k as u32)
                };
                let z = DVector::from_fn(d, |k, _| self.scales[k] * normal(k));
                let position = &self.mean + &self.basis * z * self.step;
                // Reflected at the bounds, so that the density does not pile up on them.
                position.map(|x| {
                    let folded = x.rem_euclid(2.0);
                    if folded > 1.0 { 2.0 - folded } else { folded }
                })
            })
            .collect();
    }

    /// One update of centre, step size and covariance from the ranked population.
    fn adapt(&mut self, order: &[usize]) {
        let n = self.mean.len() as f64;
        let population = self.settings.population;
        let parents = population / 2;
        let lambda = population as f64;
        let raw: Vec<f64> = (1..=population)
            .map(|rank| (0.5 * (lambda + 1.0)).ln() - (rank as f64).ln())
            .collect();
        let sum = |weights: &[f64]| weights.iter().sum::<f64>();
        let effective_of =
            |weights: &[f64]| sum(weights).powi(2) / weights.iter().map(|w| w * w).sum::<f64>();
        let effective = effective_of(&raw[..parents]);
        let rate_path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
        let rate_step = (effective + 2.0) / (n + effective + 5.0);
        let rate_one = 2.0 / ((n + 1.3).powi(2) + effective);
        let rate_many = (1.0 - rate_one)
            .min(2.0 * (effective - 1.75 + 1.0 / effective) / ((n + 2.0).powi(2) + effective));
        let damping = 1.0 + 2.0 * (((effective - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + rate_step;
        let expected = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
        // Steps that did not pay count against their directions, by no more than leaves the covariance positive
        // (equations 50 to 53).
        let against = (1.0 + rate_one / rate_many)
            .min(1.0 + 2.0 * effective_of(&raw[parents..]) / (effective + 2.0))
            .min((1.0 - rate_one - rate_many) / (n * rate_many));
        let (gain, loss) = (sum(&raw[..parents]), -sum(&raw[parents..]));
        let weights: Vec<f64> = raw
            .iter()
            .enumerate()
            .map(|(i, w)| if i < parents { w / gain } else { against * w / loss })
            .collect();

        let old = self.mean.clone();
        let steps: Vec<DVector<f64>> = order
            .iter()
            .map(|&i| (&self.positions[i] - &old) / self.step)
            .collect();
        let shift = steps[..parents]
            .iter()
            .zip(&weights)
            .fold(DVector::zeros(old.len()), |acc, (y, w)| acc + y * *w);
        self.mean = old + &shift * self.step;

        let whitened = |y: &DVector<f64>| (self.basis.transpose() * y).component_div(&self.scales);
        self.step_path = &self.step_path * (1.0 - rate_step)
            + &self.basis * whitened(&shift) * (rate_step * (2.0 - rate_step) * effective).sqrt();
        let age = 1.0 - (1.0 - rate_step).powi(2 * (self.iteration as i32 + 1));
        let steady = self.step_path.norm() / age.sqrt() < (1.4 + 2.0 / (n + 1.0)) * expected;
        let heaviside = if steady { 1.0 } else { 0.0 };
        self.covariance_path = &self.covariance_path * (1.0 - rate_path)
            + shift * (heaviside * (rate_path * (2.0 - rate_path) * effective).sqrt());
        let kept = 1.0 + (1.0 - heaviside) * rate_one * rate_path * (2.0 - rate_path)
            - rate_one
            - rate_many * sum(&weights);
        self.covariance *= kept;
        self.covariance
            .ger(rate_one, &self.covariance_path, &self.covariance_path, 1.0);
        for (y, w) in steps.iter().zip(&weights) {
            let weight = if *w < 0.0 {
                w * n / whitened(y).norm_squared().max(f64::MIN_POSITIVE)
            } else {
                *w
            };
            self.covariance.ger(rate_many * weight, y, y, 1.0);
        }
        let growth = (rate_step / damping) * (self.step_path.norm() / expected - 1.0);
        self.step = (self.step * growth.min(1.0).exp()).min(1.0);

        let eigen = SymmetricEigen::new(self.covariance.clone());
        self.scales = eigen.eigenvalues.map(|v| v.max(1e-20).sqrt());
        self.basis = eigen.eigenvectors;
    }
}

impl Optimiser for CovarianceSwarm {
    fn ask(&mut self) -> Vec<f64> {
        self.positions.iter().flat_map(|p| self.scaled(p)).collect()
    }

    fn tell(&mut self, evaluation: &Evaluation) {
        let costs: Vec<f64> = evaluation
            .objectives
            .chunks_exact(self.objectives)
            .map(|row| if row[0].is_finite() { row[0] } else { FAILED_COST })
            .collect();
        let mut order: Vec<usize> = (0..costs.len()).collect();
        order.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]));
        if let Some(&first) = order.first()
            && costs[first] < self.best.1
        {
            self.best = (self.positions[first].clone(), costs[first]);
        }
        self.evaluations += costs.len() as u64;
        // A population that failed as a whole says nothing about where to go.
        if order.first().is_some_and(|&i| costs[i] < FAILED_COST) {
            self.adapt(&order);
        }
        self.iteration += 1;
        self.sample();
    }

    fn iteration(&self) -> usize {
        self.iteration
    }

    fn planned_iterations(&self) -> usize {
        self.settings.iterations
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn best(&self) -> Vec<f64> {
        vec![self.best.1]
    }
}
