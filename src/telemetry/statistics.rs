//! The few statistics that calibration needs.

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

/// Correlation of `a[i]` with `b[i + lag]` over the samples that `mask` allows; none when fewer than ten are left or
/// one of the two does not vary.
pub(super) fn fit(a: &[f64], b: &[f64], mask: &[bool], lag: isize) -> Option<Fit> {
    let pairs = || {
        a.iter()
            .zip(mask)
            .enumerate()
            .filter(|(_, (_, allowed))| **allowed)
            .filter_map(|(i, (x, _))| Some((*x, *b.get(i.checked_add_signed(lag)?)?)))
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
/// Errors above this many robust standard deviations (spikes, locked wheels) do not count.
const SPIKE: f64 = 3.0;
/// Rounds in which spikes are found.
const ROUNDS: usize = 4;
/// Samples beyond which every second one, or fewer, are used: what the road and the car do limits an estimate, not their number.
const MOST_SAMPLES: usize = 50_000;
/// Fewest samples for an estimate with a standard error.
const LEAST_SAMPLES: usize = 10 * PARTS;

/// The sums of a least-squares fit on `P` columns.
#[derive(Clone, Copy)]
struct Sums<const P: usize> {
    gram: [[f64; P]; P],
    moment: [f64; P],
    square: f64,
}

impl<const P: usize> Sums<P> {
    const NONE: Self = Self {
        gram: [[0.0; P]; P],
        moment: [0.0; P],
        square: 0.0,
    };

    fn add(&mut self, x: [f64; P], y: f64) {
        for i in 0..P {
            for j in 0..P {
                self.gram[i][j] += x[i] * x[j];
            }
            self.moment[i] += x[i] * y;
        }
        self.square += y * y;
    }

    /// These sums and those of another part, times `sign`.
    fn with(mut self, other: &Self, sign: f64) -> Self {
        for i in 0..P {
            for j in 0..P {
                self.gram[i][j] += sign * other.gram[i][j];
            }
            self.moment[i] += sign * other.moment[i];
        }
        self.square += sign * other.square;
        self
    }

    /// The coefficients; none where the columns do not tell them apart.
    fn solve(&self) -> Option<[f64; P]> {
        // Gaussian elimination on columns scaled to one; the matrix is symmetric and positive.
        let scale: [f64; P] = std::array::from_fn(|i| self.gram[i][i].sqrt());
        if scale.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
            return None;
        }
        let mut a = self.gram;
        let mut b = self.moment;
        for i in 0..P {
            b[i] /= scale[i];
            for j in 0..P {
                a[i][j] /= scale[i] * scale[j];
            }
        }
        for i in 0..P {
            if a[i][i] < 1e-10 {
                return None;
            }
            for k in i + 1..P {
                let factor = a[k][i] / a[i][i];
                for j in i..P {
                    a[k][j] -= factor * a[i][j];
                }
                b[k] -= factor * b[i];
            }
        }
        let mut x = [0.0; P];
        for i in (0..P).rev() {
            let known: f64 = (i + 1..P).map(|j| a[i][j] * x[j]).sum();
            x[i] = (b[i] - known) / a[i][i];
        }
        Some(std::array::from_fn(|i| x[i] / scale[i]))
    }

    /// Sum of the squared errors that remain.
    fn remaining(&self) -> Option<f64> {
        let x = self.solve()?;
        let explained: f64 = x.iter().zip(&self.moment).map(|(x, m)| x * m).sum();
        Some((self.square - explained).max(0.0))
    }
}

/// Samples of a fit of one signal on `P` columns, cut into parts, without spikes.
struct Chosen<'a, const P: usize> {
    signal: &'a [f64],
    columns: [&'a [f64]; P],
    samples: Vec<usize>,
    kept: Vec<bool>,
}

impl<'a, const P: usize> Chosen<'a, P> {
    /// The samples that `mask` allows and that have partners at all lags up to `most`.
    fn new(signal: &'a [f64], columns: [&'a [f64]; P], mask: &[bool], most: usize) -> Option<Self> {
        let last = signal.len().checked_sub(most)?;
        let allowed = |i: &usize| mask.get(*i).copied().unwrap_or(false);
        let step = 1 + last.saturating_sub(most) / MOST_SAMPLES;
        let samples: Vec<usize> = (most..last).step_by(step).filter(allowed).collect();
        (samples.len() >= LEAST_SAMPLES).then(|| Self {
            kept: vec![true; samples.len()],
            signal,
            columns,
            samples,
        })
    }

    fn row(&self, sample: usize, lag: isize) -> Option<([f64; P], f64)> {
        let y = self.signal.get(sample.checked_add_signed(lag)?)?;
        Some((std::array::from_fn(|k| self.columns[k][sample]), *y))
    }

    fn parts(&self, lag: isize) -> [Sums<P>; PARTS] {
        let mut parts = [Sums::NONE; PARTS];
        for (at, (&sample, _)) in self
            .samples
            .iter()
            .zip(&self.kept)
            .enumerate()
            .filter(|(_, (_, k))| **k)
        {
            if let Some((x, y)) = self.row(sample, lag) {
                parts[at * PARTS / self.samples.len()].add(x, y);
            }
        }
        parts
    }

    fn whole(&self, lag: isize) -> Sums<P> {
        let parts = self.parts(lag);
        parts.iter().fold(Sums::NONE, |all, part| all.with(part, 1.0))
    }

    /// Keeps what is no spike beside the fit at a lag.
    fn sift(&mut self, lag: isize) -> Option<()> {
        let coefficients = self.whole(lag).solve()?;
        let error = |sample: usize| {
            let Some((x, y)) = self.row(sample, lag) else {
                return 0.0;
            };
            let fitted: f64 = x.iter().zip(&coefficients).map(|(x, c)| x * c).sum();
            (y - fitted).abs()
        };
        let errors: Vec<f64> = self.samples.iter().map(|&sample| error(sample)).collect();
        // A median error of rounding only: then there are no spikes.
        let size = self.signal.iter().fold(0.0f64, |most, y| most.max(y.abs()));
        let limit = SPIKE * (1.4826 * median(errors.clone())?).max(1e-9 * size);
        let kept: Vec<bool> = errors.iter().map(|e| *e <= limit).collect();
        if kept.iter().filter(|k| **k).count() >= LEAST_SAMPLES {
            self.kept = kept;
        }
        Some(())
    }

    /// Squared deviations of the signal from its mean at a lag, summed.
    fn variance(&self, lag: isize) -> f64 {
        let kept = self.samples.iter().zip(&self.kept).filter(|(_, kept)| **kept);
        let (mut n, mut sum, mut square) = (0.0, 0.0, 0.0);
        for (_, y) in kept.filter_map(|(&sample, _)| self.row(sample, lag)) {
            n += 1.0;
            sum += y;
            square += y * y;
        }
        square - sum * sum / f64::max(n, 1.0)
    }

    fn used(&self) -> usize {
        self.kept.iter().filter(|k| **k).count()
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
        chosen.sift(0)?;
    }
    let whole = chosen.whole(0);
    let mut without = [[0.0; PARTS]; P];
    for (at, part) in chosen.parts(0).iter().enumerate() {
        let factors = whole.with(part, -1.0).solve()?;
        for (estimates, factor) in without.iter_mut().zip(factors) {
            estimates[at] = factor;
        }
    }
    Some(Regression {
        factors: whole.solve()?,
        standard_errors: without.map(jackknife),
        samples: chosen.used(),
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

/// The lag within `-most..=most` samples with the highest score, first in steps and then around the best step: scores change
/// little over a twentieth of the range, and there are many lags at high sample rates.
fn search(most: isize, score: impl Fn(isize) -> Option<f64>) -> Option<isize> {
    let best = |lags: &mut dyn Iterator<Item = isize>| {
        lags.filter_map(|lag| Some((lag, score(lag)?)))
            .max_by(|(_, a), (_, b)| a.total_cmp(b))
            .map(|(lag, _)| lag)
    };
    let step = (most / 20).max(1);
    let reach = most / step;
    let near = best(&mut (-reach..=reach).map(|k| k * step))?;
    best(&mut ((near - step).max(-most)..=(near + step).min(most)))
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
    let mut lag = 0;
    for round in 0..ROUNDS {
        lag = search(most, |lag| chosen.whole(lag).remaining().map(|e| -e))?;
        if round + 1 < ROUNDS {
            chosen.sift(lag)?;
        }
    }
    if lag.abs() == most {
        return None;
    }
    let around = [lag - 1, lag, lag + 1].map(|lag| chosen.parts(lag));
    let wholes = around.map(|parts| parts.iter().fold(Sums::NONE, |all, part| all.with(part, 1.0)));
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
    Some(Lag {
        samples: lag as f64 + between,
        standard_error: jackknife(without),
        explained: if null > 0.0 {
            (1.0 - remaining / null).max(0.0)
        } else {
            0.0
        },
        follows: 1.0 - remaining / chosen.variance(lag).max(f64::MIN_POSITIVE),
        used: chosen.used(),
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
