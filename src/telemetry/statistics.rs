//! The few statistics that calibration needs.

use nalgebra::{SMatrix, SVector};

/// The value below which the share `share` of `values` lies; none for no values.
pub(super) fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    let index = (share * last as f64).round() as usize;
    Some(*values.select_nth_unstable_by(index.min(last), f64::total_cmp).1)
}

/// The middle value; none for no values.
pub(super) fn median(values: Vec<f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// Correlation and slope of two signals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// Pearson's correlation.
    pub correlation: f64,
    /// Slope of the second on the first, least squares.
    pub slope: f64,
    /// Samples used.
    pub samples: usize,
}

/// Correlation of two signals over the samples that `mask` allows; none when fewer than ten are left or one of the two does not
/// vary.
pub(super) fn fit(a: &[f64], b: &[f64], mask: &[bool]) -> Option<Fit> {
    let pairs = || {
        let pairs = a.iter().zip(b).zip(mask);
        pairs.filter(|(_, allowed)| **allowed).map(|((x, y), _)| (*x, *y))
    };
    let (mut n, mut sum_a, mut sum_b) = (0_usize, 0.0, 0.0);
    for (x, y) in pairs() {
        n += 1;
        sum_a += x;
        sum_b += y;
    }
    if n < 10 {
        return None;
    }
    let (mean_a, mean_b) = (sum_a / n as f64, sum_b / n as f64);
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (x, y) in pairs() {
        let (x, y) = (x - mean_a, y - mean_b);
        aa += x * x;
        bb += y * y;
        ab += x * y;
    }
    let correlation = ab / (aa * bb).sqrt();
    correlation.is_finite().then_some(Fit {
        correlation,
        slope: ab / aa,
        samples: n,
    })
}

/// Parts of a log that standard errors come from: each part is left out once (a jackknife), so that errors that last for some
/// seconds do not make an estimate look better than it is.
const PARTS: usize = 8;
/// Share of the errors that no spike is among. It is more than half: on straights, where a car mostly is, there is little to be
/// wrong, and what is said in bends is no spike.
const USUAL: f64 = 0.8;
/// Errors above this many times the usual ones (spikes, locked wheels) count as no more: three standard deviations.
const SPIKE: f64 = 3.0 / 1.2816;
/// Rounds in which spikes are found.
const ROUNDS: usize = 4;
/// Samples beyond which every second one, or fewer, are used: what the road and the car do limits an estimate, not their number.
const MOST_SAMPLES: usize = 20_000;
/// Fewest samples for an estimate with a standard error.
const LEAST_SAMPLES: usize = 10 * PARTS;

/// Share of a column's square that must be its own: less is rounding.
const NOTHING_NEW: f64 = 1e-10;

/// The sums of a least-squares fit on `P` columns.
#[derive(Clone, Copy)]
struct Sums<const P: usize> {
    gram: SMatrix<f64, P, P>,
    moment: SVector<f64, P>,
    square: f64,
}

impl<const P: usize> Sums<P> {
    fn none() -> Self {
        Self {
            gram: SMatrix::zeros(),
            moment: SVector::zeros(),
            square: 0.0,
        }
    }

    fn add(&mut self, x: &SVector<f64, P>, y: f64) {
        self.gram += x * x.transpose();
        self.moment += x * y;
        self.square += y * y;
    }

    /// These sums and those of another part, times `sign`.
    fn with(mut self, other: &Self, sign: f64) -> Self {
        self.gram += other.gram * sign;
        self.moment += other.moment * sign;
        self.square += other.square * sign;
        self
    }

    /// The factors, that of a column being zero where it is a sum of those before it; none where there are no figures.
    fn solve(&self) -> Option<SVector<f64, P>> {
        // Columns scaled to one, so that their units do not matter.
        let scale = self
            .gram
            .diagonal()
            .map(|square| if square > 0.0 { square.sqrt() } else { 1.0 });
        let mut matrix = self.gram.component_div(&(scale * scale.transpose()));
        let mut factors = self.moment.component_div(&scale);
        let mut told = [false; P];
        for (i, told) in told.iter_mut().enumerate() {
            let pivot = matrix[(i, i)];
            *told = pivot > NOTHING_NEW;
            if *told {
                let row = matrix.row(i) / pivot;
                let factor = factors[i] / pivot;
                let above = matrix.column(i).into_owned();
                matrix -= above * row;
                factors -= above * factor;
                matrix.set_row(i, &row);
                factors[i] = factor;
            }
        }
        let factors: SVector<f64, P> =
            SVector::from_fn(|i, _| if told[i] { factors[i] / scale[i] } else { 0.0 });
        (told.contains(&true) && factors.iter().all(|f| f.is_finite())).then_some(factors)
    }

    /// Sum of the squared errors that remain.
    fn remaining(&self) -> Option<f64> {
        Some((self.square - self.solve()?.dot(&self.moment)).max(0.0))
    }
}

/// Samples of a fit of one signal on `P` columns, cut into parts. A spike counts as an error of the limit, at every lag: it may be
/// in the signal or in a column, and a lag moves it to other samples.
struct Chosen<'a, const P: usize> {
    signal: &'a [f64],
    columns: [&'a [f64]; P],
    samples: Vec<usize>,
    factors: SVector<f64, P>,
    limit: f64,
}

impl<'a, const P: usize> Chosen<'a, P> {
    /// The samples that `mask` allows and that have partners at all lags up to `most`.
    fn new(signal: &'a [f64], columns: [&'a [f64]; P], mask: &[bool], most: usize) -> Option<Self> {
        let last = signal.len().checked_sub(most)?;
        let allowed = |i: &usize| mask.get(*i).copied().unwrap_or(false);
        let step = 1 + last.saturating_sub(most) / MOST_SAMPLES;
        let samples: Vec<usize> = (most..last).step_by(step).filter(allowed).collect();
        (samples.len() >= LEAST_SAMPLES).then(|| Self {
            signal,
            columns,
            samples,
            factors: SVector::zeros(),
            limit: f64::INFINITY,
        })
    }

    /// The columns' values and the signal's, `lag` later, and the error of the last round's factors.
    fn row(&self, sample: usize, lag: isize) -> Option<(SVector<f64, P>, f64, f64)> {
        let y = *self.signal.get(sample.checked_add_signed(lag)?)?;
        let x = SVector::from_fn(|k, _| self.columns[k][sample]);
        Some((x, y, (y - x.dot(&self.factors)).abs()))
    }

    fn rows(&self, lag: isize) -> impl Iterator<Item = (SVector<f64, P>, f64, f64)> {
        self.samples
            .iter()
            .filter_map(move |&sample| self.row(sample, lag))
    }

    fn parts(&self, lag: isize) -> [Sums<P>; PARTS] {
        let mut parts = [Sums::none(); PARTS];
        for (at, (x, y, error)) in self.rows(lag).enumerate() {
            let part = &mut parts[at * PARTS / self.samples.len()];
            if error <= self.limit {
                part.add(&x, y);
            } else {
                part.square += self.limit * self.limit;
            }
        }
        parts
    }

    fn whole(&self, lag: isize) -> Sums<P> {
        let parts = self.parts(lag);
        parts.iter().fold(Sums::none(), |all, part| all.with(part, 1.0))
    }

    /// Fits the factors at a lag, and sets the limit to what is usual at `lags`.
    fn sift(&mut self, lag: isize, lags: &[isize]) -> Option<()> {
        self.factors = self.whole(lag).solve()?;
        // Errors of rounding only are no measure: then there are no spikes.
        let size = self.signal.iter().fold(0.0f64, |most, y| most.max(y.abs()));
        let usual = lags
            .iter()
            .filter_map(|&lag| quantile(self.rows(lag).map(|(_, _, error)| error).collect(), USUAL));
        self.limit = SPIKE * usual.fold(1e-9 * size, f64::max);
        Some(())
    }

    /// Share of the signal's variance at a lag that the factors account for, and the number of samples, both without spikes.
    fn followed(&self, lag: isize) -> (f64, usize) {
        let (mut n, mut sum, mut square, mut errors) = (0_usize, 0.0, 0.0, 0.0);
        for (_, y, error) in self.rows(lag).filter(|(_, _, error)| *error <= self.limit) {
            n += 1;
            sum += y;
            square += y * y;
            errors += error * error;
        }
        let variance = square - sum * sum / n.max(1) as f64;
        (1.0 - errors / variance.max(f64::MIN_POSITIVE), n)
    }
}

/// Standard error of an estimate from those that leave out one part each.
fn jackknife(estimates: [f64; PARTS]) -> f64 {
    let mean = estimates.iter().sum::<f64>() / PARTS as f64;
    let sum: f64 = estimates.iter().map(|e| (e - mean).powi(2)).sum();
    (sum * (PARTS - 1) as f64 / PARTS as f64).sqrt()
}

/// A signal as a sum of columns, each with its factor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Regression<const P: usize> {
    /// The factors.
    pub factors: [f64; P],
    /// Their standard errors.
    pub standard_errors: [f64; P],
    /// Samples used.
    pub samples: usize,
}

/// Least squares of a signal on columns over the samples that `mask` allows, without spikes.
pub(super) fn regression<const P: usize>(
    signal: &[f64],
    columns: [&[f64]; P],
    mask: &[bool],
) -> Option<Regression<P>> {
    let mut chosen = Chosen::new(signal, columns, mask, 0)?;
    for _ in 1..ROUNDS {
        chosen.sift(0, &[0])?;
    }
    let whole = chosen.whole(0);
    let mut without = [[0.0; PARTS]; P];
    for (at, part) in chosen.parts(0).iter().enumerate() {
        let factors = whole.with(part, -1.0).solve()?;
        for (estimates, factor) in without.iter_mut().zip(&factors) {
            estimates[at] = *factor;
        }
    }
    Some(Regression {
        factors: whole.solve()?.into(),
        standard_errors: without.map(jackknife),
        samples: chosen.followed(0).1,
    })
}

/// How late a signal follows columns that it should coincide with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lag {
    /// The lag, samples; between samples by a parabola through the least sum of squared errors.
    pub samples: f64,
    /// Its standard error, samples.
    pub standard_error: f64,
    /// Share of the squared errors at the lag that was expected which goes away at this one.
    pub explained: f64,
    /// Share of the signal's variance that the columns account for at this lag.
    pub follows: f64,
    /// Samples used.
    pub used: usize,
}

/// The lag within `-most..=most` samples with the least error: in coarse steps first, then in ever finer ones around the best.
/// Errors change little over a twentieth of the range, and there are many lags at high sample rates.
fn search(most: isize, error: impl Fn(isize) -> Option<f64>) -> Option<isize> {
    let mut step = (most / 20).max(1);
    let (mut best, mut reach) = (0, most / step);
    loop {
        let near = (-reach..=reach)
            .map(|k| best + k * step)
            .filter(|lag| lag.abs() <= most);
        best = near
            .filter_map(|lag| Some((lag, error(lag)?)))
            .min_by(|(_, a), (_, b)| a.total_cmp(b))?
            .0;
        if step == 1 {
            return Some(best);
        }
        let finer = (step / 5).max(1);
        (step, reach) = (finer, step / finer);
    }
}

/// Where the parabola through three values at -1, 0 and 1 is least.
fn least_of([before, here, after]: [f64; 3]) -> Option<f64> {
    let curvature = before - 2.0 * here + after;
    (curvature > 0.0).then(|| 0.5 * (before - after) / curvature)
}

/// The lag at which a signal is best made of columns (each with a factor of its own), in samples, where `expected` is the
/// lag that it has if nothing is wrong. None when the best is at the end of the range: then there is no peak.
///
/// All lags are judged on the same samples, so that a few at the ends do not decide.
pub(super) fn best_lag<const P: usize>(
    signal: &[f64],
    columns: [&[f64]; P],
    mask: &[bool],
    most: usize,
    expected: f64,
) -> Option<Lag> {
    let mut chosen = Chosen::new(signal, columns, mask, most)?;
    let most = isize::try_from(most).ok()?;
    let least = |chosen: &Chosen<'_, P>| search(most, |lag| chosen.whole(lag).remaining());
    let mut lag = least(&chosen)?;
    for _ in 1..ROUNDS {
        // Errors one sample off are usual too, or nothing would tell how the errors grow.
        chosen.sift(lag, &[lag - 1, lag, lag + 1])?;
        lag = least(&chosen)?;
    }
    if lag.abs() == most {
        return None;
    }
    let around = [lag - 1, lag, lag + 1].map(|lag| chosen.parts(lag));
    let wholes = around.map(|parts| parts.iter().fold(Sums::none(), |all, part| all.with(part, 1.0)));
    let errors = |sums: [Sums<P>; 3]| -> Option<[f64; 3]> {
        let [before, here, after] = sums.map(|s| s.remaining());
        Some([before?, here?, after?])
    };
    let between = least_of(errors(wholes)?)?;
    let mut without = [0.0; PARTS];
    for (part, estimate) in without.iter_mut().enumerate() {
        let sums = std::array::from_fn(|k| wholes[k].with(&around[k][part], -1.0));
        *estimate = least_of(errors(sums)?)?;
    }
    let remaining = wholes[1].remaining()?;
    // A lag that was expected between two samples has the errors between theirs.
    let expected = expected.clamp(-(most as f64), most as f64);
    let (low, share) = (expected.floor(), expected - expected.floor());
    let at = |lag: f64| chosen.whole(lag as isize).remaining();
    let null = (1.0 - share) * at(low)? + share * at((low + 1.0).min(most as f64))?;
    let (follows, used) = chosen.followed(lag);
    Some(Lag {
        samples: lag as f64 + between,
        standard_error: jackknife(without),
        explained: if null > 0.0 {
            (1.0 - remaining / null).max(0.0)
        } else {
            0.0
        },
        follows,
        used,
    })
}

/// Means over `half` samples to each side; the ends are averaged over what there is.
pub(super) fn smoothed(values: &[f64], half: usize) -> Vec<f64> {
    let mut sums = Vec::with_capacity(values.len() + 1);
    let mut sum = 0.0;
    sums.push(sum);
    for value in values {
        sum += value;
        sums.push(sum);
    }
    (0..values.len())
        .map(|i| {
            let (from, to) = (i.saturating_sub(half), (i + half + 1).min(values.len()));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}

/// Rate of change by central differences over `half` samples to each side; zero at the ends, where there are none.
pub(super) fn derivative(values: &[f64], dt_s: f64, half: usize) -> Vec<f64> {
    let mut out = vec![0.0; values.len()];
    for i in half..values.len().saturating_sub(half) {
        out[i] = (values[i + half] - values[i - half]) / (2.0 * half as f64 * dt_s);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(shift: f64) -> Vec<f64> {
        (0..800)
            .map(|i| {
                let t = f64::from(i) - shift;
                (0.11 * t).sin() + 0.5 * (0.047 * t).cos()
            })
            .collect()
    }

    #[test]
    fn a_shifted_wave_shows_its_lag_whatever_its_factor_and_its_sign() {
        let late: Vec<f64> = wave(3.3).iter().map(|v| 5.0 - 2.0 * v).collect();
        let (early, one) = (wave(0.0), vec![1.0; 800]);
        let lag = |most| best_lag(&late, [&early, &one], &[true; 800], most, 0.0);
        let found = lag(10).unwrap();
        assert!(
            (found.samples - 3.3).abs() < 0.02 && found.standard_error < 0.02,
            "{found:?}"
        );
        assert!(found.explained > 0.95 && found.follows > 0.99, "{found:?}");
        assert!(lag(2).is_none());
        assert!(best_lag(&one, [&one], &[true; 800], 2, 0.0).is_none());
    }

    #[test]
    fn what_is_not_late_has_nothing_that_a_lag_explains() {
        let random = crate::random::Random::new(3);
        let noise = |purpose| (0..800).map(move |i| 0.3 * random.normal(purpose, 0, i, 0));
        let early = wave(0.0);
        let noisy: Vec<f64> = early.iter().zip(noise(1)).map(|(v, n)| v + n).collect();
        let found = best_lag(&noisy, [&early], &[true; 800], 10, 0.0).unwrap();
        assert!(
            found.samples.abs() < 5.0 * found.standard_error.max(0.05),
            "{found:?}"
        );
        assert!(found.explained < 0.02, "{found:?}");
        // Of a signal that has nothing to do with the other no part follows it.
        let unrelated: Vec<f64> = noise(2).collect();
        let found = best_lag(&unrelated, [&early], &[true; 800], 10, 0.0);
        assert!(found.is_none_or(|lag| lag.follows < 0.1), "{found:?}");
    }

    #[test]
    fn spikes_do_not_move_a_lag_or_a_factor() {
        let (early, one) = (wave(0.0), vec![1.0; 800]);
        let mut late = wave(2.4);
        for v in late.iter_mut().step_by(9) {
            *v -= 12.0;
        }
        let lag = best_lag(&late, [&early, &one], &[true; 800], 10, 0.0).unwrap();
        assert!((lag.samples - 2.4).abs() < 0.1, "{lag:?}");
        assert!(lag.used < 760);
        let found = regression(&late, [&wave(2.4), &one], &[true; 800]).unwrap();
        assert!(
            (found.factors[0] - 1.0).abs() < 1e-9 && found.factors[1].abs() < 1e-9,
            "{found:?}"
        );
    }

    #[test]
    fn a_column_that_says_nothing_new_has_no_factor() {
        let (x, one, still) = (wave(0.0), vec![1.0; 800], vec![3e-7; 800]);
        let y: Vec<f64> = x.iter().map(|x| 3.0 * x + 0.5).collect();
        let found = regression(&y, [&one, &still, &x], &[true; 800]).unwrap();
        let [mean, nothing, slope] = found.factors;
        assert!((mean - 0.5).abs() < 1e-9 && nothing == 0.0 && (slope - 3.0).abs() < 1e-9);
        assert!(regression(&y, [&vec![0.0; 800]], &[true; 800]).is_none());
    }

    #[test]
    fn standard_errors_cover_what_noise_does() {
        let (x, one) = (wave(0.0), vec![1.0; 800]);
        let (mut misses, mut stated) = (0.0, 0.0);
        for seed in 0..40 {
            let random = crate::random::Random::new(seed);
            let noise = (0..800).map(|i| random.normal(1, 0, i, 0));
            let y: Vec<f64> = x.iter().zip(noise).map(|(x, n)| 3.0 * x + 0.5 + n).collect();
            let found = regression(&y, [&x, &one], &[true; 800]).unwrap();
            misses += (found.factors[0] - 3.0).powi(2) / 40.0;
            stated += found.standard_errors[0].powi(2) / 40.0;
        }
        let ratio = (stated / misses).sqrt();
        assert!((0.6..1.7).contains(&ratio), "{ratio}");
    }

    #[test]
    fn medians() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![]), None);
    }
}
