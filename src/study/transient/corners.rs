//! Grip by corner: where the car holds more than on the whole lap, its plan takes more.
//!
//! The greatest share of the grip that a whole lap holds is that of its worst corner. From there the shares of all corners are raised
//! together, step by step. Where the car is lost, or falls behind its plan, the corner goes back by a step and stays there. Which corner
//! that is can only be guessed, and a slower plan may be driven faster. So at the end each corner alone is tried lower and higher. Each
//! drive follows from the ones before, so that a resumed search ends with the same bits.

use super::NamedLine;
use super::drive::{DrivenLine, INTERVAL_S, keeps_up};
use super::state::{CornerState, DriveState};
use crate::drive::{Drive, Lost, SpeedPlan, drive_until_lost};
use crate::error::{Error, Result};
use crate::line::{BySection, EnvelopeTable, FineLine, LapProfile, PointMass};
use crate::study::framework::Progress;
use crate::study::framework::state_file::StateFile;
use crate::vehicle::{Car, Traction};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// A corner ends at a greatest speed from which the car slows down by at least this much (m/s), and has gained as much.
const LEAST_DROP_MPS: f64 = 3.0;
/// A corner also ends where the lap turns over from one side to the other, between lateral accelerations of this share of the lap's
/// greatest: fast esses are driven at nearly one speed.
const LEAST_BEND: f64 = 0.5;

/// A corner of a driven lap, from one greatest speed to the next, or to where the lap turns over to the other side.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CornerGrip {
    /// Station of its start along the line (m).
    pub start_m: f64,
    /// Station of its end (m), before its start if it passes the start line.
    pub end_m: f64,
    /// Least speed of the quasi-steady-state lap (m/s).
    pub least_speed_mps: f64,
    /// The share of the envelope's grip that the car holds.
    pub grip_share: f64,
    /// Time of the driven lap (s).
    pub driven_s: f64,
    /// Time of the quasi-steady-state lap with all of the grip (s).
    pub full_grip_s: f64,
}

/// The corner that each section of a closed lap belongs to, and how many there are, by its speeds (m/s) and lateral accelerations
/// (m/s^2). Numbers begin at the greatest speed.
fn corners_of(v_mps: &[f64], ay_mps2: &[f64]) -> (Vec<usize>, usize) {
    let n = v_mps.len();
    let start = (0..n).max_by(|i, j| v_mps[*i].total_cmp(&v_mps[*j])).unwrap_or(0);
    let at = |step: usize| (start + step) % n;
    let bend_mps2 = LEAST_BEND * ay_mps2.iter().map(|ay| ay.abs()).fold(0.0, f64::max);
    let mut corner_of = vec![0; n];
    let (mut corner, mut rising) = (0, false);
    let (mut least, mut most) = (v_mps[start], 0);
    // The last bend, with the side that it turned to, and where the lap turned over last.
    let (mut bend, mut turned_over): (Option<(usize, f64)>, usize) = (None, 0);
    for step in 0..n {
        let (v, ay) = (v_mps[at(step)], ay_mps2[at(step)]);
        let mut begins = None;
        if step > 0 && ay * ay_mps2[at(step - 1)] <= 0.0 {
            turned_over = step;
        }
        if rising {
            if v > v_mps[at(most)] {
                most = step;
            }
            if v < v_mps[at(most)] - LEAST_DROP_MPS {
                begins = Some(most + 1);
                bend = bend.filter(|(last, _)| *last > most);
            }
        } else {
            least = least.min(v);
            if v > least + LEAST_DROP_MPS {
                (rising, most) = (true, step);
            }
        }
        if ay.abs() >= bend_mps2 && ay != 0.0 {
            if begins.is_none() && bend.is_some_and(|(_, side)| side * ay < 0.0) {
                begins = Some(turned_over);
            }
            bend = Some((step, ay.signum()));
        }
        if let Some(begins) = begins {
            corner += 1;
            (begins..step).for_each(|step| corner_of[at(step)] = corner);
            (rising, least) = (false, v);
        }
        corner_of[at(step)] = corner;
    }
    (corner_of, corner + 1)
}

/// A lap that was driven, where the car was lost, and its time (s) if it came round.
type Driven = (Drive, Option<Lost>, Option<f64>);

/// The plans of a line, each corner with a share of the grip of its own.
struct Corners<'a> {
    limits: &'a PointMass,
    /// Rising from the share that the whole lap holds.
    shares: Vec<f64>,
    tables: Vec<EnvelopeTable<f64>>,
    fine: FineLine,
    drs: Vec<bool>,
    corner_of: Vec<usize>,
    count: usize,
}

impl<'a> Corners<'a> {
    fn new(
        line: &NamedLine,
        limits: &'a PointMass,
        traction: &Traction,
        base: &DrivenLine,
        shares: &[f64],
    ) -> Result<Self> {
        let from = shares.iter().filter(|share| **share >= base.grip_share);
        let mut shares: Vec<f64> = from.copied().collect();
        shares.sort_by(f64::total_cmp);
        let table = |share: &f64| {
            let envelope = limits.envelope.with_grip_share(*share, traction)?;
            let limits = PointMass {
                envelope,
                ..limits.clone()
            };
            limits.table()
        };
        let tables = shares.iter().map(table).collect::<Result<_>>()?;
        let fine = FineLine::on(&line.points_m, line.relief.as_deref(), true, 1.0, None, 0.0)?;
        let (corner_of, count) = match &base.point_mass.lap {
            Some(lap) => corners_of(&lap.v_mps, &lap.ay_mps2),
            None => (vec![0; fine.points_m.len()], 1),
        };
        Ok(Self {
            drs: fine.drs_of(&line.drs),
            limits,
            shares,
            tables,
            fine,
            corner_of,
            count,
        })
    }

    /// The quasi-steady-state lap with a share of the grip in each corner, by their numbers among the shares.
    fn lap(&self, levels: &[usize]) -> Result<LapProfile> {
        let of: Vec<usize> = self.corner_of.iter().map(|corner| levels[*corner]).collect();
        let within = BySection {
            tables: &self.tables,
            of: &of,
        };
        self.fine.driven(self.limits, &within, 0.0, &self.drs)
    }

    /// The corner at a station (m).
    fn at(&self, station_m: f64) -> usize {
        let after = self.fine.station_m.partition_point(|s| *s <= station_m);
        self.corner_of[after.saturating_sub(1)]
    }

    /// The time (s) that a lap spends in each corner, from its time at each section of the line and at its end.
    fn times_s(&self, elapsed_s: &[f64], end_s: f64) -> Vec<f64> {
        let mut times = vec![0.0; self.count];
        for (i, corner) in self.corner_of.iter().enumerate() {
            times[*corner] += elapsed_s.get(i + 1).copied().unwrap_or(end_s) - elapsed_s[i];
        }
        times
    }

    /// The times (s) that a driven lap spends in each corner.
    fn driven_s(&self, drive: &Drive, lap_time_s: f64) -> Vec<f64> {
        let stations = &drive.station_m;
        let offset_s = stations
            .first()
            .zip(drive.states.first())
            .map_or(0.0, |(s, state)| s / state[0]);
        let at = |station_m: &f64| {
            let after = stations.partition_point(|s| s <= station_m);
            let Some(before) = after.checked_sub(1) else {
                return 0.0;
            };
            let speed = drive.states[before][0];
            (offset_s + before as f64 * INTERVAL_S + (station_m - stations[before]) / speed).min(lap_time_s)
        };
        let elapsed_s: Vec<f64> = self.fine.station_m.iter().map(at).collect();
        self.times_s(&elapsed_s, lap_time_s)
    }

    /// Start and end (m) of a corner.
    fn ends_m(&self, corner: usize) -> [f64; 2] {
        let n = self.corner_of.len();
        let is = |i: usize| self.corner_of[i % n] == corner;
        let start = (0..n).find(|i| is(*i) && !is(i + n - 1)).unwrap_or(0);
        let end = (0..n).find(|i| is(*i) && !is(i + 1)).unwrap_or(n - 1);
        [start, (end + 1) % n].map(|i| self.fine.station_m[i])
    }
}

/// Raises the share of the grip corner by corner from what `base` holds on the whole lap, and drives the fastest; nothing if the
/// observer ends it.
///
/// # Errors
/// Those of the drives, and of saving the state.
pub(super) fn raise(
    (car, limits, line): (&Car, &PointMass, &NamedLine),
    shares: &[f64],
    base: DrivenLine,
    state: &mut DriveState,
    state_file: &mut StateFile,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Option<DrivenLine>> {
    let traction = Traction::of(car, &limits.envelope);
    let corners = Corners::new(line, limits, &traction, &base, shares)?;
    let top = corners.shares.len() - 1;
    // Another build may have had other corners.
    let saved = state.corners.take();
    let saved = saved.filter(|saved| saved.levels.len() == corners.count);
    let mut found = saved.unwrap_or_else(|| CornerState {
        levels: vec![0; corners.count],
        frozen: vec![false; corners.count],
        best: vec![0; corners.count],
        best_s: base.lap_time_s,
        accepted: true,
        trial: 0,
        drives: 0,
    });
    let drive = |lap: &LapProfile| -> Result<Driven> {
        let plan = SpeedPlan::of_speeds(&lap.station_m, &lap.v_mps, corners.fine.length_m);
        let (driven, lost) = drive_until_lost(car, &line.circuit, plan, &base.driver, INTERVAL_S, None)?;
        let lap_time_s = driven.lap_time_s(line.circuit.length_m, INTERVAL_S);
        Ok((driven, lost, lap_time_s))
    };
    loop {
        if found.accepted {
            let rising: Vec<usize> = (0..corners.count)
                .filter(|c| !found.frozen[*c] && found.levels[*c] < top)
                .collect();
            if rising.is_empty() {
                break;
            }
            rising.into_iter().for_each(|corner| found.levels[corner] += 1);
            found.accepted = false;
        }
        let done = (state.tried + found.drives) as u64;
        let steps = top - found.levels.iter().copied().min().unwrap_or(top) + 1 + 2 * corners.count;
        let planned = done + steps as u64;
        if observe(&Progress::counted(done, planned)).is_break() {
            state.corners = Some(found);
            state_file.save(state)?;
            return Ok(None);
        }
        let lap = corners.lap(&found.levels)?;
        let (driven, lost, whole_s) = drive(&lap)?;
        found.drives += 1;
        let blamed = match (&lost, whole_s) {
            (Some(lost), _) => lowered_from(corners.at(lost.station_m), &found.levels),
            (None, Some(lap_time_s)) if !keeps_up(lap_time_s / lap.time_s - 1.0) => {
                let planned_s = corners.times_s(&lap.elapsed_s(), lap.time_s);
                let driven_s = corners.driven_s(&driven, lap_time_s);
                let behind = |c: &usize| driven_s[*c] / planned_s[*c] - 1.0;
                let raised = (0..corners.count).filter(|c| found.levels[*c] > 0);
                raised.max_by(|a, b| behind(a).total_cmp(&behind(b)))
            }
            (None, Some(lap_time_s)) => {
                if lap_time_s < found.best_s {
                    (found.best, found.best_s) = (found.levels.clone(), lap_time_s);
                }
                found.accepted = true;
                keep(state, &found, state_file);
                continue;
            }
            (None, None) => None,
        };
        match blamed {
            Some(corner) => {
                found.levels[corner] -= 1;
                found.frozen[corner] = true;
            }
            // No corner is left that takes more than the whole lap.
            None => {
                found.frozen.fill(true);
                found.accepted = true;
            }
        }
        keep(state, &found, state_file);
    }
    let held_s = |levels: &[usize]| -> Result<Option<f64>> {
        let lap = corners.lap(levels)?;
        let (_, lost, lap_time_s) = drive(&lap)?;
        Ok(lap_time_s.filter(|lap_time_s| lost.is_none() && keeps_up(lap_time_s / lap.time_s - 1.0)))
    };
    if !try_alone((&held_s, top), &mut found, state, state_file, observe)? {
        return Ok(None);
    }

    let lap = corners.lap(&found.best)?;
    let (driven, _, lap_time_s) = drive(&lap)?;
    let Some(lap_time_s) = lap_time_s else {
        return Err(Error::Study(
            "the fastest lap did not come round again".to_owned(),
        ));
    };
    let driven_s = corners.driven_s(&driven, lap_time_s);
    let road = line.relief.as_deref();
    let full = FineLine::on(&line.points_m, road, true, 1.0, Some((limits, &line.drs)), 0.0)?;
    let full_s = full.lap.as_ref().map_or_else(
        || vec![f64::NAN; corners.count],
        |lap| corners.times_s(&lap.elapsed_s(), lap.time_s),
    );
    let grip = (0..corners.count).map(|corner| {
        let [start_m, end_m] = corners.ends_m(corner);
        let within = corners
            .corner_of
            .iter()
            .zip(&lap.v_mps)
            .filter(|(of, _)| **of == corner);
        CornerGrip {
            start_m,
            end_m,
            least_speed_mps: within.map(|(_, v)| *v).fold(f64::INFINITY, f64::min),
            grip_share: corners.shares[found.best[corner]],
            driven_s: driven_s[corner],
            full_grip_s: full_s[corner],
        }
    });
    let corner_grip = grip.collect();
    let drives = found.drives;
    let mut fine = corners.fine;
    fine.lap = Some(lap);
    Ok(Some(DrivenLine {
        point_mass: fine,
        margin_m: driven.least_room_m(&line.circuit),
        drive: driven,
        lap_time_s,
        corners: corner_grip,
        full_grip_s: full.lap_time_s(),
        drives,
        ..base
    }))
}

/// Tries each corner alone a step lower, and then each a step higher, on the fastest lap so far. What is faster is taken, and tried a
/// step further. `held_s` is the time (s) of a lap on which the car holds its shares, and `top` the greatest of them. False if the
/// observer ends it.
fn try_alone(
    (held_s, top): (&(impl Fn(&[usize]) -> Result<Option<f64>> + Sync), usize),
    found: &mut CornerState,
    state: &mut DriveState,
    state_file: &mut StateFile,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<bool> {
    // A few at once. Those behind the first that is faster do not count, so that their number changes no result.
    let together = rayon::current_num_threads().max(2);
    let trials = 2 * found.best.len();
    while found.trial < trials {
        let done = (state.tried + found.drives) as u64;
        let planned = done + (trials - found.trial) as u64;
        if observe(&Progress::counted(done, planned)).is_break() {
            state.corners = Some(found.clone());
            state_file.save(state)?;
            return Ok(false);
        }
        let batch: Vec<(usize, Vec<usize>)> = (found.trial..trials)
            .filter_map(|number| Some((number, one_step(number, &found.best, top)?)))
            .take(together)
            .collect();
        let laps_s: Vec<Option<f64>> = batch
            .par_iter()
            .map(|(_, levels)| held_s(levels))
            .collect::<Result<_>>()?;
        let next = batch.last().map_or(trials, |(number, _)| number + 1);
        let faster =
            |(i, lap_s): (usize, &Option<f64>)| Some((i, lap_s.filter(|lap_s| *lap_s < found.best_s)?));
        let faster = laps_s.iter().enumerate().find_map(faster);
        found.drives += faster.map_or(batch.len(), |(i, _)| i + 1);
        match faster {
            Some((i, lap_s)) => {
                (found.trial, found.best) = batch[i].clone();
                found.best_s = lap_s;
            }
            None => found.trial = next,
        }
        keep(state, found, state_file);
    }
    Ok(true)
}

/// The trial of this number: the shares with one corner a step lower, or later a step higher. Nothing at the end of its shares.
fn one_step(number: usize, best: &[usize], top: usize) -> Option<Vec<usize>> {
    let corner = number % best.len();
    let mut levels = best.to_vec();
    levels[corner] = if number < best.len() {
        levels[corner].checked_sub(1)?
    } else {
        Some(levels[corner] + 1).filter(|level| *level <= top)?
    };
    Some(levels)
}

/// The corner that goes back by a step where a car is lost in one: itself, or the last before it that takes more than the whole lap.
fn lowered_from(corner: usize, levels: &[usize]) -> Option<usize> {
    let n = levels.len();
    (0..n)
        .map(|back| (corner + n - back) % n)
        .find(|c| levels[*c] > 0)
}

fn keep(state: &mut DriveState, found: &CornerState, state_file: &mut StateFile) {
    state.corners = Some(found.clone());
    if state_file.due() {
        state_file.save_or_warn(state);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::transient::TransientSettings;

    /// Three straights of 60, 50 and 40 m/s: a dip of 2 m/s on the first is no corner. Numbers begin at the greatest speed, and the
    /// last corner passes the start line.
    #[test]
    fn corners_lie_between_the_greatest_speeds() {
        let ends = [30.0, 50.0, 20.0, 40.0, 25.0, 58.0, 56.0, 60.0];
        let mut v = Vec::new();
        for pair in ends.windows(2) {
            v.extend((0..10).map(|i| pair[0] + (pair[1] - pair[0]) * f64::from(i) / 10.0));
        }
        // From the end back to the start, braking.
        v.extend((0..10).map(|i| 60.0 - 3.0 * f64::from(i)));
        let straight = vec![0.0; v.len()];
        let (corner_of, count) = corners_of(&v, &straight);
        assert_eq!(count, 3);
        assert_eq!((corner_of[70], corner_of[0], corner_of[9]), (0, 0, 0));
        // A greatest speed is the end of the corner before it.
        assert_eq!((corner_of[10], corner_of[11]), (0, 1));
        assert_eq!((corner_of[30], corner_of[31], corner_of[69]), (1, 2, 2));
    }

    /// At one speed: right, left, a kink to the right that is no bend, left again, and right. The straight between belongs to the
    /// bend before it.
    #[test]
    fn corners_end_where_the_lap_turns_over() {
        let bends = [-9.0, 10.0, -2.0, 8.0, 0.0, -6.0];
        let ay: Vec<f64> = bends.iter().flat_map(|ay| [*ay; 10]).collect();
        let (corner_of, count) = corners_of(&[50.0; 60], &ay);
        assert_eq!(count, 3);
        // The greatest of equal speeds is the last.
        let first = [corner_of[59], corner_of[0], corner_of[9]];
        assert_eq!(first, [0; 3]);
        assert_eq!((corner_of[10], corner_of[39]), (1, 1));
        assert_eq!((corner_of[50], corner_of[58]), (2, 2));
    }

    #[test]
    fn each_corner_is_tried_lower_and_then_higher() {
        let trials: Vec<_> = (0..6).map(|number| one_step(number, &[1, 0, 3], 3)).collect();
        let tried = [[0, 0, 3], [1, 0, 2], [2, 0, 3], [1, 1, 3]].map(|levels| Some(levels.to_vec()));
        let [first, third, fourth, fifth] = tried;
        assert_eq!(trials, [first, None, third, fourth, fifth, None]);
    }

    /// The first corner is driven fastest two steps lower, the second two steps higher, of which it holds one, and the third as it is.
    /// Seven laps tell, however many are driven at once.
    #[test]
    fn what_is_faster_alone_is_taken_and_tried_further() {
        let off = |level: usize, best: usize| (level as f64 - best as f64).powi(2);
        let held_s = |levels: &[usize]| {
            let lap_s = 100.0 + off(levels[0], 1) + off(levels[1], 2) + off(levels[2], 0);
            Ok(Some(lap_s).filter(|_| levels[1] < 2))
        };
        let mut found = CornerState {
            levels: vec![3, 0, 0],
            frozen: vec![true; 3],
            best: vec![3, 0, 0],
            best_s: 108.0,
            accepted: true,
            trial: 0,
            drives: 0,
        };
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut state = DriveState::new(TransientSettings::default());
        let mut state_file = StateFile::at(folder.path().join("checkpoint.bin"));
        let mut observe = |_: &Progress| ControlFlow::Continue(());
        let ended = try_alone(
            (&held_s, 3),
            &mut found,
            &mut state,
            &mut state_file,
            &mut observe,
        );
        assert!(ended.expect("trials"));
        assert_eq!(
            (found.best, found.best_s, found.drives),
            (vec![1, 1, 0], 101.0, 7)
        );
    }

    #[test]
    fn a_car_that_is_lost_lowers_the_corner_or_the_one_before() {
        assert_eq!(lowered_from(2, &[1, 0, 3, 0]), Some(2));
        assert_eq!(lowered_from(1, &[1, 0, 3, 0]), Some(0));
        assert_eq!(lowered_from(0, &[0, 0, 3, 0]), Some(2));
        assert_eq!(lowered_from(0, &[0, 0, 0, 0]), None);
    }
}
