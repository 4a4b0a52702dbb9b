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

/// The lag of a signal behind another, in samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lag {
    /// The lag, samples, between samples by a parabola through the peak.
    pub samples: f64,
    /// Correlation at the whole lag nearest the peak.
    pub correlation: f64,
    /// Samples used.
    pub used: usize,
}

/// The lag within `-most..=most` with the highest score, first in steps and then around the best step: scores change
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

/// The lag within `-most..=most` samples at which `late` correlates most strongly, with either sign, with `early`.
/// None when the strongest is at the end of the range: then there is no peak.
pub(super) fn best_lag(early: &[f64], late: &[f64], mask: &[bool], most: usize) -> Option<Lag> {
    // Samples whose partner falls off either end at some lag are left out at all lags, so that a few samples at the ends do not
    // decide.
    let inner = most..early.len().checked_sub(most)?;
    let mask: Vec<bool> = mask
        .iter()
        .enumerate()
        .map(|(i, allowed)| *allowed && inner.contains(&i))
        .collect();
    let most = isize::try_from(most).ok()?;
    let strength = |lag| fit(early, late, &mask, lag);
    let lag = search(most, |lag| strength(lag).map(|f| f.correlation.abs()))?;
    let at = strength(lag)?;
    if lag.abs() == most {
        return None;
    }
    let side = |lag| strength(lag).map(|f| f.correlation.abs());
    let (before, here, after) = (side(lag - 1)?, at.correlation.abs(), side(lag + 1)?);
    let curvature = before - 2.0 * here + after;
    let between = if curvature < 0.0 {
        0.5 * (before - after) / curvature
    } else {
        0.0
    };
    Some(Lag {
        samples: lag as f64 + between,
        correlation: at.correlation,
        used: at.samples,
    })
}

/// The lag within `-most..=most` samples at which `late`, times the best factor for that lag, equals `early` best,
/// where a squared error counts up to `limit` squared. None when the best is at the end of the range.
pub(super) fn least_error_lag(
    early: &[f64],
    late: &[f64],
    mask: &[bool],
    most: usize,
    limit: f64,
) -> Option<Lag> {
    // As in `best_lag`.
    let inner = most..early.len().checked_sub(most)?;
    let most = isize::try_from(most).ok()?;
    let error = |lag: isize| {
        let mut pairs = Vec::new();
        for i in inner.clone().filter(|&i| mask[i]) {
            pairs.push((early[i], *late.get(i.checked_add_signed(lag)?)?));
        }
        // Where the signal mostly grows, a wrong lag would compensate for a wrong factor.
        let factor = median(pairs.iter().map(|(e, l)| e / l).collect())?;
        let errors = pairs.iter().map(|(e, l)| (e - factor * l).abs().min(limit));
        Some(errors.map(|e| e * e).sum::<f64>())
    };
    let lag = search(most, |lag| error(lag).map(|e| -e))?;
    let here = error(lag)?;
    if lag.abs() == most {
        return None;
    }
    let (before, after) = (error(lag - 1)?, error(lag + 1)?);
    let curvature = before - 2.0 * here + after;
    let between = if curvature > 0.0 {
        0.5 * (before - after) / curvature
    } else {
        0.0
    };
    let at = fit(early, late, mask, lag)?;
    Some(Lag {
        samples: lag as f64 + between,
        correlation: at.correlation,
        used: at.samples,
    })
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

    #[test]
    fn a_shifted_sine_shows_its_lag_and_its_sign() {
        let wave =
            |shift: f64| -> Vec<f64> { (0..400).map(|i| (0.11 * (f64::from(i) - shift)).sin()).collect() };
        let late: Vec<f64> = wave(3.3).iter().map(|v| -2.0 * v).collect();
        let lag = best_lag(&wave(0.0), &late, &[true; 400], 10).unwrap();
        assert!((lag.samples - 3.3).abs() < 0.02 && lag.correlation < -0.99);
        assert!(best_lag(&wave(0.0), &late, &[true; 400], 2).is_none());
        assert!(best_lag(&[1.0; 50], &[1.0; 50], &[true; 50], 2).is_none());
    }

    #[test]
    fn outliers_do_not_move_the_least_error() {
        let ramp = |shift: f64| -> Vec<f64> {
            (0..400)
                .map(|i| 20.0 + 8.0 * (0.05 * (f64::from(i) - shift)).sin())
                .collect()
        };
        let mut late = ramp(2.4);
        for v in late.iter_mut().step_by(9) {
            *v -= 12.0;
        }
        let lag = least_error_lag(&ramp(0.0), &late, &[true; 400], 10, 1.0).unwrap();
        assert!((lag.samples - 2.4).abs() < 0.1, "{lag:?}");
    }

    #[test]
    fn medians() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![]), None);
    }
}
