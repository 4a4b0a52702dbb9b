//! Least squares within bounds: Levenberg-Marquardt steps with geodesic acceleration (Transtrum, Sethna, arXiv:1201.5885, 2012).
//!
//! Parameters of a car stand in for one another, so that the cost is a long, narrow and bent valley. A straight step leaves its
//! floor and has to be short. The acceleration is the second derivative of the errors along the step; with half of it added, the
//! step bends with the floor.

use nalgebra::linalg::QR;
use nalgebra::{DMatrix, DVector, Dyn};
use std::ops::ControlFlow;

/// Errors to be made small, over variables from 0 to 1. A break ends the descent.
pub(super) trait LeastSquares {
    /// The errors at `x`; `None` where there are none.
    fn errors(&mut self, x: &DVector<f64>) -> ControlFlow<(), Option<DVector<f64>>>;

    /// The errors with their derivatives.
    fn place(&mut self, x: DVector<f64>) -> ControlFlow<(), Option<Place>>;
}

/// Variables, their errors, and the errors' derivatives, one column for each variable.
pub(super) struct Place {
    pub x: DVector<f64>,
    pub errors: DVector<f64>,
    pub jacobian: DMatrix<f64>,
}

impl Place {
    /// Half the sum of the squares of the errors.
    pub fn cost(&self) -> f64 {
        0.5 * self.errors.norm_squared()
    }

    /// The square of the longest column.
    fn longest(&self) -> f64 {
        let squares = self.jacobian.column_iter().map(|column| column.norm_squared());
        squares.fold(0.0, f64::max)
    }
}

/// Damping at first, as a share of the square of the longest column.
const FIRST_DAMPING: f64 = 1e-3;
/// Damping of a step that is as good as undamped: this share of the longest column is rounding, as where standard errors are judged.
const ROUNDING: f64 = 1e-11;
/// Share of the step at which the second derivative is measured.
const PROBE: f64 = 0.1;
/// Longest acceleration, as a share of the step: beyond it the series does not hold, and the step is refused (the authors' figure
/// for twice the acceleration is 0.75).
const LONGEST_ACCELERATION: f64 = 0.375;
/// Least share of the promised gain with which a step is taken.
const LEAST_SHARE: f64 = 1e-4;
/// Steps refused in a row after which no step helps: damping has grown by `2^36` then.
const MOST_REFUSED: usize = 8;

/// Goes down from `place` by no more than `most_steps` tried steps, and leaves the best place there. Ends where a step without
/// damping promises less than a share of the cost, where a step promises and gains less, or where none gains. `least_gain` says the
/// share for a cost.
pub(super) fn descend(
    problem: &mut impl LeastSquares,
    place: &mut Place,
    most_steps: usize,
    least_gain: impl Fn(f64) -> f64,
) -> ControlFlow<()> {
    let mut model = Model::of(place);
    let mut damping = FIRST_DAMPING * place.longest();
    let (mut growth, mut refused) = (2.0, 0);
    for _ in 0..most_steps {
        let cost = place.cost();
        let least_gain = least_gain(cost) * cost;
        let undamped = model.undamped_promise(&place.x, ROUNDING * ROUNDING * place.longest());
        if undamped <= least_gain || refused == MOST_REFUSED {
            break;
        }
        let step = model.step(&place.x, damping);
        if let Some((next, gain)) = tried(problem, place, &model, &step, damping)? {
            *place = next;
            model = Model::of(place);
            // Nielsen, Damping parameter in Marquardt's method, 1999.
            let share = gain / step.promise;
            damping *= (1.0 - (2.0 * share - 1.0).powi(3)).max(1.0 / 3.0);
            (growth, refused) = (2.0, 0);
            if gain.max(step.promise) <= least_gain {
                break;
            }
        } else {
            damping *= growth;
            growth *= 2.0;
            refused += 1;
        }
    }
    ControlFlow::Continue(())
}

/// Where a step leads, bent by its acceleration, and what it gains; `None` if it is refused.
fn tried(
    problem: &mut impl LeastSquares,
    place: &Place,
    model: &Model,
    step: &Step,
    damping: f64,
) -> ControlFlow<(), Option<(Place, f64)>> {
    // Variables that stop at their bounds can cost more than the others gain.
    if step.promise <= 0.0 {
        return ControlFlow::Continue(None);
    }
    let Some(probed) = problem.errors(&(&place.x + &step.by * PROBE))? else {
        return ControlFlow::Continue(None);
    };
    let straight = &place.jacobian * &step.by;
    let second = ((probed - &place.errors) / PROBE - straight) * (2.0 / PROBE);
    let acceleration = model.solve(model.projected(second), &step.free, damping);
    if acceleration.norm() > LONGEST_ACCELERATION * step.by.norm() {
        return ControlFlow::Continue(None);
    }
    let x = (&place.x + &step.by + acceleration * 0.5).map(|x| x.clamp(0.0, 1.0));
    let Some(errors) = problem.errors(&x)? else {
        return ControlFlow::Continue(None);
    };
    let gain = place.cost() - 0.5 * errors.norm_squared();
    if gain > LEAST_SHARE * step.promise {
        let next = problem.place(x)?;
        return ControlFlow::Continue(next.map(|next| (next, gain)));
    }
    ControlFlow::Continue(None)
}

/// The errors about a place as its derivatives have them.
struct Model {
    factors: QR<f64, Dyn, Dyn>,
    triangle: DMatrix<f64>,
    /// The errors, in the columns of the orthogonal factor.
    errors: DVector<f64>,
    /// The slope of the cost.
    slope: DVector<f64>,
}

/// A step within the bounds.
struct Step {
    by: DVector<f64>,
    /// The variables that it does not lead to a bound, or hold at one.
    free: Vec<usize>,
    /// What the cost loses by the model.
    promise: f64,
}

impl Model {
    fn of(place: &Place) -> Self {
        let factors = place.jacobian.clone().qr();
        let mut model = Self {
            triangle: factors.r(),
            errors: DVector::zeros(0),
            slope: place.jacobian.tr_mul(&place.errors),
            factors,
        };
        model.errors = model.projected(place.errors.clone());
        model
    }

    /// `errors` in the columns of the orthogonal factor.
    fn projected(&self, mut errors: DVector<f64>) -> DVector<f64> {
        self.factors.q_tr_mul(&mut errors);
        errors.rows(0, self.triangle.nrows()).into_owned()
    }

    /// The damped step of the `free` variables that makes `errors` small.
    fn solve(&self, errors: DVector<f64>, free: &[usize], damping: f64) -> DVector<f64> {
        let (rows, count) = (self.triangle.nrows(), free.len());
        let damped = DMatrix::from_fn(rows + count, count, |i, c| match i.checked_sub(rows) {
            None => self.triangle[(i, free[c])],
            Some(k) if k == c => damping.sqrt(),
            Some(_) => 0.0,
        });
        let mut wanted = DVector::zeros(rows + count);
        wanted.rows_mut(0, rows).copy_from(&-errors);
        let factors = damped.qr();
        factors.q_tr_mul(&mut wanted);
        let solved = factors
            .r()
            .solve_upper_triangular(&wanted.rows(0, count).into_owned());
        let mut step = DVector::zeros(self.triangle.ncols());
        for (k, by) in free.iter().zip(solved.iter().flat_map(|solved| solved.iter())) {
            step[*k] = *by;
        }
        step
    }

    /// The variables that the cost does not push out of their bounds at `x`.
    fn free(&self, x: &DVector<f64>) -> Vec<usize> {
        let outwards =
            |k: usize| (x[k] <= 0.0 && self.slope[k] > 0.0) || (x[k] >= 1.0 && self.slope[k] < 0.0);
        (0..x.len()).filter(|&k| !outwards(k)).collect()
    }

    /// What the cost loses by a step.
    fn promise(&self, by: &DVector<f64>) -> f64 {
        let left = &self.errors + &self.triangle * by;
        0.5 * (self.errors.norm_squared() - left.norm_squared())
    }

    /// The most that a step from `x` could gain if it met no further bound.
    fn undamped_promise(&self, x: &DVector<f64>, rounding: f64) -> f64 {
        self.promise(&self.solve(self.errors.clone(), &self.free(x), rounding))
    }

    /// The damped step from `x`. A variable that it would lead over a bound goes to the bound, the furthest first, and the others'
    /// step is worked out anew. A variable at a bound that the cost pushes out stays there.
    fn step(&self, x: &DVector<f64>, damping: f64) -> Step {
        let mut free = self.free(x);
        let mut bound = DVector::zeros(x.len());
        loop {
            let by = &bound + self.solve(&self.errors + &self.triangle * &bound, &free, damping);
            let beyond = |k: usize| (x[k] + by[k] - 1.0).max(-(x[k] + by[k]));
            let furthest = free
                .iter()
                .copied()
                .max_by(|&a, &b| beyond(a).total_cmp(&beyond(b)));
            match furthest.filter(|&k| beyond(k) > 0.0) {
                Some(k) => {
                    bound[k] = if by[k] > 0.0 { 1.0 - x[k] } else { -x[k] };
                    free.retain(|&other| other != k);
                }
                None => {
                    let promise = self.promise(&by);
                    return Step { by, free, promise };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley, bent and a hundred times as steep across as along, over 0 to 1 for -2 to 2; `most` bounds the second
    /// variable.
    struct Valley {
        most: f64,
        asked: usize,
    }

    impl Valley {
        fn of(&self, x: &DVector<f64>) -> [f64; 2] {
            [4.0 * x[0] - 2.0, -2.0 + (self.most + 2.0) * x[1]]
        }
    }

    impl LeastSquares for Valley {
        fn errors(&mut self, x: &DVector<f64>) -> ControlFlow<(), Option<DVector<f64>>> {
            self.asked += 1;
            assert!(x.iter().all(|x| (0.0..=1.0).contains(x)), "{x}");
            let [a, b] = self.of(x);
            ControlFlow::Continue(Some(DVector::from_vec(vec![10.0 * (b - a * a), 1.0 - a])))
        }

        fn place(&mut self, x: DVector<f64>) -> ControlFlow<(), Option<Place>> {
            let ControlFlow::Continue(Some(errors)) = self.errors(&x) else {
                return ControlFlow::Break(());
            };
            let [a, _] = self.of(&x);
            let across = 10.0 * (self.most + 2.0);
            let jacobian = DMatrix::from_row_slice(2, 2, &[-80.0 * a, across, -4.0, 0.0]);
            ControlFlow::Continue(Some(Place { x, errors, jacobian }))
        }
    }

    fn descended(most: f64) -> ([f64; 2], f64, usize) {
        descended_until(most, |_| 1e-8)
    }

    fn descended_until(most: f64, least_gain: impl Fn(f64) -> f64) -> ([f64; 2], f64, usize) {
        let mut valley = Valley { most, asked: 0 };
        let start = DVector::from_vec(vec![0.2, 0.75]);
        let ControlFlow::Continue(Some(mut place)) = valley.place(start) else {
            panic!("nothing there");
        };
        assert!(descend(&mut valley, &mut place, 100, least_gain).is_continue());
        (valley.of(&place.x), place.cost(), valley.asked)
    }

    #[test]
    fn a_bent_valley_is_followed_to_its_end() {
        let ([a, b], cost, asked) = descended(2.0);
        assert!(
            (a - 1.0).abs() < 1e-6 && (b - 1.0).abs() < 1e-6 && cost < 1e-12,
            "{a} {b} {cost}"
        );
        assert!(asked < 100, "{asked}");
    }

    #[test]
    fn a_descent_ends_early_where_its_cost_asks_for_more_gain() {
        let (_, _, to_the_end) = descended(2.0);
        // No step promises more than the whole cost.
        let (_, cost, asked) = descended_until(2.0, |cost| if cost < 0.1 { 1.0 } else { 1e-8 });
        assert!(cost < 0.1 && asked < to_the_end, "{cost} {asked} {to_the_end}");
    }

    /// With `b` at most one half, the least of `100 (0.5 - a^2)^2 + (1 - a)^2` is where `200 a^3 - 99 a - 1 = 0`.
    #[test]
    fn a_minimum_at_a_bound_is_found() {
        let ([a, b], cost, _) = descended(0.5);
        assert_eq!(b, 0.5);
        assert!((200.0 * a.powi(3) - 99.0 * a - 1.0).abs() < 1e-2, "{a}");
        let least = 0.5 * (100.0 * (0.5 - a * a).powi(2) + (1.0 - a).powi(2));
        assert!((cost - least).abs() < 1e-12);
    }

    #[test]
    fn a_break_leaves_the_best_place() {
        struct Broken(Valley);
        impl LeastSquares for Broken {
            fn errors(&mut self, x: &DVector<f64>) -> ControlFlow<(), Option<DVector<f64>>> {
                if self.0.asked > 12 {
                    return ControlFlow::Break(());
                }
                self.0.errors(x)
            }
            fn place(&mut self, x: DVector<f64>) -> ControlFlow<(), Option<Place>> {
                self.0.place(x)
            }
        }
        let mut broken = Broken(Valley { most: 2.0, asked: 0 });
        let ControlFlow::Continue(Some(mut place)) = broken.place(DVector::from_vec(vec![0.2, 0.75])) else {
            panic!("nothing there");
        };
        let before = place.cost();
        assert!(descend(&mut broken, &mut place, 100, |_| 1e-8).is_break());
        assert!(place.cost() < before);
    }
}
