//! Checks whether points can be the line of a road.

use super::super::crossing::{crossings, stretches};
use super::{MOST_POINTS, Survey, WIDEST_M, place};
use crate::{Error, Place, Result};
use glam::DVec2;
use std::path::Path;

/// Fewest points of a closed line and of an open one.
const FEWEST: (usize, usize) = (8, 4);
/// Points closer than this to the one before are duplicates (m).
const DUPLICATE_M: f64 = 1e-3;
/// Range of coordinates (m): UTM northings fit.
pub(super) const FURTHEST_M: f64 = 2e7;
/// Range of the length of a road (m).
const LENGTH_M: (f64, f64) = (10.0, 200_000.0);
/// Greatest turn at one point (degrees).
const SHARPEST_DEG: f64 = 120.0;
/// Least width of a road (m).
const NARROWEST_M: f64 = 0.1;
/// A line is closed if its gap is no longer than this many of its longest steps, and open if the gap is longer than this share of
/// its length.
const JOINED_STEPS: f64 = 2.0;
const OPEN_SHARE: f64 = 0.05;
/// A line that crosses itself at this angle or a steeper one (degrees) does so at a bridge. Two stretches of a bad survey cross at
/// a shallow one.
const BRIDGE_DEG: f64 = 30.0;
/// Line between the two decks of a bridge (m). A shorter loop is a knot of the survey.
const BRIDGE_LOOP_M: f64 = 100.0;
/// Bridges that need no word, at the most.
const BRIDGES: usize = 8;

/// Decides whether a line is closed, and drops the last point of a closed one where it repeats the first.
pub(super) fn close(
    points: &mut Vec<DVec2>,
    lines: &[usize],
    path: &Path,
    asked: Option<bool>,
) -> Result<bool> {
    let [first, .., last] = points[..] else {
        return Err(Error::input(
            path,
            "whole file",
            format!("{} points", points.len()),
            format!("at least {} points", FEWEST.1),
        ));
    };
    let steps = || points.windows(2).map(|p| p[0].distance(p[1]));
    let longest = steps().fold(0.0, f64::max);
    let length: f64 = steps().sum();
    let gap = first.distance(last);
    let ends = || {
        format!(
            "ends {gap:.1} m apart on a line of {length:.0} m ({} and {})",
            place(lines, 0),
            place(lines, points.len() - 1)
        )
    };
    let closed = match asked {
        Some(true) if gap > OPEN_SHARE * length && gap > JOINED_STEPS * longest => {
            let expected = format!("a gap of at most {:.0}% of the length", 100.0 * OPEN_SHARE);
            return Err(Error::input(path, "closed", ends(), expected));
        }
        Some(asked) => asked,
        None if gap <= JOINED_STEPS * longest && gap < 0.5 * length => true,
        None if gap > OPEN_SHARE * length => false,
        None => {
            return Err(Error::input(
                path,
                "closed or open",
                ends(),
                "ends that meet or lie well apart, or a TOML file with `survey` (this file) and `closed`",
            ));
        }
    };
    if closed && gap < DUPLICATE_M.max(1e-3 * longest) {
        points.pop();
    }
    Ok(closed)
}

/// Refuses a line that repeats a point, turns back or is too short or long.
pub(super) fn check_line(
    points: &[DVec2],
    closed: bool,
    source: &str,
    place: &dyn Fn(usize) -> Place,
) -> Result<()> {
    let refuse =
        |place: Place, found: String, expected: String| Err(Error::input(source, place, found, expected));
    let n = points.len();
    let fewest = if closed { FEWEST.0 } else { FEWEST.1 };
    if !(fewest..=MOST_POINTS).contains(&n) {
        let kind = if closed { "a closed" } else { "an open" };
        return refuse(
            "whole line".into(),
            format!("{n} points"),
            format!("{fewest} to {MOST_POINTS} points of {kind} line"),
        );
    }
    let within = |x: f64| (-FURTHEST_M..=FURTHEST_M).contains(&x);
    if let Some(i) = points.iter().position(|p| !(within(p.x) && within(p.y))) {
        let expected = format!("coordinates from -{FURTHEST_M} to {FURTHEST_M} m");
        return refuse(place(i), format!("{:?}", points[i].to_array()), expected);
    }
    let mut length = 0.0;
    for i in 0..n - usize::from(!closed) {
        let j = (i + 1) % n;
        let step = points[i].distance(points[j]);
        if step < DUPLICATE_M {
            return refuse(
                place(j),
                format!("the same point as in {}", place(i)),
                "points in different places".into(),
            );
        }
        length += step;
    }
    if !(LENGTH_M.0..=LENGTH_M.1).contains(&length) {
        return refuse(
            "whole line".into(),
            format!("a length of {length:.1} m"),
            format!("{} to {} m", LENGTH_M.0, LENGTH_M.1),
        );
    }
    let turns = if closed { 0..n } else { 1..n - 1 };
    for i in turns {
        let (before, after) = (
            points[i] - points[(i + n - 1) % n],
            points[(i + 1) % n] - points[i],
        );
        let turn = before.angle_to(after).abs().to_degrees();
        if turn > SHARPEST_DEG {
            return refuse(
                place(i),
                format!("a turn of {turn:.0} degrees at one point"),
                format!("at most {SHARPEST_DEG} degrees: a line that does not turn back on itself"),
            );
        }
    }
    Ok(())
}

/// Refuses a line that crosses itself more often than it has bridges. A steep crossing is a bridge by itself.
pub(super) fn check_crossings(
    points: &[DVec2],
    closed: bool,
    bridges: usize,
    source: &str,
    place: &dyn Fn(usize) -> Place,
) -> Result<()> {
    let all = stretches(points, closed);
    let mut along_m = vec![0.0];
    for [from, to] in &all {
        along_m.push(along_m[along_m.len() - 1] + from.distance(*to));
    }
    let length_m = along_m[all.len()];
    let is_bridge = |&(i, j): &(usize, usize)| {
        let [a, b] = [all[i], all[j]].map(|[from, to]| (to - from).normalize_or_zero());
        let apart_m = along_m[j] - along_m[i + 1];
        let back_m = if closed {
            length_m - along_m[j + 1] + along_m[i]
        } else {
            f64::INFINITY
        };
        // Of two decks that are passed in opposite directions the smaller angle counts.
        a.perp_dot(b).abs() >= BRIDGE_DEG.to_radians().sin() && apart_m.min(back_m) >= BRIDGE_LOOP_M
    };
    let found = crossings(&all, bridges.saturating_add(BRIDGES + 1));
    match found {
        Ok(crossed) => {
            let steep = crossed.iter().filter(|pair| is_bridge(pair)).count().min(BRIDGES);
            if crossed.len() - steep <= bridges {
                return Ok(());
            }
            let (i, j) = crossed
                .iter()
                .copied()
                .find(|pair| !is_bridge(pair))
                .unwrap_or(crossed[0]);
            Err(Error::input(
                source,
                place(i),
                format!(
                    "a line that crosses itself at {}, {} time(s) or more in all",
                    place(j),
                    crossed.len()
                ),
                match bridges {
                    0 => format!(
                        "a line that does not at less than {BRIDGE_DEG} degrees, or a TOML file with `bridges`, the number of \
                         its crossings"
                    ),
                    _ => format!("at most {bridges} crossing(s), as `bridges` says"),
                },
            ))
        }
        Err(_) => Err(Error::input(
            source,
            "whole line",
            "points so tangled that crossings cannot be looked for",
            "the line of a road",
        )),
    }
}

impl Survey {
    /// Checks that this can be a road: enough points, none twice, no turning back, no more crossings than bridges, widths of zero
    /// or more (an edge may touch the line) and together at least 0.1 m. Widths against bends are checked where cross-sections
    /// are made.
    ///
    /// # Errors
    /// [`Error::Input`] naming the first point that cannot be.
    pub fn check(&self) -> Result<()> {
        let n = self.centre_m.len();
        let place = |i: usize| self.place(i);
        check_line(&self.centre_m, self.closed, &self.source, &place)?;
        for (field, widths) in [("left width", &self.left_m), ("right width", &self.right_m)] {
            if widths.len() != n {
                return Err(Error::input(
                    &self.source,
                    field,
                    format!("{} values", widths.len()),
                    format!("{n}, one for each point"),
                ));
            }
            if let Some(i) = widths.iter().position(|w| !(0.0..=WIDEST_M).contains(w)) {
                return Err(Error::input(
                    &self.source,
                    place(i).named(field),
                    format!("{} m", widths[i]),
                    format!("0 to {WIDEST_M} m"),
                ));
            }
        }
        let widths = self.left_m.iter().zip(&self.right_m);
        if let Some((i, width)) = widths
            .map(|(l, r)| l + r)
            .enumerate()
            .find(|(_, w)| *w < NARROWEST_M)
        {
            return Err(Error::input(
                &self.source,
                place(i).named("width of the road"),
                format!("{width} m"),
                format!("at least {NARROWEST_M} m"),
            ));
        }
        check_crossings(&self.centre_m, self.closed, self.bridges, &self.source, &place)
    }
}
