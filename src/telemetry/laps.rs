//! Cutting a log into laps.

use serde::{Deserialize, Serialize};

use super::resample::{Grid, JITTER};

/// One lap of a log, as a range of its samples.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lap {
    /// Its number; an out-lap is 0 where beacons cut the laps.
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
pub(super) struct Cut {
    /// When, s.
    pub time_s: f64,
    /// The number of the lap that starts there.
    pub number: u32,
}

/// Cuts from beacon times (s, ascending). A beacon within one sample of the start makes the first lap start there.
pub(super) fn cuts_from_beacons(beacons_s: &[f64], span: Grid) -> Vec<Cut> {
    let at_start = |time: f64| (time - span.start_s).abs() <= span.dt_s;
    beacons_s
        .iter()
        .filter(|&&time| time >= span.start_s - span.dt_s)
        .zip(1..)
        .map(|(&time, number)| Cut {
            time_s: if at_start(time) { span.start_s } else { time },
            number,
        })
        .collect()
}

/// Cuts where a logged lap number changes; `times` and `numbers` are as logged.
pub(super) fn cuts_from_numbers(times: &[f64], numbers: &[u32]) -> Vec<Cut> {
    // The pair (i, i + 1) belongs to the time of its second sample.
    times
        .iter()
        .skip(1)
        .zip(numbers.windows(2).map(|pair| (pair[0], pair[1])))
        .filter(|(_, (before, after))| before != after)
        .map(|(&time_s, (_, number))| Cut { time_s, number })
        .collect()
}

/// The laps between cuts, in time order. What comes before the first cut is lap `first_number`. A lap is complete when
/// a cut stands at both its ends; the end of the log counts as one when a cut is within one sample of it.
pub(super) fn cut(cuts: &[Cut], first_number: u32, span: Grid) -> Vec<Lap> {
    // Logged times are rounded; a cut on a sample must not fall after it.
    let index = |time: f64| {
        let position = (time - span.start_s) / span.dt_s - JITTER;
        (position.ceil().max(0.0) as usize).min(span.samples)
    };
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
    let last_s = span.start_s + (span.samples + 1) as f64 * span.dt_s;
    for cut in cuts.iter().filter(|cut| cut.time_s <= last_s) {
        let end = index(cut.time_s);
        push(number, start, end, from_line);
        (start, number, from_line) = (end, cut.number, true);
    }
    push(number, start, span.samples, false);
    laps
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPAN: Grid = Grid {
        start_s: 0.0,
        dt_s: 0.1,
        samples: 100,
    };

    fn shape(laps: &[Lap]) -> Vec<(u32, usize, usize, bool)> {
        laps.iter()
            .map(|l| (l.number, l.start, l.end, l.complete))
            .collect()
    }

    #[test]
    fn out_lap_and_in_lap_are_not_complete() {
        let cuts = cuts_from_beacons(&[2.0, 5.05, 8.0], SPAN);
        assert_eq!(
            shape(&cut(&cuts, 0, SPAN)),
            [
                (0, 0, 20, false),
                (1, 20, 51, true),
                (2, 51, 80, true),
                (3, 80, 100, false)
            ]
        );
    }

    #[test]
    fn a_single_exported_lap_has_its_beacons_at_the_ends() {
        let cuts = cuts_from_beacons(&[-3.0, 0.02, 10.0], SPAN);
        assert_eq!(shape(&cut(&cuts, 0, SPAN)), [(1, 0, 100, true)]);
    }

    #[test]
    fn a_beacon_after_the_end_closes_nothing() {
        let cuts = cuts_from_beacons(&[2.0, 50.0], SPAN);
        assert_eq!(
            shape(&cut(&cuts, 0, SPAN)),
            [(0, 0, 20, false), (1, 20, 100, false)]
        );
    }
}
