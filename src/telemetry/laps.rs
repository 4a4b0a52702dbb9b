//! Cutting a log into laps: the one set of rules, for logs and for the roads that are made of them.

use serde::{Deserialize, Serialize};

use super::path::{StartLine, like};
use super::resample::JITTER;

/// One lap of a log, as a range of its samples.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lap {
    /// Its number; an out-lap is 0 where beacons or the distance cut the laps.
    pub number: u32,
    /// Its first sample.
    pub start: usize,
    /// The sample after its last one.
    pub end: usize,
    /// Whether it runs from line to line. Out-laps, in-laps and laps cut off by an export do not.
    pub complete: bool,
}

/// A passage of the finish line.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cut {
    /// When, s.
    time_s: f64,
    /// The number of the lap that starts there.
    number: u32,
}

/// Share by which the lengths of two laps of one circuit differ at the most.
const ALIKE: f64 = 0.01;
/// A car that crosses the line is at least this fast (m/s): one that begins or ends its outing in the pits stands.
const CROSSING_MPS: f64 = 8.0;
/// Least distance (m) after which a counter restarts.
pub(super) const LEAST_M: f64 = 50.0;

/// Values of a channel with their times (s).
type Timed<'a> = (&'a [f64], &'a [f64]);

/// What a recording tells of its laps. The first that it has counts: beacons, lap numbers, a distance that restarts, a line that
/// its path crosses.
#[derive(Default)]
pub(super) struct Marks<'a> {
    /// Times at which the car passed the line (s, ascending).
    pub beacons_s: &'a [f64],
    /// The lap's number, with its times (s).
    pub numbers: Option<(&'a [f64], Vec<u32>)>,
    /// 1 where the lap was driven from line to line.
    pub complete: Option<Timed<'a>>,
    /// Distance travelled (m).
    pub distance_m: Option<Timed<'a>>,
    /// A line that was found from its path.
    pub line: Option<&'a StartLine>,
    /// Whether a file that tells of no line runs from line to line, as an exported lap does.
    pub whole: bool,
}

impl Marks<'_> {
    /// The laps of samples at `times_s`, in time order and without gaps; `driven_m` is how far the car had come at each.
    ///
    /// A lap between two passages of the line is complete. The first and the last of a file are if the file says so, or,
    /// where it has no beacons, if they are as long as another lap and the car does not stand at their outer end.
    pub fn laps(&self, times_s: &[f64], driven_m: &[f64]) -> Vec<Lap> {
        let span = Span::of(times_s);
        let mut line = None;
        let (cuts, first) = if !self.beacons_s.is_empty() {
            (cuts_from_beacons(self.beacons_s, &span), 0)
        } else if let Some((times, numbers)) = &self.numbers {
            (
                cuts_from_numbers(times, numbers),
                numbers.first().copied().unwrap_or(0),
            )
        } else {
            let cuts = self
                .distance_m
                .map(|logged| cuts_from_restarts(logged, times_s, driven_m));
            let mut cuts = cuts.unwrap_or_default();
            line = self.line.filter(|_| cuts.is_empty());
            if let Some(line) = line {
                cuts = cuts_from_beacons(&line.crossings_s, &span);
            }
            let first = u32::from(cuts.is_empty());
            (cuts, first)
        };
        let mut laps = cut(&cuts, first, &span);
        if let Some(line) = line {
            // Laps through the pits, and those that were cut short, are not from line to line.
            let driven = |at: usize| driven_m.get(at).or(driven_m.last()).copied().unwrap_or(0.0);
            for lap in &mut laps {
                lap.complete &= like(driven(lap.end) - driven(lap.start), line.lap_m);
            }
            return laps;
        }
        if let Some((times, flags)) = self.complete {
            for lap in &mut laps {
                let start_s = times_s.get(lap.start).copied().unwrap_or(f64::INFINITY);
                let at = times.partition_point(|t| *t < start_s - span.interval_s / 2.0);
                lap.complete = flags.get(at).is_some_and(|flag| *flag == 1.0);
            }
        } else if self.beacons_s.is_empty() {
            let inside = cuts
                .iter()
                .any(|cut| (1..times_s.len().saturating_sub(1)).contains(&span.index(cut.time_s)));
            if let Some(lap) = laps.first_mut().filter(|_| !inside) {
                lap.complete = self.whole;
            }
            complete_ends(&mut laps, &span, driven_m);
            // What comes before the first restart is lap 0, unless it is a lap.
            if self.numbers.is_none() && first == 0 && laps.first().is_some_and(|lap| lap.complete) {
                laps.iter_mut().for_each(|lap| lap.number += 1);
            }
        }
        laps
    }
}

/// The clock of a log.
struct Span<'a> {
    times_s: &'a [f64],
    interval_s: f64,
}

impl<'a> Span<'a> {
    fn of(times_s: &'a [f64]) -> Self {
        let length_s = times_s
            .last()
            .zip(times_s.first())
            .map_or(0.0, |(last, first)| last - first);
        Self {
            times_s,
            interval_s: length_s / times_s.len().saturating_sub(1).max(1) as f64,
        }
    }

    /// The first sample at or after a time (s).
    fn index(&self, time_s: f64) -> usize {
        // Logged times are rounded; a cut on a sample must not fall after it.
        let time_s = time_s - JITTER * self.interval_s;
        self.times_s.partition_point(|t| *t < time_s)
    }
}

/// Cuts from beacon times (s, ascending). A beacon within one sample of the start makes the first lap start there.
fn cuts_from_beacons(beacons_s: &[f64], span: &Span<'_>) -> Vec<Cut> {
    let start_s = span.times_s.first().copied().unwrap_or(0.0);
    let at_start = |time: f64| (time - start_s).abs() <= span.interval_s;
    beacons_s
        .iter()
        .filter(|&&time| time >= start_s - span.interval_s)
        .zip(1..)
        .map(|(&time, number)| Cut {
            time_s: if at_start(time) { start_s } else { time },
            number,
        })
        .collect()
}

/// Cuts where a logged lap number changes; `times` and `numbers` are as logged.
fn cuts_from_numbers(times: &[f64], numbers: &[u32]) -> Vec<Cut> {
    // The pair (i, i + 1) belongs to the time of its second sample.
    times
        .iter()
        .skip(1)
        .zip(numbers.windows(2).map(|pair| (pair[0], pair[1])))
        .filter(|(_, (before, after))| before != after)
        .map(|(&time_s, (_, number))| Cut { time_s, number })
        .collect()
}

/// Whether a counter of distance restarts between two values. The threshold is half of the distance reached, because a
/// counter may correct itself by a few metres.
pub(super) fn restarts(before_m: f64, after_m: f64) -> bool {
    before_m > LEAST_M && after_m < 0.5 * before_m
}

/// Cuts where a logged distance restarts; none if it does not go with the distance driven, as that of a broken sensor.
fn cuts_from_restarts((times, logged_m): Timed<'_>, times_s: &[f64], driven_m: &[f64]) -> Vec<Cut> {
    let driven_at = |time_s: f64| {
        let at = times_s.partition_point(|t| *t < time_s);
        driven_m.get(at).or(driven_m.last()).copied().unwrap_or(0.0)
    };
    let mut cuts = Vec::new();
    let mut from = 0;
    for (i, pair) in logged_m.windows(2).enumerate() {
        if restarts(pair[0], pair[1]) {
            let (said, went) = (
                pair[0] - logged_m[from],
                driven_at(times[i]) - driven_at(times[from]),
            );
            if !(0.5 * went..=2.0 * went).contains(&said) {
                return Vec::new();
            }
            from = i + 1;
            cuts.push(Cut {
                time_s: times[from],
                number: cuts.len() as u32 + 1,
            });
        }
    }
    cuts
}

/// The laps between cuts, in time order. What comes before the first cut is lap `first_number`. A lap is complete when
/// a cut stands at both its ends; the end of the log counts as one when a cut is within one sample of it.
fn cut(cuts: &[Cut], first_number: u32, span: &Span<'_>) -> Vec<Lap> {
    let mut laps: Vec<Lap> = Vec::with_capacity(cuts.len() + 1);
    let mut push = |number, start, end, complete| {
        if end > start {
            laps.push(Lap {
                number,
                start,
                end,
                complete,
            });
        }
    };
    let (mut start, mut number, mut from_line) = (0, first_number, false);
    let last_s = span.times_s.last().copied().unwrap_or(0.0) + 2.0 * span.interval_s;
    for cut in cuts.iter().filter(|cut| cut.time_s <= last_s) {
        let end = span.index(cut.time_s);
        push(number, start, end, from_line);
        (start, number, from_line) = (end, cut.number, true);
    }
    push(number, start, span.times_s.len(), false);
    laps
}

/// Says of the first and the last lap that they are complete if they are.
fn complete_ends(laps: &mut [Lap], span: &Span<'_>, driven_m: &[f64]) {
    let Some(newest) = span.times_s.len().min(driven_m.len()).checked_sub(1) else {
        return;
    };
    let times_s = &span.times_s[..=newest];
    let driven = |from: usize, to: usize| driven_m[to.min(newest)] - driven_m[from.min(newest)];
    // Over a second: positions stand still between those of a slow receiver.
    let begins_mps = driven(0, times_s.partition_point(|t| *t < times_s[0] + 1.0));
    let ends_mps = driven(times_s.partition_point(|t| *t < times_s[newest] - 1.0), newest);
    let length = |lap: &Lap| {
        // The last lap ends where a sample more would be.
        let beyond = if lap.end > newest {
            ends_mps * span.interval_s
        } else {
            0.0
        };
        driven(lap.start, lap.end) + beyond
    };
    let lengths: Vec<f64> = laps.iter().map(length).collect();
    let count = laps.len();
    let as_long_as_another = |lap: usize| {
        let another = |other: usize| other != lap && (count == 2 || laps[other].complete);
        (0..count).any(|o| another(o) && (lengths[lap] - lengths[o]).abs() <= ALIKE * lengths[o])
    };
    let starts = count > 1 && begins_mps >= CROSSING_MPS && as_long_as_another(0);
    let ends = count > 1 && ends_mps >= CROSSING_MPS && as_long_as_another(count - 1);
    if let [first, .., last] = laps {
        first.complete |= starts;
        last.complete |= ends;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A log of ten seconds at 10 Hz.
    fn times() -> Vec<f64> {
        (0..100).map(|i| f64::from(i) / 10.0).collect()
    }

    /// A car at 30 m/s.
    fn driven() -> Vec<f64> {
        times().iter().map(|t| 30.0 * t).collect()
    }

    fn shape(laps: &[Lap]) -> Vec<(u32, usize, usize, bool)> {
        laps.iter()
            .map(|l| (l.number, l.start, l.end, l.complete))
            .collect()
    }

    fn by_beacons(beacons_s: &[f64]) -> Vec<(u32, usize, usize, bool)> {
        let marks = Marks {
            beacons_s,
            whole: true,
            ..Marks::default()
        };
        shape(&marks.laps(&times(), &driven()))
    }

    /// Lap numbers of a car that has driven so far at each sample.
    fn by_numbers(number: impl Fn(usize) -> u32, driven_m: &[f64]) -> Vec<(u32, usize, usize, bool)> {
        let times = times();
        let marks = Marks {
            numbers: Some((&times, (0..100).map(number).collect())),
            whole: true,
            ..Marks::default()
        };
        shape(&marks.laps(&times, driven_m))
    }

    #[test]
    fn out_lap_and_in_lap_are_not_complete() {
        let laps = [
            (0, 0, 20, false),
            (1, 20, 51, true),
            (2, 51, 80, true),
            (3, 80, 100, false),
        ];
        assert_eq!(by_beacons(&[2.0, 5.05, 8.0]), laps);
    }

    #[test]
    fn a_single_exported_lap_has_its_beacons_at_the_ends() {
        assert_eq!(by_beacons(&[-3.0, 0.02, 10.0]), [(1, 0, 100, true)]);
    }

    #[test]
    fn beacons_outside_the_log_close_nothing() {
        assert_eq!(by_beacons(&[2.0, 50.0]), [(0, 0, 20, false), (1, 20, 100, false)]);
        assert_eq!(by_beacons(&[-50.0, -20.0, 40.0]), [(0, 0, 100, false)]);
    }

    #[test]
    fn ends_of_a_file_with_lap_numbers_are_complete_if_they_are_as_long_as_a_lap() {
        let thirds = |i: usize| (i / 33) as u32 + 4;
        assert_eq!(
            by_numbers(thirds, &driven()),
            [
                (4, 0, 33, true),
                (5, 33, 66, true),
                (6, 66, 99, true),
                (7, 99, 100, false)
            ]
        );
        // The out-lap is short, and the last lap cut off.
        let laps = by_numbers(
            |i| u32::from(i >= 20) + u32::from(i >= 50) + u32::from(i >= 80) + 1,
            &driven(),
        );
        assert_eq!(
            laps.iter().map(|lap| lap.3).collect::<Vec<_>>(),
            [false, true, true, false]
        );
        // Two whole laps, two parts, and one lap alone.
        let halves = |i: usize| (i / 50) as u32;
        assert_eq!(
            by_numbers(halves, &driven()),
            [(0, 0, 50, true), (1, 50, 100, true)]
        );
        let parts = by_numbers(|i| u32::from(i >= 30), &driven());
        assert!(parts.iter().all(|lap| !lap.3), "{parts:?}");
        assert_eq!(by_numbers(|_| 7, &driven()), [(7, 0, 100, true)]);
        // A lap whose last sample is the next one's first.
        assert_eq!(by_numbers(|i| u32::from(i == 99), &driven())[0], (0, 0, 99, true));
    }

    /// The pits lie at the line: an out-lap is as long as a lap, and begins at rest.
    #[test]
    fn a_lap_that_begins_at_rest_is_an_out_lap() {
        let rest = |i: usize| 30.0 * ((i as f64 - 15.0).max(0.0) / 10.0);
        let driven: Vec<f64> = (0..100).map(rest).collect();
        let number = |i: usize| u32::from(i >= 43) + u32::from(i >= 71);
        let laps = by_numbers(number, &driven);
        assert_eq!(
            laps.iter().map(|lap| lap.3).collect::<Vec<_>>(),
            [false, true, false]
        );
    }

    #[test]
    fn a_distance_that_restarts_cuts_laps() {
        let (times, driven) = (times(), driven());
        let laps = |logged: &[f64]| {
            let marks = Marks {
                distance_m: Some((&times, logged)),
                whole: true,
                ..Marks::default()
            };
            shape(&marks.laps(&times, &driven))
        };
        let from = |offset_m: f64, length_m: f64| -> Vec<f64> {
            driven.iter().map(|d| (d + offset_m) % length_m).collect()
        };
        assert_eq!(
            laps(&from(0.0, 75.0)),
            [
                (1, 0, 25, true),
                (2, 25, 50, true),
                (3, 50, 75, true),
                (4, 75, 100, true)
            ]
        );
        assert_eq!(
            laps(&from(60.0, 120.0)),
            [(0, 0, 20, false), (1, 20, 60, true), (2, 60, 100, true)]
        );
        assert_eq!(laps(&driven), [(1, 0, 100, true)]);
        // A broken counter cuts nothing.
        assert_eq!(
            laps(&from(0.0, 75.0).iter().map(|d| 9.0 * d).collect::<Vec<_>>()),
            [(1, 0, 100, true)]
        );
    }
}
