//! Cubic smoothing splines, open or periodic.
//!
//! Of all curves that stay as close to the data, the smoothing spline has the least integral of the squared second
//! derivative: it minimises `sum |y_i - g(t_i)|^2 + lambda integral |g''|^2 dt`. C. H. Reinsch, "Smoothing by spline
//! functions", Numerische Mathematik 10 (1967); the banded system and its periodic form as in P. J. Green and B. W.
//! Silverman, *Nonparametric Regression and Generalized Linear Models*, 1994, sections 2.3 and 2.5. With `lambda` zero
//! it is the interpolating spline, natural at open ends.

use glam::DVec2;
use std::ops::{Add, Mul, Sub};

/// Values of a spline: numbers or points of the plane.
pub(super) trait Value:
    Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self>
{
    /// Its size, for deviations.
    fn size(self) -> f64;
}

impl Value for f64 {
    fn size(self) -> f64 {
        self.abs()
    }
}

impl Value for DVec2 {
    fn size(self) -> f64 {
        self.length()
    }
}

/// Deviation of a smoothed curve from its data.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Root mean square (m).
    pub rms_m: f64,
    /// Greatest (m).
    pub greatest_m: f64,
}

/// A cubic spline: values and second derivatives at knots, a cubic between them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spline<T> {
    /// Knots, ascending; a closed spline has one more than data, where it repeats its start.
    pub knots: Vec<f64>,
    value: Vec<T>,
    second: Vec<T>,
    closed: bool,
}

/// A spline's value and its derivatives by the parameter.
pub(super) struct Jet<T> {
    pub value: T,
    pub first: T,
    pub second: T,
}

impl<T: Value> Spline<T> {
    /// The smoothing spline of `data` at the first knots (the last knot of a closed spline is its period's end).
    /// Knots ascend strictly; there are at least five data, or three on an open spline.
    pub fn smoothing(knots: &[f64], data: &[T], closed: bool, lambda: f64) -> Self {
        let system = System::new(knots, data.len(), closed, lambda);
        let second = system.solve(data);
        let mut value: Vec<T> = (0..data.len())
            .map(|i| data[i] - system.bend(&second, i) * lambda)
            .collect();
        let mut second = second;
        if closed {
            value.push(value[0]);
            second.push(second[0]);
        }
        Self {
            knots: knots.to_vec(),
            value,
            second,
            closed,
        }
    }

    /// The smoothest spline whose greatest deviation from the data is `greatest`, or the one that leaves waves longer
    /// than `longest_wave` at half their height, whichever is less smooth.
    pub fn within(knots: &[f64], data: &[T], closed: bool, greatest: f64, longest_wave: f64) -> Self {
        let intervals = knots.len() - 1;
        let step = (knots[intervals] - knots[0]) / intervals as f64;
        // A wave of angular frequency w comes out 1 / (1 + lambda h w^4) as high.
        let most = (longest_wave / std::f64::consts::TAU).powi(4) / step;
        let fit = |lambda: f64| Self::smoothing(knots, data, closed, lambda);
        let fits = |spline: &Self| spline.deviation(data).greatest_m <= greatest;
        let smoothest = fit(most);
        if fits(&smoothest) {
            return smoothest;
        }
        // From negligible smoothing up to the most. The deviation grows with lambda.
        let (mut low, mut high) = ((most * 1e-16).ln(), most.ln());
        let mut best = fit(0.0);
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            let spline = fit(middle.exp());
            if fits(&spline) {
                (low, best) = (middle, spline);
            } else {
                high = middle;
            }
        }
        best
    }

    /// How far the spline lies from data at its knots.
    pub fn deviation(&self, data: &[T]) -> Deviation {
        let sizes = data.iter().zip(&self.value).map(|(&y, &g)| (y - g).size());
        let (sum, greatest_m) = sizes.fold((0.0, 0.0f64), |(sum, most), size| {
            (sum + size * size, most.max(size))
        });
        Deviation {
            rms_m: (sum / data.len() as f64).sqrt(),
            greatest_m,
        }
    }

    /// First and last parameter.
    pub fn range(&self) -> (f64, f64) {
        (self.knots[0], self.knots[self.knots.len() - 1])
    }

    /// A parameter brought into the range: wrapped on a closed spline, held at the ends of an open one.
    pub fn wrap(&self, t: f64) -> f64 {
        let (start, end) = self.range();
        if self.closed {
            let wrapped = start + (t - start).rem_euclid(end - start);
            if wrapped >= end { start } else { wrapped }
        } else {
            t.clamp(start, end)
        }
    }

    /// The interval of a parameter within the range.
    pub fn interval(&self, t: f64) -> usize {
        let after = self.knots.partition_point(|&k| k <= t);
        after.clamp(1, self.knots.len() - 1) - 1
    }

    /// Value and derivatives at a parameter, which may lie anywhere.
    pub fn at(&self, t: f64) -> Jet<T> {
        let t = self.wrap(t);
        self.on(self.interval(t), t)
    }

    /// Value and derivatives on an interval.
    pub fn on(&self, i: usize, t: f64) -> Jet<T> {
        let h = self.knots[i + 1] - self.knots[i];
        let b = (t - self.knots[i]) / h;
        let a = 1.0 - b;
        let (g0, g1, m0, m1) = (
            self.value[i],
            self.value[i + 1],
            self.second[i],
            self.second[i + 1],
        );
        let (ca, cb) = (a * (a * a - 1.0) / 6.0, b * (b * b - 1.0) / 6.0);
        let (da, db) = ((1.0 - 3.0 * a * a) / 6.0, (3.0 * b * b - 1.0) / 6.0);
        Jet {
            value: g0 * a + g1 * b + m0 * (ca * h * h) + m1 * (cb * h * h),
            first: (g1 - g0) * (1.0 / h) + m0 * (da * h) + m1 * (db * h),
            second: m0 * a + m1 * b,
        }
    }
}

/// The symmetric matrix `R + lambda Q^T Q` of the second derivatives, factored. It has five diagonals; on a closed spline they
/// wrap round, and the last two unknowns are solved separately (a bordered system).
struct System {
    step: Vec<f64>,
    closed: bool,
    lambda: f64,
    band: Band,
    /// Columns of the two bordering unknowns, and the matrix that solves for them.
    border: [Vec<f64>; 2],
    solved: [Vec<f64>; 2],
    corner: [f64; 3],
}

/// `L D L^T` of a symmetric matrix with five diagonals.
#[derive(Default)]
struct Band {
    diagonal: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Band {
    /// Factors; `first[i]` couples rows i and i + 1, `second[i]` rows i and i + 2.
    fn factor(mut self) -> Self {
        let n = self.diagonal.len();
        for i in 0..n {
            if i >= 1 {
                let e = self.first[i - 1];
                self.diagonal[i] -= e * e * self.diagonal[i - 1];
            }
            if i >= 2 {
                let f = self.second[i - 2];
                self.diagonal[i] -= f * f * self.diagonal[i - 2];
            }
            if i + 1 < n {
                let mut coupling = self.first[i];
                if i >= 1 {
                    coupling -= self.second[i - 1] * self.first[i - 1] * self.diagonal[i - 1];
                }
                self.first[i] = coupling / self.diagonal[i];
            }
            if i + 2 < n {
                self.second[i] /= self.diagonal[i];
            }
        }
        self
    }

    fn solve<T: Value>(&self, right: &mut [T]) {
        let n = self.diagonal.len();
        for i in 0..n {
            let mut x = right[i];
            if i >= 1 {
                x = x - right[i - 1] * self.first[i - 1];
            }
            if i >= 2 {
                x = x - right[i - 2] * self.second[i - 2];
            }
            right[i] = x;
        }
        for i in (0..n).rev() {
            let mut x = right[i] * (1.0 / self.diagonal[i]);
            if i + 1 < n {
                x = x - right[i + 1] * self.first[i];
            }
            if i + 2 < n {
                x = x - right[i + 2] * self.second[i];
            }
            right[i] = x;
        }
    }
}

impl System {
    fn new(knots: &[f64], data: usize, closed: bool, lambda: f64) -> Self {
        let step: Vec<f64> = knots.windows(2).map(|k| k[1] - k[0]).collect();
        // Unknown j is the second derivative at knot j + offset; the ends of an open spline have none.
        let (unknowns, offset) = if closed { (data, 0) } else { (data - 2, 1) };
        let before = |j: usize| {
            let knot = j % unknowns + offset;
            step[(knot + step.len() - 1) % step.len()]
        };
        let after = |j: usize| step[j % unknowns + offset];
        let middle = |j: usize| -(1.0 / before(j) + 1.0 / after(j));
        let diagonal = |j: usize| {
            let (a, b, c) = (1.0 / before(j), middle(j), 1.0 / after(j));
            (before(j) + after(j)) / 3.0 + lambda * (a * a + b * b + c * c)
        };
        let first = |j: usize| {
            let coupling = middle(j) / before(j + 1) + middle(j + 1) / after(j);
            after(j) / 6.0 + lambda * coupling
        };
        let second = |j: usize| lambda / (after(j) * before(j + 2));
        let inner = if closed { unknowns - 2 } else { unknowns };
        let band = Band {
            diagonal: (0..inner).map(diagonal).collect(),
            first: (0..inner.saturating_sub(1)).map(first).collect(),
            second: (0..inner.saturating_sub(2)).map(second).collect(),
        }
        .factor();
        let mut border = [Vec::new(), Vec::new()];
        let mut corner = [0.0; 3];
        if closed {
            let n = unknowns;
            border = [vec![0.0; inner], vec![0.0; inner]];
            border[0][n - 4] += second(n - 4);
            border[0][n - 3] += first(n - 3);
            border[0][0] += second(n - 2);
            border[1][n - 3] += second(n - 3);
            border[1][0] += first(n - 1);
            border[1][1] += second(n - 1);
            corner = [diagonal(n - 2), first(n - 2), diagonal(n - 1)];
        }
        let solved = border.clone().map(|mut column| {
            if closed {
                band.solve(&mut column);
            }
            column
        });
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
        corner[0] -= dot(&border[0], &solved[0]);
        corner[1] -= dot(&border[0], &solved[1]);
        corner[2] -= dot(&border[1], &solved[1]);
        Self {
            step,
            closed,
            lambda,
            band,
            border,
            solved,
            corner,
        }
    }

    /// The second derivatives at all data, zero at the ends of an open spline.
    fn solve<T: Value>(&self, data: &[T]) -> Vec<T> {
        let n = data.len();
        debug_assert!(self.lambda >= 0.0);
        let kink = |i: usize| {
            let (before, after) = ((i + n - 1) % n, (i + 1) % n);
            let step_before = self.step[(i + self.step.len() - 1) % self.step.len()];
            (data[after] - data[i]) * (1.0 / self.step[i]) - (data[i] - data[before]) * (1.0 / step_before)
        };
        if !self.closed {
            let mut inner: Vec<T> = (1..n - 1).map(kink).collect();
            self.band.solve(&mut inner);
            let mut second = vec![T::default()];
            second.append(&mut inner);
            second.push(T::default());
            return second;
        }
        let mut right: Vec<T> = (0..n).map(kink).collect();
        let (inner, last) = right.split_at_mut(n - 2);
        self.band.solve(inner);
        let along = |column: &[f64]| {
            inner
                .iter()
                .zip(column)
                .fold(T::default(), |sum, (&x, &c)| sum + x * c)
        };
        let (p, q) = (last[0] - along(&self.border[0]), last[1] - along(&self.border[1]));
        let [a, b, c] = self.corner;
        let determinant = a * c - b * b;
        last[0] = (p * c - q * b) * (1.0 / determinant);
        last[1] = (q * a - p * b) * (1.0 / determinant);
        for (i, x) in inner.iter_mut().enumerate() {
            *x = *x - last[0] * self.solved[0][i] - last[1] * self.solved[1][i];
        }
        right
    }

    /// Row `i` of `Q` times the second derivatives: how far, by `lambda`, the spline leaves datum `i`.
    fn bend<T: Value>(&self, second: &[T], i: usize) -> T {
        let n = second.len();
        let mut sum = T::default();
        if self.closed || i > 0 {
            let before = (i + n - 1) % n;
            let step = self.step[(i + self.step.len() - 1) % self.step.len()];
            sum = sum + (second[before] - second[i]) * (1.0 / step);
        }
        if self.closed || i + 1 < n {
            sum = sum + (second[(i + 1) % n] - second[i]) * (1.0 / self.step[i]);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    fn uneven(n: usize) -> Vec<f64> {
        (0..n).map(|i| i as f64 + 0.3 * (2.3 * i as f64).sin()).collect()
    }

    #[test]
    fn a_straight_line_is_left_alone_however_smooth() {
        let knots = uneven(40);
        let data: Vec<f64> = knots.iter().map(|t| 3.0 - 0.5 * t).collect();
        for lambda in [0.0, 1.0, 1e6] {
            let spline = Spline::smoothing(&knots, &data, false, lambda);
            assert!(spline.deviation(&data).greatest_m < 1e-8);
            let jet = spline.at(7.3);
            assert!((jet.value - (3.0 - 3.65)).abs() < 1e-8 && (jet.first + 0.5).abs() < 1e-8);
        }
    }

    #[test]
    fn a_wave_comes_out_as_high_as_theory_says() {
        let n = 600;
        let knots: Vec<f64> = (0..=n).map(|i| 0.5 * f64::from(i)).collect();
        let omega = TAU * 5.0 / 300.0;
        let data: Vec<f64> = knots[..600].iter().map(|t| (omega * t).cos()).collect();
        let lambda = 300.0;
        let spline = Spline::smoothing(&knots, &data, true, lambda);
        // Sums stand for integrals at a hundred data per wave: agreement to their error.
        let wanted = 1.0 / (1.0 + lambda * 0.5 * omega.powi(4));
        assert!((spline.at(0.0).value - wanted).abs() < 1e-5);
        assert!((spline.at(300.0).value - spline.at(0.0).value).abs() < 1e-12);
    }

    /// The quantity that the smoothing spline makes least, over splines through `values` at the knots.
    fn cost(knots: &[f64], data: &[f64], values: &[f64], closed: bool, lambda: f64) -> f64 {
        let through = Spline::smoothing(knots, values, closed, 0.0);
        let bending: f64 = (0..knots.len() - 1)
            .map(|i| {
                let (a, b) = (through.second[i], through.second[i + 1]);
                (knots[i + 1] - knots[i]) / 3.0 * (a * a + a * b + b * b)
            })
            .sum();
        let misses: f64 = data.iter().zip(values).map(|(y, g)| (y - g).powi(2)).sum();
        misses + lambda * bending
    }

    proptest! {
        #[test]
        fn no_other_spline_costs_less(
            data in prop::collection::vec(-1.0..1.0f64, 5..30),
            closed: bool,
            log_lambda in -3.0..3.0f64,
            at in 0usize..30,
            change in -0.1..0.1f64,
        ) {
            let lambda = 10f64.powf(log_lambda);
            let knots = uneven(data.len() + usize::from(closed));
            let spline = Spline::smoothing(&knots, &data, closed, lambda);
            let mut values = spline.value[..data.len()].to_vec();
            let least = cost(&knots, &data, &values, closed, lambda);
            values[at % data.len()] += change;
            prop_assert!(cost(&knots, &data, &values, closed, lambda) >= least - 1e-10 * least.abs().max(1.0));
        }

        #[test]
        fn value_and_slope_are_continuous(data in prop::collection::vec(-1.0..1.0f64, 5..30), closed: bool) {
            let knots = uneven(data.len() + usize::from(closed));
            let spline = Spline::smoothing(&knots, &data, closed, 0.7);
            for (i, &knot) in knots.iter().enumerate().take(knots.len() - 1).skip(1) {
                let (a, b) = (spline.on(i - 1, knot), spline.on(i, knot));
                prop_assert!((a.value - b.value).abs() < 1e-9);
                prop_assert!((a.first - b.first).abs() < 1e-8);
                prop_assert!((a.second - b.second).abs() < 1e-8);
            }
            if closed {
                let last = knots.len() - 2;
                let (a, b) = (spline.on(last, knots[last + 1]), spline.on(0, knots[0]));
                prop_assert!((a.first - b.first).abs() < 1e-8);
            }
        }

        #[test]
        fn a_stated_deviation_is_kept(data in prop::collection::vec(-1.0..1.0f64, 5..60), closed: bool) {
            let knots = uneven(data.len() + usize::from(closed));
            let spline = Spline::within(&knots, &data, closed, 0.2, 1e3);
            prop_assert!(spline.deviation(&data).greatest_m <= 0.2);
        }
    }
}
