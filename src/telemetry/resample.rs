//! Bringing channels with their own clocks onto one uniform clock.

use super::recording::Channel;
use crate::{Error, Place, Result};

/// Largest deviation of logged times from a uniform clock, as a share of a sample interval: i2 writes milliseconds, which is 3 %
/// of an interval at 60 Hz.
pub(super) const JITTER: f64 = 0.04;
/// A longer pause between two samples is a gap, in nominal intervals.
const GAP_INTERVALS: f64 = 3.0;
/// Most samples of a resampled log. More samples mean a wrong rate or a wrong unit of time.
const MOST_SAMPLES: f64 = 5e6;

/// A uniform clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    pub start_s: f64,
    pub dt_s: f64,
    pub samples: usize,
}

impl Grid {
    pub fn time_s(&self, sample: usize) -> f64 {
        self.start_s + sample as f64 * self.dt_s
    }

    /// The clock with interval `dt_s` that starts at `origin_s` or whole intervals later, and lies within
    /// `start_s..=end_s`.
    ///
    /// # Errors
    /// [`Error::Input`] if the clock has fewer than two samples, or too many.
    pub fn within(source: &str, origin_s: f64, start_s: f64, end_s: f64, dt_s: f64) -> Result<Self> {
        let skipped = ((start_s - origin_s) / dt_s - 1e-6).ceil().max(0.0);
        let start_s = origin_s + skipped * dt_s;
        let intervals = ((end_s - start_s) / dt_s + 1e-6).floor();
        if !(1.0..=MOST_SAMPLES).contains(&intervals) {
            return Err(Error::input(
                source,
                "time",
                format!("{start_s:.3} to {end_s:.3} s common to all channels, sampled every {dt_s} s"),
                format!("at least two and at most {MOST_SAMPLES:.0} samples"),
            ));
        }
        Ok(Self {
            start_s,
            dt_s,
            samples: intervals as usize + 1,
        })
    }
}

/// The nominal sample interval (s), after checking that time rises and has no gaps longer than three intervals and
/// longer than `bridged_s`.
pub(super) fn check_times(source: &str, channel: &Channel, times: &[f64], bridged_s: f64) -> Result<f64> {
    let mut intervals = Vec::with_capacity(times.len());
    for (at, pair) in times.windows(2).enumerate() {
        let interval = pair[1] - pair[0];
        if interval <= 0.0 || !interval.is_finite() {
            return Err(Error::input(
                source,
                channel.place(at + 1),
                format!("time {} s after {} s", pair[1], pair[0]),
                "times that rise from sample to sample",
            ));
        }
        intervals.push(interval);
    }
    let middle = intervals.len() / 2;
    if intervals.is_empty() {
        return Err(Error::input(
            source,
            Place::default().channel(&channel.name),
            format!("{} samples", times.len()),
            "at least two",
        ));
    }
    let nominal = *intervals.select_nth_unstable_by(middle, f64::total_cmp).1;
    for (at, pair) in times.windows(2).enumerate() {
        let interval = pair[1] - pair[0];
        if interval > (GAP_INTERVALS + JITTER) * nominal && interval > bridged_s {
            return Err(Error::input(
                source,
                channel.place(at + 1),
                format!("a gap of {interval:.3} s after t = {:.3} s", pair[0]),
                format!(
                    "samples every {nominal:.4} s, with gaps of up to {bridged_s} s; bridge_gaps_s in the channel map allows \
                     longer ones"
                ),
            ));
        }
    }
    Ok(nominal)
}

/// The interval of a clock that is uniform to within [`JITTER`], as a whole number of hertz where it is one.
pub(super) fn uniform_interval(times: &[f64]) -> Option<f64> {
    let (first, last) = (times.first()?, times.last()?);
    let mean = (last - first) / (times.len() - 1) as f64;
    let rate = (1.0 / mean).round();
    let whole = 1.0 / rate;
    [whole, mean].into_iter().find(|dt| {
        dt.is_finite()
            && *dt > 0.0
            && times
                .iter()
                .enumerate()
                .all(|(i, t)| (t - (first + i as f64 * dt)).abs() <= JITTER * dt)
    })
}

/// Values of a channel at the times of the grid, each `delay_s` later in the channel's own time: linear between samples, or,
/// where the grid is more than twice as coarse as the samples, the mean over one grid interval of that line, which prevents
/// aliasing.
pub(super) fn onto(times: &[f64], values: &[f64], nominal_s: f64, delay_s: f64, grid: &Grid) -> Vec<f64> {
    let average = grid.dt_s > 2.0 * nominal_s;
    if !average {
        let mut cursor = 0;
        return (0..grid.samples)
            .map(|i| at(times, values, grid.time_s(i) + delay_s, &mut cursor))
            .collect();
    }
    let mut integral = Vec::with_capacity(values.len());
    let mut sum = 0.0;
    integral.push(0.0);
    for (t, v) in times.windows(2).zip(values.windows(2)) {
        sum += (t[1] - t[0]) * (v[0] + v[1]) / 2.0;
        integral.push(sum);
    }
    let (first, last) = (times[0], times[times.len() - 1]);
    let mut cursors = [0; 2];
    (0..grid.samples)
        .map(|i| {
            let middle = grid.time_s(i) + delay_s;
            let from = (middle - grid.dt_s / 2.0).clamp(first, last);
            let to = (middle + grid.dt_s / 2.0).clamp(first, last);
            let area = area_to(times, values, &integral, to, &mut cursors[1])
                - area_to(times, values, &integral, from, &mut cursors[0]);
            area / (to - from)
        })
        .collect()
}

fn segment(times: &[f64], time: f64, cursor: &mut usize) -> usize {
    while *cursor + 2 < times.len() && times[*cursor + 1] <= time {
        *cursor += 1;
    }
    *cursor
}

fn at(times: &[f64], values: &[f64], time: f64, cursor: &mut usize) -> f64 {
    let i = segment(times, time, cursor);
    let share = (time - times[i]) / (times[i + 1] - times[i]);
    // The ends are returned as they are, so that a grid on the samples changes nothing.
    if share <= 0.0 {
        values[i]
    } else if share >= 1.0 {
        values[i + 1]
    } else {
        values[i] + share * (values[i + 1] - values[i])
    }
}

fn area_to(times: &[f64], values: &[f64], integral: &[f64], time: f64, cursor: &mut usize) -> f64 {
    let i = segment(times, time, cursor);
    let here = at(times, values, time, cursor);
    integral[i] + (time - times[i]) * (values[i] + here) / 2.0
}

/// A channel between its samples, by a straight line; its first and its last value beyond them.
pub(super) fn linear(times_s: &[f64], values: &[f64], at_s: f64) -> f64 {
    let after = times_s.partition_point(|t| *t < at_s);
    match (after.checked_sub(1), times_s.get(after)) {
        (Some(before), Some(next_s)) => {
            let share = (at_s - times_s[before]) / (next_s - times_s[before]);
            values[before] + share * (values[after] - values[before])
        }
        (None, Some(_)) => values[0],
        (_, None) => values.last().copied().unwrap_or(f64::NAN),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry::recording::Clock;
    use proptest::prelude::*;
    use std::sync::Arc;

    fn channel(times: &[f64]) -> Channel {
        Channel {
            name: "Yaw".into(),
            unit: String::new(),
            clock: Clock::Times(times.into()),
            values: vec![0.0; times.len()],
            unreadable: None,
            lines: Some((10..10 + times.len()).collect::<Arc<[usize]>>()),
        }
    }

    #[test]
    fn time_that_stands_still_and_gaps_name_line_and_time() {
        let check = |times: &[f64], bridged| {
            check_times("a.csv", &channel(times), times, bridged).map_err(|e| e.to_string())
        };
        let error = check(&[0.0, 0.1, 0.1, 0.2], 0.0).unwrap_err();
        assert!(
            error.contains("line 12, channel Yaw: found time 0.1 s after 0.1 s"),
            "{error}"
        );
        let gap = [0.0, 0.1, 0.2, 0.7, 0.8];
        let error = check(&gap, 0.0).unwrap_err();
        assert!(
            error.contains("line 13, channel Yaw: found a gap of 0.500 s after t = 0.200 s"),
            "{error}"
        );
        assert!((check(&gap, 0.6).unwrap() - 0.1).abs() < 1e-12);
    }

    #[test]
    fn uniform_clocks_are_recognised_through_milliseconds() {
        let times: Vec<f64> = (0..600)
            .map(|i| (f64::from(i) / 60.0 * 1e3).round() / 1e3)
            .collect();
        assert_eq!(uniform_interval(&times), Some(1.0 / 60.0));
        assert_eq!(uniform_interval(&[0.0, 0.1, 0.25, 0.3]), None);
    }

    #[test]
    fn down_sampling_averages_what_linear_sampling_would_alias() {
        let times: Vec<f64> = (0..2001).map(|i| f64::from(i) * 1e-3).collect();
        let values: Vec<f64> = times
            .iter()
            .map(|t| (std::f64::consts::TAU * 100.0 * t).cos() + t)
            .collect();
        let grid = Grid::within("a", 0.0, 0.0, 2.0, 0.05).unwrap();
        let coarse = onto(&times, &values, 1e-3, 0.0, &grid);
        for (i, v) in coarse.iter().enumerate().take(40).skip(1) {
            assert!((v - grid.time_s(i)).abs() < 1e-6, "{i} {v}");
        }
    }

    #[test]
    fn a_delay_is_taken_off() {
        let times: Vec<f64> = (0..101).map(|i| f64::from(i) * 0.1).collect();
        let late: Vec<f64> = times.iter().map(|t| 3.0 * (t - 0.13)).collect();
        let grid = Grid::within("a", 0.0, 0.0, 9.87, 0.1).unwrap();
        for (i, v) in onto(&times, &late, 0.1, 0.13, &grid).iter().enumerate() {
            assert!((v - 3.0 * grid.time_s(i)).abs() < 1e-9);
        }
    }

    proptest! {
        #[test]
        fn a_grid_on_the_samples_changes_nothing(values in prop::collection::vec(-1e3..1e3, 2..50)) {
            let times: Vec<f64> = (0..values.len()).map(|i| i as f64 * 0.25).collect();
            let grid = Grid { start_s: 0.0, dt_s: 0.25, samples: values.len() };
            prop_assert_eq!(onto(&times, &values, 0.25, 0.0, &grid), values);
        }
    }
}
